"""In-line transformers out of an OpenDSS circuit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..parts import InlineConnection, InlineTransformer, Shift
from .dss_coils import Coil, coil_kv, coils_of
from .dss_live import Node
from .dss_names import Names, letters
from .dss_neutrals import Neutrals, neutral_ohm
from .dss_records import RawTransformer
from .findings import Findings

__all__ = ["Banks", "inline_parts", "leakage_pu"]

_STANDARD: dict[tuple[str, str, Shift], tuple[tuple[Coil, Coil], ...]] = {
    ("Y", "Y", "lag"): tuple(((n, 0), (n, 0)) for n in (1, 2, 3)),
    ("D", "D", "lag"): tuple(((n, n % 3 + 1), (n, n % 3 + 1)) for n in (1, 2, 3)),
    ("D", "Y", "lag"): tuple(((n, (n + 1) % 3 + 1), (n, 0)) for n in (1, 2, 3)),
    ("D", "Y", "lead"): tuple(((n, n % 3 + 1), (n, 0)) for n in (1, 2, 3)),
    ("Y", "D", "lag"): tuple(((n, 0), (n, n % 3 + 1)) for n in (1, 2, 3)),
    ("Y", "D", "lead"): tuple(((n, 0), (n, (n + 1) % 3 + 1)) for n in (1, 2, 3)),
}
"""Coils that a three-phase connection couples, a wye's neutral written 0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Banks:
    """What the conversion of transformers needs besides them."""

    buses: Names
    names: Names
    neutrals: Neutrals
    live: set[Node]
    findings: Findings


def leakage_pu(unit: RawTransformer) -> complex:
    """Resistance of the first two windings and the reactance between them."""
    ohmic = sum(winding.r_pct for winding in unit.windings[:2])
    return complex(ohmic, unit.x_pct[0]) / 100.0


def inline_parts(unit: RawTransformer, banks: Banks) -> list[InlineTransformer]:
    """Return what a transformer becomes: one row, one for each coil, or none where refused."""

    def refuse(why: str) -> list[InlineTransformer]:
        banks.findings.add("transformer", unit.name, "refused", why)
        return []

    nodes = [
        (winding.end.bus, node)
        for winding, coil in zip(unit.windings, zip(*coils_of(unit), strict=True), strict=True)
        for pair in coil
        for node in pair
        if node in (1, 2, 3)
    ]
    if not any(node in banks.live for node in nodes):
        banks.findings.add("transformer", unit.name, "not fed")
        return []
    if len({winding.end.bus for winding in unit.windings}) == 1:
        return refuse("all its windings are at one bus")
    if len(unit.windings) == 3 and unit.phases == 1:
        return _centre_tap(unit, banks, refuse)
    if len(unit.windings) != 2:
        return refuse(f"it has {len(unit.windings)} windings in {unit.phases} phases")
    if unit.phases > 3:
        return refuse(f"it has {unit.phases} phases")
    if leakage_pu(unit) == 0:
        return refuse("it has no leakage impedance")
    dead = [node for node in nodes if node not in banks.live]
    if unit.phases == 3 and not dead:
        row = _three_phase(unit, banks)
        if row is not None:
            banks.findings.add("transformer", unit.name, "as it is", _winding_names(unit))
            return [row]
    return _singles(unit, banks, refuse)


def _magnetizing(unit: RawTransformer) -> complex:
    return complex(unit.noload_pct, -unit.imag_pct) / 100.0


def _winding_names(unit: RawTransformer) -> str:
    kinds = "/".join("D" if winding.delta else "Y" for winding in unit.windings)
    return f"{kinds}, {unit.phases} phase" + ("s" if unit.phases > 1 else "")


def _three_phase(unit: RawTransformer, banks: Banks) -> InlineTransformer | None:
    """Return the row of a three-phase unit, None where its phases are not joined in a usual way."""
    first, second = unit.windings
    coils = {
        tuple(
            (p, 0 if not winding.delta else q)
            for winding, (p, q) in zip(unit.windings, limb, strict=True)
        )
        for limb in coils_of(unit)
    }
    kinds = ["D" if winding.delta else "Y" for winding in unit.windings]
    fitting = [
        shift
        for (start, end, shift), wanted in _STANDARD.items()
        if [start, end] == kinds and _turned(coils) == _turned(set(wanted))
    ]
    neutral_ohms = [
        None if winding.delta else neutral_ohm(winding, 3, banks.neutrals)
        for winding in unit.windings
    ]
    joined = any(
        not winding.delta
        and (winding.end.bus, winding.end.nodes[3]) in banks.neutrals.shared
        and winding.end.nodes[3] > 3
        for winding in unit.windings
    )
    if not fitting or joined:
        return None
    sides = [
        kind if kind == "D" else "Y" if ohm is None else "Yg"
        for kind, ohm in zip(kinds, neutral_ohms, strict=True)
    ]
    connection: InlineConnection = f"{sides[0]}/{sides[1]}"  # type: ignore[assignment]
    if connection in ("D/Yg", "D/Y") or connection in ("Yg/D", "Y/D"):
        shift = fitting[0]
    else:
        shift = "lag"
    return InlineTransformer(
        name=banks.names.of(unit.name),
        from_bus=banks.buses.of(first.end.bus),
        to_bus=banks.buses.of(second.end.bus),
        connection=connection,
        rating_kva=first.kva,
        kv_from=first.kv,
        kv_to=second.kv,
        leakage_pu=leakage_pu(unit),
        magnetizing_pu=_magnetizing(unit),
        from_tap=first.tap,
        to_tap=second.tap,
        shift=shift,
        from_neutral_ohm=neutral_ohms[0] or 0j,
        to_neutral_ohm=neutral_ohms[1] or 0j,
    )


def _turned(coils: set[tuple[Coil, ...]]) -> set[tuple[Coil, ...]]:
    """Turn every pair of coils so that the first one starts at the lower node (earth last)."""
    return {
        pair if pair[0][1] == 0 or 0 < pair[0][0] < pair[0][1] else tuple((q, p) for p, q in pair)
        for pair in coils
    }


def _singles(
    unit: RawTransformer, banks: Banks, refuse: Callable[[str], list[InlineTransformer]]
) -> list[InlineTransformer]:
    """Return a row for each coil that is fed: any connection without a neutral of its own."""
    for winding in unit.windings:
        if winding.delta:
            continue
        if (
            neutral_ohm(winding, unit.phases, banks.neutrals) != 0j
            and winding.end.nodes[unit.phases] > 3
        ):
            return refuse("its neutral is not solidly earthed, and its phases are no usual three")
    rows = []
    for limb, coils in enumerate(coils_of(unit)):
        earthed = [tuple(node if node <= 3 else 0 for node in coil) for coil in coils]
        fed = all(
            (winding.end.bus, node) in banks.live
            for winding, coil in zip(unit.windings, earthed, strict=True)
            for node in coil
            if node > 0
        )
        if not fed:
            continue
        sides = _sides(earthed)
        if sides is None:
            return refuse("one of its coils is the wrong way round, or on no phase")
        name = unit.name if unit.phases == 1 else f"{unit.name}_{limb + 1}"
        first, second = unit.windings
        rows.append(
            InlineTransformer(
                name=banks.names.of(name),
                from_bus=banks.buses.of(first.end.bus),
                to_bus=banks.buses.of(second.end.bus),
                connection="single",
                rating_kva=first.kva / unit.phases,
                kv_from=coil_kv(first, unit.phases),
                kv_to=coil_kv(second, unit.phases),
                leakage_pu=leakage_pu(unit),
                magnetizing_pu=_magnetizing(unit),
                from_tap=first.tap,
                to_tap=second.tap,
                phases=sides[0],
                to_phases=sides[1],
            )
        )
    if not rows:
        return refuse("none of its coils is fed at both ends")
    how = _winding_names(unit) if unit.phases == 1 else "a single-phase unit for each coil"
    banks.findings.add("transformer", unit.name, "as it is", how)
    return rows


def _sides(coils: list[tuple[int, ...]]) -> tuple[str, str] | None:
    """Return the phases of either coil, the polarity turned where a coil starts at earth."""
    for turned in (coils, [(q, p) for p, q in coils]):
        if all(p > 0 and p != q for p, q in turned):
            first, second = (letters([n for n in coil if n > 0]) for coil in turned)
            return first, second
    return None


def _centre_tap(
    unit: RawTransformer, banks: Banks, refuse: Callable[[str], list[InlineTransformer]]
) -> list[InlineTransformer]:
    """Return a single-phase unit with two low-voltage legs that lie against each other."""
    high, one, two = unit.windings
    start, leg_one, leg_two = coils_of(unit)[0]
    if leg_one[0] == 0:
        # both turned: the legs change their places
        one, two, leg_one, leg_two = two, one, leg_two, leg_one
    lies = (
        leg_one[0] in (1, 2, 3) and leg_one[1] == 0 and leg_two[0] == 0 and leg_two[1] in (1, 2, 3)
    )
    if one.end.bus != two.end.bus or not lies or leg_one[0] == leg_two[1]:
        return refuse("three windings that are no two legs of opposite sense on one bus")
    if one.kv != two.kv or one.tap != two.tap:
        return refuse("its two legs have different voltages")
    sides = _sides([start, (1, 0)])
    if sides is None:
        return refuse("its first winding is on no phase, or the wrong way round")
    x12, x13, x23 = (value / 100.0 for value in unit.x_pct)
    star = [
        complex(winding.r_pct / 100.0, x / 2.0)
        for winding, x in zip(
            unit.windings, (x12 + x13 - x23, x12 + x23 - x13, x13 + x23 - x12), strict=True
        )
    ]
    if abs(star[1] - star[2]) > 1e-9 * abs(star[0] + star[1]):
        how = f"its legs' impedances, {star[1]:.3g} and {star[2]:.3g} pu, are made equal"
        banks.findings.add("transformer", unit.name, "approximated", how)
    else:
        banks.findings.add("transformer", unit.name, "as it is", "centre-tap")
    return [
        InlineTransformer(
            name=banks.names.of(unit.name),
            from_bus=banks.buses.of(high.end.bus),
            to_bus=banks.buses.of(one.end.bus),
            connection="centre-tap",
            rating_kva=high.kva,
            kv_from=high.kv,
            kv_to=2.0 * one.kv,
            leakage_pu=star[0],
            leg_leakage_pu=(star[1] + star[2]) / 2.0,
            magnetizing_pu=_magnetizing(unit),
            from_tap=high.tap,
            to_tap=one.tap,
            phases=sides[0],
            to_phases=letters([leg_one[0], leg_two[1]]),
        )
    ]
