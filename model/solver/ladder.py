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

Loops that share edges carry one X and X' each and a U for every pair.

Machines feed in currents that no voltage drives: they add a last column to X and U, hence to
H, which stands in vectors of its own (``..._j`` in the workspace).

A regulator or transformer at an edge's upper end turns the voltages there, what lies below it
being seen as  T' W T; modes that it leaves loose at the lower end, and open phases between the
two sides of the event node, are the projections of ``breaks``.

Compiled functions take one scenario of a block and write into its workspace; ``solve`` is
the door for everybody else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, compiled_apart, compiled_door
from ..states import NOT_CONVERGED, Answer, Probes, State, Tree, Work
from .assemble import set_admittances
from .breaks import FLOATING, NOTHING_S, SINGULAR, squared
from .event_node import BELOW, climb_event, climb_loose, descend_event
from .loops import carry_fill, climb_chord, descend_chord_event, hand_up
from .matrix3 import (
    Matrix,
    Vector,
    add,
    column_sums,
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
from .series import carry_current, per_fork, up
from .settle import is_linear, positive, see_magnitudes, update_magnitudes
from .turns import turn_edge

__all__ = ["is_sourced", "solve_block"]

Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]


@compiled
def climb(tree: Tree, state: State, work: Work, s: int) -> int:
    """Eliminate every node from the leaves to the source; returns flags.

    ``work.y`` holds each node's own admittance and becomes the admittance below it.
    """
    fed = is_sourced(tree)
    flags = 0
    for k in range(tree.parent.size - 1, -1, -1):
        flags |= climb_edge(tree, state, work, k, s, fed)
    return flags


@compiled
def climb_edge(tree: Tree, state: State, work: Work, k: int, s: int, fed: bool) -> int:
    """Eliminate node k and the edge above it, whatever they are; returns flags.

    ``fed``: currents are fed in that no voltage drives.
    """
    in_loop, y_all, y_j, x_j = tree.in_loop[k], work.y, work.y_j, work.x_j
    turned = tree.regulator[k] >= 0 or tree.transformer[k] >= 0
    flags = 0
    for c in range(tree.tail.size):
        if tree.tail[c] == k:
            flags |= climb_chord(tree, state, work, c, s)
        if turned and in_loop:
            store(work.x_low[k], c, load(work.x[k], c))
    z, drawn, carried = load(tree.z_ohm, k), load_vector(y_j, k), tree.carried[k]
    if k == state.edge[s]:
        share, mask = state.share[s], state.open_mask[s]
        flags |= climb_event(tree, work, k, z, share, mask, carried, drawn)
    elif tree.loose_from[k + 1] > tree.loose_from[k]:
        flags |= climb_loose(tree, work, k, z, carried, drawn)
    else:
        y = load(y_all, k)
        f, w = up(y, z)
        store(work.f, k, f)
        store(work.w, k, w)
        if fed:
            ahead, drawn = carry_current(y, z, f, drawn, work, carried)
            store_vector(work.h_j, k, ahead)
            store_vector(x_j, k, drawn)
        if in_loop:
            carry_fill(work, k, y, z, f, carried)
    if turned:
        turn_edge(tree, state, work, k, s, carried)
    parent = tree.parent[k]
    if parent >= 0:
        store(y_all, parent, add(load(y_all, parent), load(work.w, k)))
        if fed:
            store_vector(y_j, parent, plus(load_vector(y_j, parent), load_vector(x_j, k)))
        if in_loop:
            hand_up(tree, work, k, parent)
    return flags


@compiled
def is_sourced(tree: Tree) -> bool:
    """Whether anything feeds in currents."""
    return bool(tree.machine_unit.size > 0)


@compiled_apart
def neutral_shift(
    w: Matrix, emf: Vector, current: Vector, neutral_y_s: complex
) -> tuple[int, Vector]:
    """Flags, and the EMF shifted by the neutral's voltage.

    The source's currents sum to what leaves the neutral. An impedance there, in the source's
    zero sequence, would be thousands of times all others and cost as much in digits.
    """
    sums, drawn = column_sums(w), plus(times(w, emf), current)
    total = sums[0] + sums[1] + sums[2] + neutral_y_s
    largest = 0.0
    for one in w:
        largest = max(largest, squared(one))
    if squared(total) <= max(SINGULAR**2 * largest, NOTHING_S**2):
        return FLOATING, emf
    shift = -(drawn[0] + drawn[1] + drawn[2]) * reciprocal(total)
    return 0, plus(emf, (shift, shift, shift))


@compiled
def descend(tree: Tree, state: State, work: Work, s: int, fed: bool) -> None:
    """Voltages from the source to the leaves, and the stubs of the event node.

    ``fed``: currents are fed in that no voltage drives.
    """
    last, edge = tree.parent.size, state.edge[s]
    for k in range(last):
        descend_edge(tree, state, work, k, s, fed)
    if edge >= last:
        descend_chord_event(tree, work, edge - last, state.share[s], state.open_mask[s])
        keep_stubs(tree, work, edge)


@compiled
def descend_edge(tree: Tree, state: State, work: Work, k: int, s: int, fed: bool) -> None:
    """The voltage of node k, from that above it."""
    v_all, fork, carried = work.v, tree.fork, tree.carried[k]
    above = load_vector(v_all, tree.parent[k] if k else tree.parent.size)
    if k == state.edge[s]:
        v = descend_event(tree, work, 0, above, state.open_mask[s], carried)
        v = plus(times(load(work.event, BELOW), v), load_vector(work.event_j, BELOW))
        v = per_fork(work.event_h[BELOW], carried, fork, v_all, v)
        keep_stubs(tree, work, k)
    else:
        v = times(load(work.f, k), above)
        if tree.in_loop[k]:
            v = per_fork(work.h[k], carried, fork, v_all, v)
        if fed:
            v = plus(v, load_vector(work.h_j, k))
    store_vector(v_all, k, v)
    if tree.node_phases[k] != 7:
        keep_phases(v_all, k, tree.node_phases[k])


@compiled
def keep_stubs(tree: Tree, work: Work, edge: int) -> None:
    """Zero at the event node for phases that its edge does not have."""
    phases = tree.phases[edge]
    if phases != 7:
        keep_phases(work.stub, 0, phases)
        keep_phases(work.stub, 1, phases)


@compiled
def keep_phases(v: Complex, k: int, phases: int) -> None:
    """Zero in row k for phases that are not there."""
    for i in range(3):
        if not phases & (1 << i):
            v[k, i] = 0.0


@compiled
def edge_current(
    tree: Tree, state: State, work: Work, s: int, where: tuple[int, bool, bool]
) -> Vector:
    """Current from above into an edge, or below: out of its lower end.

    ``where`` is the edge, whether below, and whether currents are fed in.
    """
    k, below, fed = where
    parents, v_all, edge, share = tree.parent, work.v, state.edge[s], state.share[s]
    last = parents.size
    if k >= last:
        c = k - last
        upper, lower = tree.tail[c], tree.fork[c]
        v, v_fork = load_vector(v_all, upper), load_vector(v_all, lower)
        side = 2 if below else 0
        current = plus(
            times(load(work.chord[side], c), v), times(load(work.chord[side + 1], c), v_fork)
        )
        if below:
            current = minus(current)
    else:
        upper, lower = parents[k] if k else last, k
        carried = tree.carried[k]
        if below and (tree.regulator[k] >= 0 or tree.transformer[k] >= 0):
            current = times(load(work.y, k), load_vector(v_all, k))
            if fed:
                current = plus(current, load_vector(work.y_j, k))
            current = per_fork(work.x_low[k], carried, tree.fork, v_all, current)
        else:
            current = times(load(work.w, k), load_vector(v_all, upper))
            if fed:
                current = plus(current, load_vector(work.x_j, k))
            current = per_fork(work.x[k], carried, tree.fork, v_all, current)
            if k == edge and below:
                for n in range(2):
                    lost = times(load(work.event_y, n), load_vector(work.stub, n))
                    current = plus(current, minus(lost))
    if tree.charged and k:
        part = 1.0
        if k == edge:
            part = 1.0 - share if below else share
        charging = times(
            scaled(load(tree.end_y_s, k), part), load_vector(v_all, lower if below else upper)
        )
        current = plus(current, minus(charging) if below else charging)
    return current


@compiled_door
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

    ``answer.winding_v_pu`` is the start of the fixed point and its end. Loads are constant
    impedance below ``floor_pu``. What does not settle within ``most_passes`` is flagged.
    """
    last = tree.parent.size
    v_node, i_edge, i_below = probes.v_node, probes.i_edge, probes.i_below
    v_out, i_out, stub_out, winding_out = answer.v, answer.i, answer.stub, answer.winding_v_pu
    v, stub, winding_v_pu, history = work.v, work.stub, work.winding_v_pu, work.history
    turn, fed = np.exp(-2j * np.pi / 3), is_sourced(tree)
    for s in range(state.emf_pu.size):
        linear = is_linear(tree, state, s)
        emf = state.emf_pu[s] * tree.v_nominal_v * tree.emf_turn
        store_vector(stub, 0, (0j, 0j, 0j))
        store_vector(stub, 1, (0j, 0j, 0j))
        for n in range(winding_v_pu.size):
            winding_v_pu[n] = winding_out[n, s]
            history[0, n] = history[1, n] = 0.0
        settled = linear
        flags = 0
        passes = 0
        while passes == 0 or (not settled and passes < most_passes):
            passes += 1
            set_admittances(tree, state, work, s, floor_pu)
            flags = climb(tree, state, work, s)
            store_vector(v, last, (emf, emf * turn, emf * turn.conjugate()))
            if tree.lifted:
                w, drawn = load(work.w, 0), load_vector(work.x_j, 0)
                more, lifted = neutral_shift(w, load_vector(v, last), drawn, tree.neutral_y_s)
                store_vector(v, last, lifted)
                flags |= more
            descend(tree, state, work, s, fed)
            if linear:
                break
            settled = update_magnitudes(tree, state, work, s, passes) <= tolerance_pu
        if linear:
            see_magnitudes(tree, state, work, s)
        answer.flags[s] = flags if settled else flags | NOT_CONVERGED
        answer.passes[s] = passes
        for m in range(tree.machine_unit.size):
            unit = tree.machine_unit[m]
            windings = times(load(work.g, unit), load_vector(v, tree.unit_node[unit]))
            answer.machine_v1_v[m, s] = positive(plus(windings, load_vector(work.g_j, unit)))
        for n in range(winding_v_pu.size):
            winding_out[n, s] = winding_v_pu[n]
        for n in range(i_edge.size):
            current = edge_current(tree, state, work, s, (i_edge[n], i_below[n], fed))
            for i in range(3):
                i_out[n, i, s] = current[i]
        for i in range(3):
            stub_out[0, i, s] = stub[0, i]
            stub_out[1, i, s] = stub[1, i]
            for n in range(v_node.size):
                v_out[n, i, s] = v[v_node[n], i]
