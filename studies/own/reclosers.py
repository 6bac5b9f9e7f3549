"""Measuring points at existing reclosers, by a table of the user's own: columns name and bus."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast, get_args

from ...model.parts import Feeder, Line, Point, Regulator, Switch, VoltageSide
from ...model.points import fed_by_its_points
from ...model.reactors import is_reactor
from ...model.reading.fields import did_you_mean
from ...model.zones import adjacent_sections, outwards
from .match import Match, by_name
from .rows import OwnTable, read_table

__all__ = ["OwnPoints", "read_points", "with_points"]

COLUMNS = ("name", "bus", "line", "voltage_side")
PREFIXES = ("line.", "fuse.", "recloser.", "relay.", "swtcontrol.")
SIDES = get_args(VoltageSide)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Where:
    """What is known of the feeder's lines, to place points on them."""

    buses: tuple[str, ...]
    lines: Mapping[str, Line]
    reactors: frozenset[str]  #: names of lines on which no point stands
    at: Mapping[str, Sequence[Line]]  #: other lines by either bus
    order: Mapping[str, int]  #: of buses as the source feeds them, one after the other
    across: Mapping[str, Sequence[str]]  #: buses beyond the closed switches of each

    def around(self, bus: str) -> list[str]:
        """Return the bus, and those that only a closed switch parts from it."""
        return [bus, *self.across.get(bus, ())]


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnPoints:
    """The table as it was read, names not looked up yet."""

    source: str
    rows: tuple[Point, ...]
    ignored: tuple[str, ...]  #: columns without meaning here


def read_points(path: Path) -> OwnPoints:
    """Read a CSV file of measuring points.

    The columns are ``name`` and ``bus``, and perhaps ``line`` and ``voltage_side``.

    Raises
    ------
    InputError
        With all faults of the file.
    """
    table = read_table(path)
    rows = _read(table)
    return OwnPoints(source=table.name, rows=tuple(rows), ignored=table.others_than(COLUMNS))


def with_points(feeder: Feeder, own: OwnPoints) -> tuple[Feeder, Match]:
    """Give the feeder the measuring points of a table, and the sections between neighbours.

    Without a line the point stands on the only three-phase line that leads from the bus away from
    the source, or at the end of the only one that ends there; a closed switch between the bus and
    the line, such as a fuse, does not count. A ``line`` may also name a switch or a regulator of
    the bus: the point then stands on the line behind it. These points take the place of all that
    the feeder had.
    """
    where = _where(feeder)
    points: list[Point] = []
    not_joined: list[tuple[str, str]] = []
    for point in own.rows:
        found = _placed(feeder, where, point)
        taken = [p.name for p in points if isinstance(found, Point) and _same_place(p, found)]
        if isinstance(found, str):
            not_joined.append((point.name, found))
        elif taken:
            not_joined.append((point.name, f"{taken[0]} stands at the same place"))
        else:
            points.append(found)
    sections, left_out = adjacent_sections(feeder, points)
    placed = replace(feeder, points=tuple(points), sections=sections)
    sections, not_fed = fed_by_its_points(placed)
    notes = [f"{len(sections)} sections between neighbouring points", *left_out, *not_fed]
    paired = {name for section in sections for name in (section.local, section.remote)}
    alone = [point.name for point in points if point.name not in paired]
    if alone:
        notes.append(f"in no section, without a neighbour: {', '.join(alone)}")
    if feeder.points:
        notes.append(f"they take the place of the feeder's {len(feeder.points)} points")
    if own.ignored:
        notes.append(f"columns without meaning here: {', '.join(own.ignored)}")
    match = Match(
        source=own.source,
        what="measuring points",
        joined=tuple(point.name for point in points),
        not_joined=tuple(not_joined),
        without_row=(),
        notes=tuple(notes),
    )
    return replace(placed, sections=sections), match


def _read(table: OwnTable) -> list[Point]:
    """The rows as they stand, names not looked up yet."""
    table.needs("name", "bus")
    table.raise_if_any()
    rows: list[Point] = []
    for row in table.rows:
        side = row.cells.get("voltage_side", "").lower() or "line"
        point = Point(
            name=row.cells["name"],
            bus=row.cells["bus"],
            line=row.cells.get("line", ""),
            voltage_side=cast(VoltageSide, side),
        )
        if not point.name or ":" in point.name or not point.name.isprintable():
            rule = "must hold a name without ':' or control characters"
            table.fault(row.line, "column 'name'", rule, repr(point.name))
        elif any(point.name == other.name for other in rows):
            table.fault(row.line, "column 'name'", "must be there once", repr(point.name))
        if not point.bus:
            table.fault(row.line, "column 'bus'", "must hold a name")
        if side not in SIDES:
            rule = f"must be {' or '.join(SIDES)}"
            table.fault(row.line, "column 'voltage_side'", rule, repr(side))
        rows.append(point)
    table.raise_if_any()
    return rows


def _where(feeder: Feeder) -> _Where:
    at: defaultdict[str, list[Line]] = defaultdict(list)
    reactors = frozenset(line.name for line in feeder.lines if is_reactor(feeder, line))
    for line in feeder.lines:
        if line.name not in reactors:
            at[line.from_bus].append(line)
            at[line.to_bus].append(line)
    across: defaultdict[str, list[str]] = defaultdict(list)
    for switch in feeder.switches:
        if switch.closed:
            across[switch.from_bus].append(switch.to_bus)
            across[switch.to_bus].append(switch.from_bus)
    order = {bus: n for n, bus in enumerate(outwards(feeder))}
    buses = dict.fromkeys([*order, *at])
    return _Where(
        buses=tuple(buses),
        lines={line.name: line for line in feeder.lines},
        reactors=reactors,
        at=at,
        order=order,
        across=across,
    )


def _placed(feeder: Feeder, where: _Where, row: Point) -> Point | str:
    """The point on its line, or why it cannot be placed."""
    name = by_name(where.buses, row.bus)
    if name is None:
        # OpenDSS writes the phases behind the name
        name = by_name(where.buses, row.bus.partition(".")[0])
    if name is None:
        return f"no bus is called {row.bus!r}{did_you_mean(row.bus, where.buses)}"
    row = replace(row, bus=name)
    if not row.line:
        return _on_only_line(where, row)
    wanted = row.line
    for prefix in PREFIXES:
        if wanted.lower().startswith(prefix):
            wanted = wanted[len(prefix) :]
    line = by_name(tuple(where.lines), wanted)
    if line is not None:
        return _on_line(where, where.lines[line], row)
    joints: dict[str, Switch | Regulator] = {part.name: part for part in feeder.switches}
    joints |= {part.name: part for part in feeder.regulators}
    joint = by_name(tuple(joints), wanted)
    if joint is None:
        near = did_you_mean(wanted, where.lines)
        return f"no line is called {row.line!r}{near}"
    ends = (joints[joint].from_bus, joints[joint].to_bus)
    if row.bus not in ends:
        return f"{joint} does not end at {row.bus}"
    behind = max(ends, key=lambda bus: where.order.get(bus, -1))
    return _on_only_line(where, replace(row, bus=behind))


def _on_line(where: _Where, line: Line, row: Point) -> Point | str:
    ends = [bus for bus in where.around(row.bus) if bus in (line.from_bus, line.to_bus)]
    if not ends:
        return f"line {line.name} does not end at {row.bus}"
    if line.name in where.reactors:
        return f"{line.name} is a series reactor; a point stands on a line"
    if len(line.phases) < 3:
        return f"line {line.name} has phases {line.phases} only; a point measures three"
    return replace(row, bus=ends[0], line=line.name)


def _on_only_line(where: _Where, row: Point) -> Point | str:
    """On the only three-phase line away from the source, else at the end of the only one."""
    if row.bus not in where.order:
        return f"nothing feeds {row.bus} while the open switches are open"
    whole = [
        (bus, line)
        for bus in where.around(row.bus)
        for line in where.at.get(bus, ())
        if len(line.phases) == 3
    ]

    def leads_on(bus: str, line: Line) -> bool:
        far = line.to_bus if line.from_bus == bus else line.from_bus
        return where.order.get(far, -1) > where.order.get(bus, -1) >= where.order[row.bus]

    onwards = [(bus, line) for bus, line in whole if leads_on(bus, line)]
    if not whole:
        return f"no three-phase line ends at {row.bus}"
    if len(onwards) > 1 or (not onwards and len(whole) > 1):
        names = ", ".join(line.name for _, line in onwards or whole)
        return f"several lines leave {row.bus}: the column line must name one of {names}"
    bus, line = (onwards or whole)[0]
    return replace(row, bus=bus, line=line.name)


def _same_place(one: Point, other: Point) -> bool:
    return (one.bus, one.line) == (other.bus, other.line)
