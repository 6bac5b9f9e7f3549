"""Names of a feeder's parts: unique, no loose reference, and ends that meet."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ..errors import KeyPath, Report
from ..parts import (
    Der,
    Feeder,
    InlineTransformer,
    Line,
    Load,
    Place,
    Regulator,
    Section,
    Switch,
)
from .feeder_fields import ROWS
from .fields import did_you_mean

__all__ = ["STUB_SUFFIXES", "check_ends", "check_names", "check_references", "edge_ends"]

STUB_SUFFIXES = (".p", ".q")
"""What a broken line's name gets to name its stubs: source side, load side."""

# An empty name is a stand-in for one already reported.


def check_names(feeder: Feeder, report: Report) -> None:
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
        *edge_ends(feeder),
    ]:
        if name.endswith(STUB_SUFFIXES):
            rule = "must not end in '.p' or '.q', which mark the stubs of a broken line"
            report.add(path, rule, repr(name))


def _names(feeder: Feeder) -> dict[str, list[str]]:
    """Return the names in every table whose rows have one."""
    return {
        table: [part.name for part in getattr(feeder, table)]
        for table, fields in ROWS.items()
        if fields[0].name == "name"
    }


def edge_ends(feeder: Feeder) -> list[tuple[KeyPath, str]]:
    """Return the buses that what joins them implies, each with its key path."""
    found: list[tuple[KeyPath, str]] = []
    parts: dict[str, Sequence[Line | InlineTransformer | Switch | Regulator]] = {
        "lines": feeder.lines,
        "inline_transformers": feeder.inline_transformers,
        "switches": feeder.switches,
        "regulators": feeder.regulators,
    }
    for table, rows in parts.items():
        for index, row in enumerate(rows):
            found.append(((table, index, "from"), row.from_bus))
            found.append(((table, index, "to"), row.to_bus))
    return found


def check_references(feeder: Feeder, report: Report) -> None:
    """Every name that should be that of another part is."""
    names = {table: dict.fromkeys(found) for table, found in _names(feeder).items()}
    known_buses = dict.fromkeys(name for _, name in edge_ends(feeder))

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
    for index, line in enumerate(feeder.lines):
        check(("lines", index, "code"), line.code, names["codes"], "code")
    for index, unit in enumerate(feeder.transformers):
        check_place(("transformers", index), unit.place)
    for index, bank in enumerate(feeder.capacitors):
        check_place(("capacitors", index), bank.place)
    hanging: dict[str, Sequence[Load | Der]] = {"loads": feeder.loads, "ders": feeder.ders}
    for table, parts in hanging.items():
        for index, part in enumerate(parts):
            path = (table, index)
            check((*path, "transformer"), part.transformer, names["transformers"], "transformer")
            check_place(path, part.place)
    for index, point in enumerate(feeder.points):
        check(("points", index, "bus"), point.bus, known_buses, "bus")
        check(("points", index, "line"), point.line, names["lines"], "line")
    for index, section in enumerate(feeder.sections):
        check(("sections", index, "local"), section.local, names["points"], "point")
        check(("sections", index, "remote"), section.remote, names["points"], "point")
    drawn: set[str] = set()
    for index, spot in enumerate(feeder.coordinates):
        check(("coordinates", index, "bus"), spot.bus, known_buses, "bus")
        if spot.bus in drawn:
            rule = "must be there once for each bus"
            report.add(("coordinates", index, "bus"), rule, repr(spot.bus))
        drawn.update([spot.bus] if spot.bus else [])


def check_ends(feeder: Feeder, report: Report) -> None:
    """Lines join two buses, sections two points, and points stand where they can measure."""
    ends = edge_ends(feeder)
    for (_, start), (path, end) in zip(ends[::2], ends[1::2], strict=True):
        if end and start == end:
            report.add(path, "must be another bus than from", repr(end))
    _check_point_ends(feeder, report)
    _check_section_ends(feeder.sections, report)


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
