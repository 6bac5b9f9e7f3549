"""Supervision of the wiring: silent in service, outspoken where it can see; and what it misses.

States of the paper's feeder over its whole range of load, measured with the contract's errors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.scenes import Scene, opened, scene
from oracles.true_phasors import true_phasors

from openphase.detector.criteria import Reason, Settings, verdict
from openphase.detector.evidence import Phasors, evidence_of, with_alarm
from openphase.detector.instruments import Bounds, Wiring, draw_errors, measure, miswire
from openphase.detector.supervision import LIMITS, Alarm, fed_one_way, wiring_alarm
from openphase.model import load_feeder
from openphase.model.machine_state import machine_state
from openphase.model.network import CONNECTIONS
from openphase.model.parts import Der
from openphase.model.solve import quiet_state
from openphase.model.states import State

N = 1500
CONTRACT = Bounds(tve_pct=0.05, current_floor_a=0.05)
KINDS = [kind for kind in Wiring if kind != Wiring.RIGHT]
ONE_CT = [Wiring.REVERSED_A, Wiring.REVERSED_B, Wiring.REVERSED_C]
LABELS = [kind for kind in KINDS if kind not in (*ONE_CT, Wiring.REVERSED_ALL)]

Real = NDArray[np.float64]
Build = Callable[[], Scene]


def radial() -> Scene:
    return scene(load_feeder("paper"))


def loop() -> Scene:
    return scene(load_feeder("paper"), frozenset({"R4"}))


def with_pv() -> Scene:
    """PV on T6 that delivers up to 1.4 MW, more than the feeder's load beyond R1."""
    pv = Der(
        name="PV", transformer="T6", place=None, kw=1400.0, power_factor=1.0,
        model="constant_power", z1_ohm=None, z2_ohm=None, z0_ohm=None,
    )  # fmt: skip
    return scene(replace(load_feeder("paper"), ders=(pv,)))


def states(at: Scene, rng: np.random.Generator, size: int = N) -> State:
    """Loads, exponents, windings as a study draws them; generation from none to all."""
    network = at.network
    loads = len(network.loads)
    scale = rng.uniform(0.25, 1.0, size) * rng.uniform(0.8, 1.2, (loads, size))
    exponent = np.clip(rng.uniform(0, 2, size) + rng.uniform(-0.3, 0.3, (loads, size)), 0, 2)
    level = rng.uniform(0.0, 1.0, (len(network.machines.ders), size))
    machines = machine_state(network, scale, exponent, der_level=level)
    state = quiet_state(network, scale, exponent, machines)
    connection, count = state.connection.copy(), rng.integers(1, 4, size)
    for n, unit in enumerate(("T4", "T5", "T6")):
        connection[network.units.index(unit), count > n] = CONNECTIONS["Yg/D"]
    return state._replace(connection=connection)


def with_one_phase_load(at: Scene, rng: np.random.Generator, state: State, kw: float) -> State:
    """Besides, up to ``kw`` on one phase anywhere."""
    size = state.emf_pu.size
    lines = np.flatnonzero(at.network.length_km > 0)
    y = np.zeros((3, size), complex)
    y[rng.integers(0, 3, size), np.arange(size)] = (
        rng.uniform(0.0, kw, size) * 1e3 / at.network.tree.v_nominal_v**2
    )
    return state._replace(edge=rng.choice(lines, size), share=rng.random(size), step_y_s=y)


def measured(at: Scene, phasors: Phasors, seed: int) -> Phasors:
    errors = draw_errors(np.random.default_rng(seed), len(at.points.names), phasors.v.shape[-1])
    return measure(phasors.v, phasors.i, errors, CONTRACT)


def alarms(at: Scene, phasors: Phasors) -> NDArray[np.int8]:
    terminals = at.points.terminals
    one_way = fed_one_way(terminals) & (not at.feeder.ders)
    return wiring_alarm(phasors, terminals, at.network.tree.v_nominal_v, one_way)


def wrong(phasors: Phasors, point: int, kind: Wiring) -> Phasors:
    size = phasors.v.shape[-1]
    return miswire(phasors, np.full(size, point), np.full(size, int(kind)))


def concerned(at: Scene, point: int) -> NDArray[np.bool_]:
    """(T,) terminals that have the point at either end."""
    ends = [(t.local_point, t.remote_point) for t in at.points.terminals]
    return np.array([point in pair for pair in ends])


def through_a(phasors: Phasors) -> Real:
    """(P, S) true |I1| before the event."""
    a = np.exp(2j * np.pi / 3)
    turn = np.array([1.0, a, a**2])[:, None]
    return np.asarray(np.abs((phasors.i[0] * turn).sum(axis=1)) / 3.0)


# --- silence ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("build", "kw"), [(radial, 0.0), (loop, 0.0), (with_pv, 0.0), (radial, 500.0), (loop, 500.0)]
)
def test_no_alarm_in_service(build: Build, kw: float) -> None:
    """Over the range of load, with up to 500 kW on one phase: none of 12,000 judgements."""
    at = build()
    rng = np.random.default_rng(51)
    state = with_one_phase_load(at, rng, states(at, rng), kw)
    phasors = measured(at, true_phasors(at, state, state), 52)
    assert (alarms(at, phasors) == Alarm.NONE).all()
    if at.feeder.ders:  # power did flow both ways
        r3 = at.points.names.index("R3")
        power = (phasors.v[0, r3] * phasors.i[0, r3].conj()).real.sum(axis=0)
        assert power.min() < 0 < power.max()


def test_false_alarms_beside_generation_and_one_phase_load() -> None:
    """There a phase may carry power against the others: to the currents, one of them reversed.

    With up to 500 kW on one phase and 1.4 MW of PV: one judgement in a hundred.
    """
    at = with_pv()
    rng = np.random.default_rng(51)
    state = with_one_phase_load(at, rng, states(at, rng), 500.0)
    found = alarms(at, measured(at, true_phasors(at, state, state), 52))
    assert set(np.unique(found)) == {Alarm.NONE, Alarm.ONE_CURRENT}
    assert 0.005 < (found != Alarm.NONE).mean() < 0.03


@pytest.mark.parametrize("build", [radial, loop])
def test_no_alarm_while_phases_are_open(build: Build) -> None:
    """Before a closing the feeder is no picture of order; that is not the wiring."""
    at = build()
    rng = np.random.default_rng(53)
    for mask in (1, 2, 4, 3, 5, 6, 7):
        state = states(at, rng, 40)
        for line, share in (("R1-R2", 0.5), ("R2-R3", 0.6), ("R3-R4", 0.2)):
            before = opened_all(at, state, line, share, mask)
            phasors = measured(at, true_phasors(at, before, before), mask)
            assert (alarms(at, phasors) == Alarm.NONE).all()


def opened_all(at: Scene, state: State, line: str, share: float, mask: int) -> State:
    one = opened(at, at.steady, line, share, mask)
    size = state.emf_pu.size
    return state._replace(
        edge=np.repeat(one.edge, size),
        share=np.repeat(one.share, size),
        open_mask=np.repeat(one.open_mask, size),
    )


def test_earth_faults_are_not_the_wiring() -> None:
    at = radial()
    rng = np.random.default_rng(54)
    state = states(at, rng, 300)
    lines = np.flatnonzero(at.network.length_km > 0)
    y = np.zeros((3, 300), complex)
    y[rng.integers(0, 3, 300), np.arange(300)] = 1.0 / rng.uniform(0.1, 200.0, 300)
    faulty = state._replace(edge=rng.choice(lines, 300), share=rng.random(300), step_y_s=y)
    assert (alarms(at, measured(at, true_phasors(at, faulty, faulty), 55)) == Alarm.NONE).all()


# --- alarms ----------------------------------------------------------------------------


@pytest.mark.parametrize("build", [radial, loop, with_pv])
@pytest.mark.parametrize("kind", LABELS)
def test_wrong_labels_are_seen_at_every_point_and_nowhere_else(build: Build, kind: Wiring) -> None:
    at = build()
    rng = np.random.default_rng(56)
    state = with_one_phase_load(at, rng, states(at, rng, 200), 0.0 if at.feeder.ders else 500.0)
    phasors = measured(at, true_phasors(at, state, state), 57)
    expected = Alarm.ENDS_APART if kind.name.startswith("ROTATED") else Alarm.PHASE_ORDER
    for point in range(len(at.points.names)):
        found = alarms(at, wrong(phasors, point, kind))
        mine = concerned(at, point)
        assert (found[mine] == expected).all()
        assert (found[~mine] == Alarm.NONE).all()


@pytest.mark.parametrize("build", [radial, loop])
@pytest.mark.parametrize("kind", ONE_CT)
def test_one_reversed_current_is_seen_from_a_little_current_on(build: Build, kind: Wiring) -> None:
    """In balanced service, from 5 % above the level on (ratio errors, floor); idle points never."""
    at = build()
    rng = np.random.default_rng(58)
    state = states(at, rng)
    true = true_phasors(at, state, state)
    phasors, current = measured(at, true, 59), through_a(true)
    for point in range(len(at.points.names)):
        found = alarms(at, wrong(phasors, point, kind))
        mine, loaded = concerned(at, point), current[point] > 1.05 * LIMITS.least_a
        assert (found[mine][:, loaded] == Alarm.ONE_CURRENT).all()
        assert (found[mine][:, current[point] < 0.9 * LIMITS.least_a] == Alarm.NONE).all()
        assert (found[~mine] == Alarm.NONE).all()


def test_the_unbalance_up_to_which_one_reversed_current_is_seen() -> None:
    """|I2| and |I0| below a seventh of |I1|, at whatever angles; above, no promise."""
    rng = np.random.default_rng(60)
    size = 20_000
    a = np.exp(2j * np.pi / 3)
    i1, i2, i0 = (10.0 * np.exp(2j * np.pi * rng.random(size)) for _ in range(3))
    turn = a ** -np.arange(3)[:, None]
    at = radial()
    v = np.broadcast_to(7000.0 * turn[None], (6, 3, size))
    missed = {}
    for share in (0.142, 0.3):
        i = turn * i1 + turn.conj() * i2 * share + i0 * share
        phasors = Phasors(v=np.stack([v, v]), i=np.stack([np.stack([i] * 6)] * 2))
        right = wiring_alarm(phasors, at.points.terminals, 7000.0, np.ones(8, np.bool_))
        assert not (right == Alarm.ONE_CURRENT).any()
        for kind in ONE_CT:
            found = alarms(at, wrong(phasors, 0, kind))[0]
            missed[share, kind] = (found != Alarm.ONE_CURRENT).mean()
    assert [missed[0.142, kind] for kind in ONE_CT] == [0.0, 0.0, 0.0]
    assert all(missed[0.3, kind] > 0.0 for kind in ONE_CT)


@pytest.mark.parametrize("sequence", [2, 0])
def test_one_of_the_sequences_above_the_first_is_enough(sequence: int) -> None:
    """With I0 (or I2) at -0.4 of I1, a reversed current on phase a leaves .6, .8 and .4 of it."""
    at = radial()
    turn = np.exp(-2j * np.pi / 3 * np.arange(3))[:, None]
    other = turn.conj() if sequence == 2 else np.ones((3, 1))
    v = np.broadcast_to(7000.0 * turn, (2, 6, 3, 1))
    phasors = Phasors(v=v, i=np.broadcast_to(10.0 * (turn - 0.4 * other), (2, 6, 3, 1)))
    everywhere = np.ones(len(at.points.terminals), np.bool_)
    for kind in (Wiring.RIGHT, Wiring.REVERSED_A):
        found = wiring_alarm(wrong(phasors, 0, kind), at.points.terminals, 7000.0, everywhere)
        assert (found[0, 0] == Alarm.ONE_CURRENT) == (kind == Wiring.REVERSED_A)


def interchanged(phasors: Phasors, point: int, first: int, second: int) -> Phasors:
    """Two currents of a point under each other's name."""
    i = phasors.i.copy()
    i[:, point, [first, second]] = phasors.i[:, point, [second, first]]
    return replace(phasors, i=i)


@pytest.mark.parametrize("build", [radial, loop, with_pv])
@pytest.mark.parametrize("pair", [(0, 1), (1, 2), (2, 0)])
def test_two_interchanged_currents_are_seen_from_a_little_current_on(
    build: Build, pair: tuple[int, int]
) -> None:
    """In balanced service, whichever way power may flow; idle points never."""
    at = build()
    rng = np.random.default_rng(69)
    state = states(at, rng, 300)
    true = true_phasors(at, state, state)
    phasors, current = measured(at, true, 70), through_a(true)
    for point in range(len(at.points.names)):
        found = alarms(at, interchanged(phasors, point, *pair))
        mine, loaded = concerned(at, point), current[point] > 1.05 * LIMITS.least_a
        assert (found[mine][:, loaded] == Alarm.CURRENT_ORDER).all()
        assert (found[mine][:, current[point] < 0.9 * LIMITS.least_a] == Alarm.NONE).all()
        assert (found[~mine] == Alarm.NONE).all()


def test_interchanged_currents_are_not_doubted_beside_unbalanced_or_low_voltages() -> None:
    """Voltages that are far from balanced may drive |I2| above |I1| into motors."""
    at = radial()
    turn = np.exp(-2j * np.pi / 3 * np.arange(3))[:, None]
    v = np.broadcast_to(7000.0 * turn, (2, 6, 3, 1)).copy()
    phasors = Phasors(v=v, i=np.broadcast_to(10.0 * turn.conj(), (2, 6, 3, 1)))
    everywhere = np.ones(len(at.points.terminals), np.bool_)

    def found() -> NDArray[np.int8]:
        return wiring_alarm(phasors, at.points.terminals, 7000.0, everywhere)

    assert (found() == Alarm.CURRENT_ORDER).all()
    v[:, :, 0] *= 0.82  # |V2| is 6 %
    assert (found() == Alarm.NONE).all()
    v *= 0.7  # balanced again, but dead
    v[:, :, 0] /= 0.82
    assert (found() == Alarm.NONE).all()


def test_all_currents_reversed_where_power_passes_one_way() -> None:
    """At R3 and R5 too, behind which is only load; nothing passes R4 and R4b: not seen."""
    at = radial()
    state = states(at, np.random.default_rng(61))
    true = true_phasors(at, state, state)
    phasors = measured(at, true, 62)
    seen = {
        name: {t.name for t, x in zip(at.points.terminals, found, strict=True) if x.all()}
        for point, name in enumerate(at.points.names)
        for found in [alarms(at, wrong(phasors, point, Wiring.REVERSED_ALL)) == Alarm.ALL_CURRENTS]
    }
    assert seen == {
        "R1": {"R1→R2", "R2→R1"},
        "R2": {"R1→R2", "R2→R1", "R2→R3", "R3→R2"},
        "R3": {"R2→R3", "R3→R2", "R3→R4", "R4→R3"},
        "R4": set(),
        "R4b": set(),
        "R5": {"R4b→R5", "R5→R4b"},
    }


def test_where_power_may_flow_either_way_its_direction_is_not_judged() -> None:
    for at in (loop(), with_pv()):
        assert not (fed_one_way(at.points.terminals) & (not at.feeder.ders)).any()
        state = states(at, np.random.default_rng(63), 300)
        phasors = measured(at, true_phasors(at, state, state), 64)
        for point in range(len(at.points.names)):
            assert not alarms(at, wrong(phasors, point, Wiring.REVERSED_ALL)).any()


def test_share_seen_beside_one_phase_load() -> None:
    """One current reversed, up to 500 kW on one phase: what an honest report must say."""
    shares = {}
    for build in (radial, loop):
        at = build()
        rng = np.random.default_rng(65)
        state = with_one_phase_load(at, rng, states(at, rng), 500.0)
        phasors = measured(at, true_phasors(at, state, state), 66)
        for name in ("R1", "R2", "R3"):
            point = at.points.names.index(name)
            found = alarms(at, wrong(phasors, point, Wiring.REVERSED_A))[concerned(at, point)]
            shares[build.__name__, name] = float((found != 0).mean())
    assert shares["radial", "R1"] > 0.98
    assert shares["radial", "R3"] == pytest.approx(0.88, abs=0.03)
    assert shares["loop", "R1"] == pytest.approx(0.87, abs=0.03)
    assert shares["loop", "R3"] == pytest.approx(0.31, abs=0.04)


# --- consequences ----------------------------------------------------------------------


def test_wrong_wiring_alarms_and_does_not_trip() -> None:
    """Steps of load at every point and kind of wrong wiring, at the paper's settings.

    Unsupervised, wrong labels make breaks of hundreds of them. Supervised, what trips is what
    trips with the right wiring too.
    """
    at = radial()
    rng = np.random.default_rng(67)
    before = states(at, rng, 300)
    after = with_one_phase_load(at, rng, before, 500.0)
    settings = Settings(i_set_a=1.0, v_set_pu=0.05, z_set_ohm=5.0)
    phasors = measured(at, true_phasors(at, before, after), 68)

    def trips(reported: Phasors, supervised: bool) -> NDArray[np.bool_]:
        terminals, v_nominal_v = at.points.terminals, at.network.tree.v_nominal_v
        evidence = evidence_of(reported, terminals, v_nominal_v)
        if supervised:
            evidence = with_alarm(evidence, alarms(at, reported))
        return np.asarray(verdict(evidence, settings) == Reason.TRIP)

    right = trips(phasors, True)
    np.testing.assert_array_equal(right, trips(phasors, False))
    unsupervised = dict.fromkeys(KINDS, 0)
    for kind in KINDS:
        for point in range(len(at.points.names)):
            reported, mine = wrong(phasors, point, kind), concerned(at, point)
            unsupervised[kind] += int((trips(reported, False) & ~right)[mine].sum())
            assert not (trips(reported, True) & ~right)[mine].any()
    assert all(unsupervised[kind] > 100 for kind in LABELS)


def test_both_directions_are_wanted() -> None:
    at = radial()
    phasors = true_phasors(at, at.steady, at.steady)
    with pytest.raises(ValueError, match="both directions"):
        wiring_alarm(phasors, at.points.terminals[:1], at.network.tree.v_nominal_v)


def test_every_alarm_has_words() -> None:
    assert len({alarm.text for alarm in Alarm}) == len(Alarm)
