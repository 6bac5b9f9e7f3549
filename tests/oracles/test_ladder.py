"""The ladder against the dense reference, over random feeders with every element."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.comparison import TOLERANCE, Case, Outcome, compare, outcomes
from oracles.random_elements import FOUR_WIRE, THREE_WIRE, random_full_feeder
from oracles.random_happenings import Happening, random_happening

from openphase.model.errors import InputError
from openphase.model.events.base import no_event
from openphase.model.machine_state import carried_over, machine_state
from openphase.model.machines import DER_MODELS
from openphase.model.network import CONNECTIONS, compile_network
from openphase.model.parts import Connection, Feeder, Transformer
from openphase.model.solve import quiet_state, solve, steady_state

FEEDERS = 500

Sample: TypeAlias = "dict[int, tuple[Case, list[Outcome]]]"
Real = NDArray[np.float64]


def a_case(seed: int) -> Case:
    rng = np.random.default_rng([seed, 41])
    with_tie = seed % 2 == 0
    feeder = random_full_feeder(rng, int(rng.integers(1, 8)), with_tie)
    closed = {s.name for s in feeder.switches if s.closed}
    opened: frozenset[str] = frozenset()
    if with_tie and rng.random() < 0.7 and _loop_is_carried(feeder, closed):
        closed.add("TIE")
        opened = _transferred(rng, feeder, frozenset(closed))
    network = compile_network(feeder, frozenset(closed), opened)
    return Case(
        feeder=feeder,
        closed=frozenset(closed),
        opened=opened,
        network=network,
        happening=random_happening(rng, feeder, network),
    )


def _loop_is_carried(feeder: Feeder, closed: set[str]) -> bool:
    """Whether the loop of the tie leaves its fork by a line on one side at least."""
    try:
        compile_network(feeder, frozenset({*closed, "TIE"}))
    except InputError:
        return False
    return True


def _transferred(
    rng: np.random.Generator, feeder: Feeder, closed: frozenset[str]
) -> frozenset[str]:
    """Sometimes a point on the loop is opened, so that part of it is fed by the tie."""
    loop = compile_network(feeder, closed)
    ring = {loop.nodes[k] for k in np.flatnonzero(loop.tree.in_loop)}
    ring |= {loop.nodes[k] for k in loop.tree.fork}
    ends = {line.name: {line.from_bus, line.to_bus} for line in feeder.lines}
    points = [p.name for p in feeder.points if ends[p.line] <= ring]
    if not points or rng.random() < 0.6:
        return frozenset()
    return frozenset({points[int(rng.integers(len(points)))]})


@pytest.fixture(scope="module")
def sample() -> Sample:
    """All feeders, by seed."""
    cases = {seed: a_case(seed) for seed in range(FEEDERS)}
    return {seed: (case, outcomes(case)) for seed, case in cases.items()}


def seeds_that(sample: Sample, *how: str) -> list[int]:
    return [seed for seed, (_, found) in sample.items() if any(x.how in how for x in found)]


def test_no_state_differs(sample: Sample) -> None:
    assert not seeds_that(sample, "differ")
    gaps = [x.gap for _, found in sample.values() for x in found if x.how == "agree"]
    assert len(gaps) >= 1.97 * FEEDERS
    assert max(gaps) <= TOLERANCE


def test_the_ladder_settles(sample: Sample) -> None:
    assert not seeds_that(sample, "unsettled")
    assert len(seeds_that(sample, "elsewhere")) <= FEEDERS // 50
    assert len(seeds_that(sample, "reference unsettled")) <= FEEDERS // 100


def test_what_is_undetermined_or_has_no_solution_is_flagged_and_rare(sample: Sample) -> None:
    states = [x for _, found in sample.values() for x in found]
    floating = [x for x in states if x.floating]
    impossible = [x for x in states if x.how == "no solution"]
    assert all(x.flagged for x in [*floating, *impossible])
    assert 0 < len(floating) <= 0.05 * len(states)
    assert len(impossible) <= FEEDERS // 100


def test_every_element_and_event_is_in_the_sample(sample: Sample) -> None:
    """The comparison would prove little if its sample missed a case."""
    seen: Counter[str] = Counter()
    for case, found in sample.values():
        if len(found) == 2:
            seen.update(elements(case.feeder) | places(case) | case.happening.what)
    rare = {name: count for name, count in seen.items() if count < FEEDERS // 50}
    assert not rare
    assert seen.keys() >= WANTED


WANTED = {
    *("wires 3", "wires 4", "solid", "resistor", "petersen", "isolated", "charged", "tie closed"),
    *("Yg/Yg", "D/Yg", "Yg/D", "Y/D", "D/D", "x0", "xm", "no leakage", "wye", "delta", "motors"),
    *(f"{model}, {how}" for model in DER_MODELS for how in ("direct", "behind")),
    *("DER z0", "capacitor wye", "capacitor delta", "regulator", "opened point"),
    *("at an end", "on the chord", "in the loop", "on a tree", "nowhere"),
    *("open 1", "open 2", "open 3", "open before", "closing", "step", "earth fault"),
    *("line fault", "fallen", "far", "far, between", "emf", "tap", "loads", "ders"),
}


def elements(feeder: Feeder) -> set[str]:
    """What the feeder is made of."""
    source = feeder.source
    found = {f"wires {source.wires}", source.neutral}
    found |= {"charged" for line in feeder.lines if line.c1_nf_per_km}
    for unit in feeder.transformers:
        found.add(unit.connection)
        found |= {"x0"} if unit.x0_pu else set()
        found |= {"xm"} if unit.xm_pu else set()
        found |= set() if unit.leakage_pu else {"no leakage"}
    for load in feeder.loads:
        found |= set() if load.transformer else {load.connection}
        found |= {"motors"} if load.motor_share else set()
    for der in feeder.ders:
        found.add(f"{der.model}, {'behind' if der.transformer else 'direct'}")
        found |= {"DER z0"} if der.z0_ohm else set()
    found |= {f"capacitor {bank.connection}" for bank in feeder.capacitors}
    return found | ({"regulator"} if feeder.regulators else set())


def places(case: Case) -> set[str]:
    """Where the event stands."""
    edge, share = int(case.happening.event.edge[0]), case.happening.event.share[0]
    found = {"tie closed"} if "TIE" in case.closed else set()
    found |= {"opened point"} if case.opened else set()
    if edge < 0:
        return found | {"nowhere"}
    found |= {"at an end"} if share in (0.0, 1.0) else set()
    if edge == len(case.network.nodes):
        return found | {"on the chord"}
    return found | {"in the loop" if case.network.tree.in_loop[edge] else "on a tree"}


# Other states than the file's, and from one network to another ------------------------------


def test_drawn_states_are_feeders_with_them_written_down() -> None:
    """A scenario's connections, loads, motors and DER against a feeder that has them."""
    for seed in range(60):
        rng = np.random.default_rng([seed, 43])
        feeder = random_full_feeder(rng, int(rng.integers(1, 6)), with_tie=False)
        network = compile_network(feeder, motors=True)
        written, fields, connection = _drawn(rng, feeder, network.connection)
        state = quiet_state(network, fields["load_scale"], fields["exponent"], fields["machines"])
        state = state._replace(connection=connection)
        case = a_quiet_case(written, frozenset(s.name for s in feeder.switches if s.closed))
        outcome, _ = compare(case, solve(network, state), case.event(after=False), None)
        assert outcome.how == "agree", seed


def _drawn(
    rng: np.random.Generator, feeder: Feeder, connection: NDArray[np.int64]
) -> tuple[Feeder, dict[str, Any], NDArray[np.int64]]:
    """A feeder with other values, the fields of a state that say the same of ``feeder``."""
    network = compile_network(feeder, motors=True)
    loads, ders, units = len(feeder.loads), len(feeder.ders), len(feeder.transformers)
    scale, exponent = rng.uniform(0.2, 1.1, (loads, 1)), rng.uniform(0.0, 2.0, (loads, 1))
    share, ratio = rng.uniform(0.0, 1.0, (loads, 1)), rng.uniform(2.0, 8.0, (loads, 1))
    level = rng.uniform(0.0, 1.2, (ders, 1))
    drawn = [_other_connection(rng, unit, feeder.source.wires) for unit in feeder.transformers]
    connection = connection[:, None].copy()
    connection[:units, 0] = [CONNECTIONS[kind] for kind in drawn]
    written = replace(
        feeder,
        transformers=tuple(
            replace(unit, connection=kind)
            for unit, kind in zip(feeder.transformers, drawn, strict=True)
        ),
        loads=tuple(
            replace(
                load,
                kw=load.kw * scale[n, 0],
                exponent=float(exponent[n, 0]),
                motor_share=float(share[n, 0]),
                motor_y2_y1=float(ratio[n, 0]),
            )
            for n, load in enumerate(feeder.loads)
        ),
        ders=tuple(replace(der, kw=der.kw * level[n, 0]) for n, der in enumerate(feeder.ders)),
    )
    machines = machine_state(network, scale, exponent, share=share, y2_y1=ratio, der_level=level)
    return written, {"load_scale": scale, "exponent": exponent, "machines": machines}, connection


def _other_connection(rng: np.random.Generator, unit: Transformer, wires: int) -> Connection:
    """Any that the wires allow; a closed delta needs leakage."""
    kinds = FOUR_WIRE if wires == 4 else THREE_WIRE
    kinds = kinds if unit.leakage_pu else tuple(kind for kind in kinds if kind.endswith("/Yg"))
    return kinds[int(rng.integers(len(kinds)))]


def a_quiet_case(
    feeder: Feeder, closed: frozenset[str], opened: frozenset[str] = frozenset()
) -> Case:
    """Nothing happens."""
    network = compile_network(feeder, closed, opened)
    nothing = Happening(event=no_event(network, 1), what=frozenset())
    return Case(feeder=feeder, closed=closed, opened=opened, network=network, happening=nothing)


def test_switching_from_one_network_to_another() -> None:
    """The tie closes, and a point opens: DER keep what they had in the network before."""
    compared: Counter[str] = Counter()
    for seed in range(150):
        rng = np.random.default_rng([seed, 44])
        feeder = random_full_feeder(rng, int(rng.integers(2, 7)), with_tie=True)
        closed = {s.name for s in feeder.switches if s.closed}
        if not feeder.ders or not _loop_is_carried(feeder, closed):
            continue
        tied = frozenset({*closed, "TIE"})
        opened = _transferred(rng, feeder, tied)
        cases = [a_quiet_case(feeder, frozenset(closed)), a_quiet_case(feeder, tied, opened)]
        how = _switched(cases if rng.random() < 0.7 else cases[::-1])
        assert how in ("agree", "elsewhere"), seed
        compared[how] += 1
        compared["transfer"] += bool(opened)
    assert compared["agree"] > 50
    assert compared["transfer"] > 5


def _switched(cases: list[Case]) -> str:
    """From the first network to the second."""
    before, after = cases
    first, second = steady_state(before.network), steady_state(after.network)
    answer = solve(before.network, first)
    outcome, oracle = compare(before, answer, before.event(after=False), None, opened=before.opened)
    if oracle is None or outcome.how not in ("agree", "elsewhere"):
        return outcome.how
    ones: Real = np.ones((len(before.feeder.ders), 1))
    second = carried_over(after.network, first, answer, second, ones)
    found = solve(after.network, second, start=answer.winding_v_pu)
    state: dict[str, Any] = {"before": oracle, "opened": after.opened}
    return compare(after, found, after.event(after=True), oracle, **state)[0].how
