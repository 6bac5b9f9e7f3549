"""Scratch space for eight scenarios: in lanes what all share, and a record of each for itself."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from ...lanes import WIDTH
from ...states import Probes, Tree, Work, workspace
from .rows import Stack

__all__ = ["ALL", "LEAP", "PASSED", "PLAIN", "TWIG", "Wide", "lane_of", "wide_workspace"]

Int = NDArray[np.int64]

ALL = (1 << WIDTH) - 1  #: bits of all lanes
PASSED, PLAIN, LEAP, TWIG = 0, 1, 2, 3  #: how the ladder takes a node

ALIGNED = 64  #: bytes: a vector that begins elsewhere takes two lines of the cache


class Wide(NamedTuple):
    """Scratch of eight scenarios in a network of B nodes, U units, P branches, Q leaps.

    What each means stands at the field of that name in ``Work``. ``visit`` says whether a node is
    passed by, and ``leap`` which leap ends there or, for a twig, begins; a region is what the
    ladder takes apart for a scenario by itself: an edge on which something happens with the
    whole leap that it is part of, or one that leaves modes loose.
    """

    visit: Int  #: (B,)
    leap: Int  #: (B,) -1: none
    above: Int  #: (B,) the node above that is not passed by; B, the EMF's row, for node 0
    place: Int  #: (Q,) the node at which a leap is visited
    loose: NDArray[np.bool_]  #: (B,) the edge leaves modes loose
    kept: NDArray[np.bool_]  #: (B,) W and X are looked at
    keeps: NDArray[np.bool_]  #: (B,) what currents make of the voltage is noted on the way up
    busy: Int  #: (B,) bits of the lanes in which something happens in the region there
    scenario: Int  #: (WIDTH,) which one each lane has
    flags: Int  #: (WIDTH,)
    load_scale: NDArray[np.float64]  #: (L, WIDTH) as in ``State``
    exponent: NDArray[np.float64]  #: (L, WIDTH)
    ratio: NDArray[np.float64]  #: (R, 3, WIDTH)
    emf_pu: NDArray[np.float64]  #: (1, WIDTH)
    y: Stack  #: (B, 18, WIDTH)
    f: Stack  #: (B, 18, WIDTH)
    w: Stack  #: (B, 18, WIDTH)
    y_j: Stack  #: (B, 6, WIDTH)
    h_j: Stack  #: (B, 6, WIDTH)
    x_j: Stack  #: (B, 6, WIDTH)
    v: Stack  #: (B + 1, 6, WIDTH)
    follows: NDArray[np.float64]  #: (1, WIDTH)
    turn: Stack  #: (1, 18, WIDTH) T of a regulator
    current: Stack  #: (1, 6, WIDTH) at a probe
    g: Stack  #: (U, 18, WIDTH)
    g_j: Stack  #: (U, 6, WIDTH)
    unit_y: Stack  #: (U, 6, WIDTH) loads across the LV windings
    branch_y: Stack  #: (P, 2, WIDTH) as last eliminated
    branch_own: Stack  #: (P, 2, WIDTH) as the voltages have it
    winding_v_pu: NDArray[np.float64]  #: (N, WIDTH)
    history: NDArray[np.float64]  #: (3, N, WIDTH)


def wide_workspace(tree: Tree, probes: Probes) -> tuple[Wide, Work]:
    """Scratch in lanes, and that of ``workspace`` with an axis of lanes before all others."""
    nodes, units, branches = tree.parent.size, tree.unit_node.size, tree.branch_node.size
    windings = 4 * (units + 1) + branches
    visit, leap = np.full(nodes, PLAIN), np.full(nodes, -1)
    above, place = tree.parent.copy(), np.zeros(tree.leap_from.size, np.int64)
    above[0] = nodes
    visit[tree.passed >= 0] = PASSED
    for q in range(tree.leap_from.size):
        region = tree.region_node[tree.region_from[q] : tree.region_from[q + 1]]
        k = region.min() if q < tree.twigs else np.flatnonzero(tree.leap == q)[0]
        visit[k] = TWIG if q < tree.twigs else LEAP
        leap[k], above[k], place[q] = q, tree.leap_from[q], k
    one, loose = workspace(tree), np.diff(tree.loose_from) > 0
    return Wide(
        visit=visit,
        leap=leap,
        above=above,
        place=place,
        loose=loose,
        kept=_kept(tree, probes, loose),
        keeps=_keeping(tree, loose),
        busy=np.zeros(nodes, np.int64),
        scenario=np.zeros(WIDTH, np.int64),
        flags=np.zeros(WIDTH, np.int64),
        load_scale=_aligned(tree.load_unit.size),
        exponent=_aligned(tree.load_unit.size),
        ratio=_aligned(tree.reference.shape[0], 3),
        emf_pu=_aligned(1),
        y=_aligned(nodes, 18),
        f=_aligned(nodes, 18),
        w=_aligned(nodes, 18),
        y_j=_aligned(nodes, 6),
        h_j=_aligned(nodes, 6),
        x_j=_aligned(nodes, 6),
        v=_aligned(nodes + 1, 6),
        follows=_aligned(1),
        turn=_aligned(1, 18),
        current=_aligned(1, 6),
        g=_aligned(units, 18),
        g_j=_aligned(units, 6),
        unit_y=_aligned(units, 6),
        branch_y=_aligned(branches, 2),
        branch_own=_aligned(branches, 2),
        winding_v_pu=_aligned(windings),
        history=_aligned(3, windings),
    ), Work._make(np.zeros((WIDTH, *part.shape), part.dtype) for part in one)


def _kept(tree: Tree, probes: Probes, loose: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Edges at probes, that of the source, and those that leave modes loose."""
    kept = loose.copy()
    kept[0] = True
    kept[probes.i_edge] = True
    return kept


def _keeping(tree: Tree, loose: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Edges that have more than an impedance, and all where not everything is reciprocal."""
    edges = tree.parent.size
    keeping = loose | (tree.regulator[:edges] >= 0) | (tree.transformer[:edges] >= 0)
    keeping |= tree.leap >= 0
    keeping[0] = True
    for part in (tree.z_ohm[1:edges], tree.shunt_s):
        if np.abs(part - part.swapaxes(1, 2)).max(initial=0.0) > 1e-12 * np.abs(part).max(
            initial=0.0
        ):
            keeping[:] = True
    return keeping | (tree.machine_unit.size > 0)


def _aligned(*shape: int) -> NDArray[np.float64]:
    """Zeros (..., WIDTH) that begin where a line of the cache does."""
    size = int(np.prod(shape)) * WIDTH
    room = np.zeros(size + ALIGNED // 8)
    first = -room.ctypes.data // 8 % (ALIGNED // 8)
    return room[first : first + size].reshape(*shape, WIDTH)


@compiled
def lane_of(lanes: Work, lane: int) -> Work:
    """One scenario's own scratch."""
    return Work(
        lanes.y[lane],
        lanes.f[lane],
        lanes.h[lane],
        lanes.h_j[lane],
        lanes.w[lane],
        lanes.x[lane],
        lanes.x_j[lane],
        lanes.x_low[lane],
        lanes.y_j[lane],
        lanes.v[lane],
        lanes.g[lane],
        lanes.g_j[lane],
        lanes.branch_y[lane],
        lanes.unit_y[lane],
        lanes.unit_j[lane],
        lanes.event_y[lane],
        lanes.xt[lane],
        lanes.u[lane],
        lanes.u_j[lane],
        lanes.chord[lane],
        lanes.here[lane],
        lanes.here_j[lane],
        lanes.here_x[lane],
        lanes.here_h[lane],
        lanes.row[lane],
        lanes.event[lane],
        lanes.event_h[lane],
        lanes.event_j[lane],
        lanes.stub[lane],
        lanes.winding_v_pu[lane],
        lanes.history[lane],
        lanes.follows[lane],
    )
