"""What is exactly true of the connection impedance, on random feeders and the paper's.

No noise anywhere: a tolerance is what rounding allows (``Pair.rounding_ohm``), unless the
statement itself is a limit. Each statement is derived in ``model/closed_form.py`` or here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from oracles.random_feeders import random_feeder
from oracles.scenes import (
    Pair,
    Scene,
    change,
    connected,
    constants,
    looks,
    opened,
    ring,
    scene,
    stepped,
)

from openphase.detector.impedance import connection_impedance
from openphase.model import Feeder, Place, load_feeder
from openphase.model.closed_form import (
    break_current,
    z_op1,
    z_opposite_steps,
)
from openphase.model.events.base import places_on
from openphase.model.network import compile_network, locate
from openphase.model.parts import Connection
from openphase.model.points import Terminal
from openphase.model.sequence_network import loops, sequence_network
from openphase.model.solver.breaks import FLOATING
from openphase.model.states import NOT_CONVERGED, State
from openphase.model.symmetrical import to_sequences

SEEDS = range(40)
MASKS = (0b001, 0b010, 0b100, 0b011, 0b101, 0b110, 0b111)
MILLI = (1e-3, 1e-4)


def linear(feeder: Feeder) -> Feeder:
    return replace(feeder, loads=tuple(replace(load, exponent=2.0) for load in feeder.loads))


def bus_of(feeder: Feeder, point: str) -> str:
    return next(p.bus for p in feeder.points if p.name == point)


def source_side(at: Scene) -> Iterator[tuple[Terminal, str]]:
    """Every section's terminal towards the source, with its bus."""
    for t in at.points.terminals:
        if not t.load_side:
            yield t, bus_of(at.feeder, t.local)


def below(at: Scene, bus: str) -> np.ndarray:
    """(edges,) everything that ``bus`` feeds, in a radial network."""
    found = np.zeros(len(at.network.pieces), bool)
    for k in range(1, len(at.network.nodes)):
        above = at.network.tree.parent[k]
        found[k] = above == at.network.node(bus) or found[above]
    return found


def many(at: Scene, rng: np.random.Generator, chosen: np.ndarray, size: int) -> State:
    """The steady state with the EMF moved and, at random places, phases open or load on."""
    state = at.states(size)
    edge, share = places_on(at.network, chosen).draw(rng, size)
    kind = rng.integers(3, size=size)  # 0: phases open, 1: load, 2: the source alone
    total = sum(load.kw for load in at.feeder.loads) * 1000 / at.network.tree.v_nominal_v**2
    step = rng.uniform(0.0, 0.1, (3, size)) * total * (rng.random((3, size)) < 0.7)
    return state._replace(
        emf_pu=state.emf_pu * np.where(kind == 2, rng.uniform(0.95, 1.05, size), 1.0),
        edge=np.where(kind == 2, -1, edge),
        share=share,
        open_mask=np.where(kind == 0, rng.choice(MASKS, size), 0),
        step_y_s=np.where(kind == 1, step, 0.0).astype(complex),
        step_exponent=rng.choice([0.0, 1.0, 2.0], size),
    )


def between(at: Scene, terminal: Terminal) -> np.ndarray:
    """(edges,) the path between m and n, and everything that is fed from it in between.

    More than ``in_section``: a lateral belongs to the two-port beyond its own measuring
    point too. An event there is nobody's external event.
    """
    found = terminal.on_path.copy()
    m, n = (at.network.node(bus_of(at.feeder, x)) for x in (terminal.local, terminal.remote))
    # seen from a point on the next line, the other branches of its bus lie in the section
    beyond = at.points.edge[terminal.local_point] if terminal.into < 0 else -1
    for k in range(1, len(at.network.nodes)):
        above = at.network.tree.parent[k]
        of_m = above == m and (beyond < 0 or k == beyond)
        found[k] |= found[above] and above != n and not of_m
    return found


def inside_linear(at: Scene, terminal: Terminal, state: State) -> State:
    """``state`` with every load in the section constant impedance; all else is free."""
    inside = between(at, terminal)[at.network.load_node]
    return state._replace(exponent=np.where(inside[:, None], 2.0, state.exponent))


def before_of(state: State) -> State:
    """The same loads, with nothing standing anywhere."""
    return state._replace(
        emf_pu=np.full_like(state.emf_pu, state.emf_pu[0]),
        edge=np.full_like(state.edge, -1),
        open_mask=np.zeros_like(state.open_mask),
        step_y_s=np.zeros_like(state.step_y_s),
    )


# --- an unchanged section shows its own two-port, whatever happens elsewhere -----------


def external_values(closed: bool) -> Iterator[tuple[str, Pair, complex, np.ndarray]]:
    """Terminal's name, phasors, B and usable scenarios, of external events."""
    for seed in SEEDS:
        rng = np.random.default_rng([seed, 43])
        feeder = ring(rng) if closed else random_feeder(rng, int(rng.integers(4, 9)), depth=0.8)
        at = scene(feeder, frozenset({"R4"}) if closed else None)
        for t in at.points.terminals:
            outside = ~between(at, t)
            if not (outside & (at.network.length_km > 0)).any():
                continue
            state = inside_linear(at, t, many(at, rng, outside, 24))
            before = before_of(state)
            before = before._replace(emf_pu=np.full(24, at.network.emf_pu))
            first, then = looks(at, before), looks(at, state)
            pair = change(at, t, first, then)
            m, n = bus_of(feeder, t.local), bus_of(feeder, t.remote)
            ends = (n, m) if at.network.node(m) > at.network.node(n) else (m, n)
            ends = ends if not closed else order_of(feeder, *ends)
            b = constants(feeder, *ends)[0, 1]
            usable = (pair.rounding_ohm() < 1e-4 * abs(b)) & (then.flags & NOT_CONVERGED == 0)
            yield t.name, pair, b, usable


def order_of(feeder: Feeder, one: str, other: str) -> tuple[str, str]:
    """The two buses, the one nearer the source first, with every tie open."""
    nodes = compile_network(feeder).nodes
    return (one, other) if nodes.index(one) < nodes.index(other) else (other, one)


@pytest.mark.parametrize("closed", [False, True], ids=["radial", "loop"])
def test_an_external_event_shows_the_sections_b_parameter(closed: bool) -> None:
    used = 0
    for name, pair, b, usable in external_values(closed):
        used += usable.sum()
        error = np.abs(pair.z() - b)
        assert (error <= pair.rounding_ohm())[usable].all(), name
    assert used > 600


def test_the_b_parameter_is_near_the_lines_impedance_but_is_not_it() -> None:
    feeder = load_feeder("paper")
    b = constants(feeder, "SUB", "R2")[0, 1]
    assert abs(b) == pytest.approx(0.3901, abs=5e-5)
    assert 1e-5 < abs(abs(b) - 0.39) / 0.39 < 1e-3


def test_linear_feeders_only_scale_with_the_source_so_that_eq_5_is_0_over_0() -> None:
    for seed in SEEDS:
        rng = np.random.default_rng([seed, 47])
        at = scene(linear(random_feeder(rng, 5)))
        first = looks(at, at.steady)
        then = looks(at, at.steady._replace(emf_pu=at.steady.emf_pu * 0.97))
        for t in at.points.terminals:
            dv, di = change(at, t, first, then).compensated()
            assert np.abs(dv) < 1e-12 * at.network.tree.v_nominal_v
            assert np.abs(di) < 1e-12 * np.abs(first.i).max()


def test_balanced_states_do_not_know_how_a_unit_is_connected() -> None:
    """Any connection shows the same leakage and load to a balanced voltage, at any exponent."""
    for seed in SEEDS:
        at = scene(random_feeder(np.random.default_rng([seed, 107]), 5))
        transformer = np.arange(len(at.network.units)) < len(at.feeder.transformers)
        state = at.states(4)
        connection = state.connection.copy()
        connection[transformer, 1:] = range(3)
        answer = looks(at, state._replace(connection=connection))
        scale = at.network.tree.v_nominal_v
        assert np.abs(answer.v - answer.v[..., :1]).max() < 1e-10 * scale
        assert np.abs(answer.i - answer.i[..., :1]).max() < 1e-9 * np.abs(answer.i).max()


# --- an open phase in a radial section -------------------------------------------------


def test_z_op1_is_minus_a_v_n_over_i_q() -> None:
    """With 1, 2 or 3 open phases, any grounding, and any upset of what lies above m."""
    used = 0
    kinds: set[bool] = set()
    for seed in SEEDS:
        rng = np.random.default_rng([seed, 53])
        at = scene(random_feeder(rng, int(rng.integers(2, 8)), depth=0.8))
        size = len(MASKS)
        for t, m in source_side(at):
            line, fraction = a_place(at, t, rng)
            state = at.states(size)
            own = below(at, m)[at.network.load_node]
            state = state._replace(exponent=np.where(own[:, None], 2.0, state.exponent))
            first = looks(at, state)
            emf = state.emf_pu * rng.uniform(0.97, 1.03, size)
            then = looks(at, opened(at, state._replace(emf_pu=emf), line, fraction, *MASKS))
            pair = change(at, t, first, then)
            broken = Place(line=line, at=fraction)
            a = constants(at.feeder, m, f"{line}.p", broken)[0, 0]
            edge, _ = locate(at.network, line, fraction)
            i_q1 = to_sequences(first.i[2 * edge])[1]
            usable = pair.rounding_ohm() < 1.0
            used += usable.sum()
            kinds |= {bool(flag & FLOATING) for flag in then.flags[usable]}
            exact = z_op1(a, pair.v_n[0, 1][usable], i_q1[usable])
            assert (np.abs(pair.z()[usable] - exact) <= pair.rounding_ohm()[usable]).all()
    assert used > 250
    assert kinds == {False, True}


@pytest.mark.parametrize("wires", [3, 4])
def test_phase_quantities_have_no_source_impedance_either(wires: int) -> None:
    """Eqs. (11) and (12) made exact, the break above all that is tapped in the section."""
    for seed in SEEDS:
        feeder = ring(np.random.default_rng([seed, 103]))
        kind: Connection = "D/Yg" if wires == 3 else "Yg/Yg"
        feeder = connected(feeder, kind, "T1", "T2", "T4", "T5", "T6")
        if wires == 4:  # uncoupled phases: Z0 = Z1 everywhere below the source
            lines = tuple(replace(li, z0_ohm_per_km=li.z1_ohm_per_km) for li in feeder.lines)
            feeder = replace(feeder, lines=lines)
        at = scene(feeder)
        first, then = looks(at, at.steady), looks(at, opened(at, at.steady, "R2-R3", 0.04, 0b001))
        pair = change(at, at.terminal("R2", "R3"), first, then, phases=True)
        v_m, v_n, i = pair.v_m[0, 0], pair.v_n[0, 0], pair.i_m[0, 0]
        exact = -(v_n + (v_m / 2 if wires == 3 else 0.0)) / i
        assert np.abs(pair.z(0) - exact) <= pair.rounding_ohm(0)


def a_place(at: Scene, terminal: Terminal, rng: np.random.Generator) -> tuple[str, float]:
    """A place on the section's path."""
    edge, share = places_on(at.network, terminal.on_path).draw(rng, 1)
    return at.network.line_fraction(int(edge[0]), float(share[0]))


def test_the_break_takes_what_the_series_connection_says() -> None:
    """ΔI1 = -I Z20 / (Z1 + Z20), |ΔI2| = |ΔI1| |Z1 / Z2|: the ladder at the break."""
    used = 0
    for seed in SEEDS:
        rng = np.random.default_rng([seed, 59])
        feeder = linear(random_feeder(rng, int(rng.integers(2, 8)), depth=0.8))
        at = scene(feeder)
        line, fraction = a_place(at, at.points.terminals[0], rng)
        z0, z1, z2 = np.add(*loops(sequence_network(feeder, Place(line=line, at=fraction))))
        if not np.isfinite(z1):
            continue
        edge, _ = locate(at.network, line, fraction)
        first = looks(at, at.steady)
        then = looks(at, opened(at, at.steady, line, fraction, *MASKS))
        before = to_sequences(first.i[2 * edge])
        di = to_sequences(then.i[2 * edge]) - before
        assert di == pytest.approx(to_sequences(then.i[2 * edge + 1]) - before, abs=1e-9)
        z20 = 1.0 / (1.0 / z2 + 1.0 / z0)
        for s in range(3):  # one phase open
            assert di[1, s] == pytest.approx(-before[1, 0] * z20 / (z1 + z20), rel=1e-8)
            assert abs(di[2, s]) == pytest.approx(abs(di[1, s]) * abs(z1 / z2), rel=1e-8)
            assert abs(di[0, s]) == pytest.approx(abs(di[1, s]) * abs(z1 / z0), rel=1e-8, abs=1e-9)
        for s in range(3, 6):
            assert di[1, s] == pytest.approx(break_current(2, before[1, 0], z1, z2, z0)[1])
        assert di[1, 6] == pytest.approx(-before[1, 0])
        used += 1
    assert used > 30


def test_balanced_events_have_no_negative_sequence() -> None:
    """Load steps on three phases, source steps, and all three phases open together."""
    for seed in SEEDS:
        rng = np.random.default_rng([seed, 61])
        at = scene(random_feeder(rng, 6, depth=0.8))
        line, fraction = a_place(at, at.points.terminals[0], rng)
        states = [
            stepped(at, at.steady, line, fraction, (40e3, 40e3, 40e3)),
            at.steady._replace(emf_pu=at.steady.emf_pu * 0.96),
            opened(at, at.steady, line, fraction, 0b111),
        ]
        for state in states:
            i = to_sequences(looks(at, state).i, axis=1)
            assert np.abs(i[:, [0, 2]]).max() < 1e-9
        one = stepped(at, at.steady, line, fraction, (40e3, 0.0, 0.0))
        assert np.abs(to_sequences(looks(at, one).i, axis=1)[:, 2]).max() > 1e-3


def test_the_load_side_has_no_value_where_nothing_feeds_from_downstream() -> None:
    """α = β in eqs. (20)-(21): ΔI_n / I_n = ΔV_n / V_n."""
    for seed in SEEDS:
        rng = np.random.default_rng([seed, 67])
        at = scene(linear(random_feeder(rng, 6, depth=0.8)))
        first = looks(at, at.steady)
        for t in at.points.terminals:
            if not t.load_side:
                continue
            line, fraction = a_place(at, t, rng)
            then = looks(at, opened(at, at.steady, line, fraction, *MASKS[:-1]))
            pair = change(at, t, first, then)
            i, v = pair.i_m[:, 1], pair.v_m[:, 1]
            assert np.abs(i[1] * v[0] - v[1] * i[0]).max() <= 1e-12 * np.abs(i * v).max() + 1e-9
            assert (np.abs(v[1] - v[0]) > 1e-6 * np.abs(v[0])).any() or np.abs(i).max() < 1e-6


# --- eq. (5) itself --------------------------------------------------------------------


def every_pair() -> Iterator[Pair]:
    """All terminals under internal and external events on feeders with any load."""
    for seed in SEEDS:
        rng = np.random.default_rng([seed, 71])
        at = scene(random_feeder(rng, 6, depth=0.8))
        first = looks(at, at.states(16))
        then = looks(at, many(at, rng, at.network.length_km > 0, 16))
        for t in at.points.terminals:
            yield change(at, t, first, then)


def test_eq_5_is_minus_the_compensated_voltage_over_the_compensated_current() -> None:
    used = 0
    for pair in every_pair():
        usable = pair.rounding_ohm() < 1e-3
        used += usable.sum()
        dv, di = pair.compensated()
        gap = np.abs(pair.z() + dv / np.where(usable, di, 1.0))
        assert (gap <= pair.rounding_ohm())[usable].all()
    assert used > 200


def test_eq_5_cannot_tell_closing_from_opening() -> None:
    for pair in every_pair():
        usable = pair.rounding_ohm() < 1e-3
        back = Pair(pair.v_m[::-1], pair.v_n[::-1], pair.i_m[::-1])
        assert (np.abs(pair.z() - back.z()) <= pair.rounding_ohm())[usable].all()


def test_eq_5_does_not_see_a_common_rotation_or_scaling() -> None:
    """A frequency offset turns all later phasors alike; (22) and (23) do see that."""
    turn = 0.98 * np.exp(2j * np.pi * 0.01)  # 0.01 Hz over one second, and a lower source
    for pair in every_pair():
        usable = pair.rounding_ohm() < 1e-3
        factor = np.array([1.0, turn])[:, None, None]
        turned = Pair(pair.v_m * factor, pair.v_n * factor, pair.i_m * factor)
        assert (np.abs(pair.z() - turned.z()) <= 2 * pair.rounding_ohm())[usable].all()
    assert abs(np.exp(2j * np.pi * 0.01) - 1.0) == pytest.approx(0.063, abs=5e-4)


def test_a_single_phasor_out_of_step_is_seen() -> None:
    """The rotation must be common: this is what keeps the test above honest."""
    pair = next(pair for pair in every_pair() if (pair.rounding_ohm() < 1e-6).any())
    usable = pair.rounding_ohm() < 1e-6
    off = np.array([1.0, np.exp(0.001j)])[:, None, None]
    v, n, i = pair.v_m[:, 1], (pair.v_n * off)[:, 1], pair.i_m[:, 1]
    z, _ = connection_impedance(v[1], n[1], i[1], v[1] - v[0], n[1] - n[0], i[1] - i[0])
    assert (np.abs(z - pair.z()) > 10 * pair.rounding_ohm())[usable].all()


def test_opposite_steps_inside_and_beyond() -> None:
    """Z_line (f + r) / (1 + r) with r from the currents themselves; any size and phase."""
    paper = load_feeder("paper")
    units = tuple(unit for unit in paper.transformers if unit.place.line != "R2-R3")
    names = {unit.name for unit in units}
    loads = tuple(load for load in paper.loads if load.transformer in names)
    at = scene(replace(paper, transformers=units, loads=loads))
    t = at.terminal("R2", "R3")
    first = looks(at, at.steady)
    values = []
    for fraction in (0.2, 0.5, 0.9):
        for level in (0.05, 0.5, 0.9, 1.5):
            state = stepped(at, at.steady, "R2-R3", fraction, (1e5, 1e5, 1e5))
            scale = np.array(
                [[level if load.transformer in ("T5", "T6") else 1.0] for load in loads]
            )
            then = looks(at, state._replace(load_scale=scale))
            pair = change(at, t, first, then)
            factor = pair.v_m[1, 1] / pair.v_m[0, 1]
            edge, _ = locate(at.network, "R2-R3", fraction)
            upper, lower = (to_sequences(then.i[2 * edge + end])[1] for end in (0, 1))
            outer = lower - factor * to_sequences(first.i[2 * edge])[1]
            exact = z_opposite_steps(t.line_z1_ohm, fraction, outer / (upper - lower))
            assert np.abs(pair.z() - exact) <= pair.rounding_ohm()
            values.append(abs(exact[0]) / abs(t.line_z1_ohm))
    assert min(values) < 0.5
    assert max(values) > 2.0
