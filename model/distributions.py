"""How a quantity is drawn: small frozen values, each with its quantile function.

Every draw is the quantile of one uniform number. So two studies that differ in one
distribution share all other draws, and correlated quantities need correlated uniform
numbers only (`copula`). All supports are bounded: what can be drawn can be checked.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

__all__ = [
    "LEAST_PROBABILITY",
    "Choices",
    "Distribution",
    "Fixed",
    "Integers",
    "Lognormal",
    "Normal",
    "Quantiles",
    "Triangular",
    "Uniform",
    "Values",
]

Real = NDArray[np.float64]
Int = NDArray[np.int64]

LEAST_PROBABILITY = 1e-3
"""What a truncated distribution must keep of itself: below it a bound is mistyped."""


class Distribution(ABC):
    """A bounded distribution of real numbers."""

    __slots__ = ()

    @abstractmethod
    def quantile(self, u: Real) -> Real:
        """Return the values below which the shares ``u`` of all draws lie, 0 <= u <= 1."""

    @property
    @abstractmethod
    def support(self) -> tuple[float, float]:
        """The lowest and the highest value that can be drawn."""

    @property
    def whole(self) -> bool:
        """Whether only whole numbers can be drawn."""
        return False

    def fault(self) -> str | None:
        """Return the rule that the parameters break, such as ``must have ...``, or None."""
        return None

    def draw(self, rng: np.random.Generator, size: int | tuple[int, ...]) -> Real:
        """Return independent values; one uniform number is taken for each."""
        return self.quantile(rng.random(size))


@dataclass(frozen=True, slots=True, kw_only=True)
class Fixed(Distribution):
    """Always the same number.

    Examples
    --------
    >>> Fixed(value=60.0).support
    (60.0, 60.0)
    """

    value: float

    def quantile(self, u: Real) -> Real:
        """Return the number, whatever ``u``."""
        return np.full_like(u, self.value, np.float64)

    @property
    def support(self) -> tuple[float, float]:
        """The number, twice."""
        return self.value, self.value

    @property
    def whole(self) -> bool:
        """Whether the number is whole."""
        return float(self.value).is_integer()


@dataclass(frozen=True, slots=True, kw_only=True)
class Uniform(Distribution):
    """Every number between two ends, as likely; the ends may be equal.

    Examples
    --------
    >>> Uniform(low=2.0, high=4.0).quantile(np.array([0.0, 0.5, 1.0])).tolist()
    [2.0, 3.0, 4.0]
    """

    low: float
    high: float

    def quantile(self, u: Real) -> Real:
        """Return the share ``u`` of the way from end to end."""
        return _between(self.low + u * (self.high - self.low), self.low, self.high)

    @property
    def support(self) -> tuple[float, float]:
        """The ends."""
        return self.low, self.high

    def fault(self) -> str | None:
        """Demand ends in order."""
        return None if self.low <= self.high else "must be [low, high], low <= high"


@dataclass(frozen=True, slots=True, kw_only=True)
class Normal(Distribution):
    """A normal distribution, cut at both ends.

    Parameters
    ----------
    mean, sd
        Of the distribution before it is cut.
    low, high
        Nothing beyond is drawn; what lies between is as likely as it was, relatively.
    """

    mean: float
    sd: float
    low: float
    high: float

    def quantile(self, u: Real) -> Real:
        """Return the inverse of the truncated distribution function."""
        below, above = self._cut()
        z = ndtri(below + u * (above - below))
        return _between(self.mean + self.sd * z, self.low, self.high)

    def _cut(self) -> tuple[float, float]:
        """Shares of the uncut distribution below the two ends."""
        with np.errstate(over="ignore"):  # a tiny spread: an end is infinitely far off
            below, above = ndtr((np.array([self.low, self.high]) - self.mean) / self.sd)
        return float(below), float(above)

    @property
    def support(self) -> tuple[float, float]:
        """The ends of the cut."""
        return self.low, self.high

    def fault(self) -> str | None:
        """Demand a spread, and ends that hold enough of the distribution."""
        if self.sd <= 0.0:
            return "must be normal = [mean, sd], sd > 0"
        return _window_fault(self.low, self.high, self._cut)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lognormal(Distribution):
    """A number whose logarithm is normal, cut at both ends.

    Parameters
    ----------
    median
        Of the distribution before it is cut.
    sigma
        Standard deviation of the natural logarithm, likewise.
    low, high
        Nothing beyond is drawn.
    """

    median: float
    sigma: float
    low: float
    high: float

    def quantile(self, u: Real) -> Real:
        """Return the inverse of the truncated distribution function."""
        below, above = self._cut()
        with np.errstate(over="ignore"):  # beyond the ends anyway
            values = self.median * np.exp(self.sigma * ndtri(below + u * (above - below)))
        return _between(values, self.low, self.high)

    def _cut(self) -> tuple[float, float]:
        """Shares of the uncut distribution below the two ends."""
        with np.errstate(divide="ignore", over="ignore"):  # nothing lies below 0
            ends = np.log([self.low, self.high]) - np.log(self.median)
            below, above = ndtr(ends / self.sigma)
        return float(below), float(above)

    @property
    def support(self) -> tuple[float, float]:
        """The ends of the cut."""
        return self.low, self.high

    def fault(self) -> str | None:
        """Demand a median and a spread > 0, and ends that hold enough of the distribution."""
        if self.median <= 0.0 or self.sigma <= 0.0:
            return "must be lognormal = [median, sigma], both > 0"
        if self.low < 0.0:
            return "must be cut at ends >= 0, or be no lognormal"
        return _window_fault(self.low, self.high, self._cut)


@dataclass(frozen=True, slots=True, kw_only=True)
class Triangular(Distribution):
    """Likeliest at ``mode``, less so in a straight line towards both ends."""

    low: float
    mode: float
    high: float

    def quantile(self, u: Real) -> Real:
        """Return the inverse of the distribution function, a parabola to each side."""
        width, left = self.high - self.low, self.mode - self.low
        rising = self.low + np.sqrt(u * width * left)
        falling = self.high - np.sqrt((1.0 - u) * width * (self.high - self.mode))
        return _between(np.where(u * width < left, rising, falling), self.low, self.high)

    @property
    def support(self) -> tuple[float, float]:
        """The ends."""
        return self.low, self.high

    def fault(self) -> str | None:
        """Demand three numbers in order."""
        fits = self.low <= self.mode <= self.high and self.low < self.high
        return None if fits else "must be triangular = [low, mode, high], rising"


@dataclass(frozen=True, slots=True, kw_only=True)
class Integers(Distribution):
    """Every whole number from the least to the most, as likely; drawn as floats.

    Examples
    --------
    >>> Integers(least=1, most=3).quantile(np.array([0.0, 0.34, 0.99])).tolist()
    [1.0, 2.0, 3.0]
    """

    least: int
    most: int

    def quantile(self, u: Real) -> Real:
        """Return the number in whose share of 0..1 ``u`` lies."""
        step = np.floor(u * (self.most - self.least + 1))
        return _between(self.least + step, self.least, self.most)

    @property
    def support(self) -> tuple[float, float]:
        """The least and the most."""
        return float(self.least), float(self.most)

    @property
    def whole(self) -> bool:
        """Whole by definition."""
        return True

    def fault(self) -> str | None:
        """Demand ends in order."""
        return None if self.least <= self.most else "must be integers = [least, most], in order"


@dataclass(frozen=True, slots=True, kw_only=True)
class Values(Distribution):
    """One of some numbers.

    Parameters
    ----------
    values
        The numbers, rising, so that `quantile` rises too.
    weights
        How likely each is, relatively; none for all alike.
    """

    values: tuple[float, ...]
    weights: tuple[float, ...] = ()

    def quantile(self, u: Real) -> Real:
        """Return the number in whose share of 0..1 ``u`` lies."""
        numbers = np.asarray(self.values, np.float64)
        return np.take(numbers, _pick(u, self.weights, len(self.values)))

    @property
    def support(self) -> tuple[float, float]:
        """The lowest and the highest number."""
        return min(self.values), max(self.values)

    @property
    def whole(self) -> bool:
        """Whether all the numbers are whole."""
        return all(float(value).is_integer() for value in self.values)

    def fault(self) -> str | None:
        """Demand rising numbers, and a weight for each if for any."""
        if any(after <= before for before, after in pairwise(self.values)):
            return "must be values = [...], rising"
        return _weights_fault(self.weights, len(self.values))


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantiles(Distribution):
    """A distribution as it was measured: values at equal steps of probability, linear between.

    Parameters
    ----------
    values
        From the least to the greatest; none is below the one before.

    Examples
    --------
    >>> Quantiles(values=(0.2, 0.5, 1.0)).quantile(np.array([0.0, 0.25, 1.0])).tolist()
    [0.2, 0.35, 1.0]
    """

    values: tuple[float, ...]

    def quantile(self, u: Real) -> Real:
        """Return the value at the share ``u`` of the steps."""
        steps = np.linspace(0.0, 1.0, len(self.values))
        return np.asarray(np.interp(u, steps, np.asarray(self.values, np.float64)), np.float64)

    @property
    def support(self) -> tuple[float, float]:
        """The least and the greatest."""
        return self.values[0], self.values[-1]

    def fault(self) -> str | None:
        """Demand two values or more, in order."""
        falls = any(after < before for before, after in pairwise(self.values))
        if len(self.values) < 2 or falls:
            return "must be quantiles = [...], two or more, none below the one before"
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Choices:
    """One of some texts.

    Parameters
    ----------
    values
        The texts, each once.
    weights
        How likely each is, relatively; none for all alike.
    """

    values: tuple[str, ...]
    weights: tuple[float, ...] = ()

    def quantile(self, u: Real) -> Int:
        """Return the index of the text in whose share of 0..1 ``u`` lies."""
        return _pick(u, self.weights, len(self.values))

    def draw(self, rng: np.random.Generator, size: int | tuple[int, ...]) -> Int:
        """Return indices into `values`; one uniform number is taken for each."""
        return self.quantile(rng.random(size))

    def fault(self) -> str | None:
        """Demand different texts, and a weight for each if for any."""
        if len(set(self.values)) < len(self.values):
            return "must be values = [...], each once"
        return _weights_fault(self.weights, len(self.values))


def _between(values: Real, low: float, high: float) -> Real:
    """Hold rounding within the support, which has been checked to be allowed."""
    return np.asarray(np.clip(values, low, high), np.float64)


def _pick(u: Real, weights: tuple[float, ...], count: int) -> Int:
    """Indices of the weights' shares of 0..1 that hold ``u``; one without weight holds nothing."""
    shares = np.asarray(weights or (1.0,) * count, np.float64)
    some: Int = np.flatnonzero(shares)
    stops = np.cumsum(shares[some])
    holds = np.searchsorted(stops / stops[-1], u, side="right")
    return some[np.minimum(holds, some.size - 1)]


def _window_fault(low: float, high: float, cut: Callable[[], tuple[float, float]]) -> str | None:
    if not low < high:
        return "must be cut within = [low, high], low < high"
    below, above = cut()
    if above - below < LEAST_PROBABILITY:
        return f"must be cut where at least {LEAST_PROBABILITY:g} of it remains"
    return None


def _weights_fault(weights: tuple[float, ...], count: int) -> str | None:
    if count == 0:
        return "must hold at least one value"
    if weights and len(weights) != count:
        return f"must have a weight for each of the {count} values"
    if weights and (min(weights) < 0.0 or sum(weights) <= 0.0):
        return "must have weights >= 0, one of them > 0"
    return None
