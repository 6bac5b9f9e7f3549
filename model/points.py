"""Where the measuring points stand in a compiled network, and what each terminal looks at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .line_matrices import z1_ohm
from .network import Network, Piece, compile_network, detached_end
from .parts import Feeder, Point, Section
from .sides import sides_of
from .states import Probes
from .topology import edges, forest, tree_path

__all__ = ["Points", "Terminal", "find_points", "into_line", "point_probes"]


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
    line_z1_ohm: complex
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
    terminals = []
    for section in feeder.sections:
        terminals += _terminals(feeder, network, section, opened)
    return Points(
        names=tuple(p.name for p in feeder.points),
        node=np.array([network.node(_voltage_node(p, opened)) for p in feeder.points], np.int64),
        edge=np.array([edge for edge, _ in ends], np.int64),
        below=np.array([below for _, below in ends], np.bool_),
        terminals=tuple(terminals),
    )


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


def _terminals(
    feeder: Feeder, network: Network, section: Section, opened: frozenset[str]
) -> list[Terminal]:
    """Both terminals of a section."""
    points = {p.name: n for n, p in enumerate(feeder.points)}
    ends = [feeder.points[points[name]] for name in (section.local, section.remote)]
    # the path is that of the normal state, whatever is switched in this network
    tree = forest(edges(feeder), [feeder.source.bus])[0]
    _, path = tree_path(tree, ends[0].bus, ends[1].bus)
    lines = {edge.name for edge in path if edge.is_line}
    on_path = _edges_of_lines(network, lines)
    in_section = on_path | _laterals(feeder, network, lines, ends)
    z1 = sum((z1_ohm(feeder, li) for li in feeder.lines if li.name in lines), start=0j)
    own_ends = {point.bus for point in ends if point.line in lines}
    edge_side, node_side = sides_of(feeder, network, on_path, in_section, own_ends)
    in_loop = np.append(network.tree.in_loop, np.ones(network.chords, np.bool_))
    loop_z1 = _loop_z1(feeder, network, in_loop) if bool(in_loop[on_path].all()) else None
    return [
        Terminal(
            local=here.name,
            remote=there.name,
            local_point=points[here.name],
            remote_point=points[there.name],
            into=1.0 if here.line in lines else -1.0,
            on_path=on_path,
            in_section=in_section,
            load_side=here.name in opened
            or not _reaches_feed(feeder, network, network.node(here.bus), in_section),
            line_z1_ohm=z1,
            loop_z1_ohm=loop_z1,
            edge_side=edge_side,
            node_side=node_side,
        )
        for here, there in (ends, ends[::-1])
    ]


def _loop_z1(feeder: Feeder, network: Network, in_loop: NDArray[np.bool_]) -> complex:
    """Positive-sequence impedance of all line in the closed loop."""
    lines = {line.name: line for line in feeder.lines}
    total = 0j
    for k in np.flatnonzero(in_loop):
        piece = network.pieces[k]
        if piece is not None and piece.line is not None:
            total += z1_ohm(feeder, lines[piece.line]) * (piece.stop - piece.start)
    return total


def _edges_of_lines(network: Network, lines: set[str]) -> NDArray[np.bool_]:
    return np.array([p is not None and p.line in lines for p in network.pieces], np.bool_)


def _laterals(
    feeder: Feeder, network: Network, lines: set[str], ends: list[Point]
) -> NDArray[np.bool_]:
    """Edges that tee off the path between the two points, up to the next point."""
    pieces = [p for p in compile_network(feeder).pieces if p is not None]
    # the bus of an end lies inside unless its point stands on the section's own side of it
    outer = {p.bus for p in ends if p.line in lines}
    inner = {name for p in pieces if p.line in lines for name in p.ends} - outer
    off_path = [p for p in pieces if p.line not in lines]
    _, reached = _grow(off_path, inner, outer, ends)
    if feeder.source.bus in reached:
        raise InputError.single(
            feeder.name,
            f"sections '{ends[0].name}'–'{ends[1].name}'",
            "a way to the source that passes neither of them",
            "must be fed through its two points alone",
        )
    found, _ = _grow(off_path, inner, outer, list(feeder.points))
    return np.array([p is not None and p.key in found for p in network.pieces], np.bool_)


def _grow(
    pieces: list[Piece], inner: set[str], outer: set[str], points: list[Point]
) -> tuple[set[object], set[str]]:
    """Pieces and nodes that are joined to ``inner`` without passing any of ``points``."""
    guarded = {(p.bus, p.line) for p in points}
    found: set[object] = set()
    reached = set(inner)
    waiting = sorted(inner)
    while waiting:
        name = waiting.pop()
        for piece in pieces:
            if name not in piece.ends or (name, piece.line) in guarded:
                continue
            found.add(piece.key)
            far = piece.ends[0] if piece.ends[1] == name else piece.ends[1]
            if far not in reached and far not in outer and (far, piece.line) not in guarded:
                reached.add(far)
                waiting.append(far)
    return found, reached


def _reaches_feed(feeder: Feeder, network: Network, node: int, cut: NDArray[np.bool_]) -> bool:
    """Whether ``node`` is joined to the source, or to a DER with an EMF, without ``cut``."""
    units = [
        network.tree.machine_unit[len(network.machines.motor_load) + n]
        for n, der in enumerate(feeder.ders)
        if der.model in ("thevenin", "generator")
    ]
    feeds = {0, *(int(network.tree.unit_node[unit]) for unit in units)}
    joined: list[tuple[int, int]] = [
        (int(network.tree.parent[k]), k) for k in range(1, len(network.nodes)) if not cut[k]
    ]
    for c in range(network.chords):
        if not cut[len(network.nodes) + c]:
            joined.append((int(network.tree.fork[c]), int(network.tree.tail[c])))
    reached = feeds
    grown = True
    while grown:
        grown = False
        for a, b in joined:
            if (a in reached) != (b in reached):
                reached |= {a, b}
                grown = True
    return node in reached
