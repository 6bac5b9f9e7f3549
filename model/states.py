"""The records that pass between the compiler of networks, the ladder and its callers.

Named tuples of arrays, because compiled code takes them as they are. The scenario axis
is last.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "BY_LAW",
    "NOT_CONVERGED",
    "UNEARTHED",
    "Answer",
    "Probes",
    "State",
    "Tree",
    "Work",
    "unit_voltages",
    "workspace",
]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Int = NDArray[np.int64]

NOT_CONVERGED = 4  #: flag: voltage-dependent loads did not settle
UNEARTHED = 64  #: flag: nothing earths what lies behind an ungrounded winding
BY_LAW = -1.0  #: exponent of a load that follows its own law


class Tree(NamedTuple):
    """A compiled network of B nodes: what ``solve_block`` needs to know about it.

    Node k hangs on ``parent[k]`` by edge k; node 0 is the source bus, its edge the source
    impedance. Parents come before children. Edges B to B + C - 1 are chords, which close loops:
    each leads from its ``tail`` to an ancestor of that node, its ``fork``; what would stand at
    its upper end stands at its tail.
    At the upper end of an edge may stand a regulator or a transformer: what arrives below it is
    the voltage above times a matrix. At its lower end it may leave modes of the voltage loose,
    into which it feeds no current: the common mode behind an ungrounded winding, or a phase
    that the edge does not have and its node does.
    """

    parent: Int  #: (B,); -1 for node 0
    z_ohm: Complex  #: (B + C, 3, 3)
    phases: Int  #: (B + C,) bit mask of the conductors, bit 0 for phase a
    node_phases: Int  #: (B,) bit mask of the phases at each node
    lone_phase: Int  #: (B,) of a plain edge with one phase, to a node with one; else -1
    end_y_s: Complex  #: (B + C, 3, 3) charging at each end of the edge, half of all it has
    charged: bool  #: any edge has charging
    regulator: Int  #: (B + C,) row of ``State.ratio`` at the edge's upper end; -1: none
    reference: Int  #: (R, 3) phase that a regulator's phase refers to, -1: earth
    transformer: Int  #: (B + C,) row of ``turn``; -1: none
    turn: Complex  #: (N, 3, 3) open-circuit voltage below per voltage above
    loose_from: Int  #: (B + 1,) edge k has the modes ``loose_from[k]`` to ``loose_from[k + 1]``
    loose: Real  #: (M, 3) the modes
    lifted: bool  #: the source's neutral is not solidly earthed
    neutral_y_s: complex  #: what stands between them; 0 where there is nothing
    carried: NDArray[np.bool_]  #: (B, C) the edge is part of the chain that the chord closes
    in_loop: NDArray[np.bool_]  #: (B,) of any such chain
    fork: Int  #: (C,)
    tail: Int  #: (C,)
    chord_y_s: Complex  #: (C, 3, 3) inverse of the chord's impedance, in the phases it has
    alone: NDArray[np.bool_]  #: (C, C) the identity: each chord by itself
    passed: Int  #: (B,) the leap that passes this node by; -1: none
    leap: Int  #: (B,) the leap that ends at this node; -1: none
    twigs: int  #: the first leaps, which end nowhere: nothing hangs on what they pass by
    leap_from: Int  #: (Q,) node above each leap
    leap_chain: Complex  #: (Q, 3, 3, 3) T, Z, Y: V is T V_above - Z I at its end node, I what flows
    #: into that; T' I + Y V_above flows in above; of a twig Y alone counts
    region_from: Int  #: (Q + 1,) leap q has the nodes ``region_from[q]`` to ``region_from[q + 1]``
    region_node: Int  #: those it passes by and the one that it ends at, children before parents
    shunt_s: Complex  #: (B, 3, 3) fixed shunts on each node: capacitors, charging, windings
    unit_node: Int  #: (U,)
    unit_v: Real  #: (U,) nominal volts, phase to earth
    unit_zh_ohm: Complex  #: (U,)
    unit_zl_ohm: Complex  #: (U,)
    unit_y0_s: Complex  #: (U,) zero-sequence magnetizing admittance of a Yg/Yg unit
    unit_ym_s: Complex  #: (U,) magnetizing admittance
    unit_plain: NDArray[np.bool_]  #: (U,) neither machines nor magnetizing admittance
    load_unit: Int  #: (L,) -1: a load with branches
    load_y_s: Complex  #: (L,) per winding or branch at nominal voltage
    law: Real  #: (L, 14) what `laws.law_rows` makes of the file's voltage dependence
    law_linear: NDArray[np.bool_]  #: (L,) which is none at all
    branch_first: Int  #: (P + 1,) a branch has the loads ``branch_load[first[p]:first[p + 1]]``
    branch_load: Int  #: a branch is all that lies across the same voltage
    branch_node: Int  #: (P,)
    branch_from: Int  #: (P,) phase
    branch_to: Int  #: (P,) phase, -1: earth
    branch_v: Real  #: (P,) nominal volts across it
    machine_unit: Int  #: (M,) motors of loads, then DER
    node_v: Real  #: (B,) nominal volts, phase to earth
    v_nominal_v: float  #: phase to earth, of the source
    emf_turn: complex  #: unit phasor of its phase a


class State(NamedTuple):
    """One network state of S scenarios.

    The event node stands on ``edge`` (-1: nowhere) and has two sides, the upper stub p and
    the lower stub q, with ``open_mask`` between them. A machine (motor or DER) takes
    ``machine_w * |V1|**exponent`` in the positive sequence, has the admittances ``y1``, ``y2``
    and ``y0`` besides, and feeds in the positive-sequence current ``j1``.
    """

    emf_pu: Real  #: (S,)
    load_scale: Real  #: (L, S) factor on every load
    exponent: Real  #: (L, S); `BY_LAW` where a load follows its own law
    connection: Int  #: (U, S)
    ratio: Real  #: (R, 3, S) of regulators, lower over upper voltage
    machine_va: Complex  #: (M, S) taken by all three phases at nominal voltage, P + jQ
    machine_exponent: Real  #: (M, S)
    machine_y_s: Complex  #: (M, 3, S) per winding, sequences 0, 1, 2
    machine_j_a: Complex  #: (M, S) current fed in, per winding
    edge: Int  #: (S,)
    share: Real  #: (S,) of the edge's impedance above the event node
    open_mask: Int  #: (S,) bit a: phase a is open
    step_y_s: Complex  #: (3, S) from p to earth, at nominal voltage
    step_exponent: Real  #: (S,) of ``step_y_s``
    between_y_s: Complex  #: (3, S) at p between phases a-b, b-c, c-a
    fallen_y_s: Complex  #: (3, S) from q to earth
    far_node: Int  #: (S,) node of a second step; -1: none
    far_y_s: Complex  #: (3, S) from there to earth
    far_between_y_s: Complex  #: (3, S) there between phases a-b, b-c, c-a


class Probes(NamedTuple):
    """Where to look: voltages of ``v_node``, currents from above into ``i_edge``.

    ``i_below`` is True for the current that leaves the edge at its lower end.
    """

    v_node: Int
    i_edge: Int
    i_below: NDArray[np.bool_]


class Answer(NamedTuple):
    """Phasors of S scenarios, volts to earth and amperes, and how they were found."""

    v: Complex  #: (len(v_node), 3, S)
    i: Complex  #: (len(i_edge), 3, S)
    stub: Complex  #: (2, 3, S) the event node: upper stub p, lower stub q
    winding_v_pu: Real  #: (4 (U + 1) + P, S) of units |V| across three windings and |V1|; of
    #: stub p likewise; of branches |V| across
    machine_v1_v: Complex  #: (M, S) positive-sequence winding voltage
    flags: Int  #: (S,)
    passes: Int  #: (S,)


def unit_voltages(answer: Answer, units: int) -> Real:
    """(U + 1, 4, S) what ``winding_v_pu`` holds of units, and of stub p in the last row."""
    return answer.winding_v_pu[: 4 * (units + 1)].reshape(units + 1, 4, -1)


class Work(NamedTuple):
    """Scratch space of one scenario in a network of B nodes, C chords, U units, P branches.

    A matrix with "per V_fork" in its description stands for every chord c whose chain the edge
    is part of, the companion vector ``..._j`` for the part that no voltage but the machines'
    currents make.
    """

    y: Complex  #: (B, 3, 3) admittance below each node
    f: Complex  #: (B, 3, 3) V_node per V_parent
    h: Complex  #: (B, C, 3, 3) V_node per V_fork
    h_j: Complex  #: (B, 3)
    w: Complex  #: (B, 3, 3) current into each edge's upper end, per voltage there
    x: Complex  #: (B, C, 3, 3) the same per V_fork
    x_j: Complex  #: (B, 3)
    x_low: Complex  #: (B, C, 3, 3) below a transformer or regulator, per V_fork
    y_j: Complex  #: (B, 3) current drawn below each node that depends on no voltage
    v: Complex  #: (B + 1, 3); the last row is the EMF
    g: Complex  #: (U, 3, 3) winding voltage per bus voltage
    g_j: Complex  #: (U, 3)
    unit_y: Complex  #: (U, 3, 3) across the LV windings
    unit_j: Complex  #: (U, 3) fed in there
    event_y: Complex  #: (2, 3, 3) shunts at p and q
    xt: Complex  #: (C, 3, 3) each loop's running X'
    u: Complex  #: (C, C, 3, 3) and U
    u_j: Complex  #: (C, 3)
    chord: Complex  #: (4, C, 3, 3) current into the chord per V_tail, V_fork; back per the same
    here: Complex  #: (3, 3, 3) at a break: W, P, and scratch
    here_j: Complex  #: (2, 3) the companions of X and H
    here_x: Complex  #: (C, 3, 3) X
    here_h: Complex  #: (C, 3, 3) H
    row: Complex  #: (C, 3) scratch
    event: Complex  #: (4, 3, 3) F above the event node, P at it, F below; F of a loose edge
    event_h: Complex  #: (4, C, 3, 3) the H of these
    event_j: Complex  #: (4, 3) their companions
    stub: Complex  #: (2, 3) voltages of p and q
    winding_v_pu: Real  #: (N,) the scenario's ``Answer.winding_v_pu``
    history: Real  #: (3, N) of these: the last pass's, its gaps, and this pass's gaps
    follows: Real  #: (1,) how much solved voltages move with the assumed ones


def workspace(tree: Tree) -> Work:
    """Scratch for a network."""
    nodes, units, chords = tree.parent.size, tree.unit_node.size, tree.tail.size
    windings = 4 * (units + 1) + tree.branch_node.size

    def zeros(*shape: int) -> Complex:
        return np.zeros(shape, np.complex128)

    return Work(
        y=zeros(nodes, 3, 3),
        f=zeros(nodes, 3, 3),
        h=zeros(nodes, chords, 3, 3),
        h_j=zeros(nodes, 3),
        w=zeros(nodes, 3, 3),
        x=zeros(nodes, chords, 3, 3),
        x_j=zeros(nodes, 3),
        x_low=zeros(nodes, chords, 3, 3),
        y_j=zeros(nodes, 3),
        v=zeros(nodes + 1, 3),
        g=zeros(units, 3, 3),
        g_j=zeros(units, 3),
        unit_y=zeros(units, 3, 3),
        unit_j=zeros(units, 3),
        event_y=zeros(2, 3, 3),
        xt=zeros(chords, 3, 3),
        u=zeros(chords, chords, 3, 3),
        u_j=zeros(chords, 3),
        chord=zeros(4, chords, 3, 3),
        here=zeros(3, 3, 3),
        here_j=zeros(2, 3),
        here_x=zeros(chords, 3, 3),
        here_h=zeros(chords, 3, 3),
        row=zeros(chords, 3),
        event=zeros(4, 3, 3),
        event_h=zeros(4, chords, 3, 3),
        event_j=zeros(4, 3),
        stub=zeros(2, 3),
        winding_v_pu=np.zeros(windings),
        history=np.zeros((3, windings)),
        follows=np.zeros(1),
    )
