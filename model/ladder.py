"""The ladder: a three-phase network, eliminated upwards and solved downwards.

Every tree edge has a series impedance Z (3x3) and feeds a node whose admittance to
earth, with all that hangs below it, is Y. Going up,

    F = (I + Z Y)^-1,   W = Y F,   Y_parent += W

and going down V = F V_parent: no load is ever inverted and Z = 0 is an ordinary value.

A loop is the chain of nodes below its fork, whose last node, the tail, is joined back to
the fork by the chord. The chain carries that second connection as fill: below any of its
nodes the network draws  I = Y V + X V_fork  from the node, and  I' = X' V + U V_fork
from the fork. Past a series impedance

    V = F V_parent + H V_fork,   H = -F Z X,
    W = Y F,   X += Y H,   U += X' H,   X' = X' F.

An event node stands on any edge, a share of Z above it and the rest below. A load step is
a shunt there; open phases are the projections of ``breaks``, between the upper stub p and
the lower stub q.

Compiled functions take one scenario of a block and write into its workspace; ``solve`` is
the door for everybody else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .bank import bank
from .breaks import DEAD, open_phases, open_series
from .compiled import compiled
from .matrix3 import (
    ZERO,
    Matrix,
    Vector,
    add,
    inverse,
    load,
    load_vector,
    plus_diagonal,
    product,
    scaled,
    store,
    store_vector,
    times,
)
from .states import NOT_CONVERGED, Answer, Probes, State, Tree, Work

__all__ = ["solve_block"]

Real = NDArray[np.float64]


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
def set_admittances(
    tree: Tree, state: State, work: Work, s: int, unit_v_pu: Real, floor_pu: float
) -> None:
    """Node and step admittances of scenario ``s`` at the winding voltages ``unit_v_pu``."""
    y, g, unit_y, step_y = work.y, work.g, work.unit_y, work.step_y
    load_unit, load_y, unit_node = tree.load_unit, tree.load_y_s, tree.unit_node
    zh, zl, y0 = tree.unit_zh_ohm, tree.unit_zl_ohm, tree.unit_y0_s
    load_scale, exponent, connection = state.load_scale, state.exponent, state.connection
    for k in range(y.shape[0]):
        store(y, k, ZERO)
    for unit in range(unit_node.size):
        store_vector(unit_y, unit, (0j, 0j, 0j))
    for n in range(load_unit.size):
        unit = load_unit[n]
        nominal = load_y[n] * load_scale[n, s]
        power = exponent[n, s] - 2.0
        for i in range(3):
            unit_y[unit, i] += nominal * voltage_factor(unit_v_pu[unit, i], power, floor_pu)
    for unit in range(unit_node.size):
        node = unit_node[unit]
        shunt, winding = bank(
            connection[unit, s], zh[unit], zl[unit], y0[unit], load_vector(unit_y, unit)
        )
        store(y, node, add(load(y, node), shunt))
        store(g, unit, winding)
    power = state.step_exponent[s] - 2.0
    for i in range(3):
        step_y[0, i] = state.step_y_s[i, s] * voltage_factor(unit_v_pu[-1, i], power, floor_pu)


@compiled
def voltage_factor(v_pu: float, power: float, floor_pu: float) -> float:
    """Admittance over nominal admittance: |V|**(exponent - 2), constant below the floor."""
    return 1.0 if power == 0.0 else float(np.exp(power * np.log(max(v_pu, floor_pu))))


@compiled
def climb(tree: Tree, work: Work, edge: int, share: float, mask: int) -> int:
    """Eliminate every node from the leaves to the source; returns flags.

    ``work.y`` holds each node's own admittance and becomes the admittance below it.
    """
    parents, z_all, in_loop, fork = tree.parent, tree.z_ohm, tree.in_loop, tree.fork
    y_all, f_all, w_all, h_all, x_all = work.y, work.f, work.w, work.h, work.x
    fill = work.fill
    last = parents.size
    flags = 0
    for k in range(last - 1, -1, -1):
        if k == tree.tail:
            if edge == last:
                chord(tree, work, share, mask)
            else:
                chord(tree, work, 1.0, 0)
        y = load(y_all, k)
        z = load(z_all, k)
        looped = in_loop[k]
        if k == edge:
            flags |= climb_event(work, k, y, z, looped, share, mask)
        else:
            f, w = up(y, z)
            store(f_all, k, f)
            store(w_all, k, w)
            if looped:
                # X of the node below in the chain stands in this node's own slot
                h, x, xt, u = carry(y, z, f, load(x_all, k), load(fill, 0), load(fill, 1))
                store(h_all, k, h)
                store(x_all, k, x)
                store(fill, 0, xt)
                store(fill, 1, u)
        parent = parents[k]
        if parent < 0:
            continue
        total = add(load(y_all, parent), load(w_all, k))
        if looped and parent == fork:
            x = load(x_all, k)
            total = add(add(total, x), add(load(fill, 0), load(fill, 1)))
        elif looped:
            store(x_all, parent, load(x_all, k))
        store(y_all, parent, total)
    return flags


@compiled
def climb_event(
    work: Work, k: int, y: Matrix, z: Matrix, looped: bool, share: float, mask: int
) -> int:
    """Eliminate edge k with the event node on it; returns flags."""
    event, here = work.event, work.here
    z_low, z_up = scaled(z, 1.0 - share), scaled(z, share)
    flags = 0
    f, w = up(y, z_low)
    h = x = xt = u = ZERO
    if looped:
        h, x, xt, u = carry(y, z_low, f, load(work.x, k), load(work.fill, 0), load(work.fill, 1))
    store(event, 4, f)
    store(event, 5, h)
    if mask:
        store(here, 0, w)
        store(here, 1, x)
        store(here, 2, xt)
        store(here, 3, u)
        flags = open_phases(mask, here)
        if mask == 7 and not looped:
            flags |= DEAD
        w, x, xt, u = load(here, 0), load(here, 1), load(here, 2), load(here, 3)
        store(event, 2, load(here, 4))
        store(event, 3, load(here, 5))
    y = plus_diagonal(w, load_vector(work.step_y, 0))
    f, w = up(y, z_up)
    h = ZERO
    if looped:
        h, x, xt, u = carry(y, z_up, f, x, xt, u)
        store(work.x, k, x)
        store(work.fill, 0, xt)
        store(work.fill, 1, u)
    store(event, 0, f)
    store(event, 1, h)
    store(work.w, k, w)
    return flags


@compiled
def chord(tree: Tree, work: Work, share: float, mask: int) -> None:
    """Add the chord, with its event if any, to the tail's Y, and start the fill.

    Closed it is the two-port  share * z,  load step to earth,  (1 - share) * z;
    open phases carry no current, so their rows and columns vanish.
    """
    last = tree.parent.size
    z = load(tree.z_ohm, last)
    if mask:
        store(work.here, 0, inverse(z))
        open_series(mask, work.here)
        w = load(work.here, 0)
        x = xt = scaled(w, -1.0)
        u = w
    else:
        step = load_vector(work.step_y, 0)
        if share == 1.0:
            step = (0j, 0j, 0j)
        middle = plus_diagonal(ZERO, step)
        to_step = product(z, middle)
        a = plus_diagonal(scaled(to_step, share), (1 + 0j, 1 + 0j, 1 + 0j))
        d = plus_diagonal(scaled(product(middle, z), 1.0 - share), (1 + 0j, 1 + 0j, 1 + 0j))
        b = add(z, scaled(product(to_step, z), share * (1.0 - share)))
        b_inverse = inverse(b)
        w = product(d, b_inverse)
        x = plus_diagonal(scaled(product(w, a), -1.0), step)
        xt = scaled(b_inverse, -1.0)
        u = product(b_inverse, a)
    store(work.w, last, w)
    store(work.x, last, x)
    store(work.chord_end, 0, xt)
    store(work.chord_end, 1, u)
    store(work.x, tree.tail, x)
    store(work.fill, 0, xt)
    store(work.fill, 1, u)
    store(work.y, tree.tail, add(load(work.y, tree.tail), w))


@compiled
def both(a: Matrix, v: Vector, b: Matrix, v_fork: Vector) -> Vector:
    """``a @ v + b @ v_fork``."""
    one, two = times(a, v), times(b, v_fork)
    return (one[0] + two[0], one[1] + two[1], one[2] + two[2])


@compiled
def descend(tree: Tree, work: Work, edge: int, share: float, mask: int) -> None:
    """Voltages and currents from the source to the leaves, and the stubs of the event node."""
    parents, in_loop, fork = tree.parent, tree.in_loop, tree.fork
    v_all, f_all, h_all, w_all, x_all = work.v, work.f, work.h, work.w, work.x
    i_up, i_low, stub, event = work.i_up, work.i_low, work.stub, work.event
    last = parents.size
    for k in range(last):
        above = load_vector(v_all, parents[k] if k else last)
        looped = in_loop[k]
        v_fork = load_vector(v_all, fork) if looped else (0j, 0j, 0j)
        if looped:
            current = both(load(w_all, k), above, load(x_all, k), v_fork)
        else:
            current = times(load(w_all, k), above)
        store_vector(i_up, k, current)
        store_vector(i_low, k, current)
        if k == edge:
            v = both(load(event, 0), above, load(event, 1), v_fork)
            store_vector(stub, 0, v)
            for i in range(3):
                i_low[k, i] -= work.step_y[0, i] * stub[0, i]
            if mask:
                v = both(load(event, 2), v, load(event, 3), v_fork)
            store_vector(stub, 1, v)
            v = both(load(event, 4), v, load(event, 5), v_fork)
        elif looped:
            v = both(load(f_all, k), above, load(h_all, k), v_fork)
        else:
            v = times(load(f_all, k), above)
        store_vector(v_all, k, v)
    if tree.tail >= 0:
        v_tail, v_fork = load_vector(v_all, tree.tail), load_vector(v_all, fork)
        into = both(load(w_all, last), v_tail, load(x_all, last), v_fork)
        back = both(load(work.chord_end, 0), v_tail, load(work.chord_end, 1), v_fork)
        store_vector(i_up, last, into)
        store_vector(i_low, last, (-back[0], -back[1], -back[2]))
        if edge == last:
            z = load(tree.z_ohm, last)
            drop, rise = times(z, into), times(z, back)
            for i in range(3):
                stub[0, i] = v_tail[i] - share * drop[i]
                stub[1, i] = v_fork[i] - (1.0 - share) * rise[i]


@compiled
def update_magnitudes(tree: Tree, work: Work, unit_v_pu: Real, history: Real, first: bool) -> float:
    """Move winding and step voltages towards the solved ones; returns the largest gap, pu.

    From the second pass on the step follows the secant through this pass and the last
    (Anderson's mixing of depth one), which also ends cycles and creeping near collapse.
    ``history`` (3, U + 1, 3): the last pass's voltages and gaps, and this pass's gaps.
    """
    units = tree.unit_node.size
    change = along = across = 0.0
    for unit in range(units + 1):
        if unit < units:
            v = times(load(work.g, unit), load_vector(work.v, tree.unit_node[unit]))
        else:
            v = load_vector(work.stub, 0)
        for i in range(3):
            size = np.sqrt(v[i].real ** 2 + v[i].imag ** 2) / tree.v_nominal_v
            gap = size - unit_v_pu[unit, i]
            turn = gap - history[1, unit, i]
            change = max(change, abs(gap))
            along += gap * turn
            across += turn * turn
            history[2, unit, i] = gap
    back = 0.0 if first or across == 0.0 else along / across
    for unit in range(units + 1):
        for i in range(3):
            v_pu, gap = unit_v_pu[unit, i], history[2, unit, i]
            moved = v_pu - history[0, unit, i] + gap - history[1, unit, i]
            unit_v_pu[unit, i] = max(v_pu + gap - back * moved, 0.0)
            history[0, unit, i] = v_pu
            history[1, unit, i] = gap
    return change


@compiled
def solve_block(
    tree: Tree,
    state: State,
    probes: Probes,
    work: Work,
    answer: Answer,
    tolerance_pu: float,
    most_passes: int,
    floor_pu: float,
) -> None:
    """Solve S scenarios one after the other into ``answer``.

    ``answer.unit_v_pu`` is the start of the fixed point and its end. Loads are constant
    impedance below ``floor_pu``. What does not settle within ``most_passes`` is flagged.
    """
    last = tree.parent.size
    v_node, i_edge, i_below = probes.v_node, probes.i_edge, probes.i_below
    v_out, i_out, stub_out, unit_out = answer.v, answer.i, answer.stub, answer.unit_v_pu
    exponent, v, stub = state.exponent, work.v, work.stub
    i_up, i_low = work.i_up, work.i_low
    unit_v_pu = np.empty((unit_out.shape[0], 3))
    history = np.zeros((3, unit_out.shape[0], 3))
    turn = np.exp(-2j * np.pi / 3)
    for s in range(state.emf_pu.size):
        edge, share, mask = state.edge[s], state.share[s], state.open_mask[s]
        linear = edge < 0 or state.step_exponent[s] == 2.0
        for n in range(exponent.shape[0]):
            linear &= exponent[n, s] == 2.0
        emf = complex(state.emf_pu[s] * tree.v_nominal_v, 0.0)
        store_vector(v, last, (emf, emf * turn, emf * turn.conjugate()))
        store_vector(stub, 0, (0j, 0j, 0j))
        store_vector(stub, 1, (0j, 0j, 0j))
        for unit in range(unit_v_pu.shape[0]):
            for i in range(3):
                unit_v_pu[unit, i] = unit_out[unit, i, s]
        settled = False
        flags = 0
        passes = 0
        while not settled and passes < most_passes:
            passes += 1
            set_admittances(tree, state, work, s, unit_v_pu, floor_pu)
            flags = climb(tree, work, edge, share, mask)
            descend(tree, work, edge, share, mask)
            change = update_magnitudes(tree, work, unit_v_pu, history, passes == 1)
            settled = linear or change <= tolerance_pu
        answer.flags[s] = flags if settled else flags | NOT_CONVERGED
        answer.passes[s] = passes
        for i in range(3):
            for unit in range(unit_v_pu.shape[0]):
                unit_out[unit, i, s] = unit_v_pu[unit, i]
            stub_out[0, i, s] = stub[0, i]
            stub_out[1, i, s] = stub[1, i]
            for n in range(v_node.size):
                v_out[n, i, s] = v[v_node[n], i]
            for n in range(i_edge.size):
                k = i_edge[n]
                i_out[n, i, s] = i_low[k, i] if i_below[n] else i_up[k, i]
