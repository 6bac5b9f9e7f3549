"""Validation: what an untouched sample says about settings, as the rows of a result."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...detector.criteria import Reason, Settings
from ...optimise.certificate import share_of_alpha, two_sided, upper_bound
from .cases import Case
from .classes import FALLEN, FALLEN_OHM, REPORTED, DrawClass
from .draw_event import possible_rows
from .options import options_text, trigger_text
from .status import impedance_note, load_side_status, status_of
from .validation import Validation, add_up

__all__ = [
    "Given",
    "Rival",
    "Sheet",
    "Validation",
    "add_up",
    "alpha_of",
    "certified",
    "compared_rows",
    "judged_pairs",
    "not_covered",
    "numerics",
    "section_row",
    "sheets_of",
]

#: what no certificate of this version covers
NOT_COVERED = (
    "Rare false trips are sampled, not hunted.",
    "ΔT and the operate delay are carried in the sheet, and not judged: one frame before the "
    "event and one after it, both steady, stand for all. Inrush, arcs and machines that swing "
    "are not modelled.",
    "Event classes have no rates, so there are no false trips per year.",
)

SPENT = "this sample is spent: run again with a new --seed"

FLAGS = (
    "dead",
    "floating",
    "unearthed",
    "not_converged",
)  #: in the order in which blocks count them

#: the criteria in the order in which a verdict names the first that fails
CAUSES = tuple(reason for reason in Reason if reason != Reason.TRIP)

MUST_TRIP = next(r for r, own in enumerate(REPORTED) if own.kind == "must_trip")
MUST_NOT = [r for r, own in enumerate(REPORTED) if own.kind == "must_not_trip"]


# ---- who shares the error probability ----


def judged_pairs(cases: Sequence[Case]) -> int:
    """How many pairs of a terminal and a group share the error probability."""
    return sum(int(case.judged.sum()) for case in cases)


def alpha_of(cases: Sequence[Case], attempt: int) -> float:
    """Error probability of each bound."""
    confidence = cases[0].study.certificate.confidence
    return share_of_alpha(confidence, attempt, judged_pairs(cases))


def not_covered(validations: Sequence[Validation]) -> list[str]:
    """What the bounds say nothing about, classes that were never drawn among them."""
    drawn = np.any([own.trials.any(axis=1) for own in validations], axis=0)
    seen = {own.drawn for own, any_trial in zip(REPORTED, drawn, strict=True) if any_trial}
    left_out = ", ".join(own.words for own in DrawClass if own not in seen)
    missing = [f"Not drawn, and so not covered: {left_out}."] if left_out else []
    return [*missing, *NOT_COVERED]


def numerics(
    validations: Sequence[Validation], training: NDArray[np.int64] | None = None
) -> dict[str, Any]:
    """Scenarios with a dead conductor, a floating island, or loads that did not settle.

    ``training`` are the counts of the sample on which settings were chosen, if any.
    """
    flags = np.sum([own.flags for own in validations], axis=0)
    scenarios = np.sum([own.scenarios for own in validations], axis=0)
    return {
        **dict(zip(FLAGS, flags.sum(axis=0).tolist(), strict=True)),
        "training_not_converged": None if training is None else int(training[-1]),
        "by_class": [
            {"name": drawn.name.lower(), "scenarios": int(scenarios[drawn])}
            | dict(zip(FLAGS, flags[drawn].tolist(), strict=True))
            for drawn in DrawClass
            if scenarios[drawn]
        ],
    }


# ---- rows of a result ----


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """The setting a row speaks of, and what is known of it beside the validation sample."""

    settings: Settings | None
    margin: float | None = None  #: None: none is known, or infinite
    nearest: dict[str, Any] | None = None  #: the training event it comes closest to
    missing: str | None = None  #: why there is no setting
    note: str | None = None  #: what else has to be said of it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sheet:
    """What all rows of one group's sheet have in common."""

    case: Case
    validation: Validation
    alpha: float
    attempt: int
    chosen: bool  #: the settings were chosen for this validation, which may be used up thereby


def sheets_of(
    cases: Sequence[Case], validations: Sequence[Validation], attempt: int, chosen: bool
) -> list[Sheet]:
    """A sheet for each group; the settings were ``chosen`` for this validation, or given."""
    return [
        Sheet(
            case=case,
            validation=own,
            alpha=alpha_of(cases, attempt),
            attempt=attempt,
            chosen=chosen,
        )
        for case, own in zip(cases, validations, strict=True)
    ]


def section_row(sheet: Sheet, t: int, given: Given) -> dict[str, Any]:
    """What the result says about one directed terminal in one group."""
    case = sheet.case
    terminal, own = case.points.terminals[t], given.settings
    row = _head(case, t, given)
    if own is None and terminal.load_side:
        status, reason = load_side_status(None)
        return row | _no_evidence() | {"status": status, "reason": reason}
    validation, alpha = sheet.validation, sheet.alpha
    possible = possible_rows(case)[:, t]
    classes = [
        _class_row(r, t, own, validation, alpha)
        for r in range(len(REPORTED))
        if validation.trials[r, t] or (r in MUST_NOT and possible[r])
    ]
    must_not = [one for one in classes if one["kind"] == "must_not_trip"]
    row |= _dependability(t, 0, own, validation, alpha)
    row["least_z_op_ohm"] = _finite(validation.least_z_ohm[t])
    row |= {
        "security_trials": sum(one["trials"] for one in must_not),
        "false_trips": sum(one["trips"] for one in must_not) if own else None,
        "false_trip_upper": max((one["upper"] for one in must_not), default=1.0) if own else None,
        "false_trips_per_year_upper": None,
        "classes": classes,
        "causes": _causes(validation.missed[t]) if own else [],
        "nearest_false_trip": given.nearest,
        "fixes": [],
    }
    if own is None:
        row["status"], row["reason"] = "none", given.missing or "no setting"
        return row
    status, reason = status_of(case, row, validation.front[t], sheet.attempt)
    if terminal.load_side and not row["false_trips"]:
        status, reason = load_side_status(row)
    row["status"] = status
    spent = SPENT if sheet.chosen and row["false_trips"] else None
    said = (reason, spent, given.note, impedance_note(row, case.study.certificate.margin))
    row["reason"] = "; ".join(filter(None, said))
    return row


def _head(case: Case, t: int, given: Given) -> dict[str, Any]:
    """The keys that say which terminal and which setting a row is about."""
    terminal, study, own = case.points.terminals[t], case.study, given.settings
    options = own.options if own else study.detector.options()
    return {
        "local": terminal.local,
        "remote": terminal.remote,
        "setting_group": case.group.name,
        "status": "",
        "reason": "",
        "i_set_a": own.i_set_a if own else None,
        "i_set_pu": round(own.i_set_a / study.device.ct_primary_a, 10) if own else None,
        "v_set_pu": own.v_set_pu if own else None,
        "z_set_ohm": own.z_set_ohm if own else None,
        "dt_ms": study.detector.dt_ms,
        "delay_ms": study.detector.delay_ms,
        "trigger": trigger_text(options),
        "negative_sign": options.negative_sign,
        "options": options_text(options),
        "line_z1_ohm": [terminal.line_z1_ohm.real, terminal.line_z1_ohm.imag],
        "margin": given.margin if given.margin and math.isfinite(given.margin) else None,
    }


def _dependability(
    t: int, k: int, own: Settings | None, validation: Validation, alpha: float
) -> dict[str, Any]:
    """Breaks inside, and how many of those that can be seen the k-th setting finds."""
    opens, reachable = int(validation.trials[MUST_TRIP, t]), int(validation.reachable[t])
    found = int(validation.found[k, t])
    low, high = two_sided(found, reachable, alpha)
    return {
        "opens": opens,
        "unreachable": opens - reachable,
        "detected": found if own else None,
        "dependability": found / reachable if own and reachable else None,
        "dependability_low": low if own else None,
        "dependability_high": high if own else None,
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _no_evidence() -> dict[str, Any]:
    """The keys of a terminal on which nothing was judged."""
    empty: dict[str, Any] = dict.fromkeys(
        (
            "opens",
            "unreachable",
            "detected",
            "dependability",
            "dependability_low",
            "dependability_high",
            "least_z_op_ohm",
            "security_trials",
            "false_trips",
            "false_trip_upper",
            "false_trips_per_year_upper",
        )
    )
    return empty | {"classes": [], "causes": [], "nearest_false_trip": None, "fixes": []}


def _class_row(
    r: int, t: int, own: Settings | None, validation: Validation, alpha: float
) -> dict[str, Any]:
    reported = REPORTED[r]
    trials, trips = int(validation.trials[r, t]), int(validation.trips[0, r, t])
    row = {
        "name": reported.name,
        "kind": reported.kind,
        "side": reported.side,
        "trials": trials,
        "effective_trials": int(validation.effective[r, t]) if own else None,
        "trips": trips if own else None,
        "upper": upper_bound(trips, trials, alpha) if own else None,
    }
    if reported.drawn == DrawClass.WIRING:
        row["alarms"] = int(validation.alarms[r, t])
    if reported.drawn in FALLEN and reported.side == "inside":
        row["by_ohm"] = _by_ohm(reported.drawn, t, own, validation)
    return row


def _by_ohm(
    drawn: DrawClass, t: int, own: Settings | None, validation: Validation
) -> list[dict[str, Any]]:
    """Fallen conductors inside by their resistance to earth."""
    counts = validation.fallen[FALLEN.index(drawn), :, t]
    return [
        {
            "ohm_from": low,
            "ohm_to": high if math.isfinite(high) else None,
            "trials": int(trials),
            "trips": int(trips) if own else None,
        }
        for (low, high), (trials, trips) in zip(pairwise(FALLEN_OHM), counts, strict=True)
        if trials
    ]


def _causes(missed: NDArray[np.int64]) -> list[dict[str, Any]]:
    """Shares of the missed breaks by the first criterion that failed."""
    total = int(missed.sum())
    return [
        {"criterion": reason.name.lower(), "share": int(missed[reason]) / total}
        for reason in CAUSES
        if missed[reason]
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rival:
    """One of the settings that are judged side by side."""

    name: str
    settings: Settings | None
    missing: str | None = None  #: why there is none


def compared_rows(sheet: Sheet, t: int, rivals: Sequence[Rival]) -> list[dict[str, Any]]:
    """Settings side by side on the same validation sample; the first is the row's own."""
    terminal, validation = sheet.case.points.terminals[t], sheet.validation
    trials = validation.trials[MUST_NOT, t]
    rows = []
    for k, rival in enumerate(rivals):
        own = rival.settings
        trips = validation.trips[k, MUST_NOT, t]
        bounds = [
            upper_bound(int(x), int(n), sheet.alpha)
            for x, n in zip(trips, trials, strict=True)
            if n
        ]
        found = _dependability(t, k, own, validation, sheet.alpha)
        rows.append(
            {
                "local": terminal.local,
                "remote": terminal.remote,
                "setting_group": sheet.case.group.name,
                "name": rival.name,
                "i_set_a": own.i_set_a if own else None,
                "v_set_pu": own.v_set_pu if own else None,
                "z_set_ohm": own.z_set_ohm if own else None,
                "detected": found["detected"],
                "opens": found["opens"],
                "unreachable": found["unreachable"],
                "dependability_low": found["dependability_low"],
                "dependability_high": found["dependability_high"],
                "false_trips": int(trips.sum()) if own else None,
                "trials": int(trials.sum()),
                "upper": max(bounds, default=1.0) if own else None,
                "reason": None if own else rival.missing,
            }
        )
    return rows


# ---- the part of an answer that rests on validation ----


def certified(
    sheets: Sequence[Sheet],
    given: Sequence[Sequence[Given]],
    rivals: Sequence[Sequence[Sequence[Rival]]],
    training: NDArray[np.int64] | None = None,
) -> dict[str, Any]:
    """Rows of all groups and terminals, and what the bounds do not cover.

    ``given`` and ``rivals`` run over groups and terminals; a terminal's first rival is what
    is given. ``training``: as of ``numerics``.
    """
    validations = [sheet.validation for sheet in sheets]
    return {
        "sections": [
            section_row(sheet, t, own)
            for sheet, group in zip(sheets, given, strict=True)
            for t, own in enumerate(group)
        ],
        "compared": [
            row
            for sheet, group in zip(sheets, rivals, strict=True)
            for t, own in enumerate(group)
            if sheet.case.judged[t] or own[0].settings is not None
            for row in compared_rows(sheet, t, own)
        ],
        "feeder_false_trips": {"per_year_upper": None, "assumptions": not_covered(validations)},
        "numerics": numerics(validations, training),
    }
