"""Checks a table of a user's file against the description of its fields."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from ..errors import KeyPath, Report
from .fields import Field, Kind, as_toml, bounds_of, describe_field, did_you_mean

__all__ = ["REPORTED", "check_table", "reason"]

LEAST, MOST = 1e-12, 1e12
"""Magnitudes beyond which a number is a slip: its square or reciprocal soon leaves the floats."""

REPORTED: Final = object()
"""Stands in a table for a value whose fault has been reported where it was read."""


class _UnfitError(Exception):
    """A value breaks a rule; ``what`` says what it is, if it is known but has no model."""

    def __init__(self, rule: str, what: str = "") -> None:
        super().__init__(rule)
        self.rule = rule
        self.what = what


def check_table(
    raw: Mapping[str, object] | None,
    fields: Sequence[Field],
    path: KeyPath,
    report: Report,
    refused: Sequence[tuple[str, str]] = (),
) -> dict[str, Any]:
    """Return the values of one table, every field of it, and report all that is wrong.

    Parameters
    ----------
    raw
        The table as parsed; None for one whose absence has been reported already.
    fields
        What the table may hold.
    path
        Where the table stands in the document.
    report
        Receives the faults.
    refused
        Pairs ``(pattern, why)`` of keys that have a meaning, but one that the model cannot
        represent; the reason becomes part of the message.

    Returns
    -------
    dict
        A value for each field, of the Python type of its kind. A faulty one is replaced
        by a harmless stand-in (a name by ``""``) so that further checks can go on: once
        the report has faults, the values serve for nothing else.
    """
    table = {} if raw is None else raw
    _report_unknown_keys(table, fields, path, report, refused)
    values: dict[str, Any] = {}
    for field in fields:
        if field.name in table and table[field.name] is REPORTED:
            values[field.name] = _stand_in(field)
        elif field.name in table:
            try:
                values[field.name] = _READERS[field.kind](table[field.name], field)
            except _UnfitError as error:
                what = f": {error.what}" if error.what else ""
                found = f"{as_toml(table[field.name])}{what}"
                report.add((*path, field.name), error.rule, found)
                values[field.name] = _stand_in(field)
        elif field.required:
            if raw is not None:
                report.add((*path, field.name), f"is missing ({describe_field(field)})")
            values[field.name] = _stand_in(field)
        else:
            values[field.name] = values[field.same_as] if field.same_as else field.default
    return values


def _report_unknown_keys(
    raw: Mapping[str, object],
    fields: Sequence[Field],
    path: KeyPath,
    report: Report,
    refused: Sequence[tuple[str, str]],
) -> None:
    """Report every key that no field describes: why, or else the nearest that one does."""
    known = [field.name for field in fields]
    for key in raw:
        if key not in known:
            why = reason(key, refused)
            hint = f": {why}" if why else did_you_mean(key, known)
            report.add((*path, key), f"is not a known key{hint}")


def reason(text: str, refused: Sequence[tuple[str, str]]) -> str:
    """Return why ``text`` is refused, by the first pattern that fits it all; or nothing.

    Examples
    --------
    >>> reason("Kva", [("kva|kvar", "say it by kw")])
    'say it by kw'
    """
    fitting = (why for pattern, why in refused if re.fullmatch(pattern, text, re.IGNORECASE))
    return next(fitting, "")


# ---- one reader per kind: the value as Python has it, or _UnfitError with the rule ----


def _read_name(value: object, field: Field) -> str:
    if not isinstance(value, str) or not value or value != value.strip():
        raise _UnfitError("must be a name: text, not empty, without space around it")
    if ":" in value or not value.isprintable():
        raise _UnfitError("must be a name without ':' or control characters")
    return value


def _read_text(value: object, field: Field) -> str:
    if not isinstance(value, str):
        raise _UnfitError(f"must be {describe_field(field)}")
    for variant, standard in field.respell:
        value = value.replace(variant, standard)
    if field.choices and value not in field.choices:
        what = reason(value, field.refused)
        hint = "" if what else did_you_mean(value, field.choices)
        raise _UnfitError(f"must be {describe_field(field)}{hint}", what)
    return value


def _read_number(value: object, field: Field) -> float:
    number = _finite(value)
    if number is None:
        raise _UnfitError(f"must be {describe_field(field)}")
    _check_bounds(number, field, "")
    return number


def _read_integer(value: object, field: Field) -> int:
    if not isinstance(value, int) or isinstance(value, bool):
        raise _UnfitError(f"must be {describe_field(field)}")
    _check_bounds(value, field, "")
    return value


def _read_flag(value: object, field: Field) -> bool:
    if not isinstance(value, bool):
        raise _UnfitError("must be true or false")
    return value


def _read_impedance(value: object, field: Field) -> complex:
    z = _complex(value)
    if z is None:
        raise _UnfitError(f"must be {describe_field(field)}")
    _check_bounds(math.hypot(z.real, z.imag), field, "have a magnitude ")
    if z.real < 0.0:
        raise _UnfitError("must have a resistance >= 0")
    return z


def _read_range(value: object, field: Field) -> tuple[float, float]:
    numbers = _read_numbers(value, field)
    if len(numbers) != 2 or numbers[0] > numbers[1]:
        raise _UnfitError("must be [low, high], low <= high")
    return numbers[0], numbers[1]


def _read_numbers(value: object, field: Field) -> tuple[float, ...]:
    found = [_finite(item) for item in value] if isinstance(value, list) else [None]
    numbers = tuple(number for number in found if number is not None)
    if len(numbers) < len(found) or field.count not in (None, len(found)):
        raise _UnfitError(f"must be {describe_field(field)}")
    for number in numbers:
        _check_bounds(number, field, "hold numbers ")
    return numbers


def _read_matrix(value: object, field: Field) -> tuple[tuple[float, ...], ...]:
    rows = value if isinstance(value, list) else []
    found = [[_finite(item) for item in row] if isinstance(row, list) else [] for row in rows]
    matrix = [[item for item in row if item is not None] for row in found]
    sizes = {len(row) for row in found} | {len(row) for row in matrix}
    if not 1 <= len(rows) <= 3 or sizes != {len(rows)}:
        raise _UnfitError(f"must be {describe_field(field)}")
    for i, row in enumerate(matrix):
        _check_bounds(row[i], field, "have a diagonal ")
        for j, item in enumerate(row):
            if item != matrix[j][i]:
                raise _UnfitError("must be symmetric")
            if abs(item) > MOST:  # a mutual one may be as small as reckoning left it
                raise _UnfitError(f"must hold numbers up to {MOST:g}")
    return tuple(tuple(row) for row in matrix)


def _read_phases(value: object, field: Field) -> str:
    if not isinstance(value, str) or not value or set(value) - set("abc"):
        raise _UnfitError(f"must be {describe_field(field)}")
    if len(set(value)) < len(value):
        raise _UnfitError("must name each phase once")
    return value


def _read_integers(value: object, field: Field) -> tuple[int, ...]:
    found = value if isinstance(value, list) else [None]
    integers = tuple(item for item in found if type(item) is int)
    if len(integers) < len(found) or field.count not in (None, len(found)):
        raise _UnfitError(f"must be {describe_field(field)}")
    for number in integers:
        _check_bounds(number, field, "hold integers ")
    return integers


def _read_table(value: object, field: Field) -> Mapping[str, object]:
    if not isinstance(value, Mapping):
        raise _UnfitError(f"must be a table, written [{field.name}]")
    return value


def _read_tables(value: object, field: Field) -> tuple[Mapping[str, object], ...]:
    rows = value if isinstance(value, list) else [None]
    tables = tuple(row for row in rows if isinstance(row, Mapping))
    if len(tables) < len(rows):
        raise _UnfitError(f"must be an array of tables, each written [[{field.name}]]")
    return tables


_READERS: dict[Kind, Callable[[object, Field], object]] = {
    "name": _read_name,
    "text": _read_text,
    "number": _read_number,
    "integer": _read_integer,
    "flag": _read_flag,
    "impedance": _read_impedance,
    "range": _read_range,
    "numbers": _read_numbers,
    "integers": _read_integers,
    "matrix": _read_matrix,
    "phases": _read_phases,
    "table": _read_table,
    "tables": _read_tables,
}

_STAND_INS: dict[Kind, object] = {
    "name": "",
    "text": "",
    "number": 1.0,
    "integer": 1,
    "flag": False,
    "impedance": 1.0 + 0.0j,
    "range": (0.0, 1.0),
    "numbers": (),
    "integers": (),
    "matrix": ((1.0,),),
    "phases": "abc",
    "table": None,
    "tables": (),
}


def _stand_in(field: Field) -> object:
    if field.kind in ("numbers", "integers") and field.count is not None:
        return (0,) * field.count
    return field.choices[0] if field.choices else _STAND_INS.get(field.kind)


def _finite(value: object) -> float | None:
    """Return an int or float as a finite float, None for anything else."""
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _complex(value: object) -> complex | None:
    """Return ``[r, x]`` or ``{ mag, deg }`` as a complex number, None for anything else."""
    if isinstance(value, list) and len(value) == 2:
        r, x = _finite(value[0]), _finite(value[1])
        return None if r is None or x is None else complex(r, x)
    if isinstance(value, Mapping) and set(value) == {"mag", "deg"}:
        mag, deg = _finite(value["mag"]), _finite(value["deg"])
        return None if mag is None or deg is None or mag < 0.0 else _polar(mag, deg)
    return None


def _polar(mag: float, deg: float) -> complex:
    """Return ``mag`` at ``deg`` degrees, exact at the right angles."""
    quarters, rest = divmod(deg, 90.0)
    if rest == 0.0:
        return complex(mag * (1, 1j, -1, -1j)[int(quarters) % 4])
    return complex(mag * math.cos(math.radians(deg)), mag * math.sin(math.radians(deg)))


def _check_bounds(number: float, field: Field, what: str) -> None:
    """Refuse a number outside the field's bounds; ``what`` says which number it is."""
    fits = (
        (field.low is None or number >= field.low)
        and (field.high is None or number <= field.high)
        and (field.above is None or number > field.above)
        and not (field.not_zero and number == 0.0)
    )
    if not fits:
        raise _UnfitError(f"must {what or 'be '}{bounds_of(field)}")
    if number != 0.0 and not LEAST <= abs(number) <= MOST:
        raise _UnfitError(f"must {what or 'be '}0, or {LEAST:g} to {MOST:g} of either sign")
