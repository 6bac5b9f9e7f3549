"""The border of the settings that trip in some event that must not.

An event trips in one way or several: by its base row, and by fallback rows (phases), which
count only where I_set exceeds a cap, the base row's |ΔI1|. A row trips exactly where
cap < I_set <= |ΔI|, V_set >= |ΔV| and Z_set <= reach. Only the rows that no other outdoes
matter: those few, kept with the identity of their scenario, give the margin of any setting.
Fronts merge: the front of a union is the front of the fronts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Front", "border", "factors", "front_of", "margins", "merge_fronts", "nearest"]

Real = NDArray[np.float64]
Int = NDArray[np.int64]

CELLS = 1_000_000  #: factors looked at together; bounds memory

HEAD = 64  #: rows that the others are compared with at a time; changes no result


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Front:
    """Ways to trip that no other outdoes, in a fixed order; a scenario may have several."""

    di_a: Real  #: (n,) trips where I_set <= this
    dv_pu: Real  #: (n,) and V_set >= this
    z_ohm: Real  #: (n,) and Z_set <= this
    cap_a: Real  #: (n,) and I_set > this: 0 for a base row, |ΔI1| for a fallback row
    scenario: Int  #: (n, C) class first, then what else names the scenario

    @property
    def size(self) -> int:
        """Number of rows."""
        return int(self.di_a.size)

    def where(self, chosen: NDArray[np.bool_] | Int) -> Front:
        """Some of the rows."""
        return Front(
            di_a=self.di_a[chosen],
            dv_pu=self.dv_pu[chosen],
            z_ohm=self.z_ohm[chosen],
            cap_a=self.cap_a[chosen],
            scenario=self.scenario[chosen],
        )


def front_of(di_a: Real, dv_pu: Real, z_ohm: Real, scenario: Int) -> Front:
    """Reduce events to their front; rows that trip at no setting drop out.

    Of equal rows the first in the order of scenarios stays.

    Parameters
    ----------
    di_a, dv_pu, z_ohm : (S,) or (K, S) arrays
        As :func:`~openphase.optimise.counts.corners_of` takes them: row 0 is the base row,
        the others trip only where ``di_a[0] < I_set``.
    scenario : (S, C) array
        Integers that name each scenario.
    """
    di, dv, z = (np.atleast_2d(x) for x in (di_a, dv_pu, z_ohm))
    # written as "holds", so that a row with a number that is none drops out
    able = (z > 0) & (dv < np.inf)
    able[:1] &= di[:1] > 0
    able[1:] &= di[1:] > di[0]
    row, event = np.nonzero(able)
    rows = Front(
        di_a=di[row, event],
        dv_pu=dv[row, event],
        z_ohm=z[row, event],
        cap_a=np.where(row > 0, di[0, event], 0.0),
        scenario=scenario[event],
    )
    return _reduced(rows)


def merge_fronts(parts: list[Front]) -> Front:
    """The front of all events of ``parts``, whatever their order."""
    if not parts:
        nothing = np.empty(0)
        return front_of(nothing, nothing, nothing, np.empty((0, 3), np.int64))
    return _reduced(
        Front(
            di_a=np.concatenate([p.di_a for p in parts]),
            dv_pu=np.concatenate([p.dv_pu for p in parts]),
            z_ohm=np.concatenate([p.z_ohm for p in parts]),
            cap_a=np.concatenate([p.cap_a for p in parts]),
            scenario=np.concatenate([p.scenario for p in parts]),
        )
    )


def _reduced(rows: Front) -> Front:
    """The rows that no other outdoes, in the order of their scenarios."""
    order = np.lexsort(rows.scenario.T[::-1])
    goals = np.stack((rows.di_a, rows.z_ohm, -rows.dv_pu, -rows.cap_a))[:, order]
    return rows.where(order[_undominated(goals)])


def _undominated(goals: Real) -> Int:
    """Increasing indices of the columns of ``goals`` (G, n) that no other outdoes in every goal.

    Of equal columns the first stays. Whatever outdoes a column has a larger sum of ranks: in
    that order each column is outdone by an earlier one or by none.
    """
    ranks = np.stack([_ranks(goal) for goal in goals])
    left = np.argsort(-ranks.sum(axis=0), kind="stable")
    # small whole numbers are compared several at a time
    whole = np.int16 if left.size <= np.iinfo(np.int16).max else np.int32
    ranks = ranks[:, left].astype(whole)
    kept = [left[:0]]
    while left.size:
        head = left[:HEAD]
        outdone = np.ones((head.size, left.size), np.bool_)  # [by, which]
        for rank in ranks:
            outdone &= rank[: head.size, None] >= rank
        outdone[:, : head.size] = np.triu(outdone[:, : head.size], 1)
        stays = np.logical_not(outdone.any(axis=0))
        kept.append(head[stays[: head.size]])
        stays[: head.size] = False
        left, ranks = left[stays], ranks[:, stays]
    return np.sort(np.concatenate(kept))


def _ranks(values: Real) -> Int:
    """(n,) how many different values lie below each of (n,)."""
    order = np.argsort(values)
    rising = values[order]
    new = np.zeros(values.size, np.bool_)
    np.not_equal(rising[1:], rising[:-1], out=new[1:])
    ranks = np.empty(values.size, np.int64)
    ranks[order] = np.cumsum(new)
    return ranks


def border(front: Front, v_set_pu: float, margin: float = 1.0) -> tuple[Real, Real]:
    """Border of the settings (I_set, Z_set) that trip at one V_set, as the corners of a line.

    A setting trips in some event exactly where it lies on or below this line; on the rising
    pieces, which caps make, only below. With ``margin`` it is the border of the settings that
    do not keep that margin: of those that trip once I_set and Z_set are divided, and V_set
    multiplied, by some factor up to it.

    Returns
    -------
    i_set_a, z_set_ohm : (n,) arrays
        From I_set = 0 to the largest one that trips, and there down to Z_set = 0; level and
        upright pieces, with a margin also pieces of rays from the origin. Empty where no
        event trips at this V_set.

    Examples
    --------
    >>> import numpy as np
    >>> front = front_of(
    ...     np.array([1.0, 4.0, 9.0]),
    ...     np.array([0.01, 0.01, 0.05]),
    ...     np.array([30.0, 20.0, 10.0]),
    ...     np.zeros((3, 3), np.int64),
    ... )
    >>> i_set_a, z_set_ohm = border(front, 0.02)
    >>> i_set_a.tolist(), z_set_ohm.tolist()
    ([0.0, 1.0, 1.0, 4.0, 4.0], [30.0, 30.0, 20.0, 20.0, 0.0])
    """
    able = front.where(front.dv_pu / margin <= v_set_pu)
    if not able.size:
        return np.empty(0), np.empty(0)
    # I/m' must stay above the cap: up to bend, Z/m' reaches the row only below a ray
    start, bend = able.cap_a * np.maximum(able.dv_pu / v_set_pu, 1.0), able.cap_a * margin
    end = able.di_a * margin
    edges = np.unique(np.concatenate(([0.0], start, bend, end)))
    level, slope = np.zeros(edges.size - 1), np.zeros(edges.size - 1)
    places = (np.searchsorted(edges, x).tolist() for x in (start, bend, end))
    for a, b, c, z, cap in zip(*places, able.z_ohm.tolist(), able.cap_a.tolist(), strict=True):
        level[b:c] = np.maximum(level[b:c], z * margin)
        if a < b:
            slope[a:b] = np.maximum(slope[a:b], z / cap)
    left, right = edges[:-1], edges[1:]
    # where a ray leaves a level piece
    knee = np.divide(level, slope, out=left.copy(), where=slope > 0).clip(left, right)
    i = np.append(np.column_stack((left, knee, right)).ravel(), right[-1])
    z = np.append(np.maximum(level, slope * np.stack((left, knee, right))).T.ravel(), 0.0)
    return _corners(i, z)


def _corners(i: Real, z: Real) -> tuple[Real, Real]:
    """A line without repeated points, nor points inside its level pieces."""
    new = (np.diff(i, prepend=np.nan) != 0) | (np.diff(z, prepend=np.nan) != 0)
    i, z = i[new], z[new]
    bends = np.diff(z, prepend=np.nan, append=np.nan) != 0
    turn = bends[:-1] | bends[1:]
    return i[turn], z[turn]


def factors(front: Front, i_set_a: Real, v_set_pu: Real, z_set_ohm: Real) -> Real:
    """Factor of every row (rows) to every setting (columns).

    The least m from which on the setting (I/m, V m, Z/m) trips by that row: below 1 where the
    setting itself trips, infinite where it does not and no m > 1 makes it trip, because I/m is
    at the cap before all else is reached.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        least = np.maximum(
            np.maximum(i_set_a / front.di_a[:, None], z_set_ohm / front.z_ohm[:, None]),
            front.dv_pu[:, None] / v_set_pu,
        )
        never = i_set_a <= front.cap_a[:, None] * np.maximum(least, 1.0)
    least[never] = np.inf
    return np.asarray(least)


def margins(front: Front, i_set_a: Real, v_set_pu: Real, z_set_ohm: Real) -> Real:
    """Margin of every setting (1-d arrays of one length): its smallest factor to any event.

    I_set and Z_set may be lowered and V_set raised by less than this without a trip;
    infinite where no event could ever trip.
    """
    found = np.full(i_set_a.shape, np.inf)
    step = max(CELLS // max(front.size, 1), 1)
    for start in range(0, i_set_a.size, step):
        part = slice(start, start + step)
        if front.size:
            each = factors(front, i_set_a[part], v_set_pu[part], z_set_ohm[part])
            found[part] = each.min(axis=0)
    return found


def nearest(front: Front, i_set_a: float, v_set_pu: float, z_set_ohm: float) -> tuple[int, float]:
    """Index in the front of the row nearest to a setting, and its factor; -1 and inf: none."""
    if not front.size:
        return -1, float("inf")
    each = factors(front, np.array([i_set_a]), np.array([v_set_pu]), np.array([z_set_ohm]))[:, 0]
    n = int(each.argmin())
    return n, float(each[n])
