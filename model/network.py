"""A feeder compiled for the solver: a tree of nodes, units on nodes, and what lies where.

Buses and tees become nodes, pieces of line between them become edges. Lines are cut
only where something stands: a tee of a transformer or load. An event may then stand
anywhere on an edge. With a tie closed, one edge at the fork of the loop is the chord.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bank import D_D, D_YG, Y_D, YG_D, YG_YG
from .errors import InputError
from .machines import Machines, machines_of, power_va
from .parts import (
    Capacitor,
    Der,
    Feeder,
    Line,
    Load,
    Place,
    Regulator,
    Source,
    Switch,
    Transformer,
)
from .states import Tree
from .symmetrical import phase_matrix

__all__ = [
    "CONNECTIONS",
    "Network",
    "Piece",
    "assumed_connection",
    "compile_network",
    "detached_end",
    "locate",
]

CONNECTIONS: dict[str, int] = {
    "Yg/Yg": YG_YG,
    "D/Yg": D_YG,
    "Yg/D": YG_D,
    "Y/D": Y_D,
    "D/D": D_D,
}

NO_PHASES: NDArray[np.complex128] = np.zeros((3, 3), np.complex128)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Piece:
    """A stretch of line between two nodes, or a closed switch or regulator (``line`` None)."""

    line: str | None
    regulator: str | None = None
    ends: tuple[str, str]  #: node names, in the direction of the line or regulator
    start: float  #: fraction of the line at the first end
    stop: float  #: and at the second
    length_km: float
    z_ohm: NDArray[np.complex128]  #: (3, 3)
    end_y_s: NDArray[np.complex128]  #: (3, 3) half of the charging

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
    units: tuple[str, ...]  #: transformers, then loads and DER that have none
    loads: tuple[str, ...]
    connection: NDArray[np.int64]  #: (U,) as in the file
    exponent: NDArray[np.float64]  #: (L,) as in the file
    machines: Machines
    regulators: tuple[str, ...]
    ratio: NDArray[np.float64]  #: (R, 3) lower over upper voltage, as in the file
    ratio_step: NDArray[np.float64]  #: (R,) what one tap adds to the voltage, lower over upper
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


def assumed_connection(source: Source) -> str:
    """What an unknown winding connection counts as, until a study draws it."""
    return "Yg/Yg" if source.wires == 4 else "D/Yg"


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
    pieces = _pieces(feeder, closed, opened)
    order, parent_piece, chord = _span(feeder, pieces)
    _check_fed(feeder, pieces, order)
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
    units = _units(feeder)
    machines = machines_of(feeder, units, motors)
    load_unit, load_y = _loads(feeder, units)
    source, neutral_y = feeder.source, _neutral_y(feeder.source)
    source_z = phase_matrix(source.z0_ohm, source.z1_ohm, source.z2_ohm)
    tree = Tree(
        parent=parent,
        z_ohm=np.array([source_z, *_of_pieces(edge_pieces, "z_ohm")]),
        end_y_s=np.array([NO_PHASES, *_of_pieces(edge_pieces, "end_y_s")]),
        charged=any(line.c1_nf_per_km or line.c0_nf_per_km for line in feeder.lines),
        regulator=_regulator_rows(feeder, edge_pieces),
        lifted=source.neutral == "isolated" or neutral_y != 0.0,
        neutral_y_s=neutral_y,
        in_loop=in_loop,
        fork=fork,
        tail=tail,
        shunt_s=_capacitor_shunts(feeder, index),
        unit_node=np.array([index[_node_name(feeder, _place(u))] for u in units], np.int64),
        **_unit_arrays(feeder, units, machines),
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
        connection=np.array([_connection(feeder, unit) for unit in units], np.int64),
        exponent=np.array([load.exponent for load in feeder.loads], np.float64),
        machines=machines,
        **_regulator_arrays(feeder, edge_pieces, upward),
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


def _check_fed(feeder: Feeder, pieces: list[Piece], order: list[str]) -> None:
    """Every bus hangs on the source, one way or another."""
    apart = {end for piece in pieces for end in piece.ends} - set(order)
    if apart:
        names = ", ".join(repr(name) for name in sorted(apart))
        raise InputError.single(
            feeder.name,
            "network",
            names if len(names) < 60 else f"{len(apart)} buses apart",
            f"must be connected with '{feeder.source.bus}' in every state of the switches",
        )


def detached_end(point: str) -> str:
    """Name of the line end behind a measuring point's open recloser."""
    return f"{point}:open"


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


def _place(part: Transformer | Load | Der | Capacitor) -> Place:
    assert part.place is not None
    return part.place


def _places(feeder: Feeder) -> list[Place]:
    loose: list[Load | Der | Capacitor] = [*feeder.loads, *feeder.ders, *feeder.capacitors]
    own = [part.place for part in loose if part.place is not None]
    return [t.place for t in feeder.transformers] + own


def _pieces(feeder: Feeder, closed: frozenset[str], opened: frozenset[str]) -> list[Piece]:
    cuts: dict[str, set[float]] = defaultdict(set)
    for place in _places(feeder):
        if place.line is not None and place.at is not None:
            cuts[place.line].add(place.at)
    omega = 2.0 * np.pi * feeder.source.frequency_hz
    pieces = []
    for line in feeder.lines:
        own = [p for p in feeder.points if p.line == line.name and p.name in opened]
        detached = {point.bus: point.name for point in own}
        pieces += _cut(line, cuts[line.name], detached, omega)
    joining: list[Regulator | Switch] = [s for s in feeder.switches if s.name in closed]
    for part in [*joining, *feeder.regulators]:
        pieces.append(
            Piece(
                line=None,
                regulator=part.name if isinstance(part, Regulator) else None,
                ends=(part.from_bus, part.to_bus),
                start=0.0,
                stop=1.0,
                length_km=0.0,
                z_ohm=NO_PHASES,
                end_y_s=NO_PHASES,
            )
        )
    return pieces


def _cut(line: Line, at: set[float], detached: dict[str, str], omega: float) -> list[Piece]:
    """The line between its tees; ``detached``: ends that an open recloser keeps from the bus."""
    fractions = sorted({0.0, 1.0, *at})
    ends = [
        detached_end(detached[bus]) if bus in detached else bus
        for bus in (line.from_bus, line.to_bus)
    ]
    names = [ends[0], *(_tee(line.name, x) for x in fractions[1:-1]), ends[1]]
    whole = line.length_km * phase_matrix(
        line.z0_ohm_per_km, line.z1_ohm_per_km, line.z1_ohm_per_km
    )
    siemens = 0.5j * omega * line.length_km * 1e-9
    half = siemens * phase_matrix(line.c0_nf_per_km, line.c1_nf_per_km, line.c1_nf_per_km)
    return [
        Piece(
            line=line.name,
            ends=(names[n], names[n + 1]),
            start=fractions[n],
            stop=fractions[n + 1],
            length_km=line.length_km * (fractions[n + 1] - fractions[n]),
            z_ohm=whole * (fractions[n + 1] - fractions[n]),
            end_y_s=half * (fractions[n + 1] - fractions[n]),
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
                "two switches or regulators",
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


_Unit = Transformer | Load | Der


def _units(feeder: Feeder) -> list[_Unit]:
    """Everything that hangs on a node as a bank: transformers, and what has none."""
    loads = [load for load in feeder.loads if load.transformer is None]
    ders = [der for der in feeder.ders if der.transformer is None]
    return [*feeder.transformers, *loads, *ders]


def _unit_arrays(feeder: Feeder, units: list[_Unit], machines: Machines) -> dict[str, Any]:
    """Half leakage and magnetizing admittances of the units, referred to HV."""
    kv = feeder.source.kv_ll
    half, y0, ym = [], [], []
    for unit in units:
        leakage, x0, xm, base_ohm = 0j, None, None, 1.0
        if isinstance(unit, Transformer):
            leakage, x0, xm = unit.leakage_pu, unit.x0_pu, unit.xm_pu
            base_ohm = kv * kv / (unit.rating_kva / 1000.0)
        half.append(leakage * base_ohm / 2.0)
        y0.append(0j if x0 is None else 1.0 / (1j * x0 * base_ohm))
        ym.append(0j if xm is None else 1.0 / (1j * xm * base_ohm))
    z = np.array(half, np.complex128)
    return {
        "unit_zh_ohm": z,
        "unit_zl_ohm": z,
        "unit_y0_s": np.array(y0, np.complex128),
        "unit_ym_s": np.array(ym, np.complex128),
        "unit_plain": (np.array(ym) == 0) & ~np.isin(np.arange(len(units)), machines.unit),
    }


def _connection(feeder: Feeder, unit: _Unit) -> int:
    """Winding connection; what hangs on the feeder directly is a bank without leakage."""
    if isinstance(unit, Transformer):
        known = unit.connection != "unknown"
        return CONNECTIONS[unit.connection if known else assumed_connection(feeder.source)]
    return D_YG if isinstance(unit, Load) and unit.connection == "delta" else YG_YG


def _loads(feeder: Feeder, units: list[_Unit]) -> tuple[NDArray[np.int64], NDArray[np.complex128]]:
    """The unit of every load, and its admittance per winding at nominal voltage."""
    row = {id(unit): n for n, unit in enumerate(units)}
    by_name = {unit.name: n for n, unit in enumerate(units) if isinstance(unit, Transformer)}
    unit, y = [], []
    for load in feeder.loads:
        unit.append(row[id(load)] if load.transformer is None else by_name[load.transformer])
        va = power_va(load.kw, load.power_factor)
        y.append(va.conjugate() / 3.0 / feeder.source.v_phase_v**2)
    return np.array(unit, np.int64), np.array(y, np.complex128)


def _capacitor_shunts(feeder: Feeder, index: dict[str, int]) -> NDArray[np.complex128]:
    shunt = np.zeros((len(index), 3, 3), np.complex128)
    for bank in feeder.capacitors:
        y = 1j * bank.kvar * 1000.0 / 3.0 / feeder.source.v_phase_v**2
        y0 = y if bank.connection == "wye" else 0j
        shunt[index[_node_name(feeder, bank.place)]] += phase_matrix(y0, y, y)
    return shunt


def _regulator_rows(feeder: Feeder, pieces: list[Piece | None]) -> NDArray[np.int64]:
    names = [regulator.name for regulator in feeder.regulators]
    rows = [names.index(p.regulator) if p and p.regulator else -1 for p in pieces]
    return np.array(rows, np.int64)


def _regulator_arrays(
    feeder: Feeder, pieces: list[Piece | None], upward: NDArray[np.bool_]
) -> dict[str, Any]:
    """Ratios, lower over upper voltage: inverted where a regulator is fed from its to-end."""
    ratio, step, ways = [], [], []
    for regulator in feeder.regulators:
        edge = next(k for k, p in enumerate(pieces) if p and p.regulator == regulator.name)
        taps = 1.0 + np.array(regulator.taps) * regulator.step_pct / 100.0
        ways.append(bool(upward[edge]))
        ratio.append(taps if upward[edge] else 1.0 / taps)
        step.append(regulator.step_pct / 100.0)
    return {
        "regulators": tuple(regulator.name for regulator in feeder.regulators),
        "ratio": np.array(ratio, np.float64).reshape(-1, 3),
        "ratio_step": np.array(step, np.float64),
        "ratio_upward": np.array(ways, np.bool_),
    }


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
