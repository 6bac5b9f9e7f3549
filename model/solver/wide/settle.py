"""The fixed point of eight scenarios, each by itself: as ``..settle``."""

from __future__ import annotations

from ...compiled import compiled
from ...lanes.functions import (
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
from ...lanes.kinds import WIDTH
from ...states import Tree
from ..matrix3 import plus, times
from ..settle import PLAIN_PASSES, SECANT_PASSES, SHORT_STEP, TINY, magnitude, positive
from .rows import load_entry, load_matrix, load_triple
from .work import Wide

#: Lanes of the largest voltage and gap, of the secant's two products, and the largest move of an
#: assumed and a solved voltage
Sums = tuple[float, float, float, float, float, float]

__all__ = ["see_magnitudes", "update_magnitudes"]


@compiled
def update_magnitudes(tree: Tree, wide: Wide, bits: int, passes: int, tolerance_pu: float) -> int:
    """Move the voltages towards the solved ones; returns the bits of the lanes that settled.

    Those of ``bits`` have, and stay where they are: another step would be one of rounding.
    """
    v_pu, history, done = wide.winding_v_pu, wide.history, mask_of(bits)
    largest, change, along, across, assumed, solved = find_gaps(tree, wide)
    back = splat(0.0)
    if 1 < passes <= SECANT_PASSES:
        still = across == 0.0
        back = select(still, 0.0, along / select(still, 1.0, across))
    step = SHORT_STEP if passes > PLAIN_PASSES else 1.0
    for n in range(v_pu.shape[0]):
        value, gap = load_real(v_pu, (n, 0)), load_real(history, (2, n, 0))
        moved = value - load_real(history, (0, n, 0)) + gap - load_real(history, (1, n, 0))
        new = larger(value + step * gap - back * moved, splat(0.0))
        store_real(v_pu, (n, 0), select(done, value, new))
        store_real(history, (0, n, 0), value)
        store_real(history, (1, n, 0), gap)
    error = change / larger(largest, splat(1.0))
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
def find_gaps(tree: Tree, wide: Wide) -> Sums:
    """How far the solved voltages are from those assumed, and their sums."""
    v_all, units = wide.v, tree.unit_node.size
    sourced = tree.machine_unit.size > 0
    none = splat(0.0)
    sums = (none, none, none, none, none, none)
    for unit in range(units):
        v = times(load_matrix(wide.g, unit), load_triple(v_all, tree.unit_node[unit]))
        if sourced:
            v = plus(v, load_triple(wide.g_j, unit))
        over = 1.0 / tree.unit_v[unit]
        sums = tally(wide, 4 * unit, size_of(v[0]) * over, sums)
        sums = tally(wide, 4 * unit + 1, size_of(v[1]) * over, sums)
        sums = tally(wide, 4 * unit + 2, size_of(v[2]) * over, sums)
        if sourced:
            sums = tally(wide, 4 * unit + 3, size_of(positive(v)) * over, sums)
    for i in range(3):
        sums = tally_stub(tree, wide, i, sums)
    node, first, other = tree.branch_node, tree.branch_from, tree.branch_to
    at = 4 * (units + 1)
    for p in range(node.size):
        across = load_entry(v_all, node[p], first[p])
        if other[p] >= 0:
            across = across - load_entry(v_all, node[p], other[p])
        sums = tally(wide, at + p, size_of(across) * wide.branch_over[p], sums)
    return sums


@compiled
def size_of(value: complex) -> float:
    """``|value|`` in every lane."""
    return square_root(value.real * value.real + value.imag * value.imag)


@compiled
def tally(wide: Wide, n: int, size: float, sums: Sums) -> Sums:
    """Note the gap of voltage n, which is solved as ``size``, and add it to the sums."""
    history, value = wide.history, load_real(wide.winding_v_pu, (n, 0))
    gap = size - value
    turn, moved = gap - load_real(history, (1, n, 0)), value - load_real(history, (0, n, 0))
    store_real(history, (2, n, 0), gap)
    largest, change, along, across, assumed, solved = sums
    return (
        larger(largest, size),
        larger(change, magnitude_of(gap)),
        along + gap * turn,
        across + turn * turn,
        larger(assumed, magnitude_of(moved)),
        larger(solved, magnitude_of(moved + turn)),
    )


@compiled
def tally_stub(tree: Tree, wide: Wide, i: int, sums: Sums) -> Sums:
    """Phase i of the upper stub of every lane that has an event node."""
    n = 4 * tree.unit_node.size + i
    stub, size = wide.stub, wide.current
    for lane in range(WIDTH):
        edge = wide.edge[lane]
        size[0, 0, lane] = wide.winding_v_pu[n, lane]
        if edge >= 0:
            found = complex(stub[0, 2 * i, lane], stub[0, 2 * i + 1, lane])
            size[0, 0, lane] = magnitude(found) / tree.node_v[edge]
    solved = load_real(size, (0, 0, 0))
    largest = sums[0]
    sums = tally(wide, n, solved, sums)
    there = mask_of(event_bits(wide))
    return (
        larger(largest, select(there, solved, splat(0.0))),
        sums[1],
        sums[2],
        sums[3],
        sums[4],
        sums[5],
    )


@compiled
def event_bits(wide: Wide) -> int:
    """The bits of the lanes that have an event node."""
    bits = 0
    for lane in range(WIDTH):
        bits |= int(wide.edge[lane] >= 0) << lane
    return bits
