"""Draws: whose random stream they come from, and the laws that the study names.

Seeds are fixed. Shares must lie within 5 standard errors, and a Kolmogorov-Smirnov p above
0.001; ranges hold for every single draw.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kstest

from openphase.model import load_feeder
from openphase.model.network import CONNECTIONS
from openphase.studies.run.classes import DrawClass, Purpose
from openphase.studies.run.draw import BlockId, Case, Scenarios, draw_scenarios, make_case, stream
from openphase.studies.spec.study_file import LoadDraw, TransformerDraw, default_study

N = 6000
FIRST = BlockId(
    seed=1, purpose=Purpose.TRAIN, attempt=1, drawn=DrawClass.LOAD_STEP, block=0
)  # fmt: skip


@pytest.fixture(scope="module")
def case() -> Case:
    return make_case(load_feeder("paper"), default_study("paper"))


@pytest.fixture(scope="module")
def drawn(case: Case) -> dict[DrawClass, Scenarios]:
    return {own: draw_scenarios(case, replace(FIRST, drawn=own), N) for own in DrawClass}


@pytest.fixture(scope="module")
def steps(drawn: dict[DrawClass, Scenarios]) -> Scenarios:
    return drawn[DrawClass.LOAD_STEP]


def assert_share(chosen: Any, expected: float) -> None:
    error = math.sqrt(expected * (1.0 - expected) / chosen.size)
    assert abs(chosen.mean() - expected) < 5.0 * error


def assert_uniform(values: NDArray[np.float64], low: float, high: float) -> None:
    assert values.min() >= low
    assert values.max() <= high
    assert kstest(values, "uniform", args=(low, high - low)).pvalue > 1e-3


def same(one: Scenarios, other: Scenarios) -> bool:
    pairs = [*zip(one.before, other.before, strict=True), *zip(one.after, other.after, strict=True)]
    pairs += [(one.v_error, other.v_error), (one.i_error, other.i_error)]
    return all(np.array_equal(a, b) for a, b in pairs)


def along_lines(case: Case, scenarios: Scenarios) -> list[tuple[str, float]]:
    """Line and fraction of every event."""
    event = scenarios.event
    pairs = zip(event.edge.tolist(), event.share.tolist(), strict=True)
    return [case.network.line_fraction(edge, share) for edge, share in pairs]


# --- streams ---------------------------------------------------------------------------


@pytest.mark.parametrize("own", DrawClass)
def test_a_block_depends_on_what_it_is_only(case: Case, own: DrawClass) -> None:
    which = replace(FIRST, drawn=own, block=3)
    first = draw_scenarios(case, which, 50)
    draw_scenarios(case, replace(which, block=4), 50)
    np.random.default_rng(0).random(7)
    assert same(first, draw_scenarios(case, which, 50))
    assert same(first, draw_scenarios(make_case(case.feeder, case.study), which, 50))


@pytest.mark.parametrize(
    "other",
    [
        replace(FIRST, seed=2),
        replace(FIRST, purpose=Purpose.VALIDATE),
        replace(FIRST, purpose=Purpose.HUNT),
        replace(FIRST, attempt=2),
        replace(FIRST, drawn=DrawClass.SOURCE_STEP),
        replace(FIRST, block=1),
    ],
)
def test_every_part_of_its_name_makes_another_stream(case: Case, other: BlockId) -> None:
    one, two = draw_scenarios(case, FIRST, 200), draw_scenarios(case, other, 200)
    assert not np.intersect1d(one.before.load_scale, two.before.load_scale).size
    assert not np.intersect1d(one.v_error, two.v_error).size


def test_the_stream_is_the_one_of_the_contract() -> None:
    """spawn_key=(purpose, attempt, class, block): purpose first, or two verbs share draws."""
    which = BlockId(
        seed=9, purpose=Purpose.VALIDATE, attempt=3, drawn=DrawClass.OPEN_THREE, block=5
    )
    seeds = np.random.SeedSequence(9, spawn_key=(2, 3, 3, 5))
    expected = np.random.Generator(np.random.SFC64(seeds)).random(5)
    np.testing.assert_array_equal(stream(which).random(5), expected)


def test_purposes_and_classes_keep_their_numbers() -> None:
    """They are part of every stream: append only."""
    names = ["TRAIN", "HUNT", "VALIDATE", "PLACE", "SENSITIVITY"]
    assert [purpose.name for purpose in Purpose][:5] == names
    assert [int(purpose) for purpose in Purpose] == list(range(len(Purpose)))
    names = ["OPEN_PHASE", "LOAD_STEP", "SOURCE_STEP", "OPEN_THREE"]
    assert [own.name for own in DrawClass][:4] == names
    assert [int(own) for own in DrawClass] == list(range(len(DrawClass)))


# --- the feeder's state ----------------------------------------------------------------


@pytest.mark.parametrize("own", DrawClass)
def test_loads(drawn: dict[DrawClass, Scenarios], own: DrawClass) -> None:
    scale = drawn[own].before.load_scale
    assert scale.min() >= 0.25 * 0.8
    assert scale.max() <= 1.0 * 1.2
    # the common level cancels between two loads, the own factor does not
    assert scale.max(axis=0).min() < 0.4
    ratio = scale[0] / scale[1]
    assert ratio.min() >= 0.8 / 1.2
    assert ratio.max() <= 1.2 / 0.8
    assert np.corrcoef(np.log(scale[0]), np.log(scale[1]))[0, 1] > 0.7


def test_load_level_and_own_factor_are_uniform(case: Case) -> None:
    for loads in (
        LoadDraw(level=(0.25, 1.0), each=(1.0, 1.0)),
        LoadDraw(level=(1.0, 1.0), each=(0.8, 1.2)),
    ):
        own = replace(case, study=replace(case.study, loads=loads))
        scale = draw_scenarios(own, FIRST, N).before.load_scale
        if loads.each == (1.0, 1.0):
            np.testing.assert_array_equal(scale, np.broadcast_to(scale[0], scale.shape))
            assert_uniform(scale[0], 0.25, 1.0)
        else:
            assert_uniform(scale.ravel(), 0.8, 1.2)
            assert abs(np.corrcoef(scale[0], scale[1])[0, 1]) < 5.0 / math.sqrt(N)


def test_exponents_lie_around_a_common_one_and_are_clipped(steps: Scenarios) -> None:
    exponent = steps.before.exponent
    assert exponent.min() == 0.0  # clipped: reached exactly
    assert exponent.max() == 2.0
    assert np.ptp(exponent, axis=0).max() <= 0.6
    assert np.ptp(exponent, axis=0).mean() > 0.3
    assert np.corrcoef(exponent[0], exponent[1])[0, 1] > 0.8
    # P(common + spread <= 0) = E[max(spread, 0)] / 2 = 0.3 / 4 / 2
    assert_share(exponent[0] == 0.0, 0.0375)
    assert_share(exponent[0] == 2.0, 0.0375)


def test_exponents_stay_between_the_frames(steps: Scenarios) -> None:
    np.testing.assert_array_equal(steps.before.exponent, steps.after.exponent)
    np.testing.assert_array_equal(steps.before.connection, steps.after.connection)


def test_yg_d_units_come_in_order_each_count_as_likely(case: Case, steps: Scenarios) -> None:
    is_yg_d = steps.before.connection == CONNECTIONS["Yg/D"]
    units = [case.network.units.index(name) for name in ("T4", "T5", "T6")]
    others = [n for n in range(is_yg_d.shape[0]) if n not in units]
    assert not is_yg_d[others].any()
    count = is_yg_d.sum(axis=0)
    for n in (1, 2, 3):
        assert_share(count == n, 1.0 / 3.0)
        # T4 first, then T5, then T6
        assert is_yg_d[units[:n]][:, count == n].all()
    file = np.repeat(case.network.connection[others, None], N, axis=1)
    np.testing.assert_array_equal(steps.before.connection[others], file)


@pytest.mark.parametrize("count", [(0, 0), (2, 2), (1, 2)])
def test_yg_d_count_is_within_its_range(case: Case, count: tuple[int, int]) -> None:
    draw = TransformerDraw(yg_d=("T6", "T5"), yg_d_count=count)
    own = make_case(case.feeder, replace(case.study, transformers=draw))
    connection = draw_scenarios(own, FIRST, 500).before.connection
    is_yg_d = connection == CONNECTIONS["Yg/D"]
    units = [own.network.units.index(name) for name in ("T6", "T5", "T4")]
    drawn_count = is_yg_d[units[:2]].sum(axis=0)
    assert set(drawn_count) == set(range(count[0], count[1] + 1))
    assert (is_yg_d[units[0]] >= is_yg_d[units[1]]).all()
    assert is_yg_d[units[2]].all()  # what is not in question is as in the file


@pytest.mark.parametrize("own", DrawClass)
def test_ambient_changes_lie_between_the_frames(
    case: Case, drawn: dict[DrawClass, Scenarios], own: DrawClass
) -> None:
    one = drawn[own]
    assert (one.before.emf_pu == case.network.emf_pu).all()
    source = one.after.emf_pu / one.before.emf_pu / one.event.emf_factor - 1.0
    assert_uniform(source, -0.003 - 1e-12, 0.003 + 1e-12)
    load = one.after.load_scale / one.before.load_scale - 1.0
    assert_uniform(load.ravel(), -0.01 - 1e-12, 0.01 + 1e-12)
    assert abs(np.corrcoef(load[0], load[1])[0, 1]) < 5.0 / math.sqrt(N)
    assert abs(np.corrcoef(source, load[0])[0, 1]) < 5.0 / math.sqrt(N)


@pytest.mark.parametrize("own", DrawClass)
def test_instruments_err_anew_in_each_frame_point_phase_and_scenario(
    case: Case, drawn: dict[DrawClass, Scenarios], own: DrawClass
) -> None:
    for error in (drawn[own].v_error, drawn[own].i_error):
        assert error.shape == (2, len(case.points.names), 3, N)
        assert np.abs(error).max() <= 1.0 + 1e-15
        assert np.unique(error).size == error.size
        assert abs(np.mean(error[0] * error[1].conj())) < 0.01


# --- events ----------------------------------------------------------------------------


def test_load_steps_have_the_size_and_phases_of_the_study(steps: Scenarios) -> None:
    event = steps.event
    total = event.step_before_w.sum(axis=0) + event.step_after_w.sum(axis=0)
    assert_uniform(total, 10e3 * (1 - 1e-12), 500e3 * (1 + 1e-12))
    phases = (event.step_before_w + event.step_after_w > 0).sum(axis=0)
    assert set(phases) == {1, 3}
    assert_share(phases == 1, 0.5)
    single = (event.step_before_w + event.step_after_w)[:, phases == 1]
    for phase in range(3):
        assert_share(single[phase] > 0, 1.0 / 3.0)
    balanced = (event.step_before_w + event.step_after_w)[:, phases == 3]
    np.testing.assert_allclose(balanced, np.broadcast_to(balanced[0], balanced.shape))


def test_load_steps_are_on_or_off(steps: Scenarios) -> None:
    on = (steps.event.step_after_w > 0).any(axis=0)
    off = (steps.event.step_before_w > 0).any(axis=0)
    assert (on != off).all()
    assert_share(on, 0.5)
    v = 12_000.0 / math.sqrt(3.0)
    for state, watts in (
        (steps.before, steps.event.step_before_w),
        (steps.after, steps.event.step_after_w),
    ):
        np.testing.assert_allclose(state.step_y_s, watts / v**2)


def test_load_steps_have_their_own_exponent(steps: Scenarios) -> None:
    exponent = steps.event.step_exponent
    assert_uniform(exponent, 0.0, 2.0)
    common = steps.before.exponent.mean(axis=0)
    assert abs(np.corrcoef(exponent, common)[0, 1]) < 5.0 / math.sqrt(N)


def test_load_steps_are_equally_likely_in_every_section_and_uniform_in_each(
    case: Case, steps: Scenarios
) -> None:
    """Each of the paper's sections is one line, so its fraction is the distance."""
    places = along_lines(case, steps)
    for line in ("R1-R2", "R2-R3", "R3-R4", "R4-R5"):
        here = np.array([name == line for name, _ in places])
        assert_share(here, 0.25)
        assert_uniform(np.array([at for name, at in places if name == line]), 0.0, 1.0)


@pytest.mark.parametrize("own", [DrawClass.OPEN_PHASE, DrawClass.OPEN_THREE])
def test_breaks_are_uniform_in_length_over_all_lines(
    case: Case, drawn: dict[DrawClass, Scenarios], own: DrawClass
) -> None:
    starts = {"R1-R2": (0.0, 3.0), "R2-R3": (3.0, 5.0), "R3-R4": (8.0, 5.0), "R4-R5": (13.0, 10.0)}
    km = [starts[name][0] + at * starts[name][1] for name, at in along_lines(case, drawn[own])]
    assert_uniform(np.array(km), 0.0, 23.0)


def test_breaks_open_one_phase_or_two(drawn: dict[DrawClass, Scenarios]) -> None:
    mask = drawn[DrawClass.OPEN_PHASE].event.open_mask
    for one, two in ((0b001, 0b011), (0b010, 0b110), (0b100, 0b101)):
        assert_share(mask == one, 0.8 / 3.0)
        assert_share(mask == two, 0.2 / 3.0)
    assert set(mask) == {1, 2, 4, 3, 6, 5}
    assert set(drawn[DrawClass.OPEN_THREE].event.open_mask) == {0b111}


def test_breaks_happen_at_t_0_and_nothing_else_does(drawn: dict[DrawClass, Scenarios]) -> None:
    for own in (DrawClass.OPEN_PHASE, DrawClass.OPEN_THREE):
        one = drawn[own]
        assert not one.before.open_mask.any()
        np.testing.assert_array_equal(one.after.open_mask, one.event.open_mask)
        assert (one.event.emf_factor == 1.0).all()
        assert not one.before.step_y_s.any()
        assert not one.after.step_y_s.any()
    steps = drawn[DrawClass.LOAD_STEP]
    assert not steps.after.open_mask.any()
    assert (steps.event.emf_factor == 1.0).all()


def test_source_steps_stand_nowhere_and_move_all_phases(
    drawn: dict[DrawClass, Scenarios],
) -> None:
    event = drawn[DrawClass.SOURCE_STEP].event
    assert_uniform(event.emf_factor, 0.95, 1.05)
    assert (event.edge == -1).all()
    assert not drawn[DrawClass.SOURCE_STEP].after.open_mask.any()
    assert not drawn[DrawClass.SOURCE_STEP].after.step_y_s.any()
