"""Where the measuring points stand in a compiled network, and what each terminal looks at."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .network import Network, Piece, compile_network, detached_end
from .parts import Feeder, Point, Section
from .path_impedance import Impedances, impedances_of, path_z1_ohm, rest_of_loop_z1_ohm
from .sides import joined, sides_of
from .states import Probes
from .topology import Edge, edges, shortest_path

__all__ = ["Points", "Terminal", "fed_by_its_points", "find_points", "into_line", "point_probes"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Terminal:
    """A directed pair of measuring points: ``local`` looks at ``remote``.

    Indices count the feeder's points; masks run over the network's edges.
    """

    local: str
    remote: str
    local_point: int
    remote_point: int
    into: float  #: +1 where the local current, positive into its line, flows into the section
    on_path: NDArray[np.bool_]  #: edges of the section's path: a break there is internal
    in_section: NDArray[np.bool_]  #: the path, and laterals that tee off it before the next point
    load_side: bool  #: with the section cut, nothing behind the terminal could feed it
    line_z1_ohm: complex  #: of the path, as eq. (5) shows it
    loop_z1_ohm: complex | None  #: of the whole closed loop that the path is part of; None: none
    edge_side: NDArray[np.int8]  #: (edges,) a Side: how each edge lies to the section
    node_side: NDArray[np.int8]  #: (nodes,) and each node

    @property
    def name(self) -> str:
        """The terminal as reports print it."""
        return f"{self.local}→{self.remote}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Points:
    """The measuring points of a feeder in a compiled network, and the directed terminals."""

    names: tuple[str, ...]
    node: NDArray[np.int64]  #: (P,) where V is measured
    v_nominal_v: NDArray[np.float64]  #: (P,) phase to earth there
    edge: NDArray[np.int64]  #: (P,) the line's edge at that end, where I is measured
    below: NDArray[np.bool_]  #: (P,) the point stands at the edge's lower end
    terminals: tuple[Terminal, ...]  #: both directions of every section, in the file's order


def point_probes(points: Points) -> Probes:
    """What the solver must look at: V and I of every point."""
    return Probes(v_node=points.node, i_edge=points.edge, i_below=points.below)


def into_line(points: Points) -> NDArray[np.float64]:
    """(P,) factor that makes a probed current positive into the point's line."""
    return np.where(points.below, -1.0, 1.0)


def find_points(feeder: Feeder, network: Network, opened: frozenset[str] = frozenset()) -> Points:
    """Place the feeder's points and sections in ``network``, compiled with ``opened``.

    Raises InputError for a section that the source feeds from between its points: neither
    terminal would measure what enters it.
    """
    ends = [_end(feeder, network, p) for p in feeder.points]
    node = [network.node(_voltage_node(p, opened)) for p in feeder.points]
    terminals: list[Terminal] = []
    if feeder.sections:
        state = _state(feeder, network, opened)
        for section in feeder.sections:
            terminals += _terminals(state, section)
    return Points(
        names=tuple(p.name for p in feeder.points),
        node=np.array(node, np.int64),
        v_nominal_v=network.node_v[np.array(node, np.int64)],
        edge=np.array([edge for edge, _ in ends], np.int64),
        below=np.array([below for _, below in ends], np.bool_),
        terminals=tuple(terminals),
    )


def fed_by_its_points(feeder: Feeder) -> tuple[tuple[Section, ...], tuple[str, ...]]:
    """Return the sections that `find_points` takes, and a sentence for each of the others.

    Of a feeder that makes no network all are returned.
    """
    if not feeder.sections:
        return (), ()
    try:
        state = _state(feeder, compile_network(feeder), frozenset())
    except InputError:
        return feeder.sections, ()
    taken: list[Section] = []
    left_out: list[str] = []
    for section in feeder.sections:
        try:
            _terminals(state, section)
        except InputError as error:
            why = error.faults[0].found
            left_out.append(f"no section between {section.local} and {section.remote}: {why}")
        else:
            taken.append(section)
    return tuple(taken), tuple(left_out)


def _voltage_node(point: Point, opened: frozenset[str]) -> str:
    """Where the voltage is measured: beyond the open contacts, if on the line's side."""
    beyond = point.name in opened and point.voltage_side == "line"
    return detached_end(point.name) if beyond else point.bus


def _end(feeder: Feeder, network: Network, point: Point) -> tuple[int, bool]:
    """The edge at the point's end of its line, and whether the point is at its lower end."""
    pieces = network.edges_of(point.line)
    line = next(item for item in feeder.lines if item.name == point.line)
    at_from = line.from_bus == point.bus
    edge = pieces[0] if at_from else pieces[-1]
    return edge, bool(network.upward[edge] != at_from)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _State:
    """A state of the network, and what all sections need to know of it and of the normal one."""

    feeder: Feeder
    network: Network
    opened: frozenset[str]
    normal: Network
    graph: tuple[Edge, ...]  #: of the normal state
    touching: Mapping[str, Sequence[Piece]]  #: its pieces at each node
    impedances: Impedances
    feeds: NDArray[np.int64]  #: nodes of the source and of DER with an EMF


def _state(feeder: Feeder, network: Network, opened: frozenset[str]) -> _State:
    normal = compile_network(feeder)
    touching: defaultdict[str, list[Piece]] = defaultdict(list)
    for piece in filter(None, normal.pieces):
        for name in piece.ends:
            touching[name].append(piece)
    units = [
        network.tree.machine_unit[len(network.machines.motor_load) + n]
        for n, der in enumerate(feeder.ders)
        if der.model in ("thevenin", "generator")
    ]
    return _State(
        feeder=feeder,
        network=network,
        opened=opened,
        normal=normal,
        graph=edges(feeder),
        touching=touching,
        impedances=impedances_of(feeder, network),
        feeds=np.append(network.tree.unit_node[np.array(units, np.int64)], 0),
    )


def _terminals(state: _State, section: Section) -> list[Terminal]:
    """Both terminals of a section."""
    feeder, network = state.feeder, state.network
    points = {p.name: n for n, p in enumerate(feeder.points)}
    ends = [feeder.points[points[name]] for name in (section.local, section.remote)]
    # the path is that of the normal state, whatever is switched in this network
    buses = ends[0].bus, ends[1].bus
    _, path = shortest_path(state.graph, *buses, [point.line for point in ends])
    lines = {edge.name for edge in path if edge.is_line}
    on_path = np.array([p is not None and p.line in lines for p in network.pieces], np.bool_)
    in_section = on_path | _laterals(state, lines, ends)
    own_ends = {point.bus for point in ends if point.line in lines}
    edge_side, node_side = sides_of(network, on_path, in_section, own_ends, state.normal)
    steps = [(edge.name if edge.is_line else None, edge.ends) for edge in path]
    z1 = path_z1_ohm(state.impedances, steps, buses)
    rest = rest_of_loop_z1_ohm(state.impedances, network, on_path, buses)
    fed = _fed(state, in_section)
    return [
        Terminal(
            local=here.name,
            remote=there.name,
            local_point=points[here.name],
            remote_point=points[there.name],
            into=1.0 if here.line in lines else -1.0,
            on_path=on_path,
            in_section=in_section,
            load_side=here.name in state.opened or not fed[network.node(here.bus)],
            line_z1_ohm=z1,
            loop_z1_ohm=None if rest is None else z1 + rest,
            edge_side=edge_side,
            node_side=node_side,
        )
        for here, there in (ends, ends[::-1])
    ]


def _laterals(state: _State, lines: set[str], ends: list[Point]) -> NDArray[np.bool_]:
    """Edges that tee off the path between the two points, up to the next point."""
    # the bus of an end lies inside unless its point stands on the section's own side of it
    outer = {p.bus for p in ends if p.line in lines}
    along = [p for p in state.normal.pieces if p is not None and p.line in lines]
    inner = {name for p in along for name in p.ends} - outer
    feeder = state.feeder
    _, reached = _grow(state.touching, lines, inner, ends)
    if feeder.source.bus in reached or outer & reached:
        raise InputError.single(
            feeder.name,
            f"sections '{ends[0].name}'–'{ends[1].name}'",
            "a way out of it that passes neither of them"
            if outer & reached
            else "a way to the source that passes neither of them",
            "must be fed through its two points alone",
        )
    found, _ = _grow(state.touching, lines, inner, list(feeder.points))
    return np.array([p is not None and p.key in found for p in state.network.pieces], np.bool_)


def _grow(
    touching: Mapping[str, Sequence[Piece]],
    lines: set[str],
    inner: set[str],
    points: list[Point],
) -> tuple[set[object], set[str]]:
    """Pieces off ``lines``, and nodes, that are joined to ``inner`` past none of ``points``."""
    guarded = {(p.bus, p.line) for p in points}
    found: set[object] = set()
    reached = set(inner)
    waiting = sorted(inner)
    while waiting:
        name = waiting.pop()
        for piece in touching[name]:
            if piece.line in lines or (name, piece.line) in guarded:
                continue
            found.add(piece.key)
            far = piece.ends[0] if piece.ends[1] == name else piece.ends[1]
            if far not in reached and (far, piece.line) not in guarded:
                reached.add(far)
                waiting.append(far)
    return found, reached


def _fed(state: _State, cut: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(nodes,) joined to the source, or to a DER with an EMF, without ``cut``."""
    part = joined(state.network, ~cut)
    return np.isin(part, part[state.feeds])
