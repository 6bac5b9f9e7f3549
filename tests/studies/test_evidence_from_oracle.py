"""From a drawn scenario to its evidence: the engine beside the dense nodal solution.

Everything between is ours and independent of it only here: the states, the event's place
and size, which frame is which, what DER keep, which network it is before and after, the
points' currents, the sequences, the phases and equation (5).
"""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from oracles.drawn import Frames, frames_of, looks_from, perfect
from oracles.scalar_detector import Looks
from oracles.whole import whole_feeder, whole_study

from openphase.detector.evidence import reversed_terminals
from openphase.model import load_feeder
from openphase.model.states import NOT_CONVERGED
from openphase.studies.run import engine
from openphase.studies.run.classes import DrawClass, Purpose
from openphase.studies.run.draw import BlockId, Case, Scenarios, draw_scenarios, make_cases
from openphase.studies.spec.study_file import NetworkState, default_study

SIZE = 4
EXACT_PU = 1e-12
#: what both solutions may be off, of nominal voltage and of some 100 A
OFF_PU, OFF_A = 2e-9, 2e-7

KINDS = ["paper", "loop", "four wires", "four wires moved", "three wires", "three wires moved"]


@functools.cache
def case_of(kind: str) -> Case:
    if kind in ("paper", "loop"):
        closed = ("R4",) if kind == "loop" else ()
        study = replace(default_study("paper"), network=NetworkState(closed=closed))
        return make_cases(load_feeder("paper"), study)[0]
    feeder = whole_feeder(3 if kind.startswith("three") else 4)
    return make_cases(feeder, whole_study(feeder))[int(kind.endswith("moved"))]


def drawn(case: Case, own: DrawClass, number: int = 0) -> Scenarios:
    which = BlockId(
        seed=5,
        purpose=Purpose.TRAIN,
        attempt=1,
        drawn=own,
        block=number,
        group=case.group.index,
    )
    scenarios = draw_scenarios(case, which, SIZE)
    return replace(scenarios, errors=perfect(scenarios.errors))


def agree(case: Case, seen: engine.Observed, frames: Frames, wrong: tuple[int, int], s: int) -> int:
    """Compare every terminal; returns how many impedances were large enough to be compared."""
    terminals, v_nominal = case.points.terminals, case.feeder.source.v_phase_v
    evidence, far = seen.evidence, reversed_terminals(case.points.terminals)
    compared = 0
    for t, terminal in enumerate(terminals):
        if {terminal.local_point, terminal.remote_point} & frames.floating:
            continue
        looks: Looks = looks_from(frames, terminal, terminals[far[t]], v_nominal, wrong)
        currents = [abs(i) for frame in frames.i for i in frame[terminal.local_point]]
        off_a = OFF_A * max(1.0, *currents)
        np.testing.assert_allclose(evidence.di_a[t, :, s], looks.di_a, atol=off_a)
        np.testing.assert_allclose(evidence.dv_pu[t, :, s], looks.dv_pu, atol=OFF_PU)
        assert evidence.blocked[t, s] == looks.blocked
        for r, z in enumerate(looks.z_ohm):
            # eq. (5) loses what ΔI and ΔV lose, more where they nearly cancel
            lost = 10.0 * (OFF_PU * v_nominal + abs(z) * off_a) / max(looks.di_star_a[r], 1e-12)
            if lost < 1e-3 * abs(z):
                assert abs(evidence.z_ohm[t, r, s] - z) <= lost
                compared += 1
    return compared


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("own", list(DrawClass), ids=lambda own: own.name.lower())
def test_evidence_agrees_with_the_dense_solution(
    kind: str, own: DrawClass, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "TOLERANCE_PU", EXACT_PU)
    case = case_of(kind)
    if own not in case.drawn:
        return
    compared = 0
    for number in range(2 if own in (DrawClass.TIE_SWITCHING, DrawClass.TRANSFER) else 1):
        scenarios = drawn(case, own, number)
        seen = engine.observe(case, scenarios)
        assert not (seen.flags & NOT_CONVERGED).any()
        for s in range(SIZE):
            point, how = (int(part[s]) for part in scenarios.miswired)
            frames = frames_of(case, scenarios, s)
            compared += agree(case, seen, frames, (point if how else -1, how), s)
    assert compared > SIZE
