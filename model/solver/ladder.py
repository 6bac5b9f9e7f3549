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
from .event_node import ABOVE, AT, BELOW, climb_event, climb_loose, cross, descend_event
from .matrix3 import (
    ZERO,
    Matrix,
    Vector,
    add,
    column_sums,
    load,
    load_vector,
    minus,
    plus,
    product,
    reciprocal,
    scaled,
    store,
    store_vector,
    times,
)
from .series import carry, carry_current, per_fork, up
from .settle import is_linear, positive, see_magnitudes, update_magnitudes
from .turns import transposed, turn_edge, turn_of

__all__ = ["solve_block"]

Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]


@compiled
def climb(tree: Tree, state: State, work: Work, s: int) -> int:
    """Eliminate every node from the leaves to the source; returns flags.

    ``work.y`` holds each node's own admittance and becomes the admittance below it.
    """
    parents, in_loop, lone, z_all = tree.parent, tree.in_loop, tree.lone_phase, tree.z_ohm
    y_all, y_j, f_all, w_all, x_j = work.y, work.y_j, work.f, work.w, work.x_j
    passed, leaps = tree.passed, tree.leap
    edge, share, mask = state.edge[s], state.share[s], state.open_mask[s]
    last, chords = parents.size, tree.tail.size
    sourced = tree.machine_unit.size > 0
    flags = 0
    needed, needed_too = leaps_to_take_apart(tree, edge, state.far_node[s])
    for q in range(tree.twigs):
        if q != needed and q != needed_too:
            k = tree.leap_from[q]
            store(y_all, k, add(load(y_all, k), load(tree.leap_up_s, q)))
    for k in range(last - 1, -1, -1):
        leap = passed[k]
        if leap >= 0 and leap != needed and leap != needed_too:
            continue
        leap = leaps[k]
        if leap >= 0 and leap != needed and leap != needed_too:
            climb_leap(tree, work, k, leap, sourced)
            continue
        a, parent = lone[k], parents[k]
        if a >= 0 and k != edge:
            y1 = y_all[k, a, a]
            f1 = reciprocal(1.0 + z_all[k, a, a] * y1)
            f_all[k, a, a] = f1
            y1 *= f1
            w_all[k, a, a] = y1
            y_all[parent, a, a] += y1
            continue
        for c in range(chords):
            if tree.tail[c] == k:
                flags |= climb_chord(tree, state, work, c, s)
        y, z, drawn, carried = load(y_all, k), load(z_all, k), load_vector(y_j, k), tree.carried[k]
        turned = tree.regulator[k] >= 0 or tree.transformer[k] >= 0
        if turned and in_loop[k]:
            for c in range(chords):
                store(work.x_low[k], c, load(work.x[k], c))
        if k == edge:
            flags |= climb_event(tree, work, k, z, share, mask, carried, drawn)
        elif tree.loose_from[k + 1] > tree.loose_from[k]:
            flags |= climb_loose(tree, work, k, z, carried, drawn)
        else:
            f, w = up(y, z)
            store(f_all, k, f)
            store(w_all, k, w)
            if sourced:
                ahead, drawn = carry_current(y, z, f, drawn, work, carried)
                store_vector(work.h_j, k, ahead)
                store_vector(x_j, k, drawn)
            if in_loop[k]:
                carry_fill(work, k, y, z, f, carried)
        if turned:
            turn_edge(tree, state, work, k, s, carried)
        if parent >= 0:
            store(y_all, parent, add(load(y_all, parent), load(w_all, k)))
            if sourced:
                store_vector(y_j, parent, plus(load_vector(y_j, parent), load_vector(x_j, k)))
            if in_loop[k]:
                hand_up(tree, work, k, parent)
    return flags


@compiled
def leaps_to_take_apart(tree: Tree, edge: int, far_node: int) -> tuple[int, int]:
    """The leaps on whose edges or nodes something happens; -2: none."""
    first = second = -2
    if 0 <= edge < tree.passed.size:
        first = max(tree.passed[edge], tree.leap[edge])
    if far_node >= 0:
        second = tree.passed[far_node]
    return first if first >= 0 else -2, second if second >= 0 else -2


@compiled
def climb_leap(tree: Tree, work: Work, k: int, leap: int, sourced: bool) -> None:
    """Eliminate all the edges of a leap at once, at whose end node k is."""
    a, above = tree.lone_phase[k], tree.leap_from[leap]
    y_all, up_s, low_s = work.y, tree.leap_up_s, tree.leap_low_s
    if a >= 0:
        y1 = y_all[k, a, a] + low_s[leap, a, a]
        f1 = reciprocal(1.0 + tree.leap_z_ohm[leap, a, a] * y1)
        work.f[k, a, a] = f1
        y_all[above, a, a] += y1 * f1 + up_s[leap, a, a]
        return
    y, z = add(load(y_all, k), load(low_s, leap)), load(tree.leap_z_ohm, leap)
    f, w = up(y, z)
    store(work.f, k, f)
    store(y_all, above, add(load(y_all, above), add(w, load(up_s, leap))))
    if sourced:
        none = tree.carried[k]
        ahead, drawn = carry_current(y, z, f, load_vector(work.y_j, k), work, none)
        store_vector(work.h_j, k, ahead)
        store_vector(work.y_j, above, plus(load_vector(work.y_j, above), drawn))


@compiled_apart
def carry_fill(work: Work, k: int, y: Matrix, z: Matrix, f: Matrix, carried: Flags) -> None:
    """The loops' part of eliminating a plain edge."""
    h, x = work.h[k], work.x[k]
    for c in range(carried.size):
        if carried[c]:
            store(h, c, load(x, c))
    carry(y, z, f, h, work, carried)
    for c in range(carried.size):
        if carried[c]:
            store(x, c, add(load(x, c), product(y, load(h, c))))


@compiled_apart
def hand_up(tree: Tree, work: Work, k: int, parent: int) -> None:
    """Hand the loops' fill to the node above edge k, or add it there where that is a fork."""
    carried, fork, xt, u, y = tree.carried[k], tree.fork, work.xt, work.u, work.y
    x, x_above, u_j = work.x[k], work.x[parent], work.u_j
    chords = carried.size
    for d in range(chords):
        if carried[d] and fork[d] != parent:
            store(x_above, d, load(x, d))
    for c in range(chords):
        if not carried[c] or fork[c] != parent:
            continue
        store(y, parent, add(load(y, parent), add(load(x, c), load(xt, c))))
        store_vector(work.y_j, parent, plus(load_vector(work.y_j, parent), load_vector(u_j, c)))
        for d in range(chords):
            if not carried[d]:
                continue
            if fork[d] == parent:
                store(y, parent, add(load(y, parent), load(u[c], d)))
            else:
                store(x_above, d, add(load(x_above, d), load(u[c], d)))
                store(xt, d, add(load(xt, d), load(u[d], c)))


@compiled_apart
def climb_chord(tree: Tree, state: State, work: Work, c: int, s: int) -> int:
    """Add chord c to its tail's Y and start the fill; returns flags.

    An event on it is climbed over from the farther end, so that what is inverted is never
    the small part of the impedance.
    """
    last = tree.parent.size
    happening, share, mask = state.edge[s] == last + c, state.share[s], state.open_mask[s]
    w = load(tree.chord_y_s, c)
    flags = 0
    for d in range(tree.tail.size):
        store(work.u[c], d, ZERO)
        store(work.u[d], c, ZERO)
    store_vector(work.u_j, c, (0j, 0j, 0j))
    if not happening:
        x = xt = scaled(w, -1.0)
        u = w
        if tree.regulator[last + c] >= 0 or tree.transformer[last + c] >= 0:
            t = turn_of(tree, state, work, last + c, s)
            back = transposed(t)
            w, x, xt = product(back, product(u, t)), product(back, x), product(xt, t)
        keep_chord(tree, work, c, w, x, xt, u)
        return flags
    z = load(tree.z_ohm, last + c)
    far = 1.0 - share if share <= 0.5 else share
    w = scaled(w, 1.0 / far)
    away = scaled(w, -1.0)
    store(work.here, 0, w)
    store(work.here_x, c, away)
    store(work.xt, c, away)
    store(work.u[c], c, w)
    store_vector(work.here_j, 0, (0j, 0j, 0j))
    flags = cross(work, scaled(z, 1.0 - far), mask, 1 if share <= 0.5 else 0, tree.alone[c])
    # seen from the tail: I = W V + X V_fork, and from the fork: I' = X' V + U V_fork
    w, x, xt, u = load(work.here, 0), load(work.here_x, c), load(work.xt, c), load(work.u[c], c)
    if share > 0.5:
        w, x, xt, u = u, xt, x, w
    keep_chord(tree, work, c, w, x, xt, u)
    return flags


@compiled_apart
def keep_chord(tree: Tree, work: Work, c: int, w: Matrix, x: Matrix, xt: Matrix, u: Matrix) -> None:
    """Begin the fill of loop c at its tail."""
    tail = tree.tail[c]
    store(work.chord[0], c, w)
    store(work.chord[1], c, x)
    store(work.chord[2], c, xt)
    store(work.chord[3], c, u)
    store(work.x[tail], c, x)
    store(work.xt, c, xt)
    store(work.u[c], c, u)
    store(work.y, tail, add(load(work.y, tail), w))


@compiled_apart
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
    """Voltages from the source to the leaves, and the stubs of the event node."""
    parents, in_loop, lone, phases = tree.parent, tree.in_loop, tree.lone_phase, tree.phases
    v_all, f_all, fork = work.v, work.f, tree.fork
    passed, leaps = tree.passed, tree.leap
    edge, share, mask = state.edge[s], state.share[s], state.open_mask[s]
    last = parents.size
    sourced = tree.machine_unit.size > 0
    needed, needed_too = leaps_to_take_apart(tree, edge, state.far_node[s])
    for k in range(last):
        leap = passed[k]
        if leap >= 0 and leap != needed and leap != needed_too:
            continue
        leap, parent = leaps[k], parents[k]
        if leap >= 0 and leap != needed and leap != needed_too:
            parent = tree.leap_from[leap]
        a = lone[k]
        if a >= 0 and k != edge:
            v_all[k, a] = f_all[k, a, a] * v_all[parent, a]
            continue
        above = load_vector(v_all, parent if k else last)
        carried = tree.carried[k]
        if k == edge:
            v = descend_event(tree, work, 0, above, mask, carried)
            v = plus(times(load(work.event, BELOW), v), load_vector(work.event_j, BELOW))
            v = per_fork(work.event_h[BELOW], carried, fork, v_all, v)
        else:
            v = times(load(f_all, k), above)
            if in_loop[k]:
                v = per_fork(work.h[k], carried, fork, v_all, v)
            if sourced:
                v = plus(v, load_vector(work.h_j, k))
        store_vector(v_all, k, v)
        if tree.node_phases[k] != 7:
            keep_phases(v_all, k, tree.node_phases[k])
    if edge >= last:
        descend_chord_event(tree, work, edge - last, share, mask)
    if edge >= 0 and phases[edge] != 7:
        keep_phases(work.stub, 0, phases[edge])
        keep_phases(work.stub, 1, phases[edge])


@compiled
def keep_phases(v: Complex, k: int, phases: int) -> None:
    """Zero in row k for phases that are not there."""
    for i in range(3):
        if not phases & (1 << i):
            v[k, i] = 0.0


@compiled_apart
def descend_chord_event(tree: Tree, work: Work, c: int, share: float, mask: int) -> None:
    """The stubs of an event on a chord, which was climbed from its nearer end's other side."""
    tail, fork = tree.tail[c], tree.fork[c]
    near, far, side = (tail, fork, 0) if share <= 0.5 else (fork, tail, 1)
    v_far = load_vector(work.v, far)
    v = plus(
        times(load(work.event, ABOVE), load_vector(work.v, near)), load_vector(work.event_j, ABOVE)
    )
    v = plus(v, times(load(work.event_h[ABOVE], c), v_far))
    store_vector(work.stub, side, v)
    if mask:
        v = plus(times(load(work.event, AT), v), load_vector(work.event_j, AT))
        v = plus(v, times(load(work.event_h[AT], c), v_far))
    store_vector(work.stub, 1 - side, v)


@compiled
def edge_current(tree: Tree, state: State, work: Work, s: int, k: int, below: bool) -> Vector:
    """Current from above into edge k, or ``below``: out of its lower end."""
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
            current = plus(times(load(work.y, k), load_vector(v_all, k)), load_vector(work.y_j, k))
            current = per_fork(work.x_low[k], carried, tree.fork, v_all, current)
        else:
            current = times(load(work.w, k), load_vector(v_all, upper))
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
    turn = np.exp(-2j * np.pi / 3)
    for s in range(state.emf_pu.size):
        linear = is_linear(tree, state, s)
        emf = state.emf_pu[s] * tree.v_nominal_v * tree.emf_turn
        store_vector(stub, 0, (0j, 0j, 0j))
        store_vector(stub, 1, (0j, 0j, 0j))
        for n in range(winding_v_pu.size):
            winding_v_pu[n] = winding_out[n, s]
            history[0, n] = history[1, n] = 0.0
        settled = False
        flags = 0
        passes = 0
        while not settled and passes < most_passes:
            passes += 1
            set_admittances(tree, state, work, s, floor_pu)
            flags = climb(tree, state, work, s)
            store_vector(v, last, (emf, emf * turn, emf * turn.conjugate()))
            if tree.lifted:
                flags |= lift_neutral(tree, work)
            descend(tree, state, work, s)
            settled = linear or update_magnitudes(tree, state, work, s, passes) <= tolerance_pu
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
            current = edge_current(tree, state, work, s, i_edge[n], i_below[n])
            for i in range(3):
                i_out[n, i, s] = current[i]
        for i in range(3):
            stub_out[0, i, s] = stub[0, i]
            stub_out[1, i, s] = stub[1, i]
            for n in range(v_node.size):
                v_out[n, i, s] = v[v_node[n], i]
