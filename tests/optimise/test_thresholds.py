"""The chosen setting against a search through the whole grid."""

from __future__ import annotations

import math
from itertools import chain, product

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.brute_settings import (
    Events,
    brute_counts,
    brute_margin,
    numbered,
    random_events,
    random_grid,
    rows_of,
    scaled,
)

from openphase.optimise.counts import Corners, Grid, corners_of, merge
from openphase.optimise.staircase import Front, front_of
from openphase.optimise.thresholds import (
    Choice,
    Obstacle,
    Refusal,
    Sample,
    allowed,
    choose,
    pool,
)
from openphase.optimise.windows import Window

REFERENCE = 0.5, 0.004, 0.6
Instance = tuple[Grid, Events, Events, float]


def instance(seed: int, *key: int, rows: int | None = None) -> Instance:
    """A grid, breaks, events that must not trip, and a margin."""
    rng = np.random.default_rng([*key, seed])
    grid = random_grid(rng)
    grids = grid.i_set_a, grid.v_set_pu, grid.z_set_ohm
    opens = random_events(rng, int(rng.integers(0, 80)), grids, rows)
    false = random_events(rng, int(rng.integers(0, 8)), grids, rows)
    margin = float(rng.choice([1.0, 1.1, 1.25]))
    # leave room for settings above the false trips
    false = scaled(false, 0.6)
    if rows is not None:
        # rows that begin to trip just where they end are for other tests
        false[2][1:] *= 0.97
        false[1][1:] *= 1.01
    return grid, opens, false, margin


def front(events: Events) -> Front:
    return front_of(*events, numbered(events[0].shape[-1]))


def sampled(
    grid: Grid, opens: Events, false: Events, margin: float, trials: int | None = None
) -> Sample:
    return Sample(
        opens=corners_of(grid, *opens),
        stiff=corners_of(grid, *scaled(opens, 1.0 / margin)),
        trials=opens[0].shape[-1] if trials is None else trials,
        front=front(false),
    )


def chosen(
    grid: Grid,
    opens: Events,
    false: Events,
    margin: float,
    trials: int | None = None,
    only_v: int | None = None,
    window: Window | None = None,
) -> Choice | Refusal:
    sample = sampled(grid, opens, false, margin, trials)
    return choose(grid, sample, margin, REFERENCE, only_v, window)


def kept(grid: Grid, false: Events) -> NDArray[np.float64]:
    """The margin of every setting, shape ``grid.shape``, each by itself."""
    room = np.empty(grid.shape)
    for v, i, z in product(*(range(n) for n in grid.shape)):
        setting = float(grid.i_set_a[i]), float(grid.v_set_pu[v]), float(grid.z_set_ohm[z])
        room[v, i, z] = brute_margin(false, *setting)
    return room


def row_by_row(false: Events, i: float, v: float, z: float) -> float:
    """The margin, to the last bit; that it is one is for the tests of margins to say."""
    least = math.inf
    for di_a, dv_pu, z_ohm, cap_a in chain.from_iterable(rows_of(false)):
        if di_a > cap_a and z_ohm > 0:
            factor = max(i / di_a, z / z_ohm, dv_pu / v)
            if i > cap_a * max(factor, 1.0):
                least = min(least, factor)
    return least


def keeps(grid: Grid, false: Events, margin: float) -> NDArray[np.bool_]:
    """Settings at which no event of base rows trips, not even magnified by the margin."""
    return np.asarray(brute_counts(grid, scaled(false, margin)) == 0)


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
    room = kept(grid, false)
    clear = ~np.isclose(room, margin, rtol=1e-9)
    np.testing.assert_array_equal(expected[clear], (room > margin)[clear])


@pytest.mark.parametrize("rows", [2, 4])
@pytest.mark.parametrize("seed", range(60))
def test_allowed_settings_keep_the_margin_beyond_caps_too(seed: int, rows: int) -> None:
    grid, _, false, margin = instance(seed, 45, rows=rows)
    edge = front(false)
    # without a margin to the last bit
    np.testing.assert_array_equal(allowed(grid, edge, 1.0), brute_counts(grid, false) == 0)
    found, room = allowed(grid, edge, margin), kept(grid, false)
    clear = ~np.isclose(room, margin, rtol=1e-9)
    np.testing.assert_array_equal(found[clear], (room > margin)[clear])


def test_magnified_events_are_not_enough_beyond_caps() -> None:
    """Magnified, the row begins at 2.5 A; relaxed by 1.1 already, 2.3 A trips."""
    event = np.array([[2.0], [6.0]]), np.zeros((2, 1)), np.array([[0.0], [10.0]])
    grid = Grid(
        i_set_a=np.array([2.0, 2.3, 3.0]), v_set_pu=np.array([0.05]), z_set_ohm=np.array([11.0])
    )
    assert allowed(grid, front(event), 1.25)[0, :, 0].tolist() == [True, False, False]
    assert keeps(grid, event, 1.25)[0, :, 0].tolist() == [True, True, False]


@pytest.mark.parametrize("bits", range(40))
def test_just_above_a_cap_a_row_counts(bits: int) -> None:
    """Whatever the quotient of two neighbouring floats rounds to."""
    cap = 1.0 + bits / 40.0
    event = np.array([[cap], [6.0]]), np.zeros((2, 1)), np.array([[0.0], [10.0]])
    grid = Grid(
        i_set_a=np.array([cap, np.nextafter(cap, 9.0)]),
        v_set_pu=np.array([0.05]),
        z_set_ohm=np.array([10.0, 12.0]),
    )
    for margin in (1.0, 1.25):
        free = allowed(grid, front(event), margin)[0]
        assert free.tolist() == [[True, True], [False, True]]


@pytest.mark.parametrize("rows", [None, 4])
@pytest.mark.parametrize("seed", range(100))
def test_the_choice_is_the_best_of_the_grid(seed: int, rows: int | None) -> None:
    """Most breaks found less a standard error; then security, stiff breaks, the reference."""
    grid, opens, false, margin = instance(seed, 42, rows=rows)
    only_v = None if seed % 3 else int(seed % grid.shape[0])
    window = None
    if seed % 2:
        low, high = np.sort(np.random.default_rng([46, seed]).choice(grid.z_set_ohm, 2))
        window = Window(low_ohm=float(low), high_ohm=float(high))
    choice = chosen(grid, opens, false, margin, only_v=only_v, window=window)
    # the same bits as the product where base rows are alone; with caps, see the tests of allowed
    free = keeps(grid, false, margin) if rows is None else allowed(grid, front(false), margin)
    if only_v is not None:
        free[[v for v in range(grid.shape[0]) if v != only_v]] = False
    outside = free.copy()
    if window is not None:
        free[:, :, (grid.z_set_ohm < window.low_ohm) | (grid.z_set_ohm > window.high_ohm)] = False
    if not free.any():
        assert isinstance(choice, Refusal)
        assert (choice.obstacle == Obstacle.WINDOW_MARGIN) == outside.any()
        return
    found = brute_counts(grid, opens)
    stiff = brute_counts(grid, scaled(opens, 1.0 / margin))
    best, trials = int(found[free].max()), opens[0].shape[-1]
    error = math.sqrt(best * (1.0 - best / trials)) if trials else 0.0
    ranks = {}
    for v, i, z in zip(*np.nonzero(free & (found >= best - error)), strict=True):
        setting = float(grid.i_set_a[i]), float(grid.v_set_pu[v]), float(grid.z_set_ohm[z])
        security = row_by_row(false, *setting)
        distance = sum(abs(math.log(x / y)) for x, y in zip(setting, REFERENCE, strict=True))
        ranks[v, i, z] = (-security, -int(stiff[v, i, z]), distance)
    assert isinstance(choice, Choice)
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
    assert isinstance(choice, Choice)
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
        assert isinstance(choice, Choice)
        assert choice.i_set_a == i_set_a
        assert choice.detected == (80 if i_set_a == 1.0 else 80 - weak)


def test_a_refusal_names_the_most_secure_setting() -> None:
    grid = random_grid(np.random.default_rng(5))
    everything = np.array([1e3]), np.array([0.0]), np.array([1e3])
    refusal = chosen(grid, everything, everything, 1.0)
    assert isinstance(refusal, Refusal)
    assert refusal.obstacle == Obstacle.MARGIN
    assert refusal.closest is not None
    assert place(grid, refusal.closest) == (0, grid.shape[1] - 1, grid.shape[2] - 1)
    assert refusal.closest.detected == 1
    assert refusal.closest.margin == max(grid.i_set_a[-1], grid.z_set_ohm[-1]) / 1e3


@pytest.mark.parametrize("rows", [None, 4])
@pytest.mark.parametrize("seed", range(40))
def test_no_setting_is_more_secure_than_the_one_a_refusal_names(
    seed: int, rows: int | None
) -> None:
    """With caps that need not be the strictest one."""
    grid, opens, false, _ = instance(seed, 47, rows=rows)
    window = Window(low_ohm=float(grid.z_set_ohm[0]), high_ohm=float(grid.z_set_ohm[1]))
    refusal = chosen(grid, opens, false, 1e9, window=window)
    room = kept(grid, false)[:, :, :2]
    if np.isinf(room).any():
        assert isinstance(refusal, Choice)
        return
    assert isinstance(refusal, Refusal)
    assert refusal.closest is not None
    assert refusal.closest.margin == pytest.approx(room.max())
    assert window.holds(np.array([refusal.closest.z_set_ohm])).all()


def test_a_larger_current_may_be_less_secure_beyond_a_cap() -> None:
    grid = Grid(i_set_a=np.array([1.0, 3.0]), v_set_pu=np.array([0.05]), z_set_ohm=np.array([5.0]))
    false = np.array([[0.9, 2.0], [0.0, 9.0]]), np.zeros((2, 2)), np.array([[9.0, 0.0], [0.0, 9.0]])
    refusal = chosen(grid, false, false, 1.25)
    assert isinstance(refusal, Refusal)
    assert refusal.closest is not None
    assert refusal.closest.i_set_a == 1.0
    assert refusal.closest.margin == pytest.approx(1.0 / 0.9)


def test_the_obstacles_of_a_window_are_told_apart() -> None:
    grid = Grid(
        i_set_a=np.array([1.0]), v_set_pu=np.array([0.05]), z_set_ohm=np.array([1.0, 2.0, 3.0])
    )
    nothing = np.empty(0), np.empty(0), np.empty(0)
    false = np.array([5.0]), np.array([0.0]), np.array([2.0])
    everything = np.array([5.0]), np.array([0.0]), np.array([9.0])
    for events, low, high, expected, closest in (
        (nothing, 1.4, 1.2, Obstacle.EMPTY_WINDOW, None),
        (nothing, 1.2, 1.4, Obstacle.COARSE_DEVICE, None),
        (false, 1.0, 2.0, Obstacle.WINDOW_MARGIN, 2.0),
        (everything, 1.0, 2.0, Obstacle.MARGIN, 2.0),
    ):
        window = Window(low_ohm=low, high_ohm=high)
        refusal = chosen(grid, nothing, events, 1.25, window=window)
        assert isinstance(refusal, Refusal)
        assert refusal.obstacle == expected
        assert (refusal.closest and refusal.closest.z_set_ohm) == closest
    # both ends belong to the window
    for low, high in ((2.0, 2.4), (1.6, 2.0)):
        choice = chosen(grid, nothing, nothing, 1.25, window=Window(low_ohm=low, high_ohm=high))
        assert isinstance(choice, Choice)
        assert choice.z_set_ohm == 2.0


@pytest.mark.parametrize("rows", [None, 4])
@pytest.mark.parametrize("seed", range(30))
def test_one_setting_for_several_states_is_that_of_all_their_events(
    seed: int, rows: int | None
) -> None:
    grid, opens, false, margin = instance(seed, 48, rows=rows)
    rng = np.random.default_rng([49, seed])
    which = [rng.integers(0, 3, events[0].shape[-1]) for events in (opens, false)]
    parts = []
    for n in range(3):
        some = [
            tuple(x[..., own == n] for x in events)
            for events, own in zip((opens, false), which, strict=True)
        ]
        parts.append(sampled(grid, some[0], some[1], margin))  # type: ignore[arg-type]
    whole, both = sampled(grid, opens, false, margin), pool(parts)
    assert both.trials == whole.trials
    np.testing.assert_array_equal(both.opens.cell, whole.opens.cell)
    np.testing.assert_array_equal(both.opens.count, whole.opens.count)
    one, other = (choose(grid, own, margin, REFERENCE) for own in (whole, both))
    assert one == other
    assert merge([]).cell.size == pool([]).opens.cell.size == 0


def test_only_v_looks_at_one_v_set() -> None:
    grid = Grid(i_set_a=np.array([1.0]), v_set_pu=np.array([0.01, 0.02]), z_set_ohm=np.array([5.0]))
    opens = np.array([2.0]), np.array([0.015]), np.array([9.0])
    false = np.array([9.0]), np.array([0.03]), np.array([9.0])
    low, high = (chosen(grid, opens, false, 1.25, only_v=n) for n in (0, 1))
    assert isinstance(low, Choice)
    assert isinstance(high, Choice)
    assert (low.v_set_pu, low.detected) == (0.01, 0)
    assert (high.v_set_pu, high.detected) == (0.02, 1)
    # at a larger margin only the lower V_set is left
    assert isinstance(chosen(grid, opens, false, 1.5, only_v=1), Refusal)
    assert isinstance(chosen(grid, opens, false, 1.5), Choice)


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
        found = choice.detected if isinstance(choice, Choice) else -1
        assert before is None or found <= before
        before = found


def test_inputs_stay_as_they_were() -> None:
    grid, opens, false, margin = instance(7, 42)
    corners, edge = corners_of(grid, *opens), front(false)
    copy = Corners(cell=corners.cell.copy(), count=corners.count.copy())
    di_a = edge.di_a.copy()
    sample = Sample(opens=corners, stiff=corners, trials=opens[0].size, front=edge)
    choose(grid, sample, margin, REFERENCE)
    np.testing.assert_array_equal(corners.cell, copy.cell)
    np.testing.assert_array_equal(corners.count, copy.count)
    np.testing.assert_array_equal(edge.di_a, di_a)
