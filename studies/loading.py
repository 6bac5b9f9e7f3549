"""The feeder that a command names, with measuring points."""

from __future__ import annotations

from ..model.parts import Feeder
from ..model.reading.feeder_file import load_feeder
from ..model.spread import spread_points

__all__ = ["load_with_points"]


def load_with_points(name: str) -> tuple[Feeder, tuple[str, ...]]:
    """Return the feeder, and what to tell of the points it was given because it had none.

    Raises
    ------
    InputError
        If there is no such feeder, or with every fault of its file.
    """
    spread = spread_points(load_feeder(name))
    return spread.feeder, spread.said
