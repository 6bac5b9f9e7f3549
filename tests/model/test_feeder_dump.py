"""Writing a feeder to a file and reading it back changes nothing."""

from __future__ import annotations

import random

import pytest

from openphase.model import (
    Feeder,
    Line,
    Load,
    Place,
    Point,
    Section,
    Source,
    Switch,
    Transformer,
    dump_feeder,
    feeder_from_toml,
    make_feeder,
)
from openphase.model.parts import Connection

CONNECTIONS: tuple[Connection, ...] = ("Yg/Yg", "D/Yg", "Yg/D")


def random_feeder(seed: int) -> Feeder:
    """Return a random tree with everything a feeder can have, the odd name included."""
    rng = random.Random(seed)

    def z(low: float = 0.0) -> complex:
        return complex(rng.uniform(low, 1.0), rng.choice([-1, 1]) * 10.0 ** rng.uniform(-9, 2))

    odd = rng.choice(["", " ", '"', "\\", "'", "é", "𝛀", "#", "]"])
    names = [f"b{odd}{i}" for i in range(rng.randrange(2, 9))]
    lines = [
        Line(
            name=f"l{odd}{i}",
            from_bus=names[i],
            to_bus=names[rng.randrange(i)],
            length_km=rng.uniform(1e-3, 99.0),
            z1_ohm_per_km=z(),
            z0_ohm_per_km=z(),
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
            leakage_pu=z(0.001),
            x0_pu=rng.uniform(0.1, 9) if connection == "Yg/Yg" and rng.random() < 0.5 else None,
        )
        for i, connection in enumerate(rng.choices(CONNECTIONS, k=rng.randrange(5)))
    ]
    loads = [
        Load(
            name=f"load {i}",
            transformer=unit.name if unit else None,
            place=None if unit else place(),
            connection="wye" if unit else rng.choice(["wye", "delta"]),
            kw=rng.uniform(0, 999),
            power_factor=rng.choice([1.0, rng.uniform(0.1, 1.0), -0.95]),
            exponent=rng.uniform(0, 2),
        )
        for i, unit in enumerate(rng.choices([None, *units], k=rng.randrange(6)))
    ]
    points = [
        Point(name=f"p{line.name}{end}", bus=bus, line=line.name)
        for line in lines
        for end, bus in enumerate((line.from_bus, line.to_bus))
    ]
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
        ),
        lines=lines,
        transformers=units,
        loads=loads,
        switches=[
            Switch(name="closed", from_bus=names[0], to_bus="extra", closed=True),
            Switch(name="tie", from_bus="extra", to_bus=names[-1], closed=False),
        ],
        points=points,
        sections=[
            Section(local=a.name, remote=b.name)
            for a, b in zip(points[::2], points[1::2], strict=True)
        ],
    )


@pytest.mark.parametrize("seed", range(60))
def test_writing_and_reading_changes_nothing(seed: int) -> None:
    feeder = random_feeder(seed)
    text = dump_feeder(feeder)
    assert feeder_from_toml(text, "dumped") == feeder
    assert dump_feeder(feeder_from_toml(text, "dumped")) == text
