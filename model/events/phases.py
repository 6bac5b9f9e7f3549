"""Which phases an event takes, of those that are there.

Masks have bit 0 for phase a; a pair k is phases k and k + 1: a-b, b-c, c-a.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "THREE_PHASES",
    "count_phases",
    "draw_mask",
    "draw_pair",
    "draw_phase",
    "draw_row",
    "row_flags",
]

Int = NDArray[np.int64]
Bool = NDArray[np.bool_]

THREE_PHASES = 0b111

_COUNT = np.array([0, 1, 1, 2, 1, 2, 2, 3], np.int64)

#: the phase of each rank among those of a mask; the last rank of a pair is never asked for
_OF_RANK = np.array(
    [[0, 0, 0], [0, 0, 0], [1, 1, 1], [0, 1, 1], [2, 2, 2], [0, 2, 2], [1, 2, 2], [0, 1, 2]],
    np.int64,
)
_PAIR = np.array([-1, -1, -1, 0, -1, 2, 1, -1], np.int64)
"""The one pair of a mask of two phases."""

_PAIR_MASK = np.array([0b011, 0b110, 0b101], np.int64)


def count_phases(there: Int) -> Int:
    """How many phases masks have.

    Examples
    --------
    >>> count_phases(np.array([0b000, 0b010, 0b101, 0b111]))
    array([0, 1, 2, 3])
    """
    return _COUNT[there]


def draw_phase(rng: np.random.Generator, there: Int) -> Int:
    """(S,) rows 0 to 2: one phase of each mask (S,), each as likely."""
    return draw_row(rng, there, np.zeros(there.size, np.bool_))


def draw_pair(rng: np.random.Generator, there: Int) -> Int:
    """(S,) pairs 0 to 2 of the phases of each mask (S,), each as likely.

    Of a mask of one phase there is none, and the row is without meaning.
    """
    return draw_row(rng, there, np.ones(there.size, np.bool_))


def draw_row(rng: np.random.Generator, there: Int, pairs: Bool) -> Int:
    """(S,) rows 0 to 2: pairs of each mask (S,) where ``pairs`` says so, phases elsewhere."""
    rank = rng.integers(3, size=there.size)
    count = _COUNT[there]
    pair = np.where(count == 3, rank, _PAIR[there])
    two = (count == 2) & ~pairs
    if two.any():  # of two phases, the third rank is drawn again
        rank = np.where(two & (rank == 2), rng.integers(2, size=there.size), rank)
    return np.where(pairs, pair, _OF_RANK[there, rank])


def draw_mask(rng: np.random.Generator, there: Int, two_phase_share: float) -> Int:
    """(S,) masks of one phase, or of two that often; which ones is equally likely.

    Where there is but one, it is that one.
    """
    which = draw_phase(rng, there)
    two = (rng.random(there.size) < two_phase_share) & (_COUNT[there] > 1)
    pair = np.where(there == THREE_PHASES, _PAIR_MASK[which], there)
    return np.where(two, pair, 1 << which)


def row_flags(rows: Int) -> Bool:
    """(3, S) True in the row of each scenario, of rows (S,)."""
    return np.asarray(rows == np.arange(3)[:, None])
