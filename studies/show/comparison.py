"""The comparison of runs as a table for people, in at most 100 columns."""

from __future__ import annotations

import math
from typing import Any

from ...detector.criteria import Reason
from ..spec.parts import DetectorOptions
from .sheet import Row, class_words, row_name, setting_text, table_lines, wrapped

__all__ = ["comparison_text"]

MOST_ROWS = 40  #: classes and terminals with false trips that are listed; all are in the JSON
DEFAULT = DetectorOptions()


def comparison_text(result: dict[str, Any]) -> str:
    """All comparisons, one after another."""
    lines = wrapped(
        f"{result['feeder']}: runs compared on the same {result['scenarios']} scenarios at least "
        f"of every class and side, seed {result['seed']}, attempt {result['attempt']}; intervals "
        f"of all terminals together at {result['confidence']:.0%} confidence"
    )
    for own in result["comparisons"]:
        lines += ["", *_comparison(own, result["runs"])]
    return "\n".join(lines) + "\n"


Named = tuple[str, dict[str, Any]]  #: a terminal's name and its row


def _comparison(own: dict[str, Any], runs: list[dict[str, Any]]) -> list[str]:
    several = len({row["setting_group"] for row in own["sections"]}) > 1
    rows = [
        (row_name(row, several), row)
        for row in own["sections"]
        if row["a"]["i_set_a"] or row["b"]["i_set_a"]
    ]
    lines = [
        line for letter in "ab" for line in wrapped(f"{letter.upper()}: {_run(runs[own[letter]])}")
    ]
    if not rows:
        return [*lines, "", "neither run has a setting anywhere"]
    lines += ["", *_setting_lines(rows)]
    tables = (
        (
            ("breaks found by",),
            ("both", "only A", "only B", "neither", "B - A", "interval"),
            [_found_row(named) for named in rows],
        ),
        (
            ("false trips of",),
            ("both", "only A", "only B", "events"),
            [_false_row(named) for named in rows],
        ),
    )
    for heads_and_rows in tables:
        lines += ["", *table_lines(*heads_and_rows)]
    lines += _open_lines(rows) + _class_lines(rows)
    said = [line for text in map(_causes, rows) if text for line in wrapped(f"  {text}")]
    if said:
        lines += ["", "breaks gained and lost, by what the other run misses them for", *said]
    return lines


def _run(run: dict[str, Any]) -> str:
    return f"{run['run']} ({run['verb']}, settings {run['settings']})"


def _setting_lines(rows: list[Named]) -> list[str]:
    """The settings of both runs; options that are not the defaults as notes by number."""
    own = [(named, letter) for named in rows for letter in "ab"]
    texts = [_options(named[1][letter]) for named, letter in own]
    notes = {text: n for n, text in enumerate(dict.fromkeys(filter(None, texts)), 1)}
    heads: tuple[str, ...] = ("I_set A", "V_set %", "Z_set Ω", "status", "found", "false trips")
    cells = [_setting_row(named, letter) for named, letter in own]
    if notes:
        heads = (*heads, "options")
        marks = [f"({notes[text]})" if text else "default" for text in texts]
        cells = [
            (keys, values if isinstance(values, str) else (*values, mark))
            for (keys, values), mark in zip(cells, marks, strict=True)
        ]
    lines = table_lines(("terminal", "run"), heads, cells)
    return lines + [line for text, n in notes.items() for line in wrapped(f"options ({n}): {text}")]


def _options(own: dict[str, Any]) -> str:
    """All that a setting says beside its three numbers, where it is not the default."""
    if own["i_set_a"] is None:
        return ""
    said = [own["options"]] if own["options"] else []
    if own["negative_sign"] != DEFAULT.negative_sign:
        said.append(f"negative_sign={str(own['negative_sign']).lower()}")
    if own["dt_ms"] != DEFAULT.dt_ms:
        said.append(f"dt_ms={setting_text(own['dt_ms'])}")
    return "; ".join(said)


def _setting_row(named: Named, letter: str) -> Row:
    name, row = named
    own, keys = row[letter], (name, letter.upper())
    if own["i_set_a"] is None:
        return keys, f"no setting ({own['status']})"
    n = row["reachable"]
    return keys, (
        setting_text(own["i_set_a"]),
        setting_text(own["v_set_pu"] * 100.0),
        setting_text(own["z_set_ohm"]),
        own["status"],
        f"{own['detected'] / n:.3f} of {n}" if n else "none to find",
        f"{own['false_trips']} of {row['security_trials']}",
    )


def _found_row(named: Named) -> Row:
    name, row = named
    counts = [str(row[key]) for key in ("both", "only_a", "only_b", "neither")]
    if row["difference_low"] is None:
        return (name,), (*counts, "–", "–")
    low, high = row["difference_low"], row["difference_high"]
    interval = f"{math.floor(low * 1000) / 1000:+.3f}..{math.ceil(high * 1000) / 1000:+.3f}"
    return (name,), (*counts, f"{row['difference']:+.3f}", interval)


def _false_row(named: Named) -> Row:
    name, row = named
    counts = (row["false_trips"][key] for key in ("both", "only_a", "only_b"))
    return (name,), (*map(str, counts), str(row["security_trials"]))


def _class_lines(rows: list[Named]) -> list[str]:
    """Where one run at least trips falsely: class by class and terminal, the worst rate first."""
    bad = [
        (name, own)
        for name, row in rows
        for own in row["classes"]
        if own["kind"] == "must_not_trip" and _tripped(own)
    ]
    if not bad:
        return []
    bad.sort(key=lambda named: -_tripped(named[1]) / named[1]["trials"])
    table = table_lines(
        ("false trips by class", "terminal"),
        ("both", "only A", "only B", "events"),
        [_class_row(named) for named in bad[:MOST_ROWS]],
    )
    more = len(bad) - MOST_ROWS
    return ["", *table, *([f"and {more} more rows, which --json lists"] if more > 0 else [])]


def _open_lines(rows: list[Named]) -> list[str]:
    """Which open phases inside were gained and lost, those in disguise among them."""
    seen = [
        (name, own)
        for name, row in rows
        for own in row["classes"]
        if own["kind"] != "must_not_trip"
        and own["side"] == "inside"
        and own["name"] != "wiring"
        and (own["only_a"] or own["only_b"])
        and any(row[letter]["i_set_a"] is not None for letter in "ab")
    ]
    if not seen:
        return []
    keys = ("both", "only_a", "only_b", "trials")
    cells = [((class_words(own), name), [str(own[key]) for key in keys]) for name, own in seen]
    heads = ("open phases inside, that trip", "terminal")
    return ["", *table_lines(heads, ("both", "only A", "only B", "events"), cells)]


def _class_row(named: Named) -> Row:
    name, own = named
    keys = ("both", "only_a", "only_b", "trials")
    return (class_words(own), name), [str(own[key]) for key in keys]


def _tripped(own: dict[str, Any]) -> int:
    """Events of a class in which one run at least tripped."""
    return int(own["both"] + own["only_a"] + own["only_b"])


def _causes(named: Named) -> str:
    name, row = named
    said = [
        f"only {letter} finds {sum(cause['breaks'] for cause in causes)}: "
        + ", ".join(f"{cause['breaks']} {_criterion(cause['criterion'])}" for cause in causes)
        for letter, causes in (("B", row["gained"]), ("A", row["lost"]))
        if causes
    ]
    return f"{name}: {'; '.join(said)}" if said else ""


def _criterion(name: str) -> str:
    """Why a break is missed, in a reader's words."""
    return Reason[name.upper()].text if name.upper() in Reason.__members__ else "no setting"
