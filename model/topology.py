"""The feeder as a graph: buses joined by lines, switches, regulators and transformers."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

from .errors import KeyPath
from .parts import Feeder

__all__ = ["Edge", "Tree", "buses", "edges", "forest", "shortest_path", "tree_path"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Edge:
    """What joins two buses in the graph; ``path`` is its key path in the document."""

    path: KeyPath
    name: str
    ends: tuple[str, str]

    @property
    def is_line(self) -> bool:
        """Whether there is length, and so impedance, between the ends."""
        return self.path[0] == "lines"


Tree = dict[str, tuple[str, Edge] | None]
"""Bus -> the bus before it and the edge between them; None for the root. Depth first."""


def edges(feeder: Feeder, *, ties: bool = False) -> tuple[Edge, ...]:
    """Return lines, switches, regulators and in-line transformers, in the feeder's order.

    Of the switches those that are normally closed, or with ``ties`` all.
    """
    lines = (
        Edge(path=("lines", index), name=line.name, ends=(line.from_bus, line.to_bus))
        for index, line in enumerate(feeder.lines)
    )
    switches = (
        Edge(path=("switches", index), name=switch.name, ends=(switch.from_bus, switch.to_bus))
        for index, switch in enumerate(feeder.switches)
        if switch.closed or ties
    )
    regulators = (
        Edge(path=("regulators", index), name=part.name, ends=(part.from_bus, part.to_bus))
        for index, part in enumerate(feeder.regulators)
    )
    transformers = (
        Edge(path=("inline_transformers", index), name=unit.name, ends=(unit.from_bus, unit.to_bus))
        for index, unit in enumerate(feeder.inline_transformers)
    )
    return (*lines, *switches, *regulators, *transformers)


def buses(feeder: Feeder) -> tuple[str, ...]:
    """Return the buses of a checked feeder depth first from the source, ties open."""
    return tuple(forest(edges(feeder), [feeder.source.bus])[0])


def shortest_path(
    graph: Sequence[Edge], start: str, end: str, preferred: Collection[str] = ()
) -> tuple[list[str], list[Edge]]:
    """Return the buses and the edges of the shortest way between two buses, ``start`` first.

    That with the fewest edges; among several that with the most lines of the ``preferred``
    names, then that of the edges which stand first. Without a way both lists are empty.
    """
    neighbours: defaultdict[str, list[tuple[str, int]]] = defaultdict(list)
    for n, edge in enumerate(graph):
        for here, there in (edge.ends, edge.ends[::-1]):
            neighbours[here].append((there, n))
    before: dict[str, tuple[str, int]] = {}
    reached: set[str] = set()
    waiting: list[tuple[int, int, int, str, str, int]] = [(0, 0, 0, start, "", -1)]
    count = 0
    while waiting and end not in reached:
        hops, liked, _, bus, came_from, over = heappop(waiting)
        if bus in reached:
            continue
        reached.add(bus)
        before[bus] = (came_from, over)
        for there, n in neighbours[bus]:
            if there not in reached:
                count += 1
                likes = graph[n].is_line and graph[n].name in preferred
                heappush(waiting, (hops + 1, liked - likes, count, there, bus, n))
    if end not in reached:
        return [], []
    passed, taken = [end], []
    while (step := before[passed[-1]])[1] >= 0:
        passed.append(step[0])
        taken.append(graph[step[1]])
    return passed[::-1], taken[::-1]


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
