"""How the rows of a user's table and the parts of a feeder found each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..show.sheet import wrapped

__all__ = ["Match", "by_name", "match_json", "match_text"]

MOST_SHOWN = 12  #: names or rows of a kind that are printed; JSON has them all


@dataclass(frozen=True, slots=True, kw_only=True)
class Match:
    """What became of every row of a table.

    Parameters
    ----------
    source
        The table.
    what
        What its rows are about, in the plural.
    joined
        Names of the parts that found their row.
    not_joined
        Rows that found no part, and why.
    without_row
        Names of the parts that the table says nothing of.
    notes
        Whatever else should be known, in sentences.
    """

    source: str
    what: str
    joined: tuple[str, ...]
    not_joined: tuple[tuple[str, str], ...]
    without_row: tuple[str, ...]
    notes: tuple[str, ...] = ()


def by_name(names: Sequence[str], wanted: str) -> str | None:
    """Return that of the names which is ``wanted``, else the only one but for its case.

    Examples
    --------
    >>> by_name(["R1", "r2"], "R2")
    'r2'
    """
    if wanted in names:
        return wanted
    same = [name for name in names if name.lower() == wanted.lower()]
    return same[0] if len(same) == 1 else None


def match_json(match: Match) -> dict[str, Any]:
    """Return what a report keeps of it."""
    return {
        "source": match.source,
        "what": match.what,
        "joined": list(match.joined),
        "not_joined": [{"row": row, "why": why} for row, why in match.not_joined],
        "without_row": list(match.without_row),
        "notes": list(match.notes),
    }


def match_text(match: Match) -> list[str]:
    """Return it in lines for people; long lists are cut short."""
    rows = len(match.joined) + len(match.not_joined)
    lines = wrapped(
        f"{match.source}: {len(match.joined)} of {rows} rows joined with {match.what}, "
        f"{len(match.not_joined)} not joined; {len(match.without_row)} {match.what} without a row"
    )
    for row, why in match.not_joined[:MOST_SHOWN]:
        lines += wrapped(f"- not joined: {row}: {why}")
    if len(match.not_joined) > MOST_SHOWN:
        lines.append(f"- and {len(match.not_joined) - MOST_SHOWN} more rows not joined")
    if match.without_row:
        shown = ", ".join(match.without_row[:MOST_SHOWN])
        more = len(match.without_row) - MOST_SHOWN
        lines += wrapped(f"- without a row: {shown}{f' and {more} more' if more > 0 else ''}")
    for note in match.notes:
        lines += wrapped(f"- {note}")
    return lines
