"""3x3 complex matrices as tuples of nine numbers, row by row, and vectors as three.

Compiled code keeps such values in registers: no views, no temporaries, no aliasing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..lanes.functions import joined, of_three, of_two

__all__ = [
    "IDENTITY",
    "ZERO",
    "Matrix",
    "Vector",
    "add",
    "column_sums",
    "inverse",
    "load",
    "load_vector",
    "minus",
    "outer",
    "plus",
    "plus_diagonal",
    "plus_everywhere",
    "product",
    "reciprocal",
    "row_sums",
    "scaled",
    "store",
    "store_vector",
    "times",
    "weighted",
]

Matrix = tuple[complex, complex, complex, complex, complex, complex, complex, complex, complex]
Vector = tuple[complex, complex, complex]
Complex = NDArray[np.complex128]

ZERO: Matrix = (0j, 0j, 0j, 0j, 0j, 0j, 0j, 0j, 0j)
IDENTITY: Matrix = (1 + 0j, 0j, 0j, 0j, 1 + 0j, 0j, 0j, 0j, 1 + 0j)


@compiled
def load(stack: Complex, k: int) -> Matrix:
    """Matrix k of a stack (n, 3, 3)."""
    return (
        stack[k, 0, 0],
        stack[k, 0, 1],
        stack[k, 0, 2],
        stack[k, 1, 0],
        stack[k, 1, 1],
        stack[k, 1, 2],
        stack[k, 2, 0],
        stack[k, 2, 1],
        stack[k, 2, 2],
    )


@compiled
def store(stack: Complex, k: int, m: Matrix) -> None:
    """Write matrix k of a stack (n, 3, 3)."""
    stack[k, 0, 0] = m[0]
    stack[k, 0, 1] = m[1]
    stack[k, 0, 2] = m[2]
    stack[k, 1, 0] = m[3]
    stack[k, 1, 1] = m[4]
    stack[k, 1, 2] = m[5]
    stack[k, 2, 0] = m[6]
    stack[k, 2, 1] = m[7]
    stack[k, 2, 2] = m[8]


@compiled
def load_vector(stack: Complex, k: int) -> Vector:
    """Row k of a stack (n, 3)."""
    return (stack[k, 0], stack[k, 1], stack[k, 2])


@compiled
def store_vector(stack: Complex, k: int, v: Vector) -> None:
    """Write row k of a stack (n, 3)."""
    stack[k, 0] = v[0]
    stack[k, 1] = v[1]
    stack[k, 2] = v[2]


@compiled
def add(a: Matrix, b: Matrix) -> Matrix:
    """``a + b``."""
    return (
        a[0] + b[0],
        a[1] + b[1],
        a[2] + b[2],
        a[3] + b[3],
        a[4] + b[4],
        a[5] + b[5],
        a[6] + b[6],
        a[7] + b[7],
        a[8] + b[8],
    )


@compiled
def scaled(a: Matrix, factor: float) -> Matrix:
    """``factor * a``."""
    return (
        factor * a[0],
        factor * a[1],
        factor * a[2],
        factor * a[3],
        factor * a[4],
        factor * a[5],
        factor * a[6],
        factor * a[7],
        factor * a[8],
    )


@compiled
def weighted(a: Matrix, factor: complex) -> Matrix:
    """``factor * a``."""
    return (
        factor * a[0],
        factor * a[1],
        factor * a[2],
        factor * a[3],
        factor * a[4],
        factor * a[5],
        factor * a[6],
        factor * a[7],
        factor * a[8],
    )


@compiled
def outer(u: Vector, v: Vector, factor: complex) -> Matrix:
    """``factor * u v^T``."""
    a, b, c = factor * u[0], factor * u[1], factor * u[2]
    return (
        a * v[0],
        a * v[1],
        a * v[2],
        b * v[0],
        b * v[1],
        b * v[2],
        c * v[0],
        c * v[1],
        c * v[2],
    )


@compiled
def row_sums(a: Matrix) -> Vector:
    """``a 1``."""
    return (a[0] + a[1] + a[2], a[3] + a[4] + a[5], a[6] + a[7] + a[8])


@compiled
def column_sums(a: Matrix) -> Vector:
    """``1^T a``."""
    return (a[0] + a[3] + a[6], a[1] + a[4] + a[7], a[2] + a[5] + a[8])


@compiled
def plus(u: Vector, v: Vector) -> Vector:
    """``u + v``."""
    return (u[0] + v[0], u[1] + v[1], u[2] + v[2])


@compiled
def minus(u: Vector) -> Vector:
    """``-u``."""
    return (-u[0], -u[1], -u[2])


@compiled
def plus_everywhere(a: Matrix, value: complex) -> Matrix:
    """``a`` with ``value`` added to every entry."""
    return (
        a[0] + value,
        a[1] + value,
        a[2] + value,
        a[3] + value,
        a[4] + value,
        a[5] + value,
        a[6] + value,
        a[7] + value,
        a[8] + value,
    )


@compiled
def plus_diagonal(a: Matrix, d: Vector) -> Matrix:
    """``a + diag(d)``."""
    return (a[0] + d[0], a[1], a[2], a[3], a[4] + d[1], a[5], a[6], a[7], a[8] + d[2])


@compiled
def product(a: Matrix, b: Matrix) -> Matrix:
    """``a @ b``."""
    return (
        of_three(a[0], b[0], a[1], b[3], a[2], b[6]),
        of_three(a[0], b[1], a[1], b[4], a[2], b[7]),
        of_three(a[0], b[2], a[1], b[5], a[2], b[8]),
        of_three(a[3], b[0], a[4], b[3], a[5], b[6]),
        of_three(a[3], b[1], a[4], b[4], a[5], b[7]),
        of_three(a[3], b[2], a[4], b[5], a[5], b[8]),
        of_three(a[6], b[0], a[7], b[3], a[8], b[6]),
        of_three(a[6], b[1], a[7], b[4], a[8], b[7]),
        of_three(a[6], b[2], a[7], b[5], a[8], b[8]),
    )


@compiled
def times(a: Matrix, v: Vector) -> Vector:
    """``a @ v``."""
    return (
        of_three(a[0], v[0], a[1], v[1], a[2], v[2]),
        of_three(a[3], v[0], a[4], v[1], a[5], v[2]),
        of_three(a[6], v[0], a[7], v[1], a[8], v[2]),
    )


@compiled
def reciprocal(x: complex) -> complex:
    """``1 / x`` without the library's rescaling; infinite at zero."""
    factor = 1.0 / (x.real * x.real + x.imag * x.imag)
    return joined(x.real * factor, -x.imag * factor)


@compiled
def inverse(a: Matrix) -> Matrix:
    """``a^-1`` by cofactors."""
    m3, m6, m1, m2 = -a[3], -a[6], -a[1], -a[2]
    c0 = of_two(a[4], a[8], -a[5], a[7])
    c3 = of_two(a[5], a[6], m3, a[8])
    c6 = of_two(a[3], a[7], m6, a[4])
    d = reciprocal(of_three(a[0], c0, a[1], c3, a[2], c6))
    return (
        c0 * d,
        of_two(a[2], a[7], m1, a[8]) * d,
        of_two(a[1], a[5], m2, a[4]) * d,
        c3 * d,
        of_two(a[0], a[8], m2, a[6]) * d,
        of_two(a[2], a[3], -a[0], a[5]) * d,
        c6 * d,
        of_two(a[1], a[6], -a[0], a[7]) * d,
        of_two(a[0], a[4], m1, a[3]) * d,
    )
