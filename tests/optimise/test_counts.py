"""The count tensor against asking every event at every setting."""

from __future__ import annotations

import numpy as np
import pytest
from oracles.scalar_detector import brute_counts, decimals, random_events, random_grid

from openphase.optimise.counts import Corners, Grid, corners_of, count_tensor, merge


def corners_equal(one: Corners, other: Corners) -> bool:
    return np.array_equal(one.cell, other.cell) and np.array_equal(one.count, other.count)


@pytest.mark.parametrize("seed", range(200))
def test_every_setting_counts_what_the_detector_counts(seed: int) -> None:
    rng = np.random.default_rng([21, seed])
    grid = random_grid(rng)
    size = int(rng.integers(0, 60))
    events = random_events(rng, size, (grid.i_set_a, grid.v_set_pu, grid.z_set_ohm))
    corners = corners_of(grid, *events)
    np.testing.assert_array_equal(count_tensor(grid, corners), brute_counts(grid, events))
    assert (np.diff(corners.cell) > 0).all()
    assert (corners.count > 0).all()


@pytest.mark.parametrize("seed", range(20))
def test_parts_in_any_order_are_the_whole(seed: int) -> None:
    rng = np.random.default_rng([22, seed])
    grid = random_grid(rng)
    events = random_events(rng, 400, (grid.i_set_a, grid.v_set_pu, grid.z_set_ohm))
    part = rng.integers(0, 7, 400)  # some may be empty
    parts = [corners_of(grid, *(x[part == n] for x in events)) for n in range(8)]
    whole = corners_of(grid, *events)
    for _ in range(3):
        parts = [parts[n] for n in rng.permutation(len(parts))]
        assert corners_equal(merge(parts), whole)
    assert corners_equal(merge([merge(parts[:3]), merge(parts[3:])]), whole)
    np.testing.assert_array_equal(
        sum(count_tensor(grid, own) for own in parts), count_tensor(grid, whole)
    )


def test_every_decimal_of_a_relay_falls_in_its_own_cell() -> None:
    """floor(x / 0.1) misplaces a third of these; comparing with the same floats none."""
    z = decimals(1, 500)
    grid = Grid(i_set_a=np.array([1.0]), v_set_pu=np.array([0.05]), z_set_ohm=z)
    for n, value in enumerate(z):
        one = np.array([value])
        found = count_tensor(grid, corners_of(grid, np.array([1.0]), np.array([0.05]), one))
        assert found.sum() == n + 1
        below = np.nextafter(one, 0.0)
        found = count_tensor(grid, corners_of(grid, np.array([1.0]), np.array([0.05]), below))
        assert found.sum() == n


def test_nothing_makes_nothing() -> None:
    grid = random_grid(np.random.default_rng(1))
    nothing = np.empty(0)
    assert merge([]).cell.size == 0
    assert count_tensor(grid, merge([])).sum() == 0
    assert count_tensor(grid, corners_of(grid, nothing, nothing, nothing)).shape == grid.shape


def test_events_beyond_the_grid_count_at_its_end_or_nowhere() -> None:
    grid = Grid(i_set_a=decimals(1, 3), v_set_pu=np.array([0.01, 0.05]), z_set_ohm=decimals(10, 12))
    huge, small = np.array([1e9]), np.array([0.0])
    assert (count_tensor(grid, corners_of(grid, huge, small, huge)) == 1).all()
    for event in ((small, small, huge), (huge, huge, huge), (huge, small, small)):
        assert corners_of(grid, *event).cell.size == 0


def test_inputs_stay_as_they_were() -> None:
    rng = np.random.default_rng(3)
    grid = random_grid(rng)
    events = random_events(rng, 50, (grid.i_set_a, grid.v_set_pu, grid.z_set_ohm))
    copies = [x.copy() for x in events]
    corners = corners_of(grid, *events)
    before = corners.count.copy()
    merge([corners, corners])
    count_tensor(grid, corners)
    np.testing.assert_array_equal(corners.count, before)
    for event, copy in zip(events, copies, strict=True):
        np.testing.assert_array_equal(event, copy)
