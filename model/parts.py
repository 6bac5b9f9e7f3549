"""What a feeder is made of: plain data, no behaviour beyond unit conversion.

Impedances are ohms referred to the feeder's nominal voltage, angles degrees,
powers watts. A place on the feeder is either a bus or a (line, fraction) pair,
the fraction counted from the line's from-end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = [
    "Connection",
    "Feeder",
    "Line",
    "Load",
    "LoadConnection",
    "Place",
    "Point",
    "Section",
    "Source",
    "Switch",
    "Transformer",
]

Connection = Literal["Yg/Yg", "D/Yg", "Yg/D"]
LoadConnection = Literal["wye", "delta"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A bus (``bus`` set), or a tee on a line (``line`` and ``at`` set)."""

    bus: str | None = None
    line: str | None = None
    at: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """Utility source: a balanced EMF behind sequence impedances.

    ``kv_ll`` is the nominal line-to-line voltage to which everything on the
    feeder is referred; the EMF is ``emf_pu`` of it, phase a at angle 0.
    """

    bus: str
    kv_ll: float
    emf_pu: float
    z1_ohm: complex
    z2_ohm: complex
    z0_ohm: complex
    frequency_hz: float

    @property
    def v_phase_v(self) -> float:
        """Nominal phase-to-earth voltage, volts."""
        return float(self.kv_ll * 1000.0 / 3.0**0.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A three-phase line, transposed: sequence impedances per km, no charging."""

    name: str
    from_bus: str
    to_bus: str
    length_km: float
    z1_ohm_per_km: complex
    z0_ohm_per_km: complex


@dataclass(frozen=True, slots=True, kw_only=True)
class Transformer:
    """A distribution transformer hanging on the feeder, HV side first in ``connection``.

    ``leakage_pu`` is the complex leakage on the unit's own rating, split in two
    equal halves, HV and LV. ``x0_pu`` is the zero-sequence magnetizing reactance
    (on the rating) between the halves of a Yg/Yg unit with a three-limb core; None: no such branch.
    """

    name: str
    place: Place
    connection: Connection
    rating_kva: float
    leakage_pu: complex
    x0_pu: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """A balanced three-phase load, behind a transformer or directly on the feeder.

    Behind a transformer with a Yg LV winding it is grounded wye; behind a D winding
    it is connected between the phases; ``connection`` speaks of direct loads only.
    P and Q vary as ``|V|**exponent``: 2 constant impedance, 1 current, 0 power.
    """

    name: str
    transformer: str | None
    place: Place | None
    connection: LoadConnection
    kw: float
    power_factor: float
    exponent: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Switch:
    """A three-phase switch without impedance between two buses, normally open or closed."""

    name: str
    from_bus: str
    to_bus: str
    closed: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """A measuring point: V at ``bus`` and I at that end of ``line``, three phases."""

    name: str
    bus: str
    line: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """Two adjacent measuring points that exchange phasors; each is a terminal."""

    local: str
    remote: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Feeder:
    """A checked feeder; build it with ``feeder_file.read_feeder`` or ``feeder.make_feeder``."""

    name: str
    source: Source
    lines: tuple[Line, ...]
    transformers: tuple[Transformer, ...]
    loads: tuple[Load, ...]
    switches: tuple[Switch, ...]
    points: tuple[Point, ...]
    sections: tuple[Section, ...]
