"""A feeder's graph: with its ties open a tree, and sections that lie well in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ..errors import KeyPath, Report
from ..parts import Feeder, Point
from ..topology import Edge, Tree, edges, forest, tree_path
from .feeder_names import edge_ends

__all__ = ["check_graph", "check_section_paths", "graph_is_known"]

_EDGES = ("lines", "switches", "regulators")
_JOINING = ("bus", "from", "to", "closed")


def graph_is_known(report: Report) -> bool:
    """Tell whether no fault so far touches what joins what."""
    return not any(_touches_graph(path) for path in report.paths)


def _touches_graph(path: KeyPath) -> bool:
    """Whether a fault there leaves it open which buses there are, or what joins them."""
    if path[0] == "source":
        return len(path) == 1 or path[-1] == "bus"
    if path[0] == "tables":
        return len(path) == 1 or path[1] in _EDGES
    # a fault of a whole table, or of a column of it, leaves its rows unread
    return path[0] in _EDGES and (len(path) < 3 or path[-1] in _JOINING)


def check_graph(feeder: Feeder, report: Report) -> None:
    """In the normal state everything is one tree; one tie at most closes it to a loop."""
    graph = edges(feeder)
    every_bus = [name for _, name in edge_ends(feeder)]
    trees = forest(graph, [feeder.source.bus, *every_bus])
    _check_islands(feeder, trees[1:], report)
    for tree in trees:
        _check_loops(graph, tree, report)
    ties = [index for index, switch in enumerate(feeder.switches) if not switch.closed]
    for index in ties[1:]:
        first = feeder.switches[ties[0]].name
        rule = f"must not be a second tie beside {first!r}: one loop is solved, not several"
        report.add(("switches", index), rule)


def _check_islands(feeder: Feeder, islands: Iterable[Tree], report: Report) -> None:
    """Report each group of buses that the source does not reach, at its first part."""
    for island in islands:
        path = next(path for path, name in edge_ends(feeder) if name in island)
        found = ", ".join(repr(bus) for bus in island)
        rule = f"must be connected with {feeder.source.bus!r} while ties are open"
        report.add(path, rule, found if len(found) < 60 else f"{len(island)} buses apart")


def _check_loops(graph: Iterable[Edge], tree: Tree, report: Report) -> None:
    """Report each edge that closes a loop, and what it runs through."""
    grown = {before[1].path for before in tree.values() if before is not None}
    for edge in graph:
        if edge.ends[0] in tree and edge.path not in grown:
            _, others = tree_path(tree, *edge.ends)
            loop = ", ".join(repr(other.name) for other in others)
            report.add(edge.path, f"must not close a loop while ties are open, here with {loop}")


def check_section_paths(feeder: Feeder, report: Report) -> None:
    """Between the points of a section there is line, and no source."""
    tree = forest(edges(feeder), [feeder.source.bus])[0]
    points: Mapping[str, Point] = {point.name: point for point in feeder.points}
    for index, section in enumerate(feeder.sections):
        pair = (points[section.local], points[section.remote])
        passed, taken = tree_path(tree, pair[0].bus, pair[1].bus)
        between = {edge.name for edge in taken if edge.is_line}
        inside = [bus for bus in passed if bus not in {p.bus for p in pair if p.line in between}]
        if not between:
            report.add(("sections", index), "must have a line between its points")
        elif feeder.source.bus in inside:
            report.add(("sections", index), "must not have the source between its points")
