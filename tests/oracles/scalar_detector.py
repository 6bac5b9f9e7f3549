"""The detector and the choice of settings, one comparison at a time: slow, and easy to believe."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import product

import numpy as np
from numpy.typing import NDArray

from openphase.detector.criteria import Reason, Settings
from openphase.detector.evidence import Evidence
from openphase.optimise.counts import Grid
from openphase.optimise.staircase import Front

__all__ = [
    "Looks",
    "as_front",
    "brute_counts",
    "brute_front",
    "brute_margin",
    "decimals",
    "first_failing",
    "looks_at",
    "looks_of",
    "random_events",
    "random_grid",
    "trips",
]

Real = NDArray[np.float64]
Int = NDArray[np.int64]
Events = tuple[Real, Real, Real]
"""Per event |ΔI1|, |ΔV1| and the largest Z_set that still trips (0: none)."""


@dataclass(frozen=True, kw_only=True)
class Looks:
    """What one terminal sees in one scenario; lists are of V1 and phases a, b, c."""

    di_a: list[float]
    dv_pu: list[float]
    z_ohm: list[complex]
    undefined: list[bool]
    blocked: bool
    di_star_a: list[float]
    dv_remote_star_v: list[float]
    di2_a: float
    di0_a: float
    unbalance_rise_a: float
    far_di_a: list[float]
    far_z_ohm: list[complex]
    far_undefined: list[bool]
    alarm: int = 0


def looks_of(evidence: Evidence, t: int, s: int) -> Looks:
    """One scenario of one terminal of complete evidence."""
    parts = {}
    for field in fields(Evidence):
        values = getattr(evidence, field.name)
        if values is not None:
            parts[field.name] = values[t, ..., s].tolist()
    return Looks(**parts)


def looks_at(
    v: list[list[list[complex]]],
    i: list[list[list[complex]]],
    into: tuple[float, float],
    v_nominal_v: float,
) -> Looks:
    """The same by hand, from ``v[frame][end][phase]``: end 0 is the local one."""
    turn = cmath.exp(2j * math.pi / 3)

    def sequence(abc: list[complex], way: int) -> complex:
        return sum(x * turn ** (way * k) for k, x in enumerate(abc)) / 3

    def rows(abc: list[complex]) -> list[complex]:
        return [sequence(abc, 1), *abc]

    def impedances(here: int) -> tuple[list[complex], list[bool]]:
        z_ohm, undefined = [], []
        for r in range(4):
            v_l = [rows(v[frame][here])[r] for frame in (0, 1)]
            v_r = [rows(v[frame][1 - here])[r] for frame in (0, 1)]
            i_l = [rows(i[frame][here])[r] * into[here] for frame in (0, 1)]
            below = (i_l[1] - i_l[0]) * v_l[1] - (v_l[1] - v_l[0]) * i_l[1]
            above = (v_l[1] - v_l[0]) * v_r[1] - (v_r[1] - v_r[0]) * v_l[1]
            none = abs(below) <= 1e-10 * max(abs((v_l[1] - v_l[0]) * i_l[1]), abs(v_l[1] * i_l[1]))
            undefined.append(none)
            z_ohm.append(0j if none else above / below)
        return z_ohm, undefined

    def change(x: list[list[list[complex]]], end: int, local_v: bool) -> list[float]:
        """|X' - X|, or |X' - X V'/V| by the local voltage."""
        found = []
        for r in range(4):
            before, now = rows(x[0][end])[r], rows(x[1][end])[r]
            earlier = rows(v[0][0])[r]
            # where the end was dead there is nothing to compensate with
            factor = rows(v[1][0])[r] / earlier if local_v and earlier else 1.0
            found.append(abs(now - before * factor))
        return found

    def unbalance(frame: int) -> float:
        return abs(sequence(i[frame][0], -1)) + abs(sequence(i[frame][0], 0))

    here, there = impedances(0), impedances(1)
    highest = [max(abs(x) for x in v[frame][end]) for frame in (0, 1) for end in (0, 1)]
    return Looks(
        di_a=change(i, 0, False),
        dv_pu=[x / v_nominal_v for x in change(v, 0, False)],
        z_ohm=here[0],
        undefined=here[1],
        blocked=any(x < 0.2 * v_nominal_v for x in highest),
        di_star_a=change(i, 0, True),
        dv_remote_star_v=change(v, 1, True),
        di2_a=abs(sequence(i[1][0], -1) - sequence(i[0][0], -1)),
        di0_a=abs(sequence(i[1][0], 0) - sequence(i[0][0], 0)),
        unbalance_rise_a=unbalance(1) - unbalance(0),
        far_di_a=change(i, 1, False),
        far_z_ohm=there[0],
        far_undefined=there[1],
    )


def first_failing(seen: Looks, settings: Settings) -> Reason:
    """The criteria one after the other, as the paper and the options state them."""
    if seen.alarm:
        return Reason.WIRING
    if seen.blocked:
        return Reason.BLOCKED
    own = _row_fails(seen, settings, 0)
    if own != Reason.CURRENT or not settings.options.fallback:
        return own
    phases = [_row_fails(seen, settings, k) for k in (1, 2, 3)]
    if Reason.TRIP in phases:
        return Reason.TRIP
    return IN_PHASES[max(phases)]


IN_PHASES = {
    Reason.CURRENT: Reason.CURRENT,
    Reason.VOLTAGE: Reason.PHASE_VOLTAGE,
    Reason.IMPEDANCE: Reason.PHASE_IMPEDANCE,
    Reason.SIGN: Reason.PHASE_SIGN,
    Reason.FLOOR: Reason.PHASE_FLOOR,
    Reason.UNBALANCE: Reason.UNBALANCE,
    Reason.DIRECTION: Reason.DIRECTION,
    Reason.FAR_END: Reason.PHASE_FAR_END,
}


def _row_fails(seen: Looks, settings: Settings, k: int) -> Reason:  # noqa: PLR0911
    """The first criterion that fails in the positive sequence (0) or a phase."""
    options = settings.options
    trigger = min(seen.di_a[k], seen.di_star_a[k]) if options.compensated else seen.di_a[k]
    if options.any_sequence and k == 0:
        trigger = max(trigger, seen.di2_a, seen.di0_a)
    if not trigger >= settings.i_set_a:
        return Reason.CURRENT
    if not seen.dv_pu[k] <= settings.v_set_pu:
        return Reason.VOLTAGE
    if seen.undefined[k] or not abs(seen.z_ohm[k]) >= settings.z_set_ohm:
        return Reason.IMPEDANCE
    waived = options.any_sequence and k == 0 and seen.di_star_a[0] < options.waive_sign_below_a
    if options.negative_sign and not waived and not seen.z_ohm[k].real < 0:
        return Reason.SIGN
    if options.any_sequence and not seen.dv_remote_star_v[k] >= options.floor_v:
        return Reason.FLOOR
    if not max(seen.di2_a, seen.di0_a) >= options.unbalance * seen.di_a[0]:
        return Reason.UNBALANCE
    if options.direction and not seen.unbalance_rise_a >= 0:
        return Reason.DIRECTION
    if options.both_ends != "off":
        speaks = seen.far_di_a[k] >= 0.1 and not seen.far_undefined[k]
        small = abs(seen.far_z_ohm[k]) < settings.z_set_ohm
        if options.both_ends == "no_small_z" and speaks and small:
            return Reason.FAR_END
        if options.both_ends == "agree" and not (
            speaks and not small and seen.far_z_ohm[k].real < 0
        ):
            return Reason.FAR_END
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
