"""Statuses and the reasons for them, from made-up validations of the paper's feeder."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from openphase.detector.criteria import Options, Reason, Settings
from openphase.model import load_feeder
from openphase.optimise.certificate import share_of_alpha, two_sided, upper_bound
from openphase.optimise.staircase import Front, merge_fronts
from openphase.optimise.thresholds import Choice, Obstacle, Refusal
from openphase.studies.run.blocks import block_name
from openphase.studies.run.cases import Case, make_case, make_cases
from openphase.studies.run.certify import (
    Given,
    Rival,
    Sheet,
    Validation,
    alpha_of,
    compared_rows,
    judged_pairs,
    not_covered,
    section_row,
)
from openphase.studies.run.classes import FALLEN_OHM, REPORTED, DrawClass, Purpose
from openphase.studies.run.draw import BlockId
from openphase.studies.run.status import (
    loop_note,
    nearest_false_trip,
    refusal_text,
    scenario_name,
    window_of,
)
from openphase.studies.spec.device import Steps
from openphase.studies.spec.study_file import Group, default_study

HEAD, HEAD_AWAY = 0, 1  # R1→R2, R2→R1
TERMINALS, CLASSES = 8, len(REPORTED)
KINDS = np.array([own.kind for own in REPORTED])
MUST_NOT = np.flatnonzero(KINDS == "must_not_trip")
WAYS = 3  # settings side by side


def row_index(name: str, side: str) -> int:
    """The row of the table of classes."""
    (found,) = [r for r, own in enumerate(REPORTED) if (own.name, own.side) == (name, side)]
    return found


OPEN_INSIDE = row_index("open_inside", "inside")
STEP_INSIDE, STEP_UPSTREAM = (row_index("load_step", side) for side in ("inside", "upstream"))
SOURCE = row_index("source_step", "network")
OPEN_UPSTREAM = row_index("open_outside", "upstream")
WIRING = row_index("wiring", "inside")
N = 100_000
CHOICE = Choice(i_set_a=0.5, v_set_pu=0.01, z_set_ohm=20.0, detected=900, margin=1.3)
GIVEN = Given(settings=Settings(i_set_a=0.5, v_set_pu=0.01, z_set_ohm=20.0), margin=1.3)
ALPHA = share_of_alpha(0.95, 1, 4)  # .05 / 2 / 4: first attempt, four judged terminals
NONE = merge_fronts([])


@pytest.fixture(scope="module")
def case() -> Case:
    return make_case(load_feeder("paper"), default_study("paper"))


def front(*events: tuple[float, float, float, DrawClass, int, int]) -> Front:
    """Events as |ΔI1|, |ΔV1|, reach, class, block and index, all of group 0."""
    rows = np.array(events, float)
    return Front(
        di_a=rows[:, 0],
        dv_pu=rows[:, 1],
        z_ohm=rows[:, 2],
        cap_a=np.zeros(len(rows)),
        scenario=np.column_stack((rows[:, 3:], np.zeros(len(rows)))).astype(np.int64),
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
        trips=np.zeros((WAYS, CLASSES, TERMINALS), np.int64),
        alarms=np.zeros((CLASSES, TERMINALS), np.int64),
        fallen=np.zeros((2, len(FALLEN_OHM) - 1, TERMINALS, 2), np.int64),
        reachable=np.full(TERMINALS, reachable, np.int64),
        found=np.full((WAYS, TERMINALS), found, np.int64),
        missed=missed,
        profile=np.zeros((TERMINALS, 40, 2), np.int64),
        front=(NONE,) * TERMINALS,
        least_z_ohm=np.full(TERMINALS, np.inf),
        flags=np.zeros((len(DrawClass), 4), np.int64),
        scenarios=np.full(len(DrawClass), 10 * n, np.int64),
        samples=(),
    )


def with_trips(own: Validation, counts: dict[int, int], worst: Front) -> Validation:
    """False trips of the head terminal's chosen setting: so many of each class."""
    trips = own.trips.copy()
    for r, k in counts.items():
        trips[0, r, HEAD] = k
    return replace(own, trips=trips, front=(worst, *own.front[1:]))


def sheet_of(
    case: Case, own: Validation, attempt: int = 1, alpha: float | None = None, chosen: bool = True
) -> Sheet:
    return Sheet(
        case=case,
        validation=own,
        alpha=alpha_of([case], attempt) if alpha is None else alpha,
        attempt=attempt,
        chosen=chosen,
    )


def row_of(
    case: Case, own: Validation, given: Given = GIVEN, attempt: int = 1, t: int = HEAD
) -> dict[str, Any]:
    return section_row(sheet_of(case, own, attempt), t, given)


def test_set(case: Case) -> None:
    row = row_of(case, validation())
    assert row["status"] == "set"
    assert row["reason"].startswith("no false trip, finds at least 0.8")
    assert (row["opens"], row["unreachable"], row["detected"]) == (1200, 200, 900)
    assert row["dependability"] == 0.9
    assert (row["dependability_low"], row["dependability_high"]) == two_sided(900, 1000, ALPHA)
    assert (row["false_trips"], row["security_trials"]) == (0, len(MUST_NOT) * N)
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


def test_only_judged_terminals_share_alpha_in_every_group(case: Case) -> None:
    assert judged_pairs([case]) == 4
    groups = (Group(name="normal", closed=()), Group(name="tied", closed=("R4",)))
    study = replace(case.study, groups=groups)
    each = make_cases(case.feeder, study)
    assert [int(own.judged.sum()) for own in each] == [4, 8]
    assert judged_pairs(each) == 12
    assert alpha_of(each, 2) == pytest.approx(0.05 / 4 / 12)
    # with one setting for both, what looks at the source in either is live in both
    one = make_cases(case.feeder, replace(study, network=replace(study.network, settings="one")))
    assert judged_pairs(one) == 16


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
    row = row_of(case, validation(), Given(settings=None, missing="nothing keeps the margin"))
    assert row["status"] == "none"
    assert row["reason"] == "nothing keeps the margin"
    empty = "i_set_a i_set_pu v_set_pu z_set_ohm margin detected dependability dependability_low"
    empty += " dependability_high false_trips false_trip_upper nearest_false_trip"
    for key in empty.split():
        assert row[key] is None, key
    assert row["causes"] == []
    assert [own["trips"] for own in row["classes"]] == [None] * CLASSES


def test_load_side(case: Case) -> None:
    row = row_of(case, validation(), Given(settings=None), t=HEAD_AWAY)
    assert row["status"] == "load_side"
    assert "nothing behind this terminal feeds it" in row["reason"]
    assert row["i_set_a"] is row["opens"] is row["security_trials"] is None
    assert row["classes"] == []
    # in the same order of keys as any other row: the sheet's columns come from the first
    assert list(row) == list(row_of(case, validation()))


def test_a_setting_on_the_load_side_is_judged_for_false_trips_alone(case: Case) -> None:
    """That it trips falsely is worth knowing; that it does not is no merit."""
    quiet = row_of(case, validation(n=400), t=HEAD_AWAY)
    assert (quiet["status"], quiet["i_set_a"]) == ("load_side", 0.5)
    assert "no false trip, finds at least 0.8" in quiet["reason"]
    own = validation()
    trips = own.trips.copy()
    trips[0, STEP_UPSTREAM, HEAD_AWAY] = 3
    worst = front((0.6, 0.009, 25.0, DrawClass.LOAD_STEP, 3, 17))
    own = replace(own, trips=trips, front=(NONE, worst, *own.front[2:]))
    loud = row_of(case, own, t=HEAD_AWAY)
    assert loud["status"] == "not_certified"
    assert loud["reason"].startswith("3 false trips of 100000 in load steps upstream;")


def test_only_a_choice_spends_the_sample(case: Case) -> None:
    own = with_trips(
        validation(), {STEP_UPSTREAM: 2}, front((0.6, 0.009, 25.0, DrawClass.LOAD_STEP, 3, 17))
    )
    assert "spent" in section_row(sheet_of(case, own), HEAD, GIVEN)["reason"]
    assessed = section_row(sheet_of(case, own, chosen=False), HEAD, GIVEN)
    assert assessed["status"] == "not_certified"
    assert "spent" not in assessed["reason"]


def test_a_note_is_the_end_of_the_reason(case: Case) -> None:
    row = row_of(case, validation(), replace(GIVEN, note="mind the loop"))
    assert row["status"] == "set"
    assert row["reason"].endswith("; mind the loop")


def test_the_row_says_what_the_detector_looks_at(case: Case) -> None:
    row = row_of(case, validation())
    assert [row[key] for key in ("trigger", "negative_sign", "options")] == ["|dI1|", True, ""]
    options = Options(compensated=True, negative_sign=False, unbalance=0.2)
    assert GIVEN.settings is not None
    given = replace(GIVEN, settings=replace(GIVEN.settings, options=options))
    row = row_of(case, validation(), given)
    assert row["trigger"] == "min(|dI1|, |dI1*|)"
    assert row["negative_sign"] is False
    assert row["options"] == "compensated=true; unbalance=0.2"


def test_wrong_wiring_lists_its_alarms_and_no_other_class_does(case: Case) -> None:
    own = validation()
    alarms = own.alarms.copy()
    alarms[WIRING, HEAD] = 77
    rows = row_of(case, replace(own, alarms=alarms))["classes"]
    assert {row["side"]: row["alarms"] for row in rows if "alarms" in row}["inside"] == 77
    assert {row["name"] for row in rows if "alarms" in row} == {"wiring"}


def test_a_false_trip_is_named_with_its_count_class_and_worst_scenario(case: Case) -> None:
    worst = front(
        (0.6, 0.009, 25.0, DrawClass.LOAD_STEP, 3, 17),  # factor 0.9
        (1.5, 0.001, 80.0, DrawClass.LOAD_STEP, 12, 5),  # factor 1/3
    )
    row = row_of(case, with_trips(validation(), {STEP_UPSTREAM: 2}, worst), attempt=2)
    assert row["status"] == "not_certified"
    assert f"2 false trips of {N} in load steps upstream;" in row["reason"]
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
    assert f"1 false trip of {N // 10} in load steps inside, and" in row["reason"]
    assert row["false_trips"] == 10
    assert row["false_trip_upper"] == upper_bound(1, N // 10, ALPHA)


def test_the_worst_scenario_is_of_the_class_that_is_named(case: Case) -> None:
    worst = front(
        (9.0, 0.0001, 300.0, DrawClass.SOURCE_STEP, 7, 7),  # the deepest, of another class
        (0.7, 0.009, 21.0, DrawClass.LOAD_STEP, 3, 17),
    )
    own = with_trips(validation(), {SOURCE: 1, STEP_UPSTREAM: 5}, worst)
    reason = row_of(case, own)["reason"]
    assert "in load steps upstream, and some in 1 other class;" in reason
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
    trials[OPEN_UPSTREAM] = 60_000
    row = row_of(case, replace(own, trials=trials))
    assert row["false_trip_upper"] == upper_bound(0, 60_000, ALPHA)
    uppers = {c["name"] + c["side"]: c["upper"] for c in row["classes"]}
    assert uppers["open_outsideupstream"] == row["false_trip_upper"]
    assert uppers["source_stepnetwork"] == upper_bound(0, N, ALPHA)


def test_classes_that_never_come_near_are_weak_evidence(case: Case) -> None:
    own = validation()
    effective = own.effective.copy()
    effective[SOURCE, HEAD] = N // 10 - 1
    effective[STEP_UPSTREAM, HEAD] = N // 10  # not under 10 %
    row = row_of(case, replace(own, effective=effective))
    assert row["status"] == "set"
    assert "; few of the source steps come near" in row["reason"]
    assert "load" not in row["reason"]


@pytest.mark.parametrize(
    ("hollow", "words"),
    [
        ((STEP_INSIDE, OPEN_UPSTREAM), "breaks upstream and load steps inside"),
        (
            (STEP_UPSTREAM, SOURCE, OPEN_UPSTREAM),
            "breaks upstream, load steps upstream and source steps",
        ),
    ],
)
def test_a_reason_names_classes_in_words(case: Case, hollow: tuple[int, ...], words: str) -> None:
    own = validation()
    effective = own.effective.copy()
    effective[list(hollow), HEAD] = 0
    reason = row_of(case, replace(own, effective=effective))["reason"]
    assert f"few of the {words} come near" in reason


def test_a_reason_names_a_few_classes_and_counts_the_others(case: Case) -> None:
    own = validation()
    effective = own.effective.copy()
    effective[MUST_NOT, HEAD] = 0
    reason = row_of(case, replace(own, effective=effective))["reason"]
    named = ", ".join(REPORTED[r].words for r in MUST_NOT[:3])
    assert f"few of the {named} and {len(MUST_NOT) - 3} other classes come near" in reason


def test_several_bad_classes_are_counted(case: Case) -> None:
    worst = front((0.6, 0.009, 25.0, DrawClass.LOAD_STEP, 3, 17))
    own = with_trips(validation(), {STEP_UPSTREAM: 7, SOURCE: 2, OPEN_UPSTREAM: 1}, worst)
    reason = row_of(case, own)["reason"]
    assert f"7 false trips of {N} in load steps upstream, and some in 2 other classes;" in reason


def test_i_set_in_pu_has_no_float_dust(case: Case) -> None:
    assert 1.1 / 100.0 != 0.011
    given = Given(settings=Settings(i_set_a=1.1, v_set_pu=0.01, z_set_ohm=20.0))
    assert row_of(case, validation(), given)["i_set_pu"] == 0.011


def test_classes_list_their_trials_kinds_and_sides(case: Case) -> None:
    rows = row_of(case, validation())["classes"]
    assert [(c["name"], c["kind"], c["side"]) for c in rows] == [
        (own.name, own.kind, own.side) for own in REPORTED
    ]
    assert all(c["effective_trials"] == c["trials"] // 2 for c in rows)
    own = validation()
    trials = own.trials.copy()
    trials[KINDS == "apart"] = 0  # nothing told apart was drawn
    assert len(row_of(case, replace(own, trials=trials))["classes"]) == (KINDS != "apart").sum()


def test_classes_that_were_never_drawn_are_not_covered() -> None:
    own = validation()
    trials = own.trials.copy()
    trials[STEP_INSIDE] = 0  # load steps were drawn elsewhere
    trials[SOURCE] = 0
    said = not_covered([replace(own, trials=trials)])
    assert said[0] == "Not drawn, and so not covered: source steps."
    assert not any(text.startswith("Not drawn") for text in not_covered([own]))
    # another group may have drawn them
    assert not_covered([own, replace(own, trials=trials)]) == not_covered([own])


def test_causes_are_shares_of_the_missed(case: Case) -> None:
    causes = row_of(case, validation(found=600))["causes"]
    assert causes == [{"criterion": "current", "share": 0.25}, {"criterion": "sign", "share": 0.75}]


def test_the_nearest_false_trip_is_a_training_event() -> None:
    training = front(
        (0.25, 0.001, 200.0, DrawClass.LOAD_STEP, 1, 3),  # factor 2
        (0.4, 0.008, 100.0, DrawClass.SOURCE_STEP, 4, 11),  # factor 1.25
    )
    assert nearest_false_trip(CHOICE, training, 3) == {
        "class": "source_step",
        "factor": pytest.approx(1.25),
        "scenario": "train-3-source_step-00004:11",
    }
    assert nearest_false_trip(CHOICE, NONE, 3) is None


@pytest.mark.parametrize("group", [0, 2])
def test_a_scenario_is_named_after_its_block(group: int) -> None:
    which = BlockId(
        seed=9,
        purpose=Purpose.VALIDATE,
        attempt=3,
        group=group,
        drawn=DrawClass.LOAD_STEP,
        block=12,
    )
    scenario = np.array([DrawClass.LOAD_STEP, 12, 5, group])
    assert scenario_name(Purpose.VALIDATE, 3, scenario) == f"{block_name(which)}:5"
    assert ("-g2-" in block_name(which)) == bool(group)


def test_an_infinite_margin_is_null(case: Case) -> None:
    row = row_of(case, validation(), replace(GIVEN, margin=float("inf")))
    assert row["margin"] is None


def test_compared_rows_are_of_the_same_sample(case: Case) -> None:
    own = validation()
    trips, found = own.trips.copy(), own.found.copy()
    trips[2, SOURCE, HEAD] = 7
    trips[2, KINDS == "apart", HEAD] = 99
    found[2, HEAD] = 950
    rivals = (
        Rival(name="chosen", settings=GIVEN.settings),
        Rival(name="other", settings=None, missing="no such V_set"),
        Rival(name="paper", settings=Settings(i_set_a=1.0, v_set_pu=0.05, z_set_ohm=5.0)),
    )
    rows = compared_rows(sheet_of(case, replace(own, trips=trips, found=found)), HEAD, rivals)
    assert [row["name"] for row in rows] == ["chosen", "other", "paper"]
    keys = "local remote setting_group name i_set_a v_set_pu z_set_ohm detected opens unreachable"
    keys += " dependability_low dependability_high false_trips trials upper reason"
    assert all(list(row) == keys.split() for row in rows)
    # all internal breaks, as in the row of the terminal
    assert [(row["opens"], row["unreachable"]) for row in rows] == [(1200, 200)] * 3
    assert rows[0]["dependability_low"] == two_sided(900, 1000, ALPHA)[0]
    assert [row["trials"] for row in rows] == [len(MUST_NOT) * N] * 3
    assert [row["detected"] for row in rows] == [900, None, 950]
    assert [row["false_trips"] for row in rows] == [0, None, 7]
    assert rows[0]["upper"] == upper_bound(0, N, ALPHA)
    assert rows[1]["upper"] is None
    assert rows[2]["upper"] == upper_bound(7, N, ALPHA)
    assert [row["reason"] for row in rows] == [None, "no such V_set", None]


# --- why there is no setting ------------------------------------------------------------


def looped(case: Case, section: complex, loop: complex, name: str = "tied") -> Case:
    """The case with the head section in a closed loop of these impedances."""
    head, *others = case.points.terminals
    head = replace(head, line_z1_ohm=section, loop_z1_ohm=loop)
    points = replace(case.points, terminals=(head, *others))
    return replace(case, points=points, group=replace(case.group, name=name))


def test_no_margin_names_what_blocks(case: Case) -> None:
    training = front(
        (9.0, 0.001, 200.0, DrawClass.LOAD_STEP, 1, 3),
        (9.5, 0.002, 190.0, DrawClass.LOAD_STEP, 1, 4),
        (9.9, 0.002, 150.0, DrawClass.EARTH_FAULT, 1, 4),
        (0.1, 0.05, 1.0, DrawClass.SOURCE_STEP, 1, 4),  # far away
    )
    closest = Choice(i_set_a=10.0, v_set_pu=0.002, z_set_ohm=100.0, detected=3, margin=1.018)
    said = refusal_text([case], HEAD, Refusal(obstacle=Obstacle.MARGIN, closest=closest), training)
    assert said.startswith("no setting of the device keeps the margin 1.25 in training")
    assert "the most secure keeps 1.01;" in said  # never rounded up
    assert "67% of what blocks it are load steps" in said
    assert said.endswith(
        "What may help: a lower margin, or a device with larger I_set and Z_set or a smaller V_set"
    )


def test_what_blocks_is_counted_by_events_not_by_their_ways_to_trip(case: Case) -> None:
    """One step with three rows on the front, beside two earth faults with one each."""
    training = front(
        (9.0, 0.001, 200.0, DrawClass.LOAD_STEP, 1, 3),
        (9.2, 0.002, 190.0, DrawClass.LOAD_STEP, 1, 3),
        (9.3, 0.002, 180.0, DrawClass.LOAD_STEP, 1, 3),
        (9.5, 0.002, 170.0, DrawClass.EARTH_FAULT, 1, 3),
        (9.9, 0.002, 150.0, DrawClass.EARTH_FAULT, 1, 4),
    )
    closest = Choice(i_set_a=10.0, v_set_pu=0.002, z_set_ohm=100.0, detected=3, margin=1.018)
    said = refusal_text([case], HEAD, Refusal(obstacle=Obstacle.MARGIN, closest=closest), training)
    assert "67% of what blocks it are earth faults" in said


@pytest.mark.parametrize(
    ("drawn", "unbalance", "named"),
    [
        (DrawClass.ENERGISATION, 0.0, True),
        (DrawClass.MOTOR_START, 0.0, True),
        (DrawClass.ENERGISATION, 0.5, False),  # it is on, and does not help
        (DrawClass.LOAD_SWAP, 0.0, False),
    ],
)
def test_only_what_may_help_in_a_loop_is_named(
    case: Case, drawn: DrawClass, unbalance: float, named: bool
) -> None:
    """What closes inside shows the break's own value in a section of whatever length."""
    own = looped(case, 0.4, 2.2)
    detector = replace(own.study.detector, unbalance=unbalance)
    own = replace(own, study=replace(own.study, detector=detector))
    closest = Choice(i_set_a=10.0, v_set_pu=0.002, z_set_ohm=1.4, detected=3, margin=0.7)
    refusal = Refusal(obstacle=Obstacle.WINDOW_MARGIN, closest=closest)
    said = refusal_text([own], HEAD, refusal, front((20.0, 0.001, 2.0, drawn, 1, 3)))
    assert f"100% of what blocks it are {drawn.words}" in said
    assert ("the detector's option unbalance" in said) == named
    assert "an open loop" in said
    assert "would" not in said
    assert "section of" not in said
    assert "shorter" not in said


def test_a_section_that_no_length_would_help_is_not_told_to_be_shorter(case: Case) -> None:
    """A device whose least Z_set times m2 exceeds the loop: 100 x 1.25 > 2.2 Ω."""
    device = replace(case.study.device, z_set_ohm=(Steps(first=100.0, last=110.0, step=1.0),))
    own = looped(case, 0.4, 2.2)
    own = replace(own, study=replace(own.study, device=device))
    refusal = Refusal(obstacle=Obstacle.COARSE_DEVICE, closest=None)
    said = refusal_text([own], HEAD, refusal, NONE)
    assert "section of at most" not in said
    assert said.endswith("What may help: a device with a Z_set of 0.8 to 1.44 Ω, or an open loop")


def test_an_empty_window_says_what_would_open_it(case: Case) -> None:
    """Z_section .85 of a loop of 2.2 Ω: 2 x .85 = 1.7 > 1.35 / 1.25 = 1.08."""
    own = looped(case, 0.85, 2.2)
    window = window_of(own, HEAD)
    assert window is not None
    assert (window.low_ohm, window.high_ohm) == pytest.approx((1.7, 1.08))
    assert window_of(case, HEAD) is None
    said = refusal_text([own], HEAD, Refusal(obstacle=Obstacle.EMPTY_WINDOW, closest=None), NONE)
    assert "2 times the section's 0.85 Ω, that is 1.7 Ω" in said
    assert "the 1.35 Ω that a break inside shows, divided by 1.25, that is 1.08 Ω" in said
    # what it promises does help
    longest = float(said.partition("a section of at most ")[2].split()[0])
    assert 0.5 < longest < 0.85
    better = window_of(looped(case, longest, 2.2), HEAD)
    grid = np.array(case.study.device.z_grid())
    assert better is not None
    assert better.holds(grid).any()
    m1 = float(said.partition("m1 of at most ")[2].split()[0])
    margins = replace(case.study.certificate, loop_margins=(m1, 1.25))
    eased = window_of(replace(own, study=replace(case.study, certificate=margins)), HEAD)
    assert eased is not None
    assert eased.holds(grid).any()


def test_loops_of_several_groups_need_settings_of_their_own(case: Case) -> None:
    groups = [looped(case, 0.4, 2.2, "one"), looped(case, 0.4, 40.0, "two"), case]
    refusal = Refusal(obstacle=Obstacle.EMPTY_WINDOW, closest=None)
    said = refusal_text(groups, HEAD, refusal, NONE)
    assert "one: 0.8 to 1.44 Ω and two: 0.8 to 31.7 Ω" in said
    assert "settings of their own for each group" in said
    alone = refusal_text([looped(case, 0.85, 2.2), case], HEAD, refusal, NONE)
    assert "settings of their own for each group" in alone


def test_a_margin_that_only_the_window_forbids_is_told_apart(case: Case) -> None:
    own = looped(case, 0.4, 2.2)
    closest = Choice(i_set_a=10.0, v_set_pu=0.002, z_set_ohm=1.4, detected=3, margin=1.1)
    refusal = Refusal(obstacle=Obstacle.WINDOW_MARGIN, closest=closest)
    said = refusal_text([own], HEAD, refusal, NONE)
    assert "no setting of the closed loop's window of Z_set, 0.8 to 1.44 Ω, keeps" in said


@pytest.mark.parametrize(
    ("z_set_ohm", "fits"), [(0.7, False), (0.8, True), (1.4, True), (5, False)]
)
def test_a_given_z_set_that_the_loop_does_not_allow_is_noted(
    case: Case, z_set_ohm: float, fits: bool
) -> None:
    said = loop_note(looped(case, 0.4, 2.2), HEAD, z_set_ohm)
    assert (said is None) == fits
    if said:
        assert "0.8 to 1.44 Ω wanted" in said
    assert loop_note(case, HEAD, z_set_ohm) is None
