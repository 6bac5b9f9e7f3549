"""Where the parts of a feeder stand in its schematic: km from the source, and rows of branches."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

from ...model.parts import Feeder, Place
from ...model.topology import Tree, edges, forest, tree_path

__all__ = ["FeederLayout", "Mark", "Tie", "Wire", "lay_out"]

GAP = 0.018  #: of the feeder's reach, between a bus and the mark of a point at it


@dataclass(frozen=True, slots=True, kw_only=True)
class Wire:
    """A line, or a closed switch: from a bus down to its row, then along it."""

    name: str
    is_line: bool
    start_km: float
    stop_km: float
    from_row: int
    row: int
    sections: tuple[int, ...]  #: numbers of the sections whose path it is on


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """Something that stands at a place."""

    text: str
    km: float
    row: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Tie:
    """An open switch between two buses."""

    name: str
    ends: tuple[tuple[float, int], tuple[float, int]]  #: km and row
    at_row_ends: bool  #: nothing goes on beyond either end


@dataclass(frozen=True, slots=True, kw_only=True)
class FeederLayout:
    """A feeder laid out as a tree."""

    name: str
    source: str
    sections: tuple[str, ...]
    wires: tuple[Wire, ...]
    units: tuple[Mark, ...]  #: transformers, and all else that stands on the feeder
    kinds: tuple[str, ...]  #: what they are
    joints: tuple[str, ...]  #: what joins two buses without any length
    points: tuple[Mark, ...]
    ties: tuple[Tie, ...]
    reach_km: float
    rows: int


def lay_out(feeder: Feeder) -> FeederLayout:
    """Lay out ``feeder``: the longest way on from every bus stays in its row."""
    tree = forest(edges(feeder), [feeder.source.bus])[0]
    km = _distances(feeder, tree)
    row = _rows(tree, km)
    wires = _wires(feeder, tree, km, row)
    by_line = {wire.name: wire for wire in wires if wire.is_line}
    reach = max(km.values())
    # the last bus of a row
    ends = {r: max((b for b in row if row[b] == r), key=lambda b: km[b]) for r in row.values()}
    return FeederLayout(
        name=feeder.name,
        source=feeder.source.bus,
        sections=tuple(f"{s.local}–{s.remote}" for s in feeder.sections),
        wires=wires,
        units=_units(feeder, by_line, km, row),
        kinds=_kinds(feeder),
        joints=_joints(feeder),
        points=tuple(
            Mark(
                text=p.name, km=_beside(by_line[p.line], km[p.bus], reach), row=by_line[p.line].row
            )
            for p in feeder.points
        ),
        ties=tuple(
            Tie(
                name=s.name,
                ends=((km[s.from_bus], row[s.from_bus]), (km[s.to_bus], row[s.to_bus])),
                at_row_ends=all(ends[row[b]] == b for b in (s.from_bus, s.to_bus)),
            )
            for s in feeder.switches
            if not s.closed
        ),
        reach_km=reach,
        rows=1 + max(row.values()),
    )


def _distances(feeder: Feeder, tree: Tree) -> dict[str, float]:
    """Km of every bus from the source."""
    lengths = {line.name: line.length_km for line in feeder.lines}
    km: dict[str, float] = {}
    for bus, before in tree.items():
        if before is None:
            km[bus] = 0.0
        else:
            up, edge = before
            km[bus] = km[up] + (lengths[edge.name] if edge.is_line else 0.0)
    return km


def _rows(tree: Tree, km: dict[str, float]) -> dict[str, int]:
    """Row of every bus. A branch's rows lie together, so no wire crosses another."""
    children: defaultdict[str, list[str]] = defaultdict(list)
    farthest = dict(km)
    for bus, before in reversed(tree.items()):
        if before is not None:
            children[before[0]].insert(0, bus)
            farthest[before[0]] = max(farthest[before[0]], farthest[bus])
    row: dict[str, int] = {}
    used = 0
    waiting: list[tuple[str, int | None]] = [(next(iter(tree)), 0)]
    while waiting:
        bus, given = waiting.pop()
        if given is None:
            used += 1
            given = used
        row[bus] = given
        onward = sorted(children[bus], key=lambda b: -farthest[b])
        waiting += reversed([(b, None if n else given) for n, b in enumerate(onward)])
    return row


def _wires(
    feeder: Feeder, tree: Tree, km: dict[str, float], row: dict[str, int]
) -> tuple[Wire, ...]:
    on: defaultdict[str, list[int]] = defaultdict(list)
    bus_of = {point.name: point.bus for point in feeder.points}
    for n, section in enumerate(feeder.sections):
        for edge in tree_path(tree, bus_of[section.local], bus_of[section.remote])[1]:
            on[edge.name].append(n)
    return tuple(
        Wire(
            name=edge.name,
            is_line=edge.is_line,
            start_km=km[up],
            stop_km=km[bus],
            from_row=row[up],
            row=row[bus],
            sections=tuple(on[edge.name]) if edge.is_line else (),
        )
        for bus, (up, edge) in ((b, before) for b, before in tree.items() if before is not None)
    )


def _beside(wire: Wire, bus_km: float, reach_km: float) -> float:
    """Km of a point's mark: a little into its line."""
    gap = min(GAP * reach_km, 0.3 * (wire.stop_km - wire.start_km))
    return bus_km + gap if bus_km == wire.start_km else bus_km - gap


def _units(
    feeder: Feeder, by_line: dict[str, Wire], km: dict[str, float], row: dict[str, int]
) -> tuple[Mark, ...]:
    from_bus = {line.name: line.from_bus for line in feeder.lines}

    def stands(place: Place) -> tuple[float, int]:
        if place.bus is not None:
            return km[place.bus], row[place.bus]
        assert place.line is not None
        assert place.at is not None
        wire = by_line[place.line]
        near_is_from = km[from_bus[place.line]] == wire.start_km
        share = place.at if near_is_from else 1.0 - place.at
        return wire.start_km + share * (wire.stop_km - wire.start_km), wire.row

    at: defaultdict[tuple[float, int], list[str]] = defaultdict(list)
    for place, text in _labels(feeder):
        at[stands(place)].append(text)
    return tuple(Mark(text="\n".join(texts), km=x, row=r) for (x, r), texts in sorted(at.items()))


def _kinds(feeder: Feeder) -> tuple[str, ...]:
    """What stands on the feeder; what hangs on a transformer is part of that."""
    there = {
        "transformer": bool(feeder.transformers),
        "load": any(load.place is not None for load in feeder.loads),
        "DER": any(der.place is not None for der in feeder.ders),
        "capacitor": bool(feeder.capacitors),
        "regulator": bool(feeder.regulators),
    }
    return tuple(kind for kind, stands in there.items() if stands)


def _joints(feeder: Feeder) -> tuple[str, ...]:
    """What the squares within the wires are."""
    closed = any(switch.closed for switch in feeder.switches)
    there = {"closed switch": closed, "regulator": bool(feeder.regulators)}
    return tuple(kind for kind, stands in there.items() if stands)


def _labels(feeder: Feeder) -> list[tuple[Place, str]]:
    """What stands where, with its size; what hangs on a transformer is added up there."""
    behind: defaultdict[str, dict[str, float]] = defaultdict(lambda: {"kW": 0.0})
    for load in feeder.loads:
        if load.transformer is not None:
            behind[load.transformer]["kW"] += load.kw
    for der in feeder.ders:
        if der.transformer is not None:
            own = behind[der.transformer]
            own["kW DER"] = own.get("kW DER", 0.0) + der.kw
    found: list[tuple[Place, str]] = []
    for unit in feeder.transformers:
        sizes = "\n".join(f"{size:g} {of}" for of, size in behind[unit.name].items())
        found.append((unit.place, f"{unit.name}\n{unit.connection}\n{sizes}"))
    for load in feeder.loads:
        if load.place is not None:
            found.append((load.place, f"{load.name}\n{load.connection}\n{load.kw:g} kW"))
    for der in feeder.ders:
        if der.place is not None:
            found.append((der.place, f"{der.name}\n{der.kw:g} kW DER"))
    for bank in feeder.capacitors:
        found.append((bank.place, f"{bank.name}\n{bank.connection}\n{bank.kvar:g} kvar"))
    for regulator in feeder.regulators:
        found.append((Place(bus=regulator.to_bus), f"{regulator.name}\nregulator"))
    return found
