"""How transformers are connected, by a table of the user's own: columns unit and connection."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast, get_args

from ...model.parts import (
    Connection,
    Feeder,
    InlineConnection,
    InlineTransformer,
    Shift,
    Transformer,
)
from ...model.reading.fields import did_you_mean
from .hanging import hang, why_not_hanging
from .match import Match, by_name
from .rows import OwnTable, Row, number_in, read_table

__all__ = ["OwnConnections", "read_connections", "with_transformers"]

UNKNOWN = "unknown"
COLUMNS = ("unit", "connection", "rating_kva")
INLINE = tuple(name for name in get_args(InlineConnection) if "/" in name)
HANGING = get_args(Connection)

_GROUP = re.compile(r"(YN|Y|D)(yn|y|d)(\d{0,2})")
_WINDINGS = {"YN": "Yg", "Y": "Y", "D": "D", "yn": "Yg", "y": "Y", "d": "D"}
_CLOCKS: Mapping[str, Shift | None] = {"": None, "0": None, "1": "lag", "11": "lead"}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Said:
    """A row of the table: which unit, and what it says of it."""

    unit: str
    connection: str
    shift: Shift | None
    rating_kva: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnConnections:
    """The table as it was read, names not looked up yet."""

    source: str
    rows: tuple[_Said, ...]
    ignored: tuple[str, ...]  #: columns without meaning here


def read_connections(path: Path) -> OwnConnections:
    """Read a CSV file that says how transformers are connected.

    The columns are ``unit``, ``connection`` and perhaps ``rating_kva``. A connection is written as
    in the feeder file, or as a vector group (Dyn11), or is ``unknown``.

    Raises
    ------
    InputError
        With all faults of the file.
    """
    table = read_table(path)
    rows = _read(table)
    return OwnConnections(source=table.name, rows=tuple(rows), ignored=table.others_than(COLUMNS))


def with_transformers(feeder: Feeder, own: OwnConnections) -> tuple[Feeder, Match]:
    """Give the feeder's three-phase transformers the connections of a table.

    Leakage stays what it is per unit. Names count as equal whatever their case, with or without
    ``transformer.`` before them. An in-line unit of ``unknown`` connection becomes one that hangs
    on the feeder, whose connection a study draws, if nothing but balanced loads lies behind it
    (`hanging`); otherwise it stays as it is, and the match says why.
    """
    names = [unit.name for unit in feeder.inline_transformers]
    names += [unit.name for unit in feeder.transformers]
    joined: list[str] = []
    not_joined: list[tuple[str, str]] = []
    notes: list[str] = []
    for row in own.rows:
        name = by_name(names, row.unit)
        why: str | None
        if name is None:
            why = f"no transformer has that name{did_you_mean(row.unit, names)}"
        elif name in joined:
            why = "an earlier row speaks of that unit"
        else:
            feeder, why = _told(feeder, name, row, notes)
        if why is None:
            joined.append(name or "")
        else:
            not_joined.append((row.unit, why))
    if own.ignored:
        notes.append(f"columns without meaning here: {', '.join(own.ignored)}")
    return feeder, Match(
        source=own.source,
        what="transformers",
        joined=tuple(joined),
        not_joined=tuple(not_joined),
        without_row=tuple(name for name in names if name not in joined),
        notes=tuple(notes),
    )


def _read(table: OwnTable) -> list[_Said]:
    table.needs("unit", "connection")
    table.raise_if_any()
    said = [_row(table, row) for row in table.rows]
    table.raise_if_any()
    return said


def _row(table: OwnTable, row: Row) -> _Said:
    unit = row.cells["unit"]
    if not unit:
        table.fault(row.line, "column 'unit'", "must hold a name")
    if unit.lower().startswith("transformer."):
        unit = unit[len("transformer.") :]
    written = row.cells["connection"]
    connection, shift = _connection(written)
    if connection is None:
        known = ", ".join((*INLINE, UNKNOWN))
        table.fault(row.line, "column 'connection'", f"must be one of {known}", repr(written))
    rating = number_in(table, row, "rating_kva")
    if rating == 0.0:
        table.fault(row.line, "column 'rating_kva'", "must be > 0", "0")
    return _Said(unit=unit, connection=connection or "", shift=shift, rating_kva=rating)


def _connection(text: str) -> tuple[str | None, Shift | None]:
    """The connection as the feeder file writes it, None for a strange one; and its shift."""
    text = text.replace("\N{GREEK CAPITAL LETTER DELTA}", "D").replace("\N{INCREMENT}", "D")
    if text.lower() == UNKNOWN:
        return UNKNOWN, None
    same = by_name(INLINE, text)
    if same is not None:
        return same, None
    group = _GROUP.fullmatch(text)
    if group is None or group[3] not in _CLOCKS:
        return None, None
    connection = f"{_WINDINGS[group[1]]}/{_WINDINGS[group[2]]}"
    return (connection if connection in INLINE else None), _CLOCKS[group[3]]


def _told(feeder: Feeder, name: str, row: _Said, notes: list[str]) -> tuple[Feeder, str | None]:
    """The feeder with what a row says of a unit, or why it cannot be."""
    inline = next((u for u in feeder.inline_transformers if u.name == name), None)
    if inline is None:
        unit = next(u for u in feeder.transformers if u.name == name)
        return _told_hanging(feeder, unit, row)
    if inline.connection in ("single", "centre-tap"):
        return feeder, "it is a single-phase unit, connected as its phases say"
    if row.rating_kva is not None:
        inline = replace(inline, rating_kva=row.rating_kva)
    if row.connection != UNKNOWN:
        return _with_inline(feeder, _connected(inline, row)), None
    why = why_not_hanging(feeder, inline)
    if why is not None:
        return feeder, f"{why}; it stays {inline.connection}, and no study draws what it is"
    feeder, said = hang(feeder, inline)
    notes += [note for note in said if note not in notes]
    return feeder, None


def _connected(unit: InlineTransformer, row: _Said) -> InlineTransformer:
    """The unit with its connection; ohms in a neutral go where there is none any more."""
    first, second = row.connection.split("/")
    return replace(
        unit,
        connection=cast(InlineConnection, row.connection),
        shift=row.shift or unit.shift,
        from_neutral_ohm=unit.from_neutral_ohm if first == "Yg" else 0j,
        to_neutral_ohm=unit.to_neutral_ohm if second == "Yg" else 0j,
    )


def _with_inline(feeder: Feeder, unit: InlineTransformer) -> Feeder:
    units = tuple(unit if u.name == unit.name else u for u in feeder.inline_transformers)
    return replace(feeder, inline_transformers=units)


def _told_hanging(feeder: Feeder, unit: Transformer, row: _Said) -> tuple[Feeder, str | None]:
    """The same for a unit that hangs on the feeder."""
    if row.connection not in HANGING:
        return feeder, f"a unit that hangs on the feeder can be {', '.join(HANGING)} only"
    has_core = row.connection in ("Yg/Yg", UNKNOWN)
    told = replace(
        unit,
        connection=cast(Connection, row.connection),
        rating_kva=row.rating_kva or unit.rating_kva,
        x0_pu=unit.x0_pu if has_core else None,
    )
    units = tuple(told if u.name == unit.name else u for u in feeder.transformers)
    return replace(feeder, transformers=units), None
