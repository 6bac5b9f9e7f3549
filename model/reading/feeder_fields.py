"""Every field of a feeder file: kind, unit, range, default and meaning."""

from __future__ import annotations

from . import feeder_refused as refused
from .fields import Field
from .shunt_fields import CAPACITORS, DERS, LOADS, TRANSFORMERS

__all__ = ["CSV_TABLES", "DOCUMENT", "FORMAT", "ROWS", "TABLES"]

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
    Field(
        name="imported_from",
        kind="text",
        doc="What the file was made from; the values it gives then count as imported.",
    ),
    Field(name="tables", kind="table", default={}, doc="Tables that stand in CSV files."),
    Field(name="source", kind="table", required=True, doc="The utility source."),
    Field(name="lines", kind="tables", required=True, doc="Lines; their ends make the buses."),
    Field(name="transformers", kind="tables", default=(), doc="Distribution transformers."),
    Field(name="loads", kind="tables", default=(), doc="Loads."),
    Field(name="ders", kind="tables", default=(), doc="Distributed generation."),
    Field(name="capacitors", kind="tables", default=(), doc="Capacitor banks."),
    Field(name="regulators", kind="tables", default=(), doc="Voltage regulators."),
    Field(name="switches", kind="tables", default=(), doc="Switches; an open one is a tie."),
    Field(name="points", kind="tables", default=(), doc="Measuring points."),
    Field(name="sections", kind="tables", default=(), doc="Pairs of points that exchange phasors."),
)

CSV_TABLES = ("lines", "transformers", "loads", "ders", "capacitors", "switches", "points")
"""The tables that may stand in a CSV file: long ones, whose values fit into cells."""

SOURCE: tuple[Field, ...] = (
    Field(name="bus", kind="name", required=True, doc="The substation bus."),
    Field(
        name="kv_ll",
        kind="number",
        unit="kV",
        above=0.0,
        high=1000.0,
        required=True,
        doc="Nominal line-to-line voltage, to which every impedance is referred.",
    ),
    Field(
        name="emf_pu",
        kind="number",
        unit="pu",
        above=0.0,
        high=2.0,
        default=1.0,
        doc="EMF on `kv_ll`.",
    ),
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
        high=1000.0,
        default=60.0,
        doc="Nominal frequency.",
    ),
    Field(
        name="neutral",
        kind="text",
        choices=("solid", "resistor", "petersen", "isolated"),
        refused=refused.NEUTRALS,
        default="solid",
        doc="How the neutral is earthed.",
    ),
    Field(
        name="neutral_ohm",
        kind="impedance",
        unit="ohm",
        above=0.0,
        doc="Between neutral and earth, for `resistor` and `petersen` only.",
    ),
    Field(
        name="wires",
        kind="integer",
        low=3,
        high=4,
        default=4,
        doc="3: no neutral goes with the lines, and nothing may be connected to one.",
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
    Field(
        name="c1_nf_per_km",
        kind="number",
        unit="nF/km",
        low=0.0,
        default=0.0,
        doc="Positive-sequence charging.",
    ),
    Field(
        name="c0_nf_per_km",
        kind="number",
        unit="nF/km",
        low=0.0,
        default=0.0,
        doc="Zero-sequence charging, at most `c1_nf_per_km`.",
    ),
)

REGULATORS: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="The regulator's name."),
    Field(name="from", kind="name", required=True, doc="Bus whose voltage it steps."),
    Field(name="to", kind="name", required=True, doc="Bus that gets the stepped voltage."),
    Field(
        name="taps",
        kind="integers",
        count=3,
        default=(0, 0, 0),
        doc="Tap positions of phases a, b, c; `to` has 1 + tap x `step_pct` / 100 of `from`.",
    ),
    Field(
        name="step_pct",
        kind="number",
        unit="%",
        above=0.0,
        high=5.0,
        default=0.625,
        doc="Voltage of one tap.",
    ),
    Field(
        name="most_taps",
        kind="integer",
        low=1,
        high=100,
        default=16,
        doc="Farthest tap position, up and down.",
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
    Field(name="bus", kind="name", required=True, doc="The end of `line` that it stands at."),
    Field(name="line", kind="name", required=True, doc="The line whose current it measures there."),
    Field(
        name="voltage_side",
        kind="text",
        choices=("line", "bus"),
        default="line",
        doc="Side of its contacts where it measures V, which matters while they are open.",
    ),
)

SECTIONS: tuple[Field, ...] = (
    Field(name="local", kind="name", required=True, doc="A point."),
    Field(name="remote", kind="name", required=True, doc="Another point, with line between."),
)

ROWS: dict[str, tuple[Field, ...]] = {
    "lines": LINES,
    "transformers": TRANSFORMERS,
    "loads": LOADS,
    "ders": DERS,
    "capacitors": CAPACITORS,
    "regulators": REGULATORS,
    "switches": SWITCHES,
    "points": POINTS,
    "sections": SECTIONS,
}
"""The fields of each array of tables, in the order in which a file is written."""

TABLES: dict[str, tuple[Field, ...]] = {
    "tables": tuple(
        Field(name=table, kind="name", doc=f"CSV file that stands for `[[{table}]]`.")
        for table in CSV_TABLES
    ),
    "source": SOURCE,
    **ROWS,
}
"""The fields of each table of a file."""
