"""Which equivalent stands for the folded part of each root: the first that is near enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .equivalent import Equivalent, Kind, SeenLoad, equivalent_of, seen_through

__all__ = ["ENDS", "Choice", "SeenRoot", "best_equivalent"]

Complex = NDArray[np.complex128]

ENDS = (0.25, 1.0)
"""Levels at which equivalents are compared."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """How equivalents are chosen, as ``fold`` was told."""

    kinds: Sequence[Kind]
    within: float
    level: float

    def kinds_for(self, km: float) -> list[Kind]:
        """What may stand for the folded part: length stays length, where there is any."""
        useless = ("units", "bus") if km > 0.0 else ("both",)
        return [kind for kind in self.kinds if kind not in useless] or ["bus"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeenRoot:
    """What a root sees of what hangs on it, (3, 3) each, and the loads there."""

    whole_s: Complex  #: at the level of the fold
    bare_s: Complex  #: without loads
    ends_s: Sequence[Complex]  #: at ``ENDS``, loads as linear as they are at the level
    loads: Sequence[SeenLoad]


def best_equivalent(how: Choice, seen: SeenRoot, km: float) -> tuple[Equivalent, float]:
    """Return the first equivalent that is near enough or else the nearest, and its misfit."""
    tried: list[tuple[Equivalent, float]] = []
    for kind in how.kinds_for(km):
        equivalent = equivalent_of(kind, how.level, seen.whole_s, seen.bare_s, seen.loads)
        off = max(
            _gap(seen_through(equivalent, at, seen.loads), y)
            for at, y in zip(ENDS, seen.ends_s, strict=True)
        )
        tried.append((equivalent, off))
        if off <= how.within:
            break
    return min(tried, key=lambda pair: pair[1])


def _gap(found: Complex, wanted: Complex) -> float:
    size = float(np.linalg.norm(wanted))
    return float(np.linalg.norm(found - wanted)) / size if size else 0.0
