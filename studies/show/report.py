"""The report of a sizing: one static page with its pictures in it, and the pictures as files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from typing import Any

from ...detector.criteria import Reason
from ...optimise.staircase import Front
from ..run.cases import Case
from ..run.certify import Validation
from ..run.classes import DrawClass
from ..run.store import RunFolder
from ..spec.study_file import Study
from .assumptions import assumptions
from .html_parts import (
    bound_text,
    class_trips_cell,
    dependability_text,
    false_trips_cell,
    interval_text,
    k_of_n,
    margin_text,
    percent,
    picture,
    right_cell,
    setting_cell,
    table,
)
from .sheet import class_words, row_name, setting_text
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

MARKS = (
    "Each mark is one event of the validation sample, by its positive sequence. Whatever is in "
    "full colour trips every setting to its lower left."
)
BORDERS = (
    "The brown region is built from all of the training sample, phases that stand in among it: a "
    "setting in it trips falsely there. A setting beyond the dashed line keeps the demanded "
    "margin, in V_set as well."
)
KINDS = {"must_trip": "must trip", "must_not_trip": "must not trip", "apart": "in neither count"}

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
.sheet tbody tr:nth-child(odd) > * { border-bottom: none; padding-bottom: 0; }
.sheet tbody tr:nth-child(even) > * { color: #555; }
.bad { color: #a33b00; font-weight: bold; }
.faint, figcaption, footer { color: #555; font-size: .85em; }
figure { margin: 1em 0; break-inside: avoid; }
img { max-width: 100%; height: auto; }
dt { font-weight: bold; float: left; clear: left; width: 8.5em; }
dd { margin: 0 0 .3em 9em; }
@media print { body { font-size: 10pt; margin: 0; max-width: none; } .wide { overflow: visible; }
  img { max-height: 12.5cm; }
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
    from .plots import plot_evidence, plot_feeder, plot_overview, plot_profile, png_of  # noqa: PLC0415

    pictures = {"feeder.png": png_of(plot_feeder, cases[0].feeder)}
    if result["compared"]:
        pictures["overview.png"] = png_of(plot_overview, overview_view(result))
    terminals = len(cases[0].points.terminals)
    for n, row in enumerate(result["sections"]):
        if row["classes"]:
            group, t = divmod(n, terminals)
            front = None if fronts is None else fronts[group][t]
            evidence, profile = _picture_names(n, row)
            view = evidence_view(cases[group], t, row, front, validations[group])
            pictures[evidence] = png_of(plot_evidence, view)
            pictures[profile] = png_of(
                plot_profile, profile_view(cases[group], t, validations[group])
            )
    for name, png in pictures.items():
        folder.write(name, png)
    folder.write("report.html", report_html(result, cases[0].study, pictures))


def _picture_names(t: int, row: dict[str, Any]) -> tuple[str, str]:
    """Files of a terminal's two pictures; the number keeps them apart whatever the names are."""
    stem = re.sub(r"[^A-Za-z0-9]+", "-", f"{row['local']}-{row['remote']}").strip("-")
    return f"{t + 1:02d}-{stem}-evidence.png", f"{t + 1:02d}-{stem}-along-line.png"


def report_html(result: dict[str, Any], study: Study, pictures: dict[str, bytes]) -> str:
    """The page; ``pictures`` are embedded by their names."""
    what = "Assessment of open-phase settings" if "assessed" in result else "Open-phase settings"
    title = f"{what} for feeder {result['feeder']}"
    parts = [
        f"<h1>{escape(title)}</h1>",
        _head(result, study),
        "<h2>Settings sheet</h2>",
        _sheet(result),
        picture("feeder.png", "schematic of the feeder", "The feeder and its sections.", pictures),
        _comparison(result, pictures),
        *(
            _terminal(n, row, result, pictures)
            for n, row in enumerate(result["sections"])
            if row["classes"]
        ),
        assumptions(result, study),
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
    return row_name(row, len({own["setting_group"] for own in result["sections"]}) > 1)


def _head(result: dict[str, Any], study: Study) -> str:
    demand = study.certificate
    known = {"find": demand.find_at_least, "margin": demand.margin}
    meanings = STATUS | (OF_A_SHEET if "assessed" in result else {})
    words = "\n".join(
        f"<dt>{status}</dt><dd>{escape(text.format(**known))}{_tally(result, status)}</dd>"
        for status, text in meanings.items()
    )
    assessed = result.get("assessed", {})
    note = f'<p class="bad">Note: {escape(assessed["note"])}.</p>\n' if assessed.get("note") else ""
    return note + (
        f"<p>Seed {result['seed']}, attempt {result['attempt']}, at least "
        f"{result['scenarios']:,} scenarios of every class and side. The false-trip bounds of all "
        f"terminals (for each its worst class) hold together at "
        f"{percent(result['confidence'], 0)} confidence, over all attempts; so do, apart from "
        f"them, the dependability intervals of these settings. The "
        f"target is at most {bound_text(demand.target)} false trips per event.</p>\n"
        f"<h3>What the status words mean</h3>\n<dl>\n{words}\n</dl>"
    )


def _tally(result: dict[str, Any], status: str) -> str:
    count = sum(row["status"] == status for row in result["sections"])
    return f' <span class="faint">(here: {count})</span>'


def _sheet(result: dict[str, Any]) -> str:
    head = (
        "terminal", "status", "#I_set A", "#V_set %", "#Z_set Ω", "#margin",
        "#dependability (interval)", "#unreachable", "#false trips", "#bound",
    )  # fmt: skip
    rows = []
    for row in result["sections"]:
        cells = [
            f'<th class="w">{escape(_name(row, result))}</th>',
            f'<td class="w">{escape(row["status"])}</td>',
        ]
        cells += [
            setting_cell(row["i_set_a"]),
            setting_cell(row["v_set_pu"], 100.0),
            setting_cell(row["z_set_ohm"]),
            right_cell("–" if "assessed" in result else margin_text(row)),
            right_cell(dependability_text(row)),
            right_cell(k_of_n(row["unreachable"], row["opens"])),
            false_trips_cell(row["false_trips"], row["security_trials"]),
            right_cell(bound_text(row["false_trip_upper"])),
        ]
        rows += ["".join(cells), f'<td></td><td colspan="9">{escape(row["reason"])}</td>']
    return table(head, rows, "sheet") + (
        '<p class="faint">Dependability: breaks found, of those with something connected beyond '
        "them; the unreachable ones have nothing beyond, and change nothing to be measured. "
        "False trips: k of n events that must not trip. Bound: upper bound of the false-trip "
        f"probability per event, worst class.{'' if 'assessed' in result else MARGIN}</p>"
    )


def _comparison(result: dict[str, Any], pictures: dict[str, bytes]) -> str:
    if not result["compared"]:
        return ""
    head = (
        "terminal", "setting", "#I_set A", "#V_set %", "#Z_set Ω", "#found", "#interval",
        "#false trips", "#bound",
    )  # fmt: skip
    names = dict.fromkeys(row["name"] for row in result["compared"])
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


def _terminal(
    n: int, row: dict[str, Any], result: dict[str, Any], pictures: dict[str, bytes]
) -> str:
    evidence, profile = _picture_names(n, row)
    head = ("class", "side", "kind", "#trials", "#effective trials", "#trips", "#upper bound")
    rows = [
        "".join(
            [
                f"<td>{escape(_class_name(own))}</td>",
                f'<td>{escape(own["side"])}</td><td class="w">{KINDS[own["kind"]]}</td>',
                right_cell(f"{own['trials']:,}"),
                right_cell(k_of_n(own["effective_trials"], own["trials"])),
                class_trips_cell(own),
                # a bound of trips is a merit of security, and says nothing of what must trip
                right_cell(bound_text(own["upper"]) if own["kind"] != "must_trip" else "–"),
            ]
        )
        for own in row["classes"]
    ]
    z1 = complex(*row["line_z1_ohm"])
    return "\n".join(
        [
            '<section class="terminal">',
            f"<h2>Terminal {escape(_name(row, result))}: {escape(row['status'])}</h2>",
            f"<p>{_setting(row)} Line between the points: |Z1| = {abs(z1):.2f} Ω.</p>",
            f"<p>{escape(row['reason'][:1].upper() + row['reason'][1:])}.</p>",
            table(head, rows),
            '<p class="faint">Effective trials come near the thresholds: |ΔI1| > I_set/2 and '
            "|ΔV1| ≤ V_set. Where they are few, no trips show little.</p>",
            _causes(row),
            _nearest(row),
            picture(
                evidence,
                f"evidence of {row['local']} to {row['remote']}",
                MARKS if "assessed" in result else f"{MARKS} {BORDERS}",
                pictures,
            ),
            picture(
                profile,
                f"breaks found along {row['local']} to {row['remote']}",
                "Found, of all internal breaks of the validation sample in each stretch; ticks "
                "above: transformers and loads.",
                pictures,
            ),
            "</section>",
        ]
    )


def _class_name(own: dict[str, Any]) -> str:
    """A class in words; of wrong wiring, how often the alarm was raised."""
    alarms = f" (alarm in {own['alarms']:,})" if "alarms" in own else ""
    return class_words(own) + alarms


def _setting(row: dict[str, Any]) -> str:
    if row["i_set_a"] is None:
        return "No setting."
    margin = "" if row["margin"] is None else f", margin {margin_text(row)}"
    return (
        f"I_set {setting_text(row['i_set_a'])} A ({setting_text(row['i_set_pu'])} pu), "
        f"V_set {setting_text(row['v_set_pu'] * 100.0)} %, "
        f"Z_set {setting_text(row['z_set_ohm'])} Ω{margin}."
    )


def _causes(row: dict[str, Any]) -> str:
    if row["detected"] is None:
        return ""
    missed = row["opens"] - row["unreachable"] - row["detected"]
    begin = f"<p><b>Missed breaks</b> (with something connected beyond): {missed:,}"
    if not row["causes"]:
        return f"{begin}.</p>"
    found = [
        f"{percent(cause['share'])} {escape(Reason[cause['criterion'].upper()].text)}"
        for cause in row["causes"]
    ]
    sign = "" if row["negative_sign"] else " (the sign is not used)"
    return f"{begin}; the first criterion that failed{sign}: {'; '.join(found)}.</p>"


def _nearest(row: dict[str, Any]) -> str:
    near = row["nearest_false_trip"]
    if near is None:
        return ""
    name = DrawClass[near["class"].upper()].words
    return (
        f"<p><b>Nearest false trip</b> in training: {escape(name)}, at factor "
        f"{near['factor']:.2f}; scenario <code>{escape(near['scenario'])}</code>.</p>"
    )
