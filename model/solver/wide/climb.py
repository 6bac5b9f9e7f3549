"""Up the ladder in lanes; a region where something happens is climbed lane by lane."""

from __future__ import annotations

from ...compiled import compiled
from ...lanes import WIDTH, bits_of, joined, larger, load_real, select, splat
from ...states import UNEARTHED, State, Tree, Work
from ..breaks import NOTHING_S, SINGULAR, squared
from ..ladder import climb_edge
from ..matrix3 import (
    IDENTITY,
    ZERO,
    Matrix,
    Vector,
    add,
    load,
    minus,
    outer,
    plus,
    product,
    reciprocal,
    store,
    store_vector,
    times,
)
from ..series import up
from ..turns import transposed
from .rows import (
    add_matrix,
    add_vector,
    load_entry,
    load_matrix,
    load_triple,
    put_lane,
    put_lane_vector,
    store_entry,
    store_matrix,
    store_triple,
    take_lane,
    take_lane_vector,
)
from .work import PASSED, TWIG, Wide, lane_of

__all__ = ["climb", "mark_regions", "turn_of"]


@compiled
def mark_regions(tree: Tree, state: State, wide: Wide) -> None:
    """Note in ``busy`` where something happens, and in which lanes."""
    busy = wide.busy
    for k in range(busy.size):
        busy[k] = 0
    for lane in range(WIDTH):
        s = wide.scenario[lane]
        edge, far = state.edge[s], state.far_node[s]
        if edge >= 0:
            q = max(tree.passed[edge], tree.leap[edge])
            busy[wide.place[q] if q >= 0 else edge] |= 1 << lane
        if far >= 0 and tree.passed[far] >= 0:
            busy[wide.place[tree.passed[far]]] |= 1 << lane


@compiled
def climb(tree: Tree, state: State, wide: Wide, lanes: Work, how: tuple[int, bool, bool]) -> None:
    """Eliminate every node from the leaves to the source, or only carry currents up.

    ``how``: the lanes eliminated anew, whether there are any, and whether there are currents
    that no voltage drives.
    """
    demand, full, fed = how
    for k in range(wide.visit.size - 1, -1, -1):
        if wide.visit[k] == PASSED:
            continue
        a, above = tree.lone_phase[k], wide.above[k]
        if wide.visit[k] == TWIG:
            if full:
                put_matrix(wide, k, in_lanes(load(tree.leap_chain[wide.leap[k]], 2)))
            if fed and wide.busy[k]:
                store_triple(wide.x_j, k, times(in_lanes(ZERO), (0j, 0j, 0j)))
        elif a >= 0:
            if full:
                put_entry(wide, k, a, climb_lone(tree, wide, k, a))
            if fed:
                put_drawn_entry(wide, k, a, carry_lone(tree, wide, k, a))
        elif wide.loose[k]:
            climb_loose(tree, wide, k, demand, fed)
        else:
            if full:
                put_matrix(wide, k, climb_whole(tree, wide, k))
            if fed:
                put_drawn(wide, k, carry_whole(tree, wide, k))
        if is_kept(wide, k):
            climb_regions(tree, state, wide, lanes, k, (demand, fed))
            if k and full:
                add_matrix(wide.y, above, load_matrix(wide.w, k))
            if k and fed:
                add_vector(wide.y_j, above, load_triple(wide.x_j, k))


@compiled
def is_kept(wide: Wide, k: int) -> bool:
    """Whether W and X of edge k are looked at before they go up."""
    return wide.kept[k] or wide.busy[k] != 0


@compiled
def put_matrix(wide: Wide, k: int, w: Matrix) -> None:
    """W of edge k, to where it is kept or else to the node above."""
    if is_kept(wide, k):
        store_matrix(wide.w, k, w)
    else:
        add_matrix(wide.y, wide.above[k], w)


@compiled
def put_drawn(wide: Wide, k: int, drawn: Vector) -> None:
    """X of edge k likewise."""
    if is_kept(wide, k):
        store_triple(wide.x_j, k, drawn)
    else:
        add_vector(wide.y_j, wide.above[k], drawn)


@compiled
def put_entry(wide: Wide, k: int, a: int, w: complex) -> None:
    """W of an edge with a single phase."""
    if is_kept(wide, k):
        store_entry(wide.w, k, 4 * a, w)
    else:
        above = wide.above[k]
        store_entry(wide.y, above, 4 * a, load_entry(wide.y, above, 4 * a) + w)


@compiled
def put_drawn_entry(wide: Wide, k: int, a: int, drawn: complex) -> None:
    """X of an edge with a single phase."""
    if is_kept(wide, k):
        store_entry(wide.x_j, k, a, drawn)
    else:
        above = wide.above[k]
        store_entry(wide.y_j, above, a, load_entry(wide.y_j, above, a) + drawn)


@compiled
def climb_regions(
    tree: Tree, state: State, wide: Wide, lanes: Work, k: int, how: tuple[int, bool]
) -> None:
    """Put the lanes in which something happens in the place of what is there without.

    ``how``: the lanes eliminated anew, and whether there are currents that no voltage drives.
    """
    demand, fed = how
    for lane in range(WIDTH):
        if wide.busy[k] >> lane & 1:
            flags = climb_region(tree, state, wide, lane_of(lanes, lane), k, (lane, fed))
            if demand >> lane & 1:
                wide.flags[lane] |= flags


@compiled
def in_lanes(shunt: Matrix) -> Matrix:
    """The same in every lane."""
    one = joined(splat(1.0), splat(0.0))
    return (
        one * shunt[0],
        one * shunt[1],
        one * shunt[2],
        one * shunt[3],
        one * shunt[4],
        one * shunt[5],
        one * shunt[6],
        one * shunt[7],
        one * shunt[8],
    )


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
    if q < 0:
        f, w = up(y, load(tree.z_ohm, k))
    else:
        chain = tree.leap_chain[q]
        f, _ = up(y, load(chain, 1))
        f = product(f, load(chain, 0))
        w = add(product(transposed(load(chain, 0)), product(y, f)), load(chain, 2))
    if tree.regulator[k] >= 0 or tree.transformer[k] >= 0:
        t = turn_of(tree, wide, k)
        f, w = product(f, t), product(transposed(t), product(w, t))
    store_matrix(wide.f, k, f)
    return w


@compiled
def carry_whole(tree: Tree, wide: Wide, k: int) -> Vector:
    """What is seen above such an edge of a current drawn below it.

    It is F' of it where nothing has to be noted: what is passive is reciprocal.
    """
    if wide.keeps[k]:
        return keep_ahead(tree, wide, k)
    return times(transposed(load_matrix(wide.f, k)), load_triple(wide.y_j, k))


@compiled
def keep_ahead(tree: Tree, wide: Wide, k: int) -> Vector:
    """Note what a current drawn below makes of the voltage there; returns what is seen of it.

    F may have T in it; that of the impedance alone is made anew.
    """
    turned = tree.regulator[k] >= 0 or tree.transformer[k] >= 0
    y, drawn, q = load_matrix(wide.y, k), load_triple(wide.y_j, k), wide.leap[k]
    z = load(tree.z_ohm, k) if q < 0 else load(tree.leap_chain[q], 1)
    f, _ = up(y, z)
    ahead = minus(times(f, times(z, drawn)))
    store_triple(wide.h_j, k, ahead)
    drawn = plus(drawn, times(y, ahead))
    if q >= 0:
        return times(transposed(load(tree.leap_chain[q], 0)), drawn)
    if turned:
        drawn = times(transposed(turn_of(tree, wide, k)), drawn)
    return drawn


@compiled
def climb_loose(tree: Tree, wide: Wide, k: int, demand: int, fed: bool) -> None:
    """Past an edge that leaves modes loose at its lower end, as ``breaks.free_modes`` does."""
    if not fed:
        store_triple(wide.y_j, k, times(in_lanes(ZERO), (0j, 0j, 0j)))
    w, x = load_matrix(wide.y, k), load_triple(wide.y_j, k)
    p, h, z = in_lanes(IDENTITY), times(in_lanes(ZERO), x), load(tree.z_ohm, k)
    limit = splat(NOTHING_S**2)
    for i in range(9):
        limit = larger(limit, SINGULAR**2 * squared(load_entry(wide.y, k, i)))
    for n in range(tree.loose_from[k], tree.loose_from[k + 1]):
        e = (tree.loose[n, 0], tree.loose[n, 1], tree.loose[n, 2])
        down, own, ahead = times(w, e), times(transposed(w), e), times(p, e)
        driving = e[0] * down[0] + e[1] * down[1] + e[2] * down[2]
        free = squared(driving) <= limit
        for lane in range(WIDTH):
            if bits_of(free) & demand & (1 << lane):
                wide.flags[lane] |= UNEARTHED
        scale = select(free, 0j, -reciprocal(select(free, 1 + 0j, driving)))
        drawn = scale * (e[0] * x[0] + e[1] * x[1] + e[2] * x[2])
        w, p = add(w, outer(down, own, scale)), add(p, outer(ahead, own, scale))
        x = plus(x, (drawn * down[0], drawn * down[1], drawn * down[2]))
        h = plus(h, (drawn * ahead[0], drawn * ahead[1], drawn * ahead[2]))
    f, seen = up(w, z)
    more = minus(times(f, times(z, x)))
    x, h = plus(x, times(w, more)), plus(h, times(p, more))
    f = product(p, f)
    if tree.regulator[k] >= 0 or tree.transformer[k] >= 0:
        t = turn_of(tree, wide, k)
        back = transposed(t)
        f, seen, x = product(f, t), product(back, product(seen, t)), times(back, x)
    store_matrix(wide.f, k, f)
    store_matrix(wide.w, k, seen)
    store_triple(wide.h_j, k, h)
    store_triple(wide.x_j, k, x)


@compiled
def turn_of(tree: Tree, wide: Wide, k: int) -> Matrix:
    """T of what stands at the upper end of edge k, as ``turns.turn_of``."""
    row = tree.regulator[k]
    if row < 0:
        return in_lanes(load(tree.turn, tree.transformer[k]))
    t, reference = wide.turn, tree.reference
    store_matrix(t, 0, in_lanes(IDENTITY))
    for i in range(3):
        more = load_real(wide.ratio, (row, i, 0)) - 1.0
        store_entry(t, 0, 4 * i, load_entry(t, 0, 4 * i) + more)
        if reference[row, i] >= 0:
            across = 3 * i + reference[row, i]
            store_entry(t, 0, across, load_entry(t, 0, across) - more)
    return load_matrix(t, 0)


@compiled
def climb_region(
    tree: Tree, state: State, wide: Wide, work: Work, k: int, where: tuple[int, bool]
) -> int:
    """One lane past the region at node k, edge by edge; returns flags.

    ``where`` is the lane, and whether there are currents that no voltage drives.
    """
    lane, fed = where
    s = wide.scenario[lane]
    top, q = wide.above[k], wide.leap[k]
    twig = wide.visit[k] == TWIG
    if not twig:
        take_lane(wide.y, k, lane, work.y, k)
        if fed:
            take_lane_vector(wide.y_j, k, lane, work.y_j, k)
        else:
            store_vector(work.y_j, k, (0j, 0j, 0j))
    store(work.y, top, ZERO)
    store_vector(work.y_j, top, (0j, 0j, 0j))
    flags = 0
    if q < 0:
        flags = climb_edge(tree, state, work, k, s, fed)
    else:
        for n in range(tree.region_from[q], tree.region_from[q + 1]):
            flags |= climb_edge(tree, state, work, tree.region_node[n], s, fed)
    put_lane(wide.w, k, lane, work.y, top)
    put_lane_vector(wide.x_j, k, lane, work.y_j, top)
    return flags
