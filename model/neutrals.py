"""Where a neutral goes with the lines, so that loads may lie between a phase and it."""

from __future__ import annotations

from collections import defaultdict, deque
from typing import Protocol, TypeVar

from .parts import Feeder, InlineTransformer, Line, Regulator, Switch, Transformer

__all__ = ["bus_earthings", "bus_neutrals", "wires_at_unknown"]

_T = TypeVar("_T")
_T_co = TypeVar("_T_co", covariant=True)


def bus_neutrals(feeder: Feeder) -> dict[str, bool]:
    """Whether each bus has a neutral: of the source, or of the winding that feeds it.

    A winding between phases has none, nor has a star that is not earthed.
    """
    return _by_feeding(feeder, feeder.source.wires == 4, _earthed)


def bus_earthings(feeder: Feeder) -> dict[str, str]:
    """How what feeds each bus is earthed.

    That is the source's neutral; for an in-line transformer's winding ``solid``, ``impedance`` or
    ``isolated``.
    """

    def earthing(unit: InlineTransformer, *, to_side: bool) -> str:
        if not _earthed(unit, to_side=to_side):
            return "isolated"
        ohm = unit.to_neutral_ohm if to_side else unit.from_neutral_ohm
        return "impedance" if ohm else "solid"

    source: str = feeder.source.neutral
    return _by_feeding(feeder, source, earthing)


class _OfWinding(Protocol[_T_co]):
    """What is to be known of one side of a unit."""

    def __call__(self, unit: InlineTransformer, *, to_side: bool) -> _T_co: ...


def _by_feeding(feeder: Feeder, at_source: _T, of_winding: _OfWinding[_T]) -> dict[str, _T]:
    """Something of every bus that is the source's, or of the winding that feeds it."""
    joined: defaultdict[str, list[tuple[str, tuple[InlineTransformer, bool] | None]]]
    joined = defaultdict(list)
    joining: list[Line | Switch | Regulator] = [
        *feeder.lines,
        *feeder.switches,
        *feeder.regulators,
    ]
    for part in joining:
        joined[part.from_bus].append((part.to_bus, None))
        joined[part.to_bus].append((part.from_bus, None))
    for unit in feeder.inline_transformers:
        joined[unit.from_bus].append((unit.to_bus, (unit, True)))
        joined[unit.to_bus].append((unit.from_bus, (unit, False)))
    found = {feeder.source.bus: at_source}
    waiting = deque([feeder.source.bus])
    while waiting:
        bus = waiting.popleft()
        for far, winding in joined[bus]:
            if far not in found:
                own = found[bus]
                found[far] = own if winding is None else of_winding(winding[0], to_side=winding[1])
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
