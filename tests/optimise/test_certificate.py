"""Bounds: their coverage summed up exactly, and the numbers that are known."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import beta, binom

from openphase.optimise.certificate import needed_trials, share_of_alpha, two_sided, upper_bound

Real = NDArray[np.float64]
CASES = [(n, alpha) for n in (1, 2, 3, 7, 20, 61, 150) for alpha in (0.05, 0.01, 0.4)]


def probabilities(borders: Real) -> Real:
    """A grid, and both sides of every border, where coverage is least."""
    near = np.concatenate((borders * (1.0 - 1e-9), borders * (1.0 + 1e-9)))
    return np.clip(np.concatenate((np.linspace(0.0, 1.0, 201), near)), 0.0, 1.0)


@pytest.mark.parametrize(("n", "alpha"), CASES)
def test_the_one_sided_bound_covers_exactly(n: int, alpha: float) -> None:
    k = np.arange(n + 1)
    upper = np.array([upper_bound(int(x), n, alpha) for x in k])
    p = probabilities(upper)
    covered = (binom.pmf(k, n, p[:, None]) * (upper >= p[:, None])).sum(axis=1)
    assert covered.min() >= 1.0 - alpha - 1e-9
    # and no more than the law's steps demand: just above a border it is all but exact
    assert covered.min() < 1.0 - alpha + 1e-6


@pytest.mark.parametrize(("n", "alpha"), CASES)
def test_the_two_sided_interval_covers(n: int, alpha: float) -> None:
    k = np.arange(n + 1)
    low, high = np.array([two_sided(int(x), n, alpha) for x in k]).T
    p = probabilities(np.concatenate((low, high)))
    mass = binom.pmf(k, n, p[:, None])
    inside = (low <= p[:, None]) & (p[:, None] <= high)
    assert (mass * inside).sum(axis=1).min() >= 1.0 - alpha - 1e-9
    # each side by itself has half of the error
    assert (mass * (p[:, None] < low)).sum(axis=1).max() <= alpha / 2.0 + 1e-9
    assert (mass * (p[:, None] > high)).sum(axis=1).max() <= alpha / 2.0 + 1e-9
    assert (low <= k / n).all()
    assert (k / n <= high).all()


def test_the_bound_rises_with_k_and_falls_with_n_and_alpha() -> None:
    upper = np.array([[upper_bound(k, n, 0.05) for k in range(11)] for n in (10, 100, 1000)])
    assert (np.diff(upper, axis=1)[:, :10] > 0).all()
    assert (np.diff(upper, axis=0)[:, :10] < 0).all()
    assert upper_bound(2, 50, 0.01) > upper_bound(2, 50, 0.05)


def test_no_failure_has_the_closed_form_of_the_same_law() -> None:
    for n in (1, 10, 29_956, 10**7):
        for alpha in (0.05, 1e-4, 0.05 / 2**20):
            assert upper_bound(0, n, alpha) == pytest.approx(beta.isf(alpha, 1, n), rel=1e-9)


def test_without_trials_nothing_is_known() -> None:
    assert upper_bound(0, 0, 0.05) == 1.0
    assert two_sided(0, 0, 0.05) == (0.0, 1.0)
    assert upper_bound(5, 5, 0.05) == 1.0
    assert two_sided(5, 5, 0.05)[1] == 1.0
    assert two_sided(0, 5, 0.05)[0] == 0.0


@pytest.mark.parametrize(
    ("confidence", "trials"),
    [
        (0.95, (29_956, 299_572, 2_995_731)),
        (0.99, (46_050, 460_515, 4_605_168)),
        (0.9999, (92_099, 921_030, 9_210_336)),
    ],
)
def test_needed_trials(confidence: float, trials: tuple[int, ...]) -> None:
    for target, n in zip((1e-4, 1e-5, 1e-6), trials, strict=True):
        assert needed_trials(target, 1.0 - confidence) == n


def test_needed_trials_are_enough_and_one_less_is_not() -> None:
    rng = np.random.default_rng(5)
    for _ in range(500):
        alpha, target = 10.0 ** rng.uniform(-9, -0.3), 10.0 ** rng.uniform(-6, -0.3)
        n = needed_trials(target, alpha)
        assert upper_bound(0, n, alpha) <= target
        assert n == 1 or upper_bound(0, n - 1, alpha) > target


@pytest.mark.parametrize("power", range(1, 30))
def test_needed_trials_where_the_quotient_is_whole(power: int) -> None:
    """Half to the n-th: roundings must not turn enough trials into too few."""
    n = needed_trials(0.5, 0.5**power)
    assert power <= n <= power + 1  # one trial more than needed harms nobody
    assert upper_bound(0, n, 0.5**power) <= 0.5


@pytest.mark.parametrize("confidence", [0.5, 0.95, 0.9999])
@pytest.mark.parametrize("terminals", [1, 4, 30])
def test_all_attempts_at_all_terminals_share_one_alpha(confidence: float, terminals: int) -> None:
    shares = [share_of_alpha(confidence, j, terminals) for j in range(1, 200)]
    assert terminals * math.fsum(shares) <= (1.0 - confidence) * (1.0 + 1e-12)
    assert terminals * math.fsum(shares) == pytest.approx(1.0 - confidence)
    assert shares[0] == pytest.approx((1.0 - confidence) / 2.0 / terminals)
    assert all(b == a / 2.0 for a, b in pairwise(shares))


def test_a_feeder_on_which_nothing_is_judged_still_has_an_alpha() -> None:
    assert share_of_alpha(0.95, 1, 0) == pytest.approx(0.025)


def test_the_default_size_of_eight_terminals() -> None:
    assert needed_trials(1e-4, share_of_alpha(0.95, 1, 8)) == pytest.approx(57_700, abs=50)
