"""What a result rests on: the study's laws as they stand in its file, and what is not covered."""

from __future__ import annotations

from html import escape
from typing import Any

from ..spec.study_file import Study, dump_study
from .html_parts import bullets, table
from .sheet import UNSETTLED

__all__ = ["assumptions"]

STATED = (
    "Two steady states of the feeder, ΔT apart, with one event between them. Every scenario draws "
    "all loads, what is unknown of the transformers, DER and motors afresh, and small changes of "
    "the source and of each load, whatever the event.",
    "Events pick a region first, every one equally likely, then a place uniform in length: a "
    "section, or what lies alike to all sections; for breaks a section's path and its laterals are "
    "two regions. They stand on lines of medium voltage, take phases that are there, and scale "
    "with the nominal voltage of their place.",
    "Where the study draws their exponents, loads are constant impedance below 0.7 pu; else each "
    "follows its own law.",
    "Random errors are complex, per phase, channel and frame: normal with a standard deviation of "
    "a third of their bound per axis, truncated at the bound. Ratio, angle and clock errors are "
    "uniform within their bounds, and the same in both frames.",
)


def assumptions(result: dict[str, Any], study: Study, made_from: str | None = None) -> str:
    """The report's section on them; ``made_from`` says what the feeder was imported from."""
    numerics = result["numerics"]
    solved = (
        "Numerics: what an opened conductor leads to is dead (nothing connected, or no source) in "
        f"{numerics['dead']:,} validation scenarios and floating in {numerics['floating']:,}; "
        f"nothing earths a part behind an ungrounded winding in {numerics['unearthed']:,}; "
        f"{numerics['not_converged']:,} did not converge{_unsettled(numerics)}."
    )
    source = [] if made_from is None else [f"The feeder is imported from {made_from}."]
    drawn = {own["name"] for row in result["sections"] for own in row["classes"]}
    missing = bullets(result["feeder_false_trips"]["assumptions"])
    return (
        "<h2>Assumptions</h2>\n<p>The bounds hold for events drawn as follows, and for no "
        f"others.</p>\n{bullets([*source, *STATED, solved])}\n<h3>The study</h3>\n"
        "<p>Every value of study.toml: [a, b] is uniform between a and b; docs/study-file.md says "
        f"what each means.</p>\n{_laws(study, drawn)}\n<h3>Not covered</h3>\n{missing}"
    )


def _unsettled(numerics: dict[str, Any]) -> str:
    """In which classes, and in training."""
    said = [
        f"{own['not_converged']:,} of {own['scenarios']:,} {own['name']}"
        for own in numerics["by_class"]
        if own["not_converged"]
    ]
    if training := numerics["training_not_converged"]:
        said.append(f"and {training:,} more in training")
    return f" ({', '.join(said)}). {UNSETTLED[:-1]}" if said else ""


def _laws(study: Study, drawn: set[str]) -> str:
    """A row for each table of the study; empty ones and events that were not drawn are left out."""
    rows = []
    for text in dump_study(study).split("\n\n")[1:]:
        head, *lines = text.splitlines()
        event = head.strip("[]").partition("events.")[2]
        if lines and (not event or event == "open_phase" or event in drawn):
            cells = f'<th class="w">{escape(head)}</th>'
            rows.append(f"{cells}<td>{'<br>'.join(escape(line) for line in lines)}</td>")
    return table(("table", "values"), rows)
