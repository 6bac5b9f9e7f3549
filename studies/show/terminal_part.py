"""The report's section on one terminal: its setting, its classes, its pictures."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from typing import Any

from ..run.classes import DrawClass
from .by_class import missed_causes, several_groups, worst_first
from .html_parts import (
    bound_text,
    class_trips_cell,
    folded,
    k_of_n,
    margin_text,
    picture,
    right_cell,
    table,
)
from .sheet import class_words, row_name, setting_text

__all__ = ["picture_names", "terminal_part"]

MARKS = (
    "Each mark is one event of the validation sample, by its positive sequence. Whatever is in "
    "full colour trips every setting to its lower left. Rings: what the setting trips by a phase, "
    "the positive sequence staying below I_set; and what it trips falsely."
)
BORDERS = (
    "The brown region is built from all of the training sample, phases that stand in among it, "
    "which notch its border: a setting in it trips falsely there. A setting beyond the dashed "
    "line keeps the demanded margin, in V_set as well."
)
KINDS = {"must_trip": "must trip", "must_not_trip": "must not trip", "apart": "in neither count"}
HEAD = ("class", "kind", "#trials", "#effective trials", "#trips", "#upper bound")

Row = dict[str, Any]


def picture_names(n: int, name: str) -> tuple[str, str]:
    """Files of a terminal's two pictures; the number keeps them apart whatever the names are."""
    stem = re.sub(r"[^A-Za-z0-9]+", "-", name).strip("-")
    return f"{n + 1:02d}-{stem}-evidence.png", f"{n + 1:02d}-{stem}-along-line.png"


def terminal_part(n: int, row: Row, result: Row, pictures: dict[str, bytes]) -> str:
    """All that is known of the ``n``-th row of the result."""
    name = row_name(row, several_groups(result))
    evidence, profile = picture_names(n, name)
    z1 = complex(*row["line_z1_ohm"])
    return "\n".join(
        [
            '<section class="terminal">',
            f"<h2>Terminal {escape(name)}: {escape(row['status'])}</h2>",
            f"<p>{_setting(row)} Line between the points: |Z1| = {abs(z1):.2f} Ω.</p>",
            f"<p>{escape(row['reason'][:1].upper() + row['reason'][1:])}.</p>",
            _classes(row),
            _causes(row),
            _nearest(row),
            picture(
                evidence,
                f"evidence of {name}",
                MARKS if "assessed" in result else f"{MARKS} {BORDERS}",
                pictures,
            ),
            _profile(profile, row, name, pictures),
            "</section>",
        ]
    )


def _profile(file: str, row: Row, name: str, pictures: dict[str, bytes]) -> str:
    """Where breaks are found; without a setting there is nothing to show."""
    if row["i_set_a"] is None:
        return ""
    return picture(
        file,
        f"breaks found along {name}",
        "Found, of all internal breaks of the validation sample in each stretch; ticks above: "
        "transformers, loads and DER.",
        pictures,
    )


# ---- classes ----


def _classes(row: Row) -> str:
    """What must trip and what trips falsely; all that does not in one line, and folded."""
    classes = worst_first(row["classes"])
    shown = [own for own in classes if own["kind"] == "must_trip" or _trips_falsely(own)]
    clean = [own for own in classes if own["kind"] == "must_not_trip" and not _trips_falsely(own)]
    rows = [_class_row(own) for own in shown]
    if clean:
        rows.append(_together(clean, any(map(_trips_falsely, shown))))
    return (
        table(HEAD, rows)
        + folded(
            f"All {len(classes)} classes and sides, the worst first",
            table(HEAD, [_class_row(own) for own in classes]),
        )
        + '<p class="faint">Effective trials come near the thresholds, by the positive sequence or '
        "by a phase that may stand in: |ΔI| > I_set/2 and |ΔV| ≤ V_set. Where they are few, no "
        "trips show little.</p>"
    )


def _trips_falsely(own: Row) -> bool:
    return own["kind"] == "must_not_trip" and bool(own["trips"])


def _class_row(own: Row) -> str:
    return "".join(
        [
            f"<td>{escape(_class_name(own))}</td>",
            f'<td class="w">{KINDS[own["kind"]]}</td>',
            right_cell(f"{own['trials']:,}"),
            right_cell(k_of_n(own["effective_trials"], own["trials"])),
            class_trips_cell(own),
            # a bound of trips is a merit of security, and says nothing of what must trip
            right_cell(bound_text(own["upper"]) if own["kind"] != "must_trip" else "–"),
        ]
    )


def _together(clean: Sequence[Row], others: bool) -> str:
    """Classes without a trip in one line, with the largest of their bounds."""
    trials = sum(own["trials"] for own in clean)
    judged = all(own["trips"] is not None for own in clean)
    every = "the other" if others else "all"
    bound = bound_text(max(own["upper"] for own in clean)) if judged else "–"
    return "".join(
        [
            f"<td>{every} {len(clean)} classes and sides together</td>",
            f'<td class="w">{KINDS["must_not_trip"]}</td>',
            right_cell(f"{trials:,}"),
            right_cell(
                k_of_n(sum(own["effective_trials"] for own in clean), trials) if judged else "–"
            ),
            right_cell(k_of_n(0, trials) if judged else "–"),
            right_cell(f"worst {bound}" if judged else "–"),
        ]
    )


def _class_name(own: Row) -> str:
    """A class in words; of wrong wiring, how often the alarm was raised."""
    alarms = f" (alarm in {own['alarms']:,})" if "alarms" in own else ""
    return class_words(own) + alarms


# ---- sentences ----


def _setting(row: Row) -> str:
    if row["i_set_a"] is None:
        return "No setting."
    margin = "" if row["margin"] is None else f", margin {margin_text(row)}"
    return (
        f"I_set {setting_text(row['i_set_a'])} A ({setting_text(row['i_set_pu'])} pu), "
        f"V_set {setting_text(row['v_set_pu'] * 100.0)} %, "
        f"Z_set {setting_text(row['z_set_ohm'])} Ω{margin}."
    )


def _causes(row: Row) -> str:
    if row["detected"] is None:
        return ""
    missed = row["opens"] - row["unreachable"] - row["detected"]
    begin = f"<p><b>Missed breaks</b> (with something connected beyond): {missed:,}"
    if not row["causes"]:
        return f"{begin}.</p>"
    sign = "" if row["negative_sign"] else " (the sign is not used)"
    return f"{begin}; the first criterion that failed{sign}: {missed_causes(row)}.</p>"


def _nearest(row: Row) -> str:
    near = row["nearest_false_trip"]
    if near is None:
        return ""
    name = DrawClass[near["class"].upper()].words
    return (
        f"<p><b>Nearest false trip</b> in training: {escape(name)}, at factor "
        f"{near['factor']:.2f}; scenario <code>{escape(near['scenario'])}</code>.</p>"
    )
