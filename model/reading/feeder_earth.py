"""What a feeder's part without a neutral, or without an earth, allows.

Both speak of the source's own network: behind an in-line transformer another one begins, whose
windings decide for themselves.
"""

from __future__ import annotations

from ..errors import KeyPath
from ..parts import Feeder, Line, LineCode, Load, Place
from ..topology import edges, forest
from .own_checks import OwnChecks, ohm

__all__ = ["check_isolated", "check_three_wires"]


class _Zone:
    """The buses that no in-line transformer parts from the source, every switch closed."""

    def __init__(self, feeder: Feeder) -> None:
        own = [edge for edge in edges(feeder, ties=True) if edge.path[0] != "inline_transformers"]
        self.buses = forest(own, [feeder.source.bus])[0].keys()
        self.lines = {line.name for line in feeder.lines if line.from_bus in self.buses}

    def __contains__(self, place: Place | None) -> bool:
        return place is not None and (place.bus in self.buses or place.line in self.lines)


def check_three_wires(feeder: Feeder, own: OwnChecks) -> None:
    """Nothing is connected to the neutral that is not there."""
    there = "on a feeder of three wires (source: wires = 3)"
    zone = _Zone(feeder)
    path: KeyPath
    for index, unit in enumerate(feeder.transformers):
        if unit.connection.startswith("Yg/") and unit.place in zone:
            rule = f"must not be Yg {there}: that winding needs a neutral"
            own.add(("transformers", index, "connection"), (), rule, repr(unit.connection))
    for index, inline in enumerate(feeder.inline_transformers):
        path = ("inline_transformers", index, "connection")
        single = inline.connection in ("single", "centre-tap")
        sides = inline.connection.partition("/")[::2]
        if inline.from_bus in zone.buses and sides[0] == "Yg":
            rule = f"must not be Yg at its from-side {there}: that winding needs a neutral"
            own.add(path, (), rule, repr(inline.connection))
        if inline.from_bus in zone.buses and single and len(inline.phases) == 1:
            rule = f"must be two {there}: one phase needs a neutral"
            own.add((*path[:-1], "phases"), ("connection",), rule, repr(inline.phases))
    for index, load in enumerate(feeder.loads):
        if load.connection == "wye" and load.place in zone:
            rule = f"must be 'delta' {there}: a wye load needs a neutral"
            own.add(("loads", index, "connection"), (), rule, "'wye'")
    for index, der in enumerate(feeder.ders):
        if der.z0_ohm is not None and der.place in zone:
            rule = f"must be left out {there}: the zero sequence needs a neutral"
            own.add(("ders", index, "z0_ohm"), (), rule, ohm(der.z0_ohm))
    for index, bank in enumerate(feeder.capacitors):
        if bank.connection == "wye" and bank.place in zone:
            rule = f"must be 'delta' {there}: a wye bank needs a neutral"
            own.add(("capacitors", index, "connection"), (), rule, "'wye'")
    for index, regulator in enumerate(feeder.regulators):
        if regulator.reference == "earth" and regulator.from_bus in zone.buses:
            rule = f"cannot stand {there}: units in grounded wye need a neutral"
            own.add(("regulators", index), (), rule, None)


def check_isolated(feeder: Feeder, own: OwnChecks) -> None:
    """Something ties an isolated feeder to earth, or its voltages would be undefined."""
    zone = _Zone(feeder)
    earthed = (
        _lines_tie(feeder, zone)
        or any(bank.connection == "wye" and bank.place in zone for bank in feeder.capacitors)
        or any(der.z0_ohm is not None and der.place in zone for der in feeder.ders)
        or any(
            load.connection == "wye" and _burdens(load)
            for load in feeder.loads
            if load.place in zone
        )
        or _units_tie(feeder, zone)
        or _inline_ties(feeder, zone)
    )
    if not earthed:
        rule = (
            "must not be isolated where nothing else defines the voltage to earth:"
            " give the lines c0_nf_per_km"
        )
        own.add(("source", "neutral"), (), rule, None)


def _burdens(load: Load) -> bool:
    """Whether the load carries current in the zero sequence if it is connected to earth."""
    return (load.kw > 0.0 or bool(load.kvar)) and load.motor_share < 1.0


def _lines_tie(feeder: Feeder, zone: _Zone) -> bool:
    """Whether a line has capacitance to earth."""
    codes = {code.name: code for code in feeder.codes}

    def charged(line: Line) -> bool:
        code: LineCode | None = codes.get(line.code or "")
        if code is None or code.c_nf_per_km is None:
            return line.c0_nf_per_km > 0.0
        return any(sum(row) > 0.0 for row in code.c_nf_per_km)

    return any(charged(line) for line in feeder.lines if line.name in zone.lines)


def _units_tie(feeder: Feeder, zone: _Zone) -> bool:
    """Whether a hanging transformer has a path for the zero sequence."""
    loaded = {load.transformer for load in feeder.loads if _burdens(load)}
    loaded |= {der.transformer for der in feeder.ders if der.z0_ohm is not None}
    return any(
        unit.connection == "Yg/D"
        or (
            unit.connection == "Yg/Yg"
            and (unit.name in loaded or unit.x0_pu is not None or unit.xm_pu is not None)
        )
        for unit in feeder.transformers
        if unit.place in zone
    )


def _inline_ties(feeder: Feeder, zone: _Zone) -> bool:
    """Whether a transformer to another network has a path to earth; what lies there is trusted."""
    return any(
        unit.connection in ("Yg/D", "Yg/Yg")
        or (unit.connection in ("single", "centre-tap") and len(unit.phases) == 1)
        for unit in feeder.inline_transformers
        if unit.from_bus in zone.buses
    )
