"""Fronts against pairwise comparison, margins against trying every relaxation."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.brute_settings import (
    Events,
    brute_front,
    brute_margin,
    decimals,
    degenerate,
    on_grid,
    random_events,
    rows_of,
    scaled,
    trips,
)

from openphase.optimise.staircase import (
    HEAD,
    Front,
    border,
    factors,
    front_of,
    margins,
    merge_fronts,
    nearest,
)

GRIDS = decimals(1, 12), decimals(2, 9, 1000), decimals(1, 20)
FIELDS = ("di_a", "dv_pu", "z_ohm", "cap_a", "scenario")


def scenarios(rng: np.random.Generator, size: int) -> NDArray[np.int64]:
    """Names of events, unique and in no order."""
    number = rng.permutation(size)
    return np.column_stack((number % 3, number // 3 % 5, number // 15))


def fronts_equal(one: Front, other: Front) -> bool:
    return all(np.array_equal(getattr(one, n), getattr(other, n)) for n in FIELDS)


def instance(seed: int, *key: int, rows: int | None) -> tuple[Events, NDArray[np.int64]]:
    """Few or many events; half of the instances lie wholly on coarse grids, full of duplicates."""
    rng = np.random.default_rng([*key, seed])
    size = int(rng.choice([0, 1, 2, 10, 70, 250]))
    if rows is not None:
        size //= rows - 1  # brute force looks at pairs of rows
    events = random_events(rng, size, GRIDS, rows)
    if seed % 2:
        events = on_grid(events, GRIDS)
    return events, scenarios(rng, size)


@pytest.mark.parametrize("rows", [None, 2, 4])
@pytest.mark.parametrize("seed", range(40))
def test_the_front_is_what_nothing_outdoes(seed: int, rows: int | None) -> None:
    events, scenario = instance(seed, 31, rows=rows)
    expected = brute_front(events, scenario)
    front = front_of(*events, scenario)
    found = zip(front.di_a, front.dv_pu, front.z_ohm, front.cap_a, strict=True)
    assert [tuple(map(float, row)) for row in found] == [row for row, _ in expected]
    assert [tuple(name) for name in front.scenario.tolist()] == [name for _, name in expected]


def test_a_long_front_survives_whole() -> None:
    """Hyperbolas, as noise makes them: hundreds of events, none of which outdoes another."""
    di_a = np.geomspace(0.1, 10.0, 8 * HEAD)
    events = di_a, np.full(di_a.size, 0.01), 5.0 / di_a
    scenario = np.column_stack([np.arange(di_a.size)] * 3)
    assert front_of(*events, scenario).size == di_a.size
    lower = (di_a * 0.999, np.full(di_a.size, 0.01), 5.0 / di_a * 0.999)
    both = [np.concatenate(pair) for pair in zip(lower, events, strict=True)]
    front = front_of(*both, np.column_stack([np.arange(2 * di_a.size)] * 3))
    assert (front.scenario[:, 0] >= di_a.size).all()
    assert front.size == di_a.size


def test_of_equal_events_the_first_scenario_stays() -> None:
    same = np.full(200, 1.0)
    scenario = np.column_stack((np.zeros(200), np.arange(200)[::-1], np.zeros(200))).astype(int)
    front = front_of(same, same, same, scenario)
    assert front.scenario.tolist() == [[0, 0, 0]]


def test_scenarios_may_have_names_of_any_length() -> None:
    same = np.full(3, 1.0)
    front = front_of(same, same, same, np.array([[1, 1], [1, 0], [2, 0]]))
    assert front.scenario.tolist() == [[1, 0]]
    assert merge_fronts([front, front]).scenario.tolist() == [[1, 0]]


def test_rows_without_a_number_are_in_no_front() -> None:
    for quantity in range(3):
        for row, left in ((0, 1 if quantity else 0), (1, 1)):
            event = np.array([[1.0], [9.0]]), np.zeros((2, 1)), np.full((2, 1), 9.0)
            event[quantity][row] = np.nan
            front = front_of(*event, np.zeros((1, 3), np.int64))
            assert front.size == left
            assert all(np.isfinite(getattr(front, name)).all() for name in FIELDS)


@pytest.mark.parametrize("rows", [None, 4])
@pytest.mark.parametrize("seed", range(20))
def test_the_front_of_fronts_is_the_front_of_all(seed: int, rows: int | None) -> None:
    events, scenario = instance(seed, 32, rows=rows)
    rng = np.random.default_rng([33, seed])
    whole = front_of(*events, scenario)
    part = rng.integers(0, 5, scenario.shape[0])
    parts = [front_of(*(x[..., part == n] for x in events), scenario[part == n]) for n in range(5)]
    for _ in range(3):
        parts = [parts[n] for n in rng.permutation(len(parts))]
        assert fronts_equal(merge_fronts(parts), whole)
    assert fronts_equal(merge_fronts([merge_fronts(parts[:2]), *parts[2:]]), whole)
    assert fronts_equal(merge_fronts([whole, whole]), whole)


def test_no_fronts_make_an_empty_front() -> None:
    front = merge_fronts([])
    assert front.size == 0
    assert nearest(front, 1.0, 0.05, 5.0) == (-1, np.inf)
    assert margins(front, np.ones(3), np.ones(3), np.ones(3)).tolist() == [np.inf] * 3
    assert [x.size for x in border(front, 0.05)] == [0, 0]


@pytest.mark.parametrize("rows", [None, 2, 4])
@pytest.mark.parametrize("seed", range(24))
def test_margins_are_where_the_first_event_trips(seed: int, rows: int | None) -> None:
    """Of the front, and so of all events: the others add nothing."""
    events, scenario = instance(seed, 34, rows=rows)
    front = front_of(*events, scenario)
    rng = np.random.default_rng([35, seed])
    settings = [rng.choice(grid, 8) for grid in GRIDS]
    found = margins(front, *settings)
    everything = rows_of(events)
    for n, setting in enumerate(zip(*(x.tolist() for x in settings), strict=True)):
        # below one exactly where it trips, whatever a division rounds to
        assert (found[n] <= 1.0) == any(trips(each, *setting) for each in everything)
        at, factor = nearest(front, *setting)
        assert factor == found[n]
        assert (at < 0) == (front.size == 0)
        # without a reach or a current nothing trips; a row that ends where it begins is none
        if not degenerate(events, *setting):
            assert found[n] == pytest.approx(brute_margin(events, *setting), rel=1e-9)


@pytest.mark.parametrize("seed", range(30))
def test_between_one_and_the_margin_nothing_trips_and_beyond_it_something(seed: int) -> None:
    """By asking the events themselves at many relaxations."""
    events, scenario = instance(seed, 37, rows=4)
    front = front_of(*events, scenario)
    rng = np.random.default_rng([38, seed])
    everything = rows_of(events)
    for _ in range(5):
        i, v, z = (float(rng.choice(grid)) for grid in GRIDS)
        room = nearest(front, i, v, z)[1]
        if room <= 1.0:
            continue
        for m in np.geomspace(1.0, min(room, 100.0) * (1 - 1e-9), 20):
            assert not any(trips(rows, i / m, v * m, z / m) for rows in everything)
        if room < np.inf and not degenerate(events, i, v, z):
            m = room * (1 + 1e-9)
            assert any(trips(rows, i / m, v * m, z / m) for rows in everything)


def test_a_margin_below_one_is_a_false_trip() -> None:
    event = (np.array([2.0]), np.array([0.01]), np.array([10.0]))
    front = front_of(*event, np.zeros((1, 3), np.int64))
    i, v, z = np.array([1.0, 1.0, 3.0]), np.array([0.05, 0.02, 0.05]), np.array([5.0, 8.0, 5.0])
    np.testing.assert_allclose(margins(front, i, v, z), [0.5, 0.8, 1.5])


def test_a_cap_protects_the_settings_below_it() -> None:
    """A phase's row above 2 A; the base row has no reach. One column per case."""
    event = np.array([[2.0], [6.0]]), np.full((2, 1), 0.01), np.array([[0.0], [10.0]])
    front = front_of(*event, np.zeros((1, 3), np.int64))
    assert front.cap_a.tolist() == [2.0]
    cases = {
        (3.0, 0.02, 5.0): 0.5,  # trips
        (2.0, 0.02, 5.0): np.inf,  # at the cap, and lower still when relaxed
        (1.0, 0.02, 5.0): np.inf,
        (9.0, 0.02, 5.0): 1.5,  # trips from 6 A down
        (3.0, 0.02, 14.0): 1.4,  # 3 A/1.4 is still above the cap
        (3.0, 0.02, 15.0): np.inf,  # 3 A/1.5 is not
        (3.0, 0.008, 5.0): 1.25,
        (3.0, 0.005, 5.0): np.inf,
    }
    each = np.array(list(cases)).T
    np.testing.assert_allclose(margins(front, *each), list(cases.values()))
    np.testing.assert_allclose(factors(front, *each)[0], list(cases.values()))


def test_margins_of_many_settings_are_those_of_each() -> None:
    rng = np.random.default_rng(36)
    events = random_events(rng, 40, GRIDS, 4)
    front = front_of(*events, scenarios(rng, 40))
    settings = [rng.choice(grid, 200_000) for grid in GRIDS]
    found = margins(front, *settings)
    for n in (0, 4095, 4096, 50_000, 100_000, 199_999):
        assert found[n] == nearest(front, *(float(x[n]) for x in settings))[1]


def height(line: tuple[NDArray[np.float64], NDArray[np.float64]], i: float) -> float:
    """Z on the line at a current that is none of its corners."""
    x, y = line
    return float(np.interp(i, x, y, right=0.0)) if x.size else 0.0


@pytest.mark.parametrize("rows", [None, 2, 4])
@pytest.mark.parametrize("margin", [1.0, 1.25, 2.0])
@pytest.mark.parametrize("seed", range(12))
def test_below_the_border_is_what_does_not_keep_the_margin(
    seed: int, margin: float, rows: int | None
) -> None:
    events, scenario = instance(seed, 39, rows=rows)
    front = front_of(*events, scenario)
    rng = np.random.default_rng([40, seed])
    for v in (0.0015, 0.0045, 0.02):
        line = border(front, v, margin)
        inside = 0
        for i in rng.uniform(0.01, 2.5, 40).tolist():
            top = height(line, i)
            for z in (0.001, *rng.uniform(0.0, 4.0, 4), top * 0.999, top * 1.001):
                if z > 0 and abs(z - top) > 1e-6:
                    room = margins(front, np.array([i]), np.array([v]), np.array([z]))[0]
                    assert (room <= margin) == (z < top)
                    inside += z < top
        assert inside or not line[0].size


@pytest.mark.parametrize("seed", range(20))
def test_without_caps_the_border_is_a_staircase(seed: int) -> None:
    """Down only; twice as many corners as events on it, and one; the margin scales it."""
    events, scenario = instance(seed, 41, rows=None)
    front = front_of(*events, scenario)
    i, z = border(front, 0.005, 1.25)
    assert (np.diff(i) >= 0).all()
    assert (np.diff(z) <= 0).all()
    assert ((np.diff(i) == 0) | (np.diff(z) == 0)).all()
    if i.size:
        assert i[0] == 0 < z[0]
        assert z[-1] == 0
        assert i.size % 2 == 1
    larger = scaled(events, 1.25)
    np.testing.assert_allclose(border(front_of(*larger, scenario), 0.005), (i, z))
