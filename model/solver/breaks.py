"""Open phases: projections of the three-phase equations at a break.

Below the break the network draws  I = W V + X V_fork + x  from it, and  I' = X' V + U V_fork + u
from the loop's fork (X, X', U and u are zero where the break is in no loop, x and u where no
machine feeds in current). An open phase a has no current, so

    V_a = -(sum_{b != a} w_ab V_b + x_ab V_fork + x_a) / w_aa

replaces V_a everywhere; phase by phase, so that one, two or three phases are one thing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from .matrix3 import IDENTITY, ZERO, reciprocal, store, store_vector

__all__ = ["DEAD", "FLOATING", "NOTHING_S", "SINGULAR", "UNDEFINED", "open_phases", "squared"]

Complex = NDArray[np.complex128]

DEAD = 1  #: an opened conductor's far side is connected to nothing, or to no source
FLOATING = 2  #: an opened conductor's far side has equipment, but no way to earth
UNDEFINED = 8  #: times 2^a: phase a has no voltage of its own beyond the break

SINGULAR = 1e-9  #: a driving-point admittance below this share of max|W| counts as zero
NOTHING_S = 1e-12  #: and so does one below this, which idle windings leave of rounding


@compiled
def open_phases(mask: int, here: Complex, here_j: Complex) -> int:
    """Open the phases in ``mask``; returns flags.

    ``here`` (7, 3, 3) holds W, X, X', U and ``here_j`` (3, 3) x and u, changed in place; they
    receive P, H and h: the voltage below the break is P V + H V_fork + h, V the voltage
    above it. A phase that is connected to nothing or to no earth below gets zero volts and a
    flag. The last slot of ``here`` is scratch.
    """
    w, x, xt, u, p, h, row = here[0], here[1], here[2], here[3], here[4], here[5], here[6]
    x_j, u_j, h_j = here_j[0], here_j[1], here_j[2]
    store(here, 4, IDENTITY)
    store(here, 5, ZERO)
    store_vector(here_j, 2, (0j, 0j, 0j))
    largest = 0.0
    for i in range(3):
        for j in range(3):
            largest = max(largest, squared(w[i, j]))
    limit = max(SINGULAR**2 * largest, NOTHING_S**2)
    empty = 0
    for i in range(3):
        if max(squared(w[i, 0]), squared(w[i, 1]), squared(w[i, 2])) <= limit:
            empty |= 1 << i
    flags = 0
    for a in range(3):
        if not mask & (1 << a):
            continue
        # V_a = row[0] V + row[1] V_fork + row_j
        if squared(w[a, a]) <= limit:
            flags |= UNDEFINED << a
            flags |= DEAD if empty & (1 << a) else FLOATING
            for i in range(3):  # an opened phase that hangs on this one is as little defined
                if i != a and mask & (1 << i) and squared(p[i, a]) > SINGULAR**2:
                    flags |= UNDEFINED << i
            for j in range(3):
                row[0, j] = row[1, j] = 0.0
            row_j = 0j
        else:
            scale = -reciprocal(w[a, a])
            row_j = scale * x_j[a]
            for j in range(3):
                row[0, j] = scale * w[a, j]
                row[1, j] = scale * x[a, j]
            row[0, a] = 0.0
        for i in range(3):
            from_w, from_xt, from_p = w[i, a], xt[i, a], p[i, a]
            for j in range(3):
                w[i, j] += from_w * row[0, j]
                x[i, j] += from_w * row[1, j]
                xt[i, j] += from_xt * row[0, j]
                u[i, j] += from_xt * row[1, j]
                p[i, j] += from_p * row[0, j]
                h[i, j] += from_p * row[1, j]
            x_j[i] += from_w * row_j
            u_j[i] += from_xt * row_j
            h_j[i] += from_p * row_j
            w[i, a] = xt[i, a] = p[i, a] = 0.0
        for j in range(3):
            w[a, j] = x[a, j] = 0.0
        x_j[a] = 0.0
    return flags


@compiled
def squared(value: complex) -> float:
    """``|value|**2``."""
    return value.real * value.real + value.imag * value.imag
