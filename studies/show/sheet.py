"""The settings sheet: a table for people, and the CSV that other verbs read back."""

from __future__ import annotations

import csv
import io
import textwrap
from typing import Any

__all__ = ["settings_csv", "sheet_table"]


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
    """The sheet in at most 100 columns, and the comparison under it."""
    wide = max(8, *(len(_name(row)) for row in result["sections"])) + 2
    lines = [
        f"{result['feeder']}: settings, seed {result['seed']}, attempt {result['attempt']}; "
        f"false-trip bounds of all terminals together at {result['confidence']:.0%} confidence",
        "",
        f"{'terminal':<{wide}}{'status':<14}{'I_set A':>8}{'V_set %':>8}{'Z_set Ω':>8}{'margin':>8}"
        f"{'found':>16}{'false trips':>16}{'bound':>9}",
    ]
    lines += [_setting_row(row, wide) for row in result["sections"]]
    blind = ", ".join(
        f"{_name(row)} {row['unreachable']} of {row['opens']}"
        for row in result["sections"]
        if row["unreachable"]
    )
    lines += [
        "",
        *_wrapped(
            "found: internal breaks with something connected beyond them. Breaks with nothing "
            f"beyond them cannot be seen: {blind or 'none'}."
        ),
        *_wrapped(
            "bound: upper bound of the probability of a false trip in one event, worst class. "
            "It covers load steps, source steps and breaks elsewhere; report.html says what it "
            "does not cover."
        ),
        "",
        f"{'compared':<{wide}}{'':<23}{'I_set A':>8}{'V_set %':>8}{'Z_set Ω':>8}"
        f"{'found (interval)':>18}{'false trips':>16}",
    ]
    lines += [_compared_row(row, wide) for row in result["compared"]]
    return "\n".join(lines)


def _setting_row(row: dict[str, Any], wide: int) -> str:
    head = f"{_name(row):<{wide}}{row['status']:<14}"
    if row["i_set_a"] is None:
        return head + str(row["reason"])[: 100 - len(head)]
    return (
        f"{head}{row['i_set_a']:>8.1f}{row['v_set_pu'] * 100:>8.1f}"
        f"{row['z_set_ohm']:>8.1f}{_margin(row['margin']):>8}"
        f"{_share(row['detected'], row['opens'] - row['unreachable']):>16}"
        f"{_of(row['false_trips'], row['security_trials']):>16}"
        f"{row['false_trip_upper']:>9.1e}"
    )


def _compared_row(row: dict[str, Any], wide: int) -> str:
    head = f"{_name(row):<{wide}}{row['name']:<23}"
    if row["i_set_a"] is None:
        return f"{head}no setting keeps the margin"
    interval = f"{row['dependability_low']:.3f}..{row['dependability_high']:.3f}"
    return (
        f"{head}{row['i_set_a']:>8.1f}{row['v_set_pu'] * 100:>8.1f}"
        f"{row['z_set_ohm']:>8.1f}{interval:>18}{_of(row['false_trips'], row['trials']):>16}"
    )


def _name(row: dict[str, Any]) -> str:
    return f"{row['local']}→{row['remote']}"


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, 98, subsequent_indent="  ")


def _margin(value: float | None) -> str:
    return "∞" if value is None else f"{value:.2f}"


def _share(k: int, n: int) -> str:
    return f"{k / n:.3f} of {n}" if n else "none to find"


def _of(k: int, n: int) -> str:
    return f"{k} of {n}"
