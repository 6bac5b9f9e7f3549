"""The detector and the choice of settings, one comparison at a time: slow, and easy to believe."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from openphase.detector.criteria import Reason, Settings
from openphase.optimise.counts import Grid
from openphase.optimise.staircase import Front

__all__ = [
    "as_front",
    "brute_counts",
    "brute_front",
    "brute_margin",
    "decimals",
    "first_failing",
    "random_events",
    "random_grid",
    "trips",
]

Real = NDArray[np.float64]
Int = NDArray[np.int64]
Events = tuple[Real, Real, Real]
"""Per event |ΔI1|, |ΔV1| and the largest Z_set that still trips (0: none)."""


def first_failing(
    di1_a: float, dv1_pu: float, z1: complex, blocked: bool, undefined: bool, settings: Settings
) -> Reason:
    """The criteria one after the other, as the paper states them."""
    if blocked:
        return Reason.BLOCKED
    if not di1_a >= settings.i_set_a:
        return Reason.CURRENT
    if not dv1_pu <= settings.v_set_pu:
        return Reason.VOLTAGE
    if undefined or not abs(z1) >= settings.z_set_ohm:
        return Reason.IMPEDANCE
    if settings.negative_sign and not z1.real < 0:
        return Reason.SIGN
    return Reason.TRIP


def trips(
    event: tuple[float, float, float], i_set_a: float, v_set_pu: float, z_set_ohm: float
) -> bool:
    """Whether an event (|ΔI1|, |ΔV1|, reach) trips a setting."""
    di1_a, dv1_pu, reach_ohm = event
    return di1_a >= i_set_a and dv1_pu <= v_set_pu and reach_ohm >= z_set_ohm


def brute_counts(grid: Grid, events: Events) -> Int:
    """How many events trip each setting, shape (V, I, Z), by asking each one."""
    counts = np.zeros(grid.shape, np.int64)
    rows = list(zip(*(x.tolist() for x in events), strict=True))
    for v, i, z in product(*(range(n) for n in grid.shape)):
        setting = float(grid.i_set_a[i]), float(grid.v_set_pu[v]), float(grid.z_set_ohm[z])
        counts[v, i, z] = sum(trips(event, *setting) for event in rows)
    return counts


def brute_front(events: Events, scenario: Int) -> list[int]:
    """Events that no other outdoes, in the order of their scenarios; of equals the first."""
    rows = list(zip(*(x.tolist() for x in events), strict=True))
    name = [tuple(row) for row in scenario.tolist()]

    def outdone(a: int) -> bool:
        for b in range(len(rows)):
            if b == a or not trips(rows[b], rows[a][0], rows[a][1], rows[a][2]):
                continue
            if rows[b] != rows[a] or name[b] < name[a]:
                return True
        return False

    left = [n for n, row in enumerate(rows) if row[2] > 0 and not outdone(n)]
    return sorted(left, key=lambda n: name[n])


def brute_margin(events: Events, i_set_a: float, v_set_pu: float, z_set_ohm: float) -> float:
    """The least m at which (I/m, V m, Z/m) trips in some event, by bisection of ln m."""
    rows = list(zip(*(x.tolist() for x in events), strict=True))

    def any_trip(m: float) -> bool:
        return any(trips(event, i_set_a / m, v_set_pu * m, z_set_ohm / m) for event in rows)

    low, high = math.log(1e-9), math.log(1e9)
    if not any_trip(math.exp(high)):
        return math.inf
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if any_trip(math.exp(middle)) else (middle, high)
    return math.exp(high)


def decimals(first: int, last: int, per_unit: int = 10) -> Real:
    """The floats nearest to first/per_unit, ..., last/per_unit: what a relay is set to."""
    return np.array([n / per_unit for n in range(first, last + 1)])


def random_grid(rng: np.random.Generator) -> Grid:
    """A small grid of settings in decimal steps."""
    sizes = rng.integers(1, 7, 3)
    starts = rng.integers(1, 5, 3)
    i, v, z = (
        decimals(int(a), int(a + n), per)
        for a, n, per in zip(starts, sizes, (10, 1000, 10), strict=True)
    )
    return Grid(i_set_a=i, v_set_pu=v, z_set_ohm=z)


def random_events(rng: np.random.Generator, size: int, grids: Sequence[Real]) -> Events:
    """Events of which about half lie exactly on the numbers of ``grids``, many of them equal."""
    found = []
    for grid in grids:
        wide = rng.uniform(0.0, 1.3 * grid[-1], size)
        found.append(np.where(rng.random(size) < 0.5, rng.choice(grid, size), wide))
    di1_a, dv1_pu, reach_ohm = found
    reach_ohm[rng.random(size) < 0.1] = 0.0
    dv1_pu[rng.random(size) < 0.05] = 0.0
    return di1_a, dv1_pu, reach_ohm


def as_front(events: Events, scenario: Int | None = None) -> Front:
    """All of the events, as they are."""
    di1_a, dv1_pu, reach_ohm = events
    if scenario is None:
        scenario = np.column_stack([np.arange(di1_a.size)] * 3)
    return Front(di1_a=di1_a, dv1_pu=dv1_pu, reach_ohm=reach_ohm, scenario=scenario)
