"""Matrices and vectors of lanes in memory, and one lane of them as ordinary numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from ...lanes import joined, load_real, select, store_real
from ..matrix3 import Matrix, Vector

__all__ = [
    "Stack",
    "add_lane",
    "add_lane_vector",
    "add_matrix",
    "add_vector",
    "chosen",
    "load_entry",
    "load_matrix",
    "load_triple",
    "put_lane",
    "put_lane_vector",
    "store_entry",
    "store_matrix",
    "store_triple",
    "take_lane",
    "take_lane_vector",
]

Stack = NDArray[np.float64]  #: (n, 2 m, WIDTH) of n rows of m complex numbers
Complex = NDArray[np.complex128]


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
def take_lane(stack: Stack, k: int, lane: int, out: Complex, n: int) -> None:
    """One lane of matrix k, into matrix n of ``out`` (m, 3, 3)."""
    for i in range(9):
        out[n, i // 3, i % 3] = complex(stack[k, 2 * i, lane], stack[k, 2 * i + 1, lane])


@compiled
def put_lane(stack: Stack, k: int, lane: int, given: Complex, n: int) -> None:
    """The way back."""
    for i in range(9):
        stack[k, 2 * i, lane] = given[n, i // 3, i % 3].real
        stack[k, 2 * i + 1, lane] = given[n, i // 3, i % 3].imag


@compiled
def add_lane(stack: Stack, k: int, lane: int, given: Complex, n: int) -> None:
    """Add matrix n of ``given`` to that lane."""
    for i in range(9):
        stack[k, 2 * i, lane] += given[n, i // 3, i % 3].real
        stack[k, 2 * i + 1, lane] += given[n, i // 3, i % 3].imag


@compiled
def take_lane_vector(stack: Stack, k: int, lane: int, out: Complex, n: int) -> None:
    """One lane of vector k, into row n of ``out`` (m, 3)."""
    for i in range(3):
        out[n, i] = complex(stack[k, 2 * i, lane], stack[k, 2 * i + 1, lane])


@compiled
def put_lane_vector(stack: Stack, k: int, lane: int, given: Complex, n: int) -> None:
    """The way back."""
    for i in range(3):
        stack[k, 2 * i, lane] = given[n, i].real
        stack[k, 2 * i + 1, lane] = given[n, i].imag


@compiled
def add_lane_vector(stack: Stack, k: int, lane: int, given: Complex, n: int) -> None:
    """Add row n of ``given`` to that lane."""
    for i in range(3):
        stack[k, 2 * i, lane] += given[n, i].real
        stack[k, 2 * i + 1, lane] += given[n, i].imag
