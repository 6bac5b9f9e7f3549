"""Series reactors, which a feeder has as lines of no length to speak of."""

from __future__ import annotations

from .parts import Feeder, Line

__all__ = ["REACTOR", "is_reactor"]

REACTOR = "reactor."
"""What an import puts before the name of a series reactor, to make that of its line."""


def is_reactor(feeder: Feeder, line: Line) -> bool:
    """Tell whether a line is an imported series reactor: no measuring point stands on one."""
    return feeder.imported_from is not None and line.name.startswith(REACTOR)
