"""What a feeder is made of: plain data, no behaviour beyond unit conversion.

Impedances are ohms referred to the feeder's nominal voltage, angles degrees,
powers watts. A place on the feeder is either a bus or a (line, fraction) pair,
the fraction counted from the line's from-end.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

__all__ = [
    "Capacitor",
    "CapacitorConnection",
    "Connection",
    "Der",
    "DerModel",
    "Feeder",
    "Line",
    "Load",
    "LoadConnection",
    "Neutral",
    "Origin",
    "OriginKey",
    "Place",
    "Point",
    "Regulator",
    "Section",
    "Source",
    "Switch",
    "Transformer",
    "VoltageSide",
]

Connection = Literal["Yg/Yg", "D/Yg", "Yg/D", "Y/D", "D/D", "unknown"]
LoadConnection = Literal["wye", "delta"]
CapacitorConnection = Literal["wye", "delta"]
DerModel = Literal["thevenin", "constant_current", "constant_power", "generator"]
VoltageSide = Literal["line", "bus"]
Neutral = Literal["solid", "resistor", "petersen", "isolated"]

Origin = Literal["given", "imported", "default", "unknown"]
"""Where a value comes from: the file, another file it was made from, a default, or nowhere."""

OriginKey = tuple[str, str | int, str]
"""Table, the row's name (its index where rows have none), field: ``("loads", "L1", "kw")``."""


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
    ``neutral_ohm`` stands between its neutral and earth: 0 where that is solid, a
    resistance, or the reactance of a Petersen coil; isolated, there is no connection at all.
    ``wires`` is 3 where no neutral goes with the lines: nothing may be connected to it then.
    """

    bus: str
    kv_ll: float
    emf_pu: float
    z1_ohm: complex
    z2_ohm: complex
    z0_ohm: complex
    frequency_hz: float
    neutral: Neutral = "solid"
    neutral_ohm: complex = 0j
    wires: int = 4

    @property
    def v_phase_v(self) -> float:
        """Nominal phase-to-earth voltage, volts."""
        return float(self.kv_ll * 1000.0 / 3.0**0.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A three-phase line, transposed: sequence impedances and charging capacitances per km."""

    name: str
    from_bus: str
    to_bus: str
    length_km: float
    z1_ohm_per_km: complex
    z0_ohm_per_km: complex
    c1_nf_per_km: float = 0.0
    c0_nf_per_km: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Transformer:
    """A distribution transformer hanging on the feeder, HV side first in ``connection``.

    ``leakage_pu`` is the complex leakage on the unit's own rating, split in two
    equal halves, HV and LV. ``x0_pu`` is the zero-sequence magnetizing reactance
    (on the rating) between the halves of a Yg/Yg unit with a three-limb core; None: no such branch.
    ``xm_pu`` is the magnetizing reactance there, of every sequence and connection; None: infinite.
    An unknown connection is drawn by a study; without one it counts as the commonest for the
    feeder's wires (``network.assumed_connection``).
    """

    name: str
    place: Place
    connection: Connection
    rating_kva: float
    leakage_pu: complex
    x0_pu: float | None
    xm_pu: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """A balanced three-phase load, behind a transformer or directly on the feeder.

    Behind a transformer with a Yg LV winding it is grounded wye; behind a D winding
    it is connected between the phases; ``connection`` speaks of direct loads only.
    P and Q vary as ``|V|**exponent``: 2 constant impedance, 1 current, 0 power.
    ``motor_share`` of it are motors: they take it in the positive sequence, are
    ``motor_y2_y1`` times as large an admittance to the negative, and have no neutral.
    """

    name: str
    transformer: str | None
    place: Place | None
    connection: LoadConnection
    kw: float
    power_factor: float
    exponent: float
    motor_share: float = 0.0
    motor_y2_y1: float = 6.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Der:
    """Distributed generation behind a transformer or directly on the feeder, balanced.

    It delivers ``kw`` at ``power_factor`` in the positive sequence before the event. After
    it ``model`` says what stays as it was: the EMF behind ``z1_ohm`` ("thevenin"; "generator"
    for a rotating machine, whose ``z2_ohm`` is another), the current, or the power. Impedances
    are referred to the feeder's voltage; None: no path for that sequence.
    """

    name: str
    transformer: str | None
    place: Place | None
    kw: float
    power_factor: float
    model: DerModel
    z1_ohm: complex | None
    z2_ohm: complex | None
    z0_ohm: complex | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Capacitor:
    """A three-phase capacitor bank directly on the feeder: grounded wye, or delta."""

    name: str
    place: Place
    connection: CapacitorConnection
    kvar: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Regulator:
    """Three single-phase autotransformers in grounded wye between two buses, without impedance.

    The voltage at ``to_bus`` is ``1 + tap * step_pct / 100`` times that at ``from_bus``,
    phase by phase.
    """

    name: str
    from_bus: str
    to_bus: str
    taps: tuple[int, int, int]
    step_pct: float
    most_taps: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Switch:
    """A three-phase switch without impedance between two buses, normally open or closed."""

    name: str
    from_bus: str
    to_bus: str
    closed: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """A measuring point: a recloser between ``bus`` and that end of ``line``.

    It measures the current into ``line``, and the voltage on one side of its contacts, which
    matters while they are open.
    """

    name: str
    bus: str
    line: str
    voltage_side: VoltageSide = "line"


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """Two adjacent measuring points that exchange phasors; each is a terminal."""

    local: str
    remote: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Feeder:
    """A checked feeder; build it with ``feeder_file.read_feeder`` or ``feeder.make_feeder``.

    ``origins`` tells where each value comes from, and ``imported_from`` the file it was made
    from, if any; feeders that differ in these alone are equal.
    """

    name: str
    source: Source
    lines: tuple[Line, ...]
    transformers: tuple[Transformer, ...]
    loads: tuple[Load, ...]
    switches: tuple[Switch, ...]
    points: tuple[Point, ...]
    sections: tuple[Section, ...]
    ders: tuple[Der, ...] = ()
    capacitors: tuple[Capacitor, ...] = ()
    regulators: tuple[Regulator, ...] = ()
    imported_from: str | None = field(default=None, compare=False)
    origins: Mapping[OriginKey, Origin] = field(default_factory=dict, compare=False, repr=False)
