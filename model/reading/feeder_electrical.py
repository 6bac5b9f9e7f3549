"""What the parts of a feeder must be together for the model to represent them."""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import KeyPath, Report
from ..parts import Der, Feeder, Line, Regulator, Source, Transformer
from .fields import as_toml

__all__ = ["check_electrical"]


def check_electrical(feeder: Feeder, report: Report) -> None:
    """Check values that only together can be right or wrong.

    A value that has been reported by itself says nothing beside others.
    """
    faulty = set(report.paths)
    own = _Checks(report, faulty)
    _check_neutral(feeder.source, own)
    for index, line in enumerate(feeder.lines):
        _check_charging(line, index, own)
    for index, unit in enumerate(feeder.transformers):
        _check_transformer(unit, index, own)
    for index, der in enumerate(feeder.ders):
        _check_der(der, index, own)
    for index, regulator in enumerate(feeder.regulators):
        _check_regulator(regulator, index, own)
    if feeder.source.wires == 3:
        _check_three_wires(feeder, own)
    if feeder.source.neutral == "isolated" and not report.faults:
        _check_isolated(feeder, own)


class _Checks:
    """Adds to a report where none of the values concerned has been reported yet."""

    def __init__(self, report: Report, faulty: set[KeyPath]) -> None:
        self.report = report
        self.faulty = faulty

    def add(self, path: KeyPath, others: Sequence[str], wanted: str, found: str | None) -> None:
        """Report the value at ``path``, unless it or one of ``others`` beside it is faulty."""
        beside = [(*path[:-1], other) for other in others]
        if self.faulty.isdisjoint([path, *beside]):
            self.report.add(path, wanted, found)


def _ohm(z: complex) -> str:
    return as_toml([z.real, z.imag])


def _check_neutral(source: Source, own: _Checks) -> None:
    """The impedance of the neutral is there exactly where it is one."""
    path: KeyPath = ("source", "neutral_ohm")
    z, neutral = source.neutral_ohm, source.neutral
    beside = ("neutral",)
    if neutral in ("solid", "isolated"):
        if z != 0.0:
            rule = f"must be left out for a neutral that is {neutral}"
            own.add(path, beside, rule, _ohm(z))
    elif z == 0.0:
        own.add(path, beside, f"is missing: neutral = '{neutral}' needs it", None)
    elif neutral == "resistor" and z.real == 0.0:
        own.add(path, beside, "must have a resistance > 0 for a resistor", _ohm(z))
    elif neutral == "petersen" and z.imag <= 0.0:
        own.add(path, beside, "must have a reactance > 0 for a Petersen coil", _ohm(z))


def _check_charging(line: Line, index: int, own: _Checks) -> None:
    """No capacitance between phases is negative."""
    if line.c0_nf_per_km > line.c1_nf_per_km:
        rule = (
            f"must be <= c1_nf_per_km ({line.c1_nf_per_km:g}),"
            " or capacitance between phases would be negative"
        )
        path = ("lines", index, "c0_nf_per_km")
        own.add(path, ("c1_nf_per_km",), rule, f"{line.c0_nf_per_km!r}")


def _check_transformer(unit: Transformer, index: int, own: _Checks) -> None:
    """Leakage and zero-sequence data fit the connection."""
    beside = ("connection",)
    if unit.x0_pu is not None and unit.connection not in ("Yg/Yg", "unknown"):
        rule = f"must be left out for {unit.connection}: it belongs to Yg/Yg"
        own.add(("transformers", index, "x0_pu"), beside, rule, f"{unit.x0_pu!r}")
    if unit.leakage_pu == 0.0 and unit.connection in _SHORT:
        rule = f"must not be 0 for {unit.connection}, {_SHORT[unit.connection]}"
        own.add(("transformers", index, "leakage_pu"), beside, rule, None)


_SHORT = {
    "Yg/D": "which would short the zero sequence to earth",
    "Y/D": "whose closed winding it limits",
    "D/D": "whose closed windings it limits",
    "unknown": "which may be Yg/D and would short the zero sequence to earth",
}
"""Why a connection needs leakage."""


def _check_der(der: Der, index: int, own: _Checks) -> None:
    """A model has the impedances that it stands on, and no others."""
    keeps_emf = der.model in ("thevenin", "generator")
    path: KeyPath = ("ders", index, "z1_ohm")
    if keeps_emf and der.z1_ohm is None:
        own.add(path, ("model",), f"is missing: model = '{der.model}' keeps an EMF behind it", None)
    elif not keeps_emf and der.z1_ohm is not None:
        kept = der.model.removeprefix("constant_")
        rule = f"must be left out for a constant {kept}, which stays whatever the voltage"
        own.add(path, ("model",), rule, _ohm(der.z1_ohm))
    if der.model == "generator" and der.z2_ohm is None:
        rule = "is missing: a generator has a path for the negative sequence"
        own.add(("ders", index, "z2_ohm"), ("model",), rule, None)


def _check_regulator(regulator: Regulator, index: int, own: _Checks) -> None:
    """Taps are within reach, and the least leaves some voltage."""
    path: KeyPath = ("regulators", index, "taps")
    if max(map(abs, regulator.taps)) > regulator.most_taps:
        rule = f"must be -{regulator.most_taps} to {regulator.most_taps} (most_taps)"
        own.add(path, ("most_taps",), rule, as_toml(regulator.taps))
    if regulator.most_taps * regulator.step_pct >= 100.0:
        rule = "must leave voltage at the lowest tap: most_taps x step_pct < 100 %"
        found = f"{regulator.most_taps} x {regulator.step_pct:g} %"
        own.add(("regulators", index, "step_pct"), ("most_taps",), rule, found)


def _check_three_wires(feeder: Feeder, own: _Checks) -> None:
    """Nothing is connected to the neutral that is not there."""
    there = "on a feeder of three wires (source: wires = 3)"
    for index, unit in enumerate(feeder.transformers):
        if unit.connection.startswith("Yg/"):
            rule = f"must not be Yg {there}: that winding needs a neutral"
            path: KeyPath = ("transformers", index, "connection")
            own.add(path, (), rule, repr(unit.connection))
    for index, load in enumerate(feeder.loads):
        if load.transformer is None and load.connection == "wye":
            rule = f"must be 'delta' {there}: a wye load needs a neutral"
            own.add(("loads", index, "connection"), (), rule, "'wye'")
    for index, der in enumerate(feeder.ders):
        if der.transformer is None and der.z0_ohm is not None:
            rule = f"must be left out {there}: the zero sequence needs a neutral"
            own.add(("ders", index, "z0_ohm"), (), rule, _ohm(der.z0_ohm))
    for index, bank in enumerate(feeder.capacitors):
        if bank.connection == "wye":
            rule = f"must be 'delta' {there}: a wye bank needs a neutral"
            own.add(("capacitors", index, "connection"), (), rule, "'wye'")
    for index in range(len(feeder.regulators)):
        rule = f"cannot stand {there}: three units in grounded wye need a neutral"
        own.add(("regulators", index), (), rule, None)


def _check_isolated(feeder: Feeder, own: _Checks) -> None:
    """Something ties an isolated feeder to earth, or its voltages would be undefined."""
    loaded = {
        load.transformer for load in feeder.loads if load.kw > 0.0 and load.motor_share < 1.0
    } | {der.transformer for der in feeder.ders if der.z0_ohm is not None}
    earthed = (
        any(line.c0_nf_per_km > 0.0 for line in feeder.lines)
        or any(bank.connection == "wye" for bank in feeder.capacitors)
        or any(der.transformer is None and der.z0_ohm is not None for der in feeder.ders)
        or any(
            load.connection == "wye" and load.kw > 0.0 and load.motor_share < 1.0
            for load in feeder.loads
            if load.transformer is None
        )
        or any(
            unit.connection == "Yg/D"
            or (
                unit.connection == "Yg/Yg"
                and (unit.name in loaded or unit.x0_pu is not None or unit.xm_pu is not None)
            )
            for unit in feeder.transformers
        )
    )
    if not earthed:
        rule = (
            "must not be isolated where nothing else defines the voltage to earth:"
            " give the lines c0_nf_per_km"
        )
        own.add(("source", "neutral"), (), rule, None)
