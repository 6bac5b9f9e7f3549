"""The schematic of a feeder."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from ...model.parts import Feeder, Line, Switch
from ...model.zones import outwards
from .feeder_layout import FeederLayout, Mark, Tie, lay_out
from .feeder_map import plot_feeder_map
from .feeder_places import has_coordinates
from .figures import BLUE, GREEN, ORANGE, PURPLE, RED, SKY, TALLEST, axes_or_new, house_style

__all__ = ["plot_feeder"]

SECTION_COLOURS = (BLUE, ORANGE, GREEN, RED, PURPLE, SKY)
MOST_ROWS = 40  #: of a schematic
CROWDED = 24  #: units beyond which a schematic shows their names only


@house_style()
def plot_feeder(feeder: Feeder, ax: Axes | None = None) -> Axes:
    """Draw a feeder.

    A plain small one is a schematic: km from the source, one row for each branch, and a label
    for all that stands there. One with coordinates, laterals, in-line transformers, closed loops
    or many branches is drawn by `feeder_map`.
    """
    layout = lay_out(feeder) if _is_plain(feeder) else None
    if layout is None or layout.rows > MOST_ROWS:
        return plot_feeder_map(feeder, ax)
    crowded = len(layout.units) > CROWDED
    row_height = 0.7 if crowded else 1.35
    ax = axes_or_new(ax, 11.0, 1.6 + min(row_height * layout.rows, TALLEST))
    _draw_wires(ax, layout)
    for tie in layout.ties:
        _draw_tie(ax, tie, layout.reach_km)
    for unit in layout.units:
        _draw_unit(ax, unit, crowded)
    for point in layout.points:
        ax.plot(
            point.km,
            point.row,
            "o",
            color="white",
            markeredgecolor="black",
            ms=8,
            mew=1.4,
            zorder=5,
        )
        _write(ax, point, point.text, below=True, size=9.5, weight="bold")
    ax.plot(0, 0, "s", color="black", ms=11, zorder=4)
    source = Mark(text=layout.source, km=0.0, row=0)
    _write(ax, source, layout.source, below=False, size=9.0, weight="normal")
    ax.set(xlim=(-0.04 * layout.reach_km, 1.09 * layout.reach_km), ylim=(layout.rows - 0.45, -0.75))
    ax.set_yticks([])
    ax.spines["left"].set_visible(False)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_xlabel("distance from the source along the line [km]")
    ax.set_title(f"{layout.name}: {len(feeder.lines)} lines, {len(feeder.points)} measuring points")
    handles = _legend(layout)
    ax.legend(
        handles=handles,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.42 / (row_height * layout.rows)),
        ncols=4,
    )
    return ax


def _is_plain(feeder: Feeder) -> bool:
    """Whether it is a tree of three-phase parts, without coordinates."""
    closed = [switch for switch in feeder.switches if switch.closed]
    edges = len(feeder.lines) + len(closed) + len(feeder.regulators)
    parts: list[Line | Switch] = [*feeder.lines, *closed]
    three = all(len(part.phases) == 3 for part in parts)
    radial = edges == len(outwards(feeder)) - 1
    return three and radial and not feeder.inline_transformers and not has_coordinates(feeder)


def _legend(layout: FeederLayout) -> list[Line2D]:
    """An entry for everything that is drawn, and for nothing else."""
    handles = [
        Line2D([], [], color=SECTION_COLOURS[n % 6], lw=4, label=f"section {name}")
        for n, name in enumerate(layout.sections)
    ]
    ring = Line2D([], [], ls="", marker="o", color="white", mec="black", ms=7)
    unit = Line2D([], [], ls="", marker="^", color="black", ms=6)
    joint = Line2D([], [], ls="", marker="s", color="black", ms=6)
    tie = Line2D([], [], ls="--", marker="s", color="black", mfc="white", ms=7)
    said = (
        (ring, "measuring point" if layout.points else ""),
        (unit, " or ".join(filter(None, [", ".join(layout.kinds[:-1]), *layout.kinds[-1:]]))),
        (joint, " or ".join(layout.joints)),
        (tie, "open switch" if layout.ties else ""),
    )
    for handle, text in said:
        if text:
            handle.set_label(text)
            handles.append(handle)
    return handles


def _draw_wires(ax: Axes, layout: FeederLayout) -> None:
    for wire in layout.wires:
        x, y = [wire.start_km, wire.stop_km], [wire.row, wire.row]
        ax.plot([x[0], x[0]], [wire.from_row, wire.row], color="black", lw=1.2, zorder=0.9)
        if not wire.is_line:
            ax.plot(wire.stop_km, wire.row, "s", color="black", ms=6, zorder=3)
            continue
        if not wire.sections:
            ax.plot(x, y, color="#999999", lw=2.0, zorder=1)
        # sections that share a line lie on top of each other, the later the thinner
        for n, section in enumerate(wire.sections):
            colour = SECTION_COLOURS[section % len(SECTION_COLOURS)]
            width = 5.0 * (1.0 - n / len(wire.sections))
            ax.plot(x, y, color=colour, lw=width, solid_capstyle="butt", zorder=1 + 0.01 * n)


def _draw_tie(ax: Axes, tie: Tie, reach_km: float) -> None:
    (x0, y0), (x1, y1) = tie.ends
    if tie.at_row_ends:
        aside = max(x0, x1) + 0.03 * reach_km
        x, y, middle = [x0, aside, aside, x1], [y0, y0, y1, y1], aside
    else:
        x, y, middle = [x0, x1], [y0, y1], (x0 + x1) / 2
    ax.plot(x, y, color="black", lw=1.1, ls="--", zorder=0.5)
    ax.plot(middle, (y0 + y1) / 2, "s", color="white", mec="black", ms=9, zorder=3)
    ax.annotate(
        f"{tie.name}\nopen",
        (middle, (y0 + y1) / 2),
        xytext=(9, 0),
        textcoords="offset points",
        va="center",
        fontsize=8.5,
    )


def _draw_unit(ax: Axes, unit: Mark, crowded: bool) -> None:
    tip = unit.row - (0.12 if crowded else 0.2)
    ax.plot([unit.km, unit.km], [unit.row, tip], color="black", lw=1.0, zorder=0.8)
    ax.plot(unit.km, tip, "^", color="black", ms=4 if crowded else 6, zorder=3)
    text = unit.text.partition("\n")[0] if crowded else unit.text
    ax.annotate(
        text,
        (unit.km, tip),
        xytext=(0, 5),
        textcoords="offset points",
        ha="center",
        va="bottom",
        fontsize=6 if crowded else 8.5,
        rotation=90 if crowded else 0,
        linespacing=1.15,
    )


def _write(ax: Axes, at: Mark, text: str, *, below: bool, size: float, weight: str) -> None:
    ax.annotate(
        text,
        (at.km, at.row),
        xytext=(0, -9 if below else 9),
        textcoords="offset points",
        ha="center",
        va="top" if below else "bottom",
        fontsize=size,
        weight=weight,
    )
