"""Every field of a study file: kind, unit, range and meaning.

The defaults are taken from the dataclasses, so that a study made in a program and one
read from an empty file cannot differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ...model.reading.fields import Field
from .correlations import SCALARS
from .event_fields import EVENT_TABLES, EVENTS, STATES
from .judging_fields import JUDGING_TABLES, STEPS
from .parts import Study
from .values import as_table

__all__ = [
    "CORRELATIONS",
    "DOCUMENT",
    "EVENTS",
    "FORMAT",
    "GROUPS",
    "MEASURED",
    "STATES",
    "STEPS",
    "TABLES",
    "part_of",
]

FORMAT = 1
"""Version of the file format, the only one there is."""

_CONNECTIONS = ("Yg/Yg", "D/Yg", "Yg/D", "Y/D", "D/D")
_DELTAS = (("\N{GREEK CAPITAL LETTER DELTA}", "D"), ("\N{INCREMENT}", "D"))
_DER_MODELS = ("thevenin", "generator", "constant_current", "constant_power")


def part_of(study: Study, table: str) -> Any:
    """Return the part of a study that a table of its file describes.

    Examples
    --------
    >>> part_of(Study(), "events.open_phase")
    OpenPhaseDraw(two_phase_share=0.2)
    """
    part: Any = study
    for name in table.split("."):
        part = getattr(part, name)
    return part


def _optional(name: str, doc: str) -> Field:
    return Field(name=name, kind="table", default={}, doc=doc)


DOCUMENT: tuple[Field, ...] = (
    Field(
        name="format",
        kind="integer",
        low=FORMAT,
        high=FORMAT,
        required=True,
        doc="Version of this format.",
    ),
    _optional("loads", "How much the loads take."),
    Field(name="measured", kind="tables", default=[], doc="How much where it was measured."),
    _optional("motors", "How much of it motors take."),
    _optional("transformers", "How the transformers are connected."),
    _optional("ders", "What DER deliver."),
    _optional("ambient", "What changes between the two frames besides the event."),
    Field(name="correlations", kind="tables", default=[], doc="What goes together."),
    _optional("network", "Which switches are closed."),
    Field(name="groups", kind="tables", default=[], doc="States with settings of their own."),
    _optional("events", "The events, a table each."),
    _optional("instruments", "Errors of the measurement."),
    _optional("device", "The settings that the relay can hold."),
    _optional("detector", "Options of the detector."),
    _optional("reference", "Settings to compare with."),
    _optional("certificate", "What is demanded of the settings."),
)

CORRELATIONS: tuple[Field, ...] = (
    Field(
        name="between",
        kind="names",
        choices=SCALARS,
        required=True,
        doc="The two quantities, as `table.key`.",
    ),
    Field(
        name="rank",
        kind="number",
        low=-1.0,
        high=1.0,
        required=True,
        doc="Their rank correlation (Spearman).",
    ),
)

MEASURED: tuple[Field, ...] = (
    Field(
        name="point",
        kind="name",
        required=True,
        doc="Measuring point, or the source's bus; its loads are those beyond it that no further"
        " measured one sees.",
    ),
    Field(
        name="level",
        kind="distribution",
        low=0.0,
        high=100.0,
        required=True,
        doc="Factor on these loads together, in place of `level` of `[loads]`.",
    ),
)

GROUPS: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="Name of the setting group."),
    *STATES,
)

_STATE_TABLES: dict[str, tuple[Field, ...]] = {
    "loads": (
        Field(
            name="level",
            kind="distribution",
            low=0.0,
            high=100.0,
            doc="Factor on all loads together.",
        ),
        Field(
            name="each",
            kind="distribution",
            low=0.0,
            high=100.0,
            doc="Further factor on each load.",
        ),
        Field(
            name="exponent",
            kind="distribution",
            low=0.0,
            high=2.0,
            doc='Voltage exponent common to all loads; `"file"`: each by its own law there.',
        ),
        Field(
            name="exponent_spread",
            kind="number",
            low=0.0,
            high=2.0,
            doc="How far each load's exponent may be from it, clipped to 0..2.",
        ),
    ),
    "motors": (
        Field(
            name="share",
            kind="distribution",
            low=0.0,
            high=1.0,
            doc="Share of every load; left out, the feeder file decides.",
        ),
        Field(
            name="y2_y1",
            kind="distribution",
            low=0.0,
            high=100.0,
            doc="Their negative-sequence admittance over their positive-sequence one; left out,"
            " the feeder file decides.",
        ),
    ),
    "transformers": (
        Field(name="yg_d", kind="names", doc="List of the units that may be Yg/Δ, in order."),
        Field(
            name="yg_d_count",
            kind="whole",
            low=0.0,
            high=10_000.0,
            doc="How many of them are, from the first on.",
        ),
        Field(
            name="unknown",
            kind="choice",
            choices=_CONNECTIONS,
            respell=_DELTAS,
            doc="What each unit is whose connection is unknown; left out, as told above.",
        ),
    ),
    "ders": (
        Field(
            name="level",
            kind="distribution",
            low=0.0,
            high=10.0,
            doc="Factor on the kW of all DER together.",
        ),
        Field(
            name="model",
            kind="choice",
            choices=_DER_MODELS,
            doc="What each of them is; left out, the feeder file decides.",
        ),
    ),
    "ambient": (
        Field(
            name="source_pct",
            kind="number",
            unit="%",
            low=0.0,
            high=50.0,
            doc="Largest change of the source's EMF, up or down.",
        ),
        Field(
            name="load_pct",
            kind="number",
            unit="%",
            low=0.0,
            high=100.0,
            doc="Largest change of each load, up or down.",
        ),
    ),
    "network": (
        Field(
            name="closed",
            kind="names",
            doc="List of the switches that are closed, all others being open; left out,"
            " the feeder file decides.",
        ),
        Field(
            name="settings",
            kind="text",
            choices=("each", "one"),
            doc="Settings for `each` group, or `one` for all groups together.",
        ),
    ),
}


def _with_defaults(table: str, described: Sequence[Field]) -> tuple[Field, ...]:
    """Return the fields, each with the default of the part it belongs to."""
    defaults = as_table(part_of(Study(), table))
    return tuple(replace(field, default=defaults.get(field.name)) for field in described)


TABLES: dict[str, tuple[Field, ...]] = {
    table: _with_defaults(table, described)
    for table, described in (
        *_STATE_TABLES.items(),
        ("events", EVENTS[:1]),
        *((f"events.{name}", described) for name, described in EVENT_TABLES.items()),
        *JUDGING_TABLES.items(),
    )
}
"""The fields of each table, in the order in which a file is written; see `part_of`."""
