"""Which phases are taken of those that are there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from openphase.model.events.phases import count_phases, draw_mask, draw_pair, draw_phase, row_flags
from openphase.model.events.shunts import Spot, load, phase_shares

N = 6000
MASKS = range(1, 8)


def assert_share(chosen: np.ndarray, expected: float) -> None:
    bound = 5.0 * math.sqrt(expected * (1.0 - expected) / chosen.size)
    assert abs(chosen.mean() - expected) <= bound


def phases_of(mask: int) -> set[int]:
    return {phase for phase in range(3) if mask >> phase & 1}


def spot(mask: int, three_wire: bool, v: float = 2400.0) -> Spot:
    return Spot(
        phases=np.full(N, mask), v_nominal_v=np.full(N, v), neutral=np.full(N, not three_wire)
    )


@pytest.mark.parametrize("mask", MASKS)
def test_every_phase_that_is_there_is_as_likely_and_no_other_is_taken(
    rng: np.random.Generator, mask: int
) -> None:
    drawn = draw_phase(rng, np.full(N, mask))
    assert set(drawn.tolist()) == phases_of(mask)
    for phase in phases_of(mask):
        assert_share(drawn == phase, 1.0 / len(phases_of(mask)))


@pytest.mark.parametrize("mask", [0b011, 0b110, 0b101, 0b111])
def test_a_pair_is_of_phases_that_are_there(rng: np.random.Generator, mask: int) -> None:
    drawn = draw_pair(rng, np.full(N, mask))
    there = {k for k in range(3) if {k, (k + 1) % 3} <= phases_of(mask)}
    assert set(drawn.tolist()) == there
    for pair in there:
        assert_share(drawn == pair, 1.0 / len(there))


@pytest.mark.parametrize("mask", MASKS)
def test_a_break_takes_conductors_that_are_there(rng: np.random.Generator, mask: int) -> None:
    there = np.full(N, mask)
    drawn = draw_mask(rng, there, 0.3)
    assert not (drawn & ~there).any()
    count = count_phases(drawn)
    assert set(count.tolist()) == ({1, 2} if len(phases_of(mask)) > 1 else {1})
    if len(phases_of(mask)) > 1:
        assert_share(count == 2, 0.3)


def test_where_all_phases_are_there_the_stream_is_that_of_old_studies() -> None:
    """A mixed feeder draws more numbers, a three-phase one just those it always drew."""
    old, new = (np.random.default_rng(3) for _ in range(2))
    which, two = old.integers(3, size=N), old.random(N) < 0.2
    wanted = np.where(two, np.array([0b011, 0b110, 0b101])[which], np.array([1, 2, 4])[which])
    np.testing.assert_array_equal(draw_mask(new, np.full(N, 0b111), 0.2), wanted)
    assert old.random() == new.random()


@pytest.mark.parametrize("three_wire", [False, True])
@pytest.mark.parametrize("mask", MASKS)
def test_a_load_lies_on_phases_that_are_there(
    rng: np.random.Generator, mask: int, three_wire: bool
) -> None:
    own = spot(mask, three_wire)
    shares = phase_shares(rng, own, 0.3)
    np.testing.assert_allclose(shares.sum(axis=0), 1.0)
    shunt = load(own, shares.astype(np.complex128))
    there = row_flags(np.arange(3))[:, sorted(phases_of(mask))].any(axis=1)
    earth, between = shunt.earth_s.any(axis=1), shunt.between_s.any(axis=1)
    assert not (earth & ~there).any()
    for pair in np.flatnonzero(between):
        assert {pair, (pair + 1) % 3} <= phases_of(mask)
    # without a neutral only a single conductor has the earth to return by
    assert between.any() == (three_wire and len(phases_of(mask)) > 1)
    balanced = (shares == 1.0 / 3.0).all(axis=0)
    assert_share(balanced, 0.7 if mask == 0b111 else 0.0)


@pytest.mark.parametrize("three_wire", [False, True])
def test_a_load_takes_its_power_at_the_voltage_of_its_place(
    rng: np.random.Generator, three_wire: bool
) -> None:
    turn = np.exp(-2j * np.pi / 3.0 * np.arange(3))[:, None]
    for v in (2400.0, 14400.0):
        own = spot(0b111, three_wire, v)
        shunt = load(own, 5e3 * phase_shares(rng, own, 0.5) + 0j)
        across = v * (turn - np.roll(turn, -1, axis=0))
        power = (np.abs(v * turn) ** 2 * shunt.earth_s).sum(axis=0)
        power += (np.abs(across) ** 2 * shunt.between_s).sum(axis=0)
        np.testing.assert_allclose(power, 5e3)
