"""Zones: what lies between measuring points, which points feed it, and which it feeds.

The points cut the feeder where they stand, each between its bus and that end of its line; what
remains joined is a zone. Switches count in their normal state.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from .parts import (
    Capacitor,
    Der,
    Feeder,
    InlineTransformer,
    Line,
    Load,
    Place,
    Point,
    Regulator,
    Section,
    Switch,
    Transformer,
)

__all__ = [
    "Edge",
    "Node",
    "Zones",
    "adjacent_sections",
    "nodes_of",
    "outwards",
    "section_paths",
    "zones_of",
]

Node = tuple[str, str]
"""``("bus", name)``, or ``("line", name)`` for what lies between a line's two ends."""

Joined = Mapping[Node, Sequence[Node]]
Edge = Line | Switch | Regulator | InlineTransformer


@dataclass(frozen=True, slots=True, kw_only=True)
class Zones:
    """The zones of a feeder, numbered; 0 is the one that holds the source.

    Parameters
    ----------
    of_node
        The zone of every bus and line. What nothing feeds has a zone too.
    entries
        For each zone the points, by index, through which the source feeds it: one where the
        feeder is radial, several in a closed loop, none at the source or apart from it.
    exits
        For each zone the points through which it feeds others, or which end it.
    """

    of_node: Mapping[Node, int]
    entries: tuple[tuple[int, ...], ...]
    exits: tuple[tuple[int, ...], ...]


def nodes_of(feeder: Feeder, parts: Sequence[Load | Der | Capacitor | Transformer]) -> list[Node]:
    """Where each part stands, or the transformer that it is behind; a line's ends are buses."""
    units = {unit.name: unit.place for unit in feeder.transformers}
    ends = {line.name: (line.from_bus, line.to_bus) for line in feeder.lines}

    def node(place: Place | None) -> Node:
        assert place is not None
        if place.bus is not None:
            return "bus", place.bus
        assert place.line is not None
        if place.at in (0.0, 1.0):
            return "bus", ends[place.line][int(place.at)]
        return "line", place.line

    return [
        node(units[part.transformer])
        if isinstance(part, (Load, Der)) and part.transformer is not None
        else node(part.place)
        for part in parts
    ]


def zones_of(feeder: Feeder, points: Sequence[Point]) -> Zones:
    """Cut ``feeder`` at ``points``."""
    joined = _joined(feeder, points)
    of_node = _numbered(joined, ("bus", feeder.source.bus))
    count = max(of_node.values()) + 1
    sides = [(of_node["bus", p.bus], of_node["line", p.line]) for p in points]
    return Zones(
        of_node=of_node,
        entries=tuple(tuple(_entries(zone, sides)) for zone in range(count)),
        exits=tuple(tuple(_exits(zone, sides)) for zone in range(count)),
    )


def adjacent_sections(
    feeder: Feeder, points: Sequence[Point]
) -> tuple[tuple[Section, ...], tuple[str, ...]]:
    """Sections between neighbouring points, and a sentence for each zone that has none.

    The point that feeds a zone makes a pair with each at which the zone ends: a fork gives one
    pair for each remote point. Where two points feed a zone that has no other, they are a pair.
    """
    zones, joined = zones_of(feeder, points), _joined(feeder, points)
    chosen: list[tuple[int, int]] = []
    left_out: list[str] = []
    for number, (entries, exits) in enumerate(zip(zones.entries, zones.exits, strict=True)):
        pairs = [(entry, remote) for entry in entries[:1] for remote in exits]
        if len(entries) == 2 and not exits:
            pairs = [(entries[0], entries[1])]
        elif len(entries) > 1:
            names = ", ".join(points[n].name for n in (*entries, *exits))
            left_out.append(f"no section between {names}: a closed loop feeds them from both sides")
            continue
        for local, remote in pairs:
            ends = [_inner_side(points[n], zones, number) for n in (local, remote)]
            if _has_line_between(joined, *ends):
                chosen.append((local, remote))
    sections = (Section(local=points[a].name, remote=points[b].name) for a, b in sorted(chosen))
    return tuple(sections), tuple(left_out)


def outwards(feeder: Feeder) -> dict[str, tuple[str, Edge] | None]:
    """Buses in the order of their distance from the source in edges, switches as they are.

    With each comes the bus before it and what joins the two; None for the source's bus.
    """
    joined: defaultdict[str, list[tuple[str, Edge]]] = defaultdict(list)
    closed = (switch for switch in feeder.switches if switch.closed)
    parts: list[Edge] = [*feeder.lines, *closed]
    for part in [*parts, *feeder.regulators, *feeder.inline_transformers]:
        joined[part.from_bus].append((part.to_bus, part))
        joined[part.to_bus].append((part.from_bus, part))
    found: dict[str, tuple[str, Edge] | None] = {feeder.source.bus: None}
    waiting = deque([feeder.source.bus])
    while waiting:
        bus = waiting.popleft()
        for far, part in joined[bus]:
            if far not in found:
                found[far] = bus, part
                waiting.append(far)
    return found


def section_paths(feeder: Feeder) -> tuple[tuple[str, ...], ...]:
    """Lines between the two points of every section, by the fewest edges, for a picture."""
    cut, whole = _joined(feeder, feeder.points), _joined(feeder, ())
    at = {point.name: point for point in feeder.points}
    paths = []
    for section in feeder.sections:
        one, other = at[section.local], at[section.remote]
        ways = [
            _way(cut, start, end)
            for start in (("bus", one.bus), ("line", one.line))
            for end in (("bus", other.bus), ("line", other.line))
        ]
        found = [way for way in ways if way]
        nodes = found[0] if found else _way(whole, ("bus", one.bus), ("bus", other.bus))
        paths.append(tuple(name for kind, name in nodes if kind == "line"))
    return tuple(paths)


def _joined(feeder: Feeder, points: Iterable[Point]) -> Joined:
    """What is joined to what, but for where a point stands."""
    cuts = {(point.bus, point.line) for point in points}
    joined: defaultdict[Node, list[Node]] = defaultdict(list)

    def join(a: Node, b: Node) -> None:
        joined[a].append(b)
        joined[b].append(a)

    joined.setdefault(("bus", feeder.source.bus), [])
    for line in feeder.lines:
        joined.setdefault(("line", line.name), [])
        for bus in (line.from_bus, line.to_bus):
            joined.setdefault(("bus", bus), [])
            if (bus, line.name) not in cuts:
                join(("line", line.name), ("bus", bus))
    closed = (switch for switch in feeder.switches if switch.closed)
    parts: list[Switch | Regulator | InlineTransformer] = [*closed, *feeder.regulators]
    for part in [*parts, *feeder.inline_transformers]:
        join(("bus", part.from_bus), ("bus", part.to_bus))
    for switch in feeder.switches:
        joined.setdefault(("bus", switch.from_bus), [])
        joined.setdefault(("bus", switch.to_bus), [])
    return joined


def _numbered(joined: Joined, first: Node) -> dict[Node, int]:
    """The number of every node's component, 0 with ``first``."""
    number: dict[Node, int] = {}
    count = 0
    for root in (first, *joined):
        if root in number:
            continue
        number[root] = count
        waiting = deque([root])
        while waiting:
            for far in joined[waiting.popleft()]:
                if far not in number:
                    number[far] = count
                    waiting.append(far)
        count += 1
    return number


def _entries(zone: int, sides: Sequence[tuple[int, int]]) -> list[int]:
    """Points whose other side the source reaches without passing through ``zone``."""
    if zone == 0:
        return []
    fed = _fed(sides, without=zone)
    return [n for n, own in enumerate(sides) if zone in own and (own[0] in fed or own[1] in fed)]


def _exits(zone: int, sides: Sequence[tuple[int, int]]) -> list[int]:
    """Points of ``zone`` whose other side is fed through it, or not at all."""
    fed = _fed(sides, without=zone) if zone else set()
    return [
        n
        for n, own in enumerate(sides)
        if zone in own and own[0] != own[1] and own[0] not in fed and own[1] not in fed
    ]


def _fed(sides: Sequence[tuple[int, int]], *, without: int) -> set[int]:
    """Zones that the source reaches through the points but not through one of the zones."""
    fed = {0}
    grown = True
    while grown:
        near = [own for own in sides if without not in own and (own[0] in fed) != (own[1] in fed)]
        grown = bool(near)
        fed.update(zone for own in near for zone in own)
    return fed


def _inner_side(point: Point, zones: Zones, zone: int) -> Node:
    """The side of a point that lies in ``zone``."""
    bus: Node = ("bus", point.bus)
    return bus if zones.of_node[bus] == zone else ("line", point.line)


def _has_line_between(joined: Joined, start: Node, end: Node) -> bool:
    """Whether the shortest way between two nodes of a zone has any line on it."""
    return any(kind == "line" for kind, _ in _way(joined, start, end))


def _way(joined: Joined, start: Node, end: Node) -> list[Node]:
    """Nodes of the shortest way, ends included; none where there is no way."""
    before: dict[Node, Node | None] = {start: None}
    waiting = deque([start])
    while waiting and end not in before:
        here = waiting.popleft()
        for far in joined[here]:
            if far not in before:
                before[far] = here
                waiting.append(far)
    nodes: list[Node] = []
    at: Node | None = end if end in before else None
    while at is not None:
        nodes.append(at)
        at = before[at]
    return nodes[::-1]
