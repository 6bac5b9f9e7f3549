"""Every class of events on a feeder that has all it takes, four wires and three, in two groups."""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from oracles.random_feeders import random_feeder
from oracles.walks import in_state, side_of, without_source
from oracles.whole import UNKNOWN, any_model, whole_feeder, whole_study
from scipy.stats import spearmanr

from openphase.detector.criteria import Reason, Settings, verdict
from openphase.detector.instruments import Wiring
from openphase.model import load_feeder
from openphase.model.distributions import Choices, Fixed
from openphase.model.events.base import Event
from openphase.model.machines import DER_MODELS
from openphase.model.network import CONNECTIONS, compile_network
from openphase.model.parts import Der, Load
from openphase.model.points import find_points
from openphase.model.sides import Side
from openphase.model.solver.breaks import DEAD, FLOATING
from openphase.model.states import NOT_CONVERGED
from openphase.studies.run.cases import Wired
from openphase.studies.run.classes import REPORTED, DrawClass, Purpose, reported_row
from openphase.studies.run.draw import BlockId, Case, Scenarios, draw_scenarios, make_cases
from openphase.studies.run.engine import Observed, observe
from openphase.studies.spec.parts import UNKNOWN_CONNECTION
from openphase.studies.spec.study_file import DerDraw, default_study

SIZE = 200
MANY = 4000
NETWORK = (
    DrawClass.SOURCE_STEP,
    DrawClass.TIE_SWITCHING,
    DrawClass.TRANSFER,
    DrawClass.DER_RAMP,
)
#: what the paper's feeder lacks
NEEDING_MORE = (
    DrawClass.REGULATOR_TAP,
    DrawClass.DER_TRIP,
    DrawClass.DER_RAMP,
    DrawClass.OPEN_WITH_DER_TRIP,
)
#: some of these stand at the source bus, where no line leads


@functools.cache
def cases(wires: int) -> tuple[Case, ...]:
    feeder = whole_feeder(wires)
    return make_cases(feeder, whole_study(feeder))


def block(
    case: Case, drawn: DrawClass, number: int = 0, purpose: Purpose = Purpose.TRAIN
) -> BlockId:
    return BlockId(
        seed=3, purpose=purpose, attempt=1, drawn=drawn, block=number, group=case.group.index
    )


@functools.cache
def seen(wires: int, group: int, drawn: DrawClass) -> tuple[Scenarios, Observed]:
    case = cases(wires)[group]
    scenarios = draw_scenarios(case, block(case, drawn), SIZE)
    return scenarios, observe(case, scenarios, case.study.detector.options())


EVERYTHING = [
    (wires, group, drawn)
    for wires, group, drawn in itertools.product((4, 3), (0, 1), DrawClass)
    if wires == 4 or drawn != DrawClass.REGULATOR_TAP  # they need a neutral
]


def test_all_classes_occur() -> None:
    for wires in (4, 3):
        first, second = cases(wires)
        missing = set() if wires == 4 else {DrawClass.REGULATOR_TAP}
        assert set(first.drawn) == set(second.drawn) == set(DrawClass) - missing


@pytest.mark.parametrize(("wires", "group", "drawn"), EVERYTHING)
def test_nothing_is_quietly_no_number(wires: int, group: int, drawn: DrawClass) -> None:
    """Where a number has no value, a flag says so; and next to nothing stays unsettled."""
    scenarios, found = seen(wires, group, drawn)
    evidence = found.evidence
    for values in (evidence.di_a, evidence.dv_pu, evidence.z_ohm):
        assert np.isfinite(values).all()
    assert not evidence.z_ohm[evidence.undefined].any()
    for state in (scenarios.before, scenarios.after):
        assert all(np.isfinite(values).all() for values in state)
    assert (found.flags & NOT_CONVERGED != 0).mean() <= 0.01
    reason = verdict(evidence, Settings(i_set_a=1.0, v_set_pu=0.05, z_set_ohm=5.0))
    assert set(np.unique(reason)) <= {int(own) for own in Reason}
    lost = found.flags & (DEAD | FLOATING) != 0
    opens_all = scenarios.event.open_after | scenarios.event.open_before
    assert not lost[opens_all != 0b111].any()


@pytest.mark.parametrize("drawn", [own for own in DrawClass if own not in NEEDING_MORE])
def test_a_feeder_without_loads_is_solved_too(drawn: DrawClass) -> None:
    feeder = replace(load_feeder("paper"), loads=())
    case = make_cases(feeder, default_study("paper"))[0]
    found = observe(case, draw_scenarios(case, block(case, drawn), 20))
    assert not (found.flags & NOT_CONVERGED).any()
    assert np.isfinite(found.evidence.di_a).all()
    assert np.isfinite(found.evidence.z_ohm).all()


@pytest.mark.parametrize(("wires", "group", "drawn"), EVERYTHING)
def test_sides_are_those_of_the_taken_apart_feeder(
    wires: int, group: int, drawn: DrawClass
) -> None:
    case = cases(wires)[group]
    scenarios, found = seen(wires, group, drawn)
    group = case.study.setting_groups()[case.group.index]
    closed = [s.name for s in case.feeder.switches if s.closed]
    looped = case.network.chords  # sides of a closed loop are those of the normal state
    own_state = in_state(
        case.feeder,
        closed if looped or group.closed is None else group.closed,
        () if looped else group.opened,
    )
    sections = own_state.sections
    rows = reported_row(drawn)
    known: dict[tuple[str, str], list[Side]] = {}
    for n in range(scenarios.event.edge.size):
        thing = thing_of(case, scenarios.event, n)
        if thing is None:
            assert drawn in NETWORK
            assert (found.side[:, n] == Side.NOWHERE).all()
            continue
        if thing not in known:
            known[thing] = [side_of(own_state, section, thing) for section in sections]
        wanted = np.repeat(known[thing], 2)
        if drawn == DrawClass.WIRING:  # stands where the wrong point is, and not where the load is
            wrong = case.points.names[scenarios.miswired[0][n]]
            own = [wrong in (section.local, section.remote) for section in case.feeder.sections]
            wanted = np.repeat(np.where(own, Side.PATH, Side.OTHER), 2)
        at_node = scenarios.event.at_node[n] >= 0  # a bus inside is inside, path or lateral
        seen_side = np.where(at_node & (found.side[:, n] == Side.LATERAL), -1, found.side[:, n])
        inside = at_node & np.isin(wanted, (Side.PATH, Side.LATERAL))
        np.testing.assert_array_equal(seen_side, np.where(inside, -1, wanted))
        for row, side in zip(rows[found.side[:, n]], wanted, strict=True):
            assert row < 0 or (REPORTED[row].drawn == drawn and side in REPORTED[row].where)


def thing_of(case: Case, event: Event, n: int) -> tuple[str, str] | None:
    """What an event is at: a line, a regulator, a bus; None: nothing."""
    network = case.network
    if event.edge[n] >= 0:
        return "line", network.line_fraction(int(event.edge[n]), float(event.share[n]))[0]
    if event.at_edge[n] >= 0:
        return "regulator", network.regulators[int(network.tree.regulator[event.at_edge[n]])]
    if event.at_node[n] >= 0:
        line, colon, _ = network.nodes[int(event.at_node[n])].partition(":")
        return ("line" if colon else "bus"), line
    return None


def test_every_side_occurs() -> None:
    _, found = seen(4, 0, DrawClass.OPEN_PHASE)
    assert set(np.unique(found.side)) == set(Side) - {Side.NOWHERE}


@pytest.mark.parametrize("seed", range(60))
def test_sides_on_random_feeders(seed: int) -> None:
    rng = np.random.default_rng([seed, 23])
    feeder = random_feeder(rng, int(rng.integers(2, 12)), closed_switch=seed % 3 == 0)
    network = compile_network(feeder)
    terminals = find_points(feeder, network).terminals
    for section, terminal in zip(feeder.sections, terminals[::2], strict=True):
        for k, piece in enumerate(network.pieces):
            if piece is not None and piece.line is not None:
                assert terminal.edge_side[k] == side_of(feeder, section, ("line", piece.line))


@pytest.mark.parametrize("wires", [4, 3])
def test_a_break_has_something_beyond_it_where_a_part_loses_its_supply(wires: int) -> None:
    """In the normal state: below the place on its line, or beyond the line."""
    case = cases(wires)[0]
    feeder = case.feeder
    scenarios, found = seen(wires, 0, DrawClass.OPEN_PHASE)
    units = {unit.name: unit.place for unit in feeder.transformers}
    parts: list[Load | Der] = [*feeder.loads, *feeder.ders]
    places = [units[p.transformer] if p.transformer else p.place for p in parts]
    lines = {line.name: line for line in feeder.lines}
    empty = 0
    for n, (edge, share) in enumerate(
        zip(scenarios.event.edge.tolist(), scenarios.event.share.tolist(), strict=True)
    ):
        name, at = case.network.line_fraction(edge, share)
        lost = without_source(feeder, name)
        downwards = lines[name].to_bus in lost
        connected = False
        for place in places:
            assert place is not None
            if place.line == name and place.at is not None:
                connected |= (place.at > at) == downwards
            elif place.line is not None:
                connected |= lines[place.line].from_bus in lost
            else:
                connected |= place.bus in lost
        assert found.connected[n] == connected
        empty += not connected
    assert 0 < empty < SIZE


@pytest.mark.parametrize("wires", [4, 3])
@pytest.mark.parametrize("drawn", DrawClass)
def test_a_block_drawn_twice_is_the_same(wires: int, drawn: DrawClass) -> None:
    if (wires, drawn) == (3, DrawClass.REGULATOR_TAP):
        return
    case = cases(wires)[1]
    scenarios, found = seen(wires, 1, drawn)
    again = draw_scenarios(make_cases(case.feeder, case.study)[1], block(case, drawn), SIZE)
    for one, other in ((scenarios.before, again.before), (scenarios.after, again.after)):
        assert all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))
    judged = observe(case, again, case.study.detector.options())
    np.testing.assert_array_equal(judged.evidence.z_ohm, found.evidence.z_ohm)
    np.testing.assert_array_equal(judged.evidence.alarm, found.evidence.alarm)


# --- what is drawn for the state -------------------------------------------------------


def many(case: Case, drawn: DrawClass = DrawClass.SOURCE_STEP) -> Scenarios:
    return draw_scenarios(case, block(case, drawn), MANY)


def assert_share(count: int, expected: float, size: int = MANY) -> None:
    assert abs(count / size - expected) < 5.0 * math.sqrt(expected * (1.0 - expected) / size)


@pytest.mark.parametrize("wires", [4, 3])
def test_unknown_connections_come_by_their_weights(wires: int) -> None:
    case = cases(wires)[0]
    connection = many(case).before.connection
    law = UNKNOWN_CONNECTION[wires]
    rows = [case.network.units.index(name) for name in UNKNOWN]
    total = sum(law.weights)
    for row in rows:
        for name, weight in zip(law.values, law.weights, strict=True):
            assert_share(int((connection[row] == CONNECTIONS[name]).sum()), weight / total)
    # one by one
    most = CONNECTIONS[law.values[0]]
    both = (connection[rows] == most).all(axis=0).sum()
    assert_share(int(both), (law.weights[0] / total) ** 2)


def test_the_study_s_own_law_of_unknown_connections_is_taken() -> None:
    feeder = whole_feeder(4)
    study = whole_study(feeder)
    units = replace(study.transformers, unknown=Choices(values=("D/D", "Y/D"), weights=(1, 3)))
    case = make_cases(feeder, replace(study, transformers=units))[0]
    connection = many(case).before.connection[case.network.units.index("T2")]
    assert_share(int((connection == CONNECTIONS["D/D"]).sum()), 0.25)
    assert set(connection) == {CONNECTIONS["D/D"], CONNECTIONS["Y/D"]}


def test_der_models_are_drawn_by_their_weights() -> None:
    feeder = any_model(whole_feeder(4))
    weights = (1.0, 2.0, 3.0, 4.0)
    ders = DerDraw(model=Choices(values=DER_MODELS[::-1], weights=weights))
    case = make_cases(feeder, replace(whole_study(feeder), ders=ders))[0]
    model = many(case).der_model
    for row in model:
        for name, weight in zip(DER_MODELS[::-1], weights, strict=True):
            assert_share(int((row == DER_MODELS.index(name)).sum()), weight / 10.0)
    assert abs(np.corrcoef(model[0], model[1])[0, 1]) < 5.0 / math.sqrt(MANY)


def test_der_models_are_the_file_s_without_a_law() -> None:
    case = cases(4)[0]
    model = many(case).der_model
    wanted = [DER_MODELS.index(der.model) for der in case.feeder.ders]
    np.testing.assert_array_equal(model, np.repeat(np.array(wanted)[:, None], MANY, axis=1))


def test_der_levels_motors_and_loads_arrive_where_they_belong() -> None:
    case = cases(4)[0]
    state = many(case).before
    own, motors = case.network.machines, len(case.feeder.loads)
    assert own.motor_load.size == motors  # the study gives every load a motor
    level = -state.machine_va[motors:] / own.der_va[:, None]
    np.testing.assert_allclose(level, np.broadcast_to(level[0], level.shape), rtol=1e-12)
    assert level.real.min() >= 0.0
    assert level.real.max() <= 1.0
    taken = state.machine_va[:motors] / own.load_va[:, None]
    whole = taken.real + state.load_scale
    share = taken.real / whole
    np.testing.assert_allclose(share, np.broadcast_to(share[0], share.shape), rtol=1e-9)
    assert 0.1 <= share.min() < 0.15
    assert 0.55 < share.max() <= 0.6
    y1 = state.machine_va[:motors].conj() / (3.0 * case.network.tree.v_nominal_v**2)
    ratio = state.machine_y_s[:motors, 2] / y1
    np.testing.assert_allclose(ratio, np.broadcast_to(ratio[0], ratio.shape), rtol=1e-9)
    assert 3.0 <= ratio.real.min() < 3.1
    assert 6.9 < ratio.real.max() <= 7.0 + 1e-9


def test_correlated_scalars_arrive() -> None:
    """A rank correlation of -0.7 between the loads' level and the DER's; and no other."""
    case = cases(4)[0]
    loads = replace(case.study.loads, each=Fixed(value=1.0))
    own = replace(case, study=replace(case.study, loads=loads))
    scenarios = many(own)
    state, motors = scenarios.before, len(case.feeder.loads)
    machines = case.network.machines
    level = state.load_scale[0] + state.machine_va[0].real / machines.load_va[0].real
    generation = (-state.machine_va[motors] / machines.der_va[0]).real
    share = 1.0 - state.load_scale[0] / level
    source = scenarios.after.emf_pu / scenarios.before.emf_pu / scenarios.event.emf_factor
    error = 5.0 / math.sqrt(MANY)
    assert abs(spearmanr(level, generation).statistic + 0.7) < error
    for one, other in itertools.combinations([level, share, source], 2):
        assert abs(spearmanr(one, other).statistic) < error


# --- switching and wiring --------------------------------------------------------------


def is_state(case: Case, wired: Wired, closed: set[str], opened: set[str]) -> bool:
    wanted = compile_network(case.feeder, frozenset(closed), frozenset(opened))
    return wired.network.nodes == wanted.nodes and [
        piece and piece.key for piece in wired.network.pieces
    ] == [piece and piece.key for piece in wanted.pieces]


@pytest.mark.parametrize("wires", [4, 3])
def test_switching_goes_to_each_other_state_and_back(wires: int) -> None:
    normal, moved = cases(wires)
    closed = {switch.name for switch in normal.feeder.switches if switch.closed}
    tied = (closed | {"R4"}, set[str]())
    fed_by_r5 = (closed | {"R4"}, {"R1"})
    wanted = {
        (0, DrawClass.TIE_SWITCHING): [tied],
        (0, DrawClass.TRANSFER): [tied, fed_by_r5],
        (1, DrawClass.TIE_SWITCHING): [tied],
        (1, DrawClass.TRANSFER): [tied],  # its own state is no other one
    }
    for (group, drawn), others in wanted.items():
        case = (normal, moved)[group]
        own = (closed, set[str]()) if group == 0 else fed_by_r5
        for number in range(6):
            scenarios = draw_scenarios(case, block(case, drawn, number), 5)
            there = others[number // 2 % len(others)]
            first, second = (own, there) if number % 2 == 0 else (there, own)
            assert is_state(case, scenarios.first, *first)
            assert is_state(case, scenarios.second, *second)
            for wired, state in (
                (scenarios.first, scenarios.before),
                (scenarios.second, scenarios.after),
            ):
                file = np.repeat(wired.network.ratio[:, :, None], 5, axis=2)
                np.testing.assert_array_equal(state.ratio, file)
            found = observe(case, scenarios)
            assert (found.evidence.di1_a > 0.1).any(axis=0).all()


@pytest.mark.parametrize("wires", [4, 3])
def test_other_classes_stay_in_their_own_network(wires: int) -> None:
    for case in cases(wires):
        for drawn in set(case.drawn) - {DrawClass.TIE_SWITCHING, DrawClass.TRANSFER}:
            for number in range(2):
                scenarios = draw_scenarios(case, block(case, drawn, number), 3)
                assert scenarios.first.network is case.network
                assert scenarios.second.network is case.network


def test_wiring_faults_are_of_every_kind_at_every_point() -> None:
    case = cases(4)[0]
    point, kind = many(case, DrawClass.WIRING).miswired
    points = len(case.points.names)
    assert set(kind) == {int(own) for own in Wiring} - {0}
    for n in range(points):
        assert_share(int((point == n).sum()), 1.0 / points)
    # five kinds by name, each as likely, and its variants likewise
    for variants in ((1, 2, 3), (4, 5, 6), (7, 8, 9), (10,), (11, 12)):
        for own in variants:
            assert_share(int((kind == own).sum()), 0.2 / len(variants))
    for drawn in set(case.drawn) - {DrawClass.WIRING}:
        assert not draw_scenarios(case, block(case, drawn), 50).miswired[1].any()


@pytest.mark.parametrize("wires", [4, 3])
@pytest.mark.parametrize("group", [0, 1])
def test_wrong_wiring_alarms_at_its_own_terminals_alone(wires: int, group: int) -> None:
    """And nothing else does, but for what stands open before the event."""
    case = cases(wires)[group]
    scenarios, found = seen(wires, group, DrawClass.WIRING)
    point, kind = scenarios.miswired
    alarm = found.evidence.alarm
    assert alarm is not None
    own = np.array(
        [(point == t.local_point) | (point == t.remote_point) for t in case.points.terminals]
    )
    assert not alarm[~own].any()
    np.testing.assert_array_equal(found.side == Side.PATH, own)
    assert (found.side[~own] == Side.OTHER).all()
    # swapped or rotated labels show in the voltages, which are there always
    labels = np.isin(kind, [1, 2, 3, 4, 5, 6, 11, 12])
    assert (alarm[own & labels] != 0).all()
    assert (alarm[own] != 0).mean() > 0.6
    for drawn in case.drawn:
        if drawn not in (DrawClass.WIRING, DrawClass.SINGLE_POLE):
            others = seen(wires, group, drawn)[1].evidence.alarm
            assert others is not None
            assert (others != 0).mean() <= 0.01, drawn.name


def test_a_doubted_terminal_does_not_trip() -> None:
    _, found = seen(4, 0, DrawClass.WIRING)
    alarm = found.evidence.alarm
    assert alarm is not None
    reason = verdict(found.evidence, Settings(i_set_a=0.1, v_set_pu=1.0, z_set_ohm=0.1))
    np.testing.assert_array_equal(reason == Reason.WIRING, alarm != 0)
    assert (alarm != 0).any()
