"""What lines, codes, transformers between buses and regulators must be in themselves."""

from __future__ import annotations

from collections.abc import Mapping

from ..errors import KeyPath
from ..parts import Feeder, InlineTransformer, Line, LineCode, Regulator
from .fields import as_toml
from .own_checks import OwnChecks, ohm

__all__ = ["check_series"]


def check_series(feeder: Feeder, own: OwnChecks) -> None:
    """Check what joins two buses."""
    codes = {code.name: code for code in feeder.codes}
    for index, code in enumerate(feeder.codes):
        _check_code(code, index, own)
    for index, line in enumerate(feeder.lines):
        _check_build(line, index, codes, own)
        _check_charging(line, index, own)
    for index, unit in enumerate(feeder.inline_transformers):
        _check_inline(unit, index, own)
    for index, regulator in enumerate(feeder.regulators):
        _check_regulator(regulator, index, own)


def _check_code(code: LineCode, index: int, own: OwnChecks) -> None:
    """The matrices of a code are of one size, and current can be driven through each conductor."""
    size = len(code.r_ohm_per_km)
    beside = ("r_ohm_per_km",)
    others = {"x_ohm_per_km": code.x_ohm_per_km, "c_nf_per_km": code.c_nf_per_km}
    for key, matrix in others.items():
        if matrix is not None and len(matrix) != size:
            rule = f"must have as many rows as r_ohm_per_km ({size})"
            own.add(("codes", index, key), beside, rule, f"{len(matrix)}")
            return
    if not _drives(code):
        rule = "must leave an impedance in every loop of its conductors: R + jX is singular"
        own.add(("codes", index, "x_ohm_per_km"), beside, rule, as_toml(code.x_ohm_per_km))


_SINGULAR = 1e-9
"""Least determinant of a code's impedances with each row scaled to a diagonal of 1."""


def _drives(code: LineCode) -> bool:
    """Whether every current through the conductors needs a voltage."""
    size = range(len(code.r_ohm_per_km))
    z = [[complex(code.r_ohm_per_km[i][j], code.x_ohm_per_km[i][j]) for j in size] for i in size]
    if any(z[i][i] == 0.0 for i in size):
        return False
    scaled = [[z[i][j] / (z[i][i] * z[j][j]) ** 0.5 for j in size] for i in size]
    return abs(_determinant(scaled)) > _SINGULAR


def _determinant(matrix: list[list[complex]]) -> complex:
    """Determinant by its first row, which will do for three."""
    if len(matrix) == 1:
        return matrix[0][0]
    minors = ([row[:j] + row[j + 1 :] for row in matrix[1:]] for j in range(len(matrix)))
    terms = (own * _determinant(minor) for own, minor in zip(matrix[0], minors, strict=True))
    return sum((-term if j % 2 else term for j, term in enumerate(terms)), start=0j)


def _check_build(line: Line, index: int, codes: Mapping[str, LineCode], own: OwnChecks) -> None:
    """A line has a code that fits its phases, or sequence impedances."""
    sequence = {"z1_ohm_per_km": line.z1_ohm_per_km, "z0_ohm_per_km": line.z0_ohm_per_km}
    for key, z in sequence.items():
        path: KeyPath = ("lines", index, key)
        if line.code is None and z is None:
            rule = "is missing: a line has z1_ohm_per_km and z0_ohm_per_km, or a code"
            own.add(path, ("code",), rule, None)
        elif line.code is not None and z is not None:
            own.add(path, ("code",), "must be left out beside a code", ohm(z))
    charging = {"c1_nf_per_km": line.c1_nf_per_km, "c0_nf_per_km": line.c0_nf_per_km}
    if line.code is not None:
        for key, c in charging.items():
            if c != 0.0:
                rule = "must be left out beside a code, which may have c_nf_per_km"
                own.add(("lines", index, key), ("code",), rule, f"{c!r}")
    code = codes.get(line.code or "")
    if code is not None and len(code.r_ohm_per_km) != len(line.phases):
        rule = f"must be as many as code {code.name!r} has rows ({len(code.r_ohm_per_km)})"
        own.add(("lines", index, "phases"), ("code",), rule, repr(line.phases))


def _check_charging(line: Line, index: int, own: OwnChecks) -> None:
    """No capacitance between phases is negative."""
    if line.c0_nf_per_km > line.c1_nf_per_km:
        rule = (
            f"must be <= c1_nf_per_km ({line.c1_nf_per_km:g}),"
            " or capacitance between phases would be negative"
        )
        path = ("lines", index, "c0_nf_per_km")
        own.add(path, ("c1_nf_per_km",), rule, f"{line.c0_nf_per_km!r}")


_TURNING = ("D/Yg", "D/Y", "Yg/D", "Y/D")


def _check_inline(unit: InlineTransformer, index: int, own: OwnChecks) -> None:
    """What is said of a transformer between buses belongs to its connection."""

    def add(key: str, rule: str, found: str | None = None) -> None:
        own.add(("inline_transformers", index, key), ("connection",), rule, found)

    kind = unit.connection
    _check_windings(unit, index, own)
    tapped = kind == "centre-tap"
    if unit.leakage_pu == 0.0 and not tapped:
        add("leakage_pu", "must not be 0: behind no impedance the bus would be the source's own")
    if tapped and unit.leg_leakage_pu is None:
        add("leg_leakage_pu", "is missing: each leg of a centre-tap has its branch of the star")
    elif not tapped and unit.leg_leakage_pu is not None:
        add("leg_leakage_pu", f"must be left out for {kind}", ohm(unit.leg_leakage_pu))
    if unit.magnetizing_pu.imag > 0.0:
        rule = "must be [g, -b]: a magnetizing branch is no capacitance"
        add("magnetizing_pu", rule, ohm(unit.magnetizing_pu))
    if unit.shift != "lag" and kind not in _TURNING:
        rule = f"must be left out for {kind}, which turns nothing by 30 degrees"
        add("shift", rule, repr(unit.shift))
    sides = kind.partition("/")[::2]
    neutrals = (unit.from_neutral_ohm, unit.to_neutral_ohm)
    for side, key, z in zip(sides, ("from_neutral_ohm", "to_neutral_ohm"), neutrals, strict=True):
        if z != 0.0 and side != "Yg":
            rule = f"must be left out for {kind}, which has no earthed neutral on that side"
            add(key, rule, ohm(z))


def _check_windings(unit: InlineTransformer, index: int, own: OwnChecks) -> None:
    """The phases of either side are as many as the connection has there."""
    here, there = _WINDINGS.get(unit.connection, ((3,), (3,)))
    for key, counts in (("phases", here), ("to_phases", there)):
        found = getattr(unit, key)
        if len(found) not in counts:
            words = " or ".join(_COUNTS[count] for count in counts)
            rule = f"must be {words} for {unit.connection}"
            path: KeyPath = ("inline_transformers", index, key)
            own.add(path, ("connection",), rule, repr(found))


_WINDINGS: dict[str, tuple[tuple[int, ...], tuple[int, ...]]] = {
    "single": ((1, 2), (1, 2)),
    "centre-tap": ((1, 2), (2,)),
}
_COUNTS = {1: "one phase", 2: "two phases", 3: "all three"}


def _check_regulator(regulator: Regulator, index: int, own: OwnChecks) -> None:
    """Taps are within reach, and the least leaves some voltage."""
    path: KeyPath = ("regulators", index, "taps")
    if max(map(abs, regulator.taps)) > regulator.most_taps:
        rule = f"must be -{regulator.most_taps} to {regulator.most_taps} (most_taps)"
        own.add(path, ("most_taps",), rule, as_toml(regulator.taps))
    if regulator.most_taps * regulator.step_pct >= 100.0:
        rule = "must leave voltage at the lowest tap: most_taps x step_pct < 100 %"
        found = f"{regulator.most_taps} x {regulator.step_pct:g} %"
        own.add(("regulators", index, "step_pct"), ("most_taps",), rule, found)
    _check_reference(regulator, index, own)


def _check_reference(regulator: Regulator, index: int, own: OwnChecks) -> None:
    """The units that are there have something to refer to, and only they have taps."""
    reference, phases = regulator.reference, regulator.phases

    def add(key: str, others: tuple[str, ...], rule: str, found: str | None) -> None:
        own.add(("regulators", index, key), others, rule, found)

    idle = [
        phase
        for phase, tap in zip("abc", regulator.taps, strict=True)
        if tap != 0 and phase not in phases
    ]
    if idle:
        rule = f"must be 0 where there is no unit, in phase {' and '.join(idle)}"
        add("taps", ("phases",), rule, as_toml(regulator.taps))
    if reference == "next" and len(phases) < 3:
        rule = "must be earth or a phase where not all three have a unit"
        add("reference", ("phases",), rule, repr(reference))
    if reference in phases:
        rule = f"must be another phase than those that have a unit, {' and '.join(phases)}"
        add("reference", ("phases",), rule, repr(reference))
    if regulator.jumper_ohm != 0.0 and reference in ("earth", "next"):
        rule = "must be left out where no phase goes through beside the units"
        add("jumper_ohm", ("reference",), rule, ohm(regulator.jumper_ohm))
    taps = {tap for phase, tap in zip("abc", regulator.taps, strict=True) if phase in phases}
    if regulator.gang and len(taps) > 1:
        add("taps", ("phases", "gang"), "must be equal in a gang", as_toml(regulator.taps))
