"""What was measured at points of a feeder: maxima and minima, or hourly amperes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .rows import OwnTable, number_in, read_table

__all__ = ["Readings", "read_readings"]

Real = NDArray[np.float64]
Unit = Literal["a", "kw"]

FEW_HOURS = 168  #: a week; fewer are no distribution of a year


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Readings:
    """Values by place as the file names it; NaN where nothing was read.

    Parameters
    ----------
    source
        The file.
    unit
        Amperes, the mean of the three phases, or kW of all three.
    hourly
        Whether the values are of hours, alike for all places; otherwise they are two, the
        maximum and the minimum (NaN where it is not given).
    values
        For each place.
    notes
        What else should be known.
    """

    source: str
    unit: Unit
    hourly: bool
    values: dict[str, Real]
    notes: tuple[str, ...]


def read_readings(path: Path) -> Readings:
    """Read measured loads.

    Either columns ``point``, ``max_a`` and ``min_a`` (or ``max_kw`` and ``min_kw``); or a column
    ``time`` and one of amperes for each point; or columns ``time``, ``point`` and ``a``.

    Raises
    ------
    InputError
        With all faults of the file.
    """
    table = read_table(path)
    if "time" not in table.columns:
        found = _extremes(table)
    elif "point" in table.columns:
        found = _hourly_rows(table)
    else:
        found = _hourly_columns(table)
    table.raise_if_any()
    return found


def _extremes(table: OwnTable) -> Readings:
    unit: Unit = "kw" if "max_kw" in table.columns else "a"
    most, least = f"max_{unit}", f"min_{unit}"
    table.needs("point", most)
    table.raise_if_any()
    values: dict[str, Real] = {}
    for row in table.rows:
        high, low = number_in(table, row, most), number_in(table, row, least)
        if not row.cells["point"]:
            table.fault(row.line, "column 'point'", "must hold a name")
        elif row.cells["point"] in values:
            table.fault(row.line, "column 'point'", "must be there once", row.cells["point"])
        if not row.cells[most] or high == 0.0:
            table.fault(row.line, f"column {most!r}", "must hold a number > 0")
        if high is not None and low is not None and low > high:
            table.fault(row.line, f"column {least!r}", f"must be <= {most}", f"{low:g} of {high:g}")
        values[row.cells["point"]] = np.array([_or_nan(high), _or_nan(low)])
    ignored = table.others_than(("point", most, least))
    return Readings(
        source=table.name,
        unit=unit,
        hourly=False,
        values=values,
        notes=_ignored(ignored),
    )


def _hourly_columns(table: OwnTable) -> Readings:
    """One column of amperes for each point."""
    names = table.others_than(("time",))
    if not names:
        table.fault(1, "", "must have a column of amperes for each point beside time", "none")
    _check_times(table, [row.cells["time"] for row in table.rows])
    values = {
        name: np.array([_or_nan(number_in(table, row, name.lower())) for row in table.rows])
        for name in names
    }
    return _hourly(table.name, values)


def _hourly_rows(table: OwnTable) -> Readings:
    """One row for each hour and point."""
    table.needs("a")
    table.raise_if_any()
    hours = {time: n for n, time in enumerate(dict.fromkeys(r.cells["time"] for r in table.rows))}
    values: dict[str, Real] = {}
    seen: set[tuple[str, str]] = set()
    for row in table.rows:
        time, point = row.cells["time"], row.cells["point"]
        if not time or not point:
            table.fault(row.line, "", "must have a time and a point")
        elif (time, point) in seen:
            table.fault(row.line, f"time {time!r}", f"must be there once for {point}")
        seen.add((time, point))
        own = values.setdefault(point, np.full(len(hours), np.nan))
        own[hours[time]] = _or_nan(number_in(table, row, "a"))
    found = _hourly(table.name, values)
    ignored = _ignored(table.others_than(("time", "point", "a")))
    return Readings(
        source=found.source,
        unit=found.unit,
        hourly=True,
        values=found.values,
        notes=(*found.notes, *ignored),
    )


def _check_times(table: OwnTable, times: Sequence[str]) -> None:
    seen: set[str] = set()
    for row, time in zip(table.rows, times, strict=True):
        if not time:
            table.fault(row.line, "column 'time'", "must not be empty")
        elif time in seen:
            table.fault(row.line, "column 'time'", "must be there once", repr(time))
        seen.add(time)


def _hourly(source: str, values: dict[str, Real]) -> Readings:
    """Hourly amperes: an hour without any current is an outage or a dead meter, and left out."""
    notes = []
    hours = max((own.size for own in values.values()), default=0)
    if hours < FEW_HOURS:
        notes.append(f"{hours} hours only: what happens in no week is not among them")
    for name, own in values.items():
        dead, absent = int(np.sum(own == 0.0)), int(np.sum(np.isnan(own)))
        if dead or absent:
            notes.append(
                f"{name}: {dead} of {own.size} hours without current, {absent} without a reading "
                "are left out"
            )
    kept = {name: np.where(own > 0.0, own, np.nan) for name, own in values.items()}
    return Readings(source=source, unit="a", hourly=True, values=kept, notes=tuple(notes))


def _ignored(columns: Sequence[str]) -> tuple[str, ...]:
    return (f"columns without meaning here: {', '.join(columns)}",) if columns else ()


def _or_nan(value: float | None) -> float:
    return np.nan if value is None else value
