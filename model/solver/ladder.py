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

from ..compiled import compiled
from ..states import NOT_CONVERGED, Answer, Probes, State, Tree, Work
from .assemble import set_admittances
from .breaks import FLOATING, NOTHING_S, SINGULAR, squared
from .event_node import climb_event, cross, descend_event
from .matrix3 import (
    ZERO,
    add,
    column_sums,
    inverse,
    load,
    load_vector,
    minus,
    plus,
    reciprocal,
    scaled,
    store,
    store_vector,
    times,
)
from .series import both, carry, carry_current, up
from .settle import is_linear, positive, update_magnitudes

__all__ = ["solve_block"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


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
    if squared(total) <= max(SINGULAR**2 * largest, NOTHING_S**2):
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
            change = update_magnitudes(tree, work, unit_v_pu, history, passes)
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
