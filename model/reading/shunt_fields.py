"""The fields of what hangs on a feeder: transformers, loads, DER and capacitors."""

from __future__ import annotations

from dataclasses import replace

from . import feeder_refused as refused
from .fields import Field
from .series_fields import PHASES

__all__ = ["CAPACITORS", "DERS", "LOADS", "TRANSFORMERS"]

_BUS = Field(name="bus", kind="name", doc="The bus it stands at; or give `line` and `at`.")
_LINE = Field(name="line", kind="name", doc="The line it leaves at a tee.")
_AT = Field(
    name="at", kind="number", low=0.0, high=1.0, doc="The tee's fraction of `line` from its `from`."
)

_TRANSFORMER = Field(
    name="transformer",
    kind="name",
    doc="The transformer it hangs on; or give a place, `bus` or `line` and `at`.",
)
_POWER_FACTOR = Field(
    name="power_factor",
    kind="number",
    low=-1.0,
    high=1.0,
    not_zero=True,
    default=1.0,
    doc="Power factor, negative for leading.",
)

_BRANCHES = replace(
    PHASES,
    doc="Of a wye: one branch from each to earth; of a delta: one between two, three around three.",
)
_BRANCH_KV = Field(
    name="branch_kv",
    kind="number",
    unit="kV",
    above=0.0,
    high=1000.0,
    absent="nominal",
    doc="At which each branch takes its power: by default the bus's, between phases for a delta.",
)

TRANSFORMERS: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="Name that its loads refer to."),
    _BUS,
    _LINE,
    _AT,
    Field(
        name="connection",
        kind="text",
        choices=("Yg/Yg", "D/Yg", "Yg/D", "Y/D", "D/D", "unknown"),
        respell=(("\N{GREEK CAPITAL LETTER DELTA}", "D"), ("\N{INCREMENT}", "D")),
        refused=refused.CONNECTIONS,
        required=True,
        doc="Windings, feeder side first; `Δ` may be written for `D`.",
    ),
    Field(name="rating_kva", kind="number", unit="kVA", above=0.0, required=True, doc="Rating."),
    Field(
        name="leakage_pu",
        kind="impedance",
        unit="pu",
        high=1.0,
        required=True,
        doc="Leakage on the rating, both halves together; 0 for `Yg/Yg` and `D/Yg` only.",
    ),
    Field(
        name="x0_pu",
        kind="number",
        unit="pu",
        above=0.0,
        absent="none",
        doc="Zero-sequence magnetizing reactance of a three-limb core, for `Yg/Yg` or `unknown`.",
    ),
    Field(
        name="xm_pu",
        kind="number",
        unit="pu",
        above=0.0,
        absent="infinite",
        doc="Magnetizing reactance on the rating, of every sequence.",
    ),
)

LOADS: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="The load's name."),
    _TRANSFORMER,
    _BUS,
    _LINE,
    _AT,
    Field(
        name="connection",
        kind="text",
        choices=("wye", "delta"),
        refused=refused.LOAD_CONNECTIONS,
        default="wye",
        doc="Of a load with a place; behind a transformer its winding decides.",
    ),
    _BRANCHES,
    _BRANCH_KV,
    Field(
        name="kw",
        kind="number",
        unit="kW",
        low=0.0,
        required=True,
        doc="Active power of all branches at nominal voltage.",
    ),
    _POWER_FACTOR,
    Field(
        name="kvar",
        kind="number",
        unit="kvar",
        doc="Reactive power of all branches, in place of `power_factor`.",
    ),
    Field(
        name="exponent",
        kind="number",
        low=0.0,
        high=10.0,
        default=2.0,
        doc="P and Q go with voltage to this power: 2 impedance, 1 current, 0 power.",
    ),
    Field(
        name="exponent_q",
        kind="number",
        low=0.0,
        high=10.0,
        doc="That of Q, where it is another than that of P.",
    ),
    Field(
        name="zip",
        kind="numbers",
        count=6,
        doc="In place of both, shares of impedance, current and power: of P, then of Q.",
    ),
    Field(
        name="v_min_pu",
        kind="number",
        unit="pu",
        above=0.0,
        high=2.0,
        default=0.7,
        doc="Below it each branch is a constant impedance, that at the limit.",
    ),
    Field(
        name="v_max_pu",
        kind="number",
        unit="pu",
        above=0.0,
        high=10.0,
        absent="none",
        doc="Above it the same.",
    ),
    Field(
        name="v_low_pu",
        kind="number",
        unit="pu",
        above=0.0,
        high=2.0,
        doc="Down to it the current goes linearly from the limit to the nominal impedance's.",
    ),
    Field(
        name="edge_exponent",
        kind="number",
        low=0.0,
        high=10.0,
        doc="At both limits the load is what this exponent makes it, and not its own law.",
    ),
    Field(
        name="motor_share",
        kind="number",
        low=0.0,
        high=1.0,
        default=0.0,
        doc="Share of it that motors take.",
    ),
    Field(
        name="motor_y2_y1",
        kind="number",
        above=0.0,
        default=6.0,
        doc="Negative-sequence admittance of these motors over their nominal positive one.",
    ),
)

DERS: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="The unit's name."),
    _TRANSFORMER,
    _BUS,
    _LINE,
    _AT,
    Field(
        name="kw",
        kind="number",
        unit="kW",
        low=0.0,
        required=True,
        doc="Three-phase active power it delivers before the event.",
    ),
    replace(_POWER_FACTOR, doc="Power factor, negative where it takes reactive power."),
    Field(
        name="model",
        kind="text",
        choices=("thevenin", "constant_current", "constant_power", "generator"),
        refused=refused.DER_MODELS,
        required=True,
        doc="What the event leaves as it was: the EMF, the current, the power, the EMF.",
    ),
    Field(
        name="z1_ohm",
        kind="impedance",
        unit="ohm",
        above=0.0,
        doc="Behind it the EMF stays; for `thevenin` and `generator` only, which need it.",
    ),
    Field(
        name="z2_ohm",
        kind="impedance",
        unit="ohm",
        above=0.0,
        absent="no path",
        doc="Impedance to the negative sequence; a `generator` needs it.",
    ),
    Field(
        name="z0_ohm",
        kind="impedance",
        unit="ohm",
        above=0.0,
        absent="no path",
        doc="Impedance to the zero sequence.",
    ),
)

CAPACITORS: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="The bank's name."),
    _BUS,
    _LINE,
    _AT,
    Field(
        name="connection",
        kind="text",
        choices=("wye", "delta"),
        refused=refused.LOAD_CONNECTIONS,
        default="wye",
        doc="Grounded wye, or delta.",
    ),
    _BRANCHES,
    _BRANCH_KV,
    Field(
        name="kvar",
        kind="number",
        unit="kvar",
        above=0.0,
        required=True,
        doc="Reactive power of all branches at nominal voltage.",
    ),
)
