"""Phases and nominal voltages: what stands at a bus finds there what it needs.

The phases of a bus are those that some way from the source brings, every switch closed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..buses import bus_phases, bus_volts, fed_backwards, to_side_volts
from ..errors import KeyPath, Report
from ..parts import Capacitor, Der, Feeder, Line, Load, Place, Regulator, Switch, Transformer
from ..phases import conductors, letters, phase_mask
from ..reactors import is_reactor

__all__ = ["check_phases", "check_volts"]

_ALL = 0b111
_MAKING = ("phases", "to_phases", "connection", "reference")
"""Fields that decide which phases are where."""

_TOLERANCE = 0.2
"""Two nominal voltages of a bus may differ by this much: 120 V from a leg of 240 V to earth
and 139 V as its share of 240 V between phases are both right in a four-wire delta."""


def check_phases(feeder: Feeder, report: Report) -> None:
    """Everything is connected to phases that are there; nothing is said of buses apart."""
    if any(path[-1] in _MAKING for path in report.paths):
        return
    there = bus_phases(feeder)
    lines = {line.name: line for line in feeder.lines}
    _check_joining(feeder, there, report)
    hanging: dict[str, Sequence[Transformer | Der | Load | Capacitor]] = {
        "transformers": feeder.transformers,
        "loads": feeder.loads,
        "ders": feeder.ders,
        "capacitors": feeder.capacitors,
    }
    for table, parts in hanging.items():
        for index, part in enumerate(parts):
            mask = None if part.place is None else _at(part.place, there, lines)
            if mask is None:
                continue
            if isinstance(part, (Load, Capacitor)):
                _require((table, index, "phases"), part.phases, mask, report)
            elif mask != _ALL:
                rule = "must stand where three phases are"
                report.add((table, index), rule, f"{letters(mask)} there")
    for index, point in enumerate(feeder.points):
        if point.line in lines and is_reactor(feeder, lines[point.line]):
            rule = "must be a line: no measuring point stands on a series reactor"
            report.add(("points", index, "line"), rule, repr(point.line))
        elif point.line in lines and lines[point.line].phases not in _ORDERS:
            phases = lines[point.line].phases
            rule = (
                "must be a line of three phases, whose sequence components a point measures:"
                f" this has {_named(phases)}"
            )
            report.add(("points", index, "line"), rule, repr(point.line))


_ORDERS = ("abc", "acb", "bac", "bca", "cab", "cba")


def _check_joining(feeder: Feeder, there: Mapping[str, int], report: Report) -> None:
    """What joins two buses has no phase that neither of them has."""
    joining: dict[str, Sequence[Line | Switch | Regulator]] = {
        "lines": feeder.lines,
        "switches": feeder.switches,
        "regulators": feeder.regulators,
    }
    for table, parts in joining.items():
        for n, part in enumerate(parts):
            phases = conductors(part) if isinstance(part, Regulator) else part.phases
            # a bus that no phase reaches at all is the fault of what leads there
            bus = part.from_bus if part.from_bus in there else part.to_bus
            _require((table, n, "phases"), phases, there.get(bus, _ALL), report)
    for n, unit in enumerate(feeder.inline_transformers):
        path = ("inline_transformers", n)
        _require((*path, "phases"), unit.phases, there.get(unit.from_bus, _ALL), report)
        _require((*path, "to_phases"), unit.to_phases, there.get(unit.to_bus, _ALL), report)


def _require(path: KeyPath, wanted: str, there: int, report: Report) -> None:
    """Report phases that are not there."""
    if phase_mask(wanted) & ~there:
        rule = f"must be among those that the source reaches there ({_named(letters(there))})"
        report.add(path, rule, repr(wanted))


def _named(phases: str) -> str:
    return " and ".join(phases) if len(phases) < 3 else ", ".join(phases)


def _at(place: Place, there: Mapping[str, int], lines: Mapping[str, Line]) -> int | None:
    """The phases of a place, None where it is unknown; a tee has those of its line."""
    if place.bus is not None:
        return there.get(place.bus)
    line = lines.get(place.line or "")
    if line is None or line.from_bus not in there:
        return None
    end = {0.0: line.from_bus, 1.0: line.to_bus}.get(place.at or 0.0)
    return phase_mask(line.phases) if end is None else there.get(end)


def check_volts(feeder: Feeder, report: Report) -> None:
    """Every way to a bus brings the same nominal voltage."""
    if any(path[-1] in ("kv_ll", "kv_from", "kv_to", *_MAKING) for path in report.paths):
        return
    volts = bus_volts(feeder)
    backwards = fed_backwards(feeder)
    ways: list[tuple[KeyPath, str, float]] = []
    for table in ("lines", "switches", "regulators"):
        for index, part in enumerate(getattr(feeder, table)):
            if part.from_bus in volts:
                ways.append(((table, index), part.to_bus, volts[part.from_bus]))
    for index, unit in enumerate(feeder.inline_transformers):
        if unit.from_bus in volts and unit.name not in backwards:
            ways.append((("inline_transformers", index, "kv_to"), unit.to_bus, to_side_volts(unit)))
    for path, bus, brought in ways:
        if abs(brought - volts[bus]) > _TOLERANCE * volts[bus]:
            rule = (
                f"must bring the {volts[bus] / 1000.0:.4g} kV to earth that bus {bus!r} has already"
            )
            report.add(path, rule, f"{brought / 1000.0:.4g} kV")
