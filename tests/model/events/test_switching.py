"""Loads, capacitors, motors and faults: sizes, phases, and on or off.

Powers are what the admittances take at nominal balanced voltages, summed over the phases.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.event_draws import KW, LOAD_STEP, OHM, draw
from oracles.event_sites import Site
from scipy.stats import kstest

from openphase.model.distributions import Fixed, Uniform
from openphase.model.events.earth_fault import draw_earth_fault
from openphase.model.events.line_fault import draw_line_fault
from openphase.model.events.load_step import draw_load_step
from openphase.model.events.load_swap import LoadSwapLaw, draw_load_swap
from openphase.model.events.motor_start import RUNNING_POWER_FACTOR
from openphase.model.events.shunts import (
    LEAST_OHM,
    Shunt,
    between_phases,
    spot_on,
    to_earth,
)

N = 4000
KINDS = ["site", "three_wire"]

Complex = NDArray[np.complex128]


def taken(site: Site, earth: Complex, between: Complex) -> Complex:
    """(S,) complex power at nominal balanced voltages, V conj(I) of every branch."""
    turn = np.exp(-2j * np.pi / 3.0)
    v = site.network.tree.v_nominal_v * np.array([1.0, turn, turn**2])[:, None]
    across = v - np.roll(v, -1, axis=0)
    power = v * (earth * v).conj() + across * (between * across).conj()
    return np.asarray(power.sum(axis=0))


def assert_share(chosen: Any, expected: float) -> None:
    chosen = np.asarray(chosen)
    assert abs(chosen.mean() - expected) < 5.0 * math.sqrt(expected * (1 - expected) / chosen.size)


def assert_uniform(values: Any, low: float, high: float) -> None:
    assert np.min(values) >= low - 1e-9 * abs(low)
    assert np.max(values) <= high * (1.0 + 1e-9)
    assert kstest(values, "uniform", args=(low, high - low)).pvalue > 1e-3


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("make", [to_earth, between_phases])
def test_a_shunt_takes_the_power_it_is_made_of(
    request: pytest.FixtureRequest, rng: np.random.Generator, kind: str, make: Any
) -> None:
    site: Site = request.getfixturevalue(kind)
    va = rng.normal(size=(3, 20)) + 1j * rng.normal(size=(3, 20))
    shunt: Shunt = make(spot_on(site.network, rng.choice(site.lines.edges, 20)), va)
    found = taken(site, shunt.earth_s, shunt.between_s)
    np.testing.assert_allclose(found, va.sum(axis=0), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["load_step", "step_with_tap"])
def test_load_steps(request: pytest.FixtureRequest, kind: str, name: str) -> None:
    site: Site = request.getfixturevalue(kind)
    event = draw(name, site, N)
    before = taken(site, event.earth_before_s, event.between_before_s)
    after = taken(site, event.earth_after_s, event.between_after_s)
    assert not (before * after).any()
    assert_share(after != 0.0, 0.5)
    power = before + after
    np.testing.assert_allclose(power.imag, 0.0, atol=1e-6)
    assert_uniform(power.real, 10e3, 500e3)
    branches = sum(
        (
            event.earth_before_s,
            event.earth_after_s,
            event.between_before_s,
            event.between_after_s,
        ),
        start=np.zeros((3, N), complex),
    )
    used = (branches != 0.0).sum(axis=0)
    assert set(used) == {1, 3}
    assert_share(used == 1, LOAD_STEP.single_phase_share)
    for phase in range(3):
        assert_share(branches[phase, used == 1] != 0.0, 1.0 / 3.0)
    balanced = branches[:, used == 3]
    np.testing.assert_allclose(balanced, np.broadcast_to(balanced[0], balanced.shape))


def test_load_steps_have_an_exponent_of_their_own_but_between_phases(
    site: Site, three_wire: Site
) -> None:
    assert_uniform(draw("load_step", site, N).exponent, 0.5, 1.5)
    assert (draw("load_step", three_wire, N).exponent == 2.0).all()


def test_a_step_with_tap_is_a_load_step_and_a_source_step(site: Site) -> None:
    event, plain = draw("step_with_tap", site, N), draw("load_step", site, N)
    for name in ("edge", "share", "earth_before_s", "earth_after_s", "exponent"):
        np.testing.assert_array_equal(getattr(event, name), getattr(plain, name))
    assert_uniform(event.emf_factor - 0.95, 0.0, 0.10)


def test_capacitors(site: Site, three_wire: Site) -> None:
    event = draw("capacitor_step", site, N)
    earth = event.earth_before_s + event.earth_after_s
    between = event.between_before_s + event.between_after_s
    assert_share((between != 0.0).all(axis=0), 0.25)
    assert ((between != 0.0).any(axis=0) != (earth != 0.0).any(axis=0)).all()
    power = taken(site, earth, between)
    np.testing.assert_allclose(power.real, 0.0, atol=1e-6)
    assert set(np.round(power.imag)) == {-150e3, -300e3, -600e3}
    on = (event.earth_after_s + event.between_after_s != 0.0).any(axis=0)
    off = (event.earth_before_s + event.between_before_s != 0.0).any(axis=0)
    assert (on != off).all()
    assert_share(on, 0.5)
    delta = draw("capacitor_step", three_wire, N)
    assert (delta.between_before_s + delta.between_after_s != 0.0).all()


def test_motors_start_or_run_up(site: Site) -> None:
    event = draw("motor_start", site, N)
    nothing = np.zeros((3, N), complex)
    before = taken(site, nothing, event.between_before_s)
    after = taken(site, nothing, event.between_after_s)
    starts = before == 0.0
    assert_share(starts, 0.5)
    starting = np.where(starts, after, before)
    factor = starting.real / np.abs(starting)
    assert_uniform(factor, 0.2, 0.4)
    assert (starting.imag > 0.0).all()
    running = after[~starts]
    np.testing.assert_allclose(running.real / np.abs(running), RUNNING_POWER_FACTOR)
    assert_uniform(np.abs(running), 50e3, 300e3)
    assert_uniform(np.abs(before[~starts]) / np.abs(running), 5.0, 7.0)
    for y in (event.between_before_s, event.between_after_s):
        np.testing.assert_array_equal(y, np.broadcast_to(y[0], y.shape))


def test_earth_faults(site: Site) -> None:
    event = draw("earth_fault", site, N)
    y = event.earth_before_s + event.earth_after_s
    assert ((y != 0.0).sum(axis=0) == 1).all()
    for phase in range(3):
        assert_share(y[phase] != 0.0, 1.0 / 3.0)
    assert_uniform(1.0 / y.sum(axis=0).real, *OHM.support)
    assert_share((event.earth_after_s != 0.0).any(axis=0), 0.5)
    assert not (event.earth_after_s * event.earth_before_s).any()


def test_line_faults(site: Site) -> None:
    event = draw("line_fault", site, N)
    between = event.between_before_s + event.between_after_s
    earth = event.earth_before_s + event.earth_after_s
    assert ((between != 0.0).sum(axis=0) == 1).all()
    assert_uniform(1.0 / between.sum(axis=0).real, *OHM.support)
    earthed = (earth != 0.0).any(axis=0)
    assert_share(earthed, 0.3)
    for pair, touched in enumerate(([0, 1], [1, 2], [2, 0])):
        here = between[pair] != 0.0
        assert_share(here, 1.0 / 3.0)
        which = np.isin(np.arange(3), touched)
        wanted = np.where(which[:, None], between[pair, here & earthed], 0.0)
        np.testing.assert_array_equal(earth[:, here & earthed], wanted)
    assert_share((event.between_after_s != 0.0).any(axis=0), 0.5)
    assert not (event.between_after_s * event.between_before_s).any()
    # what goes goes together
    assert not event.earth_after_s[:, (event.between_after_s == 0.0).all(axis=0)].any()


def test_a_bolted_fault_is_a_finite_admittance(site: Site, rng: np.random.Generator) -> None:
    zero = Fixed(value=0.0)
    earth = draw_earth_fault(rng, 20, site.network, site.regions, zero)
    line = draw_line_fault(rng, 20, site.network, site.regions, zero, 0.0)
    for y in (
        earth.earth_before_s + earth.earth_after_s,
        line.between_before_s + line.between_after_s,
    ):
        np.testing.assert_allclose(y.sum(axis=0), 1.0 / LEAST_OHM)
    assert all(np.isfinite(answer.i).all() for answer in site.answers(earth))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("low", "high"), [(-1.2, -0.8), (0.5, 1.5)])
def test_a_swap_s_second_step_goes_the_other_way_where_the_ratio_is_negative(
    request: pytest.FixtureRequest, rng: np.random.Generator, kind: str, low: float, high: float
) -> None:
    site: Site = request.getfixturevalue(kind)
    law = LoadSwapLaw(kw=KW, ratio=Uniform(low=low, high=high), single_phase_share=0.5)
    event = draw_load_swap(rng, N, site.network, site.regions, law)
    here = taken(site, event.earth_after_s, event.between_after_s) - taken(
        site, event.earth_before_s, event.between_before_s
    )
    far = taken(site, event.far_after_s, event.far_between_after_s) - taken(
        site, event.far_before_s, event.far_between_before_s
    )
    assert_uniform(np.abs(here), 10e3, 500e3)
    assert_share(here.real > 0.0, 0.5)
    assert_uniform((far / here).real - low, 0.0, high - low)
    np.testing.assert_allclose((far / here).imag, 0.0, atol=1e-12)
    # nothing that goes was there on the other side of t = 0 in part
    assert not (event.earth_before_s * event.earth_after_s).any()
    assert not (event.far_before_s * event.far_after_s).any()
    branches = event.earth_after_s + event.earth_before_s + event.between_after_s
    branches = branches + event.between_before_s
    others = event.far_after_s + event.far_before_s + event.far_between_after_s
    others = others + event.far_between_before_s
    np.testing.assert_array_equal(branches != 0.0, others != 0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_a_break_with_a_load_step(request: pytest.FixtureRequest, kind: str) -> None:
    site: Site = request.getfixturevalue(kind)
    event = draw("open_with_load_step", site, N)
    before = taken(site, event.far_before_s, event.far_between_before_s)
    after = taken(site, event.far_after_s, event.far_between_after_s)
    assert_share(after != 0.0, 0.5)
    assert_uniform((before + after).real, 10e3, 500e3)
    assert not (before * after).any()
    assert abs(np.corrcoef(event.edge, event.far_node)[0, 1]) < 5.0 / math.sqrt(N)


def test_the_laws_of_size_and_place_are_independent(site: Site, rng: np.random.Generator) -> None:
    event = draw_load_step(rng, N, site.network, site.regions, LOAD_STEP)
    power = taken(site, event.earth_before_s + event.earth_after_s, np.zeros((3, N), complex)).real
    on = (event.earth_after_s != 0.0).any(axis=0)
    for other in (event.share, event.exponent, on):
        assert abs(np.corrcoef(power, other)[0, 1]) < 5.0 / math.sqrt(N)
