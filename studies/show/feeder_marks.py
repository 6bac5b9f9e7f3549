"""Marks and names in the picture of a feeder."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from .feeder_places import Spot

__all__ = ["ABOVE", "BELOW", "BUS", "PART", "Letters", "Mark", "along", "draw_mark", "write"]

LARGEST = 8.0  #: points, of a mark in the legend


@dataclass(frozen=True, slots=True, kw_only=True)
class Letters:
    """How a name is written: size, and shift from its spot, in points."""

    size: float
    shift: tuple[float, float]
    colour: str = "black"
    weight: str = "normal"
    level: float = 8.0  #: the higher, the farther in front


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """How something that stands at a spot is drawn: a matplotlib marker, in points."""

    shape: str
    size: float
    face: str
    name: str = ""
    width: float = 0.9


BUS = Letters(size=6.0, shift=(2, -6), colour="#666666", level=7.0)
PART = Letters(size=6.5, shift=(5, 4))
ABOVE = Letters(size=9.5, shift=(-4, 8), weight="bold", level=9.0)
BELOW = Letters(size=9.5, shift=(-4, -16), weight="bold", level=9.0)


def draw_mark(ax: Axes, spots: Sequence[Spot], mark: Mark) -> Line2D:
    """Draw marks, and return one for the legend."""
    look: dict[str, Any] = {
        "marker": mark.shape,
        "markerfacecolor": mark.face,
        "markeredgecolor": "black",
        "markeredgewidth": min(mark.width, mark.size / 5.0),
        "linestyle": "",
    }
    xs, ys = zip(*spots, strict=True)
    ax.add_line(Line2D(xs, ys, markersize=mark.size, zorder=6, **look))
    return Line2D([], [], markersize=min(mark.size, LARGEST), label=mark.name, **look)


def write(ax: Axes, spot: Spot, text: str, letters: Letters) -> None:
    """Write a name beside a spot, readable on any line."""
    ax.annotate(
        text,
        spot,
        xytext=letters.shift,
        textcoords="offset points",
        fontsize=letters.size,
        color=letters.colour,
        weight=letters.weight,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],
        zorder=letters.level,
    )


def along(way: Sequence[Spot], share: float) -> Spot:
    """Return the spot at a share of a way's length.

    Examples
    --------
    >>> along([(0.0, 0.0), (0.0, 1.0), (3.0, 1.0)], 0.5)
    (1.0, 1.0)
    """
    lengths = [math.dist(a, b) for a, b in pairwise(way)]
    left = share * sum(lengths)
    for (a, b), length in zip(pairwise(way), lengths, strict=True):
        if length and left <= length:
            part = left / length
            return a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])
        left -= length
    return way[-1]
