"""Bounds: their coverage summed up exactly, and the numbers that are known."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import beta, binom, binomtest, multinomial, poisson

from openphase.optimise.certificate import (
    needed_trials,
    paired_difference,
    share_of_alpha,
    two_sided,
    upper_bound,
)

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


@pytest.mark.parametrize("alpha", [0.2, 0.05, 0.01])
@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 13, 24])
def test_the_interval_of_a_paired_difference_covers(n: int, alpha: float) -> None:
    """Every outcome of n pairs, at every P(only A) and P(only B) of a lattice."""
    outcomes = np.array([(a, b, n - a - b) for a in range(n + 1) for b in range(n + 1 - a)])
    low, high = np.array([paired_difference(int(a), int(b), n, alpha) for a, b, _ in outcomes]).T
    steps = 40
    for i in range(steps + 1):
        for j in range(i + 1):  # the other half is the same by exchange
            if i + j > steps:
                continue
            truth = np.array([i, j, steps - i - j]) / steps
            inside = (low <= truth[0] - truth[1] + 1e-12) & (truth[0] - truth[1] <= high + 1e-12)
            assert multinomial.pmf(outcomes[inside], n, truth).sum() >= 1.0 - alpha - 1e-9


@pytest.mark.parametrize("alpha", [0.2, 0.05, 0.01])
def test_the_interval_of_a_paired_difference_covers_where_pairs_seldom_disagree(
    alpha: float,
) -> None:
    """At large n the two counts are Poisson and independent."""
    n, k = 10**6, np.arange(60)
    table = np.array([[paired_difference(int(a), int(b), n, alpha) for b in k] for a in k]) * n
    means = np.concatenate((np.linspace(0.0, 6.0, 31), np.linspace(7.0, 24.0, 10)))
    least = 1.0
    for mean_a in means:
        for mean_b in means[means <= mean_a]:
            difference = mean_a - mean_b
            inside = (table[..., 0] <= difference + 1e-9) & (difference - 1e-9 <= table[..., 1])
            covered = poisson.pmf(k, mean_a) @ inside @ poisson.pmf(k, mean_b)
            assert covered >= 1.0 - alpha - 1e-5  # n is finite, and k is cut
            least = min(least, float(covered))
    # and it does not buy this by being wide
    assert least < 1.0 - alpha / 2.0


def test_a_paired_difference_turns_its_sign_with_its_two_sides() -> None:
    rng = np.random.default_rng(6)
    for _ in range(300):
        n = int(rng.integers(1, 400))
        a = int(rng.integers(0, n + 1))
        b = int(rng.integers(0, n + 1 - a))
        low, high = paired_difference(a, b, n, 0.05)
        back = paired_difference(b, a, n, 0.05)
        np.testing.assert_allclose(back, (-high, -low), atol=1e-15)
        assert -1.0 <= low <= (a - b) / n <= high <= 1.0


@pytest.mark.parametrize("alpha", [0.05, 0.01])
def test_a_few_pairs_prove_no_more_than_the_sign_test_says(alpha: float) -> None:
    """Without 0 only where McNemar's exact test rejects, but for a hair's breadth."""
    for a in range(25):
        for b in range(a):
            low, _ = paired_difference(a, b, 100_000, alpha)
            p = binomtest(a, a + b).pvalue
            if p > 1.25 * alpha:
                assert low <= 0
            if p < 0.8 * alpha:
                assert low > 0


def test_pairs_tell_more_than_two_samples() -> None:
    """Of 10,000 breaks 8,000 are found by A and 7,900 by B: 150 by A alone, 50 by B alone."""
    n = 10_000
    low, high = paired_difference(150, 50, n, 0.05)
    alone = [two_sided(k, n, 0.05) for k in (8000, 7900)]
    assert low > 0.0
    assert alone[0][0] < alone[1][1]  # their own intervals overlap
    normal = 1.96 * math.sqrt(200 / n - 0.01**2) / math.sqrt(n)
    assert high - low == pytest.approx(2.0 * normal, rel=0.05)


def test_without_pairs_nothing_is_known_of_their_difference() -> None:
    assert paired_difference(0, 0, 0, 0.05) == (-1.0, 1.0)
    low, high = paired_difference(0, 0, 1000, 0.05)
    assert high == -low == two_sided(0, 1000, 0.05)[1]
