"""Open phases: projections of the three-phase equations at a break.

Below the break the network draws  I = W V + X V_fork  from it, and  I' = X' V + U V_fork
from the loop's fork (X, X', U are zero where the break is in no loop). An open phase a has
no current, so

    V_a = -(sum_{b != a} w_ab V_b + x_a V_fork) / w_aa

replaces V_a everywhere; phase by phase, so that one, two or three phases are one thing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .compiled import compiled
from .matrix3 import IDENTITY, ZERO, load, store

__all__ = ["DEAD", "FLOATING", "open_phases", "open_series"]

Complex = NDArray[np.complex128]

DEAD = 1  #: an opened conductor's far side is connected to nothing, or to no source
FLOATING = 2  #: an opened conductor's far side has equipment, but no way to earth

SINGULAR = 1e-9  #: a driving-point admittance below this share of max|W| counts as zero


@compiled
def open_phases(mask: int, here: Complex) -> int:
    """Open the phases in ``mask``; returns flags.

    ``here`` (6, 3, 3) holds W, X, X', U, changed in place, and receives P and H: the
    voltage below the break is P V + H V_fork, V the voltage above it. A phase that is
    connected to nothing or to no earth below gets zero volts and a flag.
    """
    w, x, xt, u, p, h = here[0], here[1], here[2], here[3], here[4], here[5]
    store(here, 4, IDENTITY)
    store(here, 5, ZERO)
    size = np.abs(w)
    limit = SINGULAR * size.max()
    row_w = np.zeros(3, np.complex128)
    row_x = np.zeros(3, np.complex128)
    flags = 0
    for a in range(3):
        if not mask & (1 << a):
            continue
        row_w[:] = 0.0
        row_x[:] = 0.0
        if abs(w[a, a]) <= limit:
            flags |= DEAD if size[a].max() <= limit else FLOATING
        else:
            row_w[:] = -w[a] / w[a, a]
            row_x[:] = -x[a] / w[a, a]
            row_w[a] = 0.0
        for i in range(3):
            from_w, from_xt, from_p = w[i, a], xt[i, a], p[i, a]
            w[i] += from_w * row_w
            x[i] += from_w * row_x
            xt[i] += from_xt * row_w
            u[i] += from_xt * row_x
            p[i] += from_p * row_w
            h[i] += from_p * row_x
            w[i, a] = xt[i, a] = p[i, a] = 0.0
        w[a] = 0.0
        x[a] = 0.0
    return flags


@compiled
def open_series(mask: int, here: Complex) -> None:
    """Open phases of a series admittance: slot 0 of ``here`` (n, 3, 3), in place."""
    w = here[0]
    for a in range(3):
        if mask & (1 << a):
            row = w[a] / w[a, a]
            for i in range(3):
                w[i] -= w[i, a] * row
                w[i, a] = 0.0
            w[a] = 0.0
