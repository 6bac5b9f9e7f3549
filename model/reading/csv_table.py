"""CSV tables: the rows of a table of a feeder file, a column for each field.

Cells become the values that TOML would give, so that both pass the same checks. What is
wrong with the file itself is reported here, and its cells where every table is checked.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from ..errors import KeyPath, Report
from .fields import Field, describe_field, did_you_mean
from .table_check import REPORTED, reason

__all__ = ["CsvTable", "columns_of", "parse_csv", "ways_of"]

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE)
_INTEGER = re.compile(r"[+-]?\d{1,300}")
_POLAR, _RECTANGULAR = ("mag", "deg"), ("r", "x")


@dataclass(slots=True, kw_only=True)
class CsvTable:
    """A table as its cells say it, and where each row stands.

    Parameters
    ----------
    rows
        Values by field; a field that a row leaves empty is not in it.
    lines
        Line of the table (its column names), of the columns and of the rows, by key path.
    faults
        Key path, rule and what was found, of faults of the file itself.
    """

    rows: list[dict[str, object]] = field(default_factory=list)
    lines: dict[KeyPath, int] = field(default_factory=dict)
    faults: list[tuple[KeyPath, str, str | None]] = field(default_factory=list)

    def report(self, report: Report) -> None:
        """Hand the faults on, once the report knows where the rows stand."""
        for path, wanted, found in self.faults:
            report.add(path, wanted, found)


def ways_of(own: Field) -> tuple[tuple[str, ...], ...]:
    """Return the columns of a field, all of them needed; several ways where there is a choice.

    Examples
    --------
    >>> ways_of(Field(name="z_ohm", kind="impedance", doc=""))
    (('z_ohm.mag', 'z_ohm.deg'), ('z_ohm.r', 'z_ohm.x'))
    >>> ways_of(Field(name="ab", kind="numbers", count=2, doc=""))
    (('ab.1', 'ab.2'),)
    """
    if own.kind == "impedance":
        ways: tuple[Sequence[str], ...] = (_POLAR, _RECTANGULAR)
    elif own.kind in ("numbers", "integers") and own.count is not None:
        ways = ([str(n + 1) for n in range(own.count)],)
    else:
        return ((own.name,),)
    return tuple(tuple(f"{own.name}.{part}" for part in way) for way in ways)


def columns_of(fields: Sequence[Field]) -> dict[str, Field]:
    """Return the columns a table may have, and the field of each.

    Examples
    --------
    >>> list(columns_of([Field(name="z_ohm", kind="impedance", doc="")]))
    ['z_ohm.mag', 'z_ohm.deg', 'z_ohm.r', 'z_ohm.x']
    """
    return {column: own for own in fields for way in ways_of(own) for column in way}


def parse_csv(
    text: str,
    table: str,
    fields: Sequence[Field],
    refused: Sequence[tuple[str, str]] = (),
) -> CsvTable:
    r"""Return the table in a CSV text, whose first line names the columns.

    Parameters
    ----------
    text
        Cells separated by commas, in double quotes where they hold any.
    table
        Name of the table in the feeder file.
    fields
        The fields of its rows.
    refused
        Pairs ``(pattern, why)`` of columns that the model cannot represent.

    Examples
    --------
    >>> kw = Field(name="kw", kind="number", required=True, doc="")
    >>> parse_csv("kw\n120\n", "loads", [kw]).rows
    [{'kw': 120}]
    """
    lines, broken = _read_lines(text)
    number, head = lines[0] if lines else (1, [])
    head = _without_tail(head, 0)
    found = CsvTable(lines={(table,): number})
    if head and not _is_separated(head, table, found):
        return _unread(found, fields)
    if head:
        _check_head(head, table, fields, refused, found)
        _fill(lines[1:], head, table, fields, found)
    elif broken is None:
        found.faults.append(((table,), "must begin with a line that names the columns", None))
        return _unread(found, fields)
    if broken is not None:
        path = (table, len(found.rows))
        found.lines[path], wanted = broken
        found.faults.append((path, wanted, None))
        return _unread(found, fields)
    return found


def _is_separated(head: Sequence[str], table: str, found: CsvTable) -> bool:
    """Report column names that something else than commas stands between."""
    wrong = re.search("[;\t]", head[0]) if len(head) == 1 else None
    if wrong:
        mark = "semicolons" if wrong[0] == ";" else "tabs"
        found.faults.append(((table,), "must have its columns separated by commas", mark))
    return wrong is None


def _fill(
    lines: Sequence[tuple[int, list[str]]],
    head: Sequence[str],
    table: str,
    fields: Sequence[Field],
    found: CsvTable,
) -> None:
    """Add the rows that the lines below the column names hold; lines without text hold none."""
    absent = [own.name for own in fields if not _is_whole(head, own)]
    columns = columns_of(fields)
    for number, line in lines:
        cells = _without_tail(line, len(head))
        if not any(cells):
            continue
        path = (table, len(found.rows))
        found.lines[path] = number
        if len(cells) == len(head):
            row = {**_row(head, cells, columns), **dict.fromkeys(absent, REPORTED)}
            for name, value in row.items():
                if isinstance(value, _Cells):
                    row[name] = _joined(value, (*path, name), found)
            found.rows.append(row)
        else:
            rule = f"must have {len(head)} cells, as many as there are columns"
            found.faults.append((path, rule, str(len(cells))))
            _unread(found, fields)


def _read_lines(text: str) -> tuple[list[tuple[int, list[str]]], tuple[int, str] | None]:
    """Return each line's number and cells, trimmed; and where and why reading ended early."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    lines: list[tuple[int, list[str]]] = []
    number = 1
    try:
        for cells in reader:
            lines.append((number, [cell.strip() for cell in cells]))
            number = reader.line_num + 1
    except csv.Error as error:
        return lines, (number, f"is not valid CSV: {error}")
    return lines, None


def _without_tail(cells: list[str], least: int) -> list[str]:
    """Return the cells without empty ones at the end, as spreadsheets add them."""
    end = len(cells)
    while end > least and not cells[end - 1]:
        end -= 1
    return cells[:end]


def _unread(found: CsvTable, fields: Sequence[Field]) -> CsvTable:
    """Put one row of stand-ins, so that nothing is called missing that was not read."""
    found.rows.append({own.name: REPORTED for own in fields})
    return found


def _has(head: Sequence[str], own: Field) -> bool:
    """Whether any column speaks of the field, rightly or not."""
    return any(column.partition(".")[0] == own.name for column in head)


def _is_whole(head: Sequence[str], own: Field) -> bool:
    """Whether the field has the columns it needs, or none and may have none."""
    if not _has(head, own):
        return not own.required
    begun = [way for way in ways_of(own) if any(column in head for column in way)]
    return len(begun) == 1 and all(column in head for column in begun[0])


def _check_head(
    head: Sequence[str],
    table: str,
    fields: Sequence[Field],
    refused: Sequence[tuple[str, str]],
    found: CsvTable,
) -> None:
    """Report columns that are unknown, doubled, halved, nameless or missing."""
    columns = columns_of(fields)
    parted = {own.name: ways_of(own) for own in fields if len(ways_of(own)[0]) > 1}

    def fault(column: str, rule: str, text: str | None = None) -> None:
        path = (table, column) if column else (table,)
        found.lines[path] = found.lines[table,]
        found.faults.append((path, rule, text))

    for index, column in enumerate(head):
        if not column:
            fault("", "must have a name for every column", f"none for column {index + 1}")
        elif column in head[:index]:
            fault(column, "must stand in one column only")
        elif column in parted:
            rule = f"must be {_count(parted[column][0])} columns, {_listed(parted[column][0])}"
            fault(column, rule)
        elif column not in columns:
            why = reason(column, refused)
            fault(
                column,
                f"is not a known column{f': {why}' if why else did_you_mean(column, columns)}",
            )
    for own in fields:
        _check_parts(head, own, fault)
        if own.required and not _has(head, own):
            fault(own.name, f"is missing, a column ({describe_field(own)})")


def _check_parts(head: Sequence[str], own: Field, fault: Callable[[str, str], None]) -> None:
    """Report a field of several columns that has some of them, or those of two ways."""
    begun = [way for way in ways_of(own) if any(column in head for column in way)]
    if len(begun) > 1:
        first, second = (next(c for c in way if c in head) for way in begun)
        fault(second, f"must be left out beside {first}")
        return
    for way in begun:
        lacking = [column for column in way if column not in head]
        if lacking:
            there = next(column for column in way if column in head)
            what = "column" if len(lacking) == 1 else "columns"
            fault(there, f"must have the {what} {_listed(lacking)} beside it")


_COUNTS = {2: "two", 3: "three", 6: "six"}


def _count(items: Sequence[str]) -> str:
    return _COUNTS.get(len(items), str(len(items)))


def _listed(items: Sequence[str]) -> str:
    """Return ``a, b and c``."""
    return " and ".join(filter(None, (", ".join(items[:-1]), items[-1])))


@dataclass(slots=True, kw_only=True)
class _Cells:
    """The cells of one field that has several columns."""

    own: Field
    by_column: dict[str, object] = field(default_factory=dict)


def _row(
    head: Sequence[str], cells: Sequence[str], columns: Mapping[str, Field]
) -> dict[str, object]:
    """Return the values of a row; empty cells and unknown columns have none."""
    row: dict[str, object] = {}
    for column, cell in zip(head, cells, strict=True):
        if cell and column in columns:
            own = columns[column]
            if column == own.name:
                row[own.name] = _value(cell, own)
            else:
                parts = row.setdefault(own.name, _Cells(own=own))
                assert isinstance(parts, _Cells)
                parts.by_column[column] = _value(cell, own)
    return row


def _joined(cells: _Cells, path: KeyPath, found: CsvTable) -> object:
    """Return the value that several cells make, as TOML would give it."""
    there = cells.by_column
    way = next(way for way in ways_of(cells.own) if not there.keys().isdisjoint(way))
    if any(column not in there for column in way):
        both = "both" if len(way) == 2 else "all"
        found.faults.append((path, f"must have {both} cells, {_listed(way)}, or none", None))
        return REPORTED
    if way == ways_of(cells.own)[0] and cells.own.kind == "impedance":
        return {part: there[f"{cells.own.name}.{part}"] for part in _POLAR}
    return [there[column] for column in way]


def _value(cell: str, own: Field) -> object:
    """Return a cell as TOML would give it; as text where it is no value of the field's kind."""
    if own.kind in ("number", "numbers", "integer", "integers", "impedance"):
        if _INTEGER.fullmatch(cell):
            return int(cell)
        return float(cell) if _NUMBER.fullmatch(cell) else cell
    if own.kind == "flag":
        flags: Mapping[str, bool] = {"true": True, "false": False}
        return flags.get(cell.lower(), cell)
    return cell
