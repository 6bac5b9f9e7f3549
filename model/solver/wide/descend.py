"""Down the ladder in lanes, and the currents at the probes."""

from __future__ import annotations

from ...compiled import compiled
from ...lanes import WIDTH, joined, splat
from ...states import State, Tree, Work
from ..ladder import descend_edge, neutral_shift
from ..matrix3 import Vector, load, load_vector, minus, plus, store_vector, times
from .rows import (
    load_entry,
    load_matrix,
    load_triple,
    put_lane_vector,
    store_entry,
    store_triple,
    take_lane,
    take_lane_vector,
)
from .work import PASSED, TWIG, Wide, lane_of

__all__ = ["descend", "lift_neutrals", "probe_current"]


@compiled
def lift_neutrals(tree: Tree, wide: Wide, lanes: Work, fed: bool) -> None:
    """Shift every lane's EMF by the neutral's voltage."""
    last = wide.y.shape[0]
    for lane in range(WIDTH):
        work = lane_of(lanes, lane)
        take_lane(wide.w, 0, lane, work.w, 0)
        store_vector(work.x_j, 0, (0j, 0j, 0j))
        if fed:
            take_lane_vector(wide.x_j, 0, lane, work.x_j, 0)
        take_lane_vector(wide.v, last, lane, work.v, last)
        flags, emf = neutral_shift(
            load(work.w, 0), load_vector(work.v, last), load_vector(work.x_j, 0), tree.neutral_y_s
        )
        store_vector(work.v, last, emf)
        put_lane_vector(wide.v, last, lane, work.v, last)
        wide.flags[lane] |= flags


@compiled
def descend(tree: Tree, state: State, wide: Wide, lanes: Work, fed: bool) -> None:
    """Voltages from the source to the leaves, those of nodes passed by only in busy regions."""
    lone, visits, v_all = tree.lone_phase, wide.visit, wide.v
    for k in range(visits.size):
        visit = visits[k]
        if visit == PASSED:
            continue
        a, busy, above = lone[k], wide.busy[k], wide.above[k]
        if visit != TWIG:
            if a >= 0:
                v1, kept = load_entry(v_all, above, a), wide.leap[k] >= 0
                if fed and not kept:
                    v1 = v1 - tree.z_ohm[k, a, a] * load_entry(wide.y_j, k, a)
                v1 = load_entry(wide.f, k, 4 * a) * v1
                if fed and kept:
                    v1 = v1 + load_entry(wide.h_j, k, a)
                store_entry(v_all, k, a, v1)
            else:
                v = load_triple(v_all, above)
                if fed and not wide.keeps[k]:
                    lost = times(load(tree.z_ohm, k), load_triple(wide.y_j, k))
                    v = plus(v, minus(lost))
                v = times(load_matrix(wide.f, k), v)
                if fed and wide.keeps[k]:
                    v = plus(v, load_triple(wide.h_j, k))
                store_triple(v_all, k, v)
                if tree.node_phases[k] != 7:
                    keep_phases(wide, k, tree.node_phases[k])
        if busy:
            for lane in range(WIDTH):
                if busy >> lane & 1:
                    work = lane_of(lanes, lane)
                    descend_region(tree, state, wide, work, k, (lane, wide.scenario[lane], fed))


@compiled
def keep_phases(wide: Wide, k: int, phases: int) -> None:
    """Zero for phases that node k does not have."""
    for i in range(3):
        if not phases & (1 << i):
            store_entry(wide.v, k, i, joined(splat(0.0), splat(0.0)))


@compiled
def descend_region(
    tree: Tree, state: State, wide: Wide, work: Work, k: int, where: tuple[int, int, bool]
) -> None:
    """One lane down the region at node k, edge by edge."""
    lane, s, fed = where
    top, q = wide.above[k], wide.leap[k]
    take_lane_vector(wide.v, top, lane, work.v, top)
    if q < 0:
        descend_edge(tree, state, work, k, s, fed)
    else:
        for n in range(tree.region_from[q + 1] - 1, tree.region_from[q] - 1, -1):
            descend_edge(tree, state, work, tree.region_node[n], s, fed)
    if wide.visit[k] != TWIG:
        put_lane_vector(wide.v, k, lane, work.v, k)


@compiled
def probe_current(tree: Tree, wide: Wide, k: int, below: bool, fed: bool) -> Vector:
    """Current from above into an edge on which nothing happens, or out of its lower end."""
    v_all, upper = wide.v, wide.above[k]
    if below and (tree.regulator[k] >= 0 or tree.transformer[k] >= 0):
        current = times(load_matrix(wide.y, k), load_triple(v_all, k))
        if fed:
            current = plus(current, load_triple(wide.y_j, k))
    else:
        current = times(load_matrix(wide.w, k), load_triple(v_all, upper))
        if fed:
            current = plus(current, load_triple(wide.x_j, k))
    if tree.charged and k:
        charging = times(load(tree.end_y_s, k), load_triple(v_all, k if below else upper))
        current = plus(current, minus(charging) if below else charging)
    return current
