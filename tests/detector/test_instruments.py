"""The law of the instruments' errors, and what it does to a phasor."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kstest

from openphase.detector.instruments import disc_noise, measure

N = 400_000
LEFT_OUT = math.exp(-4.5)
"""Share of a Rayleigh law beyond three standard deviations of an axis."""

MEAN_SQUARE = (2.0 - 9.0 * LEFT_OUT / (1.0 - LEFT_OUT)) / 9.0
"""E|e|² of the truncated law: 2σ² less what the cut takes, σ = 1/3."""

# Seeds are fixed. A mean must lie within 5 standard errors (one false alarm in 2 million
# draws of the seed), a Kolmogorov-Smirnov p above 0.001.


@pytest.fixture(scope="module")
def errors() -> NDArray[np.complex128]:
    return disc_noise(np.random.default_rng(11), (N,))


def assert_mean(values: NDArray[np.float64], expected: float) -> None:
    assert abs(values.mean() - expected) < 5.0 * values.std() / math.sqrt(values.size)


def test_no_error_leaves_its_bound(errors: NDArray[np.complex128]) -> None:
    assert np.abs(errors).max() <= 1.0 + 1e-15
    assert np.abs(errors).max() > 0.999  # and the bound is nearly reached


def test_the_moments_are_those_of_the_truncated_law(errors: NDArray[np.complex128]) -> None:
    for axis in (errors.real, errors.imag):
        assert_mean(axis, 0.0)
        assert_mean(axis**2, MEAN_SQUARE / 2.0)
    assert_mean(np.abs(errors) ** 2, MEAN_SQUARE)
    # the test can tell it from the law without the cut, by more than 20 standard errors
    square = np.abs(errors) ** 2
    assert (2.0 / 9.0 - square.mean()) / (square.std() / math.sqrt(N)) > 20.0


def test_the_radius_follows_the_truncated_rayleigh_law(errors: NDArray[np.complex128]) -> None:
    def law(r: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.clip((1.0 - np.exp(-4.5 * r**2)) / (1.0 - LEFT_OUT), 0.0, 1.0)

    assert kstest(np.abs(errors), law).pvalue > 1e-3


def test_no_direction_is_preferred(errors: NDArray[np.complex128]) -> None:
    turn = np.angle(errors) / (2.0 * np.pi) + 0.5
    assert kstest(turn, "uniform").pvalue > 1e-3
    assert_mean(errors.real * errors.imag, 0.0)
    # also where the cut has been at work
    assert kstest(turn[np.abs(errors) > 0.9], "uniform").pvalue > 1e-3


def test_errors_of_one_block_are_independent() -> None:
    pairs = disc_noise(np.random.default_rng(3), (2, N // 2))
    assert_mean((pairs[0] * pairs[1].conj()).real, 0.0)
    assert_mean((pairs[0] * pairs[1].conj()).imag, 0.0)


@pytest.mark.parametrize("shape", [(1,), (2, 3), (2, 6, 3, 50)])
def test_shape_and_seed(shape: tuple[int, ...]) -> None:
    first = disc_noise(np.random.default_rng(5), shape)
    assert first.shape == shape
    assert first.dtype == np.complex128
    np.testing.assert_array_equal(first, disc_noise(np.random.default_rng(5), shape))


def test_a_reported_phasor_is_within_the_total_vector_error_or_the_floor() -> None:
    rng = np.random.default_rng(8)
    true = 10.0 ** rng.uniform(-3, 4, 20_000) * np.exp(2j * np.pi * rng.random(20_000))
    reported = measure(true, disc_noise(rng, true.shape), 0.05, 0.05)
    bound = np.maximum(0.0005 * np.abs(true), 0.05)
    gap = np.abs(reported - true)
    assert (gap <= bound * (1.0 + 1e-9)).all()
    assert gap.max() > 0.5  # at kiloamperes the percentage speaks, not the floor


def test_bound_by_hand() -> None:
    true = np.array([200.0 + 0j, 100j, 50.0 + 0j, 0j])
    error = np.array([1.0 + 0j, 1j, -1.0 + 0j, 0.6 + 0.8j])
    # 0.05 % of 200 is 0.1, of 100 just the floor, below it the floor
    expected = [200.1, 100.05j, 49.95, 0.03 + 0.04j]
    np.testing.assert_allclose(measure(true, error, 0.05, 0.05), expected, rtol=1e-14)


def test_without_a_floor_nothing_is_measured_as_nothing() -> None:
    true = np.array([0j, 7000.0 + 0j])
    reported = measure(true, np.array([1.0 + 0j, 1.0 + 0j]), 0.05, 0.0)
    assert reported[0] == 0.0
    assert reported[1] == pytest.approx(7003.5)


def test_perfect_instruments_report_the_truth() -> None:
    true = disc_noise(np.random.default_rng(1), (100,))
    np.testing.assert_array_equal(measure(true, np.ones(100, complex), 0.0, 0.0), true)


def test_inputs_stay_as_they_were() -> None:
    rng = np.random.default_rng(2)
    true, error = disc_noise(rng, (50,)), disc_noise(rng, (50,))
    copies = true.copy(), error.copy()
    measure(true, error, 0.05, 0.05)
    np.testing.assert_array_equal(true, copies[0])
    np.testing.assert_array_equal(error, copies[1])
