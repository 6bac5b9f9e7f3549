"""In-line transformers out of an OpenDSS circuit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..parts import InlineConnection, InlineTransformer, Shift
from .dss_coils import Coil, coil_kv, coils_of
from .dss_live import Node
from .dss_names import Names, letters
from .dss_neutrals import Neutrals, neutral_ohm
from .dss_records import RawTransformer
from .dss_spans import Span
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
    spans: list[Span] = field(default_factory=list)  #: lines that transformers need besides


def leakage_pu(unit: RawTransformer) -> complex:
    """Resistance of the first two windings and the reactance between them."""
    ohmic = sum(winding.r_pct for winding in unit.windings[:2])
    return complex(ohmic, unit.x_pct[0]) / 100.0


def inline_parts(unit: RawTransformer, banks: Banks) -> list[InlineTransformer]:
    """Return what a transformer becomes: one row, one for each coil, or none where refused."""
    nodes = [
        (winding.end.bus, node)
        for limb in coils_of(unit)
        for winding, coil in zip(unit.windings, limb, strict=True)
        for node in coil
        if node in (1, 2, 3)
    ]
    if not any(node in banks.live for node in nodes):
        banks.findings.add("transformer", unit.name, "not fed")
        return []
    rows, how = _rows(unit, banks, whole=all(node in banks.live for node in nodes))
    banks.findings.add("transformer", unit.name, "as it is" if rows else "refused", how)
    return rows


def _rows(
    unit: RawTransformer, banks: Banks, *, whole: bool
) -> tuple[list[InlineTransformer], str]:
    """Return the rows and what they are, or none and why.

    Parameters
    ----------
    whole
        All its phases are fed.
    """
    if len({winding.end.bus for winding in unit.windings}) == 1:
        return [], "all its windings are at one bus"
    if len(unit.windings) == 3 and unit.phases == 1:
        return _centre_tap(unit, banks)
    if len(unit.windings) != 2 or unit.phases > 3:
        return [], f"it has {len(unit.windings)} windings in {unit.phases} phases"
    if leakage_pu(unit) == 0:
        return [], "it has no leakage impedance"
    row = _three_phase(unit, banks) if unit.phases == 3 and whole else None
    return ([row], _winding_names(unit)) if row is not None else _singles(unit, banks)


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
            (p, q if winding.delta else 0)
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
        not winding.delta and (winding.end.bus, winding.end.nodes[3]) in banks.neutrals.shared
        for winding in unit.windings
    )
    if not fitting or joined:
        return None
    sides = [
        kind if kind == "D" else "Y" if ohm is None else "Yg"
        for kind, ohm in zip(kinds, neutral_ohms, strict=True)
    ]
    connection: InlineConnection = f"{sides[0]}/{sides[1]}"  # type: ignore[assignment]
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
        shift=fitting[0],
        from_neutral_ohm=neutral_ohms[0] or 0j,
        to_neutral_ohm=neutral_ohms[1] or 0j,
    )


def _turned(coils: set[tuple[Coil, ...]]) -> set[tuple[Coil, ...]]:
    """Turn every pair of coils so that the first one starts at the lower node (earth last)."""
    return {
        pair if pair[0][1] == 0 or 0 < pair[0][0] < pair[0][1] else tuple((q, p) for p, q in pair)
        for pair in coils
    }


def _singles(unit: RawTransformer, banks: Banks) -> tuple[list[InlineTransformer], str]:
    """Return a row for each coil that is fed: any connection without a neutral of its own."""
    for winding in unit.windings:
        own = not winding.delta and winding.end.nodes[unit.phases] > 3
        if own and neutral_ohm(winding, unit.phases, banks.neutrals) != 0:
            return [], "its neutral is not solidly earthed, and its phases are no usual three"
    rows = []
    for limb, coils in enumerate(coils_of(unit), start=1):
        earthed = [tuple(node if node <= 3 else 0 for node in coil) for coil in coils]
        fed = all(
            node == 0 or (winding.end.bus, node) in banks.live
            for winding, coil in zip(unit.windings, earthed, strict=True)
            for node in coil
        )
        if not fed:
            continue
        sides = _sides(earthed)
        if sides is None:
            return [], "one of its coils is the wrong way round, or on no phase"
        name = unit.name if unit.phases == 1 else f"{unit.name}_{limb}"
        rows.append(_single(unit, name, sides, banks))
    if not rows:
        return [], "none of its coils is fed at both ends"
    kind = _winding_names(unit)
    return rows, kind if unit.phases == 1 else f"{kind}: a single-phase unit for each coil"


def _single(
    unit: RawTransformer, name: str, sides: tuple[str, str], banks: Banks
) -> InlineTransformer:
    first, second = unit.windings
    return InlineTransformer(
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


def _sides(coils: list[tuple[int, ...]]) -> tuple[str, str] | None:
    """Return the phases of either coil, the polarity turned where a coil starts at earth."""
    for turned in (coils, [(q, p) for p, q in coils]):
        if all(p > 0 and p != q for p, q in turned):
            first, second = (letters([n for n in coil if n > 0]) for coil in turned)
            return first, second
    return None


def _centre_tap(unit: RawTransformer, banks: Banks) -> tuple[list[InlineTransformer], str]:
    """Return a single-phase unit with two low-voltage legs that lie against each other."""
    high, one, two = unit.windings
    start, leg_one, leg_two = coils_of(unit)[0]
    star = _star(unit)
    if leg_one[0] == 0:
        # both are turned: the legs change their places
        one, two, leg_one, leg_two = two, one, leg_two, leg_one
        star = [star[0], star[2], star[1]]
    legs = (leg_one[0], leg_two[1])
    against = leg_one[1] == 0 and leg_two[0] == 0 and set(legs) <= {1, 2, 3}
    if one.end.bus != two.end.bus or not against or legs[0] == legs[1]:
        return [], "three windings that are no two legs of opposite sense on one bus"
    if one.kv != two.kv or one.tap != two.tap:
        return [], "its two legs have different voltages"
    sides = _sides([start, (1, 0)])
    if sides is None:
        return [], "its first winding is on no phase, or the wrong way round"
    common = _common(star[1], star[2])
    bus, how = one.end.bus, "centre-tap"
    if star[1] != star[2]:
        bus = f"{bus}_{unit.name}"
        ohms = (one.kv * one.tap) ** 2 * 1000.0 / high.kva
        banks.spans.append(_legs(unit, bus, legs, [(z - common) * ohms for z in star[1:]]))
        how = "centre-tap, what its legs differ by a line of 1 m"
    row = InlineTransformer(
        name=banks.names.of(unit.name),
        from_bus=banks.buses.of(high.end.bus),
        to_bus=banks.buses.of(bus),
        connection="centre-tap",
        rating_kva=high.kva,
        kv_from=high.kv,
        kv_to=2.0 * one.kv,
        leakage_pu=star[0],
        leg_leakage_pu=common,
        magnetizing_pu=_magnetizing(unit),
        from_tap=high.tap,
        to_tap=one.tap,
        phases=sides[0],
        to_phases=letters(legs),
    )
    return [row], how


def _star(unit: RawTransformer) -> list[complex]:
    """Return the three branches that make the impedances between three windings."""
    x12, x13, x23 = (value / 100.0 for value in unit.x_pct)
    reactances = (x12 + x13 - x23, x12 + x23 - x13, x13 + x23 - x12)
    return [
        complex(winding.r_pct / 100.0, x / 2.0)
        for winding, x in zip(unit.windings, reactances, strict=True)
    ]


def _common(one: complex, two: complex) -> complex:
    """Return what both legs have: a little less than either, so that both have a rest."""
    rest = 0.05 * max(abs((one - two).real), abs((one - two).imag))
    return complex(min(one.real, two.real), min(one.imag, two.imag) - rest)


def _legs(unit: RawTransformer, bus: str, nodes: tuple[int, int], ohms: Sequence[complex]) -> Span:
    """Return the line behind a centre-tapped unit that makes its equal legs differ."""
    return Span(
        name=f"{unit.name}.legs",
        buses=(bus, unit.windings[1].end.bus),
        nodes=nodes,
        length_km=0.001,
        r_ohm=np.diag([z.real for z in ohms]),
        x_ohm=np.diag([z.imag for z in ohms]),
        c_nf=np.zeros((2, 2)),
        build=None,
    )
