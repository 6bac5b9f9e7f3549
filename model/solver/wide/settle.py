"""The fixed point of eight scenarios, each by itself: as ``..settle``."""

from __future__ import annotations

from ...compiled import compiled
from ...lanes import (
    WIDTH,
    bits_of,
    larger,
    load_real,
    magnitude_of,
    mask_of,
    select,
    splat,
    square_root,
    store_real,
)
from ...states import Tree
from ..matrix3 import plus, times
from ..settle import PLAIN_PASSES, SECANT_PASSES, SHORT_STEP, TINY, magnitude, positive
from .rows import load_entry, load_matrix, load_triple
from .work import Wide

__all__ = ["see_magnitudes", "update_magnitudes"]


@compiled
def update_magnitudes(tree: Tree, wide: Wide, passes: int, tolerance_pu: float) -> int:
    """Move the voltages towards the solved ones; returns the bits of the lanes that settled."""
    v_pu, history = wide.winding_v_pu, wide.history
    largest = larger(find_gaps(tree, wide), splat(1.0))
    change = along = across = assumed = solved = splat(0.0)
    for n in range(v_pu.shape[0]):
        gap = load_real(history, (2, n, 0))
        turn = gap - load_real(history, (1, n, 0))
        moved = load_real(v_pu, (n, 0)) - load_real(history, (0, n, 0))
        assumed = larger(assumed, magnitude_of(moved))
        solved = larger(solved, magnitude_of(moved + turn))
        change = larger(change, magnitude_of(gap))
        along = along + gap * turn
        across = across + turn * turn
    back = splat(0.0)
    if 1 < passes <= SECANT_PASSES:
        still = across == 0.0
        back = select(still, 0.0, along / select(still, 1.0, across))
    step = SHORT_STEP if passes > PLAIN_PASSES else 1.0
    for n in range(v_pu.shape[0]):
        value, gap = load_real(v_pu, (n, 0)), load_real(history, (2, n, 0))
        moved = value - load_real(history, (0, n, 0)) + gap - load_real(history, (1, n, 0))
        store_real(v_pu, (n, 0), larger(value + step * gap - back * moved, splat(0.0)))
        store_real(history, (0, n, 0), value)
        store_real(history, (1, n, 0), gap)
    error = change / largest
    if passes > 1:
        share = solved / larger(larger(assumed - solved, solved), splat(TINY))
        share = larger(share, load_real(wide.follows, (0, 0)))
        store_real(wide.follows, (0, 0), share)
        error = error * share
    return bits_of(error <= tolerance_pu)


@compiled
def see_magnitudes(tree: Tree, wide: Wide, bits: int) -> None:
    """Take over the solved voltages in the lanes where nothing depends on them."""
    find_gaps(tree, wide)
    own, v_pu = mask_of(bits), wide.winding_v_pu
    for n in range(v_pu.shape[0]):
        value = load_real(v_pu, (n, 0))
        seen = value + load_real(wide.history, (2, n, 0))
        store_real(v_pu, (n, 0), select(own, seen, value))


@compiled
def find_gaps(tree: Tree, wide: Wide) -> float:
    """How far the solved voltages are from those assumed; returns the largest, in pu."""
    v_all, units = wide.v, tree.unit_node.size
    sourced = tree.machine_unit.size > 0
    largest = splat(0.0)
    for unit in range(units):
        v = times(load_matrix(wide.g, unit), load_triple(v_all, tree.unit_node[unit]))
        if sourced:
            v = plus(v, load_triple(wide.g_j, unit))
        over = 1.0 / tree.unit_v[unit]
        largest = gap_of(wide, 4 * unit, v[0], over, largest)
        largest = gap_of(wide, 4 * unit + 1, v[1], over, largest)
        largest = gap_of(wide, 4 * unit + 2, v[2], over, largest)
        if sourced:
            largest = gap_of(wide, 4 * unit + 3, positive(v), over, largest)
    largest = larger(largest, find_event_gaps(tree, wide))
    node, first, other = tree.branch_node, tree.branch_from, tree.branch_to
    at = 4 * (units + 1)
    for p in range(node.size):
        across = load_entry(v_all, node[p], first[p])
        if other[p] >= 0:
            across = across - load_entry(v_all, node[p], other[p])
        largest = gap_of(wide, at + p, across, 1.0 / tree.branch_v[p], largest)
    return largest


@compiled
def gap_of(wide: Wide, n: int, v: complex, over: float, largest: float) -> float:
    """Note the gap of voltage n; returns the larger of it and ``largest``."""
    size = square_root(v.real * v.real + v.imag * v.imag) * over
    store_real(wide.history, (2, n, 0), size - load_real(wide.winding_v_pu, (n, 0)))
    return larger(size, largest)


@compiled
def find_event_gaps(tree: Tree, wide: Wide) -> float:
    """The same at the upper stub of every event node."""
    v_pu, history, at = wide.winding_v_pu, wide.history, 4 * tree.unit_node.size
    for i in range(4):
        store_real(history, (2, at + i, 0), splat(0.0))
    most = splat(0.0)
    for lane in range(WIDTH):
        edge = wide.edge[lane]
        if edge >= 0:
            for i in range(3):
                stub = complex(wide.stub[0, 2 * i, lane], wide.stub[0, 2 * i + 1, lane])
                size = magnitude(stub) / tree.node_v[edge]
                history[2, at + i, lane] = size - v_pu[at + i, lane]
    for i in range(3):
        gap, value = load_real(history, (2, at + i, 0)), load_real(v_pu, (at + i, 0))
        most = larger(most, gap + value)
    return most
