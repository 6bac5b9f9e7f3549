"""A small feeder with laterals of one phase and two, and service transformers, to be folded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from openphase.model.parts import (
    Feeder,
    InlineTransformer,
    Line,
    LineCode,
    Load,
    Place,
    Point,
    Section,
    Source,
)

__all__ = ["SOURCE", "TRUNK", "feeder_with_laterals"]

SOURCE = Source(
    bus="s",
    kv_ll=4.16,
    emf_pu=1.02,
    z1_ohm=0.1 + 0.5j,
    z2_ohm=0.1 + 0.5j,
    z0_ohm=0.2 + 0.7j,
    frequency_hz=60.0,
)
CODES = (
    LineCode(
        name="three",
        r_ohm_per_km=((0.3, 0.1, 0.1), (0.1, 0.3, 0.1), (0.1, 0.1, 0.3)),
        x_ohm_per_km=((0.8, 0.35, 0.3), (0.35, 0.8, 0.33), (0.3, 0.33, 0.8)),
        c_nf_per_km=((10.0, -2.0, -1.0), (-2.0, 10.0, -1.5), (-1.0, -1.5, 10.0)),
    ),
    LineCode(
        name="two",
        r_ohm_per_km=((0.8, 0.1), (0.1, 0.8)),
        x_ohm_per_km=((0.8, 0.3), (0.3, 0.8)),
        c_nf_per_km=((8.0, -1.0), (-1.0, 8.0)),
    ),
    LineCode(name="one", r_ohm_per_km=((0.8,),), x_ohm_per_km=((0.8,),), c_nf_per_km=((8.0,),)),
)
TRUNK = ("s", "t1", "t2")


def line(start: str, end: str, phases: str, km: float) -> Line:
    code = {1: "one", 2: "two", 3: "three"}[len(phases)]
    name = f"{start}-{end}"
    return Line(name=name, from_bus=start, to_bus=end, length_km=km, phases=phases, code=code)


def service(bus: str, phase: str) -> InlineTransformer:
    return InlineTransformer(
        name=f"T{bus}",
        from_bus=bus,
        to_bus=f"{bus}.lv",
        connection="centre-tap",
        rating_kva=50.0,
        kv_from=2.4,
        kv_to=0.24,
        leakage_pu=0.006 + 0.01j,
        leg_leakage_pu=0.012 + 0.01j,
        magnetizing_pu=0.002 - 0.005j,
        phases=phase,
        to_phases="ab",
    )


def load(bus: str, kw: float, exponent: float, **values: object) -> Load:
    base = Load(
        name=f"load {bus}",
        transformer=None,
        place=Place(bus=bus),
        connection="wye",
        kw=kw,
        power_factor=0.9,
        exponent=exponent,
    )
    return replace(base, **values)


def feeder_with_laterals(seed: int, *, linear: bool) -> Feeder:
    """A trunk of three buses with laterals of one phase, of two, and service transformers."""
    rng = np.random.default_rng(seed)

    def law() -> float:
        return 2.0 if linear else float(rng.choice([0.0, 0.8, 1.0, 2.0]))

    lines = [line("s", "t1", "abc", 1.0), line("t1", "t2", "abc", 1.0)]
    loads = [load("t2", 300.0, law())]
    units = []
    for phase in "abc":
        before = "t1"
        for step in range(3):
            bus = f"{phase}{step}"
            lines.append(line(before, bus, phase, float(rng.uniform(0.1, 0.5))))
            loads.append(load(bus, float(rng.uniform(10, 40)), law(), phases=phase))
            units.append(service(bus, phase))
            lv = {"phases": "ab", "connection": "delta", "branch_kv": 0.24, "kvar": 5.0}
            loads.append(load(f"{bus}.lv", float(rng.uniform(5, 20)), law(), **lv))
            before = bus
    before = "t2"
    for step in range(3):
        bus = f"ac{step}"
        lines.append(line(before, bus, "ac", float(rng.uniform(0.1, 0.5))))
        how = "wye" if rng.random() < 0.5 else "delta"
        loads.append(load(bus, float(rng.uniform(10, 60)), law(), phases="ac", connection=how))
        before = bus
    return Feeder(
        name="example",
        source=SOURCE,
        lines=tuple(lines),
        transformers=(),
        loads=tuple(loads),
        switches=(),
        points=(Point(name="A", bus="s", line="s-t1"), Point(name="B", bus="t1", line="t1-t2")),
        sections=(Section(local="A", remote="B"),),
        codes=CODES,
        inline_transformers=tuple(units),
    )
