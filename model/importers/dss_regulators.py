"""Regulators out of an OpenDSS circuit: 1:1 transformers, in banks, and load tap changers."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from ..parts import InlineTransformer, Reference, Regulator
from .dss_coils import Coil, coil_kv, coils_of
from .dss_names import Names, letters
from .dss_neutrals import neutral_ohm
from .dss_records import RawTapControl, RawTransformer
from .dss_spans import Span
from .dss_transformers import Banks, leakage_pu

__all__ = ["Regulated", "regulators_of", "with_tap_changer"]

_WHOLE = 1e-6
"""How near a tap must be to a whole number to be one."""


@dataclass(slots=True, kw_only=True)
class Regulated:
    """Regulators, and what they have used up."""

    regulators: list[Regulator] = field(default_factory=list)
    units: set[str] = field(default_factory=set)  #: transformers
    jumpers: set[str] = field(default_factory=set)  #: lines


@dataclass(frozen=True, slots=True, kw_only=True)
class _Unit:
    """A 1:1 transformer as a regulator sees it."""

    raw: RawTransformer
    coils: tuple[Coil, ...]
    ratio: float
    z_ohm: complex


def regulators_of(
    units: Iterable[RawTransformer],
    controls: Sequence[RawTapControl],
    spans: Sequence[Span],
    banks: Banks,
) -> Regulated:
    """Return the regulators among the transformers: two equal windings, alike in phases.

    A three-phase unit is one only if something controls its taps.
    """
    controlled = {control.transformer for control in controls}
    groups: defaultdict[tuple[str, str], list[_Unit]] = defaultdict(list)
    for unit in units:
        if unit.phases > 1 and unit.name not in controlled:
            continue
        regulating = _regulating(unit, banks)
        if regulating is not None:
            first, second = unit.windings
            groups[(first.end.bus, second.end.bus)].append(regulating)
    found, names = Regulated(), Names()
    for group in groups.values():
        _add_bank(group, spans, banks, names, found)
    return found


def _regulating(unit: RawTransformer, banks: Banks) -> _Unit | None:
    """Return the unit if it regulates, live on all its phases and earthed where it is wye."""
    if len(unit.windings) != 2:
        return None
    first, second = unit.windings
    coils = [
        tuple((p, 0 if q > 3 and not winding.delta else q) for p, q in side)
        for winding, side in zip(unit.windings, zip(*coils_of(unit), strict=True), strict=True)
    ]
    solid = all(
        winding.delta or neutral_ohm(winding, unit.phases, banks.neutrals) == 0
        for winding in unit.windings
    )
    nodes = {node for coil in coils[0] for node in coil} - {0}
    live = all((winding.end.bus, node) in banks.live for winding in unit.windings for node in nodes)
    alike = coils[0] == coils[1] and first.delta == second.delta and first.kv == second.kv
    if not (alike and solid and live and nodes <= {1, 2, 3}) or first.end.bus == second.end.bus:
        return None
    coil_va = first.kva * 1000.0 / unit.phases
    volts = coil_kv(first, unit.phases) * 1000.0 * first.tap
    return _Unit(
        raw=unit,
        coils=coils[0],
        ratio=second.tap / first.tap,
        z_ohm=leakage_pu(unit) * volts**2 / coil_va,
    )


def _add_bank(
    group: Sequence[_Unit], spans: Sequence[Span], banks: Banks, names: Names, found: Regulated
) -> None:
    """Make one regulator of the units between two buses, if they are one bank."""
    first = group[0].raw
    start, end = (winding.end.bus for winding in first.windings)
    coils = [coil for unit in group for coil in unit.coils]
    arranged = _arrangement(coils)
    z_ohm = group[0].z_ohm
    alike = all(abs(unit.z_ohm - z_ohm) <= 1e-9 * abs(z_ohm) for unit in group)
    step = _step(group)
    if arranged is None or not alike or step is None:
        return
    reference, nodes = arranged
    jumper = _jumper(reference, (start, end), spans)
    if reference in ("a", "b", "c") and jumper is None:
        return
    taps = [0, 0, 0]
    for unit in group:
        for coil in unit.coils:
            taps[_own(coil, reference) - 1] = round((unit.ratio - 1.0) / step)
    gang = len(group) == 1 and first.phases > 1
    found.regulators.append(
        Regulator(
            name=names.new(_bank_name(group)),
            from_bus=banks.buses.of(start),
            to_bus=banks.buses.of(end),
            taps=(taps[0], taps[1], taps[2]),
            step_pct=_percent(step),
            most_taps=max(first.windings[1].most_taps, *(abs(tap) for tap in taps)),
            phases=letters(sorted(nodes)).replace(reference, ""),
            reference=reference,
            z_ohm=z_ohm,
            jumper_ohm=complex(jumper.r_ohm[0, 0], jumper.x_ohm[0, 0]) if jumper else 0j,
            gang=gang,
        )
    )
    found.jumpers |= {jumper.name} if jumper else set()
    for unit in group:
        found.units.add(unit.raw.name)
        lost = unit.raw.noload_pct or unit.raw.imag_pct
        how = "a regulator" + (", its no-load branch left out" if lost else "")
        banks.findings.add(
            "transformer", unit.raw.name, "approximated" if lost else "as it is", how
        )
    if len(group) > 1:
        members = ", ".join(unit.raw.name for unit in group)
        banks.findings.note(f"transformers {members} became regulator {found.regulators[-1].name}")


def _arrangement(coils: Sequence[Coil]) -> tuple[Reference, set[int]] | None:
    """Return what the coils refer to and the phases of the bank, None where they are no bank."""
    nodes = {node for coil in coils for node in coil}
    if all(0 in coil for coil in coils):
        phases = nodes - {0}
        return ("earth", phases) if len(phases) == len(coils) else None
    if 0 in nodes or len({frozenset(coil) for coil in coils}) < len(coils):
        return None
    if len(coils) == 3:
        # three units of two windings are no closed delta of autotransformers
        return None
    common = set(coils[0]).intersection(*coils[1:])
    if len(coils) == 1:
        common = {coils[0][1]}
    if len(common) != 1:
        return None
    reference: Reference = "abc"[common.pop() - 1]  # type: ignore[assignment]
    return reference, nodes


def _own(coil: Coil, reference: Reference) -> int:
    """Return the phase whose tap a coil's is."""
    other = 0 if reference == "earth" else "abc".index(reference) + 1
    return coil[0] if coil[1] == other else coil[1]


def _step(group: Sequence[_Unit]) -> float | None:
    """Return the step of all taps, that of the file or, for a tap between, one near it."""
    step = group[0].raw.windings[1].tap_step
    if not step > 0.0:
        return None
    taps = [(unit.ratio - 1.0) / step for unit in group]
    if all(abs(tap - round(tap)) < _WHOLE for tap in taps):
        return step
    if len({round(tap, 9) for tap in taps}) == 1:
        return (group[0].ratio - 1.0) / (round(taps[0]) or (1 if taps[0] > 0 else -1))
    return None


def _jumper(reference: Reference, buses: tuple[str, str], spans: Sequence[Span]) -> Span | None:
    """Return the line through which the phase goes that others refer to."""
    for span in spans:
        if (
            set(span.buses) == set(buses)
            and letters(span.nodes) == reference
            and not any(span.opened)
        ):
            return span
    return None


def _bank_name(group: Sequence[_Unit]) -> str:
    named = {unit.raw.bank for unit in group}
    return (
        named.pop() if len(named) == 1 and len(group) > 1 and "" not in named else group[0].raw.name
    )


def with_tap_changer(
    row: InlineTransformer, unit: RawTransformer, controls: Sequence[RawTapControl], banks: Banks
) -> tuple[InlineTransformer, Regulator | None]:
    """Part a load tap changer from its transformer: a regulator of all phases behind it.

    Nothing changes at the tap it stands at: leakage and a neutral's impedance go with the
    square of the tap, as the regulator makes them appear.
    """
    if unit.phases == 1 or row.connection in ("single", "centre-tap"):
        return row, None
    if not any(c.transformer == unit.name and c.winding == 2 for c in controls):
        return row, None
    second = unit.windings[1]
    step = second.tap_step
    tap = (second.tap - 1.0) / step if step > 0.0 else 0.5
    if abs(tap - round(tap)) > _WHOLE:
        banks.findings.note(f"transformer {unit.name}: its tap is no whole step, it stays fixed")
        return row, None
    between = banks.buses.new(f"{row.to_bus}_{row.name}")
    regulator = Regulator(
        name=row.name,
        from_bus=between,
        to_bus=row.to_bus,
        taps=(round(tap), round(tap), round(tap)),
        step_pct=_percent(step),
        most_taps=max(second.most_taps, abs(round(tap))),
        gang=True,
    )
    neutral = row.to_neutral_ohm / second.tap**2
    banks.findings.note(f"transformer {unit.name}: its tap changer became regulator {row.name}")
    return replace(row, to_bus=between, to_tap=1.0, to_neutral_ohm=neutral), regulator


def _percent(step: float) -> float:
    """Return a step in percent, without the last digits that the file's limits left."""
    return float(f"{step * 100.0:.10g}")
