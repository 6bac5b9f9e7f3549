"""Tables of the user's own, as spreadsheets write them: columns found by name, others ignored."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ...model.errors import Fault, InputError
from ...model.reading.fields import did_you_mean
from ...model.reading.toml_file import read_text

__all__ = ["OwnTable", "Row", "number_in", "read_table"]

_PLAIN = re.compile(r"[-+.0-9eE]+")

MOST_FAULTS = 20  #: of a file; with more it is another file than was meant
MOST_ROWS = 2_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """Cells by column, trimmed, and the line of the file where they stand."""

    line: int
    cells: Mapping[str, str]


@dataclass(slots=True, kw_only=True)
class OwnTable:
    """A table as its file has it, and the faults found so far.

    ``columns`` are in lower case, and ``spelled`` as the file spells them.
    """

    source: str
    columns: tuple[str, ...]
    spelled: tuple[str, ...]
    rows: list[Row]
    faults: list[Fault] = field(default_factory=list)

    @property
    def name(self) -> str:
        """The file without its folders."""
        return Path(self.source).name

    def fault(self, line: int | None, where: str, wanted: str, found: str | None = None) -> None:
        """Note something wrong with the file."""
        self.faults.append(
            Fault(source=self.source, line=line, where=where, wanted=wanted, found=found)
        )

    def raise_if_any(self) -> None:
        """Raise InputError with the faults in the order of their lines, if there are any."""
        if self.faults:
            ranked = sorted(self.faults, key=lambda fault: fault.line or 0)
            more = len(ranked) - MOST_FAULTS
            if more > 0:
                rule = f"has {more} more faults of such kinds"
                ranked = ranked[:MOST_FAULTS]
                ranked.append(Fault(source=self.source, line=None, where="", wanted=rule))
            raise InputError(ranked)

    def needs(self, *names: str) -> None:
        """Report columns that are missing."""
        for name in names:
            if name not in self.columns:
                hint = did_you_mean(name, self.columns)
                self.fault(1, f"column {name!r}", f"must be there{hint}")

    def others_than(self, known: Sequence[str]) -> tuple[str, ...]:
        """Columns that nothing is taken from."""
        return tuple(
            spelled
            for name, spelled in zip(self.columns, self.spelled, strict=True)
            if name not in known
        )


def read_table(path: Path) -> OwnTable:
    """Read a CSV file, whose first line names the columns.

    Raises
    ------
    InputError
        If it cannot be read, or its lines do not make a table.
    """
    reader = csv.reader(io.StringIO(read_text(path), newline=""), strict=True)
    lines: list[tuple[int, list[str]]] = []
    number = 1
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                lines.append((number, [cell.strip() for cell in cells]))
            number = reader.line_num + 1
            if len(lines) > MOST_ROWS:
                raise InputError.single(str(path), "", None, f"must have at most {MOST_ROWS} rows")
    except csv.Error as error:
        fault = Fault(source=str(path), line=number, where="", wanted=f"is not valid CSV: {error}")
        raise InputError([fault]) from error
    if not lines:
        rule = "must begin with a line that names the columns"
        raise InputError.single(str(path), "", "nothing", rule)
    head = lines[0][1]
    while head and not head[-1]:
        head.pop()
    table = OwnTable(
        source=str(path),
        columns=tuple(name.lower() for name in head),
        spelled=tuple(head),
        rows=[],
    )
    if len(head) == 1 and any(mark in head[0] for mark in ";\t"):
        table.fault(lines[0][0], "", "must have its columns separated by commas", head[0])
    for n, name in enumerate(table.columns):
        if not name:
            table.fault(lines[0][0], "", "must have a name for every column", f"none for {n + 1}")
        elif name in table.columns[:n]:
            table.fault(lines[0][0], f"column {name!r}", "must be there once")
    for at, cells in lines[1:]:
        _add_row(table, at, cells)
    if not table.rows and not table.faults:
        table.fault(None, "", "must have rows below the column names", "none")
    if table.faults:
        table.raise_if_any()
    return table


def _add_row(table: OwnTable, at: int, cells: list[str]) -> None:
    count = len(table.columns)
    if any(cells[count:]) or len(cells) < count:
        rule = f"must have {count} cells, as many as there are columns"
        table.fault(at, "", rule, str(len(cells)))
        return
    table.rows.append(Row(line=at, cells=dict(zip(table.columns, cells, strict=False))))


def number_in(table: OwnTable, row: Row, column: str, *, least: float = 0.0) -> float | None:
    """Return the number in a cell; None where it is empty, or is a fault, which is noted."""
    cell = row.cells.get(column, "")
    if not cell:
        return None
    try:
        number = float(cell) if _PLAIN.fullmatch(cell) else math.nan
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number >= least):
        table.fault(row.line, f"column {column!r}", f"must be a number >= {least:g}", repr(cell))
        return None
    return number
