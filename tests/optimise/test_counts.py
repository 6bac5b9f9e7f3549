"""The count tensor against asking every event at every setting."""

from __future__ import annotations

import numpy as np
import pytest
from oracles.brute_settings import brute_counts, decimals, on_grid, random_events, random_grid

from openphase.optimise.counts import Corners, Grid, corners_of, count_tensor, merge


def corners_equal(one: Corners, other: Corners) -> bool:
    return np.array_equal(one.cell, other.cell) and np.array_equal(one.count, other.count)


@pytest.mark.parametrize("rows", [None, 1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(100))
def test_every_setting_counts_what_the_detector_counts(seed: int, rows: int | None) -> None:
    rng = np.random.default_rng([21, seed])
    grid = random_grid(rng)
    grids = grid.i_set_a, grid.v_set_pu, grid.z_set_ohm
    events = random_events(rng, int(rng.integers(0, 60)), grids, rows)
    if seed % 3 == 0:
        events = on_grid(events, grids)
    corners = corners_of(grid, *events)
    np.testing.assert_array_equal(count_tensor(grid, corners), brute_counts(grid, events))
    assert (np.diff(corners.cell) > 0).all()
    assert (corners.count != 0).all()
    if rows in (None, 1):
        assert (corners.count > 0).all()


@pytest.mark.parametrize("rows", [None, 4])
@pytest.mark.parametrize("seed", range(20))
def test_parts_in_any_order_are_the_whole(seed: int, rows: int | None) -> None:
    rng = np.random.default_rng([22, seed])
    grid = random_grid(rng)
    events = random_events(rng, 400, (grid.i_set_a, grid.v_set_pu, grid.z_set_ohm), rows)
    part = rng.integers(0, 7, 400)  # some may be empty
    parts = [corners_of(grid, *(x[..., part == n] for x in events)) for n in range(8)]
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


@pytest.mark.parametrize("n", range(50))
def test_a_fallback_row_begins_at_the_first_setting_above_the_cap(n: int) -> None:
    """I_set equal to |ΔI1| is the base row's, to the last bit."""
    grid = Grid(i_set_a=decimals(1, 50), v_set_pu=np.array([0.05]), z_set_ohm=np.array([5.0]))
    for cap, first in ((grid.i_set_a[n], n + 1), (np.nextafter(grid.i_set_a[n], 0.0), n)):
        event = np.array([[cap], [9.0]]), np.full((2, 1), 0.01), np.array([[0.0], [9.0]])
        found = count_tensor(grid, corners_of(grid, *event))[0, :, 0]
        np.testing.assert_array_equal(found, np.arange(50) >= first)


def test_rows_without_a_number_trip_nothing() -> None:
    grid = Grid(i_set_a=decimals(1, 3), v_set_pu=np.array([0.01, 0.05]), z_set_ohm=decimals(1, 3))
    fine = np.array([[0.1], [9.0]]), np.zeros((2, 1)), np.full((2, 1), 9.0)
    assert count_tensor(grid, corners_of(grid, *fine)).all()
    for quantity in range(3):
        for row, left in ((0, 2 / 3 if quantity else 0.0), (1, 1 / 3)):
            event = tuple(x.copy() for x in fine)
            event[quantity][row] = np.nan
            # no base current: it is not known where the fallback begins
            assert count_tensor(grid, corners_of(grid, *event)).mean() == pytest.approx(left)


def test_nothing_makes_nothing() -> None:
    grid = random_grid(np.random.default_rng(1))
    nothing = np.empty(0)
    assert merge([]).cell.size == 0
    assert count_tensor(grid, merge([])).sum() == 0
    assert count_tensor(grid, corners_of(grid, nothing, nothing, nothing)).shape == grid.shape
    nothing = np.empty((4, 0))
    assert corners_of(grid, nothing, nothing, nothing).cell.size == 0


def test_events_beyond_the_grid_count_at_its_end_or_nowhere() -> None:
    grid = Grid(i_set_a=decimals(1, 3), v_set_pu=np.array([0.01, 0.05]), z_set_ohm=decimals(10, 12))
    huge, small = np.array([1e9]), np.array([0.0])
    assert (count_tensor(grid, corners_of(grid, huge, small, huge)) == 1).all()
    for event in ((small, small, huge), (huge, huge, huge), (huge, small, small)):
        assert corners_of(grid, *event).cell.size == 0
    # a fallback row whose cap lies beyond the grid has no setting left
    for cap, cells in ((1e8, 0), (0.0, 1)):
        both = np.array([[cap], [1e9]]), np.zeros((2, 1)), np.array([[0.0], [1e9]])
        assert corners_of(grid, *both).cell.size == cells


def test_inputs_stay_as_they_were() -> None:
    rng = np.random.default_rng(3)
    grid = random_grid(rng)
    events = random_events(rng, 50, (grid.i_set_a, grid.v_set_pu, grid.z_set_ohm), 4)
    copies = [x.copy() for x in events]
    corners = corners_of(grid, *events)
    before = corners.count.copy()
    merge([corners, corners])
    count_tensor(grid, corners)
    np.testing.assert_array_equal(corners.count, before)
    for event, copy in zip(events, copies, strict=True):
        np.testing.assert_array_equal(event, copy)
