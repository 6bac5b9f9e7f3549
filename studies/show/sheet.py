"""The settings sheet: a table for people, and the CSV that other verbs read back."""

from __future__ import annotations

import csv
import io
import math
import textwrap
from collections.abc import Sequence
from typing import Any

from ..run.classes import REPORTED

__all__ = [
    "PAGE",
    "Row",
    "class_words",
    "row_name",
    "setting_text",
    "settings_csv",
    "sheet_table",
    "table_lines",
    "terminal_name",
    "wrapped",
]

PAGE = 100  #: columns of everything that is printed for people
GAP = "  "
UNSETTLED = (
    "Of these a break counts as missed; another event is judged by where its loads had got to."
)
MOST_CLASSES = 6  #: classes with trips that are listed per terminal

WORDS = {(own.name, own.side): own.words for own in REPORTED}


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
    """The sheet in at most 100 columns, by group; the classes and the comparison under it."""
    rows = result["sections"]
    lines = _title(result)
    for group, own in _by_group(rows):
        lines += ["", *_group_head(group, rows), *_setting_table(own, "assessed" in result)]
    lines += ["", *_legend(rows), *_impedances(rows)]
    several = len(_by_group(rows)) > 1
    blocks = {
        "false trips by class": [(row, _false_trips(row)) for row in rows],
        "reasons": [(row, _reservation(row)) for row in rows],
    }
    for title, texts in blocks.items():
        said = [
            line
            for row, text in texts
            if text
            for line in wrapped(f"{GAP}{row_name(row, several)}: {text}")
        ]
        if said:
            lines += ["", title, *said]
    lines += _apart(rows, several)
    lines += _unsettled(result["numerics"])
    if {row["name"] for row in result["compared"]} - {"assessed"}:
        for group, own in _by_group(result["compared"]):
            lines += ["", *_group_head(group, rows), *_comparison(own)]
    return "\n".join(lines)


def row_name(row: dict[str, Any], several: bool) -> str:
    """A row's terminal, with its group where there are ``several``."""
    return f"{terminal_name(row)} {row['setting_group']}" if several else terminal_name(row)


def _by_group(rows: list[dict[str, Any]]) -> list[tuple[str, list[dict[str, Any]]]]:
    names = dict.fromkeys(row["setting_group"] for row in rows)
    return [(name, [row for row in rows if row["setting_group"] == name]) for name in names]


def _title(result: dict[str, Any]) -> list[str]:
    """What the sheet is, and what has to be said of where its settings come from."""
    assessed = result.get("assessed")
    what = f"assessment of {assessed['settings']}" if assessed else "settings"
    lines = wrapped(
        f"{result['feeder']}: {what}, seed {result['seed']}, attempt {result['attempt']}; "
        f"false-trip bounds of all terminals together at {result['confidence']:.0%} confidence"
    )
    return lines + (wrapped(f"note: {assessed['note']}") if assessed and assessed["note"] else [])


def _group_head(name: str, rows: list[dict[str, Any]]) -> list[str]:
    return wrapped(f"setting group {name}") if len(_by_group(rows)) > 1 else []


def _setting_table(rows: list[dict[str, Any]], assessed: bool) -> list[str]:
    """The settings and what they are worth; what is assessed has no margin that is known."""
    heads: tuple[str, ...] = (
        "I_set A",
        "V_set %",
        "Z_set Ω",
        "margin",
        "found",
        "false trips",
        "bound",
    )
    cells = [_setting_row(row) for row in rows]
    if assessed:
        at = heads.index("margin")
        heads = heads[:at] + heads[at + 1 :]
        cells = [
            (keys, own if isinstance(own, str) else (*own[:at], *own[at + 1 :]))
            for keys, own in cells
        ]
    return table_lines(("terminal", "status"), heads, cells)


def _legend(rows: list[dict[str, Any]]) -> list[str]:
    several = len(_by_group(rows)) > 1
    blind = ", ".join(
        f"{row_name(row, several)} {row['unreachable']} of {row['opens']}"
        for row in rows
        if row["unreachable"]
    )
    lines = wrapped(
        "found: internal breaks with something connected beyond them. Breaks with nothing "
        f"beyond them cannot be seen: {blind or 'none'}."
    )
    bounded = [
        (own["upper"], row, own)
        for row in rows
        for own in row["classes"]
        if own["kind"] == "must_not_trip" and own["upper"] is not None
    ]
    kinds = {(own["name"], own["side"]) for _, _, own in bounded}
    worst = ""
    if bounded:
        _, row, own = max(bounded, key=lambda item: item[0])
        worst = f" Here the worst is {class_words(own)} at {row_name(row, several)}."
    return lines + wrapped(
        "bound: upper bound of the probability of a false trip in one event, the worst of "
        f"{len(kinds)} classes and sides that must not trip.{worst} report.html lists them all, "
        "and what they do not cover."
    )


def _impedances(rows: list[dict[str, Any]]) -> list[str]:
    """What Z_set must part: the line that harmless events show, and the breaks."""
    several = len(_by_group(rows)) > 1
    said = [
        f"{row_name(row, several)} {abs(complex(*row['line_z1_ohm'])):.3g} / "
        f"{setting_text(row['z_set_ohm'])} / {_ohm(row['least_z_op_ohm'])}"
        for row in rows
        if row["z_set_ohm"] is not None
    ]
    if not said:
        return []
    return wrapped(
        "Ω: |Z1| of the section's line, which harmless events show / Z_set / the smallest |Z1| of "
        f"the breaks that I_set and V_set leave to Z_set: {', '.join(said)}."
    )


def _ohm(value: float | None) -> str:
    return "no break" if value is None else f"{value:.3g}"


def class_words(own: dict[str, Any]) -> str:
    """A class of a result in a reader's words, in the plural."""
    return WORDS.get((own["name"], own["side"]), f"{own['name']} {own['side']}")


def _false_trips(row: dict[str, Any]) -> str:
    """The classes in which a setting trips falsely, the highest rate first."""
    bad = [own for own in row["classes"] if own["kind"] == "must_not_trip" and own["trips"]]
    bad.sort(key=lambda own: -own["trips"] / max(own["trials"], 1))
    said = [f"{own['trips']} of {own['trials']} {class_words(own)}" for own in bad[:MOST_CLASSES]]
    more = len(bad) - MOST_CLASSES
    return ", ".join([*said, f"and {more} more classes"] if more > 0 else said)


def _apart(rows: list[dict[str, Any]], several: bool) -> list[str]:
    """What is in neither count, inside the sections: the shares that trip, by terminal."""
    lines = []
    for row in rows:
        said = [
            f"{class_words(own)} {_apart_share(own)}"
            for own in row["classes"]
            if own["kind"] == "apart" and own["side"] == "inside" and own["trips"] is not None
        ]
        if said:
            lines += wrapped(f"{GAP}{row_name(row, several)}: {', '.join(said)}")
    if not lines:
        return []
    head = "told apart, in neither count: the share that trips, of wiring faults the share that"
    return ["", *wrapped(f"{head} raises the alarm"), *lines]


def _unsettled(numerics: dict[str, Any]) -> list[str]:
    """Scenarios without a solution, by class; nothing where there are none."""
    drawn = {own.drawn.name.lower(): own.drawn.words for own in REPORTED}
    said = [
        f"{own['not_converged']:,} of {own['scenarios']:,} {drawn[own['name']]}"
        for own in numerics["by_class"]
        if own["not_converged"]
    ]
    if training := numerics["training_not_converged"]:
        said.append(f"{training:,} scenarios of training")
    if not said:
        return []
    return ["", *wrapped(f"did not converge: {', '.join(said)}. {UNSETTLED}")]


def _apart_share(own: dict[str, Any]) -> str:
    share = _whole_percent(own.get("alarms", own["trips"]), own["trials"])
    return f"{share} of {own['trials']}"


def _whole_percent(k: int, n: int) -> str:
    """A share in percent, 0 and 100 only where it is that.

    Examples
    --------
    >>> _whole_percent(0, 9), _whole_percent(1, 900), _whole_percent(899, 900), _whole_percent(9, 9)
    ('0 %', '1 %', '99 %', '100 %')
    """
    if k in (0, n):
        return "100 %" if k else "0 %"
    return f"{min(max(round(100 * k / n), 1), 99)} %"


def _comparison(rows: list[dict[str, Any]]) -> list[str]:
    return table_lines(
        ("compared", "setting"),
        ("I_set A", "V_set %", "Z_set Ω", "found (interval)", "false trips", "bound"),
        [_compared_row(row) for row in rows],
    )


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
