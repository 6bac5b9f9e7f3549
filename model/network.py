"""A feeder compiled for the solver: a tree of nodes, units on nodes, and what lies where.

Buses and tees become nodes, pieces of line between them become edges. Lines are cut
only where something stands: a tee of a transformer or load. An event may then stand
anywhere on an edge. With a tie closed, one edge at the fork of the loop is the chord.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .bank import D_YG, YG_D, YG_YG
from .errors import InputError
from .parts import Feeder, Line, Load, Place, Transformer
from .states import Tree
from .symmetrical import phase_matrix

__all__ = ["CONNECTIONS", "Network", "Piece", "compile_network", "locate"]

CONNECTIONS: dict[str, int] = {"Yg/Yg": YG_YG, "D/Yg": D_YG, "Yg/D": YG_D}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Piece:
    """A stretch of line between two nodes, or a closed switch (``line`` None)."""

    line: str | None
    ends: tuple[str, str]  #: node names, in the line's direction
    start: float  #: fraction of the line at the first end
    stop: float  #: and at the second
    length_km: float
    z_ohm: NDArray[np.complex128]  #: (3, 3)

    @property
    def key(self) -> tuple[str | None, tuple[str, str]]:
        """What tells this piece from all others, in whichever state the network is."""
        return self.line, self.ends


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Network:
    """The compiled feeder. Edge k ends at node k; the chord, if any, is edge B."""

    tree: Tree
    nodes: tuple[str, ...]  #: names: buses, and tees as LINE:FRACTION
    pieces: tuple[Piece | None, ...]  #: of each edge; None: the source impedance
    upward: NDArray[np.bool_]  #: (edges,) the edge's upper end is the piece's first end
    length_km: NDArray[np.float64]  #: (edges,)
    units: tuple[str, ...]  #: transformers, then direct loads
    loads: tuple[str, ...]
    connection: NDArray[np.int64]  #: (U,) as in the file
    exponent: NDArray[np.float64]  #: (L,) as in the file
    equipped: NDArray[np.bool_]  #: (edges,) something is connected below the edge
    emf_pu: float

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


def compile_network(feeder: Feeder, closed: frozenset[str] | None = None) -> Network:
    """Compile ``feeder`` with the switches named in ``closed`` closed and all others open.

    ``closed`` None: as the file says. Raises InputError for a network that the ladder
    cannot carry: more than one loop, or a loop without impedance at its fork.
    """
    if closed is None:
        closed = frozenset(s.name for s in feeder.switches if s.closed)
    pieces = _pieces(feeder, closed)
    order, parent_piece, chord = _span(feeder, pieces)
    index = {name: k for k, name in enumerate(order)}
    count = len(order)
    edge_pieces: list[Piece | None] = [None, *(pieces[parent_piece[n]] for n in order[1:])]
    parent = np.full(count, -1, np.int64)
    upward = np.ones(count + 1, np.bool_)
    for k, piece in enumerate(edge_pieces):
        if piece is not None:
            upward[k] = piece.ends[1] == order[k]
            parent[k] = index[piece.ends[0] if upward[k] else piece.ends[1]]
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
    units, placed, unit_arrays = _units(feeder, index)
    load_unit, load_y = _loads(feeder, units)
    source = feeder.source
    z = [phase_matrix(source.z0_ohm, source.z1_ohm, source.z2_ohm)]
    z += [p.z_ohm if p else np.zeros((3, 3), np.complex128) for p in edge_pieces[1:]]
    tree = Tree(
        parent=parent,
        z_ohm=np.array(z),
        in_loop=in_loop,
        fork=fork,
        tail=tail,
        unit_node=placed,
        unit_zh_ohm=unit_arrays[0],
        unit_zl_ohm=unit_arrays[0],
        unit_y0_s=unit_arrays[1],
        load_unit=load_unit,
        load_y_s=load_y,
        v_nominal_v=source.v_phase_v,
    )
    kept = count + 1 if chord is not None else count
    return Network(
        tree=tree,
        nodes=tuple(order),
        pieces=tuple(edge_pieces[:kept]),
        upward=upward[:kept],
        length_km=np.array([p.length_km if p else 0.0 for p in edge_pieces[:kept]]),
        units=units,
        loads=tuple(load.name for load in feeder.loads),
        connection=_connections(feeder),
        exponent=np.array([load.exponent for load in feeder.loads], np.float64),
        equipped=_equipped(tree)[:kept],
        emf_pu=source.emf_pu,
    )


def _tee(line: str, fraction: float) -> str:
    # no name may hold a colon, so no bus is called like a tee
    return f"{line}:{fraction!r}"


def _node_name(feeder: Feeder, place: Place) -> str:
    if place.bus is not None:
        return place.bus
    assert place.line is not None
    assert place.at is not None
    line = next(item for item in feeder.lines if item.name == place.line)
    if place.at == 0.0:
        return line.from_bus
    if place.at == 1.0:
        return line.to_bus
    return _tee(place.line, place.at)


def _places(feeder: Feeder) -> list[Place]:
    own = [load.place for load in feeder.loads if load.place is not None]
    return [t.place for t in feeder.transformers] + own


def _pieces(feeder: Feeder, closed: frozenset[str]) -> list[Piece]:
    cuts: dict[str, set[float]] = defaultdict(set)
    for place in _places(feeder):
        if place.line is not None and place.at is not None:
            cuts[place.line].add(place.at)
    pieces = [p for line in feeder.lines for p in _cut(line, cuts[line.name])]
    for switch in feeder.switches:
        if switch.name in closed:
            pieces.append(
                Piece(
                    line=None,
                    ends=(switch.from_bus, switch.to_bus),
                    start=0.0,
                    stop=1.0,
                    length_km=0.0,
                    z_ohm=np.zeros((3, 3), np.complex128),
                )
            )
    return pieces


def _cut(line: Line, at: set[float]) -> list[Piece]:
    fractions = sorted({0.0, 1.0, *at})
    names = [line.from_bus, *(_tee(line.name, x) for x in fractions[1:-1]), line.to_bus]
    whole = line.length_km * phase_matrix(
        line.z0_ohm_per_km, line.z1_ohm_per_km, line.z1_ohm_per_km
    )
    return [
        Piece(
            line=line.name,
            ends=(names[n], names[n + 1]),
            start=fractions[n],
            stop=fractions[n + 1],
            length_km=line.length_km * (fractions[n + 1] - fractions[n]),
            z_ohm=whole * (fractions[n + 1] - fractions[n]),
        )
        for n in range(len(names) - 1)
    ]


def _span(feeder: Feeder, pieces: list[Piece]) -> tuple[list[str], dict[str, int], Piece | None]:
    """Node names in depth-first order, each node's piece to its parent, and the chord."""
    order, parent_piece, left = _walk(feeder.source.bus, pieces, set())
    if not left:
        return order, parent_piece, None
    if len(left) > 1:
        raise InputError.single(
            feeder.name, "switches", f"{len(left)} loops", "must close at most one loop"
        )
    # depth-first, so the one piece left over joins a node to its own ancestor: the fork.
    # Either of the loop's two pieces at the fork may be the chord; it must have impedance.
    back = pieces[left[0]]
    fork = min(back.ends, key=order.index)
    tail = max(back.ends, key=order.index)
    chain = [tail]
    while (up := _other(pieces[parent_piece[chain[-1]]], chain[-1])) != fork:
        chain.append(up)
    first = parent_piece[chain[-1]]
    if np.abs(back.z_ohm).max() == 0.0:
        if np.abs(pieces[first].z_ohm).max() == 0.0:
            raise InputError.single(
                feeder.name,
                f"switches: the loop at bus '{fork}'",
                "two switches",
                "must leave the bus by a line on one side at least",
            )
        order, parent_piece, _ = _walk(feeder.source.bus, pieces, {first})
        return order, parent_piece, pieces[first]
    return order, parent_piece, back


def _other(piece: Piece, end: str) -> str:
    return piece.ends[0] if piece.ends[1] == end else piece.ends[1]


def _walk(
    root: str, pieces: list[Piece], without: set[int]
) -> tuple[list[str], dict[str, int], list[int]]:
    """Depth-first walk; returns order, parent pieces, and pieces to known nodes left over."""
    touching: dict[str, list[int]] = defaultdict(list)
    for n, piece in enumerate(pieces):
        if n not in without:
            for end in piece.ends:
                touching[end].append(n)
    order: list[str] = []
    parent_piece: dict[str, int] = {}
    used: set[int] = set()
    left: list[int] = []
    stack: list[tuple[str, int]] = [(root, -1)]
    while stack:
        name, came = stack.pop()
        if came in used:
            continue
        if came >= 0:
            used.add(came)
        if name in parent_piece or (order and name == root):
            left.append(came)
            continue
        order.append(name)
        if came >= 0:
            parent_piece[name] = came
        for n in reversed(touching[name]):
            if n not in used:
                stack.append((_other(pieces[n], name), n))
    return order, parent_piece, left


def _units(
    feeder: Feeder, index: dict[str, int]
) -> tuple[
    tuple[str, ...],
    NDArray[np.int64],
    tuple[NDArray[np.complex128], NDArray[np.complex128]],
]:
    """Unit names, their nodes, and (half leakage, zero-sequence shunt) referred to HV."""
    kv = feeder.source.kv_ll
    hosts: list[Transformer | Load] = [*feeder.transformers]
    hosts += [load for load in feeder.loads if load.transformer is None]
    node, half, y0 = [], [], []
    for host in hosts:
        assert host.place is not None
        node.append(index[_node_name(feeder, host.place)])
        if isinstance(host, Load):
            half.append(0j)
            y0.append(0j)
            continue
        base_ohm = kv * kv / (host.rating_kva / 1000.0)
        half.append(host.leakage_pu * base_ohm / 2.0)
        y0.append(0j if host.x0_pu is None else 1.0 / (1j * host.x0_pu * base_ohm))
    return (
        tuple(host.name for host in hosts),
        np.array(node, np.int64),
        (np.array(half, np.complex128), np.array(y0, np.complex128)),
    )


def _loads(
    feeder: Feeder, units: tuple[str, ...]
) -> tuple[NDArray[np.int64], NDArray[np.complex128]]:
    """The unit of every load, and its admittance per winding at nominal voltage."""
    unit, y = [], []
    for load in feeder.loads:
        # a direct load's unit stands behind the transformers, whatever the names are
        own = units.index(load.name, len(feeder.transformers)) if load.transformer is None else -1
        unit.append(own if own >= 0 else units.index(str(load.transformer)))
        p = load.kw * 1000.0 / 3.0
        q = p * np.sqrt(1.0 / load.power_factor**2 - 1.0) * np.sign(load.power_factor)
        y.append(complex(p, -q) / feeder.source.v_phase_v**2)
    return np.array(unit, np.int64), np.array(y, np.complex128)


def _connections(feeder: Feeder) -> NDArray[np.int64]:
    """Winding connections of the units; a direct load is a bank without leakage."""
    own = [CONNECTIONS[unit.connection] for unit in feeder.transformers]
    own += [
        YG_YG if load.connection == "wye" else D_YG
        for load in feeder.loads
        if load.transformer is None
    ]
    return np.array(own, np.int64)


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
