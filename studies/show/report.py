"""The report of a sizing: one static page with its pictures in it, and the pictures as files."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

from ...optimise.staircase import Front
from ..run.cases import Case
from ..run.certify import Validation
from ..run.store import RunFolder
from ..spec.study_file import Study, resolved
from .assumptions import assumptions
from .by_class import at_a_glance, by_class, several_groups
from .html_parts import (
    bound_text,
    dependability_text,
    false_trips_cell,
    folded,
    interval_text,
    k_of_n,
    margin_text,
    percent,
    picture,
    right_cell,
    setting_cell,
    table,
)
from .sheet import row_name, terminal_name
from .terminal_part import picture_names, terminal_part
from .views import evidence_view, overview_view, profile_view

__all__ = ["report_html", "write_report"]

STATUS = {
    "set": "no false trip in validation, the bound is within the target, and the terminal surely "
    "finds at least {find:.0%} of the breaks that have something connected beyond them",
    "weak": "no false trip and the bound is within the target, but it finds less than that",
    "none": "no setting that the device can hold keeps the demanded margin of {margin:g}",
    "not_certified": "validation showed a false trip, or was too small for the target",
    "load_side": "cut off with its section, this terminal has no source behind it: no settings; "
    "the other end of the section decides",
}
"""Status -> what it means."""

OF_A_SHEET = {
    "none": "the sheet leaves the terminal without a setting",
    "load_side": "cut off with its section, this terminal has no source behind it; whatever the "
    "sheet sets it to, it did not trip falsely",
}
"""The same of an assessment, where it differs."""

MARGIN = (
    " Margin: factor by which I_set and Z_set could be lowered and V_set raised together before "
    "the first false trip in training."
)

FEEDER = "The feeder and its sections, every switch as the feeder file has it."

STYLE = """\
body { font: 15px/1.45 "DejaVu Sans", Verdana, sans-serif; color: #1b1b1b; background: #fff;
  max-width: 1080px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.6em; margin-bottom: .2em; }
h2 { font-size: 1.25em; margin-top: 2em; border-bottom: 1px solid #ccc; }
h3 { font-size: 1.05em; margin: 1.4em 0 .4em; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .82em; margin: .6em 0; }
th, td { padding: .3em .6em; border-bottom: 1px solid #ddd; text-align: left; vertical-align: top; }
thead th { border-bottom: 2px solid #888; }
.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.w { white-space: nowrap; }
.sheet tr:has(+ tr > td:empty) > * { border-bottom: none; padding-bottom: 0; }
.why { color: #555; }
.group { background: #f2f2f2; }
.bad { color: #a33b00; font-weight: bold; }
.faint, figcaption, footer { color: #555; font-size: .85em; }
figure { margin: 1em 0; break-inside: avoid; }
img { max-width: 100%; height: auto; }
.c { font-weight: normal; }
details { margin: .6em 0; }
summary { cursor: pointer; color: #0072b2; }
dt { font-weight: bold; float: left; clear: left; width: 8.5em; }
dd { margin: 0 0 .3em 9em; }
@media print { body { font-size: 10pt; margin: 0; max-width: none; } .wide { overflow: visible; }
  img { max-height: 12.5cm; } details::details-content { content-visibility: visible; }
  section.terminal { break-before: page; } tr, h2, h3 { break-inside: avoid; break-after: auto; } }
"""


def write_report(
    result: dict[str, Any],
    cases: Sequence[Case],
    fronts: Sequence[Sequence[Front]] | None,
    validations: Sequence[Validation],
    folder: RunFolder,
) -> None:
    """Draw the pictures of a finished run and write them and ``report.html``.

    Parameters
    ----------
    result
        What ``size --json`` or ``assess --json`` prints.
    cases
        The feeder and study, per group.
    fronts
        Per group and terminal, the training events that no other outdoes; None: no training.
    validations
        The validation sample of each group.
    folder
        Where the report goes.
    """
    # matplotlib takes half a second to import: only a run that got here pays for it
    from .feeder_plot import plot_feeder  # noqa: PLC0415
    from .plots import plot_evidence, plot_overview, plot_profile, png_of  # noqa: PLC0415

    pictures = {"feeder.png": png_of(plot_feeder, cases[0].feeder)}
    if _rivals(result):
        pictures["overview.png"] = png_of(plot_overview, overview_view(result))
    terminals = len(cases[0].points.terminals)
    for n, row in enumerate(result["sections"]):
        if row["classes"]:
            group, t = divmod(n, terminals)
            front = None if fronts is None else fronts[group][t]
            evidence, profile = picture_names(n, _name(row, result))
            view = evidence_view(cases[group], t, row, front, validations[group])
            pictures[evidence] = png_of(plot_evidence, view)
            if row["i_set_a"] is not None:
                along = profile_view(cases[group], t, validations[group])
                pictures[profile] = png_of(plot_profile, along)
    for name, png in pictures.items():
        folder.write(name, png)
    feeder = cases[0].feeder
    study = resolved(cases[0].study, feeder)
    page = report_html(result, study, pictures, feeder.imported_from)
    folder.write("report.html", page)


def report_html(
    result: dict[str, Any], study: Study, pictures: dict[str, bytes], made_from: str | None = None
) -> str:
    """The page; ``pictures`` are embedded by their names."""
    what = "Assessment of open-phase settings" if "assessed" in result else "Open-phase settings"
    title = f"{what} for feeder {result['feeder']}"
    parts = [
        f"<h1>{escape(title)}</h1>",
        _head(result, study),
        "<h2>Settings sheet</h2>",
        _sheet(result),
        _status_words(result, study),
        picture("feeder.png", "schematic of the feeder", FEEDER, pictures),
        by_class(result),
        _comparison(result, pictures),
        *(
            terminal_part(n, row, result, pictures)
            for n, row in enumerate(result["sections"])
            if row["classes"]
        ),
        assumptions(result, study, made_from),
        f"<footer><p>openphase {escape(result['version'])}; inputs, versions and hashes are in "
        "manifest.json, every default in study.toml, all numbers in result.json.</p></footer>",
    ]
    body = "\n".join(part for part in parts if part)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f"<title>{escape(title)}</title>\n<style>\n{STYLE}</style>\n</head>\n"
        f"<body>\n{body}\n</body>\n</html>\n"
    )


# ---- parts of the page ----


def _name(row: dict[str, Any], result: dict[str, Any]) -> str:
    """A row's terminal, with its group where the study has several."""
    return row_name(row, several_groups(result))


def _head(result: dict[str, Any], study: Study) -> str:
    """What was done, and what came of it in a few sentences."""
    target = study.certificate.target
    assessed = result.get("assessed", {})
    note = f'<p class="bad">Note: {escape(assessed["note"])}.</p>\n' if assessed.get("note") else ""
    return note + (
        f"{at_a_glance(result, target)}\n"
        f'<p class="faint">Seed {result["seed"]}, attempt {result["attempt"]}, at least '
        f"{result['scenarios']:,} scenarios of every class and side. The false-trip bounds of all "
        f"terminals (for each its worst class) hold together at "
        f"{percent(result['confidence'], 0)} confidence, over all attempts; so do, apart from "
        f"them, the dependability intervals of these settings. The "
        f"target is at most {bound_text(target)} false trips per event.</p>"
    )


def _status_words(result: dict[str, Any], study: Study) -> str:
    demand = study.certificate
    known = {"find": demand.find_at_least, "margin": demand.margin}
    meanings = STATUS | (OF_A_SHEET if "assessed" in result else {})
    words = "\n".join(
        f"<dt>{status}</dt><dd>{escape(text.format(**known))}{_tally(result, status)}</dd>"
        for status, text in meanings.items()
    )
    return folded("What the status words mean", f"<dl>\n{words}\n</dl>")


def _tally(result: dict[str, Any], status: str) -> str:
    count = sum(row["status"] == status for row in result["sections"])
    return f' <span class="faint">(here: {count})</span>'


def _sheet(result: dict[str, Any]) -> str:
    assessed = "assessed" in result  # nothing is known of its margins
    head = [
        "terminal", "status", "#I_set A", "#V_set %", "#Z_set Ω", "#margin",
        "#dependability (interval)", "#unreachable", "#false trips", "#bound",
    ]  # fmt: skip
    if assessed:
        head.remove("#margin")
    wide = len(head) - 2
    rows: list[str] = []
    group = None
    for row in result["sections"]:
        if several_groups(result) and row["setting_group"] != group:
            group = row["setting_group"]
            text = f"Setting group {escape(group)}"
            rows.append(f'<th colspan="{len(head)}" class="group">{text}</th>')
        cells = [
            f'<th class="w">{escape(terminal_name(row))}</th>',
            f'<td class="w">{escape(row["status"])}</td>',
        ]
        if row["i_set_a"] is None:
            why = f'<td colspan="{wide}" class="why">{escape(row["reason"])}</td>'
            rows.append("".join([*cells, why]))
            continue
        cells += [
            setting_cell(row["i_set_a"]),
            setting_cell(row["v_set_pu"], 100.0),
            setting_cell(row["z_set_ohm"]),
            *([] if assessed else [right_cell(margin_text(row))]),
            right_cell(dependability_text(row)),
            right_cell(k_of_n(row["unreachable"], row["opens"])),
            false_trips_cell(row["false_trips"], row["security_trials"]),
            right_cell(bound_text(row["false_trip_upper"])),
        ]
        why = f'<td colspan="{wide + 1}" class="why">{escape(row["reason"])}</td>'
        rows += ["".join(cells), f"<td></td>{why}"]
    return table(head, rows, "sheet") + (
        '<p class="faint">Dependability: breaks found, of those with something connected beyond '
        "them; the unreachable ones have nothing beyond, and change nothing to be measured. "
        "False trips: k of n events that must not trip. Bound: upper bound of the false-trip "
        f"probability per event, worst class.{'' if assessed else MARGIN}</p>"
    )


def _rivals(result: dict[str, Any]) -> tuple[str, ...]:
    """The settings side by side; none where there is but one, of which the sheet says it all."""
    names = tuple(dict.fromkeys(row["name"] for row in result["compared"]))
    return names if len(names) > 1 else ()


def _comparison(result: dict[str, Any], pictures: dict[str, bytes]) -> str:
    names = _rivals(result)
    if not names:
        return ""
    head = (
        "terminal", "setting", "#I_set A", "#V_set %", "#Z_set Ω", "#found", "#interval",
        "#false trips", "#bound",
    )  # fmt: skip
    rows = []
    for row in result["compared"]:
        cells = [
            f'<th class="w">{escape(_name(row, result))}</th>',
            f'<td class="w">{escape(row["name"])}</td>',
        ]
        if row["i_set_a"] is None:
            rows.append("".join([*cells, f'<td colspan="7">{escape(row["reason"])}</td>']))
            continue
        cells += [
            setting_cell(row["i_set_a"]),
            setting_cell(row["v_set_pu"], 100.0),
            setting_cell(row["z_set_ohm"]),
            right_cell(k_of_n(row["detected"], row["opens"] - row["unreachable"])),
            right_cell(interval_text(row["dependability_low"], row["dependability_high"])),
            false_trips_cell(row["false_trips"], row["trials"]),
            right_cell(bound_text(row["upper"])),
        ]
        rows.append("".join(cells))
    return (
        "<h2>Settings side by side</h2>\n<p>All on the same validation sample: "
        f"{', '.join(escape(name) for name in names)}.</p>\n"
        + table(head, rows)
        + picture("overview.png", "dependability and false trips of every terminal", "", pictures)
    )
