"""Uniform numbers that go together: a Gaussian copula with given rank correlations.

Normal variables of correlation ρ have Spearman's rank correlation r = 6/π·asin(ρ/2), and
keep it under every rising function of each (Pearson 1907). So ρ = 2·sin(π·r/6),
and any distributions' quantiles of the uniform numbers have rank correlation r; where a
distribution holds few different numbers, ties bring it nearer to 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

__all__ = ["contradiction", "joint_uniforms", "normal_correlations"]

Real = NDArray[np.float64]

ROUNDING = 1e-9
"""What rounding may leave of an eigenvalue or a variance that is 0."""


def normal_correlations(count: int, ranks: Mapping[tuple[int, int], float]) -> Real:
    """Return the (K, K) correlations of K normal variables with these rank correlations.

    Parameters
    ----------
    count
        Number K of variables.
    ranks
        Spearman's rank correlation by pair of indices; all others are 0.

    Examples
    --------
    >>> normal_correlations(2, {(0, 1): 0.5}).round(4).tolist()
    [[1.0, 0.5176], [0.5176, 1.0]]
    """
    matrix = np.eye(count)
    for (one, other), rank in ranks.items():
        matrix[one, other] = matrix[other, one] = 2.0 * math.sin(math.pi * rank / 6.0)
    return matrix


def contradiction(correlations: Real) -> tuple[int, ...]:
    """Return variables whose correlations cannot all hold at once; none if all can.

    They are as few as possible: without any one of them, the others' could hold.

    Examples
    --------
    >>> contradiction(normal_correlations(4, {(0, 1): 0.9, (1, 3): 0.9, (0, 3): -0.9}))
    (0, 1, 3)
    """
    if _can_hold(correlations):
        return ()
    kept = list(range(len(correlations)))
    for variable in range(len(correlations)):
        rest = [k for k in kept if k != variable]
        if not _can_hold(correlations[np.ix_(rest, rest)]):
            kept = rest
    return tuple(kept)


def _can_hold(correlations: Real) -> bool:
    """Tell whether no combination of the variables would have a negative variance."""
    return bool(np.linalg.eigvalsh(correlations)[0] >= -ROUNDING)


def joint_uniforms(rng: np.random.Generator, size: int, correlations: Real) -> Real:
    """Draw (K, size) numbers, each row uniform in 0..1, with these correlations behind them.

    A row that is correlated with none before it is the same whatever the other correlations.

    Parameters
    ----------
    rng
        K·size normal numbers are taken from it.
    size
        Number of scenarios.
    correlations
        (K, K) of the normal variables, in which there is no `contradiction`.
    """
    normals = rng.standard_normal((len(correlations), size))
    return np.asarray(ndtr(_root(correlations) @ normals), np.float64)


def _root(correlations: Real) -> Real:
    """Return the lower triangular root; Cholesky's, but variables may determine each other."""
    root = np.zeros_like(correlations)
    for k, row in enumerate(correlations):
        rest = row[k] - root[k, :k] @ root[k, :k]
        if rest > ROUNDING:
            root[k:, k] = (correlations[k:, k] - root[k:, :k] @ root[k, :k]) / math.sqrt(rest)
    return root
