"""The pictures of ``openphase paper``: drawn so that one can lay them beside the paper's."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ..paper.courses import Panel, Trace
from .figures import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    axes_or_new,
    house_style,
    save_png,
)

__all__ = ["paper_pictures", "plot_panel"]

COLOURS = (BLUE, ORANGE, GREEN, PURPLE)
WIDE, HIGH = 5.4, 3.7  #: inches of one panel


def paper_pictures(panels: Mapping[str, tuple[Panel, ...]]) -> Iterator[tuple[str, bytes]]:
    """File name and PNG of every picture."""
    for name, own in panels.items():
        buffer = io.BytesIO()
        save_png(_figure(own), buffer)
        yield f"{name}.png", buffer.getvalue()


@house_style()
def _figure(panels: tuple[Panel, ...]) -> Figure:
    columns = min(len(panels), 2)
    rows = -(-len(panels) // columns)
    wide = WIDE * columns if columns > 1 else 1.4 * WIDE
    figure = Figure(figsize=(wide, HIGH * rows + 0.3), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).flat
    for panel, ax in zip(panels, axes, strict=True):
        plot_panel(panel, ax)
    figure.supxlabel(
        "steady states before and after the event, stepped: transients are not modelled",
        fontsize=8,
        color=GREY,
    )
    return figure


@house_style()
def plot_panel(panel: Panel, ax: Axes | None = None) -> Axes:
    """Draw curves, their values in the legend; the paper's values; thresholds; ΔT shaded."""
    ax = axes_or_new(ax, 1.4 * WIDE, HIGH)
    handles = []
    for n, trace in enumerate(panel.traces):
        handles += ax.plot(
            trace.x,
            trace.y,
            color=COLOURS[n % len(COLOURS)],
            # curves that lie on each other stay visible
            lw=(3.4, 1.4)[n % 2] if panel.window_s else 1.5,
            label=_label(trace, with_value=panel.window_s is not None),
        )
    for value in panel.printed:
        ax.axhline(value, color="black", lw=0.9, ls=":")
    if panel.printed:
        values = " / ".join(f"{value:g}" for value in panel.printed)
        handles.append(Line2D([], [], color="black", lw=0.9, ls=":", label=f"paper: {values}"))
    for words, value in panel.thresholds:
        handles.append(ax.axhline(value, color=RED, lw=0.9, ls="--", label=words))
    if panel.window_s:
        _over_the_window(ax, panel, panel.window_s)
    if panel.log:
        ax.set_yscale("log")
        _decades(ax.yaxis)
    if panel.log and not panel.window_s:
        ax.set_xscale("log")
        _decades(ax.xaxis)
    ax.grid(True)
    ax.set(xlabel=panel.x_label, ylabel=panel.y_label)
    ax.set_title(panel.title, fontsize=9.5)
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2, fontsize=8)
    return ax


def _label(trace: Trace, *, with_value: bool) -> str:
    value = f": {np.nanmax(trace.y):.4g}" if with_value else ""
    return f"{trace.label}{value}{f' ({trace.basis})' if trace.basis else ''}"


def _over_the_window(ax: Axes, panel: Panel, window_s: tuple[float, float]) -> None:
    """Shade ΔT; magnitudes start at zero."""
    start, stop = window_s
    margin = 0.3 * (stop - start)
    ax.axvspan(start, stop, facecolor="#f1f4f8", lw=0, zorder=0)
    ax.set_xlim(start - margin, stop + margin)
    heights = [float(np.nanmax(trace.y)) for trace in panel.traces]
    if panel.log:
        ax.set_ylim(min(heights) / 2.0, max(heights) * 2.0)
    else:
        ax.set_ylim(0.0, 1.15 * max(*heights, *panel.printed, *(v for _, v in panel.thresholds)))


def _decades(axis: Axis) -> None:
    """Ticks at 1, 2 and 5, written out."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axis.set_minor_formatter(NullFormatter())
