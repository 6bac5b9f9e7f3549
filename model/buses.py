"""What phases every bus has, and its nominal voltage."""

from __future__ import annotations

from collections import defaultdict, deque

from .parts import Feeder, InlineTransformer, Line, Regulator, Switch
from .phases import conductors, phase_mask

__all__ = ["bus_phases", "bus_volts", "fed_backwards", "to_side_volts"]

ROOT = 3.0**0.5


def to_side_volts(unit: InlineTransformer) -> float:
    """Nominal phase-to-earth volts behind an in-line transformer, by its rating."""
    if unit.connection == "centre-tap":
        return unit.kv_to * 500.0
    if unit.connection == "single" and len(unit.to_phases) == 1:
        return unit.kv_to * 1000.0
    return unit.kv_to * 1000.0 / ROOT


def _from_side_volts(unit: InlineTransformer) -> float:
    """Nominal phase-to-earth volts before it, by its rating: for one fed from its to-side."""
    if unit.connection in ("single", "centre-tap") and len(unit.phases) == 1:
        return unit.kv_from * 1000.0
    return unit.kv_from * 1000.0 / ROOT


def _joining(feeder: Feeder) -> list[Line | Switch | Regulator]:
    """What joins two buses of one nominal voltage."""
    return [*feeder.lines, *feeder.switches, *feeder.regulators]


def bus_volts(feeder: Feeder) -> dict[str, float]:
    """Nominal phase-to-earth volts of every bus, all switches taken as closed."""
    return _volts(feeder)[0]


def fed_backwards(feeder: Feeder) -> set[str]:
    """In-line transformers whose to-side it is that gives their from-side its nominal volts."""
    return _volts(feeder)[1]


def _volts(feeder: Feeder) -> tuple[dict[str, float], set[str]]:
    joined: defaultdict[str, list[tuple[str, InlineTransformer | None, bool]]] = defaultdict(list)
    for part in _joining(feeder):
        joined[part.from_bus].append((part.to_bus, None, True))
        joined[part.to_bus].append((part.from_bus, None, False))
    for unit in feeder.inline_transformers:
        joined[unit.from_bus].append((unit.to_bus, unit, True))
        joined[unit.to_bus].append((unit.from_bus, unit, False))
    volts = {feeder.source.bus: feeder.source.v_phase_v}
    backwards: set[str] = set()
    waiting = deque([feeder.source.bus])
    while waiting:
        bus = waiting.popleft()
        for far, inline, onwards in joined[bus]:
            if far in volts:
                continue
            volts[far] = volts[bus]
            if inline is not None:
                volts[far] = to_side_volts(inline) if onwards else _from_side_volts(inline)
                backwards.update([] if onwards else [inline.name])
            waiting.append(far)
    return volts, backwards


def bus_phases(feeder: Feeder) -> dict[str, int]:
    """Bit mask of the phases that reach every bus from the source, all switches closed."""
    joined: defaultdict[str, list[tuple[str, int, int]]] = defaultdict(list)
    for part in _joining(feeder):
        mask = phase_mask(conductors(part) if isinstance(part, Regulator) else part.phases)
        joined[part.from_bus].append((part.to_bus, mask, 0))
        joined[part.to_bus].append((part.from_bus, mask, 0))
    for unit in feeder.inline_transformers:
        there, here = phase_mask(unit.to_phases), phase_mask(unit.phases)
        joined[unit.from_bus].append((unit.to_bus, here, there))
        joined[unit.to_bus].append((unit.from_bus, there, here))
    phases = defaultdict(int, {feeder.source.bus: 0b111})
    waiting = deque([feeder.source.bus])
    while waiting:
        bus = waiting.popleft()
        for far, here, there in joined[bus]:
            # a line brings the phases that the bus has; a transformer makes its own
            brings = there or phases[bus] & here
            if phases[bus] & here and brings & ~phases[far]:
                phases[far] |= brings
                waiting.append(far)
    return dict(phases)
