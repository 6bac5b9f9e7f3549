"""Matrices and vectors of lanes in memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from ...lanes.functions import joined, load_real, select, splat, store_real
from ..matrix3 import Matrix, Vector

__all__ = [
    "Stack",
    "add_entry",
    "add_in_lane",
    "add_matrix",
    "add_vector",
    "chosen",
    "chosen_vector",
    "in_lanes",
    "load_entry",
    "load_matrix",
    "load_triple",
    "no_vector",
    "put_in_lane",
    "store_entry",
    "store_matrix",
    "store_triple",
]

Stack = NDArray[np.float64]  #: (n, 2 m, WIDTH) of n rows of m complex numbers


@compiled
def load_entry(stack: Stack, k: int, i: int) -> complex:
    """Entry i of row k."""
    return joined(load_real(stack, (k, 2 * i, 0)), load_real(stack, (k, 2 * i + 1, 0)))


@compiled
def store_entry(stack: Stack, k: int, i: int, value: complex) -> None:
    """Write it."""
    store_real(stack, (k, 2 * i, 0), value.real)
    store_real(stack, (k, 2 * i + 1, 0), value.imag)


@compiled
def load_matrix(stack: Stack, k: int) -> Matrix:
    """Matrix k of a stack (n, 18, WIDTH)."""
    return (
        load_entry(stack, k, 0),
        load_entry(stack, k, 1),
        load_entry(stack, k, 2),
        load_entry(stack, k, 3),
        load_entry(stack, k, 4),
        load_entry(stack, k, 5),
        load_entry(stack, k, 6),
        load_entry(stack, k, 7),
        load_entry(stack, k, 8),
    )


@compiled
def store_matrix(stack: Stack, k: int, m: Matrix) -> None:
    """Write it."""
    store_entry(stack, k, 0, m[0])
    store_entry(stack, k, 1, m[1])
    store_entry(stack, k, 2, m[2])
    store_entry(stack, k, 3, m[3])
    store_entry(stack, k, 4, m[4])
    store_entry(stack, k, 5, m[5])
    store_entry(stack, k, 6, m[6])
    store_entry(stack, k, 7, m[7])
    store_entry(stack, k, 8, m[8])


@compiled
def add_matrix(stack: Stack, k: int, m: Matrix) -> None:
    """Add to matrix k."""
    store_entry(stack, k, 0, load_entry(stack, k, 0) + m[0])
    store_entry(stack, k, 1, load_entry(stack, k, 1) + m[1])
    store_entry(stack, k, 2, load_entry(stack, k, 2) + m[2])
    store_entry(stack, k, 3, load_entry(stack, k, 3) + m[3])
    store_entry(stack, k, 4, load_entry(stack, k, 4) + m[4])
    store_entry(stack, k, 5, load_entry(stack, k, 5) + m[5])
    store_entry(stack, k, 6, load_entry(stack, k, 6) + m[6])
    store_entry(stack, k, 7, load_entry(stack, k, 7) + m[7])
    store_entry(stack, k, 8, load_entry(stack, k, 8) + m[8])


@compiled
def load_triple(stack: Stack, k: int) -> Vector:
    """Vector k of a stack (n, 6, WIDTH)."""
    return (load_entry(stack, k, 0), load_entry(stack, k, 1), load_entry(stack, k, 2))


@compiled
def store_triple(stack: Stack, k: int, v: Vector) -> None:
    """Write it."""
    store_entry(stack, k, 0, v[0])
    store_entry(stack, k, 1, v[1])
    store_entry(stack, k, 2, v[2])


@compiled
def add_vector(stack: Stack, k: int, v: Vector) -> None:
    """Add to vector k."""
    store_entry(stack, k, 0, load_entry(stack, k, 0) + v[0])
    store_entry(stack, k, 1, load_entry(stack, k, 1) + v[1])
    store_entry(stack, k, 2, load_entry(stack, k, 2) + v[2])


@compiled
def chosen(mask: int, one: Matrix, other: Matrix) -> Matrix:
    """Matrices by lanes: ``one`` in those of ``mask``."""
    return (
        select(mask, one[0], other[0]),
        select(mask, one[1], other[1]),
        select(mask, one[2], other[2]),
        select(mask, one[3], other[3]),
        select(mask, one[4], other[4]),
        select(mask, one[5], other[5]),
        select(mask, one[6], other[6]),
        select(mask, one[7], other[7]),
        select(mask, one[8], other[8]),
    )


@compiled
def chosen_vector(mask: int, one: Vector, other: Vector) -> Vector:
    """Vectors by lanes."""
    return (
        select(mask, one[0], other[0]),
        select(mask, one[1], other[1]),
        select(mask, one[2], other[2]),
    )


@compiled
def in_lanes(m: Matrix) -> Matrix:
    """The same matrix in every lane."""
    one = joined(splat(1.0), splat(0.0))
    return (
        one * m[0],
        one * m[1],
        one * m[2],
        one * m[3],
        one * m[4],
        one * m[5],
        one * m[6],
        one * m[7],
        one * m[8],
    )


@compiled
def no_vector() -> Vector:
    """Zero in every lane."""
    zero = joined(splat(0.0), splat(0.0))
    return (zero, zero, zero)


@compiled
def add_entry(stack: Stack, k: int, i: int, value: complex) -> None:
    """Add to entry i of row k."""
    store_entry(stack, k, i, load_entry(stack, k, i) + value)


@compiled
def add_in_lane(stack: Stack, k: int, i: int, lane: int, value: complex) -> None:
    """Add to one lane of it."""
    stack[k, 2 * i, lane] += value.real
    stack[k, 2 * i + 1, lane] += value.imag


@compiled
def put_in_lane(stack: Stack, k: int, i: int, lane: int, value: complex) -> None:
    """Write one lane of it."""
    stack[k, 2 * i, lane] = value.real
    stack[k, 2 * i + 1, lane] = value.imag
