"""The fixed point of loads whose admittance follows the voltage: one step, and when to stop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..states import State, Tree, Work
from .matrix3 import Vector, load, load_vector, plus, times

__all__ = ["is_linear", "positive", "update_magnitudes"]

Real = NDArray[np.float64]

SECANT_PASSES = 60  #: by then the secant has settled the loads, or it wanders
PLAIN_PASSES = 260  #: by then plain steps have; what rounding still moves takes short ones
SHORT_STEP = 0.35


@compiled
def update_magnitudes(tree: Tree, work: Work, unit_v_pu: Real, history: Real, passes: int) -> float:
    """Move winding and step voltages towards the solved ones; returns the largest gap.

    The gap is in pu, of the largest voltage where that exceeds nominal. From the second pass
    on the step follows the secant through this pass and the last (Anderson's mixing of depth
    one), which also ends cycles and creeping near collapse; what wanders all the same settles
    in plain steps. ``history`` (3, U + 1, 4): the last pass's voltages and gaps, and this
    pass's gaps.
    """
    unit_node, g, g_j, v_all, stub = tree.unit_node, work.g, work.g_j, work.v, work.stub
    units = unit_node.size
    sourced = tree.machine_unit.size > 0
    last = 4 if sourced else 3
    change = along = across = 0.0
    largest = 1.0
    for unit in range(units + 1):
        if unit < units:
            v = times(load(g, unit), load_vector(v_all, unit_node[unit]))
            if sourced:
                v = plus(v, load_vector(g_j, unit))
        else:
            v = load_vector(stub, 0)
        for i in range(last):
            value = v[i] if i < 3 else positive(v)
            size = np.sqrt(value.real**2 + value.imag**2) / tree.v_nominal_v
            gap = size - unit_v_pu[unit, i]
            turn = gap - history[1, unit, i]
            change, largest = max(change, abs(gap)), max(largest, size)
            along += gap * turn
            across += turn * turn
            history[2, unit, i] = gap
    plain = passes == 1 or passes > SECANT_PASSES or across == 0.0
    back = 0.0 if plain else along / across
    step = SHORT_STEP if passes > PLAIN_PASSES else 1.0
    for unit in range(units + 1):
        for i in range(last):
            v_pu, gap = unit_v_pu[unit, i], history[2, unit, i]
            moved = v_pu - history[0, unit, i] + gap - history[1, unit, i]
            unit_v_pu[unit, i] = max(v_pu + step * gap - back * moved, 0.0)
            history[0, unit, i] = v_pu
            history[1, unit, i] = gap
    return change / largest


@compiled
def positive(v: Vector) -> complex:
    """Positive-sequence component of three phases."""
    turn = complex(-0.5, 0.75**0.5)
    return (v[0] + turn * v[1] + turn.conjugate() * v[2]) / 3.0


@compiled
def is_linear(tree: Tree, state: State, s: int) -> bool:
    """Whether nothing in scenario ``s`` depends on the magnitude of a voltage."""
    exponent, follows, machine_va = state.exponent, state.machine_exponent, state.machine_va
    linear = bool(state.edge[s] < 0 or state.step_exponent[s] == 2.0)
    for n in range(exponent.shape[0]):
        linear &= exponent[n, s] == 2.0
    for m in range(follows.shape[0]):
        linear &= follows[m, s] == 2.0 or machine_va[m, s] == 0.0
    return linear
