"""Which buses may be folded, and to which bus: all that hangs on the kept part by one bus alone."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator

from ..buses import bus_phases, bus_volts
from ..parts import (
    Capacitor,
    Feeder,
    InlineTransformer,
    Line,
    Place,
    Regulator,
    Switch,
    Transformer,
)

__all__ = ["fold_roots", "kept_by_default"]

LOW_VOLTAGE_V = 1000.0 / 3.0**0.5
"""Nominal phase-to-earth voltage up to which a bus is low voltage."""

_Ended = Line | Switch | Regulator | InlineTransformer
_Graph = dict[str, list[tuple[str, int]]]


def kept_by_default(feeder: Feeder) -> set[str]:
    """Buses that folding never takes, beside those on a way between two of them.

    All three-phase buses of medium voltage (the places where a measuring point may stand), and
    the buses of whatever an event or a control may act on: points, switches, regulators,
    capacitors, DER, distribution transformers, three-phase in-line transformers.
    """
    volts, phases = bus_volts(feeder), bus_phases(feeder)
    all_low = feeder.source.v_phase_v <= LOW_VOLTAGE_V * (1.0 + 1e-9)
    low = {bus for bus, v in volts.items() if v <= LOW_VOLTAGE_V * (1.0 + 1e-9) and not all_low}
    kept = {bus for bus, mask in phases.items() if mask == 0b111 and bus not in low}
    kept.add(feeder.source.bus)
    ends = {line.name: (line.from_bus, line.to_bus) for line in feeder.lines}
    acted_on: list[_Ended] = [*feeder.switches, *feeder.regulators, *_three_phase(feeder)]
    for part in acted_on:
        kept |= {part.from_bus, part.to_bus}
    for point in feeder.points:
        kept |= {point.bus, *ends[point.line]}
    for place in _places(feeder):
        if place.bus is not None:
            kept.add(place.bus)
        else:
            assert place.line is not None
            kept |= set(ends[place.line])
    return kept


def _three_phase(feeder: Feeder) -> Iterator[InlineTransformer]:
    """In-line transformers that are three-phase, or units of a bank."""
    rows: defaultdict[frozenset[str], list[InlineTransformer]] = defaultdict(list)
    for unit in feeder.inline_transformers:
        rows[frozenset((unit.from_bus, unit.to_bus))].append(unit)
    for bank in rows.values():
        if len(bank) > 1 or bank[0].connection not in ("single", "centre-tap"):
            yield from bank


def _places(feeder: Feeder) -> Iterator[Place]:
    """Where parts stand that are kept, and loads that stand on a line."""
    placed: list[Transformer | Capacitor] = [*feeder.transformers, *feeder.capacitors]
    for part in placed:
        yield part.place
    for der in feeder.ders:
        if der.place is not None:
            yield der.place
    for load in feeder.loads:
        if load.place is not None and load.place.line is not None:
            yield load.place


def fold_roots(feeder: Feeder, kept: Iterable[str]) -> dict[str, str]:
    """Return every bus that can be folded, with the bus that it folds to.

    A bus stays if it is in ``kept`` or on a way between two that are, whatever is switched.
    What remains hangs on those that stay by a single bus, loops of its own included.
    """
    joined = _graph(feeder)
    wanted = set(kept) | {feeder.source.bus}
    order, before, lowest = _depth_first(joined, feeder.source.bus)
    number = {bus: n for n, bus in enumerate(order)}
    needed = set(wanted)
    for bus in reversed(order):
        if bus in needed and before[bus] is not None:
            needed.add(str(before[bus]))
    root: dict[str, str] = {}
    for bus in order:
        above = before[bus]
        if above is None:
            continue
        if above in root:
            root[bus] = root[above]
        elif bus not in needed and lowest[bus] >= number[above]:
            root[bus] = above
    return root


def _graph(feeder: Feeder) -> _Graph:
    joined: defaultdict[str, list[tuple[str, int]]] = defaultdict(list)
    parts: list[_Ended] = [
        *feeder.lines,
        *feeder.switches,
        *feeder.regulators,
        *feeder.inline_transformers,
    ]
    for index, part in enumerate(parts):
        joined[part.from_bus].append((part.to_bus, index))
        joined[part.to_bus].append((part.from_bus, index))
    return joined


def _depth_first(
    joined: _Graph, start: str
) -> tuple[list[str], dict[str, str | None], dict[str, int]]:
    """Buses in depth-first order, the one before each, and the first that its branch gets back to.

    The latter is the order number of the earliest bus that an edge joins to the bus or to anything
    behind it.
    """
    order: list[str] = [start]
    number = {start: 0}
    before: dict[str, str | None] = {start: None}
    lowest = {start: 0}
    path = [(start, -1, iter(joined[start]))]
    while path:
        bus, by, ways = path[-1]
        for far, edge in ways:
            if edge == by:
                continue
            if far in number:
                lowest[bus] = min(lowest[bus], number[far])
                continue
            number[far] = lowest[far] = len(order)
            order.append(far)
            before[far] = bus
            path.append((far, edge, iter(joined[far])))
            break
        else:
            path.pop()
            above = before[bus]
            if above is not None:
                lowest[above] = min(lowest[above], lowest[bus])
    return order, before, lowest
