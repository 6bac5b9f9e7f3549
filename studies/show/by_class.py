"""What the terminals trip falsely, what they miss, and what is told apart: class by class."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

from ...detector.criteria import Reason
from .html_parts import bound_text, bullets, k_of_n, percent, right_cell, table
from .sheet import class_words, row_name, terminal_name

__all__ = ["at_a_glance", "by_class", "missed_causes", "several_groups", "worst_first"]

NAMED = 3  #: terminals that a sentence names

Row = dict[str, Any]


def several_groups(result: Row) -> bool:
    """Whether rows need their setting group beside their terminal."""
    return len({row["setting_group"] for row in result["sections"]}) > 1


# ---- in a few sentences ----


def at_a_glance(result: Row, target: float) -> str:
    """What a planner wants to know first."""
    rows, several = result["sections"], several_groups(result)
    judged = [row for row in rows if row["i_set_a"] is not None]
    statuses = dict.fromkeys(row["status"] for row in rows)
    counts = [f"{sum(row['status'] == own for row in rows)} {own}" for own in statuses]
    said = [f"Terminals: {', '.join(counts)}."]
    if judged:
        said.append(_false_trips(judged, target, several))
        said += _missed(rows, several)
    return bullets(said)


def _false_trips(judged: Sequence[Row], target: float, several: bool) -> str:
    trips = sum(row["false_trips"] for row in judged)
    trials = sum(row["security_trials"] for row in judged)
    own = [(one, row) for row in judged for one in row["classes"] if one["kind"] == "must_not_trip"]
    if not own:
        return "False trips: no event that must not trip was judged."
    if trips:
        worst, row = max(own, key=lambda pair: _rate(pair[0]))
        return (
            f"False trips: {k_of_n(trips, trials)} events that must not trip, at "
            f"{sum(row['false_trips'] > 0 for row in judged)} of {len(judged)} terminals with "
            f"settings. Worst: {class_words(worst)} at {row_name(row, several)}, "
            f"{k_of_n(worst['trips'], worst['trials'])} ({percent(_rate(worst))})."
        )
    worst, row = max(own, key=lambda pair: float(pair[0]["upper"]))
    return (
        f"False trips: none in {trials:,} events that must not trip. The largest bound is "
        f"{bound_text(worst['upper'])} per event ({class_words(worst)} at "
        f"{row_name(row, several)}, {worst['trials']:,} events); the target is "
        f"{bound_text(target)}."
    )


def _missed(rows: Sequence[Row], several: bool) -> list[str]:
    """What sections miss: one end that finds a break is enough, so the better end speaks."""
    ends: dict[tuple[str, frozenset[str]], list[Row]] = {}
    for row in rows:
        key = row["setting_group"], frozenset((row["local"], row["remote"]))
        ends.setdefault(key, []).append(row)
    better: list[Row] = []
    without: list[str] = []
    for pair in ends.values():
        found = [row for row in pair if row["i_set_a"] is not None]
        if not found:
            without.append(row_name(pair[0], several))
        elif found[0]["opens"] > found[0]["unreachable"]:
            better.append(min(found, key=_missed_count))
    bad = [row for row in sorted(better, key=_missed_share, reverse=True) if _missed_count(row)]
    named = [
        f"{row_name(row, several)} {k_of_n(_missed_count(row), row['opens'] - row['unreachable'])}"
        for row in bad[:NAMED]
    ]
    more = f" and {len(bad) - NAMED} more" if len(bad) > NAMED else ""
    said = [
        "Missed breaks, by the better end of each section with settings, of those with something "
        f"connected beyond: {', '.join(named) or 'none'}{more}."
    ]
    if without:
        said.append(f"Sections without settings at either end: {', '.join(without)}.")
    return said


def _missed_count(row: Row) -> int:
    return int(row["opens"] - row["unreachable"] - row["detected"])


def _missed_share(row: Row) -> float:
    return _missed_count(row) / int(row["opens"] - row["unreachable"])


def _rate(own: Row) -> float:
    return float(own["trips"]) / max(float(own["trials"]), 1.0)


# ---- class by class ----


def worst_first(classes: Iterable[Row]) -> list[Row]:
    """Classes in a reader's order.

    What must trip; what must not, the highest rate and then the highest bound first; the rest.
    """

    def key(own: Row) -> tuple[int, float, float]:
        if own["kind"] != "must_not_trip" or own["trips"] is None:
            return ("must_trip", "must_not_trip", "apart").index(own["kind"]), 0.0, 0.0
        return 1, -_rate(own), -own["upper"]

    return sorted(classes, key=key)


def by_class(result: Row) -> str:
    """Three tables over all terminals with settings, for each setting group."""
    rows = result["sections"]
    parts = ["<h2>By class of events</h2>"]
    for group in dict.fromkeys(row["setting_group"] for row in rows):
        if several_groups(result):
            parts.append(f"<h3>Setting group {escape(group)}</h3>")
        here = [row for row in rows if row["setting_group"] == group]
        if own := [row for row in here if row["i_set_a"] is not None]:
            parts += [_false_table(own), _missed_table(own), _apart_table(own)]
        else:
            parts.append("<p>No terminal has settings.</p>")
    return "\n".join(parts)


def _false_table(rows: Sequence[Row]) -> str:
    """Every class in which a setting trips falsely, the highest rate first."""
    classes = _by_key(rows, "must_not_trip")
    bad = {key: own for key, own in classes.items() if any(one["trips"] for one in own.values())}
    order = sorted(bad, key=lambda key: -max(_rate(one) for one in bad[key].values()))
    clean = len(classes) - len(bad)
    if not bad:
        return f"<p><b>False trips:</b> none, in any of {clean} classes and sides.</p>"
    rest = f" The other {clean} classes and sides have none." if clean else ""
    return f"<p><b>False trips</b>, k of n events, the worst class first.{rest}</p>\n" + _matrix(
        rows, [(_words(bad[key]), bad[key]) for key in order], "trips", "213, 94, 0"
    )


def _apart_table(rows: Sequence[Row]) -> str:
    """What is in neither count, inside the sections; of wrong wiring the alarms."""
    classes = _by_key(rows, "apart")
    inside = [
        (_words(own), own) for (name, side), own in classes.items() if side == "inside"
        and name != "wiring"
    ]  # fmt: skip
    wiring = [
        (f"{_words(own)}: alarms", own) for (name, _), own in classes.items() if name == "wiring"
    ]
    if not inside and not wiring:
        return ""
    text = (
        "<p><b>Told apart:</b> events in neither count. Trips of those inside the section, and "
        "how often wrong wiring raises the alarm.</p>\n"
    )
    body: list[str] = []
    for words, own in inside:
        body += _matrix_rows(rows, [(words, own), *_by_ohm(words, own)], "trips", "0, 114, 178")
    body += _matrix_rows(rows, wiring, "alarms", "0, 114, 178")
    return text + table(_matrix_head(rows), body)


def _by_ohm(words: str, own: Cells) -> list[tuple[str, Cells]]:
    """Fallen conductors by their resistance to earth; none of any other class."""
    found: dict[str, Cells] = {}
    for t, one in own.items():
        for band in one.get("by_ohm", ()):
            high = "more" if band["ohm_to"] is None else f"{band['ohm_to']:g}"
            text = f"{words}, {band['ohm_from']:g} to {high} Ω"
            found.setdefault(text, {})[t] = band
    return list(found.items())


def _missed_table(rows: Sequence[Row]) -> str:
    """Missed breaks of every terminal and what they are missed for."""
    body = []
    for row in rows:
        reachable = row["opens"] - row["unreachable"]
        cells = [
            f'<th class="w">{escape(terminal_name(row))}</th>',
            right_cell(k_of_n(_missed_count(row), reachable)),
            right_cell(percent(_missed_share(row), 2) if reachable else "–"),
            f"<td>{missed_causes(row) or '–'}</td>",
        ]
        body.append("".join(cells))
    return (
        "<p><b>Missed breaks</b>, of those with something connected beyond, and the criterion "
        "that fails first.</p>\n"
        + table(("terminal", "#missed", "#share", "shares by criterion"), body)
    )


def missed_causes(row: Row) -> str:
    """Shares of a terminal's missed breaks by the first criterion that failed, as HTML."""
    return "; ".join(
        f"{percent(cause['share'])} {escape(Reason[cause['criterion'].upper()].text)}"
        for cause in row["causes"]
    )


# ---- a table of classes by terminals ----

Cells = dict[int, Row]  #: a class at each terminal, by the terminal's place in its group


def _by_key(rows: Sequence[Row], kind: str) -> dict[tuple[str, str], Cells]:
    """The classes of a kind, by name and side."""
    found: dict[tuple[str, str], Cells] = {}
    for t, row in enumerate(rows):
        for own in row["classes"]:
            if own["kind"] == kind:
                found.setdefault((own["name"], own["side"]), {})[t] = own
    return found


def _words(own: Cells) -> str:
    return class_words(next(iter(own.values())))


def _matrix(
    rows: Sequence[Row], classes: Sequence[tuple[str, Cells]], counted: str, rgb: str
) -> str:
    return table(_matrix_head(rows), _matrix_rows(rows, classes, counted, rgb))


def _matrix_head(rows: Sequence[Row]) -> list[str]:
    return ["class", *(f"#{terminal_name(row)}" for row in rows)]


def _matrix_rows(
    rows: Sequence[Row], classes: Sequence[tuple[str, Cells]], counted: str, rgb: str
) -> list[str]:
    """A row for every class; the higher the share, the darker its cell."""
    return [
        f'<th class="c">{escape(words)}</th>'
        + "".join(_shaded(own.get(t), counted, rgb) for t in range(len(rows)))
        for words, own in classes
    ]


def _shaded(own: Row | None, counted: str, rgb: str) -> str:
    if own is None:
        return '<td class="n">–</td>'
    share = own[counted] / max(own["trials"], 1)
    # the square root parts one in a thousand from none
    shade = f' style="background: rgba({rgb}, {0.75 * share**0.5:.2f})"' if share else ""
    return f'<td class="n"{shade}>{k_of_n(own[counted], own["trials"])}</td>'
