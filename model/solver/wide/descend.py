"""Down the ladder in lanes, and the currents at the probes."""

from __future__ import annotations

from ...compiled import compiled
from ...lanes.functions import bits_of, joined, mask_of, select, splat
from ...states import Tree
from ..breaks import FLOATING, squared
from ..matrix3 import (
    Vector,
    column_sums,
    load,
    minus,
    plus,
    reciprocal,
    scaled,
    times,
)
from .event import descend_event, event_lanes, event_share, note, smallest_counted
from .rows import (
    Stack,
    chosen_vector,
    load_entry,
    load_matrix,
    load_triple,
    no_vector,
    store_entry,
    store_triple,
)
from .turns import turned
from .work import PASSED, TWIG, Wide

__all__ = ["descend", "lift_neutrals", "probe_current"]


@compiled
def lift_neutrals(tree: Tree, wide: Wide, fed: bool) -> None:
    """Shift every lane's EMF by the neutral's voltage, as ``ladder.neutral_shift``."""
    last = wide.y.shape[0]
    w, emf = load_matrix(wide.w, 0), load_triple(wide.v, last)
    drawn = times(w, emf)
    if fed:
        drawn = plus(drawn, load_triple(wide.x_j, 0))
    sums = column_sums(w)
    total = sums[0] + sums[1] + sums[2] + tree.neutral_y_s
    free = squared(total) <= smallest_counted(wide.w)
    note(wide, bits_of(free), FLOATING)
    shift = -(drawn[0] + drawn[1] + drawn[2]) * reciprocal(select(free, 1 + 0j, total))
    shift = select(free, 0j, shift)
    store_triple(wide.v, last, plus(emf, (shift, shift, shift)))


@compiled
def descend(tree: Tree, wide: Wide, fed: bool) -> None:
    """Voltages from the source to the leaves, those of nodes passed by only in busy regions."""
    for k in range(wide.visit.size):
        if wide.visit[k] == PASSED:
            continue
        a = tree.lone_phase[k]
        if wide.visit[k] != TWIG:
            if a >= 0:
                descend_lone(tree, wide, k, a, fed)
            else:
                descend_whole(tree, wide, k, fed)
        if wide.busy[k]:
            descend_region(tree, wide, k)


@compiled
def descend_lone(tree: Tree, wide: Wide, k: int, a: int, fed: bool) -> None:
    """The voltage below an edge, or a leap, that has a single phase."""
    v1, noted = load_entry(wide.v, wide.above[k], a), wide.leap[k] >= 0
    if fed and not noted:
        v1 = v1 - tree.z_ohm[k, a, a] * load_entry(wide.y_j, k, a)
    v1 = load_entry(wide.f, k, 4 * a) * v1
    if fed and noted:
        v1 = v1 + load_entry(wide.h_j, k, a)
    store_entry(wide.v, k, a, v1)


@compiled
def descend_whole(tree: Tree, wide: Wide, k: int, fed: bool) -> None:
    """The voltage below an edge, or a leap, of several phases."""
    v = load_triple(wide.v, wide.above[k])
    if fed and not wide.notes[k]:
        v = plus(v, minus(times(load(tree.z_ohm, k), load_triple(wide.y_j, k))))
    v = times(load_matrix(wide.f, k), v)
    if fed and wide.notes[k]:
        v = plus(v, load_triple(wide.h_j, k))
    store_triple(wide.v, k, v)
    keep_phases(wide.v, k, tree.node_phases[k])


@compiled
def keep_phases(stack: Stack, k: int, phases: int) -> None:
    """Zero in row k for phases that are not there."""
    if phases == 7:
        return
    for i in range(3):
        if not phases & (1 << i):
            store_entry(stack, k, i, joined(splat(0.0), splat(0.0)))


@compiled
def descend_region(tree: Tree, wide: Wide, k: int) -> None:
    """The lanes in which something happens down the region at node k, edge by edge."""
    q, own, v_all = wide.leap[k], mask_of(wide.busy[k]), wide.v
    generic = load_triple(v_all, k)
    first, last = (0, 1) if q < 0 else (tree.region_from[q], tree.region_from[q + 1])
    for at in range(last - 1, first - 1, -1):
        n = k if q < 0 else tree.region_node[at]
        bits, above = event_lanes(wide, n), load_triple(v_all, tree.parent[n])
        store_triple(v_all, n, descend_event(wide, n, bits, above))
        keep_phases(v_all, n, tree.node_phases[n])
        if bits:
            keep_stubs(wide, bits, tree.phases[n])
    if wide.visit[k] != TWIG:
        store_triple(v_all, k, chosen_vector(own, load_triple(v_all, k), generic))


@compiled
def keep_stubs(wide: Wide, bits: int, phases: int) -> None:
    """Zero at the event node of these lanes for phases that its edge does not have."""
    own = mask_of(bits)
    for i in range(3):
        if not phases & (1 << i):
            for side in range(2):
                stub = load_entry(wide.stub, side, i)
                store_entry(wide.stub, side, i, select(own, 0j, stub))


@compiled
def probe_current(tree: Tree, wide: Wide, k: int, below: bool, fed: bool) -> Vector:
    """Current from above into an edge, or out of its lower end."""
    v_all, upper, bits = wide.v, wide.above[k], event_lanes(wide, k)
    own, nothing = mask_of(bits), no_vector()
    if below and turned(tree, k):
        current = times(load_matrix(wide.y, k), load_triple(v_all, k))
        if fed:
            current = plus(current, load_triple(wide.y_j, k))
    else:
        current = times(load_matrix(wide.w, k), load_triple(v_all, upper))
        if fed:
            current = plus(current, load_triple(wide.x_j, k))
        if below and bits:
            for side in range(2):
                shunts, stub = load_matrix(wide.event_y, side), load_triple(wide.stub, side)
                current = plus(current, chosen_vector(own, minus(times(shunts, stub)), nothing))
    if tree.charged and k:
        share = event_share(wide, bits, 0.0 if below else 1.0)
        part = 1.0 - share if below else share
        half = scaled(load(tree.end_y_s, k), part)
        charging = times(half, load_triple(v_all, k if below else upper))
        current = plus(current, minus(charging) if below else charging)
    return current
