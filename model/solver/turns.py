"""A regulator or transformer at the upper end of an edge: voltages below it are T V."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..states import State, Tree, Work
from .matrix3 import IDENTITY, Matrix, load, load_vector, product, store, store_vector, times

__all__ = ["transposed", "turn_edge", "turn_of"]

Flags = NDArray[np.bool_]


@compiled
def transposed(a: Matrix) -> Matrix:
    """``a'``."""
    return (a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8])


@compiled
def regulator_turn(tree: Tree, state: State, work: Work, row: int, s: int) -> Matrix:
    """T of a regulator: each phase has its ratio to the phase it refers to, or to earth."""
    t, reference, ratio = work.here[2], tree.reference, state.ratio
    store(work.here, 2, IDENTITY)
    for i in range(3):
        more = ratio[row, i, s] - 1.0
        t[i, i] += more
        if reference[row, i] >= 0:
            t[i, reference[row, i]] -= more
    return load(work.here, 2)


@compiled
def turn_of(tree: Tree, state: State, work: Work, k: int, s: int) -> Matrix:
    """T of what stands at the upper end of edge k."""
    if tree.regulator[k] >= 0:
        return regulator_turn(tree, state, work, tree.regulator[k], s)
    return load(tree.turn, tree.transformer[k])


@compiled
def turn_edge(tree: Tree, state: State, work: Work, k: int, s: int, carried: Flags) -> None:
    """Put what stands at the upper end of edge k above the rest of it."""
    t = turn_of(tree, state, work, k, s)
    back = transposed(t)
    store(work.f, k, product(load(work.f, k), t))
    store(work.w, k, product(back, product(load(work.w, k), t)))
    store_vector(work.x_j, k, times(back, load_vector(work.x_j, k)))
    for c in range(carried.size):
        if carried[c]:
            store(work.x[k], c, product(back, load(work.x[k], c)))
            store(work.xt, c, product(load(work.xt, c), t))
