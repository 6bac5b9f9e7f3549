"""Where a neutral goes with the lines, so that loads may lie between a phase and it."""

from __future__ import annotations

from collections import defaultdict, deque

from .parts import Feeder, InlineTransformer, Line, Regulator, Switch, Transformer

__all__ = ["bus_neutrals", "wires_at_unknown"]


def bus_neutrals(feeder: Feeder) -> dict[str, bool]:
    """Whether each bus has a neutral: of the source, or of the winding that feeds it.

    A winding between phases has none, nor has a star that is not earthed.
    """
    joined: defaultdict[str, list[tuple[str, bool | None]]] = defaultdict(list)
    joining: list[Line | Switch | Regulator] = [
        *feeder.lines,
        *feeder.switches,
        *feeder.regulators,
    ]
    for part in joining:
        joined[part.from_bus].append((part.to_bus, None))
        joined[part.to_bus].append((part.from_bus, None))
    for unit in feeder.inline_transformers:
        joined[unit.from_bus].append((unit.to_bus, _earthed(unit, to_side=True)))
        joined[unit.to_bus].append((unit.from_bus, _earthed(unit, to_side=False)))
    found = {feeder.source.bus: feeder.source.wires == 4}
    waiting = deque([feeder.source.bus])
    while waiting:
        bus = waiting.popleft()
        for far, makes in joined[bus]:
            if far not in found:
                found[far] = found[bus] if makes is None else makes
                waiting.append(far)
    return found


def wires_at_unknown(feeder: Feeder) -> int:
    """4 where a neutral goes to every transformer of unknown connection, else 3.

    One behind a winding between phases can be no grounded wye, whatever the source is.
    """
    unknown = [unit for unit in feeder.transformers if unit.connection == "unknown"]
    if not unknown:
        return feeder.source.wires
    neutral = bus_neutrals(feeder)
    line_bus = {line.name: line.from_bus for line in feeder.lines}

    def has_neutral(unit: Transformer) -> bool:
        place = unit.place
        bus = place.bus if place.line is None else line_bus[place.line]
        return bus is not None and neutral.get(bus, False)

    return 4 if all(map(has_neutral, unknown)) else 3


def _earthed(unit: InlineTransformer, *, to_side: bool) -> bool:
    """Whether that winding has an earthed neutral, or, a single one, lies to earth."""
    if unit.connection == "centre-tap":
        return to_side or len(unit.phases) == 1
    if unit.connection == "single":
        return len(unit.to_phases if to_side else unit.phases) == 1
    return unit.connection.split("/")[to_side] == "Yg"
