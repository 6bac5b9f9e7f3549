"""Equation (5) on cases that can be done by hand, and where it has no value."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from openphase.detector.impedance import connection_impedance

Complex = NDArray[np.complex128]


def one(*phasors: complex) -> tuple[complex, bool]:
    """Equation (5) of a single case: V_L, V_R, I_L, and the changes of the three."""
    arrays = [np.array([x], np.complex128) for x in phasors]
    z, undefined = connection_impedance(*arrays)
    return complex(z[0]), bool(undefined[0])


def phasors(rng: np.random.Generator, size: int) -> Complex:
    return rng.standard_normal((size, 2)).view(np.complex128)[:, 0]


@pytest.mark.parametrize(
    ("case", "z_ohm"),
    [
        # (-2·90 + 5·100) / (-1·100 + 2·10) = 320 / -80
        ((100, 90, 10, -2, -5, -1), -4),
        # only the remote voltage moves: 5·100 / (-1·100)
        ((100, 90, 10, 0, -5, -1), -5),
        # nothing moves but the local current: a change inside, at no impedance
        ((100, 90, 10, 0, 0, -1), 0),
        # the local voltage alone: -2·90 / (2·10)
        ((100, 90, 10, -2, 0, 0), -9),
        # a quarter turn of every current turns the impedance back
        ((100, 90, 10j, -2, -5, -1j), 4j),
        # no load current before or now: 5·100 / (2·100)
        ((100, 100, 0, 0, -5, 2), 2.5),
    ],
)
def test_by_hand(case: tuple[complex, ...], z_ohm: complex) -> None:
    z, undefined = one(*case)
    assert not undefined
    assert z == pytest.approx(z_ohm, rel=1e-14, abs=1e-14)


def test_a_sound_line_shows_its_own_impedance() -> None:
    """With V_R = V_L - Z I at both times, whatever happens elsewhere, (5) gives Z."""
    rng = np.random.default_rng(4)
    z, v, i, dv, di = (phasors(rng, 2000) for _ in range(5))
    v, i, dv, di = 7000.0 * v, 100.0 * i, 50.0 * dv, 3.0 * di
    found, undefined = connection_impedance(v, v - z * i, i, dv, dv - z * di, di)
    assert not undefined.any()
    # a few of the 2000 nearly cancel in the denominator, and lose digits there
    np.testing.assert_allclose(found, z, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize(
    "case",
    [
        (100, 90, 10, 0, 0, 0),  # nothing has changed
        (100, 90, 10, 0, -5, 0),  # something changed, but not here
        (100, 90, 10, -10, 0, -1),  # ΔI just as ΔV explains: -100 + 100
        (0, 0, 0, 0, 0, 0),  # all dead
        (0, 90, 10, 0, -5, -1),  # no local voltage, now or before
        (100j, 90, 10j, -10, 5, -1),  # the same turned
    ],
)
def test_no_value_is_a_flag_and_never_a_nan(case: tuple[complex, ...]) -> None:
    assert one(*case) == (0.0, True)


def test_a_change_that_the_local_voltage_explains_is_undefined_up_to_rounding() -> None:
    rng = np.random.default_rng(9)
    v, i, x, other = (phasors(rng, 5000) for _ in range(4))
    z, undefined = connection_impedance(v, other, i, x * v, 0.1 * other, x * i)
    assert undefined.all()
    assert (z == 0.0).all()


def test_a_small_change_is_no_rounding() -> None:
    rng = np.random.default_rng(10)
    v, i, x = (phasors(rng, 5000) for _ in range(3))
    _, undefined = connection_impedance(v, v, i, x * v, x * v, x * i * (1.0 + 1e-6))
    assert not undefined.any()


def test_defined_and_undefined_stand_side_by_side_in_any_shape() -> None:
    v = np.full((2, 3), 100.0 + 0j)
    di = np.array([[0, -1, 0], [-2, 0, 1]], np.complex128)
    zero = np.zeros_like(v)
    z, undefined = connection_impedance(v, v, zero, zero, np.full_like(v, -5.0), di)
    np.testing.assert_array_equal(undefined, di == 0)
    np.testing.assert_allclose(z, np.array([[0, -5, 0], [-2.5, 0, 5]], np.complex128))


def test_inputs_stay_as_they_were() -> None:
    arrays = [np.array([100.0, 0.0], np.complex128) for _ in range(6)]
    connection_impedance(*arrays)
    for array in arrays:
        np.testing.assert_array_equal(array, [100.0, 0.0])
