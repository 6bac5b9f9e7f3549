"""Random feeders of mixed phases and voltages, with every part a real one may have.

Radial, or with loops; three or four wires; laterals of one and two phases, untransposed lines,
regulators of every reference, transformers of every connection between two buses, single ones
and banks of them, loads with laws of their own.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from oracles.mixed_edges import grow, tie
from oracles.mixed_ground import (
    ROOT,
    Ground,
    Zone,
    chosen,
    new_ground,
    place_on,
    polar,
    some_of,
)

from openphase.model.parts import (
    Capacitor,
    Connection,
    Der,
    DerModel,
    Feeder,
    Load,
    LoadConnection,
    Place,
    Point,
    Transformer,
)

__all__ = ["random_mixed_feeder"]

MODELS: tuple[DerModel, ...] = ("thevenin", "constant_current", "constant_power", "generator")
HUNG: tuple[Connection, ...] = ("Yg/Yg", "D/Yg", "Yg/D", "Y/D", "D/D")
ZIP = 0.3


def random_mixed_feeder(
    rng: np.random.Generator,
    edges: int,
    loops: int = 0,
    *,
    linear: bool = False,
    machines: bool = True,
    hung: bool = True,
) -> Feeder:
    """A feeder of ``edges`` lines, switches, regulators and transformers, and its ties.

    ``linear``: all loads are constant impedances; ``machines``: some have motors, and there
    are DER; ``hung``: some stand behind transformers that hang on the feeder.
    """
    ground = new_ground(rng)
    for n in range(edges):
        grow(ground, plain=n == 0)
    for _ in range(loops):
        tie(ground)
    units = _units(ground) if hung else []
    loads = [_load(ground, n, units, linear) for n in range(int(rng.integers(2, edges + 2)))]
    loads = [_with_motors(rng, load) for load in loads] if machines else loads
    return Feeder(
        name="mixed",
        source=ground.source,
        lines=tuple(ground.lines),
        transformers=tuple(units),
        loads=tuple(loads),
        switches=tuple(ground.switches),
        points=_points(ground),
        sections=(),
        ders=_ders(ground, units) if machines else (),
        capacitors=tuple(_capacitor(ground, n) for n in range(int(rng.choice([0, 0, 1, 2, 3])))),
        regulators=tuple(ground.regulators),
        codes=tuple(ground.codes),
        inline_transformers=tuple(ground.inlines),
    )


def _whole(ground: Ground) -> tuple[Place, Zone]:
    """A place with all three phases; the source's bus where no other is found."""
    for _ in range(20):
        place, phases, zone = place_on(ground.rng, ground)
        if phases == "abc" and not zone.legs:
            return place, zone
    return Place(bus=ground.source.bus), ground.buses[0].zone


def _units(ground: Ground) -> list[Transformer]:
    rng = ground.rng
    units = []
    for n in range(int(rng.choice([0, 0, 1, 2]))):
        place, zone = _whole(ground)
        kinds = [kind for kind in HUNG if zone.earthed or not kind.startswith("Yg")]
        kind = chosen(rng, kinds)
        units.append(
            Transformer(
                name=f"T{n}",
                place=place,
                connection=kind,
                rating_kva=zone.va / 1000.0 * float(rng.uniform(0.1, 0.3)),
                leakage_pu=polar(float(rng.uniform(0.02, 0.07)), float(rng.uniform(55, 88))),
                x0_pu=float(rng.uniform(0.3, 2.0))
                if kind == "Yg/Yg" and rng.random() < 0.5
                else None,
                xm_pu=float(rng.uniform(15, 150)) if rng.random() < 0.4 else None,
            )
        )
    return units


def _branches(
    rng: np.random.Generator, phases: str, zone: Zone
) -> tuple[LoadConnection, str, float | None] | None:
    """Connection, phases and sometimes the voltage of a direct load; None: there is no way."""
    kinds: list[LoadConnection] = ["wye"] if zone.earthed else []
    kinds += ["delta"] if len(phases) > 1 else []
    if not kinds:
        return None
    kind = chosen(rng, kinds)
    least = 1 if kind == "wye" else 2
    own = some_of(rng, phases, int(rng.integers(least, len(phases) + 1)))
    nominal = zone.volts / 1000.0
    if kind == "delta":
        nominal *= 2.0 if zone.legs else ROOT
    given = zone.legs or rng.random() < 0.3
    kv = nominal * float(rng.choice([1.0, 0.97, 1.04])) if given else None
    order = "".join(own[k] for k in rng.permutation(len(own)))
    return kind, order, kv


def _somewhere(ground: Ground) -> tuple[Place, tuple[LoadConnection, str, float | None], Zone]:
    while True:
        place, phases, zone = place_on(ground.rng, ground)
        found = _branches(ground.rng, phases, zone)
        if found is not None:
            return place, found, zone


def _load(ground: Ground, n: int, units: list[Transformer], linear: bool) -> Load:
    rng = ground.rng
    pf = 1.0 if rng.random() < 0.2 else float(rng.choice([1, 1, 1, -1]) * rng.uniform(0.85, 0.999))
    if units and rng.random() < 0.3:
        unit = chosen(rng, units)
        load = Load(
            name=f"D{n}",
            transformer=unit.name,
            place=None,
            connection="wye",
            kw=unit.rating_kva * float(rng.uniform(0.2, 0.6)),
            power_factor=pf,
            exponent=2.0,
        )
    else:
        place, (kind, phases, kv), zone = _somewhere(ground)
        kw = zone.va / 1000.0 * float(rng.uniform(0.01, 0.06)) * len(phases) / 3.0
        load = Load(
            name=f"D{n}",
            transformer=None,
            place=place,
            connection=kind,
            kw=kw,
            power_factor=pf,
            exponent=2.0,
            phases=phases,
            branch_kv=kv,
        )
    if rng.random() < 0.3:
        load = replace(load, power_factor=1.0, kvar=load.kw * float(rng.uniform(-0.3, 0.7)))
    return load if linear else replace(load, **_law(rng))


def _law(rng: np.random.Generator) -> dict[str, Any]:
    """What a load's powers do with its voltage, and between which voltages."""
    law: dict[str, Any] = {
        "exponent": float(rng.choice([0.0, 1.0, 2.0, rng.uniform(0, 2)])),
        "exponent_q": float(rng.choice([0.0, 2.0, rng.uniform(0, 4)]))
        if rng.random() < 0.3
        else None,
    }
    if rng.random() < ZIP:
        p, q = rng.dirichlet(np.ones(3), 2)
        law = {"exponent": 2.0, "zip": tuple(float(share) for share in (*p, *q))}
    if rng.random() < 0.5:
        law["v_min_pu"] = float(rng.uniform(0.6, 0.95))
        law["v_low_pu"] = 0.5 if rng.random() < 0.5 else None
    if rng.random() < 0.15:
        law["edge_exponent"] = 0.0
    if rng.random() < 0.4:
        law["v_max_pu"] = float(rng.uniform(1.02, 1.1))
    return law


def _with_motors(rng: np.random.Generator, load: Load) -> Load:
    """Motors take all three phases, by the exponent alone."""
    lawful = (
        load.zip is None
        and load.edge_exponent is None
        and load.exponent_q is None
        and load.v_max_pu is None
    )
    if not lawful or load.v_min_pu != 0.7 or len(load.phases) < 3 or rng.random() < 0.6:
        return load
    share = float(rng.choice([1.0, rng.uniform(0.1, 0.9)]))
    phases, kv = ("abc", load.branch_kv) if load.transformer is None else (load.phases, None)
    return replace(
        load,
        phases=phases,
        branch_kv=kv,
        motor_share=share,
        motor_y2_y1=float(rng.uniform(2, 8)),
    )


def _ders(ground: Ground, units: list[Transformer]) -> tuple[Der, ...]:
    rng = ground.rng
    ders = []
    for n in range(int(rng.choice([0, 0, 0, 1, 2]))):
        place, zone = _whole(ground)
        unit = chosen(rng, units) if units and rng.random() < 0.4 else None
        kw = float(rng.uniform(0.02, 0.1) * zone.va / 1000.0)
        volts = zone.volts
        if unit is not None:
            kw = unit.rating_kva * float(rng.uniform(0.1, 0.4))
            volts = _volts_at(ground, unit.place)
        z1 = 3.0 * volts**2 / kw / 1000.0 * complex(rng.uniform(0, 0.05), rng.uniform(0.15, 0.4))
        model = chosen(rng, MODELS)
        still = model in ("constant_current", "constant_power")
        to_earth = (unit is not None or zone.earthed) and rng.random() < 0.4
        ders.append(
            Der(
                name=f"G{n}",
                transformer=None if unit is None else unit.name,
                place=place if unit is None else None,
                kw=kw,
                power_factor=float(rng.choice([1.0, rng.uniform(0.9, 1), -rng.uniform(0.9, 1)])),
                model=model,
                z1_ohm=None if still else z1,
                z2_ohm=None if still and rng.random() < 0.6 else z1 * rng.uniform(0.5, 1.5),
                z0_ohm=z1 * rng.uniform(0.2, 1.0) if to_earth else None,
            )
        )
    return tuple(ders)


def _volts_at(ground: Ground, place: Place) -> float:
    if place.line is not None:
        return ground.zone_of[place.line].volts
    return next(bus.zone.volts for bus in ground.buses if bus.name == place.bus)


def _capacitor(ground: Ground, n: int) -> Capacitor:
    place, (kind, phases, kv), zone = _somewhere(ground)
    share = float(ground.rng.uniform(0.005, 0.04))
    return Capacitor(
        name=f"C{n}",
        place=place,
        connection=kind,
        kvar=zone.va / 1000.0 * share * len(phases) / 3.0,
        phases=phases,
        branch_kv=kv,
    )


def _points(ground: Ground) -> tuple[Point, ...]:
    """At some ends of lines of three phases."""
    rng = ground.rng
    whole = [line for line in ground.lines if len(line.phases) == 3]
    ends = [(line, bus) for line in whole for bus in (line.from_bus, line.to_bus)]
    kept = [end for end in ends if rng.random() < 0.2]
    return tuple(Point(name=f"P{n}", bus=bus, line=line.name) for n, (line, bus) in enumerate(kept))
