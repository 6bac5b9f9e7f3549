"""Phases as letters, as rows of a matrix and as a bit mask."""

from __future__ import annotations

from .parts import Regulator

__all__ = ["conductors", "letters", "phase_mask", "phase_rows"]


def phase_rows(phases: str) -> list[int]:
    """Rows of the phases, in their order: ``"ca"`` is ``[2, 0]``."""
    return ["abc".index(phase) for phase in phases]


def phase_mask(phases: str) -> int:
    """Bit mask of the phases, bit 0 for a."""
    return sum(1 << row for row in phase_rows(phases))


def letters(mask: int) -> str:
    """The phases of a bit mask: ``5`` is ``"ac"``."""
    return "".join(phase for row, phase in enumerate("abc") if mask >> row & 1)


def conductors(regulator: Regulator) -> str:
    """The phases that go through: its units', and the one that those of an open delta refer to."""
    through = regulator.reference in "abc" and regulator.reference not in regulator.phases
    return regulator.phases + regulator.reference if through else regulator.phases
