"""From the document of a study file to the study: what is wrong with it goes to a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ...model.distributions import Fixed
from ...model.errors import KeyPath, Report
from ...model.reading.fields import Field, as_toml, describe_field
from ...model.reading.table_check import check_table
from .checks import check_together, try_grid
from .device import Steps
from .event_fields import EVENT_TABLES
from .events import CLASSES, Events, SwitchState
from .fields import (
    CORRELATIONS,
    DOCUMENT,
    EVENTS,
    GROUPS,
    MEASURED,
    STATES,
    STEPS,
    TABLES,
    part_of,
)
from .parts import Correlation, Group, MeasuredLoad, Study
from .values import READERS, Reader

__all__ = ["study_of"]


def study_of(report: Report) -> Study:
    """Return the study that the report's document describes; faults go to the report.

    Of use only while the report is empty.
    """
    top = check_table(report.document, DOCUMENT, (), report)
    raw = dict(top)
    events = _given(_with_tables(top["events"], report), EVENTS, ("events",), report)
    raw |= {f"events.{name}": table for name, table in events.items() if name != "without"}
    parts = {
        table: replace(
            part_of(Study(), table),
            **_given(raw.get(table), described, tuple(table.split(".")), report),
        )
        for table, described in TABLES.items()
        if table != "events"
    }
    event_parts = {name: parts.pop(f"events.{name}") for name in EVENT_TABLES}
    without = events.get("without", ())
    study = Study(
        **parts,
        measured=tuple(
            MeasuredLoad(**(_NOT_MEASURED | _given(row, MEASURED, ("measured", index), report)))
            for index, row in enumerate(top["measured"])
        ),
        events=Events(without=without, **event_parts),
        groups=tuple(
            Group(**({"name": ""} | _given(row, GROUPS, ("groups", index), report)))
            for index, row in enumerate(top["groups"])
        ),
        correlations=tuple(
            Correlation(
                **(_NO_CORRELATION | _given(row, CORRELATIONS, ("correlations", index), report))
            )
            for index, row in enumerate(top["correlations"])
        ),
    )
    check_together(study, report)
    return study


_NOT_MEASURED: dict[str, Any] = {"point": "", "level": Fixed(value=1.0)}
_NO_CORRELATION: dict[str, Any] = {"between": ("", ""), "rank": 0.0}


def _with_tables(events: Mapping[str, object] | None, report: Report) -> dict[str, object]:
    """Return the events but for classes that take no table, which are reported."""
    rows = dict(events or {})
    for name in CLASSES:
        if name in rows and name not in EVENT_TABLES:
            report.add(("events", name), "takes no table: there is nothing to choose")
            del rows[name]
    return rows


def _given(
    raw: Mapping[str, object] | None, described: Sequence[Field], path: KeyPath, report: Report
) -> dict[str, Any]:
    """Return the checked values of those known keys that a table holds."""
    raw = raw or {}
    place = tuple(part for part in path if isinstance(part, str))
    values: dict[str, Any] = {}
    for field in described:
        read = _READERS.get((*place, field.name)) or READERS.get(field.kind)
        if read is not None and field.name in raw:
            values[field.name] = read(raw[field.name], field, (*path, field.name), report)
    rest = {key: value for key, value in raw.items() if key not in values}
    others = [
        replace(field, required=False) if field.name in values else field for field in described
    ]
    values = check_table(rest, others, path, report) | values
    return {key: values[key] for key in raw if key in values}


# ---- readers of single keys: a fault is reported, and a harmless value returned ----


def _read_event(value: object, field: Field, path: KeyPath, report: Report) -> Mapping[str, object]:
    if not isinstance(value, Mapping):
        written = ".".join(str(part) for part in path)
        report.add(path, f"must be a table, written [{written}]", as_toml(value))
        return {}
    return value


def _read_states(
    value: object, field: Field, path: KeyPath, report: Report
) -> tuple[SwitchState, ...]:
    rows = value if isinstance(value, list) else [None]
    if not all(isinstance(row, Mapping) for row in rows):
        rule = "must be a list of { closed = [...], opened = [...] }"
        report.add(path, rule, as_toml(value))
        return ()
    return tuple(
        SwitchState(**_given(row, STATES, (*path, index), report)) for index, row in enumerate(rows)
    )


def _read_steps(value: object, field: Field, path: KeyPath, report: Report) -> Steps:
    faults = len(report.faults)
    if not isinstance(value, Mapping):
        report.add(path, "must be { first = ..., last = ..., step = ... }", as_toml(value))
        value = None
    steps = Steps(**check_table(value, STEPS, path, report))
    if len(report.faults) == faults:
        try_grid(steps.values, path, as_toml(value), report)
    return steps


def _read_ladder(value: object, field: Field, path: KeyPath, report: Report) -> tuple[Steps, ...]:
    if not isinstance(value, list):
        report.add(
            path, "must be a list of { first = ..., last = ..., step = ... }", as_toml(value)
        )
        return ()
    return tuple(
        _read_steps(item, field, (*path, index), report) for index, item in enumerate(value)
    )


def _read_exponent(value: object, field: Field, path: KeyPath, report: Report) -> object:
    if not isinstance(value, str):
        return READERS[field.kind](value, field, path, report)
    if value != "file":
        report.add(path, f"must be 'file', {describe_field(field)}", as_toml(value))
    return "file"


def _read_two_names(value: object, field: Field, path: KeyPath, report: Report) -> tuple[str, str]:
    faults = len(report.faults)
    names = READERS["names"](value, field, path, report)
    if isinstance(names, tuple) and len(names) == 2:
        return names
    if len(report.faults) == faults:
        report.add(path, "must name two quantities", as_toml(value))
    return "", ""


def _read_two_factors(
    value: object, field: Field, path: KeyPath, report: Report
) -> tuple[float, float]:
    faults = len(report.faults)
    factors = check_table({field.name: value}, [field], path[:-1], report)[field.name]
    if len(factors) == 2:
        return factors[0], factors[1]
    if len(report.faults) == faults:
        report.add(path, "must be two factors", as_toml(value))
    return 1.0, 1.0


_READERS: dict[KeyPath, Reader] = {
    **{("events", name): _read_event for name in EVENT_TABLES},
    ("events", "tie_switching", "states"): _read_states,
    ("events", "transfer", "states"): _read_states,
    ("correlations", "between"): _read_two_names,
    ("certificate", "loop_margins"): _read_two_factors,
    ("loads", "exponent"): _read_exponent,
    ("device", "i_set"): _read_steps,
    ("device", "z_set_ohm"): _read_ladder,
}
