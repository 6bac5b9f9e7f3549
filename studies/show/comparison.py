"""The comparison of runs as a table for people, in at most 100 columns."""

from __future__ import annotations

import math
from typing import Any

from ...detector.criteria import Reason
from .sheet import Row, class_words, row_name, setting_text, table_lines, wrapped

__all__ = ["comparison_text"]

MOST_CLASSES = 6  #: classes listed per terminal; all are in the JSON


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
    tables = (
        (
            ("terminal", "run"),
            ("I_set A", "V_set %", "Z_set Ω", "status", "found", "false trips"),
            [_setting_row(named, letter) for named in rows for letter in "ab"],
        ),
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
    for table in tables:
        lines += ["", *table_lines(*table)]
    for title, texts in (
        ("false trips by class", map(_classes, rows)),
        ("breaks gained and lost, by what the other run misses them for", map(_causes, rows)),
    ):
        said = [line for text in texts if text for line in wrapped(f"  {text}")]
        if said:
            lines += ["", title, *said]
    return lines


def _run(run: dict[str, Any]) -> str:
    return f"{run['run']} ({run['verb']}, settings {run['settings']})"


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
    if row["difference"] is None:
        return (name,), (*counts, "–", "–")
    low, high = row["difference_low"], row["difference_high"]
    interval = f"{math.floor(low * 1000) / 1000:+.3f}..{math.ceil(high * 1000) / 1000:+.3f}"
    return (name,), (*counts, f"{row['difference']:+.3f}", interval)


def _false_row(named: Named) -> Row:
    name, row = named
    counts = (row["false_trips"][key] for key in ("both", "only_a", "only_b"))
    return (name,), (*map(str, counts), str(row["security_trials"]))


def _classes(named: Named) -> str:
    """The classes that must not trip and in which one run at least did, the worst first."""
    name, row = named
    bad = [
        own
        for own in row["classes"]
        if own["kind"] == "must_not_trip" and (own["both"] or own["only_a"] or own["only_b"])
    ]
    if not bad:
        return ""
    bad.sort(key=lambda own: -(own["both"] + own["only_a"] + own["only_b"]) / max(own["trials"], 1))
    said = [f"{_of_class(own)} of {own['trials']} {class_words(own)}" for own in bad[:MOST_CLASSES]]
    more = len(bad) - MOST_CLASSES
    return f"{name}: {'; '.join(said)}{f'; and {more} more classes' if more > 0 else ''}"


def _of_class(own: dict[str, Any]) -> str:
    """Who trips how often; what is zero is left out."""
    words = {"both": "both", "only_a": "only A", "only_b": "only B"}
    return ", ".join(f"{own[key]} {name}" for key, name in words.items() if own[key])


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
