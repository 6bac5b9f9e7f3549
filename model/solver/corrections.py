"""Passes that eliminate nothing anew: what loads take otherwise than assumed, as currents.

Where admittances have changed little since the last elimination, what they draw more than then is
a current at their node. It goes up and down the ladder with the matrices that stand there, at a
third of the cost. The voltages that both kinds of passes settle at are the same.
"""

from __future__ import annotations

from ..compiled import compiled
from ..states import State, Tree, Work
from .assemble import load_admittance
from .breaks import squared
from .event_node import climb_event, climb_loose
from .matrix3 import Vector, load, load_vector, minus, plus, reciprocal, store_vector, times
from .series import up
from .turns import transposed, turn_edge, turn_of

__all__ = [
    "can_correct",
    "climb_corrections",
    "leap_current",
    "leaps_to_take_apart",
    "set_corrections",
]

NEAR = 0.2  #: an admittance farther from the eliminated one than this share needs a new elimination


@compiled
def can_correct(tree: Tree, state: State, s: int) -> bool:
    """Whether loads that are branches alone follow the voltage, on a network without loops."""
    steady = state.edge[s] < 0 or state.step_exponent[s] == 2.0
    return bool(steady and tree.tail.size == 0 and tree.unit_node.size == 0)


@compiled
def set_corrections(tree: Tree, state: State, work: Work, s: int, floor_pu: float) -> bool:
    """Currents that the branches draw beyond their eliminated admittances; False: too much."""
    node, first, other, of_load = (
        tree.branch_node,
        tree.branch_from,
        tree.branch_to,
        tree.branch_load,
    )
    y_j, v, v_pu, eliminated = work.y_j, work.v, work.winding_v_pu, work.branch_y
    for k in range(y_j.shape[0]):
        store_vector(y_j, k, (0j, 0j, 0j))
    at = 4 * (tree.unit_node.size + 1)
    for p in range(node.size):
        k, i, j = node[p], first[p], other[p]
        own = load_admittance(tree, state, of_load[p], s, v_pu[at + p], floor_pu)
        more = own - eliminated[p]
        if squared(more) > NEAR**2 * squared(eliminated[p]):
            return False
        if j >= 0:
            current = more * (v[k, i] - v[k, j])
            y_j[k, j] -= current
        else:
            current = more * v[k, i]
        y_j[k, i] += current
    return True


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
def leap_current(tree: Tree, work: Work, k: int, leap: int) -> Vector:
    """What is drawn above the leap that ends at node k, by no voltage; H past it."""
    chain, y, drawn = tree.leap_chain[leap], load(work.y, k), load_vector(work.y_j, k)
    z = load(chain, 1)
    p, _ = up(y, z)
    ahead = minus(times(p, times(z, drawn)))
    store_vector(work.h_j, k, ahead)
    return times(transposed(load(chain, 0)), plus(drawn, times(y, ahead)))


@compiled
def carry_correction(tree: Tree, state: State, work: Work, k: int, s: int) -> None:
    """Past an edge on which nothing happens."""
    y, z, drawn = load(work.y, k), load(tree.z_ohm, k), load_vector(work.y_j, k)
    turned = tree.regulator[k] >= 0 or tree.transformer[k] >= 0
    if tree.loose_from[k + 1] > tree.loose_from[k]:
        climb_loose(tree, work, k, z, tree.carried[k], drawn)
        if turned:
            turn_edge(tree, state, work, k, s, tree.carried[k])
        return
    f = load(work.f, k)
    if turned:
        f, _ = up(y, z)
    ahead = minus(times(f, times(z, drawn)))
    drawn = plus(drawn, times(y, ahead))
    if turned:
        drawn = times(transposed(turn_of(tree, state, work, k, s)), drawn)
    store_vector(work.h_j, k, ahead)
    store_vector(work.x_j, k, drawn)


@compiled
def climb_corrections(tree: Tree, state: State, work: Work, s: int) -> None:
    """Carry the corrections up."""
    needed, needed_too = leaps_to_take_apart(tree, state.edge[s], state.far_node[s])
    y_all, y_j, x_j, h_j, f_all = work.y, work.y_j, work.x_j, work.h_j, work.f
    lone, z_all, parents, edge = tree.lone_phase, tree.z_ohm, tree.parent, state.edge[s]
    for k in range(parents.size - 1, -1, -1):
        leap = tree.passed[k]
        if leap >= 0 and leap != needed and leap != needed_too:
            continue
        a, leap, parent = lone[k], tree.leap[k], parents[k]
        leaping = leap >= 0 and leap != needed and leap != needed_too
        if leaping:
            parent = tree.leap_from[leap]
        if a >= 0 and k != edge:
            drawn1 = y_j[k, a]
            if leaping:
                z1 = tree.leap_chain[leap, 1, a, a]
                p1 = reciprocal(1.0 + z1 * y_all[k, a, a])
                h_j[k, a] = -p1 * z1 * drawn1
                drawn1 *= p1 * tree.leap_chain[leap, 0, a, a]
            else:
                h_j[k, a] = -f_all[k, a, a] * z_all[k, a, a] * drawn1
                drawn1 *= f_all[k, a, a]
            x_j[k, a] = drawn1
            y_j[parent, a] += drawn1
            continue
        drawn = load_vector(y_j, k)
        if leaping:
            store_vector(x_j, k, leap_current(tree, work, k, leap))
        elif k == edge:
            share, mask = state.share[s], state.open_mask[s]
            climb_event(tree, work, k, load(z_all, k), share, mask, tree.carried[k], drawn)
        else:
            carry_correction(tree, state, work, k, s)
        if parent >= 0:
            store_vector(y_j, parent, plus(load_vector(y_j, parent), load_vector(x_j, k)))
