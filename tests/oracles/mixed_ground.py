"""The ground that random mixed feeders grow on: buses with their phases, zones of one voltage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import TypeVar

import numpy as np

from openphase.model.parts import (
    InlineTransformer,
    Line,
    LineCode,
    Neutral,
    Place,
    Regulator,
    Source,
    Switch,
)

__all__ = ["ROOT", "Bus", "Ground", "Zone", "chosen", "new_ground", "place_on", "polar", "some_of"]

ROOT = float(np.sqrt(3.0))
T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Zone:
    """What one winding feeds. ``va`` is a base of three phases; loads are small shares of it."""

    volts: float  #: phase to earth
    va: float
    earthed: bool  #: things may be connected to earth
    solid: bool = True  #: and they are not the only ones that are
    legs: bool = False  #: behind a centre tap: its phases are opposite
    like: tuple[object, ...] = ()  #: zones that are alike have the same voltages

    @property
    def ohm(self) -> float:
        """Base impedance."""
        return 3.0 * self.volts**2 / self.va


@dataclass(frozen=True, slots=True, kw_only=True)
class Bus:
    """A bus that has grown."""

    name: str
    phases: str
    zone: Zone


@dataclass(slots=True, kw_only=True)
class Ground:
    """What has grown so far."""

    rng: np.random.Generator
    source: Source
    buses: list[Bus]
    lines: list[Line] = field(default_factory=list)
    codes: list[LineCode] = field(default_factory=list)
    switches: list[Switch] = field(default_factory=list)
    regulators: list[Regulator] = field(default_factory=list)
    inlines: list[InlineTransformer] = field(default_factory=list)
    code_zones: dict[str, Zone] = field(default_factory=dict)
    zone_of: dict[str, Zone] = field(default_factory=dict)  #: by line
    numbers: count[int] = field(default_factory=count)

    def bus(self, phases: str, zone: Zone) -> Bus:
        """A new bus."""
        new = Bus(name=f"B{len(self.buses)}", phases="".join(sorted(phases)), zone=zone)
        self.buses.append(new)
        return new

    def name(self, prefix: str) -> str:
        """A name that nothing has."""
        return f"{prefix}{next(self.numbers)}"

    @property
    def omega(self) -> float:
        return float(2.0 * np.pi * self.source.frequency_hz)


def polar(magnitude: float, degrees: float) -> complex:
    return complex(magnitude * np.exp(1j * np.radians(degrees)))


def chosen(rng: np.random.Generator, of: Sequence[T]) -> T:
    """One of a list."""
    return of[int(rng.integers(len(of)))]


def some_of(rng: np.random.Generator, phases: str, size: int) -> str:
    """``size`` of the phases, in order."""
    picked = rng.permutation(len(phases))[:size]
    return "".join(sorted(phases[k] for k in picked))


def place_on(rng: np.random.Generator, ground: Ground) -> tuple[Place, str, Zone]:
    """A bus, or a tee on a line: the phases and the zone there."""
    if ground.lines and rng.random() < 0.45:
        line = chosen(rng, ground.lines)
        at = float(rng.uniform(0.03, 0.97))
        return Place(line=line.name, at=at), "".join(sorted(line.phases)), ground.zone_of[line.name]
    bus = chosen(rng, ground.buses)
    return Place(bus=bus.name), bus.phases, bus.zone


def new_ground(rng: np.random.Generator) -> Ground:
    """A source bus, on three wires or four."""
    kv = float(rng.choice([4.16, 12.0, 22.0]))
    wires = 3 if rng.random() < 0.3 else 4
    kinds: list[Neutral] = ["solid", "resistor", "isolated"]
    neutral = kinds[int(rng.choice(3, p=[0.65, 0.2, 0.15]))]
    zone = Zone(
        volts=kv * 1000.0 / ROOT,
        va=float(rng.uniform(2e6, 8e6)) * kv / 12.0,
        earthed=wires == 4 and neutral != "isolated",
        like=("source",),
    )
    z1 = polar(zone.ohm * float(rng.uniform(0.01, 0.05)), float(rng.uniform(75, 85)))
    source = Source(
        bus="B0",
        kv_ll=kv,
        emf_pu=float(rng.uniform(0.98, 1.05)),
        z1_ohm=z1,
        z2_ohm=z1 * polar(float(rng.uniform(0.7, 1.3)), float(rng.uniform(-5, 4))),
        z0_ohm=z1 * polar(float(rng.uniform(0.4, 3.0)), float(rng.uniform(-10, 4))),
        frequency_hz=float(rng.choice([50.0, 60.0])),
        neutral=neutral,
        neutral_ohm=complex(rng.uniform(0.02, 0.5) * zone.ohm) if neutral == "resistor" else 0j,
        wires=wires,
        angle_deg=float(rng.choice([0.0, 30.0, rng.uniform(-180, 180)])),
    )
    return Ground(rng=rng, source=source, buses=[Bus(name="B0", phases="abc", zone=zone)])
