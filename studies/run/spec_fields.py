"""Every field of a study file: kind, unit, range and meaning.

The defaults are taken from the dataclasses, so that a study made in a program and one
read from an empty file cannot differ.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace

from ...model.fields import Field
from .spec_parts import (
    Ambient,
    CertificateDemand,
    DetectorOptions,
    Device,
    Instruments,
    LoadDraw,
    LoadStepDraw,
    NetworkState,
    OpenPhaseDraw,
    ReferenceSettings,
    SourceStepDraw,
    TransformerDraw,
)

__all__ = ["DOCUMENT", "EVENTS", "FORMAT", "STEPS", "TABLES", "as_table"]

FORMAT = 1
"""Version of the file format, the only one there is."""


def as_table(part: object) -> dict[str, object]:
    """Return a part of a study as TOML parses it; what is None is left out.

    Examples
    --------
    >>> as_table(SourceStepDraw())
    {'pct': [-5.0, 5.0]}
    """
    assert is_dataclass(part)
    row = {field.name: getattr(part, field.name) for field in fields(part)}
    return {key: _plain(value) for key, value in row.items() if value is not None}


def _plain(value: object) -> object:
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return as_table(value) if is_dataclass(value) else value


def _table(part: object, *described: Field) -> tuple[Field, ...]:
    """Return the fields, each with the part's value as its default."""
    defaults = as_table(part)
    return tuple(replace(field, default=defaults.get(field.name)) for field in described)


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
    _optional("transformers", "Which transformers may be Yg/Δ."),
    _optional("ambient", "What changes between the two frames besides the event."),
    _optional("network", "Which switches are closed."),
    _optional("events", "The events, a table each."),
    _optional("instruments", "Errors of the measurement."),
    _optional("device", "The settings that the relay can hold."),
    _optional("detector", "Options of the detector."),
    _optional("reference", "Settings to compare with."),
    _optional("certificate", "What is demanded of the settings."),
)

EVENTS: tuple[Field, ...] = (
    _optional("open_phase", "Broken conductors."),
    _optional("load_step", "Load switched on or off."),
    _optional("source_step", "A step of the source's voltage."),
)

STEPS: tuple[Field, ...] = (
    Field(name="first", kind="number", above=0.0, required=True, doc="The lowest value."),
    Field(
        name="last",
        kind="number",
        above=0.0,
        required=True,
        doc="The highest value, a whole number of steps from `first`.",
    ),
    Field(name="step", kind="number", above=0.0, required=True, doc="From one to the next."),
)

TABLES: dict[str, tuple[Field, ...]] = {
    "loads": _table(
        LoadDraw(),
        Field(name="level", kind="range", low=0.0, doc="Factor on all loads together."),
        Field(name="each", kind="range", low=0.0, doc="Further factor on each load."),
        Field(
            name="exponent",
            kind="range",
            low=0.0,
            high=2.0,
            doc="Voltage exponent common to all loads.",
        ),
        Field(
            name="exponent_spread",
            kind="number",
            low=0.0,
            high=2.0,
            doc="How far each load's exponent may be from it, clipped to 0..2.",
        ),
    ),
    "transformers": _table(
        TransformerDraw(),
        Field(name="yg_d", kind="name", doc="List of the units that may be Yg/Δ, in order."),
        Field(
            name="yg_d_count",
            kind="range",
            low=0.0,
            doc="How many of them are, from the first on; whole numbers.",
        ),
    ),
    "ambient": _table(
        Ambient(),
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
    "network": _table(
        NetworkState(),
        Field(
            name="closed",
            kind="name",
            doc="List of the switches that are closed, all others being open; left out,"
            " the feeder file decides.",
        ),
    ),
    "events.open_phase": _table(
        OpenPhaseDraw(),
        Field(
            name="two_phase_share",
            kind="number",
            low=0.0,
            high=1.0,
            doc="Share of breaks that open two phases instead of one.",
        ),
    ),
    "events.load_step": _table(
        LoadStepDraw(),
        Field(name="kw", kind="range", unit="kW", above=0.0, doc="Size at nominal voltage."),
        Field(
            name="single_phase_share",
            kind="number",
            low=0.0,
            high=1.0,
            doc="Share of steps that are on one phase instead of all three.",
        ),
        Field(
            name="exponent",
            kind="range",
            low=0.0,
            high=2.0,
            doc="Voltage exponent of the load switched.",
        ),
    ),
    "events.source_step": _table(
        SourceStepDraw(),
        Field(name="pct", kind="range", unit="%", low=-50.0, high=50.0, doc="Change of the EMF."),
    ),
    "instruments": _table(
        Instruments(),
        Field(
            name="tve_pct",
            kind="number",
            unit="%",
            low=0.0,
            high=100.0,
            doc="Largest total vector error, of the phasor's magnitude.",
        ),
        Field(
            name="current_floor_a",
            kind="number",
            unit="A",
            low=0.0,
            doc="Largest error of a current so small that its `tve_pct` is less.",
        ),
    ),
    "device": _table(
        Device(),
        Field(name="i_set_a", kind="table", unit="A", doc="Values of I_set, primary: steps."),
        Field(
            name="z_set_ohm",
            kind="tables",
            unit="ohm",
            doc="Values of Z_set, primary: one or more steps, rising; at first to 50 by 0.1,"
            " then from 51 to 300 by 1.",
        ),
        Field(
            name="v_set_pct",
            kind="numbers",
            unit="%",
            above=0.0,
            high=100.0,
            doc="Values of V_set on the nominal phase voltage, rising.",
        ),
        Field(
            name="ct_primary_a",
            kind="number",
            unit="A",
            above=0.0,
            doc="Primary current of 1 pu in the relay's own settings.",
        ),
    ),
    "detector": _table(
        DetectorOptions(),
        Field(
            name="dt_ms",
            kind="number",
            unit="ms",
            above=0.0,
            doc="ΔT, between the frames that are compared; carried, not judged yet.",
        ),
        Field(
            name="delay_ms",
            kind="number",
            unit="ms",
            low=0.0,
            doc="From pickup to trip; carried, not judged yet.",
        ),
        Field(
            name="negative_sign",
            kind="flag",
            doc="Trip only if the connection impedance has a real part < 0.",
        ),
    ),
    "reference": _table(
        ReferenceSettings(),
        Field(name="i_set_a", kind="number", unit="A", above=0.0, doc="I_set, primary."),
        Field(
            name="v_set_pct",
            kind="number",
            unit="%",
            above=0.0,
            high=100.0,
            doc="V_set on the nominal phase voltage.",
        ),
        Field(name="z_set_ohm", kind="number", unit="ohm", above=0.0, doc="Z_set, primary."),
    ),
    "certificate": _table(
        CertificateDemand(),
        Field(
            name="confidence",
            kind="number",
            low=0.5,
            high=1.0,
            doc="Confidence of the terminals' false-trip bounds together, less than 1.",
        ),
        Field(
            name="target",
            kind="number",
            above=0.0,
            high=0.5,
            doc="Upper bound demanded of the false trips per event.",
        ),
        Field(
            name="find_at_least",
            kind="number",
            low=0.0,
            high=1.0,
            doc="Share of breaks whose detection makes settings more than weak.",
        ),
        Field(
            name="margin",
            kind="number",
            low=1.0,
            doc="Factor demanded to the nearest false trip.",
        ),
    ),
}
"""The fields of each table, in the order in which a file is written.

The last part of a table's name is the name of that part of a `Study`.
"""
