"""The fixed point of loads whose admittance follows the voltage: one step, and when to stop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..states import State, Tree, Work
from .matrix3 import Vector, load, load_vector, plus, times

__all__ = ["is_linear", "is_steady", "positive", "see_magnitudes", "update_magnitudes"]

Real = NDArray[np.float64]

SECANT_PASSES = 60  #: by then the secant has settled the loads, or it wanders
PLAIN_PASSES = 260  #: by then plain steps have; what rounding still moves takes short ones
SHORT_STEP = 0.35
LEAST_SHARE = 0.2  #: of a gap that counts as error, whatever two passes show
TINY = 1e-300  #: less than any voltage that counts


@compiled
def update_magnitudes(tree: Tree, state: State, work: Work, s: int, passes: int) -> float:
    """Move winding and step voltages towards the solved ones; returns the error of these.

    The largest gap between assumed and solved, in pu of the largest voltage where that exceeds
    nominal, bounds the error of what was assumed. The solved ones move by only part of what the
    assumed ones do, at most as much as two passes have shown, and their error is smaller by that.
    From the second pass on the step follows the secant through this pass and the last (Anderson's
    mixing of depth one), which also ends cycles and creeping near collapse; what wanders all the
    same settles in plain steps.
    """
    v_pu, history = work.winding_v_pu, work.history
    largest = max(1.0, find_gaps(tree, state, work, s))
    change = along = across = assumed = solved = 0.0
    for n in range(v_pu.size):
        gap = history[2, n]
        turn = gap - history[1, n]
        moved = v_pu[n] - history[0, n]
        assumed, solved = max(assumed, abs(moved)), max(solved, abs(moved + turn))
        change = max(change, abs(gap))
        along += gap * turn
        across += turn * turn
    plain = passes == 1 or passes > SECANT_PASSES or across == 0.0
    back = 0.0 if plain else along / across
    step = SHORT_STEP if passes > PLAIN_PASSES else 1.0
    for n in range(v_pu.size):
        value, gap = v_pu[n], history[2, n]
        moved = value - history[0, n] + gap - history[1, n]
        v_pu[n] = max(value + step * gap - back * moved, 0.0)
        history[0, n] = value
        history[1, n] = gap
    if passes == 1:
        work.follows[0] = LEAST_SHARE
        return change / largest
    work.follows[0] = max(work.follows[0], solved / max(assumed - solved, solved, TINY))
    return change / largest * work.follows[0]


@compiled
def see_magnitudes(tree: Tree, state: State, work: Work, s: int) -> None:
    """Take over the solved voltages where nothing depended on them."""
    find_gaps(tree, state, work, s)
    v_pu, gaps = work.winding_v_pu, work.history[2]
    for n in range(v_pu.size):
        v_pu[n] += gaps[n]


@compiled
def find_gaps(tree: Tree, state: State, work: Work, s: int) -> float:
    """How far the solved voltages are from those assumed; returns the largest voltage, in pu."""
    unit_node, unit_v, v_all, v_pu, gaps = (
        tree.unit_node,
        tree.unit_v,
        work.v,
        work.winding_v_pu,
        work.history[2],
    )
    units = unit_node.size
    sourced = tree.machine_unit.size > 0
    last = 4 if sourced else 3
    largest = 0.0
    for unit in range(units):
        v = times(load(work.g, unit), load_vector(v_all, unit_node[unit]))
        if sourced:
            v = plus(v, load_vector(work.g_j, unit))
        for i in range(last):
            size = magnitude(v[i] if i < 3 else positive(v)) / unit_v[unit]
            gaps[4 * unit + i] = size - v_pu[4 * unit + i]
            largest = max(largest, size)
    edge = state.edge[s]
    if edge >= 0:
        count = tree.parent.size
        nominal = tree.node_v[edge if edge < count else tree.tail[edge - count]]
        for i in range(3):
            size = magnitude(work.stub[0, i]) / nominal
            gaps[4 * units + i] = size - v_pu[4 * units + i]
            largest = max(largest, size)
    else:
        gaps[4 * units : 4 * units + 3] = 0.0
    node, first, other, nominal_v = (
        tree.branch_node,
        tree.branch_from,
        tree.branch_to,
        tree.branch_v,
    )
    at = 4 * (units + 1)
    for p in range(node.size):
        across = v_all[node[p], first[p]]
        if other[p] >= 0:
            across -= v_all[node[p], other[p]]
        size = magnitude(across) / nominal_v[p]
        gaps[at + p] = size - v_pu[at + p]
        largest = max(largest, size)
    return largest


@compiled
def magnitude(value: complex) -> float:
    """``|value|``."""
    return float(np.sqrt(value.real * value.real + value.imag * value.imag))


@compiled
def positive(v: Vector) -> complex:
    """Positive-sequence component of three phases."""
    turn = complex(-0.5, 0.75**0.5)
    return (v[0] + turn * v[1] + turn.conjugate() * v[2]) / 3.0


@compiled
def is_linear(tree: Tree, state: State, s: int) -> bool:
    """Whether nothing in scenario ``s`` depends on the magnitude of a voltage."""
    exponent, law_linear = state.exponent, tree.law_linear
    linear = is_steady(state, s)
    for n in range(exponent.shape[0]):
        linear &= exponent[n, s] == 2.0 or (exponent[n, s] < 0.0 and law_linear[n])
    return linear


@compiled
def is_steady(state: State, s: int) -> bool:
    """Whether no machine and no step follows a voltage."""
    follows, machine_va = state.machine_exponent, state.machine_va
    linear = bool(state.edge[s] < 0 or state.step_exponent[s] == 2.0)
    for m in range(follows.shape[0]):
        linear &= follows[m, s] == 2.0 or machine_va[m, s] == 0.0
    return linear
