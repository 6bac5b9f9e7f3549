"""What an untouched sample of independent draws says: exact binomial bounds.

Source: C. J. Clopper and E. S. Pearson, Biometrika 26 (1934) 404-413.
"""

from __future__ import annotations

import math

from scipy.stats import beta

__all__ = ["needed_trials", "share_of_alpha", "two_sided", "upper_bound"]


def upper_bound(k: int, n: int, alpha: float) -> float:
    """One-sided upper bound of a probability after k of n, at confidence 1 - ``alpha``.

    Examples
    --------
    >>> round(upper_bound(0, 29_956, 0.05), 7)
    0.0001
    """
    if n <= 0 or k >= n:
        return 1.0
    if k == 0:
        return -math.expm1(math.log(alpha) / n)
    return float(beta.ppf(1.0 - alpha, k + 1, n - k))


def two_sided(k: int, n: int, alpha: float) -> tuple[float, float]:
    """Two-sided Clopper-Pearson interval of a probability after k of n."""
    if n <= 0:
        return 0.0, 1.0
    low = 0.0 if k == 0 else float(beta.ppf(alpha / 2.0, k, n - k + 1))
    high = 1.0 if k == n else float(beta.ppf(1.0 - alpha / 2.0, k + 1, n - k))
    return low, high


def needed_trials(target: float, alpha: float) -> int:
    """Smallest n at which no event in n trials bounds the probability by ``target``.

    Examples
    --------
    >>> needed_trials(1e-4, 0.05)
    29956
    """
    return math.ceil(math.log(alpha) / math.log1p(-target))


def share_of_alpha(confidence: float, attempt: int, terminals: int) -> float:
    """Error probability of each bound: attempt j has (1 - confidence) / 2^j for all terminals.

    The sum over all attempts is 1 - ``confidence``, so retrying until it succeeds buys
    nothing; the union over terminals lets their false-trip bounds hold together.
    """
    return (1.0 - confidence) / 2.0**attempt / max(terminals, 1)
