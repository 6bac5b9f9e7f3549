"""From a drawn scenario to its evidence: the engine beside the dense nodal solution.

Everything between is ours and independent of it only here: the states, the event's place
and size, which frame is which, what DER keep, which network it is before and after, the
points' currents, the sequences, the phases and equation (5).
"""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from oracles.drawn import Frames, frames_of, perfect, reported
from oracles.scalar_detector import looks_at
from oracles.whole import any_model, whole_feeder, whole_study

from openphase.detector.evidence import reversed_terminals
from openphase.model import load_feeder
from openphase.model.distributions import Choices
from openphase.model.machines import DER_MODELS
from openphase.model.states import NOT_CONVERGED
from openphase.studies.run import engine
from openphase.studies.run.classes import DrawClass, Purpose
from openphase.studies.run.draw import BlockId, Case, Scenarios, draw_scenarios, make_cases
from openphase.studies.spec.study_file import DerDraw, NetworkState, default_study

SIZE = 4
EXACT_PU = 1e-12
#: what both solutions may be off, of nominal voltage and of some 100 A
OFF_PU, OFF_A = 2e-9, 2e-7

FARTHEST_OHM = 1e6  #: an impedance beyond is a current that is none over a voltage

KINDS = ["paper", "loop", "four wires", "four wires moved", "three wires", "three wires moved"]
KINDS += ["drawn DER"]


@functools.cache
def case_of(kind: str) -> Case:
    if kind in ("paper", "loop"):
        closed = ("R4",) if kind == "loop" else ()
        study = replace(default_study("paper"), network=NetworkState(closed=closed))
        return make_cases(load_feeder("paper"), study)[0]
    feeder = whole_feeder(3 if kind.startswith("three") else 4)
    if kind == "drawn DER":
        feeder = any_model(feeder)
        models = DerDraw(model=Choices(values=DER_MODELS))
        return make_cases(feeder, replace(whole_study(feeder), ders=models))[0]
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
    """Compare every terminal; returns how many impedances could be compared."""
    terminals, v_nominal = case.points.terminals, case.feeder.source.v_phase_v
    evidence, far = seen.evidence, reversed_terminals(case.points.terminals)
    compared = 0
    for t, terminal in enumerate(terminals):
        points = (terminal.local_point, terminal.remote_point)
        if set(points) & frames.floating:
            continue
        v, i = reported(frames, points, wrong)
        looks = looks_at(v, i, (terminal.into, terminals[far[t]].into), v_nominal)
        off_v, off_a = OFF_PU * v_nominal, OFF_A * max(1.0, *(abs(x) for x in [*i[0][0], *i[1][0]]))
        np.testing.assert_allclose(evidence.di_a[t, :, s], looks.di_a, atol=off_a)
        np.testing.assert_allclose(evidence.dv_pu[t, :, s], looks.dv_pu, atol=OFF_PU)
        assert evidence.blocked[t, s] == looks.blocked
        for r, z in enumerate(looks.z_ohm):
            local, remote, current = (row(x, r) for x in (v[1][0], v[1][1], i[1][0]))
            # eq. (5) is above / below, and each of the two loses what its differences lose
            above = 2.0 * off_v * (abs(local) + abs(remote))
            below = 2.0 * (off_a * abs(local) + off_v * abs(current))
            whole = abs(row(v[0][0], r)) * looks.di_star_a[r]
            lost = (above + below * abs(z)) / max(whole, 1e-12)
            if below < 1e-2 * whole and lost < 1e-3 * max(min(abs(z), FARTHEST_OHM), 1.0):
                assert abs(evidence.z_ohm[t, r, s] - z) <= lost
                compared += 1
    return compared


def row(abc: list[complex], r: int) -> complex:
    """The positive sequence (0) of three phases, or one of them."""
    turn = np.exp(2j * np.pi / 3)
    return abc[r - 1] if r else complex(abc[0] + turn * abc[1] + turn**2 * abc[2]) / 3.0


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


@pytest.mark.parametrize("own", list(DrawClass), ids=lambda own: own.name.lower())
def test_the_solver_s_tolerance_is_far_below_the_instruments(
    own: DrawClass, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against 1e-12 pu, ΔI and ΔV of what blocks are solved to hardly change."""
    case = case_of("four wires")
    scenarios = drawn(case, own)
    rough = engine.observe(case, scenarios).evidence
    monkeypatch.setattr(engine, "TOLERANCE_PU", EXACT_PU)
    fine = engine.observe(case, scenarios).evidence
    instruments = case.study.instruments
    small_a = 0.02 * instruments.current_floor_a
    small_pu = 0.02 * instruments.tve_pct / 100.0
    assert np.abs(rough.di_a - fine.di_a).max() < small_a
    assert np.abs(rough.dv_pu - fine.dv_pu).max() < small_pu


@pytest.mark.parametrize("name", ["v_noise", "i_noise"])
def test_every_frame_has_errors_of_its_own(name: str) -> None:
    case = case_of("paper")
    scenarios = drawn(case, DrawClass.LOAD_STEP)
    exact = engine.observe(case, scenarios).evidence
    for frame in (0, 1):
        error = np.zeros_like(scenarios.errors.v_noise)
        error[frame, :, 0] = 0.5  # one phase: equal errors of all three have no positive sequence
        changed: dict[str, Any] = {name: error}
        errors = replace(scenarios.errors, **changed)
        seen = engine.observe(case, replace(scenarios, errors=errors)).evidence
        assert not np.isclose(seen.z1_ohm, exact.z1_ohm).all()
        pairs = [(seen.di1_a, exact.di1_a), (seen.dv1_pu, exact.dv1_pu)]
        moved, still = pairs[::-1] if name == "v_noise" else pairs
        assert not np.isclose(*moved).all()
        np.testing.assert_array_equal(*still)


@pytest.mark.parametrize("name", ["v_ratio", "v_angle", "i_ratio", "i_angle", "clock"])
def test_what_lasts_of_the_errors_is_in_both_frames(name: str) -> None:
    """With nothing happening it makes no change; with something it makes another."""
    case = case_of("paper")
    scenarios = drawn(case, DrawClass.LOAD_STEP)
    lasting = np.full_like(getattr(scenarios.errors, name), 1.0)
    errors = replace(scenarios.errors, **{name: lasting})
    quiet = replace(scenarios, after=scenarios.before, errors=errors)
    nothing = replace(quiet, event=replace(scenarios.event, emf_factor=np.ones(SIZE)))
    still = engine.observe(case, nothing).evidence
    assert still.di1_a.max() < 1e-4
    assert still.dv1_pu.max() < 1e-6
    bounds = replace(case.study.instruments, ratio_pct=30.0, angle_mrad=300.0, clock_us=1000.0)
    coarse = replace(case, study=replace(case.study, instruments=bounds))
    erring = engine.observe(coarse, replace(scenarios, errors=errors)).evidence
    exact = engine.observe(case, scenarios).evidence
    other = np.abs(erring.z1_ohm - exact.z1_ohm) > 1e-3 * np.abs(exact.z1_ohm)
    # what turns V and I of both ends alike is no error of an impedance
    assert other.any() == (name != "clock")
