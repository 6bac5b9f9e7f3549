"""Sequences, and superimposed quantities: now minus the window ΔT earlier, (1)-(2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..model.symmetrical import A

__all__ = [
    "compensated",
    "negative_sequence",
    "positive_sequence",
    "superimposed",
    "zero_sequence",
]

Complex = NDArray[np.complex128]


def positive_sequence(abc: Complex) -> Complex:
    """Positive-sequence component of phases a, b, c on the axis before the last.

    Shape (..., 3, S) becomes (..., S).
    """
    return np.asarray((abc[..., 0, :] + A * abc[..., 1, :] + A.conjugate() * abc[..., 2, :]) / 3.0)


def negative_sequence(abc: Complex) -> Complex:
    """Negative-sequence component, as ``positive_sequence``."""
    return np.asarray((abc[..., 0, :] + A.conjugate() * abc[..., 1, :] + A * abc[..., 2, :]) / 3.0)


def zero_sequence(abc: Complex) -> Complex:
    """Zero-sequence component, as ``positive_sequence``."""
    return np.asarray((abc[..., 0, :] + abc[..., 1, :] + abc[..., 2, :]) / 3.0)


def superimposed(now: Complex, earlier: Complex) -> Complex:
    """Equations (1)-(2): the change of a phasor over ΔT."""
    return np.asarray(now - earlier)


def compensated(now: Complex, earlier: Complex, v_now: Complex, v_earlier: Complex) -> Complex:
    """X* = X' - X V'/V: the part of a change that the local voltage change does not explain.

    Where ``v_earlier`` is zero there is nothing to compensate with: the plain change.
    """
    dead = v_earlier == 0
    ratio = np.where(dead, 1.0, v_now) / np.where(dead, 1.0, v_earlier)
    return np.asarray(now - earlier * ratio)
