"""The records that pass between the compiler of networks, the ladder and its callers.

Named tuples of arrays, because compiled code takes them as they are. The scenario axis
is last.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["NOT_CONVERGED", "Answer", "Probes", "State", "Tree", "Work", "workspace"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Int = NDArray[np.int64]

NOT_CONVERGED = 4  #: flag: voltage-dependent loads did not settle


class Tree(NamedTuple):
    """A compiled network of B nodes: what ``solve_block`` needs to know about it.

    Node k hangs on ``parent[k]`` by edge k; node 0 is the source bus, its edge the source
    impedance. Parents come before children. Edge B is the chord, from ``tail`` to ``fork``.
    """

    parent: Int  #: (B,); -1 for node 0
    z_ohm: Complex  #: (B + 1, 3, 3)
    end_y_s: Complex  #: (B + 1, 3, 3) charging at each end of the edge, half of all it has
    charged: bool  #: any edge has charging
    regulator: Int  #: (B + 1,) row of ``State.ratio`` at the edge's upper end; -1: none
    lifted: bool  #: the source's neutral is not solidly earthed
    neutral_y_s: complex  #: what stands between them; 0 where there is nothing
    in_loop: NDArray[np.bool_]  #: (B,) the node is on the chain that the chord closes
    fork: int  #: -1 where there is no loop
    tail: int  #: -1 where there is no loop
    shunt_s: Complex  #: (B, 3, 3) capacitors on each node
    unit_node: Int  #: (U,)
    unit_zh_ohm: Complex  #: (U,)
    unit_zl_ohm: Complex  #: (U,)
    unit_y0_s: Complex  #: (U,) zero-sequence magnetizing admittance of a Yg/Yg unit
    unit_ym_s: Complex  #: (U,) magnetizing admittance
    unit_plain: NDArray[np.bool_]  #: (U,) neither machines nor magnetizing admittance
    load_unit: Int  #: (L,)
    load_y_s: Complex  #: (L,) per winding at nominal voltage
    machine_unit: Int  #: (M,) motors of loads, then DER
    v_nominal_v: float  #: phase to earth


class State(NamedTuple):
    """One network state of S scenarios.

    The event node stands on ``edge`` (-1: nowhere) and has two sides, the upper stub p and
    the lower stub q, with ``open_mask`` between them. A machine (motor or DER) takes
    ``machine_w * |V1|**exponent`` in the positive sequence, has the admittances ``y1``, ``y2``
    and ``y0`` besides, and feeds in the positive-sequence current ``j1``.
    """

    emf_pu: Real  #: (S,)
    load_scale: Real  #: (L, S) factor on every load
    exponent: Real  #: (L, S)
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
    unit_v_pu: Real  #: (U + 1, 4, S) |V| across each LV winding, then |V1|; last row stub p
    machine_v1_v: Complex  #: (M, S) positive-sequence winding voltage
    flags: Int  #: (S,)
    passes: Int  #: (S,)


class Work(NamedTuple):
    """Scratch space of one scenario in a network of B nodes, U units and M machines.

    Row B is the chord, where there is one. A matrix with "per V_fork" in its description has
    a companion vector ``..._j``: the part that neither voltage but the machines' currents make.
    """

    y: Complex  #: (B, 3, 3) admittance below each node
    f: Complex  #: (B, 3, 3) V_node per V_parent
    h: Complex  #: (B, 3, 3) V_node per V_fork
    h_j: Complex  #: (B, 3)
    w: Complex  #: (B + 1, 3, 3) current into each edge's upper end, per voltage there
    x: Complex  #: (B + 1, 3, 3) the same per V_fork
    x_j: Complex  #: (B + 1, 3)
    y_j: Complex  #: (B, 3) current drawn below each node that depends on no voltage
    v: Complex  #: (B + 1, 3); the last row is the EMF
    g: Complex  #: (U, 3, 3) winding voltage per bus voltage
    g_j: Complex  #: (U, 3)
    unit_y: Complex  #: (U, 3, 3) across the LV windings
    unit_j: Complex  #: (U, 3) fed in there
    event_y: Complex  #: (2, 3, 3) shunts at p and q
    fill: Complex  #: (2, 3, 3) the loop's running X' and U
    fill_j: Complex  #: (1, 3) of U
    chord_end: Complex  #: (2, 3, 3) current from the fork into the chord, per V_tail and V_fork
    here: Complex  #: (7, 3, 3) a break's W, X, X', U, P, H, and scratch
    here_j: Complex  #: (3, 3) the companions of X, U and H
    event: Complex  #: (6, 3, 3) F and H above the event node, P and H at it, F and H below
    event_j: Complex  #: (3, 3) the companions of the three H
    stub: Complex  #: (2, 3) voltages of p and q
    i_up: Complex  #: (B + 1, 3) current into each edge's upper end
    i_low: Complex  #: (B + 1, 3) current out of its lower end
    unit_v_pu: Real  #: (U + 1, 4) the scenario's ``Answer.unit_v_pu``
    history: Real  #: (3, U + 1, 4) of these: the last pass's, its gaps, and this pass's gaps


def workspace(tree: Tree) -> Work:
    """Scratch for a network."""
    nodes, units = tree.parent.size, tree.unit_node.size

    def zeros(*shape: int) -> Complex:
        return np.zeros(shape, np.complex128)

    return Work(
        y=zeros(nodes, 3, 3),
        f=zeros(nodes, 3, 3),
        h=zeros(nodes, 3, 3),
        h_j=zeros(nodes, 3),
        w=zeros(nodes + 1, 3, 3),
        x=zeros(nodes + 1, 3, 3),
        x_j=zeros(nodes + 1, 3),
        y_j=zeros(nodes, 3),
        v=zeros(nodes + 1, 3),
        g=zeros(units, 3, 3),
        g_j=zeros(units, 3),
        unit_y=zeros(units, 3, 3),
        unit_j=zeros(units, 3),
        event_y=zeros(2, 3, 3),
        fill=zeros(2, 3, 3),
        fill_j=zeros(1, 3),
        chord_end=zeros(2, 3, 3),
        here=zeros(7, 3, 3),
        here_j=zeros(3, 3),
        event=zeros(6, 3, 3),
        event_j=zeros(3, 3),
        stub=zeros(2, 3),
        i_up=zeros(nodes + 1, 3),
        i_low=zeros(nodes + 1, 3),
        unit_v_pu=np.zeros((units + 1, 4)),
        history=np.zeros((3, units + 1, 4)),
    )
