"""Scratch space for eight scenarios."""

from __future__ import annotations

import threading
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...lanes.kinds import WIDTH
from ...states import Probes, Tree
from .rows import Stack

__all__ = ["ALL", "PASSED", "TWIG", "Wide", "wide_workspace"]

Int = NDArray[np.int64]
Real = NDArray[np.float64]

ALL = (1 << WIDTH) - 1  #: bits of all lanes
PASSED, PLAIN, LEAP, TWIG = 0, 1, 2, 3  #: how the ladder takes a node

ALIGNED = 64  #: bytes: a vector that begins elsewhere takes two lines of the cache


class Wide(NamedTuple):
    """Scratch of eight scenarios in a network of B nodes, U units, P branches, Q leaps.

    What each means stands at the field of that name in ``Work``. ``visit`` says whether a node is
    passed by, and ``leap`` which leap ends there or, for a twig, begins; a region is what the
    ladder takes apart for a scenario by itself: an edge on which something happens, with the
    whole leap that it is part of.
    """

    visit: Int  #: (B,)
    leap: Int  #: (B,) -1: none
    above: Int  #: (B,) the node above that is not passed by; B, the EMF's row, for node 0
    place: Int  #: (Q,) the node at which a leap is visited
    loose: NDArray[np.bool_]  #: (B,) the edge leaves modes loose
    watched: NDArray[np.bool_]  #: (B,) W and X of the edge are looked at
    notes: NDArray[np.bool_]  #: (B,) what currents make of the voltage is noted on the way up
    reciprocal: NDArray[np.bool_]  #: (1,)
    branch_over: Real  #: (P,) one over its nominal volts
    law_same: NDArray[np.bool_]  #: (L,) active and reactive power follow one law
    busy: Int  #: (B,) bits of the lanes in which something happens in the region there
    demand: Int  #: (1,) bits of the lanes that are eliminated anew
    scenario: Int  #: (WIDTH,) which one each lane has
    flags: Int  #: (WIDTH,)
    edge: Int  #: (WIDTH,) of the event
    far: Int  #: (WIDTH,) node of a second step
    opened: Int  #: (3,) bits of the lanes in which a phase is open
    empty: Int  #: (3,) and of those where nothing is below it
    load_scale: Real  #: (L, WIDTH) as in ``State``
    exponent: Real  #: (L, WIDTH)
    ratio: Real  #: (R, 3, WIDTH)
    emf_pu: Real  #: (1, WIDTH)
    share: Real  #: (1, WIDTH)
    step_power: Real  #: (1, WIDTH) of ``step_y`` beyond that of an impedance
    step_y: Stack  #: (1, 6, WIDTH)
    between_y: Stack  #: (1, 6, WIDTH)
    fallen_y: Stack  #: (1, 6, WIDTH)
    y: Stack  #: (B, 18, WIDTH)
    f: Stack  #: (B, 18, WIDTH)
    w: Stack  #: (B, 18, WIDTH)
    y_j: Stack  #: (B, 6, WIDTH)
    h_j: Stack  #: (B, 6, WIDTH)
    x_j: Stack  #: (B, 6, WIDTH)
    z_f: Stack  #: (B, 18, WIDTH) F of the impedance alone, where ``notes``
    own_f: Stack  #: (B, 18, WIDTH) F of each edge of a region, down to the upper stub
    own_h: Stack  #: (B, 6, WIDTH) what currents make of the voltage there
    top: Stack  #: (2, 18, WIDTH) W of a region, and what its charging differs by
    top_j: Stack  #: (1, 6, WIDTH) its X
    v: Stack  #: (B + 1, 6, WIDTH)
    here: Stack  #: (2, 18, WIDTH) W and P at a break
    here_j: Stack  #: (2, 6, WIDTH) x and h there
    event: Stack  #: (2, 18, WIDTH) P at the event node, F below it
    event_j: Stack  #: (2, 6, WIDTH) what currents make of these voltages
    event_y: Stack  #: (2, 18, WIDTH) shunts at its stubs
    stub: Stack  #: (2, 6, WIDTH)
    follows: Real  #: (1, WIDTH)
    turn: Stack  #: (1, 18, WIDTH) T of a regulator
    current: Stack  #: (1, 6, WIDTH) scratch
    seen_v: Stack  #: (probes, 6, WIDTH) as the pass that settled each lane found it, like the next
    seen_i: Stack  #: (probes, 6, WIDTH)
    seen_stub: Stack  #: (2, 6, WIDTH)
    seen_windings: Stack  #: (N, WIDTH)
    seen_machine: Stack  #: (M, 2, WIDTH)
    passes: Int  #: (WIDTH,)
    g: Stack  #: (U, 18, WIDTH)
    g_j: Stack  #: (U, 6, WIDTH)
    unit_y: Stack  #: (U, 6, WIDTH) loads across the LV windings
    branch_y: Stack  #: (P, 2, WIDTH) as last eliminated
    branch_own: Stack  #: (P, 2, WIDTH) as the voltages have it
    winding_v_pu: Real  #: (N, WIDTH)
    history: Real  #: (3, N, WIDTH)


class _Last(threading.local):
    """What this thread used last."""

    found: tuple[Tree, bytes, Wide] | None = None


_LAST = _Last()


def wide_workspace(tree: Tree, probes: Probes) -> Wide:
    """Scratch for a network, and what the ladder must know of it beside its tree.

    A thread that solves with the same network again gets the same scratch again.
    """
    looked_at = probes.i_edge.tobytes() + probes.v_node.tobytes()
    last = _LAST.found
    if last is None or last[0] is not tree or last[1] != looked_at:
        last = _LAST.found = (tree, looked_at, _made(tree, probes))
    return last[2]


def _made(tree: Tree, probes: Probes) -> Wide:
    nodes, units, branches = tree.parent.size, tree.unit_node.size, tree.branch_node.size
    loads, windings = tree.load_unit.size, 4 * (units + 1) + branches
    loose = np.diff(tree.loose_from) > 0
    notes, reciprocal = _noting(tree, loose)
    return Wide(
        *_visits(tree),
        loose=loose,
        watched=_watched(probes, loose),
        notes=notes,
        reciprocal=np.array([reciprocal]),
        branch_over=1.0 / tree.branch_v,
        law_same=np.all(tree.law[:, :5] == tree.law[:, 5:10], axis=1),
        busy=np.zeros(nodes, np.int64),
        demand=np.zeros(1, np.int64),
        scenario=np.zeros(WIDTH, np.int64),
        flags=np.zeros(WIDTH, np.int64),
        edge=np.zeros(WIDTH, np.int64),
        far=np.zeros(WIDTH, np.int64),
        opened=np.zeros(3, np.int64),
        empty=np.zeros(3, np.int64),
        passes=np.zeros(WIDTH, np.int64),
        **_aligned(
            load_scale=(loads,),
            exponent=(loads,),
            emf_pu=(1,),
            share=(1,),
            step_power=(1,),
            step_y=(1, 6),
            between_y=(1, 6),
            fallen_y=(1, 6),
            y=(nodes, 18),
            f=(nodes, 18),
            w=(nodes, 18),
            y_j=(nodes, 6),
            h_j=(nodes, 6),
            x_j=(nodes, 6),
            z_f=(nodes, 18),
            own_f=(nodes, 18),
            own_h=(nodes, 6),
            top=(2, 18),
            top_j=(1, 6),
            v=(nodes + 1, 6),
            here=(2, 18),
            here_j=(2, 6),
            event=(2, 18),
            event_j=(2, 6),
            event_y=(2, 18),
            stub=(2, 6),
            follows=(1,),
            turn=(1, 18),
            current=(1, 6),
            seen_v=(probes.v_node.size, 6),
            seen_i=(probes.i_edge.size, 6),
            seen_stub=(2, 6),
            seen_windings=(windings,),
            seen_machine=(tree.machine_unit.size, 2),
            g=(units, 18),
            g_j=(units, 6),
            unit_y=(units, 6),
            branch_y=(branches, 2),
            branch_own=(branches, 2),
            winding_v_pu=(windings,),
            history=(3, windings),
            ratio=(tree.reference.shape[0], 3),
        ),
    )


def _visits(tree: Tree) -> tuple[Int, Int, Int, Int]:
    """How each node is taken, its leap, the node above that is seen, and where leaps are taken."""
    nodes = tree.parent.size
    visit, leap = np.full(nodes, PLAIN), np.full(nodes, -1)
    above, place = tree.parent.copy(), np.zeros(tree.leap_from.size, np.int64)
    above[0] = nodes
    visit[tree.passed >= 0] = PASSED
    for q in range(tree.leap_from.size):
        region = tree.region_node[tree.region_from[q] : tree.region_from[q + 1]]
        k = region.min() if q < tree.twigs else region[tree.leap[region] == q][0]
        visit[k] = TWIG if q < tree.twigs else LEAP
        leap[k], above[k], place[q] = q, tree.leap_from[q], k
    return visit, leap, above, place


def _watched(probes: Probes, loose: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Edges at probes, that of the source, and those that leave modes loose."""
    watched = loose.copy()
    watched[0] = True
    watched[probes.i_edge] = True
    return watched


def _noting(tree: Tree, loose: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], bool]:
    """Edges that have more than an impedance, or all; and whether everything is reciprocal."""
    edges = tree.parent.size
    noting = loose | (tree.regulator[:edges] >= 0) | (tree.transformer[:edges] >= 0)
    noting |= tree.leap >= 0
    parts = (tree.z_ohm[:edges], tree.leap_chain[:, 1:].reshape(-1, 3, 3), tree.shunt_s)
    reciprocal = tree.machine_unit.size == 0 and all(map(_symmetric, parts))
    return noting | (not reciprocal), reciprocal


def _symmetric(matrices: NDArray[np.complex128]) -> bool:
    odd = np.abs(matrices - matrices.swapaxes(1, 2)).max(initial=0.0)
    return bool(odd <= 1e-12 * np.abs(matrices).max(initial=0.0))


def _aligned(**shapes: tuple[int, ...]) -> dict[str, Any]:
    """Zeros (..., WIDTH) by name, each beginning where a line of the cache does."""
    sizes = {name: prod(shape) * WIDTH for name, shape in shapes.items()}
    room = np.zeros(sum(sizes.values()) + ALIGNED // 8)
    at = -room.ctypes.data // 8 % (ALIGNED // 8)
    parts: dict[str, Any] = {}
    for name, shape in shapes.items():
        parts[name] = room[at : at + sizes[name]].reshape(*shape, WIDTH)
        at += sizes[name]
    return parts
