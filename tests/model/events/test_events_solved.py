"""Events in the solver, against feeders in which the change is simply written down.

An event's state must be the steady state of another feeder: with one more load, with other
taps, without a DER. Where nothing hangs on the feeder there are closed forms.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.event_draws import DRAWS, KW, MOTOR, OHM, draw
from oracles.event_sites import Site, make, site_of, watched

from openphase.model.distributions import Fixed, Uniform
from openphase.model.events.base import Event, no_event
from openphase.model.events.capacitor_step import draw_capacitor_step
from openphase.model.events.der_ramp import draw_der_ramp
from openphase.model.events.der_trip import draw_der_trip
from openphase.model.events.line_fault import draw_line_fault
from openphase.model.events.load_step import LoadStepLaw, draw_load_step
from openphase.model.events.load_swap import LoadSwapLaw, draw_load_swap
from openphase.model.events.motor_start import RUNNING_POWER_FACTOR, draw_motor_start
from openphase.model.network import compile_network
from openphase.model.parts import Capacitor, Feeder, Load, LoadConnection, Place
from openphase.model.solve import solve, steady_state
from openphase.model.states import NOT_CONVERGED, Answer

S = 12

Rng = np.random.Generator
Complex = NDArray[np.complex128]


def steady(feeder: Feeder) -> Complex:
    """What the buses and lines of ``feeder`` show in its own steady state."""
    network = compile_network(feeder)
    return watched(network, solve(network, steady_state(network)))


def assert_same(site: Site, answer: Answer, s: int, wanted: Complex) -> None:
    found = site.watch(answer, s)
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-9 * np.abs(wanted).max())


def with_load(
    feeder: Feeder, place: Place, kw: float, connection: LoadConnection, exponent: float = 2.0
) -> Feeder:
    """``feeder`` with a direct load of unity power factor; none if it takes nothing."""
    if kw == 0.0:
        return feeder
    own = Load(
        name=f"step {len(feeder.loads)}",
        transformer=None,
        place=place,
        connection=connection,
        kw=kw,
        power_factor=1.0,
        exponent=exponent,
    )
    return replace(feeder, loads=(*feeder.loads, own))


@pytest.fixture(scope="module", params=[4, 3])
def passive(request: pytest.FixtureRequest) -> Site:
    return site_of(replace(make(request.param), ders=()))


def kind_of(site: Site) -> LoadConnection:
    return "delta" if site.network.three_wire else "wye"


def kw_at(site: Site, earth: Complex, between: Complex, s: int) -> float:
    v = site.network.tree.v_nominal_v
    return float((earth[:, s].sum() + 3.0 * between[:, s].sum()).real * v * v / 1000.0)


# --- what is switched ------------------------------------------------------------------


def test_a_load_step_is_a_load_of_the_feeder(passive: Site, rng: Rng) -> None:
    exponent = Fixed(value=2.0) if passive.network.three_wire else Uniform(low=0.0, high=2.0)
    law = LoadStepLaw(kw=KW, single_phase_share=0.0, exponent=exponent)
    event = draw_load_step(rng, S, passive.network, passive.regions, law)
    sides = (
        (event.earth_before_s, event.between_before_s),
        (event.earth_after_s, event.between_after_s),
    )
    for answer, (earth, between) in zip(passive.answers(event), sides, strict=True):
        for s in range(S):
            kw = kw_at(passive, earth, between, s)
            place, power = passive.at(event, s), float(event.exponent[s])
            wanted = with_load(passive.feeder, place, kw, kind_of(passive), power)
            assert_same(passive, answer, s, steady(wanted))


def test_a_swap_is_two_loads_of_the_feeder(passive: Site, rng: Rng) -> None:
    law = LoadSwapLaw(kw=KW, ratio=Uniform(low=-1.2, high=-0.8), single_phase_share=0.0)
    event = draw_load_swap(rng, S, passive.network, passive.regions, law)
    network = passive.network
    tees = {"SA:0.5": ("SA", 0.5), "A2B:0.25": ("A2B", 0.25), "SE:0.75": ("SE", 0.75)}
    answers = passive.answers(event)
    for s in range(S):
        name = network.nodes[event.far_node[s]]
        there = Place(bus=name)
        if name in tees:
            there = Place(line=tees[name][0], at=tees[name][1])
        for answer, here, far in (
            (
                answers[0],
                (event.earth_before_s, event.between_before_s),
                (event.far_before_s, event.far_between_before_s),
            ),
            (
                answers[1],
                (event.earth_after_s, event.between_after_s),
                (event.far_after_s, event.far_between_after_s),
            ),
        ):
            one = with_load(
                passive.feeder, passive.at(event, s), kw_at(passive, *here, s), kind_of(passive)
            )
            two = with_load(one, there, kw_at(passive, *far, s), kind_of(passive))
            assert_same(passive, answer, s, steady(two))


@pytest.mark.parametrize("delta_share", [0.0, 1.0])
def test_a_capacitor_step_is_a_bank_of_the_feeder(
    passive: Site, rng: Rng, delta_share: float
) -> None:
    event = draw_capacitor_step(
        rng, S, passive.network, passive.regions, Fixed(value=450.0), delta_share
    )
    delta = passive.network.three_wire or delta_share == 1.0
    before, after = passive.answers(event)
    for s in range(S):
        bank = Capacitor(
            name="step",
            place=passive.at(event, s),
            connection="delta" if delta else "wye",
            kvar=450.0,
        )
        off, on = steady(passive.feeder), steady(replace(passive.feeder, capacitors=(bank,)))
        goes_on = (event.earth_after_s + event.between_after_s)[:, s].any()
        assert_same(passive, before, s, off if goes_on else on)
        assert_same(passive, after, s, on if goes_on else off)


def test_a_motor_takes_its_starting_and_then_its_rated_power(passive: Site, rng: Rng) -> None:
    law = replace(
        MOTOR,
        kva=Fixed(value=200.0),
        times=Fixed(value=6.0),
        power_factor=Fixed(value=0.3),
    )
    event = draw_motor_start(rng, S, passive.network, passive.regions, law)
    before, after = passive.answers(event)
    for s in range(S):
        motor = Load(
            name="motor",
            transformer=None,
            place=passive.at(event, s),
            connection="delta",
            kw=1200.0 * 0.3,
            power_factor=0.3,
            exponent=2.0,
        )
        running = replace(motor, kw=200.0 * RUNNING_POWER_FACTOR, power_factor=RUNNING_POWER_FACTOR)
        none, starting, runs = (
            steady(replace(passive.feeder, loads=(*passive.feeder.loads, *more)))
            for more in ((), (motor,), (running,))
        )
        starts = not event.between_before_s[:, s].any()
        assert_same(passive, before, s, none if starts else starting)
        assert_same(passive, after, s, starting if starts else runs)


# --- faults and fallen conductors, where nothing else carries current --------------------


def z_to(site: Site, event: Event, s: int, sequence: int) -> complex:
    """Sequence impedance from the source's EMF to the event, summed along the lines."""
    feeder = site.feeder
    place = site.at(event, s)
    ways = {
        "SA": [],
        "A2B": ["SA"],
        "BC": ["SA", "A2B"],
        "BL": ["SA", "A2B"],
        "C2D": ["SA", "A2B", "BC"],
        "SE": [],
    }
    lines = {line.name: line for line in feeder.lines}
    passed = [lines[name].length_km for name in ways[str(place.line)]]
    km = sum(passed) + float(place.at or 0.0) * lines[str(place.line)].length_km
    line, source = lines["SA"], feeder.source
    if sequence == 0:
        return complex(source.z0_ohm + km * line.z0_ohm_per_km)
    return complex(source.z1_ohm + km * line.z1_ohm_per_km)


def emf_v(site: Site) -> float:
    return site.feeder.source.v_phase_v * site.feeder.source.emf_pu


def test_an_earth_fault_s_current(bare: Site) -> None:
    """I = 3 E / (Z1 + Z2 + Z0 + 3 R)."""
    event = draw("earth_fault", bare, S)
    before, after = bare.answers(event)
    for s in range(S):
        y = event.earth_after_s[:, s] + event.earth_before_s[:, s]
        there, away = (after, before) if event.earth_after_s[:, s].any() else (before, after)
        z = 2.0 * z_to(bare, event, s, 1) + z_to(bare, event, s, 0)
        wanted = 3.0 * emf_v(bare) / abs(z + 3.0 / y.sum())
        assert np.abs(y * there.stub[0, :, s]).max() == pytest.approx(wanted, rel=1e-9)
        assert np.abs(away.i[:, :, s]).max() < 1e-9


def test_a_line_fault_s_current(bare: Site, rng: Rng) -> None:
    """I = sqrt(3) E / (Z1 + Z2 + R) without earth."""
    event = draw_line_fault(rng, S, bare.network, bare.regions, OHM, 0.0)
    before, after = bare.answers(event)
    for s in range(S):
        y = event.between_after_s[:, s] + event.between_before_s[:, s]
        there = after if event.between_after_s[:, s].any() else before
        v = there.stub[0, :, s]
        wanted = 3.0**0.5 * emf_v(bare) / abs(2.0 * z_to(bare, event, s, 1) + 1.0 / y.sum())
        found = np.abs(y * (v - np.roll(v, -1))).max()
        assert found == pytest.approx(wanted, rel=1e-9)


def test_a_solid_line_fault_with_earth_holds_its_phases_there(bare: Site, rng: Rng) -> None:
    event = draw_line_fault(rng, S, bare.network, bare.regions, Fixed(value=0.0), 1.0)
    sides = (
        (event.earth_before_s, event.between_before_s),
        (event.earth_after_s, event.between_after_s),
    )
    for answer, (earth, between) in zip(bare.answers(event), sides, strict=True):
        v_pu = np.abs(answer.stub[0]) / emf_v(bare)
        touched = earth != 0.0
        assert (touched.sum(axis=0) == np.where(between.any(axis=0), 2, 0)).all()
        assert (v_pu[touched] < 5e-3).all()
        assert (v_pu[~touched] > 0.9).all()


def test_a_conductor_fallen_on_the_source_side_is_an_earth_fault_of_that_end(bare: Site) -> None:
    event = draw("fallen_source_side", bare, S)
    _, after = bare.answers(event)
    for s in range(S):
        y = event.earth_after_s[:, s]
        z = 2.0 * z_to(bare, event, s, 1) + z_to(bare, event, s, 0)
        wanted = 3.0 * emf_v(bare) / abs(z + 3.0 / y.sum())
        assert np.abs(y * after.stub[0, :, s]).max() == pytest.approx(wanted, rel=1e-9)
        assert np.abs(after.stub[1, :, s][y != 0.0]) == 0.0


def test_a_conductor_fallen_on_the_load_side_carries_what_comes_back_only(
    bare: Site, site: Site
) -> None:
    event = draw("fallen_load_side", bare, S)
    _, after = bare.answers(event)
    assert np.abs(after.i).max() < 1e-9
    # with load between the phases beyond there is a way back, into the ground at q
    _, after = site.answers(draw("fallen_load_side", site, S))
    into_ground = np.abs(event.fallen_after_s * after.stub[1])
    assert into_ground.max() > 1.0


# --- closings --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("closing", "kind"),
    [("single_pole", 4), ("single_pole", 3), ("energisation", 4), ("energisation", 3)],
)
def test_a_closing_is_the_opening_reversed_in_time(closing: str, kind: int) -> None:
    own = site_of(replace(make(kind), ders=()))
    event = draw(closing, own, S)
    nothing = no_event(own.network, S)
    opening = replace(nothing, edge=event.edge, share=event.share, open_after=event.open_before)
    closed, opened = own.answers(event), own.answers(opening)
    for one, other in zip(closed, opened[::-1], strict=True):
        np.testing.assert_allclose(one.v, other.v, rtol=0.0, atol=1e-6)
        np.testing.assert_allclose(one.i, other.i, rtol=0.0, atol=1e-6)


def test_cold_load_is_a_feeder_with_more_load_there(passive: Site) -> None:
    event = draw("reclosing", passive, S)
    _, after = passive.answers(event)
    assert (event.load_factor != 1.0).any()
    for s in range(S):
        pairs = zip(passive.feeder.loads, event.load_factor[:, s], strict=True)
        loads = tuple(replace(load, kw=load.kw * float(k)) for load, k in pairs)
        assert_same(passive, after, s, steady(replace(passive.feeder, loads=loads)))


def test_before_an_energisation_all_beyond_is_dead_and_draws_nothing(site: Site) -> None:
    """As if neither the loads nor the DER beyond were there, connected DER elsewhere included."""
    event = draw("energisation", site, 30)
    before, _ = site.answers(event)
    for s in range(30):
        edge = int(event.edge[s])
        beyond = site.network.below(edge)
        np.testing.assert_array_equal(before.v[beyond, :, s], 0.0)
        gone = {site.network.loads[n] for n in np.flatnonzero(beyond[site.network.load_node])}
        lost = zip(site.feeder.ders, event.der_factor[:, s] == 0.0, strict=True)
        less = replace(
            site.feeder,
            loads=tuple(load for load in site.feeder.loads if load.name not in gone),
            ders=tuple(der for der, off in lost if not off),
        )
        network = compile_network(less)
        other = solve(network, steady_state(network))
        for bus in ("S", "A", "A2", "B", "C", "C2", "D", "E", "L"):
            if not beyond[site.network.node(bus)]:
                np.testing.assert_allclose(
                    before.v[site.network.node(bus), :, s],
                    other.v[network.node(bus), :, 0],
                    rtol=0.0,
                    atol=1e-5,
                )


# --- regulators, DER and the source ------------------------------------------------------


def test_a_tap_change_is_a_feeder_with_other_taps(passive: Site) -> None:
    event = draw("regulator_tap", passive, S)
    _, after = passive.answers(event)
    network = passive.network
    for s in range(S):
        ratio = network.ratio * event.tap_factor[:, :, s]
        regulators = []
        for r, own in enumerate(passive.feeder.regulators):
            boost = ratio[r] if network.ratio_upward[r] else 1.0 / ratio[r]
            a, b, c = (round((x - 1.0) * 100.0 / own.step_pct) for x in boost)
            regulators.append(replace(own, taps=(a, b, c)))
        wanted = steady(replace(passive.feeder, regulators=tuple(regulators)))
        assert_same(passive, after, s, wanted)
        assert np.abs(wanted - steady(passive.feeder)).max() > 1.0


@pytest.fixture(scope="module")
def inverters() -> Site:
    """DER that keep their power: what is left is a steady state of its own."""
    feeder = make(4)
    ders = tuple(replace(der, model="constant_power") for der in feeder.ders)
    return site_of(replace(feeder, ders=ders))


def test_after_a_trip_the_feeder_is_without_those_der(inverters: Site, rng: Rng) -> None:
    event = draw_der_trip(rng, S, inverters.network, Uniform(low=0.0, high=1.0))
    _, after = inverters.answers(event)
    for s in range(S):
        pairs = zip(inverters.feeder.ders, event.der_factor[:, s], strict=True)
        left = tuple(der for der, k in pairs if k == 1.0)
        assert len(left) < 4
        assert_same(inverters, after, s, steady(replace(inverters.feeder, ders=left)))


def test_after_a_ramp_the_der_deliver_that_much(inverters: Site, rng: Rng) -> None:
    event = draw_der_ramp(rng, S, inverters.network, Uniform(low=0.2, high=1.3))
    _, after = inverters.answers(event)
    for s in range(S):
        ders = tuple(
            replace(der, kw=der.kw * float(event.der_factor[0, s])) for der in inverters.feeder.ders
        )
        assert_same(inverters, after, s, steady(replace(inverters.feeder, ders=ders)))


def test_a_source_step_scales_a_linear_feeder(passive: Site) -> None:
    event = draw("source_step", passive, S)
    before, after = passive.answers(event)
    np.testing.assert_allclose(after.v, before.v * event.emf_factor, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(after.i, before.i * event.emf_factor, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("name", sorted(set(DRAWS) - {"regulator_tap"}))
def test_events_in_a_closed_loop_converge(looped: Site, name: str) -> None:
    for answer in looped.answers(draw(name, looped, 40)):
        assert not (answer.flags & NOT_CONVERGED).any()
        assert np.isfinite(answer.v).all()
