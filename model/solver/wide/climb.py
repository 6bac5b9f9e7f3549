"""Up the ladder in lanes, and apart from it the regions where something happens."""

from __future__ import annotations

from ...compiled import compiled
from ...lanes.functions import mask_of
from ...lanes.kinds import WIDTH
from ...states import Tree
from ..matrix3 import (
    ZERO,
    Matrix,
    Vector,
    add,
    load,
    minus,
    plus,
    product,
    reciprocal,
    scaled,
    times,
)
from ..series import up
from ..turns import transposed
from .event import climb_event, event_lanes, event_share, free_modes
from .rows import (
    add_entry,
    add_matrix,
    add_vector,
    chosen,
    chosen_vector,
    in_lanes,
    load_entry,
    load_matrix,
    load_triple,
    no_vector,
    store_entry,
    store_matrix,
    store_triple,
)
from .turns import turn_edge, turn_of, turned
from .work import ALL, PASSED, TWIG, Wide

__all__ = ["climb", "mark_regions"]


@compiled
def mark_regions(tree: Tree, wide: Wide) -> None:
    """Note in ``busy`` where something happens, and in which lanes."""
    busy = wide.busy
    for k in range(busy.size):
        busy[k] = 0
    for lane in range(WIDTH):
        edge, far = wide.edge[lane], wide.far[lane]
        if edge >= 0:
            q = max(tree.passed[edge], tree.leap[edge])
            busy[wide.place[q] if q >= 0 else edge] |= 1 << lane
        if far >= 0 and tree.passed[far] >= 0:
            busy[wide.place[tree.passed[far]]] |= 1 << lane


@compiled
def climb(tree: Tree, wide: Wide, full: bool, fed: bool, floor_pu: float) -> None:
    """Eliminate every node from the leaves to the source, or only carry currents up.

    ``full``: eliminate; ``fed``: there are currents that no voltage drives.
    """
    for k in range(wide.visit.size - 1, -1, -1):
        if wide.visit[k] == PASSED:
            continue
        a = tree.lone_phase[k]
        if wide.visit[k] == TWIG:
            if full:
                put_matrix(wide, k, in_lanes(load(tree.leap_chain[wide.leap[k]], 2)))
            if fed and wide.busy[k]:
                store_triple(wide.x_j, k, no_vector())
        elif a >= 0:
            if full:
                put_entry(wide, k, a, climb_lone(tree, wide, k, a))
            if fed:
                put_drawn_entry(wide, k, a, carry_lone(tree, wide, k, a))
        elif wide.loose[k]:
            climb_loose(tree, wide, k, fed)
        else:
            if full:
                put_matrix(wide, k, climb_whole(tree, wide, k))
            if fed:
                put_drawn(wide, k, carry_whole(tree, wide, k))
        if wide.busy[k]:
            climb_region(tree, wide, k, full, fed, floor_pu)
        if k and is_watched(wide, k):
            hand_up(wide, k, full, fed)


@compiled
def climb_region(tree: Tree, wide: Wide, k: int, full: bool, fed: bool, floor_pu: float) -> None:
    """Take the region at node k apart for the lanes in which something happens there."""
    q, above, own = wide.leap[k], wide.above[k], mask_of(wide.busy[k])
    store_matrix(wide.top, 0, in_lanes(ZERO))
    store_matrix(wide.top, 1, in_lanes(ZERO))
    store_triple(wide.top_j, 0, no_vector())
    first, last = (0, 1) if q < 0 else (tree.region_from[q], tree.region_from[q + 1])
    for at in range(first, last):
        n = k if q < 0 else tree.region_node[at]
        bits, parent = event_lanes(wide, n), tree.parent[n]
        drawn = no_vector()
        if fed:
            drawn = load_triple(wide.y_j, n)
        w, drawn = climb_event(tree, wide, n, bits, drawn, floor_pu)
        less = in_lanes(ZERO)
        if tree.charged:
            # the node above holds half of the whole edge's
            share = event_share(wide, bits, 1.0)
            less = scaled(load(tree.end_y_s, n), share - 1.0)
        if parent == above:
            add_matrix(wide.top, 0, w)
            add_matrix(wide.top, 1, less)
            add_vector(wide.top_j, 0, drawn)
        else:
            add_matrix(wide.y, parent, add(w, less))
            add_vector(wide.y_j, parent, drawn)
    store_matrix(wide.w, k, chosen(own, load_matrix(wide.top, 0), load_matrix(wide.w, k)))
    drawn = chosen_vector(own, load_triple(wide.top_j, 0), load_triple(wide.x_j, k))
    store_triple(wide.x_j, k, drawn)
    if full and tree.charged:
        add_matrix(wide.y, above, chosen(own, load_matrix(wide.top, 1), ZERO))


@compiled
def hand_up(wide: Wide, k: int, full: bool, fed: bool) -> None:
    """W and X of edge k, where they were kept, to the node above."""
    above = wide.above[k]
    if full:
        add_matrix(wide.y, above, load_matrix(wide.w, k))
    if fed:
        add_vector(wide.y_j, above, load_triple(wide.x_j, k))


@compiled
def is_watched(wide: Wide, k: int) -> bool:
    """Whether W and X of edge k are looked at before they go up."""
    return bool(wide.watched[k] or wide.busy[k] != 0)


@compiled
def put_matrix(wide: Wide, k: int, w: Matrix) -> None:
    """W of edge k, to where it is kept or else to the node above."""
    if is_watched(wide, k):
        store_matrix(wide.w, k, w)
    else:
        add_matrix(wide.y, wide.above[k], w)


@compiled
def put_drawn(wide: Wide, k: int, drawn: Vector) -> None:
    """X of edge k likewise."""
    if is_watched(wide, k):
        store_triple(wide.x_j, k, drawn)
    else:
        add_vector(wide.y_j, wide.above[k], drawn)


@compiled
def put_entry(wide: Wide, k: int, a: int, w: complex) -> None:
    """W of an edge with a single phase.

    Where it is kept an event of lanes before these may have left something in the other phases: a
    leap that ends in one phase may pass lines that have more.
    """
    if is_watched(wide, k):
        store_matrix(wide.w, k, in_lanes(ZERO))
        store_entry(wide.w, k, 4 * a, w)
    else:
        above = wide.above[k]
        add_entry(wide.y, above, 4 * a, w)


@compiled
def put_drawn_entry(wide: Wide, k: int, a: int, drawn: complex) -> None:
    """X of an edge with a single phase, likewise."""
    if is_watched(wide, k):
        store_triple(wide.x_j, k, no_vector())
        store_entry(wide.x_j, k, a, drawn)
    else:
        above = wide.above[k]
        add_entry(wide.y_j, above, a, drawn)


@compiled
def climb_lone(tree: Tree, wide: Wide, k: int, a: int) -> complex:
    """Past an edge, or a leap, that has a single phase; returns W."""
    y, q = load_entry(wide.y, k, 4 * a), wide.leap[k]
    if q < 0:
        f = reciprocal(1.0 + tree.z_ohm[k, a, a] * y)
        w = y * f
    else:
        chain = tree.leap_chain[q]
        f = reciprocal(1.0 + chain[1, a, a] * y) * chain[0, a, a]
        w = chain[0, a, a] * (y * f) + chain[2, a, a]
    store_entry(wide.f, k, 4 * a, f)
    return w


@compiled
def carry_lone(tree: Tree, wide: Wide, k: int, a: int) -> complex:
    """What is seen above such an edge of a current drawn below it."""
    drawn, q = load_entry(wide.y_j, k, a), wide.leap[k]
    if q >= 0:
        z = tree.leap_chain[q, 1, a, a]
        own = reciprocal(1.0 + z * load_entry(wide.y, k, 4 * a))
        store_entry(wide.h_j, k, a, -(own * (z * drawn)))
    return load_entry(wide.f, k, 4 * a) * drawn


@compiled
def climb_whole(tree: Tree, wide: Wide, k: int) -> Matrix:
    """Past an edge, or a leap, of several phases, and what stands at its upper end; returns W."""
    y, q = load_matrix(wide.y, k), wide.leap[k]
    f, w = up(y, series_of(tree, wide, k))
    if wide.notes[k]:
        store_matrix(wide.z_f, k, f)
    if q >= 0:
        chain = tree.leap_chain[q]
        f = product(f, load(chain, 0))
        w = add(product(transposed(load(chain, 0)), product(y, f)), load(chain, 2))
    elif turned(tree, k):
        t = turn_of(tree, wide, k)
        f, w = product(f, t), product(transposed(t), product(w, t))
    store_matrix(wide.f, k, f)
    return w


@compiled
def series_of(tree: Tree, wide: Wide, k: int) -> Matrix:
    """The impedance of an edge or a leap."""
    q = wide.leap[k]
    return load(tree.z_ohm, k) if q < 0 else load(tree.leap_chain[q], 1)


@compiled
def carry_whole(tree: Tree, wide: Wide, k: int) -> Vector:
    """What is seen above such an edge of a current drawn below it.

    It is F' of it where all is reciprocal, as what is passive is.
    """
    drawn = load_triple(wide.y_j, k)
    if wide.notes[k]:
        f, z = load_matrix(wide.z_f, k), series_of(tree, wide, k)
        ahead = minus(times(f, times(z, drawn)))
        store_triple(wide.h_j, k, ahead)
        if not wide.reciprocal[0]:
            return seen_through(tree, wide, k, plus(drawn, times(load_matrix(wide.y, k), ahead)))
    return times(transposed(load_matrix(wide.f, k)), drawn)


@compiled
def seen_through(tree: Tree, wide: Wide, k: int, drawn: Vector) -> Vector:
    """A current into the impedance of an edge or a leap, as seen above what stands there."""
    q = wide.leap[k]
    if q >= 0:
        return times(transposed(load(tree.leap_chain[q], 0)), drawn)
    if turned(tree, k):
        return times(transposed(turn_of(tree, wide, k)), drawn)
    return drawn


@compiled
def climb_loose(tree: Tree, wide: Wide, k: int, fed: bool) -> None:
    """Past an edge that leaves modes loose at its lower end."""
    if not fed:
        store_triple(wide.y_j, k, no_vector())
    below = load_matrix(wide.y, k), load_triple(wide.y_j, k)
    w, p, x, h = free_modes(tree, wide, k, below, ALL)
    z = load(tree.z_ohm, k)
    f, seen = up(w, z)
    more = minus(times(f, times(z, x)))
    x, h = plus(x, times(w, more)), plus(h, times(p, more))
    f = product(p, f)
    if turned(tree, k):
        f, seen, x = turn_edge(tree, wide, k, (f, seen, x))
    store_matrix(wide.f, k, f)
    store_matrix(wide.w, k, seen)
    store_triple(wide.h_j, k, h)
    store_triple(wide.x_j, k, x)
