"""The feeder as a graph: buses joined by lines, switches and regulators."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from .errors import KeyPath
from .parts import Feeder

__all__ = ["Edge", "Tree", "buses", "edges", "forest", "tree_path"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Edge:
    """A line, switch or regulator in the graph; ``path`` is its key path in the document."""

    path: KeyPath
    name: str
    ends: tuple[str, str]

    @property
    def is_line(self) -> bool:
        """Whether there is length, and so impedance, between the ends."""
        return self.path[0] == "lines"


Tree = dict[str, tuple[str, Edge] | None]
"""Bus -> the bus before it and the edge between them; None for the root. Depth first."""


def edges(feeder: Feeder) -> tuple[Edge, ...]:
    """Return the lines, the normally closed switches and the regulators, in the feeder's order."""
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
    return (*lines, *switches, *regulators)


def buses(feeder: Feeder) -> tuple[str, ...]:
    """Return the buses of a checked feeder depth first from the source, ties open."""
    return tuple(forest(edges(feeder), [feeder.source.bus])[0])


def forest(graph: Sequence[Edge], roots: Iterable[str]) -> list[Tree]:
    """Return a spanning tree from every root that no earlier tree reaches, in order."""
    neighbours: defaultdict[str, list[tuple[str, Edge]]] = defaultdict(list)
    for edge in graph:
        start, end = edge.ends
        neighbours[start].append((end, edge))
        neighbours[end].append((start, edge))
    trees: list[Tree] = []
    reached: set[str] = set()
    for root in roots:
        if root not in reached:
            trees.append(_spanning_tree(root, neighbours))
            reached.update(trees[-1])
    return trees


def _spanning_tree(root: str, neighbours: dict[str, list[tuple[str, Edge]]]) -> Tree:
    """Return the tree of all buses reached from the root, branches in the order of the edges."""
    tree: Tree = {}
    waiting: list[tuple[str, tuple[str, Edge] | None]] = [(root, None)]
    while waiting:
        bus, before = waiting.pop()
        if bus in tree:
            continue
        tree[bus] = before
        for neighbour, edge in reversed(neighbours.get(bus, [])):
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


def _to_root(tree: Tree, bus: str) -> tuple[list[str], list[Edge]]:
    """Return the buses and the edges from a bus up to the root."""
    passed: list[str] = [bus]
    taken: list[Edge] = []
    while (before := tree[bus]) is not None:
        bus, edge = before
        passed.append(bus)
        taken.append(edge)
    return passed, taken
