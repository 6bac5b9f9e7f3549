"""Lines, switches, regulators and in-line transformers of random mixed feeders."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
from oracles.mixed_ground import ROOT, Bus, Ground, Zone, chosen, polar, some_of

from openphase.model.parts import (
    InlineTransformer,
    Line,
    LineCode,
    Reference,
    Regulator,
    Shift,
    Switch,
)

__all__ = ["add_line", "grow", "tie"]

WINDINGS = ("Yg", "Y", "D")
BANKS: tuple[tuple[tuple[str, str], ...], ...] = (
    (("a", "a"), ("b", "b"), ("c", "c")),
    (("ab", "ab"), ("bc", "bc")),
    (("ab", "ab"), ("bc", "bc"), ("ca", "ca")),
    (("a", "ab"), ("b", "bc")),
    (("ab", "a"), ("bc", "b"), ("ca", "c")),
)


def grow(ground: Ground, plain: bool = False) -> None:
    """One step away from a bus that is there; ``plain``: a line with all phases, or a switch."""
    rng = ground.rng
    upper = ground.buses[-1] if rng.random() < 0.5 else chosen(rng, ground.buses)
    kinds: list[Callable[[Ground, Bus], None]] = [_lateral, _switch, _regulator, _inline]
    share = [0.9, 0.1, 0.0, 0.0] if plain else [0.62, 0.08, 0.13, 0.17]
    kinds[int(rng.choice(4, p=share))](ground, upper)


def _turned(rng: np.random.Generator, upper: str, lower: str, share: float = 0.5) -> dict[str, str]:
    """Ends of a part, which may stand backwards."""
    if rng.random() < share:
        upper, lower = lower, upper
    return {"from_bus": upper, "to_bus": lower}


def _fewer(rng: np.random.Generator, phases: str) -> str:
    """All of the phases, or some."""
    size = len(phases) if rng.random() < 0.7 else int(rng.integers(1, len(phases) + 1))
    return some_of(rng, phases, size)


def _lateral(ground: Ground, upper: Bus) -> None:
    phases = _fewer(ground.rng, upper.phases)
    add_line(ground, upper, ground.bus(phases, upper.zone), phases)


def add_line(ground: Ground, upper: Bus, lower: Bus, phases: str) -> None:
    """A line of a code, in any order of its phases, or of sequence values."""
    rng, zone = ground.rng, upper.zone
    name, km = ground.name("L"), float(rng.uniform(0.1, 3.0))
    z = polar(zone.ohm * float(rng.uniform(0.002, 0.02)) / km, float(rng.uniform(30, 75)))
    nf = 0.0
    if ground.source.neutral == "isolated" or rng.random() < 0.6:
        nf = float(rng.uniform(2e-4, 5e-3)) / zone.ohm / ground.omega * 1e9 / km
    line = Line(
        name=name,
        **_turned(rng, upper.name, lower.name),
        length_km=km,
        z1_ohm_per_km=z,
        z0_ohm_per_km=z * polar(float(rng.uniform(1.4, 4.0)), float(rng.uniform(-10, 10))),
        c1_nf_per_km=nf,
        c0_nf_per_km=nf * float(rng.uniform(0.4, 1.0)),
        phases=phases,
    )
    if rng.random() < 0.65:
        order = "".join(phases[k] for k in rng.permutation(len(phases)))
        code = _code(ground, zone, z, nf, len(phases))
        line = replace(
            line, phases=order, code=code, z1_ohm_per_km=None, z0_ohm_per_km=None,
            c1_nf_per_km=0.0, c0_nf_per_km=0.0,
        )  # fmt: skip
    ground.lines.append(line)
    ground.zone_of[name] = zone


def _code(ground: Ground, zone: Zone, z: complex, nf: float, size: int) -> str:
    """Name of an untransposed code; sometimes one that is there."""
    rng = ground.rng
    known = [
        own.name
        for own in ground.codes
        if len(own.r_ohm_per_km) == size and ground.code_zones[own.name] == zone
    ]
    if known and rng.random() < 0.4:
        return chosen(rng, known)
    r, x, c = (np.zeros((size, size)) for _ in range(3))
    for i in range(size):
        for j in range(i + 1):
            near = 1.0 if i == j else float(rng.uniform(0.2, 0.45))
            r[i, j] = r[j, i] = z.real * near * rng.uniform(0.85, 1.15) * (1.0 if i == j else 0.5)
            x[i, j] = x[j, i] = z.imag * near * rng.uniform(0.85, 1.15)
            c[i, j] = c[j, i] = nf * (rng.uniform(0.9, 1.1) if i == j else -rng.uniform(0, 0.25))
    name = ground.name("K")

    def rows(matrix: np.ndarray) -> tuple[tuple[float, ...], ...]:
        return tuple(tuple(float(value) for value in row) for row in matrix)

    code = LineCode(
        name=name, r_ohm_per_km=rows(r), x_ohm_per_km=rows(x), c_nf_per_km=rows(c) if nf else None
    )
    ground.codes.append(code)
    ground.code_zones[name] = zone
    return name


def _switch(ground: Ground, upper: Bus) -> None:
    phases = _fewer(ground.rng, upper.phases)
    lower = ground.bus(phases, upper.zone)
    ends = _turned(ground.rng, upper.name, lower.name)
    ground.switches.append(Switch(name=ground.name("S"), **ends, closed=True, phases=phases))


def _regulator(ground: Ground, upper: Bus) -> None:
    """Wye where there is earth, in any phases; open or closed delta where there are three."""
    rng, zone = ground.rng, upper.zone
    kinds: list[Reference] = ["earth"] if zone.earthed and zone.solid else []
    if upper.phases == "abc" and not zone.legs:
        kinds += [chosen(rng, ["a", "b", "c"]), "next"]
    if not kinds:
        return _lateral(ground, upper)
    reference = chosen(rng, kinds)
    phases = _fewer(rng, upper.phases) if reference == "earth" else "abc".replace(reference, "")
    lower = ground.bus(phases if reference == "earth" else "abc", zone)
    gang = ground.source.neutral == "isolated" or rng.random() < 0.2
    taps = rng.integers(-6, 7, size=3)
    some = reference == "next" or rng.random() < 0.5
    ground.regulators.append(
        Regulator(
            name=ground.name("R"),
            **_turned(rng, upper.name, lower.name, 0.2 if reference == "earth" else 0.0),
            taps=tuple(  # type: ignore[arg-type]
                int(taps[0 if gang else k]) if "abc"[k] in phases else 0 for k in range(3)
            ),
            step_pct=0.625,
            most_taps=16,
            phases=phases,
            reference=reference,
            z_ohm=polar(zone.ohm * float(rng.uniform(1e-3, 1e-2)), 80.0) if some else 0j,
            jumper_ohm=complex(zone.ohm * 1e-4 * (rng.random() < 0.5) * (reference in "abc")),
            gang=gang,
        )
    )
    return None


def _inline(ground: Ground, upper: Bus) -> None:
    rng, zone = ground.rng, upper.zone
    if zone.legs:
        return _lateral(ground, upper)
    if upper.phases == "abc":
        kind = int(rng.choice(4, p=[0.5, 0.2, 0.15, 0.15]))
        makers = [_three_phase, _bank, _single, _centre_tap]
        return makers[kind](ground, upper)
    if not zone.earthed and len(upper.phases) < 2:
        return _lateral(ground, upper)
    return chosen(rng, [_single, _centre_tap])(ground, upper)


def _unit(ground: Ground, name: str, kva: float) -> InlineTransformer:
    """Everything that does not depend on the connection."""
    rng = ground.rng
    off = [1.0, 1.0, 0.95, 0.975, 1.025, 1.05]
    return InlineTransformer(
        name=name,
        from_bus="",
        to_bus="",
        connection="Yg/Yg",
        rating_kva=kva,
        kv_from=1.0,
        kv_to=1.0,
        leakage_pu=polar(float(rng.uniform(0.01, 0.06)), float(rng.uniform(45, 88))),
        magnetizing_pu=complex(rng.uniform(1e-3, 5e-3), -rng.uniform(5e-3, 2e-2))
        if rng.random() < 0.4
        else 0j,
        from_tap=float(rng.choice(off)),
        to_tap=float(rng.choice(off)),
    )


def _three_phase(ground: Ground, upper: Bus) -> None:
    """Of any connection that the zone allows; sometimes like one there is, or two in parallel."""
    rng, zone = ground.rng, upper.zone
    near, far = chosen(rng, WINDINGS), chosen(rng, WINDINGS)
    kv = float(rng.choice([0.48, 4.16, 12.0]))
    shift: Shift = "lag" if (near == "D") == (far == "D") or rng.random() < 0.5 else "lead"
    turned = bool(rng.random() < 0.2)
    twins = [own for own in ground.buses if own.zone.like[1:2] == zone.like[:1]]
    if twins and rng.random() < 0.5:
        near, far, kv, shift, turned = chosen(rng, twins).zone.like[2:]  # type: ignore[assignment]
    if near == "Yg" and not zone.earthed:
        return _lateral(ground, upper)
    kva = zone.va / 1000.0 * float(rng.uniform(0.2, 0.6))
    below = Zone(
        volts=kv * 1000.0 / ROOT,
        va=kva * 1000.0,
        earthed=(far == "Yg" and near != "Y") or bool(rng.random() < 0.3),
        solid=far == "Yg" and near != "Y",
        like=(ground.name("zone"), zone.like[0], near, far, kv, shift, turned),
    )
    sides = [
        (near, upper.name, zone.volts * ROOT / 1000.0, zone),
        (far, ground.bus("abc", below).name, kv, below),
    ]
    (first, start, kv_from, side), (second, end, kv_to, other) = sides[::-1] if turned else sides
    unit = replace(
        _unit(ground, ground.name("X"), kva),
        connection=f"{first}/{second}",
        from_bus=start,
        to_bus=end,
        kv_from=kv_from,
        kv_to=kv_to,
        shift=shift,
        from_neutral_ohm=_neutral_ohm(rng, side) if first == "Yg" else 0j,
        to_neutral_ohm=_neutral_ohm(rng, other) if second == "Yg" else 0j,
    )
    ground.inlines.append(unit)
    if rng.random() < 0.2:
        second_one = _unit(ground, ground.name("X"), kva * 0.7)
        own = ("name", "rating_kva", "leakage_pu", "magnetizing_pu")
        ground.inlines.append(
            replace(unit, to_neutral_ohm=0j, **{key: getattr(second_one, key) for key in own})
        )
    return None


def _neutral_ohm(rng: np.random.Generator, zone: Zone) -> complex:
    return complex(rng.uniform(0.01, 0.3), rng.uniform(0, 0.1)) * zone.ohm * (rng.random() < 0.3)


def _winding_kv(volts: float, letters: str) -> float:
    return volts / 1000.0 * (ROOT if len(letters) == 2 else 1.0)


def _bank(ground: Ground, upper: Bus) -> None:
    """Two or three single-phase units between the same buses, of unlike ratings."""
    rng, zone = ground.rng, upper.zone
    bank = chosen(rng, [own for own in BANKS if zone.earthed or len(own[0][0]) == 2])
    kva = zone.va / 3000.0 * float(rng.uniform(0.2, 0.5))
    below = Zone(
        volts=float(rng.choice([277.0, 2400.0])),
        va=3000.0 * kva,
        earthed=len(bank[0][1]) == 1 or bool(rng.random() < 0.3),
        solid=len(bank[0][1]) == 1,
        like=(ground.name("zone"),),
    )
    lower = ground.bus("abc", below)
    for near, far in bank:
        ground.inlines.append(
            replace(
                _unit(ground, ground.name("X"), kva * float(rng.uniform(0.8, 1.2))),
                connection="single",
                from_bus=upper.name,
                to_bus=lower.name,
                phases=near,
                to_phases=far,
                kv_from=_winding_kv(zone.volts, near),
                kv_to=_winding_kv(below.volts, far),
                from_tap=1.0,
                to_tap=1.0,
            )
        )


def _near_letters(ground: Ground, upper: Bus) -> str:
    """One phase where there is earth, or two."""
    sizes = [1] if upper.zone.earthed else []
    sizes += [2] if len(upper.phases) > 1 else []
    letters = some_of(ground.rng, upper.phases, chosen(ground.rng, sizes))
    return letters[::-1] if ground.rng.random() < 0.3 else letters


def _single(ground: Ground, upper: Bus) -> None:
    """From one phase or two to one (as of a single-wire line) or two."""
    rng, zone = ground.rng, upper.zone
    near = _near_letters(ground, upper)
    far = some_of(rng, "abc", int(rng.choice([1, 1, 2])))
    kva = zone.va / 3000.0 * float(rng.uniform(0.05, 0.3))
    below = Zone(
        volts=float(rng.choice([120.0, 2400.0, 12700.0])),
        va=3000.0 * kva,
        earthed=len(far) == 1 or bool(rng.random() < 0.4),
        solid=len(far) == 1,
        like=(ground.name("zone"),),
    )
    unit = replace(
        _unit(ground, ground.name("X"), kva),
        connection="single",
        from_bus=upper.name,
        to_bus=ground.bus(far, below).name,
        phases=near,
        to_phases=far,
        kv_from=_winding_kv(zone.volts, near),
        kv_to=_winding_kv(below.volts, far),
    )
    ground.inlines.append(unit)


def _centre_tap(ground: Ground, upper: Bus) -> None:
    rng, zone = ground.rng, upper.zone
    near = _near_letters(ground, upper)
    far = chosen(rng, ["".join(pair) for pair in combinations("abc", 2)])
    far = far[::-1] if rng.random() < 0.4 else far
    kva = zone.va / 3000.0 * float(rng.uniform(0.05, 0.2))
    below = Zone(volts=120.0, va=3000.0 * kva, earthed=True, legs=True, like=(ground.name("zone"),))
    ground.inlines.append(
        replace(
            _unit(ground, ground.name("X"), kva),
            connection="centre-tap",
            from_bus=upper.name,
            to_bus=ground.bus(far, below).name,
            phases=near,
            to_phases=far,
            kv_from=_winding_kv(zone.volts, near),
            kv_to=0.24,
            leg_leakage_pu=polar(float(rng.uniform(0.01, 0.04)), float(rng.uniform(30, 80))),
        )
    )


def tie(ground: Ground) -> None:
    """A line, or an open switch, between two buses that have like voltages."""
    rng = ground.rng
    pairs = [
        (a, b, "".join(sorted(set(a.phases) & set(b.phases))))
        for a, b in combinations(ground.buses, 2)
        if (a.zone == b.zone or (a.zone.like[1:] and a.zone.like[1:] == b.zone.like[1:]))
    ]
    pairs = [pair for pair in pairs if pair[2]]
    if not pairs:
        return
    a, b, phases = chosen(rng, pairs)
    if rng.random() < 0.35 and a.zone == b.zone:
        add_line(ground, a, b, phases)
        return
    ends = _turned(rng, a.name, b.name)
    ground.switches.append(Switch(name=ground.name("TIE"), **ends, closed=False, phases=phases))
