"""The ladder against the dense reference, over random feeders with every element."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.dense import DenseSolution, NoSolutionError, NotConvergedError, solve_dense
from oracles.dense import Event as DenseEvent
from oracles.random_elements import random_full_feeder
from oracles.random_happenings import Happening, dense_event, random_happening

from openphase.model.errors import InputError
from openphase.model.events.base import apply_event
from openphase.model.machines import DER_MODELS, carried_over
from openphase.model.network import Network, compile_network, detached_end
from openphase.model.parts import Feeder
from openphase.model.solve import solve, steady_state
from openphase.model.solver.breaks import DEAD, FLOATING
from openphase.model.states import NOT_CONVERGED, Answer

TOLERANCE = 1e-9
FEEDERS = 500

Complex = NDArray[np.complex128]
Sample: TypeAlias = "dict[int, tuple[Case, list[Outcome]]]"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """A feeder in one state of its switches, and an event."""

    feeder: Feeder
    closed: frozenset[str]
    opened: frozenset[str]
    network: Network
    happening: Happening

    @property
    def detached(self) -> dict[str, str]:
        """The reference's names of detached line ends, by those of the network."""
        points = [p for p in self.feeder.points if p.name in self.opened]
        return {detached_end(p.name): f"{p.line}@{p.bus}" for p in points}

    def event(self, *, after: bool) -> DenseEvent:
        """The reference's state before or after the event."""
        return dense_event(self.network, self.happening.event, self.detached, after=after)


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
    ring.add(loop.nodes[loop.tree.fork])
    ends = {line.name: {line.from_bus, line.to_bus} for line in feeder.lines}
    points = [p.name for p in feeder.points if ends[p.line] <= ring]
    if not points or rng.random() < 0.6:
        return frozenset()
    return frozenset({points[int(rng.integers(len(points)))]})


def gap_pu(case: Case, answer: Answer, oracle: DenseSolution, event: DenseEvent) -> float:
    """Largest difference, of voltages in pu of nominal and currents in pu of 1 MVA.

    Where there are larger ones, at resonance or a fault, in pu of the largest.
    """
    network, feeder = case.network, case.feeder
    highest = max(np.abs(v).max() for v in [*oracle.v.values(), *oracle.stubs.values()])
    v_base = max(feeder.source.v_phase_v, float(highest))
    largest = max(np.abs(i).max() for i in [*oracle.i_from.values(), oracle.i_source])
    i_base = max(1e6 / (3 * feeder.source.v_phase_v), float(largest))
    gaps = [0.0]

    def compare_v(name: str, ours: Complex, theirs: Complex) -> None:
        for k in range(3):
            if (name, k) not in oracle.floating:
                gaps.append(abs(ours[k] - theirs[k]) / v_base)

    ours = {theirs: own for own, theirs in case.detached.items()}
    for bus, v in oracle.v.items():
        compare_v(bus, answer.v[network.node(ours.get(bus, bus)), :, 0], v)
    for line in feeder.lines:
        edges = network.edges_of(line.name)
        first, last = edges[0], edges[-1]
        start = answer.i[2 * first + (not network.upward[first]), :, 0]
        stop = answer.i[2 * last + network.upward[last], :, 0]
        start = start if network.upward[first] else -start
        stop = -stop if network.upward[last] else stop
        gaps.append(np.abs(start - oracle.i_from[line.name]).max() / i_base)
        gaps.append(np.abs(stop - oracle.i_to[line.name]).max() / i_base)
    if event.open_line is not None:
        upward = network.upward[int(case.happening.event.edge[0])]
        for n, side in enumerate("pq" if upward else "qp"):
            name = f"{event.open_line}.{side}"
            compare_v(name, answer.stub[n, :, 0], oracle.stubs[name])
    return max(gaps)


def winding_voltages(
    case: Case, answer: Answer, event: DenseEvent
) -> dict[str, NDArray[np.float64]]:
    """The ladder's voltages, as a start for the reference."""
    network = case.network
    units = network.tree.load_unit
    found = {name: answer.unit_v_pu[units[n], :3, 0] for n, name in enumerate(network.loads)}
    own = network.machines
    for m, unit in enumerate(own.unit):
        motors = own.motor_load.size
        name = (
            f"{network.loads[own.motor_load[m]]}.motor"
            if m < motors
            else f"{own.ders[m - motors]}.der"
        )
        found[name] = np.full(3, answer.unit_v_pu[unit, 3, 0])
    for n, shunt in enumerate(event.shunts):
        if shunt.exponent != 2.0:
            found[f"shunt {n}"] = answer.unit_v_pu[-1, [shunt.phase], 0]
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How one state compares."""

    how: Literal["agree", "elsewhere", "differ", "unsettled", "no solution", "reference unsettled"]
    gap: float = np.inf
    floating: bool = False  #: the reference finds undetermined voltages
    flagged: bool = False  #: so does the ladder


def compare(
    case: Case, answer: Answer, event: DenseEvent, start: DenseSolution | None, **state: Any
) -> tuple[Outcome, DenseSolution | None]:
    """The ladder's answer against the reference; and the reference at the same state.

    Where several operating points exist the reference may have found another. Then what the
    ladder found must be one as well: the reference, held at the ladder's voltages, must give
    them back.
    """
    flagged = bool(answer.flags[0] & (DEAD | FLOATING))
    try:
        oracle = solve_dense(case.feeder, case.closed, event, start=start, **state)
    except NoSolutionError:
        return Outcome(how="no solution", flagged=flagged), None
    except NotConvergedError:
        return Outcome(how="reference unsettled", flagged=flagged), None
    found = Outcome(
        how="unsettled" if answer.flags[0] & NOT_CONVERGED else "agree",
        gap=gap_pu(case, answer, oracle, event),
        floating=bool(oracle.floating),
        flagged=flagged,
    )
    if found.how == "unsettled" or found.gap <= TOLERANCE:
        return found, oracle
    start = replace(oracle, load_pu=winding_voltages(case, answer, event))
    held = solve_dense(case.feeder, case.closed, event, start=start, hold=True, **state)
    moved = max(np.abs(held.load_pu[name] - pu).max() for name, pu in start.load_pu.items())
    gap = gap_pu(case, answer, held, event)
    if max(gap, moved) > TOLERANCE:
        return replace(found, how="differ"), oracle
    return replace(found, how="elsewhere", gap=gap), held


def outcomes(case: Case) -> list[Outcome]:
    """Before the event, and after it."""
    network, event = case.network, case.happening.event
    steady = steady_state(network)
    first, second = apply_event(network, steady, steady, event)
    answer = solve(network, first)
    state: dict[str, Any] = {"opened": case.opened}
    before, oracle = compare(case, answer, case.event(after=False), None, **state)
    if before.how not in ("agree", "elsewhere"):
        return [before]
    second = carried_over(network, first, answer, second, event.der_factor)
    answer = solve(network, second, start=answer.unit_v_pu)
    scale = {name: float(event.load_factor[n, 0]) for n, name in enumerate(network.loads)}
    state |= {"before": oracle, "load_scale": scale}
    return [before, compare(case, answer, case.event(after=True), oracle, **state)[0]]


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
