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

Machines feed in currents that no voltage drives: they add a last column to X and U, hence to
H, which stands in vectors of its own (x, u, h below, ``..._j`` in the workspace).

An event node stands on any edge, a share of Z above it and the rest below. It has two sides,
the upper stub p and the lower stub q, each with a shunt; open phases between them are the
projections of ``breaks``.

Compiled functions take one scenario of a block and write into its workspace; ``solve`` is
the door for everybody else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .bank import YG_D, bank, plain_bank
from .breaks import DEAD, FLOATING, SINGULAR, open_phases, squared
from .compiled import compiled
from .matrix3 import (
    ZERO,
    Matrix,
    Vector,
    add,
    column_sums,
    inverse,
    load,
    load_vector,
    minus,
    plus,
    plus_diagonal,
    product,
    reciprocal,
    scaled,
    store,
    store_vector,
    times,
)
from .states import NOT_CONVERGED, Answer, Probes, State, Tree, Work

__all__ = ["solve_block"]

Complex = NDArray[np.complex128]
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
def carry_current(
    y: Matrix, z: Matrix, f: Matrix, x_j: Vector, xt: Matrix, u_j: Vector
) -> tuple[Vector, Vector, Vector]:
    """The last column of H, X and U past ``z`` above ``y``; ``xt`` is X' below ``z``."""
    h_j = minus(times(f, times(z, x_j)))
    return h_j, plus(x_j, times(y, h_j)), plus(u_j, times(xt, h_j))


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


@compiled
def climb(tree: Tree, state: State, work: Work, s: int) -> int:
    """Eliminate every node from the leaves to the source; returns flags.

    ``work.y`` holds each node's own admittance and becomes the admittance below it.
    """
    parents, in_loop, z_all, regulator = tree.parent, tree.in_loop, tree.z_ohm, tree.regulator
    y_all, y_j, f_all, w_all = work.y, work.y_j, work.f, work.w
    h_all, x_all, h_j, x_j, fill, fill_j = (
        work.h,
        work.x,
        work.h_j,
        work.x_j,
        work.fill,
        work.fill_j,
    )
    edge, share, mask, fork = state.edge[s], state.share[s], state.open_mask[s], tree.fork
    last = parents.size
    sourced = tree.machine_unit.size > 0
    flags = 0
    for k in range(last - 1, -1, -1):
        if k == tree.tail:
            flags |= climb_chord(tree, work, edge == last, share, mask)
        y, z, looped, drawn = load(y_all, k), load(z_all, k), in_loop[k], load_vector(y_j, k)
        if k == edge:
            flags |= climb_event(work, k, y, z, share, mask, looped, drawn)
        else:
            f, w = up(y, z)
            store(f_all, k, f)
            store(w_all, k, w)
            if sourced:
                xt = load(fill, 0) if looped else ZERO
                ahead, drawn, back = carry_current(y, z, f, drawn, xt, load_vector(fill_j, 0))
                store_vector(h_j, k, ahead)
                store_vector(x_j, k, drawn)
                if looped:
                    store_vector(fill_j, 0, back)
            if looped:
                # X of the node below in the chain stands in this node's own slot
                h, x, xt, u = carry(y, z, f, load(x_all, k), load(fill, 0), load(fill, 1))
                store(h_all, k, h)
                store(x_all, k, x)
                store(fill, 0, xt)
                store(fill, 1, u)
            if regulator[k] >= 0:
                regulate(work, k, state.ratio, regulator[k], s, looped)
        parent = parents[k]
        if parent < 0:
            continue
        total = add(load(y_all, parent), load(w_all, k))
        if sourced:
            drawn = plus(load_vector(y_j, parent), load_vector(x_j, k))
            if looped and parent == fork:
                drawn = plus(drawn, load_vector(fill_j, 0))
            store_vector(y_j, parent, drawn)
        if looped and parent == fork:
            total = add(add(total, load(x_all, k)), add(load(fill, 0), load(fill, 1)))
        elif looped:
            store(x_all, parent, load(x_all, k))
        store(y_all, parent, total)
    return flags


@compiled
def regulate(work: Work, k: int, ratio: Real, row: int, s: int, looped: bool) -> None:
    """Put a regulator at the upper end of edge k, which has been eliminated."""
    f, w, x, x_j, xt = work.f[k], work.w[k], work.x[k], work.x_j[k], work.fill[0]
    for j in range(3):
        t = ratio[row, j, s]
        for i in range(3):
            f[i, j] *= t
            w[i, j] *= t
            if looped:
                xt[i, j] *= t
    for i in range(3):
        t = ratio[row, i, s]
        x_j[i] *= t
        for j in range(3):
            w[i, j] *= t
            if looped:
                x[i, j] *= t


@compiled
def climb_event(
    work: Work, k: int, y: Matrix, z: Matrix, share: float, mask: int, looped: bool, x_j: Vector
) -> int:
    """Eliminate edge k with the event node on it; returns flags."""
    here, here_j = work.here, work.here_j
    z_low = scaled(z, 1.0 - share)
    f, w = up(y, z_low)
    h = x = xt = u = ZERO
    u_j = (0j, 0j, 0j)
    if looped:
        xt, u, u_j = load(work.fill, 0), load(work.fill, 1), load_vector(work.fill_j, 0)
    h_j, x_j, u_j = carry_current(y, z_low, f, x_j, xt, u_j)
    if looped:
        h, x, xt, u = carry(y, z_low, f, load(work.x, k), xt, u)
    store(work.event, 4, f)
    store(work.event, 5, h)
    store_vector(work.event_j, 2, h_j)
    store(here, 0, w)
    store(here, 1, x)
    store(here, 2, xt)
    store(here, 3, u)
    store_vector(here_j, 0, x_j)
    store_vector(here_j, 1, u_j)
    fed = x_j[0] != 0.0 or x_j[1] != 0.0 or x_j[2] != 0.0
    flags = cross(work, scaled(z, share), mask, 1)
    if mask == 7 and not looped and not fed:
        flags |= DEAD
    store(work.w, k, load(here, 0))
    store_vector(work.x_j, k, load_vector(here_j, 0))
    if looped:
        store(work.x, k, load(here, 1))
        store(work.fill, 0, load(here, 2))
        store(work.fill, 1, load(here, 3))
        store_vector(work.fill_j, 0, load_vector(here_j, 1))
    return flags


@compiled
def cross(work: Work, z: Matrix, mask: int, below: int) -> int:
    """Climb over the event node and the series impedance ``z`` above it; returns flags.

    What is below stands in ``work.here``, and what is seen from above ``z`` replaces it.
    ``below`` is the side that is met first: 1 for q, 0 for p.
    """
    here, here_j, event, event_j = work.here, work.here_j, work.event, work.event_j
    store(here, 0, add(load(here, 0), load(work.event_y, below)))
    flags = 0
    if mask:
        flags = open_phases(mask, here, here_j)
        store(event, 2, load(here, 4))
        store(event, 3, load(here, 5))
        store_vector(event_j, 1, load_vector(here_j, 2))
    y = add(load(here, 0), load(work.event_y, 1 - below))
    f, w = up(y, z)
    xt = load(here, 2)
    h_j, x_j, u_j = carry_current(y, z, f, load_vector(here_j, 0), xt, load_vector(here_j, 1))
    h, x, xt, u = carry(y, z, f, load(here, 1), xt, load(here, 3))
    store(event, 0, f)
    store(event, 1, h)
    store_vector(event_j, 0, h_j)
    store(here, 0, w)
    store(here, 1, x)
    store(here, 2, xt)
    store(here, 3, u)
    store_vector(here_j, 0, x_j)
    store_vector(here_j, 1, u_j)
    return flags


@compiled
def climb_chord(tree: Tree, work: Work, happening: bool, share: float, mask: int) -> int:
    """Add the chord to the tail's Y and start the fill; returns flags.

    An event on it is climbed over from the farther end, so that what is inverted is never
    the small part of the impedance.
    """
    last = tree.parent.size
    here = work.here
    z = load(tree.z_ohm, last)
    flags = 0
    if happening:
        far = 1.0 - share if share <= 0.5 else share
        w = inverse(scaled(z, far))
    else:
        w = inverse(z)
    away = scaled(w, -1.0)
    store(here, 0, w)
    store(here, 1, away)
    store(here, 2, away)
    store(here, 3, w)
    store_vector(work.here_j, 0, (0j, 0j, 0j))
    store_vector(work.here_j, 1, (0j, 0j, 0j))
    if happening:
        flags = cross(work, scaled(z, 1.0 - far), mask, 1 if share <= 0.5 else 0)
    # seen from the tail: I = W V + X V_fork, and from the fork: I' = X' V + U V_fork
    w, x, xt, u = load(here, 0), load(here, 1), load(here, 2), load(here, 3)
    if happening and share > 0.5:
        w, x, xt, u = u, xt, x, w
    store(work.w, last, w)
    store(work.x, last, x)
    store(work.chord_end, 0, xt)
    store(work.chord_end, 1, u)
    store(work.x, tree.tail, x)
    store(work.fill, 0, xt)
    store(work.fill, 1, u)
    store_vector(work.fill_j, 0, (0j, 0j, 0j))
    store(work.y, tree.tail, add(load(work.y, tree.tail), w))
    return flags


@compiled
def both(a: Matrix, v: Vector, b: Matrix, v_fork: Vector) -> Vector:
    """``a @ v + b @ v_fork``."""
    return plus(times(a, v), times(b, v_fork))


@compiled
def lift_neutral(tree: Tree, work: Work) -> int:
    """Shift the EMF (last row of V) by the neutral's voltage; returns flags.

    The source's currents sum to what leaves the neutral. An impedance there, in the source's
    zero sequence, would be thousands of times all others and cost as much in digits.
    """
    last = work.y.shape[0]
    w, emf = load(work.w, 0), load_vector(work.v, last)
    sums, current = column_sums(w), plus(times(w, emf), load_vector(work.x_j, 0))
    total = sums[0] + sums[1] + sums[2] + tree.neutral_y_s
    largest = 0.0
    for i in range(9):
        largest = max(largest, squared(w[i]))
    if squared(total) <= SINGULAR**2 * largest:
        return FLOATING
    shift = -(current[0] + current[1] + current[2]) * reciprocal(total)
    store_vector(work.v, last, plus(emf, (shift, shift, shift)))
    return 0


@compiled
def descend(tree: Tree, state: State, work: Work, s: int) -> None:
    """Voltages and currents from the source to the leaves, and the stubs of the event node."""
    parents, in_loop, regulator, ratio = tree.parent, tree.in_loop, tree.regulator, state.ratio
    v_all, f_all, h_all, w_all, x_all = work.v, work.f, work.h, work.w, work.x
    h_j, x_j, i_up, i_low = work.h_j, work.x_j, work.i_up, work.i_low
    edge, share, mask, fork = state.edge[s], state.share[s], state.open_mask[s], tree.fork
    last = parents.size
    sourced = tree.machine_unit.size > 0
    for k in range(last):
        above = load_vector(v_all, parents[k] if k else last)
        looped = in_loop[k]
        v_fork = load_vector(v_all, fork) if looped else (0j, 0j, 0j)
        if looped:
            current = both(load(w_all, k), above, load(x_all, k), v_fork)
        else:
            current = times(load(w_all, k), above)
        if sourced:
            current = plus(current, load_vector(x_j, k))
        store_vector(i_up, k, current)
        if k == edge:
            v = descend_event(work, 0, above, v_fork, mask)
            v = plus(
                both(load(work.event, 4), v, load(work.event, 5), v_fork),
                load_vector(work.event_j, 2),
            )
            lost = plus(
                times(load(work.event_y, 0), load_vector(work.stub, 0)),
                times(load(work.event_y, 1), load_vector(work.stub, 1)),
            )
            current = plus(current, minus(lost))
        else:
            if looped:
                v = both(load(f_all, k), above, load(h_all, k), v_fork)
            else:
                v = times(load(f_all, k), above)
            if sourced:
                v = plus(v, load_vector(h_j, k))
        store_vector(i_low, k, current)
        row = regulator[k]
        if row >= 0:
            for i in range(3):
                i_low[k, i] /= ratio[row, i, s]
        store_vector(v_all, k, v)
    if tree.tail >= 0:
        v_tail, v_fork = load_vector(v_all, tree.tail), load_vector(v_all, fork)
        into = both(load(work.w, last), v_tail, load(work.x, last), v_fork)
        back = both(load(work.chord_end, 0), v_tail, load(work.chord_end, 1), v_fork)
        store_vector(i_up, last, into)
        store_vector(i_low, last, minus(back))
        if edge == last and share <= 0.5:
            descend_event(work, 0, v_tail, v_fork, mask)
        elif edge == last:
            descend_event(work, 1, v_fork, v_tail, mask)
    if tree.charged:
        add_charging_currents(tree, work, edge, share)


@compiled
def descend_event(work: Work, near: int, above: Vector, v_fork: Vector, mask: int) -> Vector:
    """Voltages of both stubs, ``near`` (0 for p) first; returns that of the other."""
    event, event_j = work.event, work.event_j
    v = plus(both(load(event, 0), above, load(event, 1), v_fork), load_vector(event_j, 0))
    store_vector(work.stub, near, v)
    if mask:
        v = plus(both(load(event, 2), v, load(event, 3), v_fork), load_vector(event_j, 1))
    store_vector(work.stub, 1 - near, v)
    return v


@compiled
def add_charging_currents(tree: Tree, work: Work, edge: int, share: float) -> None:
    """The currents at an edge's ends include what charges that end of it."""
    parents, end_y, v, i_up, i_low = tree.parent, tree.end_y_s, work.v, work.i_up, work.i_low
    last = parents.size
    for k in range(1, last + (1 if tree.tail >= 0 else 0)):
        half = load(end_y, k)
        upper, lower = (tree.tail, tree.fork) if k == last else (parents[k], k)
        first = times(half, load_vector(v, upper))
        second = times(half, load_vector(v, lower))
        above, below = (share, 1.0 - share) if k == edge else (1.0, 1.0)
        for i in range(3):
            i_up[k, i] += above * first[i]
            i_low[k, i] -= below * second[i]


@compiled
def update_magnitudes(tree: Tree, work: Work, unit_v_pu: Real, history: Real, first: bool) -> float:
    """Move winding and step voltages towards the solved ones; returns the largest gap, pu.

    From the second pass on the step follows the secant through this pass and the last
    (Anderson's mixing of depth one), which also ends cycles and creeping near collapse.
    ``history`` (3, U + 1, 4): the last pass's voltages and gaps, and this pass's gaps.
    """
    unit_node, g, g_j, v_all, stub = tree.unit_node, work.g, work.g_j, work.v, work.stub
    units = unit_node.size
    sourced = tree.machine_unit.size > 0
    last = 4 if sourced else 3
    change = along = across = 0.0
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
            change = max(change, abs(gap))
            along += gap * turn
            across += turn * turn
            history[2, unit, i] = gap
    back = 0.0 if first or across == 0.0 else along / across
    for unit in range(units + 1):
        for i in range(last):
            v_pu, gap = unit_v_pu[unit, i], history[2, unit, i]
            moved = v_pu - history[0, unit, i] + gap - history[1, unit, i]
            unit_v_pu[unit, i] = max(v_pu + gap - back * moved, 0.0)
            history[0, unit, i] = v_pu
            history[1, unit, i] = gap
    return change


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
    v, stub, i_up, i_low = work.v, work.stub, work.i_up, work.i_low
    unit_v_pu, history = work.unit_v_pu, work.history
    turn = np.exp(-2j * np.pi / 3)
    for s in range(state.emf_pu.size):
        linear = is_linear(tree, state, s)
        emf = complex(state.emf_pu[s] * tree.v_nominal_v, 0.0)
        store_vector(stub, 0, (0j, 0j, 0j))
        store_vector(stub, 1, (0j, 0j, 0j))
        for unit in range(unit_v_pu.shape[0]):
            for i in range(4):
                unit_v_pu[unit, i] = unit_out[unit, i, s]
                history[0, unit, i] = history[1, unit, i] = 0.0
        settled = False
        flags = 0
        passes = 0
        while not settled and passes < most_passes:
            passes += 1
            set_admittances(tree, state, work, s, unit_v_pu, floor_pu)
            flags = climb(tree, state, work, s)
            store_vector(v, last, (emf, emf * turn, emf * turn.conjugate()))
            if tree.lifted:
                flags |= lift_neutral(tree, work)
            descend(tree, state, work, s)
            change = update_magnitudes(tree, work, unit_v_pu, history, passes == 1)
            settled = linear or change <= tolerance_pu
        answer.flags[s] = flags if settled else flags | NOT_CONVERGED
        answer.passes[s] = passes
        for m in range(tree.machine_unit.size):
            unit = tree.machine_unit[m]
            windings = times(load(work.g, unit), load_vector(v, tree.unit_node[unit]))
            answer.machine_v1_v[m, s] = positive(plus(windings, load_vector(work.g_j, unit)))
        for unit in range(unit_v_pu.shape[0]):
            for i in range(4):
                unit_out[unit, i, s] = unit_v_pu[unit, i]
        for i in range(3):
            stub_out[0, i, s] = stub[0, i]
            stub_out[1, i, s] = stub[1, i]
            for n in range(v_node.size):
                v_out[n, i, s] = v[v_node[n], i]
            for n in range(i_edge.size):
                k = i_edge[n]
                i_out[n, i, s] = i_low[k, i] if i_below[n] else i_up[k, i]
