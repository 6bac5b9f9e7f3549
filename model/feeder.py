"""Checks that concern more than one part of a feeder, and the door that applies them.

A `Feeder` that came through `make_feeder` or `checked_feeder` has unique names, no loose
reference, and a graph that is a tree while its ties are open.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from .errors import KeyPath, Report
from .feeder_document import document_from_feeder, feeder_from_document
from .feeder_fields import TABLES
from .fields import did_you_mean
from .parts import Feeder, Line, Load, Place, Point, Section, Source, Switch, Transformer
from .topology import Edge, Tree, buses, edges, forest, tree_path

__all__ = ["STUB_SUFFIXES", "buses", "checked_feeder", "make_feeder"]

STUB_SUFFIXES = (".p", ".q")
"""What a broken line's name gets to name its stubs: source side, load side."""


def make_feeder(  # noqa: PLR0913 - one argument for each field of Feeder
    *,
    name: str,
    source: Source,
    lines: Sequence[Line],
    transformers: Sequence[Transformer] = (),
    loads: Sequence[Load] = (),
    switches: Sequence[Switch] = (),
    points: Sequence[Point] = (),
    sections: Sequence[Section] = (),
) -> Feeder:
    """Return a feeder built in a program, checked like one from a file.

    Raises
    ------
    InputError
        With every fault of the parts, on their own and together.
    """
    feeder = Feeder(
        name=name,
        source=source,
        lines=tuple(lines),
        transformers=tuple(transformers),
        loads=tuple(loads),
        switches=tuple(switches),
        points=tuple(points),
        sections=tuple(sections),
    )
    document = document_from_feeder(feeder)
    return checked_feeder(Report(source=name, document=document))


def checked_feeder(report: Report) -> Feeder:
    """Return the feeder that the report's document describes.

    Raises
    ------
    InputError
        With every fault of the document.
    """
    feeder = feeder_from_document(report.document, report)
    _check_names(feeder, report)
    _check_references(feeder, report)
    _check_edges(feeder, report)
    _check_transformers(feeder.transformers, report)
    _check_point_ends(feeder, report)
    _check_section_ends(feeder.sections, report)
    if _graph_is_known(report):
        _check_graph(feeder, report)
    if not report.faults:
        _check_section_paths(feeder, report)
    report.raise_if_any()
    return feeder


# ---- names and references; an empty name is a stand-in for one already reported ----


def _check_names(feeder: Feeder, report: Report) -> None:
    """Names are unique in their table and leave room for those made from them."""
    if "/" in feeder.name or "\\" in feeder.name or feeder.name in {".", ".."}:
        report.add(("name",), "must do as the name of a folder", repr(feeder.name))
    for table, names in _names(feeder).items():
        seen: set[str] = set()
        for index, name in enumerate(names):
            if name in seen:
                report.add((table, index, "name"), f"must be unique among the {table}", repr(name))
            seen.update([name] if name else [])
    for path, name in [
        *((("lines", index, "name"), line.name) for index, line in enumerate(feeder.lines)),
        *_edge_ends(feeder),
    ]:
        if name.endswith(STUB_SUFFIXES):
            rule = "must not end in '.p' or '.q', which mark the stubs of a broken line"
            report.add(path, rule, repr(name))


def _names(feeder: Feeder) -> dict[str, list[str]]:
    """Return the names in every table whose rows have one."""
    return {
        "lines": [line.name for line in feeder.lines],
        "transformers": [unit.name for unit in feeder.transformers],
        "loads": [load.name for load in feeder.loads],
        "switches": [switch.name for switch in feeder.switches],
        "points": [point.name for point in feeder.points],
    }


def _edge_ends(feeder: Feeder) -> list[tuple[KeyPath, str]]:
    """Return the buses that lines and switches imply, each with its key path."""
    found: list[tuple[KeyPath, str]] = []
    parts: dict[str, Sequence[Line | Switch]] = {
        "lines": feeder.lines,
        "switches": feeder.switches,
    }
    for table, rows in parts.items():
        for index, row in enumerate(rows):
            found.append(((table, index, "from"), row.from_bus))
            found.append(((table, index, "to"), row.to_bus))
    return found


def _check_references(feeder: Feeder, report: Report) -> None:
    """Every name that should be that of another part is."""
    names = {table: dict.fromkeys(found) for table, found in _names(feeder).items()}
    known_buses = dict.fromkeys(name for _, name in _edge_ends(feeder))

    def check(path: KeyPath, name: str | None, known: Collection[str], what: str) -> None:
        if name and name not in known and "" not in known:
            report.add(
                path, f"must be a {what} of the feeder{did_you_mean(name, known)}", repr(name)
            )

    def check_place(path: KeyPath, place: Place | None) -> None:
        if place is not None:
            check((*path, "bus"), place.bus, known_buses, "bus")
            check((*path, "line"), place.line, names["lines"], "line")

    check(("source", "bus"), feeder.source.bus, known_buses, "bus")
    for index, unit in enumerate(feeder.transformers):
        check_place(("transformers", index), unit.place)
    for index, load in enumerate(feeder.loads):
        path = ("loads", index)
        check((*path, "transformer"), load.transformer, names["transformers"], "transformer")
        check_place(path, load.place)
    for index, point in enumerate(feeder.points):
        check(("points", index, "bus"), point.bus, known_buses, "bus")
        check(("points", index, "line"), point.line, names["lines"], "line")
    for index, section in enumerate(feeder.sections):
        check(("sections", index, "local"), section.local, names["points"], "point")
        check(("sections", index, "remote"), section.remote, names["points"], "point")


# ---- each table by itself, but several fields at once ----


def _check_edges(feeder: Feeder, report: Report) -> None:
    """Lines and switches join two buses."""
    ends = _edge_ends(feeder)
    for (_, start), (path, end) in zip(ends[::2], ends[1::2], strict=True):
        if end and start == end:
            report.add(path, "must be another bus than from", repr(end))


def _check_transformers(transformers: Iterable[Transformer], report: Report) -> None:
    """Zero-sequence data fit the connection."""
    for index, unit in enumerate(transformers):
        path = ("transformers", index)
        if unit.x0_pu is not None and unit.connection != "Yg/Yg":
            rule = f"must be left out for {unit.connection}: it belongs to Yg/Yg"
            report.add((*path, "x0_pu"), rule, f"{unit.x0_pu!r}")
        if unit.connection == "Yg/D" and unit.leakage_pu == 0.0:
            rule = "must not be 0 for Yg/D, which would short the zero sequence to earth"
            report.add((*path, "leakage_pu"), rule)


def _check_point_ends(feeder: Feeder, report: Report) -> None:
    """A point stands at an end of its line, so never across an open switch from it."""
    ends = {line.name: (line.from_bus, line.to_bus) for line in feeder.lines}
    for index, point in enumerate(feeder.points):
        if point.bus and point.line in ends and "" not in ends[point.line]:
            start, end = ends[point.line]
            if point.bus not in (start, end):
                rule = f"must be an end of line {point.line!r}, {start!r} or {end!r}"
                report.add(("points", index, "bus"), rule, repr(point.bus))


def _check_section_ends(sections: Sequence[Section], report: Report) -> None:
    """A section has two points and stands in the file once."""
    pairs: list[set[str]] = []
    for index, section in enumerate(sections):
        pair = {section.local, section.remote}
        if "" not in pair and len(pair) == 1:
            rule = "must be another point than local"
            report.add(("sections", index, "remote"), rule, repr(section.remote))
        elif "" not in pair and pair in pairs:
            rule = "must be there once, in one direction; both terminals are judged anyway"
            report.add(("sections", index), rule, f"{section.local!r}, {section.remote!r} again")
        pairs.append(pair)


# ---- the graph ----


def _graph_is_known(report: Report) -> bool:
    """Tell whether no fault so far touches what joins what."""
    harmless = {
        field.name
        for table in ("source", "lines")
        for field in TABLES[table]
        if field.kind in ("number", "impedance") or field.name == "name"
    }
    return all(
        path[0] not in ("source", "lines", "switches") or path[-1] in harmless
        for path in report.paths
    )


def _check_graph(feeder: Feeder, report: Report) -> None:
    """In the normal state everything is one tree; one tie at most closes it to a loop."""
    graph = edges(feeder)
    every_bus = [name for _, name in _edge_ends(feeder)]
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
        path = next(path for path, name in _edge_ends(feeder) if name in island)
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


def _check_section_paths(feeder: Feeder, report: Report) -> None:
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
