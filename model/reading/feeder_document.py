"""The way between a `Feeder` and its document, the tables of plain values in a file.

Both directions exist so that a feeder built in a program passes the same checks as one
that was read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import KeyPath, Report
from ..parts import (
    Capacitor,
    Coordinates,
    Der,
    Feeder,
    InlineTransformer,
    Line,
    LineCode,
    Load,
    Place,
    Point,
    Regulator,
    Section,
    Source,
    Switch,
    Transformer,
)
from .feeder_fields import DOCUMENT, FORMAT, ROWS, TABLES
from .feeder_refused import KEYS
from .fields import Field
from .provenance import find_origins, is_written, row_key
from .table_check import REPORTED, check_table

__all__ = ["document_from_feeder", "feeder_from_document"]

_Row = dict[str, Any]

_PARTS: dict[str, type] = {
    "codes": LineCode,
    "lines": Line,
    "inline_transformers": InlineTransformer,
    "transformers": Transformer,
    "loads": Load,
    "ders": Der,
    "capacitors": Capacitor,
    "regulators": Regulator,
    "switches": Switch,
    "points": Point,
    "sections": Section,
    "coordinates": Coordinates,
}

_RENAMED = {"from": "from_bus", "to": "to_bus"}
"""Fields of a file whose name is a word of Python's."""

_PLACES = ({"bus"}, {"line", "at"})

_HANGING = {
    "transformers": _PLACES,
    "loads": ({"transformer"}, *_PLACES),
    "ders": ({"transformer"}, *_PLACES),
    "capacitors": _PLACES,
}
"""The ways in which the parts of a table may say where they hang."""


def feeder_from_document(document: Mapping[str, object], report: Report) -> Feeder:
    """Return the feeder a document describes, every field checked on its own.

    Faults go to the report. Stand-ins take the place of faulty values, an empty text that
    of a faulty name, so the feeder is of use only to further checks until the report is
    known to be empty.
    """
    top = check_table(document, DOCUMENT, (), report, KEYS[""])
    source = check_table(top["source"], TABLES["source"], ("source",), report, KEYS["source"])
    rows = {table: _rows(top[table], table, report) for table in ROWS}
    for table, ways in _HANGING.items():
        for index, (raw, row) in enumerate(zip(top[table], rows[table], strict=True)):
            if REPORTED not in raw.values():
                _check_place(row, ways, (table, index), report)
    for index, raw in enumerate(top["loads"]):
        _check_behind_transformer(raw, ("loads", index), report)
    origins = find_origins(
        {"source": [top["source"] or {}], **{table: top[table] for table in ROWS}},
        {"source": [source], **rows},
        imported=top["imported_from"] is not None,
    )
    return Feeder(
        name=top["name"],
        source=_source(source),
        **{table: tuple(_part(table, row) for row in rows[table]) for table in ROWS},
        imported_from=top["imported_from"],
        origins=origins,
    )


def _rows(raw: Sequence[Mapping[str, object]], table: str, report: Report) -> list[_Row]:
    """Return the checked rows of an array of tables."""
    return [
        check_table(row, ROWS[table], (table, index), report, KEYS[table])
        for index, row in enumerate(raw)
    ]


def _check_place(row: _Row, allowed: Sequence[set[str]], path: KeyPath, report: Report) -> None:
    """Report a row that says where it hangs in no way, half a way or two ways."""
    given = [key for key in ("transformer", "bus", "line", "at") if row.get(key) is not None]
    if set(given) not in allowed:
        ways = " or ".join(" and ".join(sorted(way, reverse=True)) for way in allowed)
        report.add(path, f"must say where it hangs, by {ways}", " and ".join(given) or "none")


def _check_behind_transformer(raw: Mapping[str, object], path: KeyPath, report: Report) -> None:
    """Report what a load says of itself where the transformer above it decides that."""
    if "transformer" not in raw or REPORTED in raw.values():
        return
    decided = {
        "connection": "whose winding decides",
        "phases": "whose loads have three",
        "branch_kv": "whose loads have its nominal voltage",
    }
    for key, why in decided.items():
        if key in raw:
            report.add((*path, key), f"must be left out behind a transformer, {why}")


def _source(row: _Row) -> Source:
    return Source(**{**row, "neutral_ohm": row["neutral_ohm"] or 0j})


def _part(table: str, row: _Row) -> Any:
    """Return the part that a row describes; its attributes are called like the fields."""
    values = {_RENAMED.get(key, key): value for key, value in row.items()}
    if "at" in values:
        place = Place(bus=values.pop("bus"), line=values.pop("line"), at=values.pop("at"))
        values["place"] = place if values.get("transformer") is None else None
    return _PARTS[table](**values)


def document_from_feeder(feeder: Feeder) -> dict[str, object]:
    """Return the document that describes a feeder.

    A value that is the default is written only where the feeder's origins say that it was
    given: so a default stays one when the document is read.
    """
    document: dict[str, object] = {"format": FORMAT, "name": feeder.name}
    if feeder.imported_from is not None:
        document["imported_from"] = feeder.imported_from
    document["source"] = _row(feeder, "source", 0, feeder.source)
    for table in ROWS:
        parts = getattr(feeder, table)
        document[table] = [_row(feeder, table, index, part) for index, part in enumerate(parts)]
    return document


def _row(feeder: Feeder, table: str, index: int, part: object) -> _Row:
    """Return the row that describes a part."""
    values = {field.name: _value(part, field) for field in TABLES[table]}
    key = row_key(values, index)
    return {
        field.name: _plain(values[field.name])
        for field in TABLES[table]
        if is_written(field, values, feeder.origins.get((table, key, field.name)))
    }


def _value(part: object, field: Field) -> object:
    """Return the value that a part has in a field; None where it has none."""
    name = _RENAMED.get(field.name, field.name)
    if name == "neutral_ohm":
        return getattr(part, name) or None
    if hasattr(part, name):
        return getattr(part, name)
    place = getattr(part, "place", None)
    return None if place is None else getattr(place, name)


def _plain(value: object) -> object:
    """Return a value as a file holds it: impedances, tuples and matrices are lists there."""
    if isinstance(value, complex):
        return [value.real, value.imag]
    return [_plain(item) for item in value] if isinstance(value, tuple) else value
