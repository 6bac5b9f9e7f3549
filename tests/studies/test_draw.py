"""Draws: whose random stream they come from, and the laws that the study names.

Seeds are fixed. Shares must lie within 5 standard errors, and a Kolmogorov-Smirnov p above
0.001; ranges hold for every single draw. Every class on a feeder that has all it takes is
drawn in test_draw_classes.py.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kstest

from openphase.model import load_feeder
from openphase.model.distributions import Fixed, Integers, Uniform
from openphase.model.network import CONNECTIONS
from openphase.studies.run.classes import DrawClass, Purpose
from openphase.studies.run.draw import BlockId, Case, Scenarios, draw_scenarios, make_case, stream
from openphase.studies.spec.events import CLASSES
from openphase.studies.spec.study_file import LoadDraw, TransformerDraw, default_study

N = 6000
FIRST = BlockId(
    seed=1, purpose=Purpose.TRAIN, attempt=1, drawn=DrawClass.LOAD_STEP, block=0
)  # fmt: skip

IMPOSSIBLE = {
    DrawClass.REGULATOR_TAP,
    DrawClass.DER_TRIP,
    DrawClass.DER_RAMP,
    DrawClass.OPEN_WITH_DER_TRIP,
}
#: what the paper's feeder can have
DRAWN = [own for own in DrawClass if own not in IMPOSSIBLE]
BREAKS = [DrawClass.OPEN_PHASE, DrawClass.OPEN_THREE]


@pytest.fixture(scope="module")
def case() -> Case:
    return make_case(load_feeder("paper"), default_study("paper"))


@pytest.fixture(scope="module")
def drawn(case: Case) -> dict[DrawClass, Scenarios]:
    return {own: draw_scenarios(case, replace(FIRST, drawn=own), N) for own in DRAWN}


@pytest.fixture(scope="module")
def steps(drawn: dict[DrawClass, Scenarios]) -> Scenarios:
    return drawn[DrawClass.LOAD_STEP]


def assert_share(chosen: Any, expected: float) -> None:
    error = math.sqrt(expected * (1.0 - expected) / chosen.size)
    assert abs(chosen.mean() - expected) < 5.0 * error


def assert_uniform(values: NDArray[np.floating[Any]], low: float, high: float) -> None:
    assert values.min() >= low
    assert values.max() <= high
    assert kstest(values, "uniform", args=(low, high - low)).pvalue > 1e-3


def arrays(scenarios: Scenarios) -> list[NDArray[Any]]:
    """Everything that was drawn."""
    found = [*scenarios.before, *scenarios.after, scenarios.der_model, *scenarios.miswired]
    for part in (scenarios.event, scenarios.errors):
        found += [getattr(part, field.name) for field in fields(part)]
    return found


def same(one: Scenarios, other: Scenarios) -> bool:
    pairs = zip(arrays(one), arrays(other), strict=True)
    return all(np.array_equal(a, b) for a, b in pairs)


def along_lines(case: Case, scenarios: Scenarios) -> list[tuple[str, float]]:
    """Line and fraction of every event."""
    event = scenarios.event
    pairs = zip(event.edge.tolist(), event.share.tolist(), strict=True)
    return [case.network.line_fraction(edge, share) for edge, share in pairs]


# --- streams ---------------------------------------------------------------------------


@pytest.mark.parametrize("own", DRAWN)
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
        replace(FIRST, group=1),
        replace(FIRST, group=2),
    ],
)
def test_every_part_of_its_name_makes_another_stream(case: Case, other: BlockId) -> None:
    one, two = draw_scenarios(case, FIRST, 200), draw_scenarios(case, other, 200)
    assert not np.intersect1d(one.before.load_scale, two.before.load_scale).size
    assert not np.intersect1d(one.errors.v_noise, two.errors.v_noise).size


def test_the_stream_is_the_one_of_the_contract() -> None:
    """spawn_key=(purpose, attempt, class, block): purpose first, or two verbs share draws."""
    which = BlockId(
        seed=9, purpose=Purpose.VALIDATE, attempt=3, drawn=DrawClass.OPEN_THREE, block=5
    )
    for group, key in ((0, (2, 3, 3, 5)), (4, (2, 3, 3, 5, 4))):
        seeds = np.random.SeedSequence(9, spawn_key=key)
        expected = np.random.Generator(np.random.SFC64(seeds)).random(5)
        np.testing.assert_array_equal(stream(replace(which, group=group)).random(5), expected)


def test_purposes_and_classes_keep_their_numbers() -> None:
    """They are part of every stream: append only."""
    assert [(own.name, int(own)) for own in Purpose] == [
        ("TRAIN", 0),
        ("HUNT", 1),
        ("VALIDATE", 2),
        ("PLACE", 3),
        ("SENSITIVITY", 4),
    ]
    numbers = {
        **{"OPEN_PHASE": 0, "LOAD_STEP": 1, "SOURCE_STEP": 2, "OPEN_THREE": 3},
        **{"CAPACITOR_STEP": 4, "MOTOR_START": 5, "REGULATOR_TAP": 6, "EARTH_FAULT": 7},
        **{"LINE_FAULT": 8, "TIE_SWITCHING": 9, "TRANSFER": 10, "DER_TRIP": 11, "DER_RAMP": 12},
        **{"ENERGISATION": 13, "RECLOSING": 14, "SINGLE_POLE": 15, "FALLEN_SOURCE_SIDE": 16},
        **{"FALLEN_LOAD_SIDE": 17, "OPEN_WITH_LOAD_STEP": 18, "OPEN_WITH_DER_TRIP": 19},
        **{"LOAD_SWAP": 20, "STEP_WITH_TAP": 21, "WIRING": 22},
    }
    assert {own.name: int(own) for own in DrawClass} == numbers
    assert [own.name.lower() for own in DrawClass] == list(CLASSES)


def test_what_the_feeder_cannot_have_is_not_drawn(case: Case) -> None:
    assert case.drawn == tuple(DRAWN)
    events = replace(case.study.events, without=("wiring", "load_swap"))
    fewer = make_case(case.feeder, replace(case.study, events=events))
    assert set(DRAWN) - set(fewer.drawn) == {DrawClass.WIRING, DrawClass.LOAD_SWAP}
    still = replace(case.study.events.tie_switching, states=())
    events = replace(case.study.events, tie_switching=still)
    assert (
        DrawClass.TIE_SWITCHING
        not in make_case(case.feeder, replace(case.study, events=events)).drawn
    )


# --- the feeder's state ----------------------------------------------------------------


@pytest.mark.parametrize("own", DRAWN)
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
    one = Fixed(value=1.0)
    level = LoadDraw(level=Uniform(low=0.25, high=1.0), each=one)
    own = replace(case, study=replace(case.study, loads=level))
    scale = draw_scenarios(own, FIRST, N).before.load_scale
    np.testing.assert_array_equal(scale, np.broadcast_to(scale[0], scale.shape))
    assert_uniform(scale[0], 0.25, 1.0)
    each = LoadDraw(level=one, each=Uniform(low=0.8, high=1.2))
    own = replace(case, study=replace(case.study, loads=each))
    scale = draw_scenarios(own, FIRST, N).before.load_scale
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
    least, most = count
    draw = TransformerDraw(yg_d=("T6", "T5"), yg_d_count=Integers(least=least, most=most))
    own = make_case(case.feeder, replace(case.study, transformers=draw))
    connection = draw_scenarios(own, FIRST, 500).before.connection
    is_yg_d = connection == CONNECTIONS["Yg/D"]
    units = [own.network.units.index(name) for name in ("T6", "T5", "T4")]
    drawn_count = is_yg_d[units[:2]].sum(axis=0)
    assert set(drawn_count) == set(range(least, most + 1))
    assert (is_yg_d[units[0]] >= is_yg_d[units[1]]).all()
    assert is_yg_d[units[2]].all()  # what is not in question is as in the file


@pytest.mark.parametrize("own", DRAWN)
def test_ambient_changes_lie_between_the_frames(
    case: Case, drawn: dict[DrawClass, Scenarios], own: DrawClass
) -> None:
    one = drawn[own]
    assert (one.before.emf_pu == case.network.emf_pu).all()
    source = one.after.emf_pu / one.before.emf_pu / one.event.emf_factor - 1.0
    assert_uniform(source, -0.003 - 1e-12, 0.003 + 1e-12)
    load = one.after.load_scale / one.before.load_scale / one.event.load_factor - 1.0
    assert_uniform(load.ravel(), -0.01 - 1e-12, 0.01 + 1e-12)
    assert abs(np.corrcoef(load[0], load[1])[0, 1]) < 5.0 / math.sqrt(N)
    assert abs(np.corrcoef(source, load[0])[0, 1]) < 5.0 / math.sqrt(N)


@pytest.mark.parametrize("own", DRAWN)
def test_instruments_err_anew_at_every_point_and_in_every_scenario(
    case: Case, drawn: dict[DrawClass, Scenarios], own: DrawClass
) -> None:
    errors, points = drawn[own].errors, len(case.points.names)
    for noise in (errors.v_noise, errors.i_noise):
        assert noise.shape == (2, points, 3, N)
        assert np.abs(noise).max() <= 1.0 + 1e-15
        assert np.unique(noise).size == noise.size
        assert abs(np.mean(noise[0] * noise[1].conj())) < 0.01
    lasting = (errors.v_ratio, errors.v_angle, errors.i_ratio, errors.i_angle)
    assert {error.shape for error in lasting} == {(points, 3, N)}
    assert errors.clock.shape == (points, N)
    assert errors.frequency.shape == (N,)
    for error in (*lasting, errors.clock, errors.frequency):
        assert np.abs(error).max() <= 1.0


def test_what_lasts_of_the_errors_is_uniform_and_independent(steps: Scenarios) -> None:
    errors = steps.errors
    clock = np.repeat(errors.clock[:, None], 3, axis=1)
    rows = [errors.v_ratio, errors.v_angle, errors.i_ratio, errors.i_angle]
    for error in (*rows, errors.clock, errors.frequency):
        assert_uniform(error.ravel(), -1.0, 1.0)
    for one, other in itertools.combinations([*rows, clock], 2):
        assert abs(np.corrcoef(one[0, 0], other[0, 0])[0, 1]) < 5.0 / math.sqrt(N)
    for error in rows:
        between = (error[0, 0], error[0, 1]), (error[0, 0], error[1, 0])
        for one, other in between:
            assert abs(np.corrcoef(one, other)[0, 1]) < 5.0 / math.sqrt(N)


# --- events ----------------------------------------------------------------------------


def test_load_steps_have_the_size_and_phases_of_the_study(case: Case, steps: Scenarios) -> None:
    event = steps.event
    assert not event.between_before_s.any()
    assert not event.between_after_s.any()
    v = case.network.tree.v_nominal_v
    watts = (event.earth_before_s + event.earth_after_s).real * v**2
    assert_uniform(watts.sum(axis=0), 10e3 * (1 - 1e-12), 500e3 * (1 + 1e-12))
    phases = (watts > 0).sum(axis=0)
    assert set(phases) == {1, 3}
    assert_share(phases == 1, 0.5)
    for phase in range(3):
        assert_share(watts[phase, phases == 1] > 0, 1.0 / 3.0)
    balanced = watts[:, phases == 3]
    np.testing.assert_allclose(balanced, np.broadcast_to(balanced[0], balanced.shape))


def test_load_steps_are_on_or_off(steps: Scenarios) -> None:
    on = (steps.event.earth_after_s != 0).any(axis=0)
    off = (steps.event.earth_before_s != 0).any(axis=0)
    assert (on != off).all()
    assert_share(on, 0.5)
    np.testing.assert_array_equal(steps.before.step_y_s, steps.event.earth_before_s)
    np.testing.assert_array_equal(steps.after.step_y_s, steps.event.earth_after_s)


def test_load_steps_have_their_own_exponent(steps: Scenarios) -> None:
    exponent = steps.event.exponent
    assert_uniform(exponent, 0.0, 2.0)
    for state in (steps.before, steps.after):
        np.testing.assert_array_equal(state.step_exponent, exponent)
    common = steps.before.exponent.mean(axis=0)
    assert abs(np.corrcoef(exponent, common)[0, 1]) < 5.0 / math.sqrt(N)


@pytest.mark.parametrize("own", [*BREAKS, DrawClass.LOAD_STEP])
def test_events_are_equally_likely_in_every_section_and_uniform_in_each(
    case: Case, drawn: dict[DrawClass, Scenarios], own: DrawClass
) -> None:
    """Each of the paper's sections is one line, so its fraction is the distance."""
    places = along_lines(case, drawn[own])
    for line in ("R1-R2", "R2-R3", "R3-R4", "R4-R5"):
        here = np.array([name == line for name, _ in places])
        assert_share(here, 0.25)
        assert_uniform(np.array([at for name, at in places if name == line]), 0.0, 1.0)


def test_breaks_open_one_phase_or_two(drawn: dict[DrawClass, Scenarios]) -> None:
    mask = drawn[DrawClass.OPEN_PHASE].event.open_after
    for one, two in ((0b001, 0b011), (0b010, 0b110), (0b100, 0b101)):
        assert_share(mask == one, 0.8 / 3.0)
        assert_share(mask == two, 0.2 / 3.0)
    assert set(mask) == {1, 2, 4, 3, 6, 5}
    assert set(drawn[DrawClass.OPEN_THREE].event.open_after) == {0b111}


@pytest.mark.parametrize("own", DRAWN)
def test_what_is_open_is_open_from_t_0_on_or_until_then(
    drawn: dict[DrawClass, Scenarios], own: DrawClass
) -> None:
    one = drawn[own]
    np.testing.assert_array_equal(one.before.open_mask, one.event.open_before)
    np.testing.assert_array_equal(one.after.open_mask, one.event.open_after)
    opens, closes = one.event.open_after.any(), one.event.open_before.any()
    assert opens == (own.name.startswith(("OPEN", "FALLEN")))
    assert closes == (own in (DrawClass.ENERGISATION, DrawClass.RECLOSING, DrawClass.SINGLE_POLE))


def test_source_steps_stand_nowhere_and_move_all_phases(
    drawn: dict[DrawClass, Scenarios],
) -> None:
    one = drawn[DrawClass.SOURCE_STEP]
    assert_uniform(one.event.emf_factor, 0.95, 1.05)
    assert (one.event.edge == -1).all()
    assert not one.after.step_y_s.any()
    for own in set(DRAWN) - {DrawClass.SOURCE_STEP, DrawClass.STEP_WITH_TAP}:
        assert (drawn[own].event.emf_factor == 1.0).all()
