"""Statuses and the reasons for them, from made-up validations of the paper's feeder."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from openphase.detector.criteria import Reason, Settings
from openphase.model import load_feeder
from openphase.optimise.certificate import share_of_alpha, two_sided, upper_bound
from openphase.optimise.staircase import Front, merge_fronts
from openphase.optimise.thresholds import Choice
from openphase.studies.run.certify import (
    COMPARED,
    WORDS,
    Validation,
    compared_rows,
    judged,
    section_row,
)
from openphase.studies.run.classes import REPORTED, DrawClass
from openphase.studies.run.draw import Case, make_case
from openphase.studies.run.spec import default_study

HEAD, HEAD_AWAY = 0, 1  # R1→R2, R2→R1
TERMINALS, CLASSES = 8, len(REPORTED)
OPEN_INSIDE, STEP_INSIDE, STEP_OUTSIDE, SOURCE, OPEN_OUTSIDE = range(5)
N = 100_000
CHOICE = Choice(i_set_a=0.5, v_set_pu=0.01, z_set_ohm=20.0, detected=900, margin=1.3)
ALPHA = share_of_alpha(0.95, 1, 4)  # .05 / 2 / 4: first attempt, four judged terminals
NONE = merge_fronts([])


@pytest.fixture(scope="module")
def case() -> Case:
    return make_case(load_feeder("paper"), default_study("paper"))


def front(*events: tuple[float, float, float, DrawClass, int, int]) -> Front:
    rows = np.array(events, float)
    return Front(
        di_a=rows[:, 0],
        dv_pu=rows[:, 1],
        z_ohm=rows[:, 2],
        cap_a=np.zeros(len(rows)),
        scenario=rows[:, 3:].astype(np.int64),
    )


def validation(
    n: int = N, found: int = 900, reachable: int = 1000, opens: int = 1200
) -> Validation:
    """No false trip in n trials of every class; so many breaks found at every terminal."""
    trials = np.full((CLASSES, TERMINALS), n, np.int64)
    trials[OPEN_INSIDE] = opens
    missed = np.zeros((TERMINALS, len(Reason)), np.int64)
    missed[:, Reason.CURRENT] = (reachable - found) // 4
    missed[:, Reason.SIGN] = reachable - found - missed[:, Reason.CURRENT]
    return Validation(
        trials=trials,
        effective=trials // 2,
        trips=np.zeros((len(COMPARED), CLASSES, TERMINALS), np.int64),
        reachable=np.full(TERMINALS, reachable, np.int64),
        found=np.full((len(COMPARED), TERMINALS), found, np.int64),
        missed=missed,
        profile=np.zeros((TERMINALS, 40, 2), np.int64),
        front=(NONE,) * TERMINALS,
        flags=np.zeros(3, np.int64),
        scenarios=10 * n,
        samples=(),
    )


def with_trips(own: Validation, counts: dict[int, int], worst: Front) -> Validation:
    """False trips of the head terminal's chosen setting: so many of each class."""
    trips = own.trips.copy()
    for r, k in counts.items():
        trips[0, r, HEAD] = k
    return replace(own, trips=trips, front=(worst, *own.front[1:]))


def row_of(
    case: Case,
    own: Validation,
    choice: Choice | None = CHOICE,
    training: Front = NONE,
    attempt: int = 1,
    t: int = HEAD,
) -> dict[str, Any]:
    return section_row(case, t, choice, own, training, attempt)


def test_set(case: Case) -> None:
    row = row_of(case, validation())
    assert row["status"] == "set"
    assert row["reason"].startswith("no false trip, finds at least 0.8")
    assert (row["opens"], row["unreachable"], row["detected"]) == (1200, 200, 900)
    assert row["dependability"] == 0.9
    assert (row["dependability_low"], row["dependability_high"]) == two_sided(900, 1000, ALPHA)
    assert (row["false_trips"], row["security_trials"]) == (0, 4 * N)
    assert row["false_trip_upper"] == upper_bound(0, N, ALPHA)
    assert row["margin"] == 1.3
    assert row["i_set_pu"] == 0.005


@pytest.mark.parametrize("attempt", [1, 2, 5])
def test_every_attempt_has_its_own_alpha(case: Case, attempt: int) -> None:
    row = row_of(case, validation(), attempt=attempt)
    alpha = share_of_alpha(0.95, attempt, 4)
    assert alpha == pytest.approx(0.05 / 2**attempt / 4)
    assert row["false_trip_upper"] == upper_bound(0, N, alpha)
    assert row["dependability_low"] == two_sided(900, 1000, alpha)[0]


def test_only_judged_terminals_share_alpha(case: Case) -> None:
    assert judged(case.points.terminals) == 4
    closed = replace(case.study, network=replace(case.study.network, closed=("R4",)))
    assert judged(make_case(case.feeder, closed).points.terminals) == 8


def test_weak_is_decided_by_the_lower_bound(case: Case) -> None:
    low = two_sided(520, 1000, ALPHA)[0]
    assert 0.4 < low < 0.5  # although more than half were found
    row = row_of(case, validation(found=520))
    assert row["status"] == "weak"
    assert f"only {math.floor(low * 1000) / 1000:.3f}" in row["reason"]  # never rounded up
    assert "0.5 wanted" in row["reason"]
    assert row["i_set_a"] == 0.5  # printed all the same
    lenient = replace(case.study.certificate, find_at_least=0.4)
    own = replace(case, study=replace(case.study, certificate=lenient))
    assert row_of(own, validation(found=520))["status"] == "set"


def test_a_section_in_which_nothing_can_be_seen_is_weak(case: Case) -> None:
    row = row_of(case, validation(found=0, reachable=0))
    assert row["status"] == "weak"
    assert row["dependability"] is None
    assert row["unreachable"] == row["opens"]
    assert row["causes"] == []


def test_none(case: Case) -> None:
    row = row_of(case, validation(), None)
    assert row["status"] == "none"
    assert "margin 1.25" in row["reason"]
    empty = "i_set_a i_set_pu v_set_pu z_set_ohm margin detected dependability dependability_low"
    empty += " dependability_high false_trips false_trip_upper nearest_false_trip"
    for key in empty.split():
        assert row[key] is None, key
    assert row["causes"] == []
    assert [own["trips"] for own in row["classes"]] == [None] * CLASSES


def test_load_side(case: Case) -> None:
    row = row_of(case, validation(), None, t=HEAD_AWAY)
    assert row["status"] == "load_side"
    assert "nothing behind this terminal feeds it" in row["reason"]
    assert row["i_set_a"] is row["opens"] is row["security_trials"] is None
    assert row["classes"] == []
    # in the same order of keys as any other row: the sheet's columns come from the first
    assert list(row) == list(row_of(case, validation()))


def test_a_false_trip_is_named_with_its_count_class_and_worst_scenario(case: Case) -> None:
    worst = front(
        (0.6, 0.009, 25.0, DrawClass.LOAD_STEP, 3, 17),  # factor 0.9
        (1.5, 0.001, 80.0, DrawClass.LOAD_STEP, 12, 5),  # factor 1/3
    )
    row = row_of(case, with_trips(validation(), {STEP_OUTSIDE: 2}, worst), attempt=2)
    assert row["status"] == "not_certified"
    assert f"2 false trips of {N} in load steps outside;" in row["reason"]
    assert "validate-2-load_step-00012:5" in row["reason"]
    assert "spent" in row["reason"]
    assert row["false_trips"] == 2
    assert row["false_trip_upper"] == upper_bound(2, N, share_of_alpha(0.95, 2, 4))


def test_the_worst_class_is_that_of_the_highest_rate(case: Case) -> None:
    own = validation()
    trials = own.trials.copy()
    trials[SOURCE] = 10 * N
    trials[STEP_INSIDE] = N // 10
    worst = front((1.5, 0.001, 80.0, DrawClass.LOAD_STEP, 0, 0))
    own = with_trips(replace(own, trials=trials), {SOURCE: 9, STEP_INSIDE: 1}, worst)
    row = row_of(case, own)
    assert f"1 false trip of {N // 10} in load steps inside;" in row["reason"]
    assert row["false_trips"] == 10
    assert row["false_trip_upper"] == upper_bound(1, N // 10, ALPHA)


def test_the_worst_scenario_is_of_the_class_that_is_named(case: Case) -> None:
    worst = front(
        (9.0, 0.0001, 300.0, DrawClass.SOURCE_STEP, 7, 7),  # the deepest, of another class
        (0.7, 0.009, 21.0, DrawClass.LOAD_STEP, 3, 17),
    )
    own = with_trips(validation(), {SOURCE: 1, STEP_OUTSIDE: 5}, worst)
    reason = row_of(case, own)["reason"]
    assert "in load steps outside;" in reason
    assert "validate-1-load_step-00003:17" in reason


def test_trips_that_are_told_apart_are_in_neither_count(case: Case) -> None:
    own = validation()
    trips = own.trips.copy()
    for r, reported in enumerate(REPORTED):
        if reported.kind == "apart":
            trips[0, r, HEAD] = 999
    row = row_of(case, replace(own, trips=trips))
    assert row["status"] == "set"
    assert row["false_trips"] == 0


def test_found_breaks_are_no_false_trips(case: Case) -> None:
    own = validation()
    trips = own.trips.copy()
    trips[0, OPEN_INSIDE, HEAD] = 900
    assert row_of(case, replace(own, trips=trips))["status"] == "set"


def test_too_few_scenarios(case: Case) -> None:
    row = row_of(case, validation(n=400))
    assert row["status"] == "not_certified"
    bound = upper_bound(0, 400, ALPHA)
    assert f"{bound:.2g}" in row["reason"]
    assert "too few scenarios" in row["reason"]
    assert "spent" not in row["reason"]


def test_the_worst_class_bounds_the_terminal(case: Case) -> None:
    own = validation()
    trials = own.trials.copy()
    trials[OPEN_OUTSIDE] = 60_000
    row = row_of(case, replace(own, trials=trials))
    assert row["false_trip_upper"] == upper_bound(0, 60_000, ALPHA)
    uppers = {c["name"] + c["side"]: c["upper"] for c in row["classes"]}
    assert uppers["open_outsideoutside"] == row["false_trip_upper"]
    assert uppers["source_stepoutside"] == upper_bound(0, N, ALPHA)


def test_classes_that_never_come_near_are_weak_evidence(case: Case) -> None:
    own = validation()
    effective = own.effective.copy()
    effective[SOURCE, HEAD] = N // 10 - 1
    effective[STEP_OUTSIDE, HEAD] = N // 10  # not under 10 %
    row = row_of(case, replace(own, effective=effective))
    assert row["status"] == "set"
    assert "; few of the source steps come near" in row["reason"]
    assert "load" not in row["reason"]


@pytest.mark.parametrize(
    ("hollow", "words"),
    [
        ((STEP_INSIDE, OPEN_OUTSIDE), "load steps inside and breaks elsewhere"),
        (
            (STEP_OUTSIDE, SOURCE, OPEN_OUTSIDE),
            "load steps outside, source steps and breaks elsewhere",
        ),
    ],
)
def test_a_reason_names_classes_in_words(case: Case, hollow: tuple[int, ...], words: str) -> None:
    own = validation()
    effective = own.effective.copy()
    effective[list(hollow), HEAD] = 0
    reason = row_of(case, replace(own, effective=effective))["reason"]
    assert f"few of the {words} come near" in reason


def test_every_class_that_must_not_trip_has_words() -> None:
    must_not = {(own.name, own.side) for own in REPORTED if own.kind == "must_not_trip"}
    assert set(WORDS) == must_not


def test_i_set_in_pu_has_no_float_dust(case: Case) -> None:
    assert 1.1 / 100.0 != 0.011
    assert row_of(case, validation(), replace(CHOICE, i_set_a=1.1))["i_set_pu"] == 0.011


def test_classes_list_their_trials_kinds_and_sides(case: Case) -> None:
    rows = row_of(case, validation())["classes"]
    assert [(c["name"], c["kind"], c["side"]) for c in rows] == [
        (own.name, own.kind, own.side) for own in REPORTED
    ]
    assert all(c["effective_trials"] == c["trials"] // 2 for c in rows)
    own = validation()
    trials = own.trials.copy()
    trials[5:] = 0  # nothing told apart was drawn
    assert len(row_of(case, replace(own, trials=trials))["classes"]) == 5


def test_causes_are_shares_of_the_missed(case: Case) -> None:
    causes = row_of(case, validation(found=600))["causes"]
    assert causes == [{"criterion": "current", "share": 0.25}, {"criterion": "sign", "share": 0.75}]


def test_the_nearest_false_trip_is_a_training_event(case: Case) -> None:
    training = front(
        (0.25, 0.001, 200.0, DrawClass.LOAD_STEP, 1, 3),  # factor 2
        (0.4, 0.008, 100.0, DrawClass.SOURCE_STEP, 4, 11),  # factor 1.25
    )
    found = row_of(case, validation(), training=training, attempt=3)["nearest_false_trip"]
    assert found == {
        "class": "source_step",
        "factor": pytest.approx(1.25),
        "scenario": "train-3-source_step-00004:11",
    }
    assert row_of(case, validation())["nearest_false_trip"] is None


def test_an_infinite_margin_is_null(case: Case) -> None:
    row = row_of(case, validation(), replace(CHOICE, margin=float("inf")))
    assert row["margin"] is None


def test_compared_rows_are_of_the_same_sample(case: Case) -> None:
    own = validation()
    trips, found = own.trips.copy(), own.found.copy()
    trips[2, SOURCE, HEAD] = 7
    trips[2, 5:, HEAD] = 99  # told apart
    found[2, HEAD] = 950
    chosen = Settings(i_set_a=0.5, v_set_pu=0.01, z_set_ohm=20.0)
    paper = Settings(i_set_a=1.0, v_set_pu=0.05, z_set_ohm=5.0)
    rows = compared_rows(
        case, HEAD, (chosen, None, paper), replace(own, trips=trips, found=found), 1
    )
    assert [row["name"] for row in rows] == list(COMPARED)
    keys = "local remote name i_set_a v_set_pu z_set_ohm detected opens unreachable"
    keys += " dependability_low dependability_high false_trips trials upper reason"
    assert all(list(row) == keys.split() for row in rows)
    # all internal breaks, as in the row of the terminal
    assert [(row["opens"], row["unreachable"]) for row in rows] == [(1200, 200)] * 3
    assert rows[0]["dependability_low"] == two_sided(900, 1000, ALPHA)[0]
    assert [row["trials"] for row in rows] == [4 * N] * 3
    assert [row["detected"] for row in rows] == [900, None, 950]
    assert [row["false_trips"] for row in rows] == [0, None, 7]
    assert rows[0]["upper"] == upper_bound(0, N, ALPHA)
    assert rows[1]["upper"] is None
    assert rows[2]["upper"] == upper_bound(7, N, ALPHA)


@pytest.mark.parametrize(
    ("v_set_pct", "why"),
    [
        ((0.5, 1.0, 5.0), "no setting with V_set 5 % keeps the margin 1.25"),
        ((0.5, 1.0), "the device has no V_set of 5 %"),
    ],
)
def test_a_missing_setting_to_compare_says_why(
    case: Case, v_set_pct: tuple[float, ...], why: str
) -> None:
    device = replace(case.study.device, v_set_pct=v_set_pct)
    own = replace(case, study=replace(case.study, device=device))
    paper = Settings(i_set_a=1.0, v_set_pu=0.05, z_set_ohm=5.0)
    rows = compared_rows(own, HEAD, (None, None, paper), validation(), 1)
    assert [row["reason"] for row in rows] == ["no setting keeps the margin 1.25", why, None]
