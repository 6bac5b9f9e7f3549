"""Merged buses change nothing: every answer is that of the network with all its buses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from oracles.random_happenings import random_happening
from oracles.random_mixed import random_mixed_feeder

from openphase.model.errors import InputError
from openphase.model.events.base import apply_event
from openphase.model.leaps import with_leaps
from openphase.model.machine_state import carried_over
from openphase.model.network import Network, compile_network
from openphase.model.parts import Feeder, Line
from openphase.model.solve import solve, steady_state
from openphase.model.states import NOT_CONVERGED, Answer, Probes, State

FEEDERS = 80
TOLERANCE_PU = 1e-9


def with_chains(rng: np.random.Generator, feeder: Feeder) -> Feeder:
    """Lines cut into several by buses without anything, and some with a twig there."""
    lines: list[Line] = []
    tied = {place for point in feeder.points for place in (point.line,)}
    tied |= {part.place.line for part in (*feeder.capacitors, *feeder.transformers)}
    tied |= {part.place.line for part in (*feeder.loads, *feeder.ders) if part.place is not None}
    for line in feeder.lines:
        pieces = int(rng.integers(1, 5))
        if line.name in tied or pieces == 1:
            lines.append(line)
            continue
        buses = [line.from_bus, *(f"{line.name}.{n}" for n in range(1, pieces)), line.to_bus]
        shares = rng.dirichlet(np.ones(pieces))
        for n, share in enumerate(shares):
            ends = {"from_bus": buses[n], "to_bus": buses[n + 1]}
            if rng.random() < 0.3:
                ends = {"from_bus": buses[n + 1], "to_bus": buses[n]}
            km = line.length_km * float(share)
            lines.append(replace(line, name=f"{line.name}/{n}", length_km=km, **ends))
        if rng.random() < 0.4:
            far = f"{line.name}.twig"
            twig = replace(line, name=f"{line.name}/twig", from_bus=buses[1], to_bus=far)
            lines += [twig, replace(twig, name=f"{twig.name}/2", from_bus=far, to_bus=f"{far}.2")]
    return replace(feeder, lines=tuple(lines))


def cases() -> Iterator[tuple[Network, list[tuple[State, Answer]]]]:
    """Networks with chains, each state before and after an event with all that it does."""
    for seed in range(FEEDERS):
        rng = np.random.default_rng([seed, 71])
        loops = int(rng.choice([0, 1, 2]))
        feeder = with_chains(rng, random_mixed_feeder(rng, int(rng.integers(3, 12)), loops))
        closed = frozenset(switch.name for switch in feeder.switches)
        try:
            network = compile_network(feeder, closed)
        except InputError:
            continue
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
    assert passed > 0.15 * nodes
