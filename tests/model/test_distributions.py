"""Distributions: what their quantiles promise, held against scipy and against samples."""

from __future__ import annotations

import math
import pickle
from itertools import pairwise

import numpy as np
import pytest
from scipy import integrate, stats

from openphase.model.distributions import (
    LEAST_PROBABILITY,
    Choices,
    Distribution,
    Fixed,
    Integers,
    Lognormal,
    Normal,
    Quantiles,
    Triangular,
    Uniform,
    Values,
)

CONTINUOUS = [
    Uniform(low=-2.0, high=5.0),
    Normal(mean=1.0, sd=2.0, low=-1.0, high=9.0),
    Normal(mean=0.0, sd=1.0, low=2.0, high=4.0),
    Normal(mean=0.0, sd=1.0, low=-50.0, high=50.0),
    Lognormal(median=10.0, sigma=1.5, low=0.1, high=100.0),
    Lognormal(median=10.0, sigma=0.5, low=0.0, high=20.0),
    Triangular(low=0.0, mode=1.0, high=4.0),
    Triangular(low=0.0, mode=0.0, high=4.0),
    Triangular(low=-1.0, mode=4.0, high=4.0),
]
DISCRETE = [
    Fixed(value=3.5),
    Integers(least=-2, most=3),
    Integers(least=4, most=4),
    Quantiles(values=(-1.0, 0.0, 0.0, 3.0, 4.0)),
    Quantiles(values=(0.2, 1.0)),
    Values(values=(1.0, 2.5, 7.0)),
    Values(values=(1.0, 2.5, 7.0, 9.0), weights=(2.0, 0.0, 1.0, 5.0)),
]
ALL = [*CONTINUOUS, *DISCRETE]


def density(drawn: Distribution, x: float) -> float:
    """Return the density up to a factor, as the textbook has it."""
    if isinstance(drawn, Normal):
        return math.exp(-(((x - drawn.mean) / drawn.sd) ** 2) / 2.0)
    if isinstance(drawn, Lognormal):
        return math.exp(-((math.log(x / drawn.median) / drawn.sigma) ** 2) / 2.0) / x
    if isinstance(drawn, Triangular):
        if x < drawn.mode:
            return (x - drawn.low) / (drawn.mode - drawn.low)
        return 1.0 if x == drawn.mode else (drawn.high - x) / (drawn.high - drawn.mode)
    return 1.0


def integral(drawn: Distribution, low: float, high: float) -> float:
    """Return the integral of the density, cut where it bends."""
    bends = {Normal: ("mean",), Lognormal: ("median",), Triangular: ("mode",)}
    points = [getattr(drawn, name) for name in bends.get(type(drawn), ())]
    inside = [low, *(point for point in points if low < point < high), high]
    parts = [
        integrate.quad(lambda x: density(drawn, x), a, b, limit=200)[0] for a, b in pairwise(inside)
    ]
    return float(sum(parts))


@pytest.mark.parametrize("drawn", CONTINUOUS, ids=str)
@pytest.mark.parametrize("u", [0.01, 0.2, 0.5, 0.9, 0.99])
def test_the_share_u_of_the_density_lies_below_the_quantile(drawn: Distribution, u: float) -> None:
    low, high = drawn.support
    low = max(low, 1e-9) if isinstance(drawn, Lognormal) else low
    if high - low > 50.0:  # the density is nothing to the integrator out there
        low, high = max(low, -20.0), min(high, 120.0)
    x = float(drawn.quantile(np.array([u]))[0])
    assert integral(drawn, low, x) / integral(drawn, low, high) == pytest.approx(u, abs=1e-7)


@pytest.mark.parametrize("drawn", ALL, ids=str)
def test_quantiles_rise_and_stay_within_the_support(drawn: Distribution) -> None:
    values = drawn.quantile(np.linspace(0.0, 1.0, 10_001))
    assert values.dtype == np.float64
    assert (np.diff(values) >= 0.0).all()
    low, high = drawn.support
    assert low <= values[0]
    assert values[-1] <= high
    if drawn in CONTINUOUS:
        assert (values[0], values[-1]) == pytest.approx((low, high), rel=1e-9)


@pytest.mark.parametrize("drawn", ALL, ids=str)
def test_a_draw_takes_one_uniform_number_for_each_value(drawn: Distribution) -> None:
    rng, twin = np.random.default_rng(5), np.random.default_rng(5)
    values = drawn.draw(rng, (4, 7))
    assert values.shape == (4, 7)
    assert np.array_equal(values, drawn.quantile(twin.random((4, 7))))
    assert rng.random() == twin.random()


@pytest.mark.parametrize("drawn", [d for d in ALL if not isinstance(d, Fixed)], ids=str)
def test_draws_have_the_mean_of_their_quantiles(drawn: Distribution) -> None:
    """Of 100,000 draws: within five standard errors of the integral of the quantile function."""
    values = drawn.draw(np.random.default_rng(11), 100_000)
    middles = (np.arange(200_000) + 0.5) / 200_000
    wanted = drawn.quantile(middles).mean()
    assert abs(values.mean() - wanted) <= 5.0 * values.std() / math.sqrt(values.size) + 1e-4


@pytest.mark.parametrize(
    ("drawn", "twin"),
    [
        (Normal(mean=1.0, sd=2.0, low=-1.0, high=9.0), stats.truncnorm(-1.0, 4.0, 1.0, 2.0)),
        (Triangular(low=0.0, mode=1.0, high=4.0), stats.triang(0.25, 0.0, 4.0)),
        (Uniform(low=-2.0, high=5.0), stats.uniform(-2.0, 7.0)),
    ],
    ids=str,
)
def test_quantiles_are_scipy_s(drawn: Distribution, twin: stats.rv_continuous) -> None:
    u = np.linspace(0.001, 0.999, 999)
    np.testing.assert_allclose(drawn.quantile(u), twin.ppf(u), rtol=1e-10, atol=1e-12)


def test_a_discrete_draw_has_the_shares_it_should() -> None:
    """A chi-square test of each at 1e-4."""
    rng = np.random.default_rng(3)
    for drawn, expected in (
        (Integers(least=-2, most=3), dict.fromkeys(range(-2, 4), 1.0)),
        (Values(values=(1.0, 2.5, 7.0)), {1.0: 1.0, 2.5: 1.0, 7.0: 1.0}),
        (
            Values(values=(1.0, 2.5, 7.0, 9.0), weights=(2.0, 0.0, 1.0, 5.0)),
            {1.0: 2.0, 7.0: 1.0, 9.0: 5.0},
        ),
    ):
        values, counts = np.unique(drawn.draw(rng, 60_000), return_counts=True)
        assert values.tolist() == list(expected)
        shares = np.array(list(expected.values())) / sum(expected.values())
        assert stats.chisquare(counts, shares * 60_000).pvalue > 1e-4


def test_choices_are_drawn_as_indices() -> None:
    choices = Choices(values=("a", "b", "c"), weights=(1.0, 0.0, 3.0))
    drawn = choices.draw(np.random.default_rng(3), 40_000)
    assert drawn.dtype == np.int64
    assert set(drawn) == {0, 2}
    assert stats.binomtest(int((drawn == 2).sum()), 40_000, 0.75).pvalue > 1e-4
    assert choices.quantile(np.array([0.0, 0.2499, 0.2501, 1.0])).tolist() == [0, 0, 2, 2]
    assert Choices(values=("a", "b")).quantile(np.array([0.49, 0.51])).tolist() == [0, 1]


def test_what_draws_whole_numbers() -> None:
    whole = [
        Fixed(value=2.0),
        Integers(least=0, most=1),
        Values(values=(-1.0, 2.0)),
    ]
    broken = [
        Fixed(value=2.5),
        Uniform(low=1.0, high=3.0),
        Uniform(low=3.0, high=3.0),
        Values(values=(-1.0, 2.5)),
        Normal(mean=1.0, sd=1.0, low=0.0, high=3.0),
    ]
    assert all(drawn.whole for drawn in whole)
    assert not any(drawn.whole for drawn in broken)


@pytest.mark.parametrize("drawn", ALL, ids=str)
def test_sound_parameters_break_no_rule(drawn: Distribution) -> None:
    assert drawn.fault() is None


@pytest.mark.parametrize(
    ("drawn", "rule"),
    [
        (Uniform(low=2.0, high=1.0), "low <= high"),
        (Normal(mean=0.0, sd=0.0, low=-1.0, high=1.0), "sd > 0"),
        (Normal(mean=0.0, sd=1.0, low=1.0, high=1.0), "low < high"),
        (Normal(mean=0.0, sd=1.0, low=4.0, high=9.0), "at least 0.001 of it"),
        (Normal(mean=0.0, sd=1e-300, low=4.0, high=1e300), "at least 0.001 of it"),
        (Lognormal(median=0.0, sigma=1.0, low=0.0, high=1.0), "both > 0"),
        (Lognormal(median=1.0, sigma=-1.0, low=0.0, high=1.0), "both > 0"),
        (Lognormal(median=1.0, sigma=1.0, low=-1.0, high=1.0), "ends >= 0"),
        (Lognormal(median=1.0, sigma=1e-3, low=2.0, high=3.0), "at least 0.001 of it"),
        (Lognormal(median=1.0, sigma=1.0, low=3.0, high=2.0), "low < high"),
        (Triangular(low=0.0, mode=3.0, high=2.0), "rising"),
        (Triangular(low=1.0, mode=1.0, high=1.0), "rising"),
        (Integers(least=2, most=1), "in order"),
        (Values(values=()), "at least one value"),
        (Values(values=(1.0, 1.0)), "rising"),
        (Values(values=(1.0, 2.0), weights=(1.0,)), "a weight for each of the 2 values"),
        (Values(values=(1.0, 2.0), weights=(0.0, 0.0)), "one of them > 0"),
        (Values(values=(1.0, 2.0), weights=(2.0, -1.0)), "weights >= 0"),
        (Choices(values=("a", "a")), "each once"),
        (Choices(values=()), "at least one value"),
        (Choices(values=("a", "b"), weights=(1.0, 2.0, 3.0)), "a weight for each"),
    ],
    ids=str,
)
def test_a_rule_that_parameters_break(drawn: Distribution | Choices, rule: str) -> None:
    assert rule in str(drawn.fault())


def test_a_window_is_refused_just_where_too_little_remains() -> None:
    edge = stats.norm.isf(LEAST_PROBABILITY)
    for at, fits in ((edge - 1e-6, True), (edge + 1e-6, False)):
        cut = Normal(mean=0.0, sd=1.0, low=at, high=60.0)
        assert (cut.fault() is None) == fits


def test_values_are_plain_frozen_data() -> None:
    for drawn in [*ALL, Choices(values=("a",))]:
        twin = pickle.loads(pickle.dumps(drawn))
        assert twin == drawn
        assert hash(twin) == hash(drawn)
        assert not hasattr(drawn, "__dict__")
