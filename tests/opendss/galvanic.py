"""Which nodes of a feeder, cut open or not, have no connection to earth: by its graph alone."""

from __future__ import annotations

from collections.abc import Hashable

from opendss.as_dss import Cut

from openphase.model.line_matrices import shunt_nf_per_km
from openphase.model.parts import Feeder, InlineTransformer, LineCode
from openphase.model.phases import conductors

__all__ = ["floating_nodes"]

EARTH = "earth"
Node = tuple[str, str]


class _Sets:
    """Disjoint sets of whatever is joined by a conductor or a branch."""

    def __init__(self) -> None:
        self.parent: dict[Hashable, Hashable] = {}

    def root(self, item: Hashable) -> Hashable:
        path = [item]
        while (up := self.parent.setdefault(path[-1], path[-1])) != path[-1]:
            path.append(up)
        for each in path:
            self.parent[each] = path[-1]
        return path[-1]

    def join(self, *items: Hashable) -> None:
        for item in items[1:]:
            self.parent[self.root(items[0])] = self.root(item)


def floating_nodes(feeder: Feeder, cut: Cut | None = None) -> dict[Node, Hashable]:
    """(bus, phase) of all that floats, and which floating part each belongs to."""
    sets = _Sets()
    source = feeder.source
    for phase in "abc":
        sets.join((source.bus, phase), "source")
    if source.neutral != "isolated":
        sets.join("source", EARTH)
    _lines(sets, feeder, cut)
    for switch in feeder.switches:
        for phase in switch.phases if switch.closed else "":
            sets.join((switch.from_bus, phase), (switch.to_bus, phase))
    for own in feeder.regulators:
        for phase in conductors(own):
            sets.join((own.from_bus, phase), (own.to_bus, phase))
            _reference(sets, own.from_bus, phase, own.reference)
    for unit in feeder.inline_transformers:
        _windings(sets, unit)
    for part in (*feeder.loads, *feeder.capacitors):
        assert part.place is not None
        ends = [(part.place.bus, phase) for phase in part.phases]
        sets.join(*ends, *([EARTH] if part.connection == "wye" else []))
    earth = sets.root(EARTH)
    return {
        item: sets.root(item)
        for item in list(sets.parent)
        if isinstance(item, tuple) and len(item) == 2 and sets.root(item) != earth
    }


def _lines(sets: _Sets, feeder: Feeder, cut: Cut | None) -> None:
    codes: dict[str | None, LineCode] = {code.name: code for code in feeder.codes}
    for line in feeder.lines:
        charged = bool(shunt_nf_per_km(line, codes.get(line.code)).any())
        for phase in line.phases:
            ends: list[Hashable] = [(line.from_bus, phase), (line.to_bus, phase)]
            if cut is not None and cut.line == line.name and phase in cut.phases:
                # an end that is open at a bus leaves the line's shunt on the other side
                p, q = (line.name, phase, "p"), (line.name, phase, "q")
                if cut.at > 0:
                    sets.join(ends[0], p, *([EARTH] if charged else []))
                if cut.at < 1:
                    sets.join(ends[1], q, *([EARTH] if charged else []))
            else:
                sets.join(*ends, *([EARTH] if charged else []))


def _reference(sets: _Sets, bus: str, phase: str, reference: str) -> None:
    if reference == "earth":
        sets.join((bus, phase), EARTH)
    elif reference == "next":
        sets.join((bus, phase), (bus, "bca"["abc".index(phase)]))
    else:
        sets.join((bus, phase), (bus, reference))


def _windings(sets: _Sets, unit: InlineTransformer) -> None:
    here: list[Hashable] = [(unit.from_bus, phase) for phase in unit.phases]
    there: list[Hashable] = [(unit.to_bus, phase) for phase in unit.to_phases]
    if unit.connection == "centre-tap":
        sets.join(*there, EARTH)
        kinds = ["Yg" if len(here) == 1 else "D"]
    elif unit.connection == "single":
        kinds = ["Yg" if len(side) == 1 else "D" for side in (here, there)]
    else:
        kinds = unit.connection.split("/")
    for kind, side in zip(kinds, (here, there), strict=False):
        sets.join(*side, *([EARTH] if kind == "Yg" else []))
