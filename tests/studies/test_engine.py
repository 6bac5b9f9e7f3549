"""Blocks from draws to counts, against asking the detector scenario by scenario.

On the paper's feeder, and on one that has everything, in a state of the network that is not
its normal one.
"""

from __future__ import annotations

import functools
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.brute_settings import brute_front
from oracles.whole import whole_feeder, whole_study

from openphase.detector.criteria import Options, Reason, Settings, reach_of, verdict
from openphase.model import load_feeder
from openphase.model.parts import Feeder, Switch
from openphase.model.states import NOT_CONVERGED
from openphase.optimise.counts import Grid, count_tensor
from openphase.studies.run import tally
from openphase.studies.run.choose import gather
from openphase.studies.run.classes import FALLEN, REPORTED, DrawClass, Purpose, Side
from openphase.studies.run.draw import BlockId, Case, draw_scenarios, make_case, make_cases
from openphase.studies.run.engine import Observed, observe
from openphase.studies.run.store import pack
from openphase.studies.run.tally import FLAGGED, Trained, judge_block, train_block
from openphase.studies.run.verdicts import unpack_verdicts
from openphase.studies.spec.study_file import Group, Study, default_study

SIZE = 250
MARGIN = 1.25
SMALL = Grid(
    i_set_a=np.array([0.1, 0.3, 0.6, 1.0, 2.0, 5.0]),
    v_set_pu=np.array([0.002, 0.01, 0.05]),
    z_set_ohm=np.array([0.5, 1.5, 5.0, 20.0, 100.0]),
)

NETWORK = {"SOURCE_STEP", "TIE_SWITCHING", "TRANSFER", "DER_RAMP"}
APART = {"OPEN_THREE", "WIRING"}
APART_INSIDE = {"SINGLE_POLE", "FALLEN_SOURCE_SIDE", "FALLEN_LOAD_SIDE"}
APART_INSIDE |= {"OPEN_WITH_LOAD_STEP", "OPEN_WITH_DER_TRIP"}

BOTH = [("paper", drawn) for drawn in DrawClass if "DER" not in drawn.name]
BOTH = [one for one in BOTH if one[1] != DrawClass.REGULATOR_TAP]
BOTH += [("whole", drawn) for drawn in DrawClass]
KINDS = ["paper", "whole"]


@functools.cache
def case_of(kind: str) -> Case:
    if kind == "paper":
        return make_case(load_feeder("paper"), default_study("paper"))
    feeder = whole_feeder(4)
    return make_cases(feeder, whole_study(feeder))[1]


def block(
    case: Case, drawn: DrawClass, number: int = 0, purpose: Purpose = Purpose.TRAIN
) -> BlockId:
    return BlockId(
        seed=1, purpose=purpose, attempt=1, drawn=drawn, block=number, group=case.group.index
    )


def look(case: Case, which: BlockId, *options: Options) -> Observed:
    return observe(case, draw_scenarios(case, which, SIZE), *options)


@functools.cache
def seen_of(kind: str, drawn: DrawClass) -> Observed:
    case = case_of(kind)
    return look(case, block(case, drawn), case.study.detector.options())


@functools.cache
def trained_of(kind: str, drawn: DrawClass) -> Trained:
    case = replace(case_of(kind), grid=SMALL)
    return train_block(case, block(case, drawn), SIZE)


def must_trip(case: Case, drawn: DrawClass, seen: Observed, t: int) -> NDArray[np.bool_]:
    """Breaks on the path with something beyond them, where the terminal looks at the source."""
    if drawn != DrawClass.OPEN_PHASE or case.points.terminals[t].load_side:
        return np.zeros(SIZE, np.bool_)
    solved = seen.flags & NOT_CONVERGED == 0
    return np.asarray((seen.side[t] == Side.PATH) & seen.connected & case.judged[t] & solved)


def must_not_trip(case: Case, drawn: DrawClass, seen: Observed, t: int) -> NDArray[np.bool_]:
    """By the contract's list, and apart from the table of classes."""
    inside = np.isin(seen.side[t], [Side.PATH, Side.LATERAL])
    if drawn.name in APART or not case.judged[t]:
        return np.zeros(SIZE, np.bool_)
    if drawn == DrawClass.OPEN_PHASE or drawn.name in APART_INSIDE:
        return np.asarray(~inside)
    return np.ones(SIZE, np.bool_)


def settings_of(grid: Grid) -> list[tuple[tuple[int, int, int], Settings]]:
    """Every cell of a grid with its setting."""
    return [
        (
            (v, i, z),
            Settings(
                i_set_a=float(grid.i_set_a[i]),
                v_set_pu=float(grid.v_set_pu[v]),
                z_set_ohm=float(grid.z_set_ohm[z]),
            ),
        )
        for v, i, z in np.ndindex(grid.shape)
    ]


def everything(value: Any) -> dict[str, list[Any]]:
    return {name: array.tolist() for name, array in pack(value).items()}


# --- training --------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "drawn"), BOTH)
def test_corners_count_what_the_verdicts_say_at_every_setting(kind: str, drawn: DrawClass) -> None:
    case, own, known = case_of(kind), trained_of(kind, drawn), seen_of(kind, drawn)
    cells = settings_of(SMALL)
    trip = np.array([verdict(known.evidence, one) == Reason.TRIP for _, one in cells])
    for t in range(len(case.points.terminals)):
        for corners, wanted in (
            (own.opens[t], must_trip(case, drawn, known, t)),
            (own.false[t], must_not_trip(case, drawn, known, t)),
        ):
            tensor = count_tensor(SMALL, corners)
            expected = (trip[:, t] & wanted).sum(axis=1)
            assert [tensor[cell] for cell, _ in cells] == expected.tolist()


@pytest.mark.parametrize("kind", KINDS)
def test_the_sample_trips_by_the_sequence_and_by_the_phases(kind: str) -> None:
    """What the counts above are compared on would prove little if nothing tripped."""
    for drawn in (DrawClass.OPEN_PHASE, DrawClass.LOAD_STEP):
        evidence = seen_of(kind, drawn).evidence
        by_phases = without = 0
        for _, one in settings_of(SMALL):
            alone = replace(one, options=Options(fallback=False))
            trip = verdict(evidence, one) == Reason.TRIP
            without += int((verdict(evidence, alone) == Reason.TRIP).sum())
            by_phases += int((trip & (evidence.di1_a < one.i_set_a)).sum())
        assert without > 100
        assert by_phases > 100


@pytest.mark.parametrize("kind", KINDS)
def test_stiff_corners_are_breaks_seen_through_the_margin(kind: str) -> None:
    """What is still found where every I and Z is smaller, and every V larger, by the margin."""
    case, drawn = case_of(kind), DrawClass.OPEN_PHASE
    assert case.study.certificate.margin == MARGIN
    known, own = seen_of(kind, drawn), trained_of(kind, drawn)
    shrunk = replace(
        known.evidence,
        di_a=known.evidence.di_a / MARGIN,
        dv_pu=known.evidence.dv_pu * MARGIN,
        z_ohm=known.evidence.z_ohm / MARGIN,
    )
    counted = 0
    for cell, one in settings_of(SMALL):
        trip = verdict(shrunk, one) == Reason.TRIP
        for t in range(len(case.points.terminals)):
            expected = int((trip[t] & must_trip(case, drawn, known, t)).sum())
            assert count_tensor(SMALL, own.stiff[t])[cell] == expected
            counted += expected
    assert counted > 0


@pytest.mark.parametrize(("kind", "drawn"), BOTH)
def test_fronts_are_what_nothing_outdoes_of_events_that_must_not_trip(
    kind: str, drawn: DrawClass
) -> None:
    case, known = case_of(kind), seen_of(kind, drawn)
    reach = reach_of(known.evidence, case.study.detector.options())
    for t, front in enumerate(trained_of(kind, drawn).front):
        index = front.scenario[:, 2]
        assert must_not_trip(case, drawn, known, t)[index].all()
        assert (front.scenario[:, [0, 1, 3]] == [drawn, 0, case.group.index]).all()
        # every row of a front is a row of its event
        rows = np.stack([reach.di_a[t], reach.dv_pu[t], reach.z_ohm[t]])[:, :, index]
        own = np.stack([front.di_a, front.dv_pu, front.z_ohm])[:, None]
        caps = np.broadcast_to(reach.di_a[t, :1, index].T, rows.shape[1:]).copy()
        caps[0] = 0.0
        assert ((rows == own).all(axis=0) & (caps == front.cap_a)).any(axis=0).all()


@pytest.mark.parametrize("drawn", [DrawClass.LOAD_STEP, DrawClass.OPEN_PHASE, DrawClass.LINE_FAULT])
def test_fronts_are_those_of_comparing_each_with_each(drawn: DrawClass) -> None:
    case, size = case_of("whole"), 60
    which = block(case, drawn)
    own = train_block(case, which, size)
    seen = observe(case, draw_scenarios(case, which, size), case.study.detector.options())
    reach = reach_of(seen.evidence, case.study.detector.options())
    for t, front in enumerate(own.front):
        wanted = np.flatnonzero(_must_not(case, drawn, seen, t))
        names = np.array([[int(drawn), 0, n, case.group.index] for n in wanted.tolist()], np.int64)
        events = tuple(x[t][:, wanted] for x in (reach.di_a, reach.dv_pu, reach.z_ohm))
        found = sorted(
            (tuple(name), row)
            for name, *row in zip(
                front.scenario.tolist(),
                front.di_a,
                front.dv_pu,
                front.z_ohm,
                front.cap_a,
                strict=True,
            )
        )
        brute = sorted((name, list(row)) for row, name in brute_front(events, names.reshape(-1, 4)))
        assert found == brute


def _must_not(case: Case, drawn: DrawClass, seen: Observed, t: int) -> NDArray[np.bool_]:
    outside = ~np.isin(seen.side[t], [Side.PATH, Side.LATERAL])
    chosen = outside if drawn == DrawClass.OPEN_PHASE else np.ones_like(outside)
    return np.asarray(chosen & case.judged[t])


def test_terminals_that_are_not_judged_contribute_nothing() -> None:
    case = case_of("paper")
    away = [t for t, judged in enumerate(case.judged) if not judged]
    names = [case.points.terminals[t].name for t in away]
    assert names == ["R2→R1", "R3→R2", "R4→R3", "R4b→R5"]
    for drawn in case.drawn:
        own = trained_of("paper", drawn)
        for t in away:
            assert own.front[t].size == 0
            for corners in (own.opens[t], own.stiff[t], own.false[t]):
                assert corners.cell.size == 0


def test_with_one_setting_for_all_a_terminal_is_judged_where_it_looks_away_too() -> None:
    """It keeps its setting there: false trips count, breaks that it cannot see do not."""
    feeder, base = load_feeder("paper"), default_study("paper")
    study = replace(
        base,
        network=replace(base.network, closed=None),
        groups=(
            Group(name="normal"),
            Group(name="moved", closed=("R4",), opened=("R1",)),  # all is fed by R5
        ),
        detector=replace(base.detector, negative_sign=False),  # or it would save most of them
    )
    one = replace(study, network=replace(study.network, settings="one"))
    apart, together = make_cases(feeder, study), make_cases(feeder, one)
    away = [np.array([t.load_side for t in case.points.terminals]) for case in apart]
    for n, case in enumerate(apart):
        np.testing.assert_array_equal(case.judged, ~away[n])
        np.testing.assert_array_equal(together[n].judged, ~(away[0] & away[1]))
    case = together[1]
    turned = np.flatnonzero(away[1] & ~away[0])
    assert [case.points.terminals[t].name for t in turned] == ["R1→R2", "R2→R3", "R3→R4"]
    steps, breaks = (
        train_block(case, block(case, drawn), SIZE)
        for drawn in (DrawClass.LOAD_STEP, DrawClass.OPEN_PHASE)
    )
    lax = Settings(i_set_a=0.1, v_set_pu=0.05, z_set_ohm=0.1, options=one.detector.options())
    tripped = np.zeros(away[1].size, np.bool_)
    for number in range(4):
        which = block(case, DrawClass.OPEN_PHASE, number)
        everywhere = look(case, which, one.detector.options())
        trips = verdict(everywhere.evidence, lax) == Reason.TRIP
        inside = everywhere.side == Side.PATH
        tripped |= (trips & inside & everywhere.connected).any(axis=1)
    for t in turned[1:]:
        assert count_tensor(case.grid, steps.false[t]).any()
        assert tripped[t]
        assert not breaks.opens[t].cell.size


@pytest.mark.parametrize(("kind", "drawn"), BOTH)
def test_trials_are_all_events_each_in_one_class(kind: str, drawn: DrawClass) -> None:
    own, known = trained_of(kind, drawn), seen_of(kind, drawn)
    assert (own.trials.sum(axis=0) == SIZE).all()
    others = [r for r, row in enumerate(REPORTED) if row.drawn != drawn]
    assert not own.trials[others].any()
    for r, row in enumerate(REPORTED):
        if row.drawn == drawn and row.side == "network":
            assert (own.trials[r] == SIZE).all()
        elif row.drawn == drawn:
            np.testing.assert_array_equal(own.trials[r], np.isin(known.side, row.where).sum(axis=1))


# --- judging ---------------------------------------------------------------------------


def random_settings(case: Case, count: int) -> list[Settings]:
    """Some settings of the device; half of them where things happen."""
    grid, rng = case.grid, np.random.default_rng(2)
    found = []
    for n in range(count):
        high = grid.shape if n % 2 else (7, 20, 80)
        v, i, z = (int(rng.integers(most)) for most in high)
        found.append(
            Settings(
                i_set_a=float(grid.i_set_a[i]),
                v_set_pu=float(grid.v_set_pu[v]),
                z_set_ohm=float(grid.z_set_ohm[z]),
                options=OPTIONS[n % len(OPTIONS)],
            )
        )
    return found


OPTIONS = (
    Options(),
    Options(fallback=False),
    Options(negative_sign=False),
    Options(any_sequence=True, unbalance=0.2),
    Options(compensated=True, direction=True, both_ends="no_small_z"),
)


@functools.cache
def chosen_of(kind: str) -> tuple[tuple[Settings | None, ...], ...]:
    """Three settings a terminal, some of them none."""
    chosen, count = random_settings(case_of(kind), 30), len(case_of(kind).points.terminals)
    pairs = [(chosen[t], None, chosen[t + 10]) for t in range(count)]
    return ((None, None, None), *pairs[1:])


@functools.cache
def judged_of(kind: str, drawn: DrawClass) -> tuple[tally.Tested, Observed]:
    case = case_of(kind)
    which = block(case, drawn, 1, Purpose.VALIDATE)
    return judge_block(case, which, chosen_of(kind), SIZE), look(case, which, *OPTIONS)


@pytest.mark.parametrize(("kind", "drawn"), BOTH)
def test_judged_blocks_count_what_the_verdicts_say(kind: str, drawn: DrawClass) -> None:
    case, (tested, known) = case_of(kind), judged_of(kind, drawn)
    alarm = known.evidence.alarm
    assert alarm is not None
    for t, settings in enumerate(chosen_of(kind)):
        reasons = [
            np.full(SIZE, Reason.BLOCKED) if one is None else verdict(known.evidence, one)[t]
            for one in settings
        ]
        breaks = np.full(SIZE, drawn == DrawClass.OPEN_PHASE) & (known.side[t] == Side.PATH)
        opens = breaks & known.connected
        # a break without a solution is no find
        reasons = [
            np.where(opens & (known.flags & NOT_CONVERGED != 0), Reason.BLOCKED, own)
            for own in reasons
        ]
        trip = [own == Reason.TRIP for own in reasons]
        assert tested.reachable[t] == opens.sum()
        assert tested.found[:, t].tolist() == [int((own & opens).sum()) for own in trip]
        missed = np.bincount(reasons[0][opens & ~trip[0]], minlength=len(Reason))
        np.testing.assert_array_equal(tested.missed[t], missed)
        for r, own in enumerate(REPORTED):
            members = np.isin(known.side[t], own.where) & (own.drawn == drawn)
            assert tested.trials[r, t] == members.sum()
            assert tested.trips[:, r, t].tolist() == [int((x & members).sum()) for x in trip]
            assert tested.alarms[r, t] == ((alarm[t] != 0) & members).sum()
            near, one = 0, settings[0]
            if one is not None:
                # by any row that its options judge by
                rows = range(4 if one.options.fallback else 1)
                close = np.zeros(SIZE, np.bool_)
                for k in rows:
                    moved = known.evidence.di_a[t, k] > one.i_set_a / 2.0
                    if k:  # phases stand in below the threshold only
                        moved &= known.evidence.di_a[t, 0] < one.i_set_a
                    close |= moved & (known.evidence.dv_pu[t, k] <= one.v_set_pu)
                near = int((close & members & ~known.evidence.blocked[t]).sum())
            assert tested.effective[r, t] == near
        everywhere = replace(case, judged=np.ones_like(case.judged))
        bad = must_not_trip(everywhere, drawn, known, t) & trip[0]
        assert set(tested.front[t].scenario[:, 2]) <= set(np.flatnonzero(bad))
        assert bool(tested.front[t].size) == bool(bad.any())
        reason, side, reachable = unpack_verdicts(tested.verdicts[t])
        np.testing.assert_array_equal(reason, reasons[0])
        np.testing.assert_array_equal(side, known.side[t])
        np.testing.assert_array_equal(reachable, (known.side[t] == Side.PATH) & known.connected)


@pytest.mark.parametrize(("kind", "drawn"), BOTH)
def test_judged_blocks_add_up(kind: str, drawn: DrawClass) -> None:
    tested, known = judged_of(kind, drawn)
    assert (tested.trials.sum(axis=0) == SIZE).all()
    for part in (tested.effective, tested.alarms, *tested.trips):
        assert (part >= 0).all()
        assert (part <= tested.trials).all()
    np.testing.assert_array_equal(tested.found[0] + tested.missed.sum(axis=1), tested.reachable)
    assert not tested.missed[:, Reason.TRIP].any()
    assert (tested.found <= tested.reachable).all()
    (breaks,) = (r for r, own in enumerate(REPORTED) if own.name == "open_inside")
    np.testing.assert_array_equal(tested.profile[..., 0].sum(axis=1), tested.trials[breaks])
    np.testing.assert_array_equal(tested.profile[..., 1].sum(axis=1), tested.trips[0, breaks])
    assert (tested.profile[..., 1] <= tested.profile[..., 0]).all()
    bits = [int((known.flags & bit != 0).sum()) for bit in FLAGGED]
    assert tested.flags.tolist() == bits
    assert not tested.trips[1].any()  # no setting never trips
    np.testing.assert_array_equal(tested.sample_side, known.side[:, : tested.sample.shape[-1]])


@pytest.mark.parametrize("kind", KINDS)
def test_pictures_show_the_first_events_by_the_setting_s_own_options(kind: str) -> None:
    tested, known = judged_of(kind, DrawClass.OPEN_PHASE)
    kept = tested.sample.shape[-1]
    for t, (one, *_) in enumerate(chosen_of(kind)):
        reach = reach_of(known.evidence, one.options if one else Options(fallback=False))
        reason = np.full(SIZE, Reason.BLOCKED) if one is None else verdict(known.evidence, one)[t]
        size = np.abs(known.evidence.z1_ohm[t])
        rows = (reach.di_a[t, 0], reach.dv_pu[t, 0], size, reach.z_ohm[t, 0], reason)
        np.testing.assert_array_equal(tested.sample[t], np.stack(rows)[:, :kept])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("drawn", [*FALLEN, DrawClass.OPEN_PHASE, DrawClass.EARTH_FAULT])
def test_fallen_conductors_inside_are_counted_by_their_resistance(
    kind: str, drawn: DrawClass
) -> None:
    case, (tested, known) = case_of(kind), judged_of(kind, drawn)
    if drawn not in FALLEN:
        assert not tested.fallen.any()
        return
    event = draw_scenarios(case, block(case, drawn, 1, Purpose.VALIDATE), SIZE).event
    source_side = drawn == DrawClass.FALLEN_SOURCE_SIDE
    lies = event.earth_after_s if source_side else event.fallen_after_s
    ohm = 1.0 / np.abs(lies).max(axis=0)
    reason = unpack_verdicts(tested.verdicts)[0]
    for t in range(len(case.points.terminals)):
        inside = np.isin(known.side[t], [Side.PATH, Side.LATERAL])
        for b, (low, high) in enumerate(pairwise([0.0, 100.0, 500.0, np.inf])):
            own = inside & (ohm >= low) & (ohm < high)
            counts = [own.sum(), (own & (reason[t] == Reason.TRIP)).sum()]
            assert tested.fallen[FALLEN.index(drawn), b, t].tolist() == counts
    others = [n for n, own in enumerate(FALLEN) if own != drawn]
    assert not tested.fallen[others].any()
    assert tested.fallen[..., 1].any()


def test_alarms_are_for_wrong_wiring() -> None:
    for kind in KINDS:
        tested, _ = judged_of(kind, DrawClass.WIRING)
        assert tested.alarms.sum() > 0.1 * tested.trials.sum()
        tested, _ = judged_of(kind, DrawClass.LOAD_STEP)
        assert tested.alarms.sum() <= 0.01 * tested.trials.sum()


# --- places, order, merging ------------------------------------------------------------


def test_a_break_with_nothing_beyond_it_is_told_from_the_others() -> None:
    """With the tie open the paper's feeder ends at T6 (.9 of R3-R4) and at T3 (.5 of R4-R5)."""
    case, known = case_of("paper"), seen_of("paper", DrawClass.OPEN_PHASE)
    count = 0
    for edge, share, connected in zip(known.edge, known.share, known.connected, strict=True):
        line, at = case.network.line_fraction(int(edge), float(share))
        empty = (line == "R3-R4" and at > 0.9) or (line == "R4-R5" and at < 0.5)
        assert connected == (not empty)
        count += empty
    assert 0 < count < SIZE
    assert not seen_of("paper", DrawClass.SOURCE_STEP).connected.any()


def test_sides_are_those_of_the_lines() -> None:
    """On the paper's feeder every section is the line of its name (R5-R4b: R4-R5)."""
    sections = ("R1-R2", "R2-R3", "R3-R4", "R4-R5")
    case, known = case_of("paper"), seen_of("paper", DrawClass.OPEN_PHASE)

    def side(own: str, line: str) -> Side:
        if own == line:
            return Side.PATH
        if "R4-R5" in (own, line):
            return Side.OTHER
        return Side.DOWNSTREAM if sections.index(line) > sections.index(own) else Side.UPSTREAM

    for n in range(SIZE):
        line, _ = case.network.line_fraction(int(known.edge[n]), float(known.share[n]))
        assert known.side[::2, n].tolist() == [side(own, line) for own in sections]
        np.testing.assert_array_equal(known.side[::2, n], known.side[1::2, n])
    assert (seen_of("paper", DrawClass.SOURCE_STEP).side == Side.NOWHERE).all()


@pytest.mark.parametrize("kind", KINDS)
def test_blocks_are_the_same_in_any_order(kind: str) -> None:
    case = replace(case_of(kind), grid=SMALL)
    wanted = [block(case, drawn, n) for drawn in case.drawn for n in range(2)]
    forward = {which: train_block(case, which, 50) for which in wanted}
    backward = {which: train_block(case, which, 50) for which in reversed(wanted)}
    for which in wanted:
        assert everything(forward[which]) == everything(backward[which])
    one = gather(forward[which] for which in wanted)
    other = gather(backward[which] for which in reversed(wanted))
    assert everything(one) == everything(other)


def test_a_judged_block_is_the_same_again() -> None:
    for drawn in case_of("whole").drawn:
        case = case_of("whole")
        which = block(case, drawn, 1, Purpose.VALIDATE)
        again = judge_block(make_cases(case.feeder, case.study)[1], which, chosen_of("whole"), SIZE)
        first, _ = judged_of("whole", drawn)
        for name, values in pack(first).items():
            assert values.tobytes() == pack(again)[name].tobytes()


def test_many_blocks_are_gathered_as_few() -> None:
    """Merging on the way, past its step of 32 blocks, changes nothing."""
    case = case_of("paper")
    few = [trained_of("paper", drawn) for drawn in case.drawn]
    whole, once = gather(few * 4), gather(few)
    np.testing.assert_array_equal(whole.trials, 4 * once.trials)
    np.testing.assert_array_equal(whole.reachable, 4 * once.reachable)
    for t in range(len(case.points.terminals)):
        assert everything(whole.front[t]) == everything(once.front[t])
        for one, other in ((whole.opens[t], once.opens[t]), (whole.false[t], once.false[t])):
            np.testing.assert_array_equal(count_tensor(SMALL, one), 4 * count_tensor(SMALL, other))


def with_a_switch(feeder: Feeder) -> Feeder:
    """The paper's feeder with a closed sectionalising switch in the middle of R1-R2."""
    first, *others = feeder.lines
    half = first.length_km / 2.0
    upper = replace(first, to_bus="X", length_km=half)
    lower = replace(first, name="X-R2", from_bus="Y", length_km=half)
    switch = Switch(name="S", from_bus="X", to_bus="Y", closed=True)
    return replace(
        feeder,
        lines=(upper, lower, *others),
        switches=(*feeder.switches, switch),
        transformers=feeder.transformers[1:],
        loads=feeder.loads[1:],
    )


def test_a_closed_switch_inside_a_section_is_part_of_the_way() -> None:
    case = make_case(with_a_switch(load_feeder("paper")), Study())
    setting = Settings(i_set_a=1.0, v_set_pu=0.05, z_set_ohm=5.0)
    settings = tuple((setting,) for _ in case.points.terminals)
    tested = judge_block(case, block(case, DrawClass.OPEN_PHASE), settings, SIZE)
    # breaks on both halves are inside, and the profile runs over both
    profile = tested.profile[0, :, 0]
    assert profile.sum() == tested.trials[0, 0] > 20
    assert profile[:20].any()
    assert profile[20:].any()
