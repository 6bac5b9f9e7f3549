"""The feeder as a graph: buses joined by lines, switches, regulators and transformers."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from .errors import KeyPath
from .parts import Feeder

__all__ = [
    "Edge",
    "Neighbours",
    "Tree",
    "buses",
    "edges",
    "forest",
    "neighbours",
    "shortest_path",
    "tree_path",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Edge:
    """What joins two buses; ``path`` is its key path in the document."""

    path: KeyPath
    name: str
    ends: tuple[str, str]

    @property
    def is_line(self) -> bool:
        """Whether there is length, and so impedance, between the ends."""
        return self.path[0] == "lines"


Neighbours = Mapping[str, Sequence[tuple[str, Edge]]]
"""Bus -> the buses next to it, and the edges to them, in the order of the edges."""

Tree = dict[str, tuple[str, Edge] | None]
"""Bus -> the bus before it and the edge between them; None for the root. Depth first."""


def edges(feeder: Feeder) -> tuple[Edge, ...]:
    """Return lines, normally closed switches, regulators, transformers, in the feeder's order."""
    lines = (
        Edge(path=("lines", index), name=line.name, ends=(line.from_bus, line.to_bus))
        for index, line in enumerate(feeder.lines)
    )
    switches = (
        Edge(path=("switches", index), name=switch.name, ends=(switch.from_bus, switch.to_bus))
        for index, switch in enumerate(feeder.switches)
        if switch.closed
    )
    regulators = (
        Edge(path=("regulators", index), name=part.name, ends=(part.from_bus, part.to_bus))
        for index, part in enumerate(feeder.regulators)
    )
    inline = (
        Edge(path=("inline_transformers", index), name=unit.name, ends=(unit.from_bus, unit.to_bus))
        for index, unit in enumerate(feeder.inline_transformers)
    )
    return (*lines, *switches, *regulators, *inline)


def neighbours(graph: Iterable[Edge]) -> Neighbours:
    """Return what stands next to every bus."""
    beside: defaultdict[str, list[tuple[str, Edge]]] = defaultdict(list)
    for edge in graph:
        start, end = edge.ends
        beside[start].append((end, edge))
        beside[end].append((start, edge))
    return beside


def buses(feeder: Feeder) -> tuple[str, ...]:
    """Return the buses of a checked feeder depth first from the source, ties open."""
    return tuple(forest(edges(feeder), [feeder.source.bus])[0])


def forest(graph: Sequence[Edge], roots: Iterable[str]) -> list[Tree]:
    """Return a spanning tree from every root that no earlier tree reaches, in order."""
    beside = neighbours(graph)
    trees: list[Tree] = []
    reached: set[str] = set()
    for root in roots:
        if root not in reached:
            trees.append(_spanning_tree(root, beside))
            reached.update(trees[-1])
    return trees


def _spanning_tree(root: str, beside: Neighbours) -> Tree:
    """Return the tree of all buses reached from the root, branches in the order of the edges."""
    tree: Tree = {}
    waiting: list[tuple[str, tuple[str, Edge] | None]] = [(root, None)]
    while waiting:
        bus, before = waiting.pop()
        if bus in tree:
            continue
        tree[bus] = before
        for neighbour, edge in reversed(beside.get(bus, [])):
            waiting.append((neighbour, (bus, edge)))
    return tree


def tree_path(tree: Tree, start: str, end: str) -> tuple[list[str], list[Edge]]:
    """Return the buses and the edges between two buses of a tree, ``start`` first."""
    up, up_edges = _to_root(tree, start)
    down, down_edges = _to_root(tree, end)
    while up_edges and down_edges and up_edges[-1] is down_edges[-1]:
        up_edges.pop(), down_edges.pop()
        up.pop(), down.pop()
    return [*up, *reversed(down[:-1])], [*up_edges, *reversed(down_edges)]


def shortest_path(beside: Neighbours, start: str, end: str) -> tuple[list[str], list[Edge]]:
    """Return the buses and the edges of the way of fewest edges, ``start`` first.

    Among ways as short it is the one that comes first in the order of the edges. In a tree it
    is the only one. Raises KeyError where there is none.
    """
    before: Tree = {start: None}
    waiting = deque([start])
    while waiting and end not in before:
        bus = waiting.popleft()
        for far, edge in beside.get(bus, []):
            if far not in before:
                before[far] = bus, edge
                waiting.append(far)
    passed, taken = _to_root(before, end)
    return passed[::-1], taken[::-1]


def _to_root(tree: Tree, bus: str) -> tuple[list[str], list[Edge]]:
    """Return the buses and the edges from a bus up to the root."""
    passed: list[str] = [bus]
    taken: list[Edge] = []
    while (before := tree[bus]) is not None:
        bus, edge = before
        passed.append(bus)
        taken.append(edge)
    return passed, taken
