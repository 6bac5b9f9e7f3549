"""Merged buses change nothing: every answer is that of the network with all its buses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from oracles.random_happenings import random_happening
from oracles.random_mixed import random_mixed_feeder

from openphase.model.errors import InputError
from openphase.model.events.base import apply_event
from openphase.model.leaps import why_solved, with_leaps
from openphase.model.machine_state import carried_over
from openphase.model.network import Network, compile_network
from openphase.model.parts import Capacitor, Feeder, Line, LineCode, Place
from openphase.model.phases import letters
from openphase.model.reading.feeder_file import load_feeder
from openphase.model.solve import solve, steady_state
from openphase.model.states import NOT_CONVERGED, Answer, Probes, State, Tree

FEEDERS = 80
MANY = 300  #: feeders where nothing is solved
TOLERANCE_PU = 1e-9
CHAIN_TOLERANCE = 1e-11

Complex = NDArray[np.complex128]


def with_chains(rng: np.random.Generator, feeder: Feeder) -> Feeder:
    """Lines cut into several by buses on which nothing varies.

    Their pieces are built differently; some have more phases near the source, and some buses
    have twigs or capacitors.
    """
    above = upper_ends(feeder)
    lines: list[Line] = []
    codes = list(feeder.codes)
    capacitors = list(feeder.capacitors)
    tied = {place for point in feeder.points for place in (point.line,)}
    tied |= {part.place.line for part in (*feeder.capacitors, *feeder.transformers)}
    tied |= {part.place.line for part in (*feeder.loads, *feeder.ders) if part.place is not None}
    for line in feeder.lines:
        pieces = int(rng.integers(1, 6))
        if line.name in tied or pieces == 1:
            lines.append(line)
            continue
        upper, wide = above.get(line.name, (line.from_bus, line.phases))
        lower = line.to_bus if upper == line.from_bus else line.from_bus
        buses = [upper, *(f"{line.name}.{n}" for n in range(1, pieces)), lower]
        like = rng.random() < 0.3
        widened = int(rng.integers(0, pieces)) if rng.random() < 0.5 else 0
        for n, share in enumerate(rng.dirichlet(np.ones(pieces))):
            own = line if like else unlike(rng, line, f"{line.name}/{n}", codes)
            if n < widened:
                own = of_phases(own, wide, codes)
            ends = turned(rng, buses[n], buses[n + 1])
            km = line.length_km * float(share)
            lines.append(replace(own, name=f"{line.name}/{n}", length_km=km, **ends))
            if n + 1 < pieces and rng.random() < 0.3:
                lines += twig(rng, lines[-1], buses[n + 1])
            if n + 1 < pieces and len(own.phases) > 1 and rng.random() < 0.3:
                capacitors.append(
                    Capacitor(
                        name=f"{line.name}.C{n}",
                        place=Place(bus=buses[n + 1]),
                        connection="delta",
                        kvar=1.0,
                        phases=own.phases,
                    )
                )
    return replace(feeder, lines=tuple(lines), codes=tuple(codes), capacitors=tuple(capacitors))


def upper_ends(feeder: Feeder) -> dict[str, tuple[str, str]]:
    """The bus above every line that is in no loop, and the phases there."""
    closed = frozenset(switch.name for switch in feeder.switches)
    try:
        network = compile_network(feeder, closed)
    except InputError:
        return {}
    tree, found = network.tree, {}
    for line in feeder.lines:
        k = network.edges_of(line.name)[0]
        if k < tree.parent.size and not tree.in_loop[k] and len(network.edges_of(line.name)) == 1:
            upper = int(tree.parent[k])
            found[line.name] = (network.nodes[upper], letters(int(tree.node_phases[upper])))
    return found


def turned(rng: np.random.Generator, one: str, other: str) -> dict[str, str]:
    """Ends of a line, which may stand backwards."""
    ends = (one, other) if rng.random() < 0.7 else (other, one)
    return {"from_bus": ends[0], "to_bus": ends[1]}


def unlike(rng: np.random.Generator, line: Line, name: str, codes: list[LineCode]) -> Line:
    """The line built differently, by a code of its own where it has one."""
    size, factor = len(line.phases), float(rng.uniform(0.5, 2.0))
    if line.code is None:
        z1 = line.z1_ohm_per_km
        assert z1 is not None
        return replace(line, z1_ohm_per_km=z1 * factor)
    old = next(code for code in codes if code.name == line.code)
    about = rng.uniform(0.9, 1.1, (3, size, size))
    r, x, c = (
        rows(np.array(matrix) * (part + part.T) / 2.0)
        for matrix, part in zip(
            (old.r_ohm_per_km, old.x_ohm_per_km, old.c_nf_per_km or np.zeros((size, size))),
            about,
            strict=True,
        )
    )
    charging = None if old.c_nf_per_km is None else c
    codes.append(LineCode(name=name, r_ohm_per_km=r, x_ohm_per_km=x, c_nf_per_km=charging))
    return replace(line, code=name)


def rows(matrix: NDArray[np.float64]) -> tuple[tuple[float, ...], ...]:
    """As a code has them."""
    return tuple(tuple(float(value) for value in row) for row in matrix)


def of_phases(line: Line, phases: str, codes: list[LineCode]) -> Line:
    """A transposed line about like this one, in other phases."""
    if line.code is None:
        return replace(line, phases=phases)
    code = next(code for code in codes if code.name == line.code)
    z1 = 0.7 * complex(code.r_ohm_per_km[0][0], code.x_ohm_per_km[0][0])
    nf = 0.0 if code.c_nf_per_km is None else code.c_nf_per_km[0][0]
    own = {"z1_ohm_per_km": z1, "z0_ohm_per_km": 2.5 * z1, "c1_nf_per_km": nf, "c0_nf_per_km": nf}
    return replace(line, phases=phases, code=None, **own)


def twig(rng: np.random.Generator, like: Line, bus: str) -> list[Line]:
    """A dead end with a fork in it, of all the line's phases or of one."""
    name, far = f"{like.name}/twig", f"{like.name}.twig"
    first = replace(like, name=name, from_bus=bus, to_bus=far)
    if rng.random() < 0.4 and like.code is None:
        first = replace(first, phases=like.phases[0])
    return [
        first,
        replace(first, name=f"{name}/2", from_bus=far, to_bus=f"{far}.2"),
        replace(first, name=f"{name}/3", from_bus=f"{far}.3", to_bus=far),
    ]


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
