"""The settings sheet: a table for people, and the CSV that other verbs read back."""

from __future__ import annotations

import csv
import io
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
    confidence = result["confidence"]
    lines = [
        f"{result['feeder']}: settings, seed {result['seed']}, attempt {result['attempt']}; "
        f"all bounds together at {confidence:.0%} confidence",
        "",
        f"{'terminal':<10}{'status':<15}{'I_set A':>8}{'V_set %':>8}{'Z_set Ω':>8}{'margin':>8}"
        f"{'found':>16}{'false trips':>15}{'bound':>9}",
    ]
    for row in result["sections"]:
        name = f"{row['local']}→{row['remote']}"
        if row["i_set_a"] is None:
            lines.append(f"{name:<10}{row['status']:<15}{row['reason'][:75]}")
            continue
        lines.append(
            f"{name:<10}{row['status']:<15}{row['i_set_a']:>8.1f}{row['v_set_pu'] * 100:>8.1f}"
            f"{row['z_set_ohm']:>8.1f}{_margin(row['margin']):>8}"
            f"{_share(row['detected'], row['opens'] - row['unreachable']):>16}"
            f"{_of(row['false_trips'], row['security_trials']):>15}"
            f"{row['false_trip_upper']:>9.1e}"
        )
    lines += [
        "",
        "found: internal breaks with something connected beyond them; others cannot be seen:",
        "  "
        + ", ".join(
            f"{row['local']}→{row['remote']} {row['unreachable']} of {row['opens']}"
            for row in result["sections"]
            if row["opens"]
        ),
        "bound: upper bound of the false-trip probability per event, worst class",
        "",
        f"{'compared':<10}{'':<25}{'I_set A':>8}{'V_set %':>8}{'Z_set Ω':>8}"
        f"{'found (interval)':>21}{'false trips':>15}",
    ]
    for row in result["compared"]:
        name = f"{row['local']}→{row['remote']}"
        if row["i_set_a"] is None:
            lines.append(f"{name:<10}{row['name']:<25}{'no setting keeps the margin':>30}")
            continue
        interval = f"{row['dependability_low']:.3f}..{row['dependability_high']:.3f}"
        lines.append(
            f"{name:<10}{row['name']:<25}{row['i_set_a']:>8.1f}{row['v_set_pu'] * 100:>8.1f}"
            f"{row['z_set_ohm']:>8.1f}{interval:>21}{_of(row['false_trips'], row['trials']):>15}"
        )
    return "\n".join(lines)


def _margin(value: float | None) -> str:
    return "∞" if value is None else f"{value:.2f}"


def _share(k: int, n: int) -> str:
    return f"{k / n:.3f} of {n}" if n else "-"


def _of(k: int, n: int) -> str:
    return f"{k} of {n}"
