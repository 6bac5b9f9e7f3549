"""A feeder compiled for the solver: a tree of nodes, units on nodes, and what lies where.

Buses and tees become nodes, pieces of line between them become edges. Lines are cut
only where something stands: a tee of a transformer or load. An event may then stand
anywhere on an edge. Every closed loop has one edge that is its chord.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .buses import bus_volts
from .edges import hang_edges
from .laws import law_rows, own_exponents
from .machines import Machines, machines_of
from .neutrals import bus_neutrals
from .parts import Capacitor, Feeder, Load, Source
from .phases import phase_mask
from .pieces import ALL_PHASES, Piece, check_fed, detached_end, node_name, pieces_of, place_of, span
from .states import Tree
from .symmetrical import phase_matrix
from .units import (
    CONNECTIONS,
    Nodes,
    Unit,
    assumed_connection,
    capacitor_shunts,
    connection_of,
    loads_of,
    regulator_arrays,
    regulator_references,
    unit_arrays,
    units_of,
)

__all__ = [
    "CONNECTIONS",
    "Network",
    "Piece",
    "assumed_connection",
    "compile_network",
    "detached_end",
    "locate",
]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Network:
    """The compiled feeder. Edge k ends at node k; chords, if any, are the last edges."""

    tree: Tree
    nodes: tuple[str, ...]  #: names: buses, and tees as LINE:FRACTION
    pieces: tuple[Piece | None, ...]  #: of each edge; None: the source impedance
    upward: NDArray[np.bool_]  #: (edges,) the edge's upper end is the piece's first end
    length_km: NDArray[np.float64]  #: (edges,)
    units: tuple[str, ...]  #: transformers, then loads with motors and DER that have none
    loads: tuple[str, ...]
    connection: NDArray[np.int64]  #: (U,) as in the file
    exponent: NDArray[np.float64]  #: (L,) as in the file; `BY_LAW`: it says more than that
    machines: Machines
    regulators: tuple[str, ...]
    ratio: NDArray[np.float64]  #: (R, 3) lower over upper voltage, as in the file
    ratio_step: NDArray[np.float64]  #: (R,) what one tap adds to the voltage, lower over upper
    ratio_most: NDArray[np.int64]  #: (R,) taps to either side of neutral
    ratio_upward: NDArray[np.bool_]  #: (R,) the regulator's from-end is the upper one
    ratio_phases: NDArray[np.int64]  #: (R,) bit mask of the phases that have a unit
    ratio_gang: NDArray[np.bool_]  #: (R,) they step together
    equipped: NDArray[np.bool_]  #: (edges,) something is connected below the edge
    emf_pu: float
    three_wire: bool  #: at the source
    neutral: NDArray[np.bool_]  #: (B,) a neutral goes with the lines there

    @property
    def chords(self) -> int:
        """How many closed loops there are; the chord of each is one of the last edges."""
        return self.tree.tail.size

    @property
    def node_phases(self) -> NDArray[np.int64]:
        """(B,) bit mask of the phases at each node."""
        return self.tree.node_phases

    @property
    def node_v(self) -> NDArray[np.float64]:
        """(B,) nominal volts of each node, phase to earth."""
        return self.tree.node_v

    @property
    def load_node(self) -> NDArray[np.int64]:
        """(L,) where each load hangs, behind its transformer or directly."""
        tree = self.tree
        nodes = np.empty(tree.load_unit.size, np.int64)
        behind = tree.load_unit >= 0
        nodes[behind] = tree.unit_node[tree.load_unit[behind]]
        nodes[tree.branch_load] = np.repeat(tree.branch_node, np.diff(tree.branch_first))
        return nodes

    def node(self, name: str) -> int:
        """Index of the node called ``name``."""
        return self.nodes.index(name)

    def edges_of(self, line: str) -> list[int]:
        """Edges of ``line``, from its from-end to its to-end."""
        own = [k for k, piece in enumerate(self.pieces) if piece and piece.line == line]
        return sorted(own, key=lambda k: _start(self.pieces[k]))

    def below(self, edge: int) -> NDArray[np.bool_]:
        """(B,) the nodes that hang below ``edge``; none below a chord."""
        hanging = np.zeros(len(self.nodes), np.bool_)
        if edge < hanging.size:
            hanging[edge] = True
            for k in range(edge + 1, hanging.size):
                hanging[k] = hanging[self.tree.parent[k]]
        return hanging

    def line_fraction(self, edge: int, share: float) -> tuple[str, float]:
        """Line and fraction from its from-end of a place given as edge and share from above."""
        piece = self.pieces[edge]
        if piece is None or piece.line is None:
            raise ValueError(f"edge {edge} is no line")
        along = share if self.upward[edge] else 1.0 - share
        return piece.line, piece.start + along * (piece.stop - piece.start)


def _start(piece: Piece | None) -> float:
    return piece.start if piece else 0.0


def locate(network: Network, line: str, fraction: float) -> tuple[int, float]:
    """Edge and share from its upper end of the place at ``fraction`` of ``line``."""
    edges = network.edges_of(line)
    stops = [network.pieces[k].stop for k in edges]  # type: ignore[union-attr]
    edge = edges[min(int(np.searchsorted(stops, fraction, side="left")), len(edges) - 1)]
    piece = network.pieces[edge]
    assert piece is not None
    along = (fraction - piece.start) / (piece.stop - piece.start)
    return edge, float(along if network.upward[edge] else 1.0 - along)


def compile_network(
    feeder: Feeder,
    closed: frozenset[str] | None = None,
    opened: frozenset[str] = frozenset(),
    *,
    motors: bool = False,
) -> Network:
    """Compile ``feeder`` in one state of its switches.

    Parameters
    ----------
    feeder : Feeder
    closed : frozenset of str, optional
        The switches that are closed, all others being open; by default as the file says.
    opened : frozenset of str
        Measuring points whose recloser is open: their lines do not reach the bus there.
    motors : bool
        Give every three-phase load a motor, and not only those that have one in the file.

    Raises
    ------
    InputError
        For a network that the ladder cannot carry: a loop without a line at its fork, windings
        that leave more than one voltage undefined, or a part that nothing feeds.
    """
    if closed is None:
        closed = frozenset(s.name for s in feeder.switches if s.closed)
    pieces = pieces_of(feeder, closed, opened)
    spanned = span(feeder, pieces)
    order = spanned.order
    check_fed(feeder, pieces, order)
    below = [pieces[spanned.parent_piece[name]] for name in order[1:]]
    edge_pieces = [None, *below, *spanned.chords]
    index = {name: k for k, name in enumerate(order)}
    units = units_of(feeder, motors)
    edges = hang_edges(feeder, edge_pieces, spanned, _touched(feeder, units, order))
    buses = _buses_of(feeder, pieces, order)
    nodes = Nodes(row=index, volts=_at_nodes(bus_volts(feeder), buses))
    machines = machines_of(feeder, units, motors)
    unit_node = np.array([index[node_name(feeder, place_of(u))] for u in units], np.int64)
    unit_part = unit_arrays(feeder, units, machines, nodes.volts[unit_node])
    source, neutral_y = feeder.source, _neutral_y(feeder.source)
    shunts = capacitor_shunts(feeder, nodes) + edges.shunt_s
    law, linear = law_rows(feeder)
    angle = np.deg2rad(source.angle_deg)
    tree = Tree(
        **edges.fields,
        reference=regulator_references(feeder),
        lifted=source.neutral == "isolated" or neutral_y != 0.0,
        neutral_y_s=neutral_y,
        shunt_s=shunts,
        unit_node=unit_node,
        **unit_part,
        **loads_of(feeder, units, unit_part["unit_v"], nodes),
        law=law,
        law_linear=linear,
        machine_unit=machines.unit,
        node_v=nodes.volts,
        v_nominal_v=feeder.source.v_phase_v,
        emf_turn=complex(np.cos(angle), np.sin(angle)),
    )
    tree.z_ohm[0] = phase_matrix(source.z0_ohm, source.z1_ohm, source.z2_ohm)
    assumed = assumed_connection(feeder)
    return Network(
        tree=tree,
        nodes=tuple(order),
        pieces=tuple(edge_pieces),
        upward=edges.upward,
        length_km=np.array([p.length_km if p else 0.0 for p in edge_pieces]),
        units=tuple(unit.name for unit in units),
        loads=tuple(load.name for load in feeder.loads),
        connection=np.array([connection_of(unit, assumed) for unit in units], np.int64),
        exponent=own_exponents(feeder),
        machines=machines,
        **regulator_arrays(feeder, edge_pieces, edges.upward),
        equipped=_equipped(tree),
        emf_pu=feeder.source.emf_pu,
        three_wire=feeder.source.wires == 3,
        neutral=_at_nodes(bus_neutrals(feeder), buses).astype(np.bool_),
    )


def _touched(feeder: Feeder, units: list[Unit], order: list[str]) -> NDArray[np.int64]:
    """(B,) bit mask of the phases of each node that something hangs on."""
    masks = dict.fromkeys(order, 0)
    for unit in units:
        masks[node_name(feeder, place_of(unit))] |= ALL_PHASES
    hanging: list[Load | Capacitor] = [*feeder.loads, *feeder.capacitors]
    for part in hanging:
        if part.place is not None:
            masks[node_name(feeder, part.place)] |= phase_mask(part.phases)
    return np.array([masks[name] for name in order], np.int64)


def _neutral_y(source: Source) -> complex:
    """Admittance between the source's neutral and earth; 0 where it is isolated, or solid."""
    extreme = source.neutral == "isolated" or source.neutral_ohm == 0.0
    return 0j if extreme else 1.0 / complex(source.neutral_ohm)


def _buses_of(feeder: Feeder, pieces: list[Piece], order: list[str]) -> list[str]:
    """The bus of every node, and along a line that of its from-end."""
    bus_of = {line.name: line.from_bus for line in feeder.lines}
    own: dict[str, str] = {}
    for piece in pieces:
        for end in piece.ends:
            own[end] = end if piece.line is None or ":" not in end else bus_of[piece.line]
    return [own.get(name, name) for name in order]


def _at_nodes(of_bus: Mapping[str, float], buses: list[str]) -> NDArray[np.float64]:
    """(B,) what holds at the bus of each node."""
    return np.array([of_bus[name] for name in buses], np.float64)


def _equipped(tree: Tree) -> NDArray[np.bool_]:
    """Per edge: something hangs below it. A loop's edges are fed from both ends, so always."""
    count = tree.parent.size
    below = np.zeros(count + tree.tail.size, np.bool_)
    below[tree.unit_node] = True
    below[tree.branch_node] = True
    for k in range(count - 1, 0, -1):
        below[tree.parent[k]] |= below[k]
    below[:count] |= tree.in_loop
    below[count:] = True
    return below
