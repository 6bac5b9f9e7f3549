"""The choice of settings one comparison at a time: slow, and easy to believe."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from openphase.optimise.counts import Grid

__all__ = [
    "brute_allowed",
    "brute_counts",
    "brute_front",
    "brute_margin",
    "decimals",
    "degenerate",
    "numbered",
    "on_grid",
    "random_events",
    "random_grid",
    "row_trips",
    "rows_of",
    "scaled",
    "trips",
]

Real = NDArray[np.float64]
Int = NDArray[np.int64]
Events = tuple[Real, Real, Real]
"""Current's change, voltage's change and the largest Z_set that still trips (0: none):
(S,), or (K, S) with the base row first and the fallback rows after it."""
Row = tuple[float, float, float, float]
"""The same three of one row, and its cap."""


def rows_of(events: Events) -> list[list[Row]]:
    """Per event its rows; the cap of a base row is 0, that of the others the base's current."""
    di, dv, z = (np.atleast_2d(x) for x in events)
    return [
        [
            (float(di[k, s]), float(dv[k, s]), float(z[k, s]), float(di[0, s]) if k else 0.0)
            for k in range(di.shape[0])
        ]
        for s in range(di.shape[1])
    ]


def row_trips(row: Row, i_set_a: float, v_set_pu: float, z_set_ohm: float) -> bool:
    """Whether a row trips a setting."""
    di_a, dv_pu, z_ohm, cap_a = row
    return cap_a < i_set_a <= di_a and dv_pu <= v_set_pu and z_ohm >= z_set_ohm


def trips(rows: Sequence[Row], i_set_a: float, v_set_pu: float, z_set_ohm: float) -> bool:
    """Whether an event trips a setting: by any of its rows."""
    return any(row_trips(row, i_set_a, v_set_pu, z_set_ohm) for row in rows)


def brute_counts(grid: Grid, events: Events) -> Int:
    """How many events trip each setting, shape (V, I, Z), by asking each one at each."""
    i_set, v_set, z_set = np.meshgrid(grid.i_set_a, grid.v_set_pu, grid.z_set_ohm)
    counts = np.zeros(grid.shape, np.int64)
    for rows in rows_of(events):
        tripped = np.zeros(grid.shape, np.bool_)
        for di_a, dv_pu, z_ohm, cap_a in rows:
            tripped |= (cap_a < i_set) & (i_set <= di_a) & (dv_pu <= v_set) & (z_ohm >= z_set)
        counts += tripped
    return counts


def brute_front(events: Events, scenario: Int) -> list[tuple[Row, tuple[int, ...]]]:
    """Rows that no other outdoes, and their scenarios, in that order; of equals the first."""
    named = [
        (row, tuple(name), k)
        for rows, name in zip(rows_of(events), scenario.tolist(), strict=True)
        for k, row in enumerate(rows)
        if row[2] > 0 and row[0] > row[3]
    ]

    def outdone(one: tuple[Row, tuple[int, ...], int]) -> bool:
        (di_a, dv_pu, z_ohm, cap_a), *name = one
        for (by_di, by_dv, by_z, by_cap), *by_name in named:
            at_least = by_di >= di_a and by_dv <= dv_pu and by_z >= z_ohm and by_cap <= cap_a
            same = (by_di, by_dv, by_z, by_cap) == one[0]
            if at_least and (not same or by_name < name):
                return True
        return False

    left = [one for one in named if not outdone(one)]
    return [(row, name) for row, name, _ in sorted(left, key=lambda one: one[1:])]


def tripping_spans(row: Row, setting: tuple[float, float, float]) -> list[tuple[float, float]]:
    """All spans of m between which the setting (I/m, V m, Z/m) trips by this row.

    Nothing changes but where a threshold passes one of the row's numbers, so between these
    places one m speaks for all.
    """
    i, v, z = setting
    di_a, dv_pu, z_ohm, cap_a = row
    places = [i / x for x in (di_a, cap_a) if x > 0]
    places += [z / z_ohm] if z_ohm > 0 else []
    places += [dv_pu / v]
    edges = [0.0, *sorted(set(places)), math.inf]
    spans = []
    for a, b in pairwise(edges):
        m = math.sqrt(a * b) if a > 0 and b < math.inf else (b / 2 if b < math.inf else 2 * a)
        if m > 0 and row_trips(row, i / m, v * m, z / m):
            spans.append((a, b))
    return spans


def brute_margin(events: Events, i_set_a: float, v_set_pu: float, z_set_ohm: float) -> float:
    """The least m > 1 at which (I/m, V m, Z/m) trips in some event.

    Below 1 if the setting itself trips: the least down to which it still does by the same row.
    """
    setting = i_set_a, v_set_pu, z_set_ohm
    least = math.inf
    for rows in rows_of(events):
        for row in rows:
            for a, b in tripping_spans(row, setting):
                if b > 1.0:
                    least = min(least, a)
    return least


def brute_allowed(grid: Grid, events: Events, margin: float) -> NDArray[np.bool_]:
    """Settings that no event trips after any relaxation from 1 to ``margin``."""
    free = np.ones(grid.shape, np.bool_)
    for v, i, z in product(*(range(n) for n in grid.shape)):
        setting = float(grid.i_set_a[i]), float(grid.v_set_pu[v]), float(grid.z_set_ohm[z])
        free[v, i, z] = brute_margin(events, *setting) > margin
    return free


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


def random_events(
    rng: np.random.Generator, size: int, grids: Sequence[Real], rows: int | None = None
) -> Events:
    """Events of which about half lie exactly on the numbers of ``grids``, many of them equal.

    ``rows`` None: (S,) arrays; else (rows, S), of which many have no reach.
    """
    shape = (size,) if rows is None else (rows, size)
    found = []
    for grid in grids:
        wide = rng.uniform(0.0, 1.3 * grid[-1], shape)
        found.append(np.where(rng.random(shape) < 0.5, rng.choice(grid, shape), wide))
    di_a, dv_pu, z_ohm = found
    z_ohm[rng.random(shape) < 0.1] = 0.0
    dv_pu[rng.random(shape) < 0.05] = 0.0
    if rows is not None:
        # base rows of little current, or of no reach, leave room for the others
        weak = rng.random(size) < 0.5
        di_a[0, weak] = rng.choice([0.0, 0.05, grids[0][0], grids[0][grids[0].size // 2]], size)[
            weak
        ]
        z_ohm[0, rng.random(size) < 0.3] = 0.0
        z_ohm[1:, rng.random(size) < 0.2] = 0.0
    return di_a, dv_pu, z_ohm


def on_grid(events: Events, grids: Sequence[Real]) -> Events:
    """The same events moved up to the numbers of ``grids``: many equal ones."""
    di_a, dv_pu, z_ohm = (
        np.where(x > 0, grid[np.minimum(np.searchsorted(grid, x), grid.size - 1)], 0.0)
        for x, grid in zip(events, grids, strict=True)
    )
    return di_a, dv_pu, z_ohm


def scaled(events: Events, factor: float) -> Events:
    """Events made larger: what a setting relaxed by this factor sees of them."""
    di_a, dv_pu, z_ohm = events
    return di_a * factor, dv_pu / factor, z_ohm * factor


def numbered(size: int) -> Int:
    """(size, 3): scenarios named in their order."""
    return np.column_stack([np.arange(size)] * 3)


def degenerate(events: Events, i_set_a: float, v_set_pu: float, z_set_ohm: float) -> bool:
    """Whether some row begins to trip, on relaxing, just where it ends: rounding decides."""
    for rows in rows_of(events):
        for di_a, dv_pu, z_ohm, cap_a in rows:
            if di_a > cap_a > 0 and z_ohm > 0:
                begin = max(i_set_a / di_a, z_set_ohm / z_ohm, dv_pu / v_set_pu)
                if math.isclose(begin * cap_a, i_set_a, rel_tol=1e-8):
                    return True
    return False
