"""The sequence networks against the three-phase ladder, and the closed forms on their own."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from oracles.random_feeders import random_feeder
from oracles.scenes import Scene, looks, opened, scene

from openphase.model import Feeder, Place, load_feeder
from openphase.model.closed_form import (
    break_current,
    break_voltage,
    false_trip_probability,
    least_operating_voltage,
    z_op1_approx,
    z_op_a_four_wire_approx,
    z_op_a_three_wire_approx,
    z_op_a_yg_d_approx,
)
from openphase.model.sequence_network import Flow, after, before, loops, sequence_network, two_port
from openphase.model.solver.breaks import DEAD, FLOATING
from openphase.model.states import Answer
from openphase.model.symmetrical import to_phases, to_sequences

TOLERANCE = 1e-9
SEEDS = 80
#: open phases, and which phase is the odd one: open of one, whole of two
BREAKS = {0b001: (1, 0), 0b010: (1, 1), 0b100: (1, 2), 0b110: (2, 0), 0b101: (2, 1), 0b011: (2, 2)}
BREAKS[0b111] = (3, 0)


def balanced_feeder(seed: int) -> Feeder:
    """Random, radial and linear; every third one has a single kind of transformer."""
    rng = np.random.default_rng([seed, 29])
    feeder = random_feeder(
        rng, int(rng.integers(1, 9)), exponent=2.0, closed_switch=seed % 3 == 0, n_transformers=3
    )
    kinds = ("Yg/Yg", "D/Yg", "Yg/D")
    if seed % 3 == 1:
        kind = kinds[seed // 3 % 3]
        units = tuple(
            replace(unit, connection=kind, x0_pu=unit.x0_pu if kind == "Yg/Yg" else None)
            for unit in feeder.transformers
        )
        loads = feeder.loads
        if kind == "D/Yg":  # three wires: nothing but the source is earthed
            loads = tuple(replace(load, connection="delta") for load in loads)
        feeder = replace(feeder, transformers=units, loads=loads)
    return feeder


def random_place(feeder: Feeder, seed: int) -> Place:
    rng = np.random.default_rng([seed, 31])
    line = feeder.lines[int(rng.integers(len(feeder.lines)))]
    return Place(line=line.name, at=float(rng.uniform(0.02, 0.98)))


def gap_pu(at: Scene, ladder: Answer, s: int, flow: Flow, nodes: tuple[str, ...]) -> float:
    """Largest difference of any bus voltage and of any current at a line's upper end, pu."""
    source = at.feeder.source
    v_base = source.v_phase_v
    gaps = []
    for bus in {end for line in at.feeder.lines for end in (line.from_bus, line.to_bus)}:
        ours = to_phases(flow.v[nodes.index(bus)])
        gaps.append(np.abs(ours - ladder.v[at.network.node(bus), :, s]).max() / v_base)
        below = at.network.node(bus)
        current = ladder.i[2 * below + 1, :, s]
        ours = to_phases(flow.i[nodes.index(bus)])
        gaps.append(np.abs(ours - current).max() / (1e6 / (3 * v_base)))
    return max(gaps)


@pytest.mark.parametrize("seed", range(SEEDS))
def test_sequence_networks_agree_with_the_ladder(seed: int) -> None:
    feeder = balanced_feeder(seed)
    place = random_place(feeder, seed)
    at = scene(feeder)
    network = sequence_network(feeder, place)
    assert gap_pu(at, looks(at, at.steady), 0, before(network), network.nodes) < TOLERANCE
    state = opened(at, at.steady, place.line, place.at, *BREAKS)
    ladder = looks(at, state)
    if not np.isfinite(loops(network)[1][1]):
        with pytest.raises(ValueError, match="no load below the break"):
            after(network, 1)
        return
    v_base = feeder.source.v_phase_v
    for s, (count, odd) in enumerate(BREAKS.values()):
        flow = after(network, count, odd)
        if count == 3:
            # the sequence network leaves the far side's zero sequence open where it floats
            assert bool(ladder.flags[s] & FLOATING) == np.isinf(loops(network)[1][0])
            assert ladder.flags[s] & DEAD
        else:
            assert ladder.flags[s] == 0
        assert gap_pu(at, ladder, s, flow, network.nodes) < TOLERANCE
        for stub, name in enumerate("pq"):
            ours = to_phases(flow.v[network.nodes.index(f"{place.line}.{name}")])
            assert np.abs(ours - ladder.stub[stub, :, s]).max() / v_base < TOLERANCE


def test_the_sample_has_every_case() -> None:
    seen: set[str] = set()
    for seed in range(SEEDS):
        feeder = balanced_feeder(seed)
        y0, y1 = 1.0 / loops(sequence_network(feeder, random_place(feeder, seed)))[1][:2]
        seen |= {unit.connection for unit in feeder.transformers}
        seen.add("no load below" if y1 == 0 else "no zero sequence below" if y0 == 0 else "earthed")
        seen |= {f"direct {load.connection}" for load in feeder.loads if load.place}
        seen |= {"magnetizing" for unit in feeder.transformers if unit.x0_pu is not None}
        seen |= {"switch" for switch in feeder.switches if switch.closed}
    assert seen >= {"Yg/Yg", "D/Yg", "Yg/D", "direct wye", "direct delta", "magnetizing", "switch"}
    assert seen >= {"no load below", "no zero sequence below", "earthed"}


def random_impedances(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng([seed, 37])
    parts = rng.uniform(0.1, 300.0, (4, 2, 50))
    current, z1, z2, z0 = parts[:, 0] + 1j * parts[:, 1]
    return current, z1, z2, z0


@pytest.mark.parametrize("mask", list(BREAKS))
def test_the_open_phases_carry_nothing_and_the_whole_ones_drop_nothing(mask: int) -> None:
    """The boundary conditions themselves, in phases."""
    current, z1, z2, z0 = random_impedances(mask)
    count, odd = BREAKS[mask]
    di = break_current(count, current, z1, z2, z0, odd)
    i = to_phases(di + np.stack([0 * current, current, 0 * current]))
    turn = np.exp(2j * np.pi / 3) ** np.array([-odd, 0.0, odd])
    v_pq = to_phases(turn[:, None] * break_voltage(count, current, z1, z2, z0))
    scale = np.abs(current).max()
    for phase in range(3):
        if mask >> phase & 1:
            assert np.abs(i[phase]).max() < 1e-13 * scale
        else:
            assert np.abs(v_pq[phase]).max() < 1e-11 * scale
    sequences = to_sequences(v_pq)
    loop = np.stack([z0, z1, z2])
    assert sequences == pytest.approx(-loop * di, rel=1e-11, abs=1e-9)


def test_one_open_phase_is_the_papers_series_connection() -> None:
    current, z1, z2, z0 = random_impedances(0)
    z20 = z2 * z0 / (z2 + z0)
    di0, di1, di2 = break_current(1, current, z1, z2, z0)
    assert di1 == pytest.approx(-current * z20 / (z1 + z20), rel=1e-12)
    assert np.abs(di2) == pytest.approx(np.abs(di1 * z1 / z2), rel=1e-12)
    assert di0 + di1 + di2 == pytest.approx(-current, rel=1e-12)


def test_a_four_wire_break_takes_a_third_and_a_three_wire_break_a_half() -> None:
    z, current = np.array(288.0 + 0j), np.array(24.0 + 0j)
    infinite = np.array(np.inf + 0j)
    assert break_current(1, current, z, z, z)[1] == pytest.approx(-8.0)
    assert break_current(1, current, z, z, infinite)[1] == pytest.approx(-12.0)
    assert break_current(2, current, z, z, z)[1] == pytest.approx(-16.0)
    assert break_current(2, current, z, z, infinite)[1] == pytest.approx(-24.0)
    # two open with a Yg/Δ bank, whose zero-sequence impedance is next to nothing
    assert break_current(2, current, z, z, z / 1e9)[1] == pytest.approx(-12.0)
    # one open with it: I Z0 / Z1, which halves twice when the load halves once
    light = break_current(1, current / 2, 2 * z, 2 * z, np.array(0.1 + 0j))[1]
    full = break_current(1, current, z, z, np.array(0.1 + 0j))[1]
    assert full == pytest.approx(-24.0 * 0.1 / 288.0, rel=1e-3)
    assert full / light == pytest.approx(4.0, rel=1e-3)


@pytest.mark.parametrize("count", [0, 4])
def test_there_are_three_phases(count: int) -> None:
    current, z1, z2, z0 = random_impedances(0)
    with pytest.raises(ValueError, match="must be 1, 2 or 3"):
        break_current(count, current, z1, z2, z0)
    with pytest.raises(ValueError, match="must be 1, 2 or 3"):
        break_voltage(count, current, z1, z2, z0)


def test_the_papers_approximations_give_the_papers_numbers() -> None:
    z_s, z_t, z_l = np.array(0.9 + 0j), np.array(8.6 + 0j), np.array(288.0 + 0j)
    assert z_op1_approx(z_s, z_l) == pytest.approx(-288.9)
    assert z_op_a_three_wire_approx(z_s, z_l) == pytest.approx(-1.5 * 288.9)
    assert z_op_a_four_wire_approx(z_s, z_l) == pytest.approx(-288.9)
    # eq. (13) for one unit is in the paper; for more, the text says they act in parallel
    z = z_op_a_yg_d_approx(z_s, z_t, np.array([1.0, 2.0, 3.0]))
    assert z == pytest.approx([-28.5, -15.6, -11.3], abs=0.03)


def test_the_error_law_and_its_inverse() -> None:
    """Against a draw: eq. (5) of an event too small to count, every voltage with an error."""
    rng = np.random.default_rng(41)
    v, sigma, di, size = 6928.2, 5e-4, 2.0, 200_000
    error = rng.standard_normal((4, size, 2)) @ np.array([1, 1j]) * sigma / math.sqrt(2)
    m, n, m_, n_ = v * (1.0 + error)
    z = ((m_ - m) * n - (n_ - n) * m) / (di * v)
    for z_set in (2.0, 5.0, 8.0):
        expected = false_trip_probability(
            np.array(z_set), np.array(di), np.array(sigma), np.array(v)
        )
        found = np.mean((np.abs(z) >= z_set) & (z.real < 0))
        # five standard deviations of the share, and 2 % for the law's own neglect
        bound = 5 * math.sqrt(expected / size) + 0.02 * expected
        assert abs(found - expected) < bound
        floor = least_operating_voltage(expected, np.array(sigma), np.array(v))
        assert floor == pytest.approx(z_set * di)
    sigmas = np.array([1e-4, 5e-4, 1e-3])
    floors = least_operating_voltage(np.array(1e-6), sigmas, np.array(v))
    assert floors == pytest.approx(7.245 * sigmas * v, rel=1e-4)
    assert floors == pytest.approx([5.0, 25.0, 50.0], rel=0.01)


def test_a_two_port_carries_voltage_and_current() -> None:
    """V and I of the upper end from those of the lower one, taps between them included."""
    feeder = load_feeder("paper")
    network = sequence_network(feeder, Place(line="R3-R4", at=0.95))
    flow = before(network)
    (a, b), (c, d) = two_port(network, "R2", "R3")
    upper, lower = network.nodes.index("R2"), network.nodes.index("R3")
    child = network.nodes.index("R2-R3@0.25")  # what leaves R2, and not what stands there
    assert a * d - b * c == pytest.approx(np.ones(3), rel=1e-12)
    v, i = flow.v[lower], flow.i[lower]
    assert (a * v + b * i)[1] == pytest.approx(flow.v[upper, 1], rel=1e-12)
    assert (c * v + d * i)[1] == pytest.approx(flow.i[child, 1], rel=1e-12)


def test_the_sequence_network_says_what_it_cannot_carry() -> None:
    feeder = load_feeder("paper")
    place = Place(line="R2-R3", at=0.6)
    with pytest.raises(ValueError, match="must stand on a line"):
        sequence_network(feeder, Place(bus="R2"))
    loads = (replace(feeder.loads[0], exponent=1.0), *feeder.loads[1:])
    with pytest.raises(ValueError, match="load 'L1': only constant impedance"):
        sequence_network(replace(feeder, loads=loads), place)
    tie = replace(feeder.switches[0], closed=True)
    with pytest.raises(ValueError, match="not radial"):
        sequence_network(replace(feeder, switches=(tie,)), place)
    t4 = next(unit for unit in feeder.transformers if unit.name == "T4")
    units = (replace(t4, leakage_pu=0j),)
    loads = tuple(load for load in feeder.loads if load.transformer == "T4")
    with pytest.raises(ValueError, match="transformer 'T4': a Yg/D unit needs leakage"):
        sequence_network(replace(feeder, transformers=units, loads=loads), place)
