"""A random feeder furnished with everything that a feeder may have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from oracles.random_feeders import random_feeder

from openphase.model.parts import (
    Capacitor,
    Connection,
    Der,
    DerModel,
    Feeder,
    Line,
    Neutral,
    Place,
    Regulator,
    Source,
    Transformer,
)

__all__ = ["FOUR_WIRE", "THREE_WIRE", "furnished", "random_full_feeder"]

NEUTRALS: tuple[Neutral, ...] = ("solid", "resistor", "petersen", "isolated")
FOUR_WIRE: tuple[Connection, ...] = ("Yg/Yg", "D/Yg", "Yg/D", "Y/D", "D/D")
THREE_WIRE: tuple[Connection, ...] = ("D/Yg", "Y/D", "D/D")
LEAST_NF = 60.0
"""Capacitance to earth of the smallest network without solid earth: some 10 km of line."""
MODELS: tuple[DerModel, ...] = ("thevenin", "constant_current", "constant_power", "generator")


def random_full_feeder(rng: np.random.Generator, n_lines: int, with_tie: bool = False) -> Feeder:
    """A random feeder with a good share of every element, three- or four-wire."""
    feeder = random_feeder(rng, n_lines, with_tie, closed_switch=bool(rng.random() < 0.3))
    return furnished(rng, feeder)


def furnished(rng: np.random.Generator, feeder: Feeder) -> Feeder:
    """``feeder`` with neutral, charging, all connections, motors, DER, capacitors, regulators.

    Where it has three wires nothing is connected to a neutral. An isolated or compensated
    network has charging, or else nothing but its loads would hold it to earth.
    """
    wires = 3 if rng.random() < 0.4 else 4
    neutral = NEUTRALS[int(rng.integers(4))]
    lines = feeder.lines
    if neutral in ("petersen", "isolated") or rng.random() < 0.5:
        lines = _charged(rng, lines, least_nf=0.0 if neutral in ("solid", "resistor") else LEAST_NF)
    units = [_connected(rng, unit, wires) for unit in feeder.transformers]
    places = [Place(bus=line.to_bus) for line in lines]
    places += [Place(line=line.name, at=float(rng.uniform(0.05, 0.95))) for line in lines]
    ders, units = _ders(rng, feeder, units, places, wires)
    loads = tuple(
        replace(
            load,
            connection="delta" if wires == 3 else load.connection,
            motor_share=float(
                rng.choice([0.0, 0.0, rng.uniform(0.1, 0.9), 1.0], p=[0.3, 0.2, 0.4, 0.1])
            ),
            motor_y2_y1=float(rng.uniform(2.0, 8.0)),
        )
        for load in feeder.loads
    )
    full = replace(
        feeder,
        source=_grounded(rng, feeder.source, neutral, wires, lines),
        lines=lines,
        transformers=tuple(units),
        loads=loads,
        ders=ders,
        capacitors=_capacitors(rng, feeder, places, wires),
    )
    for n in range(int(rng.choice([0, 1, 2], p=[0.55, 0.3, 0.15]))):
        full = _regulated(rng, full, f"RG{n}", ganged=neutral in ("petersen", "isolated"))
    return full


def _charged(rng: np.random.Generator, lines: Sequence[Line], least_nf: float) -> tuple[Line, ...]:
    """Overhead line or cable, each line its own, all of it ``least_nf`` to earth or more."""
    per_km = []
    for _ in lines:
        c1 = float(rng.uniform(150, 350) if rng.random() < 0.3 else rng.uniform(8, 13))
        per_km.append((c1, c1 * float(rng.uniform(0.35, 1.0))))
    whole = sum(c0 * line.length_km for line, (_, c0) in zip(lines, per_km, strict=True))
    more = max(1.0, least_nf / whole)
    return tuple(
        replace(line, c1_nf_per_km=c1 * more, c0_nf_per_km=c0 * more)
        for line, (c1, c0) in zip(lines, per_km, strict=True)
    )


def _grounded(
    rng: np.random.Generator, source: Source, neutral: Neutral, wires: int, lines: Sequence[Line]
) -> Source:
    """A Petersen coil is off resonance with all that the lines charge by 10 % or more."""
    ohm = 0j
    if neutral == "resistor":
        ohm = complex(np.exp(rng.uniform(np.log(0.5), np.log(200))))
    elif neutral == "petersen":
        farad = sum(line.c0_nf_per_km * line.length_km for line in lines) * 1e-9
        resonant = 1 / (6 * np.pi * source.frequency_hz * farad)
        detuned = rng.uniform(0.7, 0.9) if rng.random() < 0.5 else rng.uniform(1.1, 1.5)
        ohm = complex(rng.uniform(0.02, 0.1), 1.0) * resonant * detuned
    return replace(source, neutral=neutral, neutral_ohm=ohm, wires=wires)


def _connected(rng: np.random.Generator, unit: Transformer, wires: int) -> Transformer:
    kinds = FOUR_WIRE if wires == 4 else THREE_WIRE
    kind = kinds[int(rng.integers(len(kinds)))]
    ideal = kind.endswith("/Yg") and rng.random() < 0.05
    return replace(
        unit,
        connection=kind,
        leakage_pu=0j if ideal else unit.leakage_pu,
        x0_pu=float(rng.uniform(0.3, 2.0)) if kind == "Yg/Yg" and rng.random() < 0.6 else None,
        xm_pu=float(rng.uniform(15, 150)) if rng.random() < 0.4 else None,
    )


def _ders(
    rng: np.random.Generator,
    feeder: Feeder,
    units: Sequence[Transformer],
    places: Sequence[Place],
    wires: int,
) -> tuple[tuple[Der, ...], list[Transformer]]:
    """None to three, behind transformers that are large enough for them, or direct."""
    total = sum(load.kw for load in feeder.loads)
    ders: list[Der] = []
    sized = {unit.name: unit for unit in units}
    for n in range(int(rng.choice([0, 1, 2, 3], p=[0.2, 0.4, 0.25, 0.15]))):
        model = MODELS[int(rng.integers(4))]
        kw = float(rng.uniform(0.03, 0.25) * total)
        base = feeder.source.kv_ll**2 * 1000.0 / kw
        z1 = base * complex(rng.uniform(0.0, 0.05), rng.uniform(0.15, 0.4))
        transformer = None
        if units and rng.random() < 0.65:
            transformer = units[int(rng.integers(len(units)))].name
            own = sized[transformer]
            sized[transformer] = replace(own, rating_kva=own.rating_kva + 1.3 * kw)
        to_earth = rng.random() < 0.4 and (transformer is not None or wires == 4)
        inverter = model in ("constant_current", "constant_power")
        ders.append(
            Der(
                name=f"G{n}",
                transformer=transformer,
                place=None if transformer else places[int(rng.integers(len(places)))],
                kw=kw,
                power_factor=float(rng.choice([1.0, rng.uniform(0.9, 1), -rng.uniform(0.9, 1)])),
                model=model,
                z1_ohm=None if inverter else z1,
                z2_ohm=None if inverter and rng.random() < 0.6 else z1 * rng.uniform(0.5, 1.5),
                z0_ohm=z1 * rng.uniform(0.2, 1.0) if to_earth else None,
            )
        )
    return tuple(ders), list(sized.values())


def _capacitors(
    rng: np.random.Generator, feeder: Feeder, places: Sequence[Place], wires: int
) -> tuple[Capacitor, ...]:
    total = sum(load.kw for load in feeder.loads)
    return tuple(
        Capacitor(
            name=f"C{n}",
            place=places[int(rng.integers(len(places)))],
            connection="wye" if wires == 4 and rng.random() < 0.6 else "delta",
            kvar=float(rng.uniform(0.05, 0.25) * total),
        )
        for n in range(int(rng.choice([0, 1, 2], p=[0.5, 0.35, 0.15])))
    )


def _regulated(rng: np.random.Generator, feeder: Feeder, name: str, *, ganged: bool) -> Feeder:
    """A regulator where a line leaves the bus that feeds it; sometimes it stands backwards.

    Unequal taps are a zero-sequence voltage in series, with which a network without solid
    earth would resonate: there they are ``ganged``.
    """
    line = feeder.lines[int(rng.integers(len(feeder.lines)))]
    upper = _upper_end(feeder, line)
    bus = f"{line.name}{name}"
    ends = (bus, upper) if rng.random() < 0.2 else (upper, bus)
    taps = rng.integers(-6, 7, size=1 if ganged else 3)
    regulator = Regulator(
        name=name,
        from_bus=ends[0],
        to_bus=ends[1],
        taps=(int(taps[0]), int(taps[-1]), int(taps[taps.size // 2])),
        step_pct=0.625,
        most_taps=16,
    )
    moved = replace(
        line,
        from_bus=bus if line.from_bus == upper else line.from_bus,
        to_bus=bus if line.to_bus == upper else line.to_bus,
    )
    return replace(
        feeder,
        lines=tuple(moved if own is line else own for own in feeder.lines),
        points=tuple(
            replace(point, bus=bus) if (point.line, point.bus) == (line.name, upper) else point
            for point in feeder.points
        ),
        regulators=(*feeder.regulators, regulator),
    )


def _upper_end(feeder: Feeder, line: Line) -> str:
    """The end of a line nearer the source, ties open."""
    edges = [(x.from_bus, x.to_bus) for x in feeder.lines]
    edges += [(x.from_bus, x.to_bus) for x in feeder.switches if x.closed]
    edges += [(x.from_bus, x.to_bus) for x in feeder.regulators]
    reached, new = {feeder.source.bus}, [feeder.source.bus]
    while new:
        bus = new.pop(0)
        if bus in (line.from_bus, line.to_bus):
            return bus
        near = {end for edge in edges if bus in edge for end in edge} - reached
        reached |= near
        new += sorted(near)
    raise AssertionError(f"line {line.name!r} is not fed")
