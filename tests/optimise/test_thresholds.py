"""The chosen setting against a search through the whole grid."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.scalar_detector import (
    Events,
    as_front,
    brute_counts,
    brute_margin,
    random_events,
    random_grid,
)

from openphase.optimise.counts import Corners, Grid, corners_of
from openphase.optimise.staircase import Front, front_of
from openphase.optimise.thresholds import Choice, Sample, allowed, choose

REFERENCE = 0.5, 0.004, 0.6
Instance = tuple[Grid, Events, Events, float]


def instance(seed: int, *key: int) -> Instance:
    """A grid, breaks, events that must not trip, and a margin."""
    rng = np.random.default_rng([*key, seed])
    grid = random_grid(rng)
    grids = grid.i_set_a, grid.v_set_pu, grid.z_set_ohm
    opens = random_events(rng, int(rng.integers(0, 80)), grids)
    false = random_events(rng, int(rng.integers(0, 8)), grids)
    margin = float(rng.choice([1.0, 1.1, 1.25]))
    # leave room for settings above the false trips
    false = false[0] * 0.6, false[1] * 1.5, false[2] * 0.6
    return grid, opens, false, margin


def front(events: Events) -> Front:
    return front_of(*events, as_front(events).scenario)


def stiffened(events: Events, margin: float) -> Events:
    return events[0] / margin, events[1] * margin, events[2] / margin


def chosen(
    grid: Grid,
    opens: Events,
    false: Events,
    margin: float,
    trials: int | None = None,
    only_v: int | None = None,
) -> Choice | None:
    sample = Sample(
        opens=corners_of(grid, *opens),
        stiff=corners_of(grid, *stiffened(opens, margin)),
        trials=opens[0].size if trials is None else trials,
        front=front(false),
    )
    return choose(grid, sample, margin, REFERENCE, only_v)


def keeps(grid: Grid, false: Events, margin: float) -> NDArray[np.bool_]:
    """Settings at which no event trips, not even when it is magnified by the margin."""
    magnified = false[0] * margin, false[1] / margin, false[2] * margin
    return np.asarray(brute_counts(grid, magnified) == 0)


def place(grid: Grid, choice: Choice) -> tuple[int, int, int]:
    """The cell of a choice, which must be a setting of the grid to the last bit."""
    return (
        grid.v_set_pu.tolist().index(choice.v_set_pu),
        grid.i_set_a.tolist().index(choice.i_set_a),
        grid.z_set_ohm.tolist().index(choice.z_set_ohm),
    )


@pytest.mark.parametrize("seed", range(60))
def test_allowed_settings_keep_the_margin(seed: int) -> None:
    grid, _, false, margin = instance(seed, 41)
    expected = keeps(grid, false, margin)
    np.testing.assert_array_equal(allowed(grid, front(false), margin), expected)
    for v, i, z in product(*(range(n) for n in grid.shape)):
        setting = float(grid.i_set_a[i]), float(grid.v_set_pu[v]), float(grid.z_set_ohm[z])
        room = brute_margin(false, *setting)
        if not math.isclose(room, margin, rel_tol=1e-9):
            assert expected[v, i, z] == (room > margin)


@pytest.mark.parametrize("seed", range(150))
def test_the_choice_is_the_best_of_the_grid(seed: int) -> None:
    """Most breaks found less a standard error; then security, stiff breaks, the reference."""
    grid, opens, false, margin = instance(seed, 42)
    only_v = None if seed % 3 else int(seed % grid.shape[0])
    choice = chosen(grid, opens, false, margin, only_v=only_v)
    free = keeps(grid, false, margin)
    if only_v is not None:
        free[[v for v in range(grid.shape[0]) if v != only_v]] = False
    if not free.any():
        assert choice is None
        return
    found = brute_counts(grid, opens)
    stiff = brute_counts(grid, stiffened(opens, margin))
    best, trials = int(found[free].max()), opens[0].size
    error = math.sqrt(best * (1.0 - best / trials)) if trials else 0.0
    ranks = {}
    for v, i, z in zip(*np.nonzero(free & (found >= best - error)), strict=True):
        setting = float(grid.i_set_a[i]), float(grid.v_set_pu[v]), float(grid.z_set_ohm[z])
        security = min((max(setting[0] / a, setting[2] / c, b / setting[1])
                        for a, b, c in zip(*false, strict=True) if a > 0 and c > 0),
                       default=math.inf)  # fmt: skip
        distance = sum(abs(math.log(x / y)) for x, y in zip(setting, REFERENCE, strict=True))
        ranks[v, i, z] = (-security, -int(stiff[v, i, z]), distance)
    assert choice is not None
    cell = place(grid, choice)
    assert cell in ranks
    least = min(ranks.values())
    # roundings of the distance may differ by a bit; margin and count may not
    assert ranks[cell][:2] == least[:2]
    assert ranks[cell][2] == pytest.approx(least[2], abs=1e-12)
    assert choice.detected == found[cell]
    assert choice.margin == -ranks[cell][0]
    assert choice.margin >= margin * (1.0 - 1e-12)
    # no event of the sample trips it
    assert brute_counts(grid, false)[cell] == 0


def test_the_reference_decides_among_equals() -> None:
    """Nothing must not trip and no break is seen: all settings are alike."""
    grid = Grid(
        i_set_a=np.array([0.1, 0.5, 1.0]),
        v_set_pu=np.array([0.002, 0.004, 0.05]),
        z_set_ohm=np.array([0.1, 0.6, 50.0]),
    )
    nothing = np.empty(0), np.empty(0), np.empty(0)
    choice = chosen(grid, nothing, nothing, 1.25)
    assert choice is not None
    assert (choice.i_set_a, choice.v_set_pu, choice.z_set_ohm) == REFERENCE
    assert choice.margin == math.inf
    assert choice.detected == 0


def test_within_a_standard_error_the_larger_margin_wins() -> None:
    grid = Grid(i_set_a=np.array([1.0, 2.0]), v_set_pu=np.array([0.05]), z_set_ohm=np.array([5.0]))
    false = np.array([0.5]), np.array([0.0]), np.array([100.0])

    def breaks(weak: int) -> Events:
        """100 breaks, of which so many are too weak for 2 A, and 20 not seen at all."""
        di1_a = np.array([1.5] * weak + [9.0] * (80 - weak) + [0.0] * 20)
        return di1_a, np.zeros(100), np.full(100, 99.0)

    # 80 of 100 found, standard error 4: up to 4 breaks are given for twice the margin
    for weak, i_set_a in ((0, 2.0), (4, 2.0), (5, 1.0)):
        choice = chosen(grid, breaks(weak), false, 1.25)
        assert choice is not None
        assert choice.i_set_a == i_set_a
        assert choice.detected == (80 if i_set_a == 1.0 else 80 - weak)


def test_none_when_nothing_is_allowed() -> None:
    grid = random_grid(np.random.default_rng(5))
    everything = np.array([1e3]), np.array([0.0]), np.array([1e3])
    assert chosen(grid, everything, everything, 1.0) is None


def test_only_v_looks_at_one_v_set() -> None:
    grid = Grid(i_set_a=np.array([1.0]), v_set_pu=np.array([0.01, 0.02]), z_set_ohm=np.array([5.0]))
    opens = np.array([2.0]), np.array([0.015]), np.array([9.0])
    false = np.array([9.0]), np.array([0.03]), np.array([9.0])
    low, high = (chosen(grid, opens, false, 1.25, only_v=n) for n in (0, 1))
    assert low is not None
    assert high is not None
    assert (low.v_set_pu, low.detected) == (0.01, 0)
    assert (high.v_set_pu, high.detected) == (0.02, 1)
    # at a larger margin only the lower V_set is left
    assert chosen(grid, opens, false, 1.5, only_v=1) is None
    assert chosen(grid, opens, false, 1.5) is not None


@pytest.mark.parametrize("seed", range(40))
def test_more_events_that_must_not_trip_never_find_more_breaks(seed: int) -> None:
    grid, opens, false, margin = instance(seed, 43)
    rng = np.random.default_rng([44, seed])
    more = random_events(rng, 12, (grid.i_set_a, grid.v_set_pu, grid.z_set_ohm))
    before = None
    for n in range(13):
        events = tuple(np.concatenate((a, 0.7 * b[:n])) for a, b in zip(false, more, strict=True))
        # no trials: no standard error, so that only the count of the best is looked at
        choice = chosen(grid, opens, events, margin, trials=0)  # type: ignore[arg-type]
        found = -1 if choice is None else choice.detected
        assert before is None or found <= before
        before = found


def test_inputs_stay_as_they_were() -> None:
    grid, opens, false, margin = instance(7, 42)
    corners, edge = corners_of(grid, *opens), front(false)
    copy = Corners(cell=corners.cell.copy(), count=corners.count.copy())
    di1_a = edge.di1_a.copy()
    sample = Sample(opens=corners, stiff=corners, trials=opens[0].size, front=edge)
    choose(grid, sample, margin, REFERENCE)
    np.testing.assert_array_equal(corners.cell, copy.cell)
    np.testing.assert_array_equal(corners.count, copy.count)
    np.testing.assert_array_equal(edge.di1_a, di1_a)
