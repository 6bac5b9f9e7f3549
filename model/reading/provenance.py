"""Where each value of a feeder comes from: given, imported, a default, or unknown."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..parts import Feeder, Origin, OriginKey
from .feeder_fields import TABLES
from .fields import Field, as_toml

__all__ = ["assumptions", "count_origins", "find_origins", "is_written", "row_key"]

_Row = Mapping[str, Any]


def find_origins(
    raw: Mapping[str, Sequence[Mapping[str, object]]],
    rows: Mapping[str, Sequence[_Row]],
    *,
    imported: bool,
) -> dict[OriginKey, Origin]:
    """Return the origin of every value that the parts of a document have.

    Parameters
    ----------
    raw
        The rows of each table as they were parsed.
    rows
        The same, with the values that absent fields take.
    imported
        Whether the document was made from another file.

    Returns
    -------
    dict
        An origin for each field that says anything about its row. A default that does not
        concern the row, such as the magnetizing reactance of a core it does not have, is
        left out.
    """
    found: dict[OriginKey, Origin] = {}
    for table, values in rows.items():
        for index, (row, parsed) in enumerate(zip(values, raw[table], strict=True)):
            key = row_key(row, index)
            for field in TABLES[table]:
                if field.name in parsed:
                    origin: Origin = "imported" if imported else "given"
                    unknown = "unknown" in field.choices and row[field.name] == "unknown"
                    found[table, key, field.name] = "unknown" if unknown else origin
                elif _assumes(field) and _concerns(table, field.name, row):
                    found[table, key, field.name] = "default"
    return found


def row_key(row: _Row, index: int) -> str | int:
    """Return what a row is called in the origins: by its name, or counted where it has none."""
    name = row.get("name")
    return index if name is None else str(name)


def _assumes(field: Field) -> bool:
    """Whether the field's absence says something about the feeder."""
    return field.default is not None or bool(field.same_as) or bool(field.absent)


def _concerns(table: str, field: str, row: _Row) -> bool:
    """Whether the field says anything about a row with these values."""
    if table == "inline_transformers":
        return _concerns_inline(field, row["connection"])
    concerns = _CONCERNS.get((table, field))
    return concerns is None or concerns(row)


_CONCERNS: dict[tuple[str, str], Callable[[_Row], bool]] = {
    ("source", "angle_deg"): lambda row: bool(row["angle_deg"]),  # where angles begin is no guess
    ("loads", "connection"): lambda row: row["transformer"] is None,
    ("loads", "phases"): lambda row: row["transformer"] is None,
    ("loads", "branch_kv"): lambda row: row["transformer"] is None,
    ("loads", "power_factor"): lambda row: row["kvar"] is None,
    ("loads", "exponent"): lambda row: row["zip"] is None,
    ("lines", "c1_nf_per_km"): lambda row: row["code"] is None,
    ("lines", "c0_nf_per_km"): lambda row: row["code"] is None,
    ("transformers", "x0_pu"): lambda row: row["connection"] in ("Yg/Yg", "unknown"),
    ("regulators", "jumper_ohm"): lambda row: row["reference"] in ("a", "b", "c"),
}
"""Where that depends on other values of the row."""


def _concerns_inline(field: str, connection: str) -> bool:
    """Whether the field says anything about a transformer of this connection."""
    if field in ("phases", "to_phases"):
        return connection in ("single", "centre-tap")
    start, _, end = connection.partition("/")
    return {
        "shift": (start == "D") != (end == "D"),
        "from_neutral_ohm": start == "Yg",
        "to_neutral_ohm": end == "Yg",
    }.get(field, True)


def is_written(field: Field, row: _Row, origin: Origin | None) -> bool:
    """Whether a value must stand in a file for it to read back as it is, origin included.

    Examples
    --------
    >>> share = Field(name="share", kind="number", default=0.0, doc="")
    >>> [is_written(share, {"share": 0.0}, origin) for origin in ("given", "default", None)]
    [True, False, False]
    >>> is_written(share, {"share": 0.5}, "default")
    True
    """
    value = row[field.name]
    if value is None:
        return False
    if field.required or origin not in (None, "default"):
        return True
    return bool(value != (row[field.same_as] if field.same_as else field.default))


def count_origins(feeder: Feeder) -> dict[Origin, int]:
    """Return how many of the feeder's values come from where."""
    counts = Counter(feeder.origins.values())
    order: tuple[Origin, ...] = ("given", "imported", "default", "unknown")
    return {origin: counts[origin] for origin in order}


def assumptions(feeder: Feeder) -> list[str]:
    """Return what was assumed, a line for each field: its value, and for how many rows.

    Examples
    --------
    >>> from openphase.model import load_feeder
    >>> assumptions(load_feeder("paper"))[:2]
    ['source: z2_ohm as z1_ohm', 'source: z0_ohm as z1_ohm']
    """
    known: defaultdict[tuple[str, str], list[tuple[str, Origin]]] = defaultdict(list)
    for (table, name, key), origin in feeder.origins.items():
        known[table, key].append((str(name), origin))
    lines = []
    for table, fields in TABLES.items():
        for field in fields:
            own = known[table, field.name]
            for wanted in ("default", "unknown"):
                rows = [name for name, origin in own if origin == wanted]
                if rows:
                    whose = "" if table == "source" else f" ({_whose(rows, len(own))})"
                    lines.append(f"{table}: {field.name} {_assumed(field, wanted)}{whose}")
    return lines


def _assumed(field: Field, origin: str) -> str:
    if origin == "unknown":
        return "unknown"
    if field.same_as:
        return f"as {field.same_as}"
    return field.absent or as_toml(field.default)


def _whose(rows: Sequence[str], count: int) -> str:
    """Return the rows by name while they are few."""
    if len(rows) == count:
        return "all" if count > 1 else rows[0]
    return ", ".join(rows) if len(rows) <= 6 else f"{len(rows)} of {count}"
