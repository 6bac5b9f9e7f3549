"""Writing a feeder to a file and reading it back changes nothing."""

from __future__ import annotations

import random

import pytest

from openphase.model import (
    Capacitor,
    Der,
    Feeder,
    Line,
    Load,
    Place,
    Point,
    Regulator,
    Section,
    Source,
    Switch,
    Transformer,
    dump_feeder,
    feeder_from_toml,
    make_feeder,
)
from openphase.model.parts import Connection, DerModel, Neutral

WITH_NEUTRAL: tuple[Connection, ...] = ("Yg/Yg", "D/Yg", "Yg/D", "Y/D", "D/D", "unknown")
WITHOUT: tuple[Connection, ...] = ("D/Yg", "Y/D", "D/D", "unknown")
MODELS: tuple[DerModel, ...] = ("thevenin", "constant_current", "constant_power", "generator")
NEUTRALS: tuple[Neutral, ...] = ("solid", "resistor", "petersen", "isolated")


def random_feeder(seed: int) -> Feeder:
    """Return a random tree with everything a feeder can have, the odd name included."""
    rng = random.Random(seed)
    wires = rng.choice([3, 4])

    def z(low: float = 0.0) -> complex:
        return complex(rng.uniform(low, 1.0), rng.choice([-1, 1]) * 10.0 ** rng.uniform(-9, 2))

    def maybe(value: float) -> float | None:
        return value if rng.random() < 0.5 else None

    odd = rng.choice(["", " ", '"', "\\", "'", "é", "𝛀", "#", "]"])
    names = [f"b{odd}{i}" for i in range(rng.randrange(2, 9))]
    c1 = rng.choice([0.0, rng.uniform(1, 300)])
    lines = [
        Line(
            name=f"l{odd}{i}",
            from_bus=names[i],
            to_bus=names[rng.randrange(i)],
            length_km=rng.uniform(1e-3, 99.0),
            z1_ohm_per_km=z(),
            z0_ohm_per_km=z(),
            c1_nf_per_km=max(c1, 5.0),
            c0_nf_per_km=rng.uniform(1.0, 5.0),
        )
        for i in range(1, len(names))
    ]

    def place() -> Place:
        if rng.random() < 0.5:
            return Place(bus=rng.choice(names))
        return Place(line=rng.choice(lines).name, at=rng.choice([0.0, rng.random(), 1.0]))

    units = [
        Transformer(
            name=f"t{i}",
            place=place(),
            connection=connection,
            rating_kva=rng.uniform(5, 5000),
            leakage_pu=complex(rng.uniform(0.001, 0.1), rng.uniform(0, 0.5)),
            x0_pu=maybe(rng.uniform(0.1, 9)) if connection in ("Yg/Yg", "unknown") else None,
            xm_pu=maybe(rng.uniform(20, 90)),
        )
        for i, connection in enumerate(
            rng.choices(WITH_NEUTRAL if wires == 4 else WITHOUT, k=rng.randrange(7))
        )
    ]
    loads = [
        Load(
            name=f"load {i}",
            transformer=unit.name if unit else None,
            place=None if unit else place(),
            connection="wye" if unit else rng.choice(["wye", "delta"] if wires == 4 else ["delta"]),
            kw=rng.uniform(0, 999),
            power_factor=rng.choice([1.0, rng.uniform(0.1, 1.0), -0.95]),
            exponent=rng.uniform(0, 2),
            motor_share=rng.choice([0.0, rng.random()]),
            motor_y2_y1=rng.choice([6.0, rng.uniform(1, 8)]),
        )
        for i, unit in enumerate(rng.choices([None, *units], k=rng.randrange(6)))
    ]
    ders = [
        Der(
            name=f"pv {i}",
            transformer=unit.name if unit else None,
            place=None if unit else place(),
            kw=rng.uniform(0, 999),
            power_factor=rng.choice([1.0, -0.9]),
            model=model,
            z1_ohm=z(0.1) if model in ("thevenin", "generator") else None,
            z2_ohm=z(0.1) if model == "generator" or rng.random() < 0.5 else None,
            z0_ohm=z(0.1) if (unit or wires == 4) and rng.random() < 0.5 else None,
        )
        for i, (unit, model) in enumerate(
            zip(rng.choices([None, *units], k=4), rng.choices(MODELS, k=4), strict=True)
        )
    ]
    points = [
        Point(
            name=f"p{line.name}{end}",
            bus=bus,
            line=line.name,
            voltage_side=rng.choice(["line", "bus"]),
        )
        for line in lines
        for end, bus in enumerate((line.from_bus, line.to_bus))
    ]
    neutral = rng.choice(NEUTRALS)
    return make_feeder(
        name=f"random{seed}",
        source=Source(
            bus=rng.choice(names),
            kv_ll=rng.uniform(1, 40),
            emf_pu=rng.uniform(0.9, 1.1),
            z1_ohm=z(),
            z2_ohm=z(),
            z0_ohm=0j,
            frequency_hz=rng.choice([50.0, 60.0]),
            neutral=neutral,
            neutral_ohm={"resistor": 8 + 0j, "petersen": 2 + 40j}.get(neutral, 0j),
            wires=wires,
        ),
        lines=lines,
        transformers=units,
        loads=loads,
        ders=ders,
        capacitors=[
            Capacitor(
                name="bank",
                place=place(),
                connection=rng.choice(["wye", "delta"] if wires == 4 else ["delta"]),
                kvar=rng.uniform(1, 999),
            )
        ],
        regulators=[
            Regulator(
                name="booster",
                from_bus=rng.choice(names),
                to_bus="far",
                taps=rng.choice([(0, 0, 0), (-16, 3, 16)]),
                step_pct=rng.choice([0.625, 1.25]),
                most_taps=rng.choice([16, 20]),
            )
        ]
        if wires == 4
        else [],
        switches=[
            Switch(name="closed", from_bus=names[0], to_bus="extra", closed=True),
            Switch(name="tie", from_bus="extra", to_bus=names[-1], closed=False),
        ],
        points=points,
        sections=[
            Section(local=a.name, remote=b.name)
            for a, b in zip(points[::2], points[1::2], strict=True)
        ],
        imported_from=rng.choice([None, "a.dss"]),
    )


@pytest.mark.parametrize("seed", range(60))
def test_writing_and_reading_changes_nothing(seed: int) -> None:
    feeder = random_feeder(seed)
    text = dump_feeder(feeder)
    read = feeder_from_toml(text, "dumped")
    assert read == feeder
    assert read.origins == feeder.origins
    assert read.imported_from == feeder.imported_from
    assert dump_feeder(read) == text
