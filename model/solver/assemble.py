"""What hangs on the nodes of one scenario: banks with their loads, charging, the event's shunts.

First half of a pass of the ladder, which eliminates what is put up here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..states import State, Tree, Work
from .bank import YG_D, bank, plain_bank
from .matrix3 import ZERO, add, load, load_vector, plus, scaled, store, store_vector

__all__ = ["add_circulant", "set_admittances"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


@compiled
def set_admittances(
    tree: Tree, state: State, work: Work, s: int, unit_v_pu: Real, floor_pu: float
) -> None:
    """What hangs on every node and on the event node, at the winding voltages ``unit_v_pu``."""
    set_loads(tree, state, work, s, unit_v_pu, floor_pu)
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
    if tree.charged:
        add_charging(tree, work, state.edge[s])
    node = state.far_node[s]
    if node >= 0:
        far_y, far_between_y = state.far_y_s, state.far_between_y_s
        for i in range(3):
            add_shunt(y, node, i, far_y[i, s], far_between_y[i, s])
    set_event_shunts(tree, state, work, s, unit_v_pu, floor_pu)


@compiled
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
def set_loads(
    tree: Tree, state: State, work: Work, s: int, unit_v_pu: Real, floor_pu: float
) -> None:
    """Admittance across the LV windings of every unit, and the current fed in there."""
    unit_y, unit_j = work.unit_y, work.unit_j
    load_unit, load_y, machine_unit = tree.load_unit, tree.load_y_s, tree.machine_unit
    load_scale, exponent = state.load_scale, state.exponent
    machine_va, machine_y, machine_j = state.machine_va, state.machine_y_s, state.machine_j_a
    follows = state.machine_exponent
    for unit in range(unit_y.shape[0]):
        store(unit_y, unit, ZERO)
        store_vector(unit_j, unit, (0j, 0j, 0j))
    for n in range(load_unit.size):
        unit = load_unit[n]
        nominal = load_y[n] * load_scale[n, s]
        power = exponent[n, s] - 2.0
        for i in range(3):
            unit_y[unit, i, i] += nominal * voltage_factor(unit_v_pu[unit, i], power, floor_pu)
    turn = complex(-0.5, 0.75**0.5)
    for m in range(machine_unit.size):
        unit = machine_unit[m]
        power = follows[m, s] - 2.0
        taken = machine_va[m, s].conjugate() / (3.0 * tree.v_nominal_v**2)
        y0, y2 = machine_y[m, 0, s], machine_y[m, 2, s]
        y1 = machine_y[m, 1, s] + taken * voltage_factor(unit_v_pu[unit, 3], power, floor_pu)
        own = (y0 + y1 + y2) / 3.0
        ahead = (y0 + turn * y1 + turn.conjugate() * y2) / 3.0
        behind = (y0 + turn.conjugate() * y1 + turn * y2) / 3.0
        add_circulant(unit_y, unit, own, ahead, behind)
        j = machine_j[m, s]
        store_vector(
            unit_j, unit, plus(load_vector(unit_j, unit), (j, j * turn.conjugate(), j * turn))
        )


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
def add_charging(tree: Tree, work: Work, edge: int) -> None:
    """Half of every edge's charging at its ends; of the event's edge the parts beyond it."""
    y, parents, end_y = work.y, tree.parent, tree.end_y_s
    last = parents.size
    for k in range(1, last + (1 if tree.tail >= 0 else 0)):
        if k == edge:
            continue
        half = load(end_y, k)
        upper, lower = (tree.tail, tree.fork) if k == last else (parents[k], k)
        store(y, upper, add(load(y, upper), half))
        store(y, lower, add(load(y, lower), half))


@compiled
def set_event_shunts(
    tree: Tree, state: State, work: Work, s: int, unit_v_pu: Real, floor_pu: float
) -> None:
    """Shunts at p and q; and the charging of the two parts of the event's edge."""
    event_y, edge, share = work.event_y, state.edge[s], state.share[s]
    store(event_y, 0, ZERO)
    store(event_y, 1, ZERO)
    if edge < 0:
        return
    step_y, between_y, fallen_y = state.step_y_s, state.between_y_s, state.fallen_y_s
    power = state.step_exponent[s] - 2.0
    for i in range(3):
        factor = voltage_factor(unit_v_pu[-1, i], power, floor_pu)
        add_shunt(event_y, 0, i, step_y[i, s] * factor, between_y[i, s])
        event_y[1, i, i] += fallen_y[i, s]
    if tree.charged:
        half = load(tree.end_y_s, edge)
        above, below = scaled(half, share), scaled(half, 1.0 - share)
        last = tree.parent.size
        upper, lower = (tree.tail, tree.fork) if edge == last else (tree.parent[edge], edge)
        store(event_y, 0, add(load(event_y, 0), above))
        store(event_y, 1, add(load(event_y, 1), below))
        store(work.y, upper, add(load(work.y, upper), above))
        store(work.y, lower, add(load(work.y, lower), below))


@compiled
def voltage_factor(v_pu: float, power: float, floor_pu: float) -> float:
    """Admittance over nominal admittance: |V|**(exponent - 2), constant below the floor."""
    return 1.0 if power == 0.0 else float(np.exp(power * np.log(max(v_pu, floor_pu))))
