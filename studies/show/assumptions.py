"""What a result rests on: the study's laws as they stand in its file, and what is not covered."""

from __future__ import annotations

from html import escape
from typing import Any

from ...model.reading.fields import as_toml
from ..spec.fields import TABLES, part_of
from ..spec.study_file import Study
from ..spec.values import as_table
from .html_parts import bullets, table

__all__ = ["assumptions"]

STATED = (
    "Two steady states of the feeder, ΔT apart, with one event between them. Every scenario draws "
    "all loads, what is unknown of the transformers, DER and motors afresh, and small changes of "
    "the source and of each load, whatever the event.",
    "Breaks are uniform in length over all lines; other events pick a section first, every one "
    "equally likely, then a place uniform in length.",
    "Below 0.7 pu all loads are constant impedance.",
    "Random errors are complex, per phase, channel and frame: normal with a standard deviation of "
    "a third of their bound per axis, truncated at the bound. Ratio, angle and clock errors are "
    "uniform within their bounds, and the same in both frames.",
)


def assumptions(result: dict[str, Any], study: Study) -> str:
    """The report's section on them."""
    numerics = result["numerics"]
    solved = (
        "Numerics: what an opened conductor leads to is dead (nothing connected, or no source) in "
        f"{numerics['dead']:,} validation scenarios and floating in {numerics['floating']:,}; "
        f"{numerics['not_converged']:,} did not converge."
    )
    drawn = {own["name"] for row in result["sections"] for own in row["classes"]}
    missing = bullets(result["feeder_false_trips"]["assumptions"])
    return (
        "<h2>Assumptions</h2>\n<p>The bounds hold for events drawn as follows, and for no "
        f"others.</p>\n{bullets([*STATED, solved])}\n<h3>The study</h3>\n"
        "<p>Every value of study.toml: [a, b] is uniform between a and b; docs/study-file.md says "
        f"what each means.</p>\n{_laws(study, drawn)}\n<h3>Not covered</h3>\n{missing}"
    )


def _laws(study: Study, drawn: set[str]) -> str:
    """A row for each table of the study; events that were not drawn are left out."""
    rows = []
    for name, fields in TABLES.items():
        event = name.partition("events.")[2]
        if event and event != "open_phase" and event not in drawn:
            continue
        values = as_table(part_of(study, name))
        said = [f"{own.name} = {as_toml(values[own.name])}" for own in fields if own.name in values]
        if said:
            rows.append(_row(name, said))
    for name, items in (("groups", study.groups), ("correlations", study.correlations)):
        for item in items:
            values = as_table(item)
            rows.append(_row(name, [f"{key} = {as_toml(value)}" for key, value in values.items()]))
    return table(("table", "values"), rows)


def _row(name: str, said: list[str]) -> str:
    cells = f'<th class="w">[{escape(name)}]</th>'
    return f"{cells}<td>{'<br>'.join(escape(text) for text in said)}</td>"
