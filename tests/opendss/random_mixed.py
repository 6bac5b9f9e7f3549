"""Small random feeders of everything that OpenDSS can be told: linear, on buses."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from opendss.as_dss import Cut

from openphase.model.buses import bus_phases, bus_volts
from openphase.model.parts import (
    Capacitor,
    Feeder,
    InlineConnection,
    InlineTransformer,
    Line,
    LineCode,
    Load,
    Neutral,
    Place,
    Regulator,
    Source,
    Switch,
)

__all__ = ["random_cut", "random_mixed_feeder"]

THREE_PHASE: tuple[InlineConnection, ...] = (
    "Yg/Yg",
    "Y/Yg",
    "Yg/Y",
    "Y/Y",
    "D/Yg",
    "D/Y",
    "Yg/D",
    "Y/D",
    "D/D",
)
NEUTRALS: tuple[Neutral, ...] = ("solid", "solid", "solid", "resistor", "isolated")
LOW_KV = (0.48, 4.16, 12.47)


def random_cut(rng: np.random.Generator, feeder: Feeder) -> Cut:
    """One or more conductors of any line, at an end or within."""
    line = feeder.lines[int(rng.integers(len(feeder.lines)))]
    at = float(rng.choice([0.0, 1.0, rng.uniform(0.02, 0.98)]))
    count = int(rng.integers(1, len(line.phases) + 1)) if rng.random() < 0.3 else 1
    phases = sorted(str(p) for p in rng.choice(list(line.phases), size=count, replace=False))
    return Cut(line=line.name, at=at, phases="".join(phases))


def random_mixed_feeder(rng: np.random.Generator, steps: int = 8, loops: int = 0) -> Feeder:
    """Grow a feeder by ``steps`` elements, close ``loops`` more lines, then load it.

    Half of them have charging. Some stand behind a substation transformer without earth.
    """
    kv = float(rng.choice([4.16, 12.47, 24.9]))
    grown = _Grown(rng=rng, kv=kv, charged=bool(rng.random() < 0.5))
    grown.seen("S", "abc", 0)
    if rng.random() < 0.4:
        grown.three_phase("S", THREE_PHASE)
    grown.line(list(grown.phases)[-1])
    for _ in range(steps):
        grown.step()
    for _ in range(loops):
        grown.loop()
    draft = _assembled(grown, (), ())
    return _assembled(grown, *_equipment(rng, draft))


@dataclass(slots=True)
class _Grown:
    """What stands so far."""

    rng: np.random.Generator
    kv: float
    charged: bool
    phases: dict[str, str] = field(default_factory=dict)
    zone: dict[str, int] = field(default_factory=dict)  #: buses between which no transformer is
    lines: list[Line] = field(default_factory=list)
    codes: list[LineCode] = field(default_factory=list)
    units: list[InlineTransformer] = field(default_factory=list)
    regulators: list[Regulator] = field(default_factory=list)
    switches: list[Switch] = field(default_factory=list)
    volts: dict[int, float] = field(default_factory=dict)  #: nominal kV to earth of each zone

    def seen(self, bus: str, phases: str, zone: int) -> str:
        self.phases[bus], self.zone[bus] = phases, zone
        if zone not in self.volts:
            self.volts[zone] = self.kv / 3.0**0.5
        return bus

    def step(self) -> None:
        """One more element behind a bus; the newest bus more often than others."""
        buses = list(self.phases)
        last = self.rng.random() < 0.5
        bus = buses[-1] if last else buses[int(self.rng.integers(len(buses)))]
        draw = self.rng.random()
        if draw < 0.55:
            self.line(bus)
        elif draw < 0.70:
            self.regulator(bus)
        elif draw < 0.76 and self.phases[bus] == "abc":  # a loop may not close over less
            far = self.seen(self.name(), self.phases[bus], self.zone[bus])
            name = f"SW{len(self.switches)}"
            self.switches.append(
                Switch(name=name, from_bus=bus, to_bus=far, closed=True, phases=self.phases[bus])
            )
        elif self.phases[bus] == "abc" and self.rng.random() < 0.6:
            self.three_phase(bus, THREE_PHASE)
        else:
            self.single(bus)

    def name(self) -> str:
        return f"B{len(self.phases)}"

    def some(self, phases: str) -> str:
        """All of the phases, or fewer, in any order."""
        count = (
            len(phases) if self.rng.random() < 0.5 else int(self.rng.integers(1, len(phases) + 1))
        )
        return "".join(str(p) for p in self.rng.choice(list(phases), size=count, replace=False))

    def line(self, bus: str, far: str | None = None) -> None:
        rng = self.rng
        phases = self.some(self.phases[bus])
        if far is not None:
            phases = self.some("".join(p for p in self.phases[bus] if p in self.phases[far]))
        far = far or self.seen(self.name(), "".join(sorted(phases)), self.zone[bus])
        ends = (bus, far) if rng.random() < 0.6 else (far, bus)
        code = None
        base = self.volts[self.zone[bus]] ** 2 / 2.0
        size = base * 0.004 * rng.uniform(0.3, 1.5)
        z1 = complex(size * rng.uniform(0.3, 1.0), size)
        nf = rng.uniform(8, 200) if self.charged else 0.0
        if rng.random() < 0.6:
            code = self.code(len(phases), z1, nf)
        self.lines.append(
            Line(
                name=f"L{len(self.lines)}",
                from_bus=ends[0],
                to_bus=ends[1],
                length_km=float(rng.uniform(0.2, 2.0)),
                z1_ohm_per_km=None if code else z1,
                z0_ohm_per_km=None if code else z1 * complex(rng.uniform(1.5, 3.5), 0.1),
                c1_nf_per_km=0.0 if code else nf,
                c0_nf_per_km=0.0 if code else nf * 0.6,
                phases=phases,
                code=code,
            )
        )

    def code(self, size: int, z1: complex, nf: float) -> str:
        """An untransposed line: every self and mutual impedance its own."""
        rng = self.rng
        z, c = np.zeros((size, size), np.complex128), np.zeros((size, size))
        for i in range(size):
            z[i, i] = z1 * complex(rng.uniform(1.3, 1.8), rng.uniform(-0.1, 0.1))
            c[i, i] = nf * rng.uniform(0.9, 1.1)
        for i, j in combinations(range(size), 2):
            z[i, j] = z[j, i] = z1 * complex(rng.uniform(0.3, 0.6), rng.uniform(-0.1, 0.1))
            c[i, j] = c[j, i] = -nf * rng.uniform(0.1, 0.2)
        name = f"K{len(self.codes)}"
        self.codes.append(
            LineCode(
                name=name,
                r_ohm_per_km=_rows(z.real),
                x_ohm_per_km=_rows(z.imag),
                c_nf_per_km=_rows(c) if nf else None,
            )
        )
        return name

    def regulator(self, bus: str) -> None:
        rng, phases = self.rng, self.phases[bus]
        reference = "earth"
        if phases == "abc" and rng.random() < 0.4:
            reference = str(rng.choice(["a", "b", "c"]))
        far = self.seen(self.name(), phases, self.zone[bus])
        phases = phases.replace(reference, "")
        base = self.volts[self.zone[bus]] ** 2 / 2.0
        self.regulators.append(
            Regulator(
                name=f"R{len(self.regulators)}",
                from_bus=bus,
                to_bus=far,
                taps=tuple(int(rng.integers(-16, 17)) if p in phases else 0 for p in "abc"),  # type: ignore[arg-type]
                step_pct=0.625,
                most_taps=16,
                phases=phases,
                reference=reference,  # type: ignore[arg-type]
                z_ohm=complex(0.0005, 0.002) * base,
                jumper_ohm=0j if reference == "earth" else complex(0.0004, 0.0003) * base,
            )
        )

    def three_phase(self, bus: str, kinds: tuple[InlineConnection, ...]) -> None:
        rng = self.rng
        kind = kinds[int(rng.integers(len(kinds)))]
        kv_to = float(rng.choice(LOW_KV))
        zone = max(self.zone.values()) + 1
        self.volts[zone] = kv_to / 3.0**0.5
        first, second = kind.split("/")
        floating = first == "Y" and second == "Y"
        self.units.append(
            InlineTransformer(
                name=f"T{len(self.units)}",
                from_bus=bus,
                to_bus=self.seen(self.name(), "abc", zone),
                connection=kind,
                rating_kva=float(rng.uniform(1000, 3000)),
                kv_from=self.volts[self.zone[bus]] * 3.0**0.5,
                kv_to=kv_to,
                leakage_pu=complex(rng.uniform(0.002, 0.02), rng.uniform(0.03, 0.08)),
                magnetizing_pu=self.magnetizing(always=floating),
                from_tap=float(rng.choice([1.0, 1.025, 0.975])),
                to_tap=float(rng.choice([1.0, 1.05, 0.95])),
                shift="lag" if rng.random() < 0.5 else "lead",
                from_neutral_ohm=self.earthing(first),
                to_neutral_ohm=self.earthing(second),
            )
        )

    def magnetizing(self, always: bool = False) -> complex:
        """Between two ungrounded stars it is what holds the neutrals."""
        if always or self.rng.random() < 0.5:
            return complex(self.rng.uniform(0.001, 0.005), -self.rng.uniform(0.003, 0.02))
        return 0j

    def earthing(self, winding: str) -> complex:
        if winding != "Yg" or self.rng.random() < 0.5:
            return 0j
        return complex(self.rng.uniform(0.1, 5.0), self.rng.uniform(0.1, 5.0))

    def single(self, bus: str) -> None:
        """One to three single-phase units between the same two buses, or a centre-tapped one."""
        rng = self.rng
        zone = max(self.zone.values()) + 1
        here = self.phases[bus]
        ends = ["a", "b", "c", "ab", "bc", "ca"]
        ends = [e for e in ends if set(e) <= set(here)]
        volts = self.volts[self.zone[bus]]
        centre = rng.random() < 0.4
        count = 1 if centre else int(rng.integers(1, 4))
        chosen = [ends[k] for k in rng.permutation(len(ends))[:count]]
        per_phase = not centre and bool(rng.random() < 0.7)
        low = float(rng.choice([0.24, 2.4, 7.2]))
        far = self.name()
        carried: set[str] = set()
        for phases in chosen:
            to_phases = "ab" if centre else phases if per_phase else phases[0]
            carried |= set(to_phases)
            leg = complex(rng.uniform(0.005, 0.01), rng.uniform(0.005, 0.01))
            winding = 2 * low if centre else low * (3.0**0.5 if len(to_phases) == 2 else 1.0)
            self.units.append(
                InlineTransformer(
                    name=f"T{len(self.units)}",
                    from_bus=bus,
                    to_bus=far,
                    connection="centre-tap" if centre else "single",
                    rating_kva=float(rng.uniform(200, 500)),
                    kv_from=volts * (3.0**0.5 if len(phases) == 2 else 1.0),
                    kv_to=winding,
                    leakage_pu=complex(rng.uniform(0.002, 0.01), rng.uniform(0.01, 0.04)),
                    leg_leakage_pu=leg if centre else None,
                    magnetizing_pu=self.magnetizing(),
                    from_tap=float(rng.choice([1.0, 1.025])),
                    phases=phases,
                    to_phases=to_phases,
                )
            )
        self.volts[zone] = low
        self.seen(far, "".join(sorted(carried)), zone)

    def loop(self) -> None:
        """One more line between two buses of one zone, where there are any."""
        pairs = [
            (a, b)
            for a, b in combinations(self.phases, 2)
            if self.zone[a] == self.zone[b] and set(self.phases[a]) & set(self.phases[b])
        ]
        joined = {frozenset((s.from_bus, s.to_bus)) for s in self.switches}
        pairs = [pair for pair in pairs if frozenset(pair) not in joined]
        if pairs:
            self.line(*pairs[int(self.rng.integers(len(pairs)))])


def _rows(matrix: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(v) for v in row) for row in matrix)


def _assembled(grown: _Grown, loads: tuple[Load, ...], capacitors: tuple[Capacitor, ...]) -> Feeder:
    rng = np.random.default_rng(len(grown.lines))
    short = grown.kv**2 / 200.0
    neutral = NEUTRALS[int(rng.integers(len(NEUTRALS)))]
    return Feeder(
        name="mixed",
        source=Source(
            bus="S",
            kv_ll=grown.kv,
            emf_pu=1.02,
            z1_ohm=complex(0.1, 1.0) * short,
            z2_ohm=complex(0.1, 0.9) * short,
            z0_ohm=complex(0.2, float(rng.uniform(1.5, 3.0))) * short,
            frequency_hz=60.0,
            angle_deg=float(rng.choice([0.0, 30.0])),
            neutral=neutral,
            neutral_ohm=0j if neutral in ("solid", "isolated") else complex(2.0, 3.0),
        ),
        lines=tuple(grown.lines),
        transformers=(),
        loads=loads,
        switches=tuple(grown.switches),
        points=(),
        sections=(),
        capacitors=capacitors,
        regulators=tuple(grown.regulators),
        codes=tuple(grown.codes),
        inline_transformers=tuple(grown.units),
    )


def _equipment(
    rng: np.random.Generator, feeder: Feeder
) -> tuple[tuple[Load, ...], tuple[Capacitor, ...]]:
    """Loads on most buses, of every kind that the bus's phases allow; some capacitors."""
    volts, masks = bus_volts(feeder), bus_phases(feeder)
    loads: list[Load] = []
    banks: list[Capacitor] = []
    for bus, mask in masks.items():
        there = "".join(p for k, p in enumerate("abc") if mask >> k & 1)
        for _ in range(int(rng.integers(0, 3))):
            delta = len(there) > 1 and rng.random() < 0.4
            count = int(rng.integers(2 if delta else 1, len(there) + 1))
            phases = "".join(str(p) for p in rng.choice(list(there), size=count, replace=False))
            kv = volts[bus] / 1000.0 * (3.0**0.5 if delta else 1.0)
            kw = float(rng.uniform(10, 150)) * len(phases)
            place, name = Place(bus=bus), f"{len(loads) + len(banks)}"
            if rng.random() < 0.15:
                banks.append(
                    Capacitor(
                        name=f"C{name}",
                        place=place,
                        connection="delta" if delta else "wye",
                        kvar=kw * 0.5,
                        phases=phases,
                    )
                )
                continue
            loads.append(
                Load(
                    name=f"D{name}",
                    transformer=None,
                    place=place,
                    connection="delta" if delta else "wye",
                    kw=kw,
                    power_factor=float(rng.choice([1.0, 0.9, -0.95])),
                    exponent=2.0,
                    phases=phases,
                    branch_kv=kv if rng.random() < 0.5 else None,
                )
            )
    return tuple(loads), tuple(banks)
