"""A feeder compiled for the solver: a tree of nodes, units on nodes, and what lies where.

Buses and tees become nodes, pieces of line between them become edges. Lines are cut
only where something stands: a tee of a transformer or load. An event may then stand
anywhere on an edge. With a tie closed, one edge at the fork of the loop is the chord.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .machines import Machines, machines_of
from .parts import Feeder, Source
from .pieces import NO_PHASES, Piece, check_fed, detached_end, node_name, pieces_of, place_of, span
from .states import Tree
from .symmetrical import phase_matrix
from .units import (
    CONNECTIONS,
    assumed_connection,
    capacitor_shunts,
    connection_of,
    loads_of,
    regulator_arrays,
    regulator_rows,
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
    """The compiled feeder. Edge k ends at node k; the chord, if any, is edge B."""

    tree: Tree
    nodes: tuple[str, ...]  #: names: buses, and tees as LINE:FRACTION
    pieces: tuple[Piece | None, ...]  #: of each edge; None: the source impedance
    upward: NDArray[np.bool_]  #: (edges,) the edge's upper end is the piece's first end
    length_km: NDArray[np.float64]  #: (edges,)
    units: tuple[str, ...]  #: transformers, then loads and DER that have none
    loads: tuple[str, ...]
    connection: NDArray[np.int64]  #: (U,) as in the file
    exponent: NDArray[np.float64]  #: (L,) as in the file
    machines: Machines
    regulators: tuple[str, ...]
    ratio: NDArray[np.float64]  #: (R, 3) lower over upper voltage, as in the file
    ratio_step: NDArray[np.float64]  #: (R,) what one tap adds to the voltage, lower over upper
    ratio_most: NDArray[np.int64]  #: (R,) taps to either side of neutral
    ratio_upward: NDArray[np.bool_]  #: (R,) the regulator's from-end is the upper one
    equipped: NDArray[np.bool_]  #: (edges,) something is connected below the edge
    emf_pu: float
    three_wire: bool

    @property
    def has_chord(self) -> bool:
        """Whether a closed loop runs over the last edge."""
        return self.tree.tail >= 0

    def node(self, name: str) -> int:
        """Index of the node called ``name``."""
        return self.nodes.index(name)

    def edges_of(self, line: str) -> list[int]:
        """Edges of ``line``, from its from-end to its to-end."""
        own = [k for k, piece in enumerate(self.pieces) if piece and piece.line == line]
        return sorted(own, key=lambda k: _start(self.pieces[k]))

    def below(self, edge: int) -> NDArray[np.bool_]:
        """(B,) the nodes that hang below ``edge``; none below the chord."""
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
        Give every load a motor, and not only those that have one in the file.

    Raises
    ------
    InputError
        For a network that the ladder cannot carry: more than one loop, a loop without
        impedance at its fork, or a part that nothing feeds.
    """
    if closed is None:
        closed = frozenset(s.name for s in feeder.switches if s.closed)
    pieces = pieces_of(feeder, closed, opened)
    order, parent_piece, chord = span(feeder, pieces)
    check_fed(feeder, pieces, order)
    index = {name: k for k, name in enumerate(order)}
    count = len(order)
    edge_pieces: list[Piece | None] = [None, *(pieces[parent_piece[n]] for n in order[1:])]
    parent, upward = _hang(edge_pieces, order, index)
    in_loop = np.zeros(count, np.bool_)
    fork = tail = -1
    if chord is not None:
        ends = [index[name] for name in chord.ends]
        fork, tail = min(ends), max(ends)
        upward[count] = chord.ends[0] == order[tail]
        k = tail
        while k != fork:
            in_loop[k] = True
            k = int(parent[k])
    edge_pieces.append(chord)
    units = units_of(feeder)
    machines = machines_of(feeder, units, motors)
    load_unit, load_y = loads_of(feeder, units)
    source, neutral_y = feeder.source, _neutral_y(feeder.source)
    source_z = phase_matrix(source.z0_ohm, source.z1_ohm, source.z2_ohm)
    tree = Tree(
        parent=parent,
        z_ohm=np.array([source_z, *_of_pieces(edge_pieces, "z_ohm")]),
        end_y_s=np.array([NO_PHASES, *_of_pieces(edge_pieces, "end_y_s")]),
        charged=any(line.c1_nf_per_km or line.c0_nf_per_km for line in feeder.lines),
        regulator=regulator_rows(feeder, edge_pieces),
        lifted=source.neutral == "isolated" or neutral_y != 0.0,
        neutral_y_s=neutral_y,
        in_loop=in_loop,
        fork=fork,
        tail=tail,
        shunt_s=capacitor_shunts(feeder, index),
        unit_node=np.array([index[node_name(feeder, place_of(u))] for u in units], np.int64),
        **unit_arrays(feeder, units, machines),
        load_unit=load_unit,
        load_y_s=load_y,
        machine_unit=machines.unit,
        v_nominal_v=feeder.source.v_phase_v,
    )
    kept = count + 1 if chord is not None else count
    return Network(
        tree=tree,
        nodes=tuple(order),
        pieces=tuple(edge_pieces[:kept]),
        upward=upward[:kept],
        length_km=np.array([p.length_km if p else 0.0 for p in edge_pieces[:kept]]),
        units=tuple(unit.name for unit in units),
        loads=tuple(load.name for load in feeder.loads),
        connection=np.array([connection_of(feeder, unit) for unit in units], np.int64),
        exponent=np.array([load.exponent for load in feeder.loads], np.float64),
        machines=machines,
        **regulator_arrays(feeder, edge_pieces, upward),
        equipped=_equipped(tree)[:kept],
        emf_pu=feeder.source.emf_pu,
        three_wire=feeder.source.wires == 3,
    )


def _neutral_y(source: Source) -> complex:
    """Admittance between the source's neutral and earth; 0 where it is isolated, or solid."""
    extreme = source.neutral == "isolated" or source.neutral_ohm == 0.0
    return 0j if extreme else 1.0 / complex(source.neutral_ohm)


def _hang(
    edge_pieces: list[Piece | None], order: list[str], index: dict[str, int]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Each node's parent, and whether its piece leads downwards; one place more for a chord."""
    parent = np.full(len(order), -1, np.int64)
    upward = np.ones(len(order) + 1, np.bool_)
    for k, piece in enumerate(edge_pieces):
        if piece is not None:
            upward[k] = piece.ends[1] == order[k]
            parent[k] = index[piece.ends[0] if upward[k] else piece.ends[1]]
    return parent, upward


def _of_pieces(pieces: list[Piece | None], name: str) -> list[NDArray[np.complex128]]:
    """A matrix of every edge but the source's; zero where there is no chord."""
    return [NO_PHASES if piece is None else getattr(piece, name) for piece in pieces[1:]]


def _equipped(tree: Tree) -> NDArray[np.bool_]:
    """Per edge: a unit hangs below it. A loop's edges are fed from both ends, so always."""
    count = tree.parent.size
    below = np.zeros(count + 1, np.bool_)
    below[tree.unit_node] = True
    for k in range(count - 1, 0, -1):
        below[tree.parent[k]] |= below[k]
    below[:count] |= tree.in_loop
    below[count] = True
    return below
