"""All validation blocks of one group, added up."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...optimise.staircase import Front, merge_fronts
from .choose import MERGE_EVERY
from .classes import DrawClass
from .draw import BlockId
from .tally import FLAGGED, Tested

__all__ = ["Validation", "add_up"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Validation:
    """All validation blocks of one group together."""

    trials: NDArray[np.int64]  #: (R, T)
    effective: NDArray[np.int64]  #: (R, T)
    trips: NDArray[np.int64]  #: (K, R, T)
    alarms: NDArray[np.int64]  #: (R, T)
    fallen: NDArray[np.int64]  #: (2, bands, T, 2)
    reachable: NDArray[np.int64]  #: (T,)
    found: NDArray[np.int64]  #: (K, T)
    missed: NDArray[np.int64]  #: (T, Reason)
    profile: NDArray[np.int64]  #: (T, PLACES, 2)
    front: tuple[Front, ...]
    least_z_ohm: NDArray[np.float64]  #: (T,)
    flags: NDArray[np.int64]  #: (DrawClass, 4) by ``tally.FLAGGED``
    scenarios: NDArray[np.int64]  #: (DrawClass,)
    samples: tuple[tuple[BlockId, NDArray[np.float64], NDArray[np.int8]], ...]  #: for pictures


#: what simply adds up over blocks
ADDED = (
    *("trials", "effective", "trips", "alarms", "fallen", "reachable"),
    *("found", "missed", "profile"),
)

SAMPLED_BLOCKS = 25  #: blocks of a class whose kept evidence goes into pictures


def add_up(blocks: Iterable[tuple[BlockId, Tested]], size: int) -> Validation:
    """Add blocks of ``size`` scenarios; memory does not grow with their number."""
    total: dict[str, Any] = {}
    fronts: list[tuple[Front, ...]] = []
    samples: list[tuple[BlockId, NDArray[np.float64], NDArray[np.int8]]] = []
    least = np.array(np.inf)
    flags = np.zeros((len(DrawClass), len(FLAGGED)), np.int64)
    count = np.zeros(len(DrawClass), np.int64)
    for which, block in blocks:
        count[which.drawn] += size
        flags[which.drawn] += block.flags
        least = np.minimum(least, block.least_z_ohm)
        for name in ADDED:
            total[name] = total.get(name, 0) + getattr(block, name)
        fronts.append(block.front)
        if len(fronts) > MERGE_EVERY:
            fronts = [_merged(fronts)]
        if which.block < SAMPLED_BLOCKS:
            samples.append((which, block.sample, block.sample_side))
    return Validation(
        front=_merged(fronts),
        least_z_ohm=least,
        flags=flags,
        scenarios=count,
        samples=tuple(samples),
        **total,
    )


def _merged(fronts: list[tuple[Front, ...]]) -> tuple[Front, ...]:
    """Fronts by block and terminal, as one of each terminal."""
    return tuple(merge_fronts(list(own)) for own in zip(*fronts, strict=True))
