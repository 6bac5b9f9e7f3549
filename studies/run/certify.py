"""Validation: what an untouched sample says about chosen settings, and each terminal's status."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...detector.criteria import Reason, Settings
from ...model.points import Terminal
from ...optimise.certificate import share_of_alpha, two_sided, upper_bound
from ...optimise.staircase import Front, factors, merge_fronts, nearest
from ...optimise.thresholds import Choice
from .classes import REPORTED, DrawClass, Purpose
from .draw import BlockId, Case
from .spec import Study
from .tally import Tested

__all__ = [
    "COMPARED",
    "NOT_BUILT",
    "Validation",
    "add_up",
    "compared_rows",
    "judged",
    "section_row",
]

#: what the certificate of this version does not cover
NOT_BUILT = (
    "Only the classes listed per terminal are drawn. Faults with intact conductors, regulator "
    "taps, capacitor and motor switching, tie switching and transfer, PV, energisation and "
    "reclosing are not: the bounds say nothing about them.",
    "Ratio and angle errors of CTs and VTs, and clock errors, are not drawn: only the random "
    "error stated above.",
    "Rare false trips are sampled, not hunted.",
    "ΔT and the operate delay are carried in the sheet, and not judged: one frame before the "
    "event and one after it stand for all.",
    "Event classes have no rates, so there are no false trips per year.",
    "One setting group; each study has one state of its switches.",
)

BEST_AT_REFERENCE = "best at reference V_set"
COMPARED = ("chosen", BEST_AT_REFERENCE, "reference")

#: the criteria in the order in which a verdict names the first that fails
CAUSES = (Reason.BLOCKED, Reason.CURRENT, Reason.VOLTAGE, Reason.IMPEDANCE, Reason.SIGN)

#: the classes that must not trip, as a reason names them
WORDS = {
    ("load_step", "inside"): "load steps inside",
    ("load_step", "outside"): "load steps outside",
    ("source_step", "outside"): "source steps",
    ("open_outside", "outside"): "breaks elsewhere",
}

FEW_EFFECTIVE = 0.1  #: below this share of effective trials, zero trips show little


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Validation:
    """All validation blocks together."""

    trials: NDArray[np.int64]  #: (R, T)
    effective: NDArray[np.int64]  #: (R, T)
    trips: NDArray[np.int64]  #: (K, R, T)
    reachable: NDArray[np.int64]  #: (T,)
    found: NDArray[np.int64]  #: (K, T)
    missed: NDArray[np.int64]  #: (T, Reason)
    profile: NDArray[np.int64]  #: (T, PLACES, 2)
    front: tuple[Front, ...]
    flags: NDArray[np.int64]  #: (3,)
    scenarios: int
    samples: tuple[tuple[BlockId, NDArray[np.float64], NDArray[np.int8]], ...]  #: for pictures


#: drawn classes as reasons name them
DRAWN_WORDS = {
    DrawClass.OPEN_PHASE: "breaks elsewhere",
    DrawClass.LOAD_STEP: "load steps",
    DrawClass.SOURCE_STEP: "source steps",
    DrawClass.OPEN_THREE: "three-phase breaks",
}

#: how a reported class is drawn
CLASS_IDS = {own.name: int(own.drawn) for own in REPORTED}

#: what simply adds up over blocks
ADDED = ("trials", "effective", "trips", "reachable", "found", "missed", "profile", "flags")

SAMPLED_BLOCKS = 25  #: blocks of a class whose kept evidence goes into pictures


def add_up(blocks: Iterable[tuple[BlockId, Tested]], size: int) -> Validation:
    """Add blocks of ``size`` scenarios; memory does not grow with their number."""
    total: dict[str, Any] = {}
    front: tuple[Front, ...] = ()
    samples: list[tuple[BlockId, NDArray[np.float64], NDArray[np.int8]]] = []
    count = 0
    for which, block in blocks:
        count += size
        for name in ADDED:
            total[name] = total.get(name, 0) + getattr(block, name)
        pairs = zip(front, block.front, strict=True) if front else ()
        front = tuple(merge_fronts(list(pair)) for pair in pairs) or block.front
        if which.block < SAMPLED_BLOCKS:
            samples.append((which, block.sample, block.sample_side))
    return Validation(front=front, scenarios=count, samples=tuple(samples), **total)


def judged(terminals: tuple[Terminal, ...]) -> int:
    """How many terminals share the error probability."""
    return sum(not terminal.load_side for terminal in terminals)


def scenario_name(purpose: Purpose, attempt: int, scenario: NDArray[np.int64]) -> str:
    """A scenario's identity: purpose-attempt-class-block:index."""
    drawn, block, index = (int(n) for n in scenario)
    stem = f"{purpose.name.lower()}-{attempt}-{DrawClass(drawn).name.lower()}-{block:05d}"
    return f"{stem}:{index}"


def section_row(
    case: Case,
    t: int,
    choice: Choice | None,
    validation: Validation,
    training_front: Front,
    attempt: int,
) -> dict[str, Any]:
    """What the result says about one directed terminal."""
    terminal, study = case.points.terminals[t], case.study
    alpha = share_of_alpha(study.certificate.confidence, attempt, judged(case.points.terminals))
    row: dict[str, Any] = {
        "local": terminal.local,
        "remote": terminal.remote,
        "setting_group": "all",
        "status": "",
        "reason": "",
        "i_set_a": choice.i_set_a if choice else None,
        "i_set_pu": round(choice.i_set_a / study.device.ct_primary_a, 10) if choice else None,
        "v_set_pu": choice.v_set_pu if choice else None,
        "z_set_ohm": choice.z_set_ohm if choice else None,
        "dt_ms": study.detector.dt_ms,
        "delay_ms": study.detector.delay_ms,
        "trigger": "|dI1|",
        "negative_sign": study.detector.negative_sign,
        "line_z1_ohm": [terminal.line_z1_ohm.real, terminal.line_z1_ohm.imag],
        "margin": choice.margin if choice and math.isfinite(choice.margin) else None,
    }
    if terminal.load_side:
        row |= _no_evidence() | {
            "status": "load_side",
            "reason": "with the section cut, nothing behind this terminal feeds it",
        }
        return row
    classes = [_class_row(r, t, choice, validation, alpha) for r in range(len(REPORTED))]
    classes = [own for own in classes if own["trials"]]
    must_not = [own for own in classes if own["kind"] == "must_not_trip"]
    opens = int(validation.trials[0, t])
    reachable = int(validation.reachable[t])
    found = int(validation.found[0, t]) if choice else 0
    low, high = two_sided(found, reachable, alpha)
    row |= {
        "opens": opens,
        "unreachable": opens - reachable,
        "detected": found if choice else None,
        "dependability": found / reachable if choice and reachable else None,
        "dependability_low": low if choice else None,
        "dependability_high": high if choice else None,
        "security_trials": sum(own["trials"] for own in must_not),
        "false_trips": sum(own["trips"] for own in must_not) if choice else None,
        "false_trip_upper": max((own["upper"] for own in must_not), default=1.0)
        if choice
        else None,
        "false_trips_per_year_upper": None,
        "classes": classes,
        "causes": _causes(validation.missed[t]) if choice else [],
        "nearest_false_trip": _nearest(choice, training_front, attempt) if choice else None,
        "fixes": [],
    }
    if choice is None:
        row["status"], row["reason"] = "none", _no_setting(case, training_front)
    else:
        front = validation.front[t]
        row["status"], row["reason"] = _status(case, row, must_not, front, attempt)
    return row


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
            "security_trials",
            "false_trips",
            "false_trip_upper",
            "false_trips_per_year_upper",
        )
    )
    return empty | {"classes": [], "causes": [], "nearest_false_trip": None, "fixes": []}


def _class_row(
    r: int, t: int, choice: Choice | None, validation: Validation, alpha: float
) -> dict[str, Any]:
    own = REPORTED[r]
    trials, trips = int(validation.trials[r, t]), int(validation.trips[0, r, t])
    return {
        "name": own.name,
        "kind": own.kind,
        "side": own.side,
        "trials": trials,
        "effective_trials": int(validation.effective[r, t]) if choice else None,
        "trips": trips if choice else None,
        "upper": upper_bound(trips, trials, alpha) if choice else None,
    }


def _causes(missed: NDArray[np.int64]) -> list[dict[str, Any]]:
    """Shares of the missed breaks by the first criterion that failed."""
    total = int(missed.sum())
    return [
        {"criterion": reason.name.lower(), "share": int(missed[reason]) / total}
        for reason in CAUSES
        if missed[reason]
    ]


def _nearest(choice: Choice, front: Front, attempt: int) -> dict[str, Any] | None:
    """The training event that the setting comes closest to tripping in."""
    n, factor = nearest(front, choice.i_set_a, choice.v_set_pu, choice.z_set_ohm)
    if n < 0:
        return None
    return {
        "class": DrawClass(int(front.scenario[n, 0])).name.lower(),
        "factor": factor,
        "scenario": scenario_name(Purpose.TRAIN, attempt, front.scenario[n]),
    }


def _status(
    case: Case, row: dict[str, Any], must_not: list[dict[str, Any]], front: Front, attempt: int
) -> tuple[str, str]:
    """The status and the reason for it, of a terminal that has settings."""
    demand = case.study.certificate
    note = _weak_evidence(must_not)
    if row["false_trips"]:
        worst = max(must_not, key=lambda own: own["trips"] / own["trials"])
        of_worst = front.scenario[:, 0] == CLASS_IDS[worst["name"]]
        front = front.where(of_worst) if of_worst.any() else front
        n, _ = nearest(front, row["i_set_a"], row["v_set_pu"], row["z_set_ohm"])
        return "not_certified", (
            f"{worst['trips']} false trip{'s' if worst['trips'] > 1 else ''} of "
            f"{worst['trials']} in {_words(worst)}; worst scenario "
            f"{scenario_name(Purpose.VALIDATE, attempt, front.scenario[n])}; "
            "this sample is spent: run again with a new --seed"
        )
    if row["false_trip_upper"] > demand.target:
        return "not_certified", (
            f"no false trip, but the bound {row['false_trip_upper']:.2g} per event is above the "
            f"target {demand.target:.2g}: too few scenarios{note}"
        )
    sure = math.floor(row["dependability_low"] * 1000) / 1000
    if row["dependability_low"] >= demand.find_at_least:
        return "set", f"no false trip, finds at least {sure:.3f}{note}"
    return "weak", (
        f"no false trip, but finds only {sure:.3f} for sure, {demand.find_at_least:g} wanted{note}"
    )


def _weak_evidence(must_not: list[dict[str, Any]]) -> str:
    """A note that names the classes whose events hardly ever came near the thresholds."""
    hollow = [
        _words(own) for own in must_not if own["effective_trials"] < FEW_EFFECTIVE * own["trials"]
    ]
    if not hollow:
        return ""
    names = " and ".join(filter(None, [", ".join(hollow[:-1]), hollow[-1]]))
    return f"; few of the {names} come near the thresholds: their zero is weak evidence"


def _no_setting(case: Case, front: Front) -> str:
    """Why no setting keeps the margin: what the strictest one keeps, and what blocks it."""
    device, demand = case.study.device, case.study.certificate
    strictest = (device.i_grid()[-1], device.v_grid_pu()[0], device.z_grid()[-1])
    each = factors(front, *(np.array([value]) for value in strictest))[:, 0]
    blocking = front.scenario[each < demand.margin, 0]
    said = f"no setting of the device keeps the margin {demand.margin:g} in training"
    if not blocking.size:
        return said
    drawn = DrawClass(int(np.bincount(blocking).argmax()))
    share = float((blocking == drawn).mean())
    return (
        f"{said}: the strictest keeps {math.floor(each.min() * 100) / 100:g}; {share:.0%} of what "
        f"blocks it are {DRAWN_WORDS[drawn]}. A lower margin, or a device with larger I_set and "
        "Z_set or a smaller V_set, would help"
    )


def _words(own: dict[str, Any]) -> str:
    """A class and its side in words."""
    return WORDS[own["name"], own["side"]]


def compared_rows(
    case: Case,
    t: int,
    settings: tuple[Settings | None, ...],
    validation: Validation,
    attempt: int,
) -> list[dict[str, Any]]:
    """The chosen setting beside others, on the same validation sample."""
    terminal = case.points.terminals[t]
    alpha = share_of_alpha(
        case.study.certificate.confidence, attempt, judged(case.points.terminals)
    )
    must_not = [r for r, own in enumerate(REPORTED) if own.kind == "must_not_trip"]
    rows = []
    opens, reachable = int(validation.trials[0, t]), int(validation.reachable[t])
    for k, own in enumerate(settings):
        found = int(validation.found[k, t])
        low, high = two_sided(found, reachable, alpha)
        bounds = [
            upper_bound(int(validation.trips[k, r, t]), int(validation.trials[r, t]), alpha)
            for r in must_not
            if validation.trials[r, t]
        ]
        rows.append(
            {
                "local": terminal.local,
                "remote": terminal.remote,
                "name": COMPARED[k],
                "i_set_a": own.i_set_a if own else None,
                "v_set_pu": own.v_set_pu if own else None,
                "z_set_ohm": own.z_set_ohm if own else None,
                "detected": found if own else None,
                "opens": opens,
                "unreachable": opens - reachable,
                "dependability_low": low if own else None,
                "dependability_high": high if own else None,
                "false_trips": int(validation.trips[k, must_not, t].sum()) if own else None,
                "trials": int(validation.trials[must_not, t].sum()),
                "upper": max(bounds, default=1.0) if own else None,
                "reason": None if own else _missing(case.study, COMPARED[k]),
            }
        )
    return rows


def _missing(study: Study, name: str) -> str:
    """Why there is no setting of this name to compare."""
    margin = f"keeps the margin {study.certificate.margin:g}"
    if name != BEST_AT_REFERENCE:
        return f"no setting {margin}"
    wanted = study.reference.v_set_pct
    if not np.isclose(study.device.v_grid_pu(), wanted / 100.0).any():
        return f"the device has no V_set of {wanted:.10g} %"
    return f"no setting with V_set {wanted:.10g} % {margin}"
