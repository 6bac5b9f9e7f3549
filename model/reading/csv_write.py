"""Tables of a feeder file as CSV text, so that they read back exactly."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence

from .csv_table import ways_of
from .fields import Field

__all__ = ["csv_text"]


def csv_text(rows: Sequence[Mapping[str, object]], fields: Sequence[Field]) -> str:
    r"""Return the rows of a table as CSV, with the columns that any of them needs.

    Examples
    --------
    >>> fields = [
    ...     Field(name=name, kind=kind, doc="")
    ...     for name, kind in (("name", "name"), ("z_ohm", "impedance"), ("kw", "number"))
    ... ]
    >>> csv_text([{"name": "A", "z_ohm": [0.1, 0.5]}, {"name": "B"}], fields)
    'name,z_ohm.r,z_ohm.x\nA,0.1,0.5\nB,,\n'
    """
    used = [own for own in fields if any(own.name in row for row in rows)]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    # an impedance is written as its two parts: polar ones would not read back exactly
    columns = {own.name: ways_of(own)[-1] for own in used}
    writer.writerow([column for own in used for column in columns[own.name]])
    for row in rows:
        cells: list[str] = []
        for own in used:
            value = row.get(own.name)
            parts = value if isinstance(value, list) else [value] * len(columns[own.name])
            cells += [_cell(part) for part in parts]
        writer.writerow(cells)
    return out.getvalue()


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(float(value)) if isinstance(value, float) else str(value)
