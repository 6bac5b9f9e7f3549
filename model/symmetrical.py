"""Phase quantities (a, b, c) to symmetrical components (0, 1, 2) and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["FORTESCUE", "A", "phase_matrix", "to_phases", "to_sequences"]

A = np.exp(2j * np.pi / 3)  #: the operator a

#: columns are the sequences 0, 1, 2 in phases a, b, c
FORTESCUE = np.array([[1, 1, 1], [1, A**2, A], [1, A, A**2]])


def to_sequences(abc: NDArray[np.complex128], axis: int = 0) -> NDArray[np.complex128]:
    """Symmetrical components in order 0, 1, 2 of the phase axis ``axis``."""
    turned = np.moveaxis(abc, axis, 0)
    return np.moveaxis(np.tensordot(np.linalg.inv(FORTESCUE), turned, axes=1), 0, axis)


def to_phases(sequences: NDArray[np.complex128], axis: int = 0) -> NDArray[np.complex128]:
    """Phase quantities of symmetrical components in order 0, 1, 2."""
    turned = np.moveaxis(sequences, axis, 0)
    return np.moveaxis(np.tensordot(FORTESCUE, turned, axes=1), 0, axis)


def phase_matrix(z0: complex, z1: complex, z2: complex) -> NDArray[np.complex128]:
    """The 3x3 phase matrix of a transposed element with these sequence impedances."""
    own = (z0 + z1 + z2) / 3.0
    up = (z0 + A * z1 + A**2 * z2) / 3.0
    down = (z0 + A**2 * z1 + A * z2) / 3.0
    if z1 == z2:  # exactly symmetric, and a single float pair where all three agree
        up = down = (z0 - z1) / 3.0
    return np.array([[own, up, down], [down, own, up], [up, down, own]], np.complex128)
