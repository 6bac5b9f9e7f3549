"""Blocks from draws to counts, against asking the detector scenario by scenario."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from openphase.detector.criteria import Reason, Settings, reach_ohm, verdict
from openphase.model import load_feeder
from openphase.model.parts import Feeder, Switch
from openphase.optimise.counts import Corners, count_tensor
from openphase.studies.run.choose import gather
from openphase.studies.run.classes import REPORTED, DrawClass, Purpose, Side
from openphase.studies.run.draw import BlockId, Case, draw_scenarios, make_case
from openphase.studies.run.engine import Observed, observe
from openphase.studies.run.store import pack
from openphase.studies.run.tally import Trained, judge_block, train_block
from openphase.studies.spec.study_file import Study, default_study

SIZE = 300
MARGIN = 1.25


def block(drawn: DrawClass, number: int = 0, purpose: Purpose = Purpose.TRAIN) -> BlockId:
    return BlockId(seed=1, purpose=purpose, attempt=1, drawn=drawn, block=number)


@pytest.fixture(scope="module")
def case() -> Case:
    return make_case(load_feeder("paper"), default_study("paper"))


@pytest.fixture(scope="module")
def seen(case: Case) -> dict[DrawClass, Observed]:
    return {own: observe(case, draw_scenarios(case, block(own), SIZE)) for own in DrawClass}


@pytest.fixture(scope="module")
def trained(case: Case) -> dict[DrawClass, Trained]:
    return {own: train_block(case, block(own), SIZE) for own in DrawClass}


def must_trip(drawn: DrawClass, seen: Observed, t: int) -> np.ndarray:
    if drawn != DrawClass.OPEN_PHASE:
        return np.zeros(SIZE, np.bool_)
    return np.asarray((seen.side[t] == Side.PATH) & seen.connected)


def must_not_trip(drawn: DrawClass, seen: Observed, t: int) -> np.ndarray:
    if drawn == DrawClass.OPEN_PHASE:
        return np.asarray(seen.side[t] == Side.OUTSIDE)
    return np.full(SIZE, drawn in (DrawClass.LOAD_STEP, DrawClass.SOURCE_STEP))


def random_settings(case: Case, count: int) -> list[tuple[tuple[int, int, int], Settings]]:
    """Cells of the device's grid and their settings; half of them where things happen."""
    grid, rng = case.grid, np.random.default_rng(2)
    found = []
    for n in range(count):
        high = grid.shape if n % 2 else (7, 20, 80)
        v, i, z = (int(rng.integers(most)) for most in high)
        setting = Settings(
            i_set_a=float(grid.i_set_a[i]),
            v_set_pu=float(grid.v_set_pu[v]),
            z_set_ohm=float(grid.z_set_ohm[z]),
            negative_sign=case.study.detector.negative_sign,
        )
        found.append(((v, i, z), setting))
    return found


def everything(value: Any) -> dict[str, list[Any]]:
    return {name: array.tolist() for name, array in pack(value).items()}


@pytest.mark.parametrize("drawn", DrawClass)
def test_corners_count_what_the_verdicts_say_at_any_setting(
    case: Case,
    seen: dict[DrawClass, Observed],
    trained: dict[DrawClass, Trained],
    drawn: DrawClass,
) -> None:
    grid, own, known = case.grid, trained[drawn], seen[drawn]
    settings = random_settings(case, 200)
    trip = np.array([verdict(known.evidence, one) == Reason.TRIP for _, one in settings])
    counted = 0
    for t, terminal in enumerate(case.points.terminals):
        if terminal.load_side:
            continue
        for corners, wanted in (
            (own.opens[t], must_trip(drawn, known, t)),
            (own.false[t], must_not_trip(drawn, known, t)),
        ):
            tensor = count_tensor(grid, corners)
            expected = (trip[:, t] & wanted).sum(axis=1)
            assert [tensor[cell] for cell, _ in settings] == expected.tolist()
            counted += int(expected.sum())
    assert counted > 0 or drawn == DrawClass.OPEN_THREE


def test_stiff_corners_are_breaks_seen_through_the_margin(
    case: Case, seen: dict[DrawClass, Observed], trained: dict[DrawClass, Trained]
) -> None:
    """What is still found with I and Z raised and V lowered by the margin."""
    known, own = seen[DrawClass.OPEN_PHASE], trained[DrawClass.OPEN_PHASE]
    grid = case.grid
    reach = reach_ohm(known.evidence, True)
    for t, terminal in enumerate(case.points.terminals):
        if terminal.load_side:
            continue
        wanted = must_trip(DrawClass.OPEN_PHASE, known, t)
        tensor = count_tensor(grid, own.stiff[t])
        for cell, one in random_settings(case, 100):
            found = (
                (known.evidence.di1_a[t] / MARGIN >= one.i_set_a)
                & (known.evidence.dv1_pu[t] * MARGIN <= one.v_set_pu)
                & (reach[t] / MARGIN >= one.z_set_ohm)
            )
            assert tensor[cell] == (found & wanted).sum()


def test_fronts_are_of_events_that_must_not_trip(
    case: Case, seen: dict[DrawClass, Observed], trained: dict[DrawClass, Trained]
) -> None:
    for drawn in DrawClass:
        known = seen[drawn]
        reach = reach_ohm(known.evidence, True)
        for t, front in enumerate(trained[drawn].front):
            index = front.scenario[:, 2]
            assert must_not_trip(drawn, known, t)[index].all()
            assert (front.scenario[:, 0] == drawn).all()
            assert (front.scenario[:, 1] == 0).all()
            np.testing.assert_array_equal(front.di_a, known.evidence.di1_a[t, index])
            np.testing.assert_array_equal(front.dv_pu, known.evidence.dv1_pu[t, index])
            np.testing.assert_array_equal(front.z_ohm, reach[t, index])


def test_load_side_terminals_contribute_nothing(
    case: Case, trained: dict[DrawClass, Trained]
) -> None:
    away = [t for t, terminal in enumerate(case.points.terminals) if terminal.load_side]
    assert [case.points.terminals[t].name for t in away] == ["R2→R1", "R3→R2", "R4→R3", "R4b→R5"]
    for own in trained.values():
        for t in away:
            assert own.front[t].size == 0
            for corners in (own.opens[t], own.stiff[t], own.false[t]):
                assert corners.cell.size == 0


def test_a_break_with_nothing_beyond_it_is_told_from_the_others(
    case: Case, seen: dict[DrawClass, Observed]
) -> None:
    """With the tie open the paper's feeder ends at T6 (.9 of R3-R4) and at T3 (.5 of R4-R5)."""
    known = seen[DrawClass.OPEN_PHASE]
    count = 0
    for edge, share, connected in zip(known.edge, known.share, known.connected, strict=True):
        line, at = case.network.line_fraction(int(edge), float(share))
        empty = (line == "R3-R4" and at > 0.9) or (line == "R4-R5" and at < 0.5)
        assert connected == (not empty)
        count += empty
    assert 0 < count < SIZE
    assert not seen[DrawClass.SOURCE_STEP].connected.any()


@pytest.mark.parametrize("drawn", DrawClass)
def test_judged_blocks_count_what_the_verdicts_say(case: Case, drawn: DrawClass) -> None:
    which = block(drawn, 1, Purpose.VALIDATE)
    known = observe(case, draw_scenarios(case, which, SIZE))
    chosen = [one for _, one in random_settings(case, 30)]
    terminals = case.points.terminals
    settings = tuple(
        (None, None, None) if own.load_side else (chosen[t], None, chosen[t + 10])
        for t, own in enumerate(terminals)
    )
    tested = judge_block(case, which, settings, SIZE)
    for t, terminal in enumerate(terminals):
        trip = [
            np.zeros(SIZE, np.bool_)
            if one is None
            else verdict(known.evidence, one)[t] == Reason.TRIP
            for one in settings[t]
        ]
        opens = must_trip(drawn, known, t)
        assert tested.reachable[t] == opens.sum()
        assert tested.found[:, t].tolist() == [int((own & opens).sum()) for own in trip]
        if not terminal.load_side:
            assert tested.missed[t].sum() == (opens & ~trip[0]).sum()
        for r, own in enumerate(REPORTED):
            inside = known.side[t] != Side.OUTSIDE
            where = {
                "open_inside": known.side[t] == Side.PATH,
                "open_lateral": known.side[t] == Side.LATERAL,
            }.get(own.name, inside == (own.side == "inside"))
            members = np.asarray(where) & (own.drawn == drawn)
            assert tested.trials[r, t] == members.sum()
            assert tested.trips[:, r, t].tolist() == [int((x & members).sum()) for x in trip]
            one = settings[t][0]
            near = 0
            if one is not None:
                di1_a, dv1_pu = known.evidence.di1_a[t], known.evidence.dv1_pu[t]
                close = (di1_a > one.i_set_a / 2.0) & (dv1_pu <= one.v_set_pu)
                near = int((close & members).sum())
            assert tested.effective[r, t] == near
        bad = must_not_trip(drawn, known, t) & trip[0]
        assert set(tested.front[t].scenario[:, 2]) <= set(np.flatnonzero(bad))
        assert bool(tested.front[t].size) == bool(bad.any())


def test_sides_are_those_of_the_lines(case: Case, seen: dict[DrawClass, Observed]) -> None:
    """On the paper's feeder every section is the line of its name (R5-R4b: R4-R5)."""
    lines = ["R1-R2", "R1-R2", "R2-R3", "R2-R3", "R3-R4", "R3-R4", "R4-R5", "R4-R5"]
    known = seen[DrawClass.OPEN_PHASE]
    for n in range(SIZE):
        line, _ = case.network.line_fraction(int(known.edge[n]), float(known.share[n]))
        sides = [Side.PATH if own == line else Side.OUTSIDE for own in lines]
        assert known.side[:, n].tolist() == sides
    assert (seen[DrawClass.SOURCE_STEP].side == Side.OUTSIDE).all()


def test_blocks_are_the_same_in_any_order(case: Case) -> None:
    wanted = [block(drawn, n) for drawn in DrawClass for n in range(2)]
    forward = {which: train_block(case, which, 100) for which in wanted}
    backward = {which: train_block(case, which, 100) for which in reversed(wanted)}
    for which in wanted:
        assert everything(forward[which]) == everything(backward[which])
    one = gather(forward[which] for which in wanted)
    other = gather(backward[which] for which in reversed(wanted))
    assert everything(one) == everything(other)


def test_many_blocks_are_gathered_as_few(case: Case) -> None:
    """Merging on the way, past its step of 32 blocks, changes nothing."""
    few = [train_block(case, block(drawn), 60) for drawn in DrawClass]
    whole = gather(few * 20)
    once = gather(few)
    np.testing.assert_array_equal(whole.trials, 20 * once.trials)
    np.testing.assert_array_equal(whole.reachable, 20 * once.reachable)
    for t in range(len(case.points.terminals)):
        assert everything(whole.front[t]) == everything(once.front[t])
        for one, other in ((whole.opens[t], once.opens[t]), (whole.false[t], once.false[t])):
            expected = Corners(cell=other.cell, count=20 * other.count)
            assert everything(one) == everything(expected)


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
    tested = judge_block(case, block(DrawClass.OPEN_PHASE), settings, SIZE)
    # breaks on both halves are inside, and the profile runs over both
    profile = tested.profile[0, :, 0]
    assert profile.sum() == tested.trials[0, 0] > 20
    assert profile[:20].any()
    assert profile[20:].any()
