"""Past a series impedance: the equations that the ladder climbs and descends by."""

from __future__ import annotations

from ..compiled import compiled
from .matrix3 import (
    Matrix,
    Vector,
    add,
    inverse,
    minus,
    plus,
    plus_diagonal,
    product,
    scaled,
    times,
)

__all__ = ["both", "carry", "carry_current", "up"]


@compiled
def up(y: Matrix, z: Matrix) -> tuple[Matrix, Matrix]:
    """F and W of the series impedance ``z`` above ``y``."""
    f = inverse(plus_diagonal(product(z, y), (1 + 0j, 1 + 0j, 1 + 0j)))
    return f, product(y, f)


@compiled
def carry(
    y: Matrix, z: Matrix, f: Matrix, x: Matrix, xt: Matrix, u: Matrix
) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """H and the fill X, X', U past the series impedance ``z`` above ``y``."""
    h = scaled(product(f, product(z, x)), -1.0)
    return h, add(x, product(y, h)), product(xt, f), add(u, product(xt, h))


@compiled
def carry_current(
    y: Matrix, z: Matrix, f: Matrix, x_j: Vector, xt: Matrix, u_j: Vector
) -> tuple[Vector, Vector, Vector]:
    """The last column of H, X and U past ``z`` above ``y``; ``xt`` is X' below ``z``."""
    h_j = minus(times(f, times(z, x_j)))
    return h_j, plus(x_j, times(y, h_j)), plus(u_j, times(xt, h_j))


@compiled
def both(a: Matrix, v: Vector, b: Matrix, v_fork: Vector) -> Vector:
    """``a @ v + b @ v_fork``."""
    return plus(times(a, v), times(b, v_fork))
