"""From a drawn scenario to its evidence: the engine beside the dense nodal solution.

Everything between is ours and independent of it only here: the states, the event's place
and size, which frame is which, the points' currents, the sequences and equation (5).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracles.dense import DenseSolution, Event, solve_dense

from openphase.model import load_feeder
from openphase.model.network import CONNECTIONS
from openphase.model.states import State
from openphase.studies.run.classes import DrawClass, Purpose, Side
from openphase.studies.run.draw import BlockId, Case, Scenarios, draw_scenarios, make_case
from openphase.studies.run.engine import observe
from openphase.studies.spec.study_file import NetworkState, default_study

SIZE = 12
NAMES = {code: name for name, code in CONNECTIONS.items()}


def drawn(closed: tuple[str, ...], kind: DrawClass) -> tuple[Case, Scenarios]:
    study = replace(default_study("paper"), network=NetworkState(closed=closed))
    case = make_case(load_feeder("paper"), study)
    which = BlockId(seed=5, purpose=Purpose.TRAIN, attempt=1, drawn=kind, block=0)
    scenarios = draw_scenarios(case, which, SIZE)
    perfect = np.zeros_like(scenarios.v_error)
    return case, replace(scenarios, v_error=perfect, i_error=perfect)


def dense(case: Case, state: State, s: int, start: DenseSolution | None) -> DenseSolution:
    """Scenario s of a state, by the oracle, from the state's own numbers."""
    event = Event()
    edge = int(state.edge[s])
    if edge >= 0:
        line, fraction = case.network.line_fraction(edge, float(state.share[s]))
        watts = state.step_y_s[:, s].real * case.network.tree.v_nominal_v**2
        phases = tuple(np.flatnonzero(watts).tolist())
        event = Event(
            open_line=line if state.open_mask[s] else None,
            open_fraction=fraction,
            open_phases=tuple(a for a in range(3) if state.open_mask[s] & (1 << a)),
            step_line=line if phases else None,
            step_fraction=fraction,
            step_kw=float(watts.sum()) / 1000,
            step_phases=phases or (0, 1, 2),
            step_exponent=float(state.step_exponent[s]),
        )
    units = [unit.name for unit in case.feeder.transformers]
    return solve_dense(
        case.feeder,
        frozenset(case.study.network.closed or ()),
        event,
        dict(zip(case.network.loads, state.load_scale[:, s].tolist(), strict=True)),
        dict(zip(case.network.loads, state.exponent[:, s].tolist(), strict=True)),
        {name: NAMES[int(state.connection[u, s])] for u, name in enumerate(units)},  # type: ignore[misc]
        float(state.emf_pu[s]) / case.network.emf_pu,
        start,
    )


def positive(abc: np.ndarray) -> complex:
    a = np.exp(2j * np.pi / 3)
    return complex(abc[0] + a * abc[1] + a * a * abc[2]) / 3


@pytest.mark.parametrize("closed", [(), ("R4",)], ids=["radial", "loop"])
@pytest.mark.parametrize("kind", list(DrawClass), ids=lambda kind: kind.name.lower())
def test_evidence_agrees_with_the_dense_solution(closed: tuple[str, ...], kind: DrawClass) -> None:
    case, scenarios = drawn(closed, kind)
    seen = observe(case, scenarios)
    points = {point.name: point for point in case.feeder.points}
    lines = {line.name: line for line in case.feeder.lines}
    compared = 0
    for s in range(SIZE):
        before = dense(case, scenarios.before, s, None)
        after = dense(case, scenarios.after, s, before)
        for t, terminal in enumerate(case.points.terminals):
            ends = points[terminal.local], points[terminal.remote]
            if {(ends[0].bus, a) for a in range(3)} & after.floating:
                continue
            if {(ends[1].bus, a) for a in range(3)} & after.floating:
                continue
            v = [[positive(state.v[end.bus]) for end in ends] for state in (before, after)]
            at_from = lines[ends[0].line].from_bus == ends[0].bus
            i = [
                terminal.into * positive((state.i_from if at_from else state.i_to)[ends[0].line])
                for state in (before, after)
            ]
            dv, dr, di = v[1][0] - v[0][0], v[1][1] - v[0][1], i[1] - i[0]
            assert seen.evidence.di1_a[t, s] == pytest.approx(abs(di), abs=2e-4)
            v_nominal = case.feeder.source.v_phase_v
            assert seen.evidence.dv1_pu[t, s] == pytest.approx(abs(dv) / v_nominal, abs=2e-6)
            denominator = di * v[1][0] - dv * i[1]
            if abs(denominator) > 0.05 * v_nominal:  # else 0/0, or a quotient of tolerances
                z = (dv * v[1][1] - dr * v[1][0]) / denominator
                assert seen.evidence.z1_ohm[t, s] == pytest.approx(z, rel=5e-3, abs=5e-3)
                compared += 1
    assert compared > SIZE


def test_sides_of_drawn_events() -> None:
    """An event is inside exactly one section of the paper's feeder, as its line says."""
    case, scenarios = drawn((), DrawClass.OPEN_PHASE)
    seen = observe(case, scenarios)
    sections = {"R1-R2": "R1", "R2-R3": "R2", "R3-R4": "R3", "R4-R5": "R5"}
    for s in range(SIZE):
        line, _ = case.network.line_fraction(int(seen.edge[s]), float(seen.share[s]))
        for t, terminal in enumerate(case.points.terminals[::2]):
            inside = terminal.local == sections[line]
            assert (seen.side[2 * t, s] == Side.PATH) == inside


@pytest.mark.parametrize("name", ["v_error", "i_error"])
def test_every_frame_has_errors_of_its_own(name: str) -> None:
    case, scenarios = drawn((), DrawClass.LOAD_STEP)
    exact = observe(case, scenarios).evidence
    for frame in (0, 1):
        error = np.zeros_like(scenarios.v_error)
        error[frame, :, 0] = 0.5  # one phase: equal errors of all three have no positive sequence
        seen = observe(case, replace(scenarios, **{name: error})).evidence
        assert not np.isclose(seen.z1_ohm, exact.z1_ohm).all()
        moved = seen.di1_a if name == "i_error" else seen.dv1_pu
        still = seen.dv1_pu if name == "i_error" else seen.di1_a
        unmoved = exact.dv1_pu if name == "i_error" else exact.di1_a
        assert not np.isclose(moved, exact.di1_a if name == "i_error" else exact.dv1_pu).all()
        np.testing.assert_array_equal(still, unmoved)
