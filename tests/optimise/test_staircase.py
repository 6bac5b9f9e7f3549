"""Fronts against pairwise comparison, margins against bisection."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.scalar_detector import (
    Events,
    brute_front,
    brute_margin,
    decimals,
    random_events,
    trips,
)

from openphase.optimise.staircase import Front, front_of, margins, merge_fronts, nearest

GRIDS = decimals(1, 12), decimals(2, 9, 1000), decimals(1, 20)


def scenarios(rng: np.random.Generator, size: int) -> NDArray[np.int64]:
    """Names of events, unique and in no order."""
    number = rng.permutation(size)
    return np.column_stack((number % 3, number // 3 % 5, number // 15))


def fronts_equal(one: Front, other: Front) -> bool:
    names = ("di1_a", "dv1_pu", "reach_ohm", "scenario")
    return all(np.array_equal(getattr(one, n), getattr(other, n)) for n in names)


def instance(seed: int, *key: int) -> tuple[Events, NDArray[np.int64]]:
    """Few or many events; half of the instances lie wholly on coarse grids, full of duplicates."""
    rng = np.random.default_rng([*key, seed])
    size = int(rng.choice([0, 1, 2, 10, 70, 250]))
    events = random_events(rng, size, GRIDS)
    if seed % 2:
        events = tuple(  # type: ignore[assignment]
            np.where(x > 0, grid[np.minimum(np.searchsorted(grid, x), grid.size - 1)], 0.0)
            for x, grid in zip(events, GRIDS, strict=True)
        )
    return events, scenarios(rng, size)


@pytest.mark.parametrize("seed", range(60))
def test_the_front_is_what_nothing_outdoes(seed: int) -> None:
    events, scenario = instance(seed, 31)
    expected = brute_front(events, scenario)
    front = front_of(*events, scenario)
    assert front.size == len(expected)
    for found, given in zip(
        (front.di1_a, front.dv1_pu, front.reach_ohm, front.scenario),
        (*events, scenario),
        strict=True,
    ):
        np.testing.assert_array_equal(found, given[expected])


def test_a_long_front_survives_the_first_pass() -> None:
    """Hyperbolas, as noise makes them: hundreds of events, none of which outdoes another."""
    di1_a = np.geomspace(0.1, 10.0, 500)
    events = di1_a, np.full(500, 0.01), 5.0 / di1_a
    scenario = np.column_stack([np.arange(500)] * 3)
    assert front_of(*events, scenario).size == 500
    lower = (di1_a * 0.999, np.full(500, 0.01), 5.0 / di1_a * 0.999)
    both = [np.concatenate(pair) for pair in zip(lower, events, strict=True)]
    front = front_of(*both, np.column_stack([np.arange(1000)] * 3))
    assert (front.scenario[:, 0] >= 500).sum() == 500


def test_of_equal_events_the_first_scenario_stays() -> None:
    same = np.full(200, 1.0)
    scenario = np.column_stack((np.zeros(200), np.arange(200)[::-1], np.zeros(200))).astype(int)
    front = front_of(same, same, same, scenario)
    assert front.scenario.tolist() == [[0, 0, 0]]


@pytest.mark.parametrize("seed", range(20))
def test_the_front_of_fronts_is_the_front_of_all(seed: int) -> None:
    events, scenario = instance(seed, 32)
    rng = np.random.default_rng([33, seed])
    whole = front_of(*events, scenario)
    part = rng.integers(0, 5, scenario.shape[0])
    parts = [front_of(*(x[part == n] for x in events), scenario[part == n]) for n in range(5)]
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


@pytest.mark.parametrize("seed", range(24))
def test_margins_are_where_the_first_event_trips(seed: int) -> None:
    """Of the front, and so of all events: the others add nothing."""
    events, scenario = instance(seed, 34)
    front = front_of(*events, scenario)
    rng = np.random.default_rng([35, seed])
    settings = [rng.choice(grid, 6) for grid in GRIDS]
    found = margins(front, *settings)
    expected = [brute_margin(events, *row) for row in zip(*settings, strict=True)]
    # without a voltage change V_set never binds, without a reach or a current nothing trips
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    for n, (i, v, z) in enumerate(zip(*settings, strict=True)):
        at, factor = nearest(front, i, v, z)
        if at < 0:
            continue
        assert factor == found[n]
        event = front.di1_a[at], front.dv1_pu[at], front.reach_ohm[at]
        assert trips(event, i / factor * (1 - 1e-12), v * factor * (1 + 1e-12), 0.0)
        assert not trips(event, i / factor * 1.001, v * factor * 0.999, z / factor * 1.001)


def test_a_margin_below_one_is_a_false_trip() -> None:
    event = (np.array([2.0]), np.array([0.01]), np.array([10.0]))
    front = front_of(*event, np.zeros((1, 3), np.int64))
    i, v, z = np.array([1.0, 1.0, 3.0]), np.array([0.05, 0.02, 0.05]), np.array([5.0, 8.0, 5.0])
    np.testing.assert_allclose(margins(front, i, v, z), [0.5, 0.8, 1.5])


def test_margins_of_many_settings_are_those_of_each() -> None:
    rng = np.random.default_rng(36)
    events = random_events(rng, 40, GRIDS)
    front = front_of(*events, scenarios(rng, 40))
    settings = [rng.choice(grid, 10_000) for grid in GRIDS]
    found = margins(front, *settings)
    for n in (0, 4095, 4096, 8191, 8192, 9999):
        assert found[n] == nearest(front, *(float(x[n]) for x in settings))[1]
