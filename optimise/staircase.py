"""The border of the settings that trip in some event that must not.

Only the events that no other event outdoes matter: larger |ΔI1| and reach at smaller
|ΔV1| trip a wider range of settings. These few, kept with their identity, give the margin
of any setting. Fronts merge: the front of a union is the front of the fronts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Front", "border", "front_of", "margins", "merge_fronts", "nearest"]

Real = NDArray[np.float64]
Int = NDArray[np.int64]

CELLS = 1_000_000  #: factors looked at together; bounds memory

BINS = 32  #: per goal, in the first pass that thins events out


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Front:
    """Events that no other event outdoes, in a fixed order."""

    di1_a: Real  #: (n,)
    dv1_pu: Real  #: (n,)
    reach_ohm: Real  #: (n,)
    scenario: Int  #: (n, 3) class, block, index: which scenario it was

    @property
    def size(self) -> int:
        """Number of events."""
        return int(self.di1_a.size)

    def where(self, chosen: NDArray[np.bool_]) -> Front:
        """Some of the events."""
        return Front(
            di1_a=self.di1_a[chosen],
            dv1_pu=self.dv1_pu[chosen],
            reach_ohm=self.reach_ohm[chosen],
            scenario=self.scenario[chosen],
        )


def front_of(di1_a: Real, dv1_pu: Real, reach_ohm: Real, scenario: Int) -> Front:
    """Reduce events to their front; events that trip at no setting (reach 0) drop out.

    Of equal events the first in the order of scenarios stays.
    """
    order = np.lexsort((scenario[:, 2], scenario[:, 1], scenario[:, 0]))
    order = order[reach_ohm[order] > 0]
    goals = np.column_stack((di1_a[order], reach_ohm[order], -dv1_pu[order]))
    left = np.flatnonzero(~_surely_outdone(goals))
    goals = goals[left]
    at_least = np.ones((left.size, left.size), np.bool_)  # [by, which]
    same = at_least.copy()
    for goal in goals.T:
        at_least &= goal[:, None] >= goal
        same &= goal[:, None] == goal
    first = np.arange(left.size)[:, None] < np.arange(left.size)
    chosen = order[left[~(at_least & (~same | first)).any(axis=0)]]
    return Front(
        di1_a=di1_a[chosen],
        dv1_pu=dv1_pu[chosen],
        reach_ohm=reach_ohm[chosen],
        scenario=scenario[chosen],
    )


def _surely_outdone(goals: Real) -> NDArray[np.bool_]:
    """Events (rows) outdone by one in a higher bin of every goal; bins are equal in number.

    A cheap first pass: it may miss outdone events, and never takes a front event.
    """
    count = goals.shape[0]
    if count < 64:
        return np.zeros(count, np.bool_)
    bins = np.stack(
        [np.searchsorted(np.sort(goal), goal, side="left") * BINS // count for goal in goals.T]
    )
    taken = np.zeros((BINS + 1, BINS + 1, BINS + 1), np.bool_)
    taken[tuple(bins)] = True
    for axis in range(3):
        taken = np.flip(np.maximum.accumulate(np.flip(taken, axis), axis=axis), axis)
    return np.asarray(taken[tuple(bins + 1)])


def merge_fronts(parts: list[Front]) -> Front:
    """The front of all events of ``parts``, whatever their order."""
    return front_of(
        np.concatenate([p.di1_a for p in parts]) if parts else np.empty(0),
        np.concatenate([p.dv1_pu for p in parts]) if parts else np.empty(0),
        np.concatenate([p.reach_ohm for p in parts]) if parts else np.empty(0),
        np.concatenate([p.scenario for p in parts]) if parts else np.empty((0, 3), np.int64),
    )


def border(front: Front, v_set_pu: float, margin: float = 1.0) -> tuple[Real, Real]:
    """Border of the settings (I_set, Z_set) that trip at one V_set, as the corners of its steps.

    A setting trips in some event exactly where it lies on or below this line. With
    ``margin`` it is the border of the settings that do not keep that margin: of those that
    an event trips once it is magnified by it, in |ΔV1| as well.

    Returns
    -------
    i_set_a, z_set_ohm : (2n + 1,) arrays
        From I_set = 0 at the longest reach, step by step down to Z_set = 0; empty where no
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
    able = front.dv1_pu / margin <= v_set_pu
    i, z = front.di1_a[able] * margin, front.reach_ohm[able] * margin
    order = np.lexsort((z, i))[::-1]
    i, z = i[order], z[order]
    # from the largest current down, a step is where the reach exceeds all before it
    step = np.diff(np.maximum.accumulate(z), prepend=0.0) > 0
    i, z = i[step][::-1], z[step][::-1]
    if not i.size:
        return i, z
    return np.append(0.0, np.repeat(i, 2)), np.append(np.repeat(z, 2), 0.0)


def factors(front: Front, i_set_a: Real, v_set_pu: Real, z_set_ohm: Real) -> Real:
    """Factor of every event (rows) to every setting (columns).

    The setting (I/m, V m, Z/m) trips in the event from m = factor on.
    """
    with np.errstate(divide="ignore"):
        return np.maximum(
            np.maximum(
                i_set_a / front.di1_a[:, None],
                z_set_ohm / front.reach_ohm[:, None],
            ),
            front.dv1_pu[:, None] / v_set_pu,
        )


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
    """Index in the front of the event nearest to a setting, and its factor; -1 and inf: none."""
    if not front.size:
        return -1, float("inf")
    each = factors(front, np.array([i_set_a]), np.array([v_set_pu]), np.array([z_set_ohm]))[:, 0]
    n = int(each.argmin())
    return n, float(each[n])
