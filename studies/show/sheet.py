"""The settings sheet: a table for people, and the CSV that other verbs read back."""

from __future__ import annotations

import csv
import io
import math
import textwrap
from collections.abc import Sequence
from typing import Any

__all__ = [
    "PAGE",
    "setting_text",
    "settings_csv",
    "sheet_table",
    "table_lines",
    "terminal_name",
    "wrapped",
]

PAGE = 100  #: columns of everything that is printed for people
GAP = "  "


def terminal_name(row: dict[str, Any]) -> str:
    """The terminal a row of the result speaks of, as ``Terminal.name`` has it."""
    return f"{row['local']}→{row['remote']}"


def setting_text(value: float) -> str:
    """A setting exactly as the device holds it: the shortest decimal, without float dust.

    Examples
    --------
    >>> setting_text(0.15), setting_text(0.05 * 100.0), setting_text(0.1 + 0.2)
    ('0.15', '5', '0.3')
    """
    return f"{value:.10g}"


def settings_csv(result: dict[str, Any]) -> str:
    """One row per terminal, the scalar keys of its JSON as columns."""
    rows = result["sections"]
    columns = [key for key in rows[0] if not isinstance(rows[0][key], list | dict)]
    columns = [key for key in columns if key != "nearest_false_trip"]
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow(["" if row[key] is None else row[key] for key in columns])
    return buffer.getvalue()


def sheet_table(result: dict[str, Any]) -> str:
    """The sheet in at most 100 columns, the reasons and the comparison under it."""
    lines = [
        *wrapped(
            f"{result['feeder']}: settings, seed {result['seed']}, attempt {result['attempt']}; "
            "false-trip bounds of all terminals together at "
            f"{result['confidence']:.0%} confidence"
        ),
        "",
        *table_lines(
            ("terminal", "status"),
            ("I_set A", "V_set %", "Z_set Ω", "margin", "found", "false trips", "bound"),
            [_setting_row(row) for row in result["sections"]],
        ),
        "",
    ]
    blind = ", ".join(
        f"{terminal_name(row)} {row['unreachable']} of {row['opens']}"
        for row in result["sections"]
        if row["unreachable"]
    )
    lines += wrapped(
        "found: internal breaks with something connected beyond them. Breaks with nothing "
        f"beyond them cannot be seen: {blind or 'none'}."
    )
    lines += wrapped(
        "bound: upper bound of the probability of a false trip in one event, worst class. "
        "It covers load steps, source steps and breaks elsewhere; report.html says what it "
        "does not cover."
    )
    reasons = [
        line
        for row in result["sections"]
        if (reason := _reservation(row))
        for line in wrapped(f"{GAP}{terminal_name(row)}: {reason}")
    ]
    if reasons:
        lines += ["", "reasons", *reasons]
    if result["compared"]:
        lines += [
            "",
            *table_lines(
                ("compared", "setting"),
                ("I_set A", "V_set %", "Z_set Ω", "found (interval)", "false trips", "bound"),
                [_compared_row(row) for row in result["compared"]],
            ),
        ]
    return "\n".join(lines)


Row = tuple[Sequence[str], Sequence[str] | str]


def table_lines(key_heads: Sequence[str], heads: Sequence[str], rows: Sequence[Row]) -> list[str]:
    """A table of at most 100 columns: keys to the left, numbers to the right, under their heads.

    Parameters
    ----------
    key_heads
        Over the keys, which are aligned to the left. Where a row would be too long, its keys
        stand on a line of their own above its numbers.
    heads
        Over the numbers.
    rows
        Keys and numbers of each row; a text instead of the numbers runs on below itself.
    """
    numbers = [cells for _, cells in rows if not isinstance(cells, str)]
    key_wide = [max(map(len, own)) for own in zip(key_heads, *(k for k, _ in rows), strict=True)]
    wide = [max(map(len, own)) for own in zip(heads, *numbers, strict=True)]
    left = sum(key_wide) + len(GAP) * len(key_wide)
    beside = left + sum(wide) + len(GAP) * (len(wide) - 1) <= PAGE
    indent = " " * left if beside else GAP
    lines = []
    for keys, cells in ((key_heads, heads), *rows):
        begin = GAP.join(f"{key:<{w}}" for key, w in zip(keys, key_wide, strict=True)).rstrip()
        if isinstance(cells, str):
            below = textwrap.wrap(cells, PAGE - len(indent)) or [""]
        else:
            below = [GAP.join(f"{cell:>{w}}" for cell, w in zip(cells, wide, strict=True))]
        if beside:
            lines.append((f"{begin:<{left}}" + below.pop(0)).rstrip())
        else:
            lines += wrapped(GAP.join(keys)) if len(begin) > PAGE else [begin]
        lines += [indent + line for line in below]
    return lines


def wrapped(text: str) -> list[str]:
    """A paragraph in lines of at most 100 columns, all but the first indented."""
    begin = text[: len(text) - len(text.lstrip())]
    return textwrap.wrap(text.lstrip(), PAGE, initial_indent=begin, subsequent_indent=begin + GAP)


def _setting_row(row: dict[str, Any]) -> Row:
    keys = (terminal_name(row), row["status"])
    if row["i_set_a"] is None:
        return keys, row["reason"]
    return keys, (
        *_settings(row),
        "∞" if row["margin"] is None else f"{row['margin']:.2f}",
        _share(row["detected"], row["opens"] - row["unreachable"]),
        _of(row["false_trips"], row["security_trials"]),
        f"{row['false_trip_upper']:.1e}",
    )


def _compared_row(row: dict[str, Any]) -> Row:
    keys = (terminal_name(row), row["name"].replace("reference V_set", "ref. V_set"))
    if row["i_set_a"] is None:
        return keys, row["reason"]
    reachable = row["opens"] - row["unreachable"]
    share = row["detected"] / reachable if reachable else 0.0
    # outwards, as in the report
    low = math.floor(row["dependability_low"] * 1000.0) / 1000.0
    high = math.ceil(row["dependability_high"] * 1000.0) / 1000.0
    return keys, (
        *_settings(row),
        f"{share:.3f} {low:.3f}..{high:.3f}",
        _of(row["false_trips"], row["trials"]),
        f"{row['upper']:.1e}",
    )


def _settings(row: dict[str, Any]) -> tuple[str, str, str]:
    values = (row["i_set_a"], row["v_set_pu"] * 100.0, row["z_set_ohm"])
    i_set, v_set, z_set = map(setting_text, values)
    return i_set, v_set, z_set


def _reservation(row: dict[str, Any]) -> str:
    """What the table leaves unsaid of a row: why it falls short, or what weakens it."""
    reason = str(row["reason"])
    if row["status"] == "set":
        # the first clause repeats the numbers of the table
        return reason.partition("; ")[2]
    return reason if row["i_set_a"] is not None else ""


def _share(k: int, n: int) -> str:
    return f"{k / n:.3f} of {n}" if n else "none to find"


def _of(k: int, n: int) -> str:
    return f"{k} of {n}"
