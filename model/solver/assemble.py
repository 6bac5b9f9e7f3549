"""What hangs on the nodes of one scenario: banks with their loads, charging, the event's shunts.

First half of a pass of the ladder, which eliminates what is put up here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, compiled_apart
from ..states import State, Tree, Work
from .bank import YG_D, bank, plain_bank
from .matrix3 import ZERO, add, load, load_vector, plus, scaled, store, store_vector

__all__ = ["add_machine", "hang_bank", "set_admittances"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


@compiled
def set_admittances(tree: Tree, state: State, work: Work, s: int, floor_pu: float) -> None:
    """What hangs on every node and on the event node, at the work's winding voltages."""
    set_units(tree, state, work, s, floor_pu)
    y, y_j, g, unit_y = work.y, work.y_j, work.g, work.unit_y
    unit_node, plain, connections = tree.unit_node, tree.unit_plain, state.connection
    zh, zl, y0 = tree.unit_zh_ohm, tree.unit_zl_ohm, tree.unit_y0_s
    shunts = tree.shunt_s
    for k in range(y.shape[0]):
        store(y, k, load(shunts, k))
        store_vector(y_j, k, (0j, 0j, 0j))
    for unit in range(unit_node.size):
        node, connection = unit_node[unit], connections[unit, s]
        if not plain[unit] or connection > YG_D:
            hang_bank(tree, work, unit, connection)
            continue
        across = (unit_y[unit, 0, 0], unit_y[unit, 1, 1], unit_y[unit, 2, 2])
        shunt, winding = plain_bank(connection, zh[unit], zl[unit], y0[unit], across)
        store(y, node, add(load(y, node), shunt))
        store(g, unit, winding)
    add_branches(tree, state, work, s, floor_pu)
    node = state.far_node[s]
    if node >= 0:
        far_y, far_between_y = state.far_y_s, state.far_between_y_s
        for i in range(3):
            add_shunt(y, node, i, far_y[i, s], far_between_y[i, s])
    set_event_shunts(tree, state, work, s, floor_pu)


@compiled
def add_branches(tree: Tree, state: State, work: Work, s: int, floor_pu: float) -> None:
    """The branches of loads that stand on a bus themselves."""
    node, loads = tree.branch_node, tree.branch_load
    y, winding_v_pu, at = work.y, work.winding_v_pu, 4 * (tree.unit_node.size + 1)
    for p in range(node.size):
        k, i, j = node[p], tree.branch_from[p], tree.branch_to[p]
        own = 0j
        for n in range(tree.branch_first[p], tree.branch_first[p + 1]):
            own += load_admittance(tree, state, loads[n], s, winding_v_pu[at + p], floor_pu)
        y[k, i, i] += own
        if j >= 0:
            y[k, j, j] += own
            y[k, i, j] -= own
            y[k, j, i] -= own


@compiled
def load_admittance(
    tree: Tree, state: State, n: int, s: int, v_pu: float, floor_pu: float
) -> complex:
    """Admittance of one winding or branch of load n at the voltage across it."""
    nominal = complex(tree.load_y_s[n] * state.load_scale[n, s])
    exponent = state.exponent[n, s]
    if exponent == 2.0:
        return nominal
    if exponent >= 0.0:
        return nominal * voltage_factor(v_pu, exponent - 2.0, floor_pu)
    if tree.law_linear[n]:
        return nominal
    real, imag = law_factors(tree.law, n, v_pu)
    return complex(nominal.real * real, nominal.imag * imag)


@compiled_apart
def law_factors(law: Real, n: int, v_pu: float) -> tuple[float, float]:
    """Conductance and susceptance over their nominal values, by the law of load n.

    Beyond its limits it is the impedance at the limit. Where that ends at a lower voltage, the
    current goes linearly with the voltage from one limit to the other.
    """
    least, most, low, beyond = law[n, 10], law[n, 11], law[n, 12], law[n, 13]
    v = min(max(v_pu, least), most)
    if v != v_pu and beyond >= 0.0:
        real = imag = v ** (beyond - 2.0)
    else:
        real, imag = part_factor(law, n, 0, v), part_factor(law, n, 5, v)
    if v_pu < least and low > 0.0:
        if v_pu <= low:
            return 1.0, 1.0
        part = (v_pu - low) / (least - low)
        real = (low + (least * real - low) * part) / v_pu
        imag = (low + (least * imag - low) * part) / v_pu
    return real, imag


@compiled
def part_factor(law: Real, n: int, at: int, v: float) -> float:
    """Of the active (0) or reactive (5) part, within the limits."""
    factor = law[n, at] + law[n, at + 1] / v + law[n, at + 2] / (v * v)
    if law[n, at + 4] != 0.0:
        factor += law[n, at + 4] * v ** (law[n, at + 3] - 2.0)
    return float(factor)


@compiled_apart
def hang_bank(tree: Tree, work: Work, unit: int, connection: int) -> None:
    """Hang a bank with machines, a magnetizing branch or rarer windings on its node."""
    y, y_j, node = work.y, work.y_j, tree.unit_node[unit]
    shunt, drawn, winding, fed = bank(
        connection,
        tree.unit_zh_ohm[unit],
        tree.unit_zl_ohm[unit],
        tree.unit_y0_s[unit],
        tree.unit_ym_s[unit],
        load(work.unit_y, unit),
        load_vector(work.unit_j, unit),
    )
    store(y, node, add(load(y, node), shunt))
    store_vector(y_j, node, plus(load_vector(y_j, node), drawn))
    store(work.g, unit, winding)
    store_vector(work.g_j, unit, fed)


@compiled
def set_units(tree: Tree, state: State, work: Work, s: int, floor_pu: float) -> None:
    """Admittance across the LV windings of every unit, and the current fed in there."""
    unit_y, unit_j, v_pu, load_unit = work.unit_y, work.unit_j, work.winding_v_pu, tree.load_unit
    if unit_y.shape[0] == 0:
        return
    for unit in range(unit_y.shape[0]):
        store(unit_y, unit, ZERO)
        store_vector(unit_j, unit, (0j, 0j, 0j))
    for n in range(load_unit.size):
        unit = load_unit[n]
        if unit >= 0:
            for i in range(3):
                own = load_admittance(tree, state, n, s, v_pu[4 * unit + i], floor_pu)
                unit_y[unit, i, i] += own
    for m in range(tree.machine_unit.size):
        add_machine(tree, state, work, m, s, floor_pu)


@compiled
def add_machine(tree: Tree, state: State, work: Work, m: int, s: int, floor_pu: float) -> None:
    """What machine m puts across the LV windings of its unit."""
    unit_y, unit_j, unit = work.unit_y, work.unit_j, tree.machine_unit[m]
    machine_y, turn = state.machine_y_s, complex(-0.5, 0.75**0.5)
    power = state.machine_exponent[m, s] - 2.0
    taken = state.machine_va[m, s].conjugate() / (3.0 * tree.unit_v[unit] ** 2)
    y0, y2 = machine_y[m, 0, s], machine_y[m, 2, s]
    v1_pu = work.winding_v_pu[4 * unit + 3]
    y1 = machine_y[m, 1, s] + taken * voltage_factor(v1_pu, power, floor_pu)
    own = (y0 + y1 + y2) / 3.0
    ahead = (y0 + turn * y1 + turn.conjugate() * y2) / 3.0
    behind = (y0 + turn.conjugate() * y1 + turn * y2) / 3.0
    add_circulant(unit_y, unit, own, ahead, behind)
    j = state.machine_j_a[m, s]
    store_vector(unit_j, unit, plus(load_vector(unit_j, unit), (j, j * turn.conjugate(), j * turn)))


@compiled
def add_circulant(stack: Complex, k: int, own: complex, ahead: complex, behind: complex) -> None:
    """Add to matrix k the one with ``own`` on its diagonal and ``ahead`` right of it."""
    matrix = (own, ahead, behind, behind, own, ahead, ahead, behind, own)
    store(stack, k, add(load(stack, k), matrix))


@compiled
def add_shunt(stack: Complex, k: int, i: int, earth: complex, between: complex) -> None:
    """Add to matrix k what lies from phase i to earth, and from it to the phase after it."""
    following = (i + 1) % 3
    stack[k, i, i] += earth + between
    stack[k, following, following] += between
    stack[k, i, following] -= between
    stack[k, following, i] -= between


@compiled
def set_event_shunts(tree: Tree, state: State, work: Work, s: int, floor_pu: float) -> None:
    """Shunts at p and q; and the charging of the two parts of the event's edge."""
    event_y, edge, share = work.event_y, state.edge[s], state.share[s]
    store(event_y, 0, ZERO)
    store(event_y, 1, ZERO)
    if edge < 0:
        return
    step_y, between_y, fallen_y = state.step_y_s, state.between_y_s, state.fallen_y_s
    at, power = 4 * tree.unit_node.size, state.step_exponent[s] - 2.0
    for i in range(3):
        factor = voltage_factor(work.winding_v_pu[at + i], power, floor_pu)
        add_shunt(event_y, 0, i, step_y[i, s] * factor, between_y[i, s])
        event_y[1, i, i] += fallen_y[i, s]
    if tree.charged:
        half = load(tree.end_y_s, edge)
        above, below = scaled(half, share), scaled(half, 1.0 - share)
        last = tree.parent.size
        upper, lower = (
            (tree.tail[edge - last], tree.fork[edge - last])
            if edge >= last
            else (tree.parent[edge], edge)
        )
        store(event_y, 0, add(load(event_y, 0), above))
        store(event_y, 1, add(load(event_y, 1), below))
        # the nodes hold half of the whole edge's
        store(work.y, upper, add(load(work.y, upper), scaled(below, -1.0)))
        store(work.y, lower, add(load(work.y, lower), scaled(above, -1.0)))


@compiled
def voltage_factor(v_pu: float, power: float, floor_pu: float) -> float:
    """Admittance over nominal admittance: |V|**(exponent - 2), constant below the floor."""
    return 1.0 if power == 0.0 else float(np.exp(power * np.log(max(v_pu, floor_pu))))
