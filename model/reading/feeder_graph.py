"""A feeder's graph: fed from the source with its ties open, and sections that lie well in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ..errors import KeyPath, Report
from ..parts import Feeder, Point, Regulator
from ..topology import Edge, Tree, edges, forest, shortest_path, tree_path
from .feeder_names import edge_ends

__all__ = ["check_graph", "check_section_paths", "graph_is_known"]

_EDGES = ("lines", "inline_transformers", "switches", "regulators")
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
    """In the normal state the source reaches every bus, and every loop has impedance."""
    graph = edges(feeder)
    every_bus = [name for _, name in edge_ends(feeder)]
    trees = forest(graph, [feeder.source.bus, *every_bus])
    _check_islands(feeder, trees[1:], report)
    _check_loops(feeder, graph, report)


def _check_islands(feeder: Feeder, islands: Iterable[Tree], report: Report) -> None:
    """Report each group of buses that the source does not reach, at its first part."""
    for island in islands:
        path = next(path for path, name in edge_ends(feeder) if name in island)
        found = ", ".join(repr(bus) for bus in island)
        rule = f"must be connected with {feeder.source.bus!r} while ties are open"
        report.add(path, rule, found if len(found) < 60 else f"{len(island)} buses apart")


def _check_loops(feeder: Feeder, graph: Iterable[Edge], report: Report) -> None:
    """Report what closes a loop in which nothing limits the current, and what with."""
    reported: set[KeyPath] = set()
    bare = [(edge, _without_impedance(feeder, edge)) for edge in graph if not edge.is_line]
    for phase in "abc":
        own = [edge for edge, phases in bare if phase in phases]
        grown = {
            before[1].path: tree
            for tree in forest(own, [edge.ends[0] for edge in own])
            for before in tree.values()
            if before is not None
        }
        trees = list(grown.values())
        for edge in own:
            if edge.path not in grown and edge.path not in reported:
                reported.add(edge.path)
                tree = next(tree for tree in trees if edge.ends[0] in tree)
                others = ", ".join(repr(other.name) for other in tree_path(tree, *edge.ends)[1])
                rule = f"must not close a loop without impedance, here with {others}"
                report.add(edge.path, rule)


def _without_impedance(feeder: Feeder, edge: Edge) -> str:
    """The phases in which a switch or regulator has no impedance."""
    table, index = edge.path
    assert isinstance(index, int)
    if table == "switches":
        return feeder.switches[index].phases
    if table == "regulators":
        regulator = feeder.regulators[index]
        bare = regulator.phases if regulator.z_ohm == 0.0 else ""
        return bare + regulator.reference if _jumps(regulator) else bare
    return ""


def _jumps(regulator: Regulator) -> bool:
    """Whether a phase goes through it without impedance, beside its units."""
    own = regulator.reference in "abc" and regulator.reference not in regulator.phases
    return own and regulator.jumper_ohm == 0.0


def check_section_paths(feeder: Feeder, report: Report) -> None:
    """Between the points of a section there is line, and no source.

    The way between them is the shortest by its number of lines, switches, regulators and
    transformers; of several that over the lines of the points themselves.
    """
    graph = edges(feeder)
    points: Mapping[str, Point] = {point.name: point for point in feeder.points}
    for index, section in enumerate(feeder.sections):
        pair = (points[section.local], points[section.remote])
        lines = {point.line for point in pair}
        passed, taken = shortest_path(graph, pair[0].bus, pair[1].bus, lines)
        between = {edge.name for edge in taken if edge.is_line}
        inside = [bus for bus in passed if bus not in {p.bus for p in pair if p.line in between}]
        if not between:
            report.add(("sections", index), "must have a line between its points")
        elif feeder.source.bus in inside:
            report.add(("sections", index), "must not have the source between its points")
