"""Every field of a study file's events: kind, unit, range and meaning."""

from __future__ import annotations

from ...model.reading.fields import Field
from .events import CLASSES, WIRING_KINDS

__all__ = ["EVENTS", "EVENT_TABLES", "STATES"]

MOST_KW = 1e5
MOST_OHM = 1e5


def _table(name: str, doc: str) -> Field:
    return Field(name=name, kind="table", default={}, doc=doc)


def _kw(doc: str) -> Field:
    return Field(name="kw", kind="distribution", unit="kW", above=0.0, high=MOST_KW, doc=doc)


def _ohm(doc: str) -> Field:
    return Field(name="ohm", kind="distribution", unit="ohm", above=0.0, high=MOST_OHM, doc=doc)


def _share(name: str, doc: str) -> Field:
    return Field(name=name, kind="number", low=0.0, high=1.0, doc=doc)


def _pct(doc: str) -> Field:
    return Field(name="pct", kind="distribution", unit="%", low=-50.0, high=50.0, doc=doc)


_TRIPPING = Field(
    name="share",
    kind="distribution",
    low=0.0,
    high=1.0,
    doc="Share of the DER that trip, any of them; at least one does.",
)

_STATES = Field(
    name="states",
    kind="tables",
    default=[],
    doc="The other states of the network, each as likely; without any there are no such events.",
)

EVENTS: tuple[Field, ...] = (
    Field(
        name="without",
        kind="names",
        choices=CLASSES,
        default=[],
        doc="List of the classes that are left out; `open_phase` cannot be.",
    ),
    _table("open_phase", "Broken conductors."),
    _table("load_step", "Load switched on or off."),
    _table("source_step", "A step of the source's voltage."),
    _table("capacitor_step", "A capacitor bank switched on or off."),
    _table("motor_start", "A motor begins to start, or is up to speed."),
    _table("regulator_tap", "A regulator changes its tap."),
    _table("earth_fault", "One phase to earth, conductors whole."),
    _table("line_fault", "Two phases together, conductors whole."),
    _table("tie_switching", "A tie closes or opens, and the feeder's own switches stay."),
    _table("transfer", "Part of the feeder goes over to another feeder, or back."),
    _table("der_trip", "DER trip."),
    _table("der_ramp", "All DER deliver more or less than before."),
    _table("reclosing", "Three phases close upon cold load."),
    _table("single_pole", "A fuse, cut-out or single-phase recloser closes."),
    _table("fallen_source_side", "A broken conductor whose source side lies on the ground."),
    _table("fallen_load_side", "A broken conductor whose load side lies on the ground."),
    _table("open_with_load_step", "A break and a load step within ΔT."),
    _table("open_with_der_trip", "A break and a trip of DER within ΔT."),
    _table("load_swap", "Load on at one place, off at another, within ΔT."),
    _table("step_with_tap", "A load step and a step of the source's voltage within ΔT."),
    _table("wiring", "A measuring point wired wrongly."),
)

STATES: tuple[Field, ...] = (
    Field(
        name="closed",
        kind="names",
        doc="List of the switches that are closed, all others being open; left out, the"
        " feeder file decides.",
    ),
    Field(
        name="opened",
        kind="names",
        default=[],
        doc="List of the measuring points whose recloser is open.",
    ),
)

EVENT_TABLES: dict[str, tuple[Field, ...]] = {
    "open_phase": (_share("two_phase_share", "Share that opens two phases instead of one."),),
    "load_step": (
        _kw("Size at nominal voltage."),
        _share("single_phase_share", "Share of steps that are on one phase instead of all three."),
        Field(
            name="exponent",
            kind="distribution",
            low=0.0,
            high=2.0,
            doc="Voltage exponent of the load switched.",
        ),
    ),
    "source_step": (_pct("Change of the EMF."),),
    "capacitor_step": (
        Field(
            name="kvar",
            kind="distribution",
            unit="kvar",
            above=0.0,
            high=MOST_KW,
            doc="Size of the bank, three phases together, at nominal voltage.",
        ),
        _share("delta_share", "Share of banks between the phases instead of in grounded wye."),
    ),
    "motor_start": (
        Field(
            name="kva",
            kind="distribution",
            unit="kVA",
            above=0.0,
            high=MOST_KW,
            doc="Rating of the motor.",
        ),
        Field(
            name="times",
            kind="distribution",
            above=0.0,
            high=20.0,
            doc="Power while it starts, in ratings, at nominal voltage.",
        ),
        Field(
            name="power_factor",
            kind="distribution",
            above=0.0,
            high=1.0,
            doc="While it starts, lagging.",
        ),
    ),
    "regulator_tap": (
        Field(
            name="taps",
            kind="whole",
            low=-32.0,
            high=32.0,
            doc="Change of the tap position, up or down.",
        ),
        _share("single_phase_share", "Share of changes of one phase instead of all three alike."),
    ),
    "earth_fault": (_ohm("Resistance between the phase and earth."),),
    "line_fault": (
        _ohm("Resistance between the phases."),
        _share("earth_share", "Share of faults that touch earth too."),
    ),
    "tie_switching": (_STATES,),
    "transfer": (_STATES,),
    "der_trip": (_TRIPPING,),
    "der_ramp": (
        Field(
            name="factor",
            kind="distribution",
            low=0.0,
            high=10.0,
            doc="Factor on what the DER deliver.",
        ),
    ),
    "reclosing": (
        Field(
            name="cold_load",
            kind="distribution",
            above=0.0,
            high=10.0,
            doc="Factor on the loads beyond the place.",
        ),
    ),
    "single_pole": (_share("two_phase_share", "Share that closes two phases instead of one."),),
    "fallen_source_side": (_ohm("Resistance between the fallen end and earth."),),
    "fallen_load_side": (_ohm("Resistance between the fallen end and earth."),),
    "open_with_load_step": (_kw("Size of the load at nominal voltage."),),
    "open_with_der_trip": (_TRIPPING,),
    "load_swap": (
        _kw("Size of the step at the first place."),
        Field(
            name="ratio",
            kind="distribution",
            low=-10.0,
            high=0.0,
            doc="Step at the second place, in steps at the first.",
        ),
    ),
    "step_with_tap": (_kw("Size of the load at nominal voltage."), _pct("Change of the EMF.")),
    "wiring": (
        Field(
            name="kinds",
            kind="choice",
            choices=tuple(WIRING_KINDS),
            doc="What is wrong, all alike at first; the phases concerned are drawn.",
        ),
    ),
}
"""The fields of each class's table, without defaults: `spec_fields.TABLES` has them."""
