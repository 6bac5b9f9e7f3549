"""Buses that nothing but capacitance holds to earth."""

from __future__ import annotations

from ..parts import Feeder, InlineTransformer

__all__ = ["unearthed_buses"]


def unearthed_buses(feeder: Feeder) -> frozenset[str]:
    """Return the buses whose voltage to earth only charging, or nothing, determines.

    They are joined among themselves by lines, switches and regulators, and to the rest by
    windings without an earthed neutral.
    """
    root: dict[str, str] = {}

    def find(bus: str) -> str:
        root.setdefault(bus, bus)
        while root[bus] != bus:
            root[bus] = root[root[bus]]
            bus = root[bus]
        return bus

    ends = [(line.from_bus, line.to_bus) for line in feeder.lines]
    ends += [(regulator.from_bus, regulator.to_bus) for regulator in feeder.regulators]
    ends += [(switch.from_bus, switch.to_bus) for switch in feeder.switches if switch.closed]
    for start, end in ends:
        root[find(start)] = find(end)
    earthed = set() if feeder.source.neutral == "isolated" else {find(feeder.source.bus)}
    for unit in feeder.inline_transformers:
        here, there = _earths(unit)
        earthed |= {find(unit.from_bus)} if here else set()
        earthed |= {find(unit.to_bus)} if there else set()
        find(unit.from_bus)
        find(unit.to_bus)
    shunts = [(load.connection, load.place) for load in feeder.loads]
    shunts += [(bank.connection, bank.place) for bank in feeder.capacitors]
    for connection, place in shunts:
        if connection == "wye" and place is not None and place.bus is not None:
            earthed.add(find(place.bus))
    return frozenset(bus for bus in root if find(bus) not in earthed)


def _earths(unit: InlineTransformer) -> tuple[bool, bool]:
    """Tell on which sides a transformer has a way to earth."""
    if unit.connection == "centre-tap":
        return len(unit.phases) == 1, True
    if unit.connection == "single":
        return len(unit.phases) == 1, len(unit.to_phases) == 1
    here, _, there = unit.connection.partition("/")
    return here == "Yg", there == "Yg"
