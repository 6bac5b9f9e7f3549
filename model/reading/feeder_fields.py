"""Every field of a feeder file: kind, unit, range, default and meaning."""

from __future__ import annotations

from . import feeder_refused as refused
from .fields import Field
from .series_fields import CODES, INLINE_TRANSFORMERS, LINES, REGULATORS, SWITCHES
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
    Field(name="codes", kind="tables", default=(), doc="Line codes: matrices per km."),
    Field(name="lines", kind="tables", required=True, doc="Lines; their ends make the buses."),
    Field(
        name="inline_transformers",
        kind="tables",
        default=(),
        doc="Transformers between two buses, with whatever network lies behind them.",
    ),
    Field(name="transformers", kind="tables", default=(), doc="Distribution transformers."),
    Field(name="loads", kind="tables", default=(), doc="Loads."),
    Field(name="ders", kind="tables", default=(), doc="Distributed generation."),
    Field(name="capacitors", kind="tables", default=(), doc="Capacitor banks."),
    Field(name="regulators", kind="tables", default=(), doc="Voltage regulators."),
    Field(name="switches", kind="tables", default=(), doc="Switches; an open one is a tie."),
    Field(name="points", kind="tables", default=(), doc="Measuring points."),
    Field(name="sections", kind="tables", default=(), doc="Pairs of points that exchange phasors."),
    Field(name="coordinates", kind="tables", default=(), doc="Where buses are drawn."),
)

CSV_TABLES = (
    "lines",
    "inline_transformers",
    "transformers",
    "loads",
    "ders",
    "capacitors",
    "switches",
    "points",
    "coordinates",
)
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
        doc="Nominal line-to-line voltage, of every bus that no in-line transformer parts from it.",
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
        name="angle_deg",
        kind="number",
        unit="deg",
        low=-360.0,
        high=360.0,
        default=0.0,
        doc="Angle of phase a of the EMF.",
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

COORDINATES: tuple[Field, ...] = (
    Field(name="bus", kind="name", required=True, doc="A bus of the feeder, once."),
    Field(name="x", kind="number", required=True, doc="To the right, in any unit."),
    Field(name="y", kind="number", required=True, doc="Upwards, in the same."),
)

ROWS: dict[str, tuple[Field, ...]] = {
    "codes": CODES,
    "lines": LINES,
    "inline_transformers": INLINE_TRANSFORMERS,
    "transformers": TRANSFORMERS,
    "loads": LOADS,
    "ders": DERS,
    "capacitors": CAPACITORS,
    "regulators": REGULATORS,
    "switches": SWITCHES,
    "points": POINTS,
    "sections": SECTIONS,
    "coordinates": COORDINATES,
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
