"""The paper's results (its Section V) as an exact model of its feeder gives them.

Where the paper's own figures differ, ours are what the assumptions in ``paper.toml`` make
of them: a change of these numbers is a change of the physics.
"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from oracles.scenes import Pair, change, connected, looks, opened, scene

from openphase.model import Feeder, load_feeder
from openphase.model.closed_form import z_op_a_yg_d_approx


def paper_pair(
    feeder: Feeder, local: str, remote: str, *, phases: bool = False, at: float = 0.6
) -> Pair:
    """Phase A open in the middle of R2-R3, tie open."""
    the = scene(feeder)
    first, then = looks(the, the.steady), looks(the, opened(the, the.steady, "R2-R3", at, 0b001))
    return change(the, the.terminal(local, remote), first, then, phases=phases)


def moved(pair: Pair, name: str, k: int) -> float:
    values = getattr(pair, name)[:, k, 0]
    return float(abs(values[1] - values[0]))


def degrees(z: complex) -> float:
    return math.degrees(math.atan2(z.imag, z.real))


def test_the_papers_base_case() -> None:
    feeder = load_feeder("paper")
    v = feeder.source.v_phase_v
    assert abs(paper_pair(feeder, "R1", "R2").z()[0]) == pytest.approx(0.3901, abs=5e-5)
    pair = paper_pair(feeder, "R2", "R3")
    assert abs(pair.z()[0]) == pytest.approx(288.30, abs=0.005)
    assert degrees(pair.z()[0]) == pytest.approx(-179.3, abs=0.05)
    assert moved(pair, "v_n", 1) / v == pytest.approx(0.03323, abs=5e-6)
    di = [moved(pair, "i_m", k) for k in range(3)]
    assert di == pytest.approx([23.70, 0.7979, 0.798], abs=0.005)
    assert di[1:] == pytest.approx([0.7979, 0.7979], abs=5e-5)
    phases = paper_pair(feeder, "R2", "R3", phases=True)
    assert moved(phases, "i_m", 0) == pytest.approx(23.936, abs=5e-4)
    assert moved(phases, "v_n", 0) / v == pytest.approx(0.09289, abs=5e-6)
    fall = abs(phases.v_n[0, 0, 0]) - abs(phases.v_n[1, 0, 0])
    assert fall / v == pytest.approx(0.0107, abs=5e-5)  # the magnitude alone
    beyond = paper_pair(feeder, "R3", "R4", phases=True)
    assert moved(beyond, "i_m", 0) == pytest.approx(3.0845, abs=5e-5)


@pytest.mark.parametrize("at", [0.26, 0.4, 0.89])
def test_any_place_between_the_tees_gives_the_same(at: float) -> None:
    feeder = load_feeder("paper")
    pair = paper_pair(feeder, "R2", "R3", phases=True, at=at)
    assert abs(pair.z(0)[0]) == pytest.approx(28.101, abs=5e-4)


def z_a(feeder: Feeder, at: float = 0.6) -> list[float]:
    """|Z_A| at R2 with one, two and three Yg/Δ units."""
    cases = [connected(feeder, "Yg/D", *more) for more in ((), ("T5",), ("T5", "T6"))]
    pairs = [paper_pair(case, "R2", "R3", phases=True, at=at) for case in cases]
    return [float(abs(pair.z(0)[0])) for pair in pairs]


def test_phase_impedances_with_yg_d_units() -> None:
    paper = load_feeder("paper")
    assert z_a(paper) == pytest.approx([28.101, 17.968, 14.364], abs=5e-4)
    z_s, z_t = paper.source.z1_ohm, paper.transformers[0].leakage_pu * 144.0
    alone = [abs(z_op_a_yg_d_approx(z_s, z_t, n)) for n in (1, 2, 3)]
    assert alone == pytest.approx([28.6, 15.7, 11.3], abs=0.05)


def t4_at(feeder: Feeder, at: float) -> Feeder:
    units = tuple(
        replace(unit, place=replace(unit.place, at=at)) if unit.name == "T4" else unit
        for unit in feeder.transformers
    )
    return replace(feeder, transformers=units)


def test_phase_impedances_depend_on_what_the_paper_does_not_say() -> None:
    """Place of T4, cores, and Z0 of the lines; the break between T2 and T4 throughout."""
    paper = load_feeder("paper")
    found = [z_a(t4_at(paper, at), at=0.4)[0] for at in (0.5, 0.75, 0.9, 1.0)]
    assert found == pytest.approx([27.46, 27.86, 28.10, 28.26], abs=0.005)
    units = tuple(replace(unit, x0_pu=None) for unit in paper.transformers)
    assert z_a(replace(paper, transformers=units))[0] == pytest.approx(30.75, abs=0.005)
    lines = tuple(replace(line, z0_ohm_per_km=3 * line.z1_ohm_per_km) for line in paper.lines)
    overhead = z_a(replace(paper, lines=lines))
    assert overhead == pytest.approx([32.965, 23.494, 20.459], abs=5e-4)


@pytest.mark.parametrize(("ohm", "expected"), [(0.72, (2.4051, 2.4107)), (0.52, (2.2054, 2.2103))])
def test_the_papers_closed_loop(ohm: float, expected: tuple[float, float]) -> None:
    paper = load_feeder("paper")
    lines = tuple(
        replace(
            line,
            z1_ohm_per_km=line.z1_ohm_per_km * ohm / 0.72,
            z0_ohm_per_km=line.z0_ohm_per_km * ohm / 0.72,
        )
        if line.name == "R3-R4"
        else line
        for line in paper.lines
    )
    at = scene(replace(paper, lines=lines), frozenset({"R4"}))
    first, then = looks(at, at.steady), looks(at, opened(at, at.steady, "R2-R3", 0.6, 0b001))
    for names, value in zip((("R2", "R3"), ("R3", "R2")), expected, strict=True):
        z = change(at, at.terminal(*names), first, then).z()[0]
        assert abs(z) == pytest.approx(value, abs=5e-5)
        assert z.real < 0
