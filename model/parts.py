"""What a feeder is made of: plain data, no behaviour beyond unit conversion.

Impedances are ohms at the voltage where they stand, angles degrees, powers watts. A place
on the feeder is either a bus or a (line, fraction) pair, the fraction counted from the
line's from-end. ``phases`` is some of the letters a, b, c: the conductors that are there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

__all__ = [
    "Capacitor",
    "CapacitorConnection",
    "Connection",
    "Coordinates",
    "Der",
    "DerModel",
    "Feeder",
    "InlineConnection",
    "InlineTransformer",
    "Line",
    "LineCode",
    "Load",
    "LoadConnection",
    "Neutral",
    "Origin",
    "OriginKey",
    "Place",
    "Point",
    "Reference",
    "Regulator",
    "Section",
    "Shift",
    "Source",
    "Switch",
    "Transformer",
    "VoltageSide",
]

Connection = Literal["Yg/Yg", "D/Yg", "Yg/D", "Y/D", "D/D", "unknown"]
InlineConnection = Literal[
    "Yg/Yg", "Y/Yg", "Yg/Y", "Y/Y", "D/Yg", "D/Y", "Yg/D", "Y/D", "D/D", "single", "centre-tap"
]
Shift = Literal["lag", "lead"]
Reference = Literal["earth", "a", "b", "c", "next"]
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

    ``kv_ll`` is the nominal line-to-line voltage of its bus, and of every bus that no in-line
    transformer parts from it; the EMF is ``emf_pu`` of it, phase a at ``angle_deg``.
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
    angle_deg: float = 0.0

    @property
    def v_phase_v(self) -> float:
        """Nominal phase-to-earth voltage, volts."""
        return float(self.kv_ll * 1000.0 / 3.0**0.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class LineCode:
    """A way to build lines of 1, 2 or 3 conductors: symmetric matrices per km, neutral reduced.

    Conductor i of it is the phase that stands i-th in the ``phases`` of a line.
    """

    name: str
    r_ohm_per_km: tuple[tuple[float, ...], ...]
    x_ohm_per_km: tuple[tuple[float, ...], ...]
    c_nf_per_km: tuple[tuple[float, ...], ...] | None = None  #: None: no charging


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A line: of a ``code``, or transposed with sequence values per km, in phases it has.

    One that has fewer than three phases and no code takes those rows and columns of the
    transposed line's matrices.
    """

    name: str
    from_bus: str
    to_bus: str
    length_km: float
    z1_ohm_per_km: complex | None = None
    z0_ohm_per_km: complex | None = None
    c1_nf_per_km: float = 0.0
    c0_nf_per_km: float = 0.0
    phases: str = "abc"
    code: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class InlineTransformer:
    """A transformer between two buses, with whatever network lies behind it.

    Three-phase: ``connection`` names the windings, from-side first; voltages are line to line.
    D/Y and Y/D make the to-side ``shift`` by 30 degrees. ``single``: one winding on either
    side, over ``phases`` at ``from_bus`` and ``to_phases`` at ``to_bus``: one letter is from
    that phase to earth, two are between two phases; voltages are those of the windings.
    ``centre-tap``: two legs to earth on ``to_phases``, ``kv_to`` from leg to leg; ``leakage_pu`` is
    then the star branch of the from-winding, ``leg_leakage_pu`` that of either leg.
    Several rows between the same two buses are one bank. Everything per unit is on the rating.
    """

    name: str
    from_bus: str
    to_bus: str
    connection: InlineConnection
    rating_kva: float  #: of all phases together
    kv_from: float
    kv_to: float
    leakage_pu: complex
    leg_leakage_pu: complex | None = None
    magnetizing_pu: complex = 0j  #: admittance G - jB across the to-windings
    from_tap: float = 1.0  #: turns over rated turns
    to_tap: float = 1.0
    phases: str = "abc"
    to_phases: str = "abc"
    shift: Shift = "lag"
    from_neutral_ohm: complex = 0j  #: between the neutral of a Yg winding and earth
    to_neutral_ohm: complex = 0j


@dataclass(frozen=True, slots=True, kw_only=True)
class Transformer:
    """A distribution transformer hanging on the feeder, HV side first in ``connection``.

    ``leakage_pu`` is the complex leakage on the unit's own rating, split in two
    equal halves, HV and LV. ``x0_pu`` is the zero-sequence magnetizing reactance
    (on the rating) between the halves of a Yg/Yg unit with a three-limb core; None: no such branch.
    ``xm_pu`` is the magnetizing reactance there, of every sequence and connection; None: infinite.
    An unknown connection is drawn by a study; without one it counts as the commonest for the
    wires at its place (``network.assumed_connection``).
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
    """A load, behind a transformer that hangs on the feeder, or directly on it.

    Behind a transformer with a Yg LV winding it is grounded wye, behind a D winding it is
    connected between the phases, and always balanced; ``connection`` and ``phases`` speak of
    direct loads. Those have equal branches: wye, one from each of ``phases`` to earth; delta,
    one between two phases, or three around. ``kw`` is that of all branches, at ``branch_kv``
    across each (None: the bus's nominal voltage).
    P and Q vary as ``|V|**exponent``: 2 constant impedance, 1 current, 0 power; Q as
    ``exponent_q`` where given; ``zip`` replaces both by shares of constant impedance, current
    and power, P's then Q's. That holds from ``v_min_pu`` to ``v_max_pu``. Beyond, a branch is
    a constant impedance, that at the limit: by its own law, or by ``edge_exponent`` there. Down
    to ``v_low_pu``, if given, its current goes linearly with the voltage to that of the nominal
    impedance, which it is from there on.
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
    phases: str = "abc"
    branch_kv: float | None = None
    kvar: float | None = None  #: takes the place of ``power_factor``
    exponent_q: float | None = None
    zip: tuple[float, float, float, float, float, float] | None = None
    v_min_pu: float = 0.7
    v_max_pu: float | None = None
    v_low_pu: float | None = None
    edge_exponent: float | None = None


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
    """A capacitor bank directly on the feeder, grounded wye or delta, with a load's branches."""

    name: str
    place: Place
    connection: CapacitorConnection
    kvar: float
    phases: str = "abc"
    branch_kv: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Regulator:
    """Single-phase autotransformers between two buses, one for each of ``phases``.

    Each adds ``tap * step_pct / 100`` of the voltage at ``from_bus`` between its phase and its
    ``reference``: earth (wye), one phase for the other two (open delta), or the phase that
    follows (closed delta). ``z_ohm`` lies before each on the from-side, ``jumper_ohm`` in the
    phase that others refer to.
    """

    name: str
    from_bus: str
    to_bus: str
    taps: tuple[int, int, int]  #: of phases a, b, c, 0 where there is none
    step_pct: float
    most_taps: int
    phases: str = "abc"
    reference: Reference = "earth"
    z_ohm: complex = 0j
    jumper_ohm: complex = 0j
    gang: bool = False  #: all phases step together


@dataclass(frozen=True, slots=True, kw_only=True)
class Switch:
    """A switch, recloser or fuse without impedance between two buses, normally open or closed."""

    name: str
    from_bus: str
    to_bus: str
    closed: bool
    phases: str = "abc"


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
class Coordinates:
    """Where a bus is drawn, in any unit."""

    bus: str
    x: float
    y: float


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
    codes: tuple[LineCode, ...] = ()
    inline_transformers: tuple[InlineTransformer, ...] = ()
    coordinates: tuple[Coordinates, ...] = ()
    imported_from: str | None = field(default=None, compare=False)
    origins: Mapping[OriginKey, Origin] = field(default_factory=dict, compare=False, repr=False)
