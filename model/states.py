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
    in_loop: NDArray[np.bool_]  #: (B,) the node is on the chain that the chord closes
    fork: int  #: -1 where there is no loop
    tail: int  #: -1 where there is no loop
    unit_node: Int  #: (U,)
    unit_zh_ohm: Complex  #: (U,)
    unit_zl_ohm: Complex  #: (U,)
    unit_y0_s: Complex  #: (U,)
    load_unit: Int  #: (L,)
    load_y_s: Complex  #: (L,) per winding at nominal voltage
    v_nominal_v: float  #: phase to earth


class State(NamedTuple):
    """One network state of S scenarios. ``edge`` is -1 where nothing stands on an edge."""

    emf_pu: Real  #: (S,)
    load_scale: Real  #: (L, S) factor on every load
    exponent: Real  #: (L, S)
    connection: Int  #: (U, S)
    edge: Int  #: (S,)
    share: Real  #: (S,) of the edge's impedance above the event node
    open_mask: Int  #: (S,) bit a: phase a is open
    step_y_s: Complex  #: (3, S) load at the event node, at nominal voltage
    step_exponent: Real  #: (S,)


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
    unit_v_pu: Real  #: (U + 1, 3, S) |V| across each LV winding; last row the event node
    flags: Int  #: (S,)
    passes: Int  #: (S,)


class Work(NamedTuple):
    """Scratch space of one scenario in a network of B nodes and U units."""

    y: Complex  #: (B, 3, 3) admittance below each node
    f: Complex  #: (B, 3, 3) V_node per V_parent
    h: Complex  #: (B, 3, 3) V_node per V_fork
    w: Complex  #: (B + 1, 3, 3) current into each edge's upper end, per voltage there
    x: Complex  #: (B + 1, 3, 3) the same per V_fork
    v: Complex  #: (B + 1, 3); the last row is the EMF
    g: Complex  #: (U, 3, 3) winding voltage per bus voltage
    unit_y: Complex  #: (U, 3)
    step_y: Complex  #: (1, 3)
    fill: Complex  #: (2, 3, 3) the loop's running X' and U
    chord_end: Complex  #: (2, 3, 3) current from the fork into the chord, per V_tail and V_fork
    here: Complex  #: (7, 3, 3) a break's W, X, X', U, P, H, and scratch
    event: Complex  #: (6, 3, 3) F and H above the event node, P and H at it, F and H below
    stub: Complex  #: (2, 3) voltages of p and q
    i_up: Complex  #: (B + 1, 3) current into each edge's upper end
    i_low: Complex  #: (B + 1, 3) current out of its lower end


def workspace(nodes: int, units: int) -> Work:
    """Scratch for a network of ``nodes`` nodes and ``units`` units."""

    def zeros(*shape: int) -> Complex:
        return np.zeros(shape, np.complex128)

    return Work(
        y=zeros(nodes, 3, 3),
        f=zeros(nodes, 3, 3),
        h=zeros(nodes, 3, 3),
        w=zeros(nodes + 1, 3, 3),
        x=zeros(nodes + 1, 3, 3),
        v=zeros(nodes + 1, 3),
        g=zeros(units, 3, 3),
        unit_y=zeros(units, 3),
        step_y=zeros(1, 3),
        fill=zeros(2, 3, 3),
        chord_end=zeros(2, 3, 3),
        here=zeros(7, 3, 3),
        event=zeros(6, 3, 3),
        stub=zeros(2, 3),
        i_up=zeros(nodes + 1, 3),
        i_low=zeros(nodes + 1, 3),
    )
