"""Every field of a feeder file: kind, unit, range, default and meaning."""

from __future__ import annotations

from .fields import Field

__all__ = ["DOCUMENT", "FORMAT", "TABLES"]

FORMAT = 1
"""Version of the file format, the only one there is."""

DOCUMENT: tuple[Field, ...] = (
    Field(
        name="format",
        kind="integer",
        low=FORMAT,
        high=FORMAT,
        required=True,
        doc="Version of this format.",
    ),
    Field(name="name", kind="name", required=True, doc="The feeder's name, without `/` or `\\`."),
    Field(name="source", kind="table", required=True, doc="The utility source."),
    Field(name="lines", kind="tables", required=True, doc="Lines; with switches they make buses."),
    Field(name="transformers", kind="tables", default=(), doc="Distribution transformers."),
    Field(name="loads", kind="tables", default=(), doc="Loads."),
    Field(name="switches", kind="tables", default=(), doc="Switches; an open one is a tie."),
    Field(name="points", kind="tables", default=(), doc="Measuring points."),
    Field(name="sections", kind="tables", default=(), doc="Pairs of points that exchange phasors."),
)

_BUS = Field(name="bus", kind="name", doc="The bus it stands at; or give `line` and `at`.")
_LINE = Field(name="line", kind="name", doc="The line it leaves at a tee.")
_AT = Field(
    name="at", kind="number", low=0.0, high=1.0, doc="The tee's fraction of `line` from its `from`."
)

SOURCE: tuple[Field, ...] = (
    Field(name="bus", kind="name", required=True, doc="The substation bus."),
    Field(
        name="kv_ll",
        kind="number",
        unit="kV",
        above=0.0,
        required=True,
        doc="Nominal line-to-line voltage, to which every impedance is referred.",
    ),
    Field(name="emf_pu", kind="number", unit="pu", above=0.0, default=1.0, doc="EMF on `kv_ll`."),
    Field(
        name="z1_ohm",
        kind="impedance",
        unit="ohm",
        required=True,
        doc="Positive-sequence impedance behind the bus; 0 is allowed.",
    ),
    Field(
        name="z2_ohm",
        kind="impedance",
        unit="ohm",
        same_as="z1_ohm",
        doc="Negative-sequence impedance.",
    ),
    Field(
        name="z0_ohm",
        kind="impedance",
        unit="ohm",
        same_as="z1_ohm",
        doc="Zero-sequence impedance.",
    ),
    Field(
        name="frequency_hz",
        kind="number",
        unit="Hz",
        above=0.0,
        default=60.0,
        doc="Nominal frequency.",
    ),
)

LINES: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="Not ending in `.p` or `.q`."),
    Field(name="from", kind="name", required=True, doc="Bus that fractions are counted from."),
    Field(name="to", kind="name", required=True, doc="Bus at the other end."),
    Field(
        name="length_km", kind="number", unit="km", above=0.0, required=True, doc="Route length."
    ),
    Field(
        name="z1_ohm_per_km",
        kind="impedance",
        unit="ohm/km",
        above=0.0,
        required=True,
        doc="Positive-sequence series impedance.",
    ),
    Field(
        name="z0_ohm_per_km",
        kind="impedance",
        unit="ohm/km",
        above=0.0,
        required=True,
        doc="Zero-sequence series impedance.",
    ),
)

TRANSFORMERS: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="Name that its loads refer to."),
    _BUS,
    _LINE,
    _AT,
    Field(
        name="connection",
        kind="text",
        choices=("Yg/Yg", "D/Yg", "Yg/D"),
        respell=(("\N{GREEK CAPITAL LETTER DELTA}", "D"), ("\N{INCREMENT}", "D")),
        required=True,
        doc="Windings, feeder side first; `Δ` may be written for `D`.",
    ),
    Field(name="rating_kva", kind="number", unit="kVA", above=0.0, required=True, doc="Rating."),
    Field(
        name="leakage_pu",
        kind="impedance",
        unit="pu",
        required=True,
        doc="Leakage on the rating, both halves together; not 0 for `Yg/D`.",
    ),
    Field(
        name="x0_pu",
        kind="number",
        unit="pu",
        above=0.0,
        doc="Zero-sequence magnetizing reactance of a three-limb core, for `Yg/Yg` only.",
    ),
)

LOADS: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="The load's name."),
    Field(
        name="transformer",
        kind="name",
        doc="The transformer it hangs on; or give a place, `bus` or `line` and `at`.",
    ),
    _BUS,
    _LINE,
    _AT,
    Field(
        name="connection",
        kind="text",
        choices=("wye", "delta"),
        default="wye",
        doc="Of a load with a place; behind a transformer its winding decides.",
    ),
    Field(
        name="kw",
        kind="number",
        unit="kW",
        low=0.0,
        required=True,
        doc="Three-phase active power at nominal voltage.",
    ),
    Field(
        name="power_factor",
        kind="number",
        low=-1.0,
        high=1.0,
        not_zero=True,
        default=1.0,
        doc="Power factor, negative for leading.",
    ),
    Field(
        name="exponent",
        kind="number",
        low=0.0,
        high=2.0,
        default=2.0,
        doc="P and Q go with voltage to this power: 2 impedance, 1 current, 0 power.",
    ),
)

SWITCHES: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="The switch's name."),
    Field(name="from", kind="name", required=True, doc="Bus on one side."),
    Field(name="to", kind="name", required=True, doc="Bus on the other side."),
    Field(name="closed", kind="flag", default=False, doc="Its normal state."),
)

POINTS: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="The point's name."),
    Field(name="bus", kind="name", required=True, doc="Where it measures V: an end of `line`."),
    Field(name="line", kind="name", required=True, doc="Where it measures I, at that end."),
)

SECTIONS: tuple[Field, ...] = (
    Field(name="local", kind="name", required=True, doc="A point."),
    Field(name="remote", kind="name", required=True, doc="Another point, with line between."),
)

TABLES: dict[str, tuple[Field, ...]] = {
    "source": SOURCE,
    "lines": LINES,
    "transformers": TRANSFORMERS,
    "loads": LOADS,
    "switches": SWITCHES,
    "points": POINTS,
    "sections": SECTIONS,
}
"""The fields of each table, in the order in which a file is written."""
