"""The copula: rank correlations that are reached, marginals that are not touched."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from openphase.model.copula import contradiction, joint_uniforms, normal_correlations
from openphase.model.distributions import Lognormal, Triangular, Uniform

SIZE = 40_000
BOUND = 0.025
"""Five standard errors of a rank correlation of 40,000 pairs, 1/sqrt(40,000) each at most."""


@pytest.mark.parametrize("rank", [-1.0, -0.9, -0.6, 0.0, 0.3, 0.8, 1.0])
def test_the_rank_correlation_is_reached_through_any_quantiles(rank: float) -> None:
    matrix = normal_correlations(3, {(0, 2): rank})
    u = joint_uniforms(np.random.default_rng(7), SIZE, matrix)
    one = Lognormal(median=3.0, sigma=1.2, low=0.0, high=50.0).quantile(u[0])
    other = Triangular(low=0.0, mode=0.1, high=4.0).quantile(u[2])
    assert stats.spearmanr(one, other).statistic == pytest.approx(rank, abs=BOUND)
    assert stats.spearmanr(one, u[1]).statistic == pytest.approx(0.0, abs=BOUND)
    assert stats.spearmanr(other, u[1]).statistic == pytest.approx(0.0, abs=BOUND)


def test_several_correlations_at_once() -> None:
    ranks = {(0, 1): 0.7, (1, 3): -0.5, (0, 3): -0.2}
    u = joint_uniforms(np.random.default_rng(8), SIZE, normal_correlations(4, ranks))
    reached = stats.spearmanr(u.T).statistic
    for one in range(4):
        for other in range(one):
            wanted = ranks.get((other, one), 0.0)
            assert reached[one, other] == pytest.approx(wanted, abs=BOUND)


@pytest.mark.parametrize("rank", [-1.0, -0.6, 0.0, 0.95])
def test_each_row_stays_uniform(rank: float) -> None:
    """A Kolmogorov-Smirnov test of each at 1e-4."""
    matrix = normal_correlations(2, {(0, 1): rank})
    u = joint_uniforms(np.random.default_rng(9), SIZE, matrix)
    for row in u:
        assert stats.kstest(row, "uniform").pvalue > 1e-4
    level = Uniform(low=0.25, high=1.0).quantile(u[1])
    assert stats.kstest(level, stats.uniform(0.25, 0.75).cdf).pvalue > 1e-4


def test_a_full_correlation_makes_copies() -> None:
    u = joint_uniforms(np.random.default_rng(1), 1000, normal_correlations(2, {(0, 1): 1.0}))
    np.testing.assert_allclose(u[1], u[0], atol=1e-12)
    u = joint_uniforms(np.random.default_rng(1), 1000, normal_correlations(2, {(0, 1): -1.0}))
    np.testing.assert_allclose(u[1], 1.0 - u[0], atol=1e-12)


def test_what_is_not_correlated_keeps_its_draws() -> None:
    """Bit by bit, or studies that differ in a correlation would share no other draw."""
    plain = joint_uniforms(np.random.default_rng(2), 1000, normal_correlations(4, {}))
    other = joint_uniforms(np.random.default_rng(2), 1000, normal_correlations(4, {(1, 2): 0.7}))
    assert [np.array_equal(a, b) for a, b in zip(plain, other, strict=True)] == [
        True,
        True,
        False,
        True,
    ]


def test_the_root_gives_the_correlations_back() -> None:
    """Of random correlations, singular ones among them: those of the normals behind."""
    rng = np.random.default_rng(4)
    for rows in (2, 3, 6):
        factors = rng.standard_normal((5, rows))
        factors /= np.linalg.norm(factors, axis=1, keepdims=True)
        wanted = factors @ factors.T
        assert contradiction(wanted) == ()
        u = joint_uniforms(np.random.default_rng(6), SIZE, wanted)
        normals = stats.norm.ppf(u)
        np.testing.assert_allclose(np.corrcoef(normals), wanted, atol=BOUND)


@pytest.mark.parametrize(
    ("ranks", "named"),
    [
        ({(0, 1): 0.9, (1, 2): 0.9, (0, 2): -0.9}, (0, 1, 2)),
        ({(0, 3): 1.0, (3, 4): 1.0, (0, 4): 0.9}, (0, 3, 4)),
        ({(0, 1): 0.9, (1, 2): 0.9, (0, 2): -0.9, (3, 4): 0.5}, (0, 1, 2)),
        ({(0, 1): 0.9, (1, 2): 0.9, (0, 2): -0.9, (2, 3): 0.3}, (0, 1, 2)),
        ({(0, 1): 0.9, (1, 2): 0.9}, (0, 1, 2)),
        ({(0, 1): 0.6, (1, 2): 0.6, (0, 2): 0.0}, ()),
        ({(0, 1): 1.0, (1, 2): 1.0, (0, 2): 1.0}, ()),
        ({(0, 1): -1.0}, ()),
        ({}, ()),
    ],
)
def test_correlations_that_cannot_hold_together_are_named(
    ranks: dict[tuple[int, int], float], named: tuple[int, ...]
) -> None:
    assert contradiction(normal_correlations(5, ranks)) == named


def test_those_named_are_as_few_as_possible() -> None:
    """Of random demands: without any one of the named, all the others could hold."""
    rng = np.random.default_rng(12)
    found = 0
    for _ in range(200):
        ranks = {(a, b): float(rng.uniform(-1, 1)) for b in range(6) for a in range(b)}
        kept = {pair: rank for pair, rank in ranks.items() if rng.random() < 0.5}
        matrix = normal_correlations(6, kept)
        named = contradiction(matrix)
        assert (np.linalg.eigvalsh(matrix)[0] < 0.0) == bool(named)
        for left_out in named:
            rest = [k for k in named if k != left_out]
            assert np.linalg.eigvalsh(matrix[np.ix_(rest, rest)])[0] >= -1e-9
        found += len(named) > 0
    assert 50 < found < 200


def test_the_normal_correlation_is_the_stronger_one() -> None:
    """Pearson's 2·sin(π·r/6) lies beyond Spearman's r, but at the ends and at 0."""
    for rank in (-1.0, 0.0, 1.0):
        assert normal_correlations(2, {(0, 1): rank})[0, 1] == pytest.approx(rank, abs=1e-15)
    for rank in (0.1, 0.5, 0.9):
        assert rank < normal_correlations(2, {(0, 1): rank})[0, 1] < rank + 0.02
