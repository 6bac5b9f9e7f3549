"""Past a series impedance: what is seen from above it.

F and W are the ladder's; H and the fill X, X', U exist for every loop whose chain runs over the
impedance, and the last column for machines' currents.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..states import Work
from .matrix3 import (
    Matrix,
    Vector,
    add,
    inverse,
    load,
    load_vector,
    minus,
    plus,
    plus_diagonal,
    product,
    scaled,
    store,
    store_vector,
    times,
)

__all__ = ["carry", "carry_current", "per_fork", "up"]

Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]


@compiled
def up(y: Matrix, z: Matrix) -> tuple[Matrix, Matrix]:
    """F and W of the series impedance ``z`` above ``y``."""
    f = inverse(plus_diagonal(product(z, y), (1 + 0j, 1 + 0j, 1 + 0j)))
    return f, product(y, f)


@compiled
def carry(y: Matrix, z: Matrix, f: Matrix, x_all: Complex, work: Work, carried: Flags) -> None:
    """X, X' and U past the series impedance ``z`` above ``y``; H takes the place of X.

    ``x_all`` (C, 3, 3) holds X and receives H; X past the impedance is X + Y H, which the caller
    adds, who knows where to.
    """
    chords = carried.size
    for c in range(chords):
        if carried[c]:
            store(x_all, c, scaled(product(f, product(z, load(x_all, c))), -1.0))
    for c in range(chords):
        if carried[c]:
            xt = load(work.xt, c)
            for d in range(chords):
                if carried[d]:
                    store(work.u[c], d, add(load(work.u[c], d), product(xt, load(x_all, d))))
            store(work.xt, c, product(xt, f))


@compiled
def carry_current(
    y: Matrix, z: Matrix, f: Matrix, x_j: Vector, work: Work, carried: Flags
) -> tuple[Vector, Vector]:
    """The last column of H and X past ``z`` above ``y``, and that of U; before ``carry``."""
    h_j = minus(times(f, times(z, x_j)))
    for c in range(carried.size):
        if carried[c]:
            more = times(load(work.xt, c), h_j)
            store_vector(work.u_j, c, plus(load_vector(work.u_j, c), more))
    return h_j, plus(x_j, times(y, h_j))


@compiled
def per_fork(
    stack: Complex, carried: Flags, fork: NDArray[np.int64], v: Complex, total: Vector
) -> Vector:
    """``total`` and the sum of ``stack[c] @ V_fork[c]`` over the loops that are carried."""
    for c in range(carried.size):
        if carried[c]:
            total = plus(total, times(load(stack, c), load_vector(v, fork[c])))
    return total
