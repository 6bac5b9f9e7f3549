"""Pictures of a run: each takes data and draws it; none computes, and none opens a window."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, PercentFormatter
from numpy.typing import NDArray

from .figures import (
    BLUE,
    BROWN,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    TALLEST,
    YELLOW,
    axes_or_new,
    house_style,
    png_of,
    save_figure,
    save_png,
)
from .sheet import setting_text
from .views import Bar, Cloud, EvidenceView, Family, OverviewView, ProfileView, Setting

__all__ = [
    "plot_evidence",
    "plot_overview",
    "plot_profile",
    "png_of",
    "save_figure",
    "save_png",
]

Real = NDArray[np.float64]

FAMILIES: dict[Family, tuple[str, str]] = {
    Family.INSIDE: (BLUE, "o"),
    Family.OUTSIDE: (PURPLE, "v"),
    Family.LOAD: (ORANGE, "s"),
    Family.SOURCE: (GREEN, "D"),
    Family.FAULT: (RED, "^"),
    Family.SWITCHING: ("black", "p"),
    Family.DER: (BROWN, "h"),
    Family.PAIR: (GREY, "X"),
}
"""Colour and marker of each family of classes."""

PHASES, FALSE = "found by the phases that stand in below I_set", "false trip of this setting"
RINGS = {PHASES: "black", FALSE: "#c00000"}
"""Colour of the rings around what trips otherwise than the picture's axes tell, or falsely."""


# ---- evidence ----


@house_style()
def plot_evidence(view: EvidenceView, ax: Axes | None = None) -> Axes:
    """Draw a terminal's events in the plane of |ΔI1| and |Z1|, and the settings among them."""
    ax = axes_or_new(ax, 8.6, 7.6)
    low = np.array([view.limits_a[0], view.limits_ohm[0]])
    high = np.array([view.limits_a[1], view.limits_ohm[1]])
    ax.set(xscale="log", yscale="log", xlim=view.limits_a, ylim=view.limits_ohm)
    handles = [_draw_cloud(ax, cloud, low, high) for cloud in view.clouds]
    handles = handles[-1:] + handles[:-1]  # what must trip is drawn last and named first
    if view.chosen is not None:
        handles += _draw_trips(ax, view, view.chosen, low, high)
    handles += _draw_borders(ax, view)
    handles += _draw_settings(ax, view)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    ax.grid(True)
    ax.set_xlabel("|ΔI1| and I_set [A]")
    ax.set_ylabel("|Z1| and Z_set [Ω]")
    ax.set_title(
        f"{view.terminal}: a sample of the validation events, judged at V_set "
        f"{_percent(view.v_set_pu)}\nfull colour: by its positive sequence, trips every setting "
        "to its lower left; faint: cannot trip; on the frame: beyond",
        fontsize=9,
    )
    ax.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.09), ncols=2, fontsize=8.2
    )
    return ax


def _inside(cloud: Cloud, low: Real, high: Real) -> tuple[Real, Real]:
    """A cloud's events, those beyond the frame moved onto it."""
    x = np.clip(cloud.di1_a, low[0] * 1.04, high[0] / 1.04)
    return x, np.clip(cloud.z1_ohm, low[1] * 1.05, high[1] / 1.05)


def _draw_cloud(ax: Axes, cloud: Cloud, low: Real, high: Real) -> Line2D | Patch:
    """Draw one family; what cannot trip is faint and hollow. Returns its legend entry."""
    colour, marker = FAMILIES[cloud.family]
    must_trip = cloud.family == Family.INSIDE
    size = 24 if must_trip else 13
    x, y = _inside(cloud, low, high)
    unable = ~cloud.able
    ax.scatter(
        x[unable],
        y[unable],
        s=size,
        marker=marker,
        facecolors="none",
        edgecolors=colour,
        linewidths=0.6,
        alpha=0.35 if must_trip else 0.22,
        zorder=2,
    )
    ax.scatter(
        x[cloud.able],
        y[cloud.able],
        s=size,
        marker=marker,
        color=colour,
        edgecolors="white",
        linewidths=0.3,
        alpha=0.9,
        zorder=4 if must_trip else 3,
    )
    able = int(cloud.able.sum())
    return Line2D(
        [],
        [],
        ls="",
        marker=marker,
        color=colour,
        markersize=5,
        label=f"{cloud.family} ({able:,} of {x.size:,} shown can trip)",
    )


def _draw_trips(
    ax: Axes, view: EvidenceView, own: Setting, low: Real, high: Real
) -> list[Line2D | Patch]:
    """Ring what the setting trips by its phases, and what it trips falsely."""
    rings: dict[str, list[tuple[Real, Real]]] = {PHASES: [], FALSE: []}
    for cloud in view.clouds:
        x, y = _inside(cloud, low, high)
        if cloud.family == Family.INSIDE:
            # the phases stand in only where the positive sequence stays below I_set
            kind, ringed = PHASES, cloud.trips & (cloud.di1_a < own.i_set_a)
        else:
            kind, ringed = FALSE, cloud.trips
        rings[kind].append((x[ringed], y[ringed]))
    handles: list[Line2D | Patch] = []
    for text, parts in rings.items():
        if not sum(own.size for own, _ in parts):
            continue
        x = np.concatenate([own for own, _ in parts])
        y = np.concatenate([own for _, own in parts])
        look: dict[str, Any] = {"marker": "o", "mec": RINGS[text], "mfc": "none", "mew": 1.1}
        ax.plot(x, y, ls="", ms=8, zorder=6, **look)
        handles.append(Line2D([], [], ls="", ms=8, label=f"{text} ({x.size:,} shown)", **look))
    return handles


def _draw_borders(ax: Axes, view: EvidenceView) -> list[Line2D | Patch]:
    """Draw the staircase of the training sample, as it is and with the demanded margin."""
    if view.border is None or view.margin_border is None:
        return []
    floor = view.limits_a[0], view.limits_ohm[0]
    x, y = (np.maximum(own, low) for own, low in zip(view.border, floor, strict=True))
    ax.fill_between(x, y, floor[1], color="#d9b38c", alpha=0.28, lw=0, zorder=1)
    ax.plot(x, y, color="#5b3a1a", lw=1.3, zorder=5)
    mx, my = (np.maximum(own, low) for own, low in zip(view.margin_border, floor, strict=True))
    ax.plot(mx, my, color="#5b3a1a", lw=1.1, ls=(0, (4, 2)), zorder=5)
    return [
        Patch(
            facecolor="#f3e6d9",
            edgecolor="#5b3a1a",
            label="settings that trip falsely in the training sample",
        ),
        Line2D(
            [],
            [],
            color="#5b3a1a",
            lw=1.1,
            ls=(0, (4, 2)),
            label=f"border at margin {view.margin:g}",
        ),
    ]


def _draw_settings(ax: Axes, view: EvidenceView) -> list[Line2D | Patch]:
    """Draw the chosen setting with what it trips, the reference, and the device's range."""
    handles: list[Line2D | Patch] = []
    right, top = view.limits_a[1], view.limits_ohm[1]
    if view.chosen is not None:
        own = view.chosen
        ax.fill_between(
            [own.i_set_a, right], own.z_set_ohm, top, color=SKY, alpha=0.13, lw=0, zorder=0.5
        )
        ax.plot(
            [own.i_set_a, own.i_set_a, right],
            [top, own.z_set_ohm, own.z_set_ohm],
            color=BLUE,
            lw=0.9,
            zorder=5,
        )
        label = f"{view.word}: {_settings(own)}, and what it trips"
        handles += ax.plot(
            own.i_set_a,
            own.z_set_ohm,
            ls="",
            marker="P",
            color="black",
            markeredgecolor="white",
            markersize=11,
            zorder=7,
            label=label,
        )
    own = view.reference
    handles += ax.plot(
        own.i_set_a,
        own.z_set_ohm,
        ls="",
        marker="X",
        color=YELLOW,
        markeredgecolor="black",
        markersize=10,
        zorder=6,
        label=f"reference: {_settings(own)}",
    )
    if view.window_ohm is not None:
        text = "window of Z_set in the closed loop"
        ax.axhspan(*view.window_ohm, color=GREEN, alpha=0.22, lw=0, zorder=0.6)
        handles.append(Patch(color=GREEN, alpha=0.22, label=text))
    (x0, x1), (y0, y1) = view.device_a, view.device_ohm
    handles += ax.plot(
        [x0, x1, x1, x0, x0],
        [y0, y0, y1, y1, y0],
        color=GREY,
        lw=0.8,
        ls=":",
        zorder=1.5,
        label="range of the device",
    )
    return handles


# ---- dependability ----


@house_style()
def plot_profile(view: ProfileView, ax: Axes | None = None) -> Axes:
    """Draw the share of breaks that a terminal finds, along its section."""
    ax = axes_or_new(ax, 8.6, 3.9)
    x = view.edges_km
    ax.stairs(view.high, x, baseline=view.low, fill=True, color=SKY, alpha=0.4, lw=0)
    ax.stairs(view.share, x, baseline=None, color=BLUE, lw=1.6)
    for start, stop in view.blind_km:
        ax.axvspan(start, stop, facecolor="#ededed", lw=0, zorder=0)
    for km, text in view.tees:
        ax.plot([km, km], [1.03, 1.1], color=GREY, lw=1.0, clip_on=False)
        ax.text(km, 1.12, text, ha="center", va="bottom", fontsize=8, color="#444444")
    ax.set(xlim=(x[0], x[-1]), ylim=(0.0, 1.03))
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    ax.grid(True)
    ax.set_xlabel(f"distance of the break from {view.local}, towards {view.remote} [km]")
    ax.set_ylabel("found, of all breaks there")
    ax.set_title(
        f"{view.terminal}: where breaks are found; {view.found:,} of all {view.breaks:,} internal "
        "breaks, blind ends included",
        fontsize=9.5,
        pad=30 if view.tees else 8,
    )
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=BLUE, lw=1.6, label="share found"),
        Patch(color=SKY, alpha=0.4, label=f"{view.confidence:.0%} interval of each stretch"),
    ]
    if view.blind_km:
        handles.append(Patch(facecolor="#ededed", label="nothing connected beyond: cannot be seen"))
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3)
    return ax


OVERVIEW = ((BLUE, ""), (SKY, ""), ("#bdbdbd", "///"))  #: colour and hatch of each setting


@house_style()
def plot_overview(view: OverviewView, ax: Axes | None = None) -> Axes:
    """Draw the dependability of the compared settings of every judged terminal."""
    row_height = 0.2 + 0.25 * len(view.names)
    ax = axes_or_new(ax, 8.6, 1.5 + min(row_height * len(view.terminals), TALLEST))
    step = 0.25 / row_height
    for t, bars in enumerate(view.bars):
        for n, bar in enumerate(bars):
            _draw_bar(ax, t + step * (n - (len(bars) - 1) / 2), bar, n, 0.9 * step)
    ax.set_yticks(range(len(view.terminals)), view.terminals)
    ax.set(xlim=(0.0, 1.0), ylim=(len(view.terminals) - 0.5, -0.5))
    ax.tick_params(axis="y", length=0)
    ax.xaxis.set_major_formatter(PercentFormatter(1.0))
    ax.grid(True, axis="x")
    ax.set_xlabel("dependability: breaks found, of those with something connected beyond")
    ax.set_title("Breaks found, with intervals; right of each bar its false trips, k of n events")
    handles = [
        Patch(facecolor=colour, edgecolor="white", hatch=hatch, label=name)
        for name, (colour, hatch) in zip(view.names, OVERVIEW, strict=False)
    ]
    below = -0.55 / (row_height * len(view.terminals))
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, below), ncols=3)
    return ax


def _draw_bar(ax: Axes, y: float, bar: Bar, n: int, height: float) -> None:
    colour, hatch = OVERVIEW[n]
    if bar.share is None:
        why = bar.reason or "no break to find"
        ax.text(0.01, y, why, va="center", fontsize=8, color="#444444")
        return
    ax.barh(y, bar.share, height, color=colour, edgecolor="white", hatch=hatch, lw=0)
    ax.plot([bar.low, bar.high], [y, y], color="black", lw=1.4, solid_capstyle="butt")
    bad = bar.false_trips > 0
    ax.text(
        bar.high + 0.012,
        y,
        f"{bar.false_trips:,} of {bar.trials:,}",
        va="center",
        fontsize=8,
        color="#a33b00" if bad else "#444444",
        weight="bold" if bad else "normal",
        clip_on=False,
    )


def _settings(own: Setting) -> str:
    i_set, z_set = setting_text(own.i_set_a), setting_text(own.z_set_ohm)
    return f"{i_set} A, {_percent(own.v_set_pu)}, {z_set} Ω"


def _percent(pu: float) -> str:
    return f"{setting_text(pu * 100)} %"
