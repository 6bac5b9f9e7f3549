"""Figures: the project's style, and saving so that equal data give equal bytes.

No pyplot: a figure belongs to whoever made it, and no window opens.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, TypeVar

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

__all__ = [
    "BLUE",
    "BROWN",
    "DPI",
    "GREEN",
    "GREY",
    "ORANGE",
    "PURPLE",
    "RED",
    "SKY",
    "TALLEST",
    "YELLOW",
    "axes_or_new",
    "house_style",
    "png_of",
    "save_figure",
    "save_png",
]

T = TypeVar("T")

DPI = 120
# Okabe and Ito's colours, which the colour-blind tell apart
BLUE, ORANGE, GREEN, RED, PURPLE = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7"
SKY, YELLOW, GREY, BROWN = "#56B4E9", "#F0E442", "#777777", "#6b4c00"

TALLEST = 100.0  #: inches that rows of a picture may take

STYLE: Any = {
    "font.family": "DejaVu Sans",  # ships with matplotlib
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "svg.hashsalt": "openphase",
    "text.parse_math": False,  # a name may hold a dollar sign
}


@contextmanager
def house_style() -> Iterator[None]:
    """Draw in the project's style, whatever the user's matplotlibrc says; also a decorator."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)
        yield


def save_png(figure: Figure | SubFigure | None, target: Path | IO[bytes]) -> None:
    """Write a figure as PNG: equal figures give equal bytes."""
    _save(figure, target, "png", {"Software": None})


def save_figure(figure: Figure | SubFigure | None, path: Path) -> None:
    """Write a figure as PNG or SVG, as the file's name says.

    Raises ValueError for any other ending.
    """
    if path.suffix.lower() == ".svg":
        _save(figure, path, "svg", {"Date": None, "Creator": None})
    elif path.suffix.lower() == ".png":
        save_png(figure, path)
    else:
        raise ValueError(f"must end in .png or .svg, got '{path.suffix}'")


def _save(
    figure: Figure | SubFigure | None,
    target: Path | IO[bytes],
    form: str,
    metadata: dict[str, str | None],
) -> None:
    if not isinstance(figure, Figure):
        raise TypeError(f"must be a whole figure, got {type(figure).__name__}")
    with house_style():
        figure.savefig(target, format=form, dpi=DPI, metadata=metadata, facecolor="white")


def png_of(plot: Callable[[T], Axes], data: T) -> bytes:
    """The picture that ``plot`` makes of ``data``."""
    buffer = io.BytesIO()
    save_png(plot(data).get_figure(), buffer)
    return buffer.getvalue()


def axes_or_new(ax: Axes | None, width: float, height: float) -> Axes:
    """``ax``, or the axes of a new figure of this size in inches."""
    if ax is not None:
        return ax
    return Figure(figsize=(width, height), layout="constrained").add_subplot()
