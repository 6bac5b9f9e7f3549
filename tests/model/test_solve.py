"""The ladder against a dense nodal solution that shares no code with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracles.dense import DenseSolution, Event, solve_dense
from oracles.random_feeders import random_event, random_feeder

from openphase.model import load_feeder
from openphase.model.network import Network, compile_network, locate
from openphase.model.parts import Feeder, Place
from openphase.model.solve import solve, steady_state
from openphase.model.solver.breaks import DEAD, FLOATING
from openphase.model.states import NOT_CONVERGED, Answer, State
from openphase.studies.solving import Break, solve_break

TOLERANCE = 1e-9


def event_state(network: Network, state: State, event: Event) -> State:
    """The state after ``event``, as the model describes it."""
    state = state._replace(emf_pu=state.emf_pu * event.emf_scale)
    if event.open_line is not None and event.open_phases:
        edge, share = locate(network, event.open_line, event.open_fraction)
        mask = sum(1 << phase for phase in event.open_phases)
        return state._replace(
            edge=np.array([edge]), share=np.array([share]), open_mask=np.array([mask])
        )
    if event.step_line is not None:
        edge, share = locate(network, event.step_line, event.step_fraction)
        y = np.zeros((3, 1), complex)
        for phase in event.step_phases:
            y[phase] = event.step_kw * 1000 / len(event.step_phases) / network.tree.v_nominal_v**2
        return state._replace(
            edge=np.array([edge]),
            share=np.array([share]),
            step_y_s=y,
            step_exponent=np.array([event.step_exponent]),
        )
    return state


def gap_pu(
    feeder: Feeder, network: Network, answer: Answer, oracle: DenseSolution, event: Event | None
) -> float:
    """Largest difference in pu of nominal voltage and of 1 MVA."""
    v_base = feeder.source.v_phase_v
    i_base = 1e6 / (3 * v_base)
    gaps = [0.0]

    def compare_v(name: str, ours: np.ndarray) -> None:
        for phase in range(3):
            if (name, phase) not in oracle.floating:
                gaps.append(abs(ours[phase] - oracle.v[name][phase]) / v_base)

    for bus in {end for line in feeder.lines for end in (line.from_bus, line.to_bus)}:
        compare_v(bus, answer.v[network.node(bus), :, 0])
    for line in feeder.lines:
        edges = network.edges_of(line.name)
        first, last = edges[0], edges[-1]
        start = answer.i[2 * first + (not network.upward[first]), :, 0]
        stop = answer.i[2 * last + network.upward[last], :, 0]
        start = start if network.upward[first] else -start
        stop = -stop if network.upward[last] else stop
        gaps.append(np.abs(start - oracle.i_from[line.name]).max() / i_base)
        gaps.append(np.abs(stop - oracle.i_to[line.name]).max() / i_base)
    if event is not None and event.open_phases and event.open_line is not None:
        edge, _ = locate(network, event.open_line, event.open_fraction)
        names = ("p", "q") if network.upward[edge] else ("q", "p")
        for n, stub in enumerate(names):
            compare_stub = f"{event.open_line}.{stub}"
            for phase in range(3):
                if (compare_stub, phase) not in oracle.floating:
                    ours = answer.stub[n, phase, 0]
                    gaps.append(abs(ours - oracle.stubs[compare_stub][phase]) / v_base)
    return max(gaps)


def solve_both(
    feeder: Feeder, closed: frozenset[str], event: Event
) -> tuple[float, float, Answer, DenseSolution]:
    """Gaps before and after the event, and both answers after it."""
    network = compile_network(feeder, closed)
    state = steady_state(network)
    before = solve(network, state)
    oracle_before = solve_dense(feeder, closed)
    after = solve(network, event_state(network, state, event), start=before.winding_v_pu)
    oracle = solve_dense(feeder, closed, event, start=oracle_before)
    return (
        gap_pu(feeder, network, before, oracle_before, None),
        gap_pu(feeder, network, after, oracle, event),
        after,
        oracle,
    )


@pytest.mark.parametrize("seed", range(120))
@pytest.mark.parametrize("exponent", [2.0, None], ids=["linear", "mixed"])
def test_random_feeders_agree_with_the_dense_solution(seed: int, exponent: float | None) -> None:
    rng = np.random.default_rng([seed, 17])
    feeder = random_feeder(
        rng,
        int(rng.integers(1, 9)),
        with_tie=seed % 2 == 0,
        exponent=exponent,
        closed_switch=seed % 3 == 0,
    )
    closed = {s.name for s in feeder.switches if s.closed}
    if seed % 4 == 0:
        closed |= {s.name for s in feeder.switches}
    event = random_event(rng, feeder, exponent=exponent)
    before, after, answer, oracle = solve_both(feeder, frozenset(closed), event)
    assert not answer.flags[0] & NOT_CONVERGED
    assert before < TOLERANCE
    if exponent is None and after >= TOLERANCE:
        # several operating points can exist after a break; the oracle must then have others too
        other = solve_dense(feeder, frozenset(closed), event)
        assert abs(other.source_va - oracle.source_va) > 1e-6 * abs(oracle.source_va)
        pytest.skip("several operating points exist after this event")
    assert after < TOLERANCE
    if oracle.floating:
        assert answer.flags[0] & (DEAD | FLOATING)


def test_loops_breaks_and_connections_all_occur_in_the_sample() -> None:
    """The property test above would prove little if its sample missed a case."""
    seen: set[str] = set()
    for seed in range(120):
        rng = np.random.default_rng([seed, 17])
        feeder = random_feeder(
            rng,
            int(rng.integers(1, 9)),
            with_tie=seed % 2 == 0,
            exponent=2.0,
            closed_switch=seed % 3 == 0,
        )
        event = random_event(rng, feeder, exponent=2.0)
        seen |= {t.connection for t in feeder.transformers}
        seen |= {load.connection for load in feeder.loads if load.transformer is None}
        seen.add(f"open {len(event.open_phases)}")
        seen.add("step" if event.step_line else "no step")
        if seed % 4 == 0 and any(s.name == "TIE" for s in feeder.switches):
            network = compile_network(feeder, frozenset(s.name for s in feeder.switches))
            assert network.chords
            if event.open_line:
                edge, _ = locate(network, event.open_line, event.open_fraction)
                on_chord = edge == len(network.nodes)
                seen.add("chord" if on_chord else f"loop {network.tree.in_loop[edge]}")
    # what these feeders leave out is compared in oracles/test_ladder.py, over all connections
    assert seen >= {"Yg/Yg", "D/Yg", "Yg/D"}
    assert seen >= {"wye", "delta", "open 1", "open 2", "open 3", "step"}
    assert seen >= {"chord", "loop True", "loop False"}


@pytest.mark.parametrize("seed", range(200, 280))
def test_what_floats_is_what_the_dense_solution_cannot_determine(seed: int) -> None:
    """The nulls of ``solve``, bus by bus and phase by phase, stubs included."""
    rng = np.random.default_rng([seed, 18])
    feeder = random_feeder(rng, int(rng.integers(1, 7)), exponent=2.0)
    bare = replace(feeder, points=(), sections=())
    if seed % 2:  # idle units: what an open conductor leaves to float
        bare = replace(bare, loads=tuple(load for load in bare.loads if rng.random() < 0.4))
    line = bare.lines[int(rng.integers(len(bare.lines)))].name
    phases = [(0,), (1, 2), (0, 2), (0, 1, 2)][int(rng.integers(4))]
    closed = frozenset(s.name for s in bare.switches if s.closed)
    fraction = float(rng.uniform(0.05, 0.95))
    event = Event(open_line=line, open_fraction=fraction, open_phases=phases)
    oracle = solve_dense(bare, closed, event, start=solve_dense(bare, closed))
    answer = solve_break(bare, Break(line=line, fraction=fraction, phases=phases), closed)
    normal = compile_network(bare)
    edge, _ = locate(normal, line, fraction)
    # the oracle calls the from-side p; ours is the upstream one
    swap = {} if normal.upward[edge] else {f"{line}.p": f"{line}.q", f"{line}.q": f"{line}.p"}
    ours = {
        (swap.get(name, name), phase)
        for name, bus in answer["buses"].items()
        for phase in range(3)
        if bus["after"][phase] is None
    }
    known = {(name, phase) for name in answer["buses"] for phase in range(3)}
    assert ours == {own for own in oracle.floating if (swap.get(own[0], own[0]), own[1]) in known}


def test_a_direct_load_called_like_a_transformer_keeps_its_own_connection() -> None:
    feeder = load_feeder("paper")
    extra = replace(
        feeder.loads[0],
        name="T4",
        transformer=None,
        place=Place(bus="R3"),
        connection="wye",
    )
    twins = [
        replace(feeder, loads=(*feeder.loads, own)) for own in (extra, replace(extra, name="X"))
    ]
    event = Event(open_line="R2-R3", open_fraction=0.6, open_phases=(0,))
    answers = [solve_both(twin, frozenset(), event)[2] for twin in twins]
    np.testing.assert_array_equal(answers[0].v, answers[1].v)
