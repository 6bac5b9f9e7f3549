"""What is written reads back: real feeders' parts, in the file itself or in tables beside it."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from openphase.model import (
    Capacitor,
    Coordinates,
    Der,
    Feeder,
    InlineTransformer,
    InputError,
    Line,
    LineCode,
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
    load_feeder,
    make_feeder,
    read_feeder,
    shipped_feeders,
    write_feeder,
)
from openphase.model.parts import InlineConnection, Neutral
from openphase.model.reading.feeder_file import feeder_content

DOC = Path(__file__).parents[3] / "docs" / "feeder-file.md"
KINDS: tuple[InlineConnection, ...] = (
    "Yg/Yg", "Y/Yg", "Yg/Y", "Y/Y", "D/Yg", "D/Y", "Yg/D", "Y/D", "D/D", "single", "centre-tap",
)  # fmt: skip


class Draw:
    """A random feeder in the making: every bus and the phases it has."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.phases = {"S": "abc"}
        self.volts = {"S": 7200.0}

    def some(self, phases: str, least: int = 1) -> str:
        count = self.rng.randint(min(least, len(phases)), len(phases))
        return "".join(self.rng.sample(phases, count))

    def z(self, low: float = 0.01) -> complex:
        return complex(self.rng.uniform(low, 1.0), 10.0 ** self.rng.uniform(-3, 1))

    def maybe(self, value: Any) -> Any:
        return value if self.rng.random() < 0.5 else None

    def bus(self, least: int = 1) -> str:
        """A bus with so many phases at least."""
        return self.rng.choice([bus for bus, own in self.phases.items() if len(own) >= least])

    def grown(self, phases: str, volts: float) -> str:
        bus = f"b{len(self.phases)}" + self.rng.choice(["", ",", " é", '"', "'"])
        self.phases[bus], self.volts[bus] = phases, volts
        return bus

    def matrix(self, size: int, *, mutual: float) -> tuple[tuple[float, ...], ...]:
        own = [[self.rng.uniform(1.0, 2.0) for _ in range(size)] for _ in range(size)]
        return tuple(
            tuple(own[i][i] if i == j else mutual * own[min(i, j)][max(i, j)] for j in range(size))
            for i in range(size)
        )

    def code(self, name: str, size: int) -> LineCode:
        return LineCode(
            name=name,
            r_ohm_per_km=self.matrix(size, mutual=0.1),
            x_ohm_per_km=self.matrix(size, mutual=0.3),
            c_nf_per_km=self.maybe(self.matrix(size, mutual=-0.2)),
        )

    def line(self, n: int) -> Line:
        start = self.bus()
        phases = self.phases[start] if n < 3 else self.some(self.phases[start])
        coded = self.rng.random() < 0.6
        return Line(
            name=f"l{n}",
            from_bus=start,
            to_bus=self.grown(phases, self.volts[start]),
            length_km=self.rng.uniform(0.01, 9.0),
            z1_ohm_per_km=None if coded else self.z(),
            z0_ohm_per_km=None if coded else self.z(),
            c1_nf_per_km=0.0 if coded else self.rng.choice([0.0, 9.0]),
            phases=phases,
            code=f"c{len(phases)}" if coded else None,
        )

    def inline(self, n: int) -> InlineTransformer:
        kind = self.rng.choice(KINDS)
        single = kind in ("single", "centre-tap")
        start = self.bus(1 if single else 3)
        phases = self.some(self.phases[start])[:2] if single else "abc"
        legs = self.some("abc", 2)[:2] if kind == "centre-tap" else self.some("abc")[:2]
        to_phases = legs if single else "abc"
        sides = kind.partition("/")[::2]
        return InlineTransformer(
            name=f"x{n}",
            from_bus=start,
            to_bus=self.grown(to_phases, 240.0),
            connection=kind,
            rating_kva=self.rng.uniform(5, 5000),
            kv_from=self.volts[start] / 1000.0,
            kv_to=self.rng.uniform(0.2, 30.0),
            leakage_pu=0.1 * self.z(),
            leg_leakage_pu=0.05 * self.z() if kind == "centre-tap" else None,
            magnetizing_pu=self.maybe(0.001 - 0.01j) or 0j,
            from_tap=self.rng.choice([1.0, 0.975]),
            to_tap=self.rng.choice([1.0, 1.05]),
            phases=phases,
            to_phases=to_phases,
            shift=self.rng.choice(["lag", "lead"])
            if (sides[0] == "D") != (sides[1] == "D")
            else "lag",
            from_neutral_ohm=self.maybe(self.z()) or 0j if sides[0] == "Yg" else 0j,
            to_neutral_ohm=self.maybe(self.z()) or 0j if sides[1] == "Yg" else 0j,
        )

    def regulator(self, n: int) -> Regulator:
        kind = self.rng.choice(["earth", "open", "next"])
        start = self.bus(1 if kind == "earth" else 3)
        units = self.some(self.phases[start]) if kind == "earth" else "abc"
        reference: Any = kind
        if kind == "open":
            reference = self.rng.choice(units)
            units = units.replace(reference, "")
        through = "abc" if kind == "open" else units
        tap = self.rng.randint(-16, 16)
        a, b, c = (tap if phase in units else 0 for phase in "abc")
        return Regulator(
            name=f"r{n}",
            from_bus=start,
            to_bus=self.grown(through, self.volts[start]),
            taps=(a, b, c),
            step_pct=self.rng.choice([0.625, 1.25]),
            most_taps=16,
            phases=units,
            reference=reference,
            z_ohm=self.maybe(self.z()) or 0j,
            jumper_ohm=self.maybe(self.z()) or 0j if kind == "open" else 0j,
            gang=self.rng.random() < 0.5,
        )

    def place(self, lines: list[Line]) -> tuple[Place, str]:
        """A place, and the phases it has."""
        if self.rng.random() < 0.5:
            bus = self.bus()
            return Place(bus=bus), self.phases[bus]
        line = self.rng.choice(lines)
        return Place(line=line.name, at=self.rng.uniform(0.1, 0.9)), line.phases

    def load(self, n: int, lines: list[Line]) -> Load:
        place, there = self.place(lines)
        delta = len(there) > 1 and self.rng.random() < 0.4
        phases = self.some(there, 2 if delta else 1)
        law = self.rng.choice(["exponent", "both", "zip"])
        kvar = self.maybe(self.rng.uniform(-50, 50))
        zp, ip, zq, iq = (self.rng.uniform(-1, 2) for _ in range(4))
        shares = (zp, ip, 1 - zp - ip, zq, iq, 1 - zq - iq)
        return Load(
            name=f"load {n}",
            transformer=None,
            place=place,
            connection="delta" if delta else "wye",
            kw=self.rng.uniform(0, 99),
            power_factor=1.0 if kvar is not None else self.rng.choice([1.0, -0.9]),
            exponent=2.0 if law == "zip" else self.rng.uniform(0, 3),
            motor_share=self.rng.choice([0.0, 0.4]) if len(phases) == 3 else 0.0,
            phases=phases,
            branch_kv=self.maybe(self.rng.uniform(0.1, 8)),
            kvar=kvar,
            exponent_q=self.rng.uniform(0, 4) if law == "both" else None,
            zip=shares if law == "zip" else None,
            v_min_pu=self.rng.choice([0.7, 0.8]),
            v_max_pu=self.maybe(1.05),
            v_low_pu=self.maybe(0.5),
            edge_exponent=self.maybe(0.0),
        )


def random_feeder(seed: int) -> Feeder:
    """Return a random feeder with all that real ones have, loops and the odd name included."""
    draw = Draw(seed)
    rng = draw.rng
    lines = [draw.line(n) for n in range(rng.randint(3, 6))]
    regulators = [draw.regulator(n) for n in range(rng.randint(0, 2))]
    inline = [draw.inline(n) for n in range(rng.randint(0, 4))]
    neutral: Neutral = rng.choice(["solid", "resistor"])
    units = [
        Transformer(
            name=f"t{n}",
            place=Place(bus=draw.bus(3)),
            connection=rng.choice(["Yg/Yg", "unknown"]),
            rating_kva=50.0,
            leakage_pu=0.1 * draw.z(),
            x0_pu=None,
        )
        for n in range(rng.randint(0, 2))
    ]
    whole = [line for line in lines if len(line.phases) == 3]
    points = [
        Point(name=f"{line.name}{end}", bus=bus, line=line.name)
        for line in whole
        for end, bus in (("from", line.from_bus), ("to", line.to_bus))
    ]
    tied = rng.choice(whole)
    return make_feeder(
        name=f"random{seed}",
        source=Source(
            bus="S",
            kv_ll=12.47,
            emf_pu=1.02,
            z1_ohm=draw.z(),
            z2_ohm=draw.z(),
            z0_ohm=draw.z(),
            frequency_hz=60.0,
            neutral=neutral,
            neutral_ohm=8 + 0j if neutral == "resistor" else 0j,
            angle_deg=rng.choice([0.0, 30.0, -120.5]),
        ),
        codes=[draw.code(f"c{size}", size) for size in (1, 2, 3)],
        lines=[*lines, replace(tied, name="second way")],
        inline_transformers=inline,
        transformers=units,
        loads=[
            *(draw.load(n, lines) for n in range(rng.randint(1, 6))),
            *(
                Load(
                    name=f"at {unit.name}",
                    transformer=unit.name,
                    place=None,
                    connection="wye",
                    kw=5.0,
                    power_factor=0.9,
                    exponent=1.0,
                )
                for unit in units
            ),
        ],
        ders=[
            Der(
                name="pv",
                transformer=None,
                place=Place(bus=draw.bus(3)),
                kw=9.0,
                power_factor=1.0,
                model="constant_current",
                z1_ohm=None,
                z2_ohm=None,
                z0_ohm=draw.maybe(draw.z()),
            )
        ],
        capacitors=[
            Capacitor(
                name=f"bank {n}",
                place=place,
                connection="wye",
                kvar=rng.uniform(1, 99),
                phases=draw.some(there),
                branch_kv=draw.maybe(7.2),
            )
            for n, (place, there) in enumerate(draw.place(lines) for _ in range(2))
        ],
        regulators=regulators,
        switches=[
            Switch(name="fuse", from_bus="S", to_bus="stub", closed=True, phases=draw.some("abc")),
            *(
                Switch(name=f"tie {n}", from_bus="S", to_bus=tied.to_bus, closed=False)
                for n in range(2)
            ),
        ],
        points=points,
        sections=[
            Section(local=a.name, remote=b.name)
            for a, b in zip(points[::2], points[1::2], strict=True)
            if a.bus != "S"
        ],
        coordinates=[
            Coordinates(bus=bus, x=rng.uniform(-9, 9), y=float(n))
            for n, bus in enumerate(rng.sample(list(draw.phases), 3))
        ],
        imported_from=rng.choice([None, "a.dss"]),
    )


@pytest.mark.parametrize("seed", range(40))
def test_what_is_written_reads_back(seed: int, tmp_path: Path) -> None:
    feeder = random_feeder(seed)
    for tables in (False, True):
        path = tmp_path / f"{tables}.toml"
        files = write_feeder(feeder, path, tables=tables, comment="From a book,\n\npage 7")
        assert set(files) == set(tmp_path.glob(f"{tables}.*"))
        read = read_feeder(path)
        assert read == feeder
        assert read.origins == feeder.origins
        assert read.imported_from == feeder.imported_from
    assert feeder_from_toml(feeder_content(feeder), "content") == feeder


def test_the_random_feeders_have_everything() -> None:
    feeders = [random_feeder(seed) for seed in range(40)]
    assert {unit.connection for f in feeders for unit in f.inline_transformers} == set(KINDS)
    assert {len(line.phases) for f in feeders for line in f.lines} == {1, 2, 3}
    assert {part.reference for f in feeders for part in f.regulators} == set("abc") | {
        "earth",
        "next",
    }
    assert {load.zip is None for f in feeders for load in f.loads} == {True, False}


def test_the_same_feeder_gives_the_same_bytes(tmp_path: Path) -> None:
    written = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        files = write_feeder(random_feeder(3), tmp_path / name / "f.toml", tables=True)
        written.append([(file.name, file.read_bytes()) for file in files])
    assert written[0] == written[1]
    assert b"\r" not in b"".join(content for _, content in written[0])


def test_tables_are_called_after_the_file_and_listed_in_it(tmp_path: Path) -> None:
    files = write_feeder(random_feeder(3), tmp_path / "the: town.toml", tables=True)
    text = files[0].read_text(encoding="utf-8")
    assert "[[loads]]" not in text
    assert 'loads = "the-town.loads.csv"' in text
    assert "[[codes]]" in text


@pytest.mark.parametrize("name", shipped_feeders())
def test_shipped_feeders_read_back_from_tables(name: str, tmp_path: Path) -> None:
    feeder = load_feeder(name)
    write_feeder(feeder, tmp_path / "f.toml", tables=True)
    assert read_feeder(tmp_path / "f.toml") == feeder


def test_a_file_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"must be a file to write, got No such file"):
        write_feeder(random_feeder(3), tmp_path / "none" / "f.toml")


def test_the_documented_unbalanced_example_is_read() -> None:
    section = DOC.read_text(encoding="utf-8").partition("## An unbalanced example\n")[2]
    feeder = feeder_from_toml(section.partition("```toml\n")[2].partition("```")[0], "example")
    assert {line.phases for line in feeder.lines} == {"abc", "cab", "b"}
    assert {unit.connection for unit in feeder.inline_transformers} == {"D/Yg", "centre-tap"}
    assert feeder.loads[2].phases == "b"
    assert feeder_from_toml(dump_feeder(feeder), "dumped") == feeder
