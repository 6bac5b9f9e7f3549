"""Merged buses change nothing: every answer is that of the network with all its buses."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from oracles.chains import with_chains
from oracles.random_happenings import random_happening
from oracles.random_mixed import random_mixed_feeder

from openphase.model.errors import InputError
from openphase.model.events.base import apply_event
from openphase.model.leaps import why_solved, with_leaps
from openphase.model.machine_state import carried_over
from openphase.model.network import Network, compile_network
from openphase.model.parts import Feeder
from openphase.model.reading.feeder_file import load_feeder
from openphase.model.solve import solve, steady_state
from openphase.model.states import NOT_CONVERGED, Answer, Probes, State, Tree

FEEDERS = 80
MANY = 300  #: feeders where nothing is solved
TOLERANCE_PU = 1e-9
CHAIN_TOLERANCE = 1e-11

Complex = NDArray[np.complex128]


def networks(feeders: int = FEEDERS) -> Iterator[tuple[np.random.Generator, Feeder, Network]]:
    """Random mixed feeders with chains."""
    for seed in range(feeders):
        rng = np.random.default_rng([seed, 71])
        loops = int(rng.choice([0, 1, 2]))
        feeder = with_chains(rng, random_mixed_feeder(rng, int(rng.integers(3, 12)), loops))
        closed = frozenset(switch.name for switch in feeder.switches)
        try:
            yield rng, feeder, compile_network(feeder, closed)
        except InputError:
            continue


def cases() -> Iterator[tuple[Network, list[tuple[State, Answer]]]]:
    """Networks with chains, each state before and after an event with all that it does."""
    for rng, feeder, network in networks():
        steady = steady_state(network)
        states = []
        for _ in range(3):
            event = random_happening(rng, feeder, network).event
            before, after = apply_event(network, steady, steady, event)
            first = solve(network, before)
            states.append((before, first))
            after = carried_over(network, before, first, after, event.der_factor)
            states.append((after, solve(network, after, start=first.winding_v_pu)))
        yield network, states


def looked_at(rng: np.random.Generator, network: Network) -> Probes:
    """A few nodes, and a few edges at either end."""
    edges = rng.choice(len(network.pieces), 2)
    return Probes(
        v_node=rng.choice(len(network.nodes), 2),
        i_edge=edges.astype(np.int64),
        i_below=rng.random(2) < 0.5,
    )


def gaps(network: Network, probes: Probes, whole: Answer, merged: Answer) -> float:
    """Largest difference of what is looked at, in pu; currents against the largest there are."""
    v = np.abs(whole.v[probes.v_node] - merged.v) / network.node_v[probes.v_node][:, None, None]
    rows = 2 * probes.i_edge + probes.i_below
    i = np.abs(whole.i[rows] - merged.i) / max(1.0, float(np.abs(whole.i).max()))
    stub = np.abs(whole.stub - merged.stub) / network.node_v.max()
    return float(max(v.max(), i.max(), stub.max()))


def test_merged_buses_change_nothing():
    rng = np.random.default_rng(5)
    worst, passed, compared, nodes = 0.0, 0, 0, 0
    for network, states in cases():
        probes = looked_at(rng, network)
        merged = with_leaps(network, probes)
        passed += int((merged.tree.passed >= 0).sum())
        nodes += len(network.nodes)
        for state, whole in states:
            found = solve(merged, state, probes, start=whole.winding_v_pu)
            if (whole.flags | found.flags)[0] & NOT_CONVERGED:
                continue
            compared += 1
            assert found.flags == whole.flags
            worst = max(worst, gaps(network, probes, whole, found))
    assert worst < TOLERANCE_PU
    assert compared > 3 * FEEDERS
    assert passed > 0.25 * nodes


def nobody() -> Probes:
    """Probes that look nowhere."""
    nowhere = np.zeros(0, np.int64)
    return Probes(v_node=nowhere, i_edge=nowhere, i_below=nowhere.astype(np.bool_))


def chain_edges(tree: Tree, end: int) -> list[int]:
    """The edges of the chain that ends at a node, upwards."""
    edges, top = [end], tree.leap_from[tree.leap[end]]
    while tree.parent[edges[-1]] != top:
        edges.append(int(tree.parent[edges[-1]]))
    return edges


def eliminated(tree: Tree, leap: int, end: int, y_end_s: Complex) -> tuple[Complex, Complex]:
    """A leap's region eliminated node by node, ``y_end_s`` being all there is at its end.

    Returns the current drawn at the node above it, and the voltage at the end, per voltage there.
    """
    region = tree.region_node[tree.region_from[leap] : tree.region_from[leap + 1]].tolist()
    hanging = {k: y_end_s if k == end else tree.shunt_s[k].copy() for k in region}
    top = int(tree.leap_from[leap])
    hanging[top] = np.zeros((3, 3), np.complex128)
    path = {}
    for k in region:
        row = tree.transformer[k]
        turn = tree.turn[row] if row >= 0 else np.eye(3)
        path[k] = np.linalg.inv(np.eye(3) + tree.z_ohm[k] @ hanging[k]) @ turn
        hanging[int(tree.parent[k])] += turn.T @ hanging.pop(k) @ path[k]
    voltage = np.eye(3, dtype=np.complex128)
    for k in chain_edges(tree, end) if end >= 0 else []:
        voltage = voltage @ path[k]
    return hanging[top], voltage


def random_admittance(rng: np.random.Generator, phases: int) -> Complex:
    """Of anything from next to nothing to a bolted fault, in the phases of a mask."""
    y = rng.normal(size=(3, 3)) + 1j * rng.normal(size=(3, 3))
    y = (y + y.T) * 10.0 ** rng.uniform(-8, 3)
    missing = [i for i in range(3) if not phases & (1 << i)]
    y[missing] = y[:, missing] = 0.0
    return np.asarray(y)


def apart(one: Complex, other: Complex) -> float:
    """Largest difference over the largest entry."""
    return float(np.abs(one - other).max() / np.abs(other).max())


def test_a_chain_is_what_its_nodes_make_one_by_one():
    rng = np.random.default_rng(6)
    worst, chains, narrow, crossed, hung_on = 0.0, 0, 0, 0, 0
    for _, _, network in networks(MANY):
        tree = with_leaps(network, nobody()).tree
        for end in np.flatnonzero(tree.leap >= 0).tolist():
            leap = int(tree.leap[end])
            t, z, y_above = tree.leap_chain[leap]
            y = random_admittance(rng, int(tree.node_phases[end]))
            drawn, voltage = eliminated(tree, leap, end, y)
            f = np.linalg.inv(np.eye(3) + z @ y) @ t
            worst = max(worst, apart(f, voltage))
            if y.any() or drawn.any():
                worst = max(worst, apart(t.T @ y @ f + y_above, drawn))
            edges = chain_edges(tree, end)
            widest = int(np.bitwise_or.reduce(tree.phases[edges]))
            if tree.lone_phase[end] >= 0:
                alone = np.arange(3) == tree.lone_phase[end]
                assert not y_above[~np.outer(alone, alone)].any()
                assert not f[alone][:, ~alone].any()
            chains += 1
            narrow += widest != tree.phases[end]
            crossed += (tree.transformer[edges] >= 0).any()
            hung_on += int((tree.passed == leap).sum()) >= len(edges)
    assert worst < CHAIN_TOLERANCE
    assert chains > 200
    assert min(narrow, crossed, hung_on) > 20


def test_a_twig_is_what_its_nodes_make_one_by_one():
    worst, twigs = 0.0, 0
    for _, _, network in networks(MANY):
        tree = with_leaps(network, nobody()).tree
        for leap in range(tree.twigs):
            drawn, _ = eliminated(tree, leap, -1, np.zeros((3, 3), np.complex128))
            found = tree.leap_chain[leap, 2]
            worst = max(worst, apart(found, drawn) if drawn.any() else np.abs(found).max())
            twigs += 1
    assert worst < CHAIN_TOLERANCE
    assert twigs > 100


def test_every_edge_at_a_passed_node_belongs_to_its_leap():
    """So that an event on any of them, or on the node, gives that node back."""
    rng = np.random.default_rng(7)
    for _, _, network in networks(MANY):
        tree = with_leaps(network, looked_at(rng, network)).tree
        leap_of = np.maximum(tree.passed, tree.leap)
        below = np.flatnonzero(tree.passed[tree.parent[1:]] >= 0) + 1
        assert np.array_equal(leap_of[below], tree.passed[tree.parent[below]])
        for q in range(tree.leap_from.size):
            region = tree.region_node[tree.region_from[q] : tree.region_from[q + 1]]
            assert set(region.tolist()) == set(np.flatnonzero(leap_of == q).tolist())
            assert tree.passed[tree.leap_from[q]] < 0
            assert (np.diff(region) < 0).all()


def test_ieee_123_keeps_what_its_loads_and_forks_need():
    network = compile_network(load_feeder("ieee123"))
    leaping = with_leaps(network, nobody())
    why = why_solved(leaping, nobody())
    assert why == {"loads": 85, "points": 0, "forks": 26, "others": 8}
    assert sum(why.values()) == int((leaping.tree.passed < 0).sum())
    assert len(network.nodes) == 132


def test_buses_are_solved_where_somebody_looks():
    network = compile_network(load_feeder("ieee123"))
    node = int(np.flatnonzero(with_leaps(network, nobody()).tree.passed >= 0)[0])
    probes = nobody()._replace(v_node=np.array([node]))
    leaping = with_leaps(network, probes)
    assert leaping.tree.passed[node] < 0
    assert why_solved(leaping, probes)["points"] == 1
