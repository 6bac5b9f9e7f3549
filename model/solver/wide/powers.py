"""Powers of positive numbers in lanes, to the last digits."""

from __future__ import annotations

from ...compiled import compiled
from ...lanes.functions import larger, power_of_two, rounded, select, smaller, splat, split_power

__all__ = ["power"]

LOG2_E = 1.4426950408889634
LN2_HIGH, LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
FURTHEST = 700.0  #: of an exponent: e**700 is still a number


@compiled
def power(base: float, exponent: float) -> float:
    """``base ** exponent`` in every lane; ``base`` must be positive."""
    return exponential(exponent * logarithm(base))


@compiled
def logarithm(x: float) -> float:
    """Natural logarithm.

    With x = m 2^n, m from sqrt(1/2) to sqrt(2), and z = (m - 1) / (m + 1) it is  n ln 2 +
    2 (z + z^3/3 + z^5/5 + ...), which ends where z^2 < 0.03 leaves nothing.
    """
    m, n = split_power(x)
    upper = m > 1.4142135623730951
    m = select(upper, 0.5 * m, m)
    n = select(upper, n + 1.0, n)
    z = (m - 1.0) / (m + 1.0)
    t = z * z
    tail = 1.0 / 19.0 + t * (1.0 / 21.0)
    tail = 1.0 / 17.0 + t * tail
    tail = 1.0 / 15.0 + t * tail
    tail = 1.0 / 13.0 + t * tail
    tail = 1.0 / 11.0 + t * tail
    tail = 1.0 / 9.0 + t * tail
    tail = 1.0 / 7.0 + t * tail
    tail = 1.0 / 5.0 + t * tail
    tail = 1.0 / 3.0 + t * tail
    return n * LN2_HIGH + (2.0 * z + (2.0 * z * t * tail + n * LN2_LOW))


@compiled
def exponential(x: float) -> float:
    """``e**x``: 2^n times the power series of what is left, at most ln 2 / 2."""
    x = larger(smaller(x, splat(FURTHEST)), splat(-FURTHEST))
    n = rounded(x * LOG2_E)
    r = (x - n * LN2_HIGH) - n * LN2_LOW
    series = 1.0 / 479001600.0 + r * (1.0 / 6227020800.0)
    series = 1.0 / 39916800.0 + r * series
    series = 1.0 / 3628800.0 + r * series
    series = 1.0 / 362880.0 + r * series
    series = 1.0 / 40320.0 + r * series
    series = 1.0 / 5040.0 + r * series
    series = 1.0 / 720.0 + r * series
    series = 1.0 / 120.0 + r * series
    series = 1.0 / 24.0 + r * series
    series = 1.0 / 6.0 + r * series
    series = 0.5 + r * series
    return (1.0 + (r + r * r * series)) * power_of_two(n)
