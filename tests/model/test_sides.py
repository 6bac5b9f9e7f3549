"""How everything lies to a section where the normal state has loops, and how long it takes."""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import pairwise, permutations

import numpy as np
import pytest
from oracles.walks import side_of

from openphase.model.errors import InputError
from openphase.model.network import compile_network
from openphase.model.parts import Feeder, Line, Load, Place, Point, Section, Source, Switch
from openphase.model.points import Terminal, find_points
from openphase.model.sides import Side
from openphase.model.solve import solve, steady_state

SOURCE = Source(
    bus="0", kv_ll=12.0, emf_pu=1.0, z1_ohm=0.9j, z2_ohm=0.9j, z0_ohm=0.9j, frequency_hz=60.0
)


def feeder_of(ends: list[tuple[int, int]], switches: list[tuple[int, int]]) -> Feeder:
    """Lines and closed switches between numbered buses."""
    return Feeder(
        name="mesh",
        source=SOURCE,
        lines=tuple(
            Line(
                name=f"{a}-{b}",
                from_bus=str(a),
                to_bus=str(b),
                length_km=1.0,
                z1_ohm_per_km=0.1 + 0.3j,
                z0_ohm_per_km=0.3 + 0.9j,
            )
            for a, b in ends
        ),
        transformers=(),
        loads=(),
        switches=tuple(
            Switch(name=f"{a}={b}", from_bus=str(a), to_bus=str(b), closed=True)
            for a, b in switches
        ),
        points=(),
        sections=(),
    )


def random_mesh(rng: np.random.Generator) -> Feeder:
    """A tree of up to nine buses with up to three lines across, and a pair of points."""
    count = int(rng.integers(5, 10))
    tree = [(int(rng.integers(max(0, k - 3), k)), k) for k in range(1, count)]
    is_switch = rng.random(len(tree)) < 0.15
    lines = [own for own, switch in zip(tree, is_switch, strict=True) if not switch]
    switches = [own for own, switch in zip(tree, is_switch, strict=True) if switch]
    for _ in range(int(rng.integers(0, 4))):
        a, b = sorted(int(k) for k in rng.choice(count, 2, replace=False))
        if (a, b) not in [*lines, *switches]:
            lines.append((a, b))
    own = feeder_of(lines, switches)
    first, last = (own.lines[int(k)] for k in rng.integers(len(own.lines), size=2))
    points = (
        Point(name="P", bus=(first.from_bus, first.to_bus)[rng.integers(2)], line=first.name),
        Point(name="Q", bus=(last.from_bus, last.to_bus)[rng.integers(2)], line=last.name),
    )
    return replace(own, points=points, sections=(Section(local="P", remote="Q"),))


def shortest_paths(own: Feeder, start: str, end: str) -> list[set[str]]:
    """All ways of fewest parts, by trying them all; the names of their lines."""
    joints = {p.name: {p.from_bus, p.to_bus} for p in (*own.lines, *own.switches)}
    for count in range(1, len(joints) + 1):
        found = []
        for names in permutations(joints, count):
            at = start
            for name in names:
                if at not in joints[name]:
                    break
                (at,) = joints[name] - {at}
            else:
                if at == end:
                    found.append({name for name in names if "-" in name})
        if found:
            return found
    return []


def path_of(own: Feeder, terminal: Terminal) -> set[str]:
    network = compile_network(own)
    edges = np.flatnonzero(terminal.on_path)
    return {str(p.line) for k in edges if (p := network.pieces[k])}


def test_sides_in_meshed_normal_states_are_what_a_walk_finds() -> None:
    rng = np.random.default_rng(6)
    tried, loops = 0, 0
    seen: set[Side] = set()
    while tried < 60:
        own = random_mesh(rng)
        if own.points[0].bus == own.points[1].bus:
            continue
        try:
            network = compile_network(own)
            terminal = find_points(own, network).terminals[0]
        except InputError:
            continue  # fed past its points, or a loop without impedance
        path = path_of(own, terminal)
        if not path:
            continue
        tried += 1
        loops += network.chords
        assert path in shortest_paths(own, own.points[0].bus, own.points[1].bus)
        for k, piece in enumerate(network.pieces):
            if piece is None or piece.line is None:
                continue
            things = [("line", name) for name in path]
            wanted = side_of(own, own.sections[0], ("line", piece.line), things)
            assert terminal.edge_side[k] == wanted, (own, piece.line)
            seen.add(wanted)
    assert loops > 20
    assert seen == {Side.PATH, Side.LATERAL, Side.UPSTREAM, Side.DOWNSTREAM, Side.OTHER}


def test_beside_a_second_way_nothing_is_downstream() -> None:
    """Two lines side by side from 1 to 2, one of them the section."""
    own = feeder_of([(0, 1), (1, 2), (2, 3), (0, 4)], [])
    points = (Point(name="P", bus="1", line="1-2"), Point(name="Q", bus="2", line="1-2"))
    own = replace(own, points=points, sections=(Section(local="P", remote="Q"),))
    beside = replace(own, lines=(replace(own.lines[1], name="beside"), *own.lines))
    wanted = {
        True: {"0-1": Side.UPSTREAM, "1-2": Side.PATH, "2-3": Side.DOWNSTREAM, "0-4": Side.OTHER},
        False: {"0-1": Side.UPSTREAM, "1-2": Side.PATH, "2-3": Side.UPSTREAM, "0-4": Side.OTHER},
    }
    for feeder in (own, beside):
        network = compile_network(feeder)
        terminal = find_points(feeder, network).terminals[0]
        sides = {
            piece.line: Side(side)
            for piece, side in zip(network.pieces, terminal.edge_side, strict=True)
            if piece is not None and piece.line != "beside"
        }
        assert sides == wanted[feeder is own]


@pytest.mark.parametrize("loops", [0, 3])
def test_ten_terminals_on_three_thousand_buses_take_seconds(loops: int) -> None:
    rng = np.random.default_rng(2)
    trunk = [(k - 1, k) for k in range(1, 400)]
    laterals = [(int(rng.integers(max(0, k - 600), k)), k) for k in range(400, 3000)]
    across = [(60 * n + 53, 60 * n + 75) for n in range(loops)]
    own = feeder_of([*trunk, *laterals, *across], [])
    points = tuple(Point(name=f"P{n}", bus=str(n), line=f"{n}-{n + 1}") for n in range(50, 351, 60))
    sections = tuple(Section(local=a.name, remote=b.name) for a, b in pairwise(points))
    loads = tuple(
        Load(
            name=f"load {k}",
            transformer=None,
            place=Place(bus=str(k)),
            connection="wye",
            kw=5.0,
            power_factor=0.95,
            exponent=2.0,
        )
        for k in range(400, 3000, 2)
    )
    own = replace(own, points=points, sections=sections, loads=loads)
    network = compile_network(own)
    begun = time.perf_counter()
    found = find_points(own, network)
    assert len(found.terminals) == 10
    assert time.perf_counter() - begun < 2.0


@pytest.mark.parametrize("ends", [(1, 2), (2, 1)])
def test_a_line_back_to_a_bus_that_a_switch_joins_closes_the_loop(ends: tuple[int, int]) -> None:
    """Two lines from 0 to 1, one of them over a switch, carry a load as one of half the length."""
    load = Load(
        name="load",
        transformer=None,
        place=Place(bus="1"),
        connection="wye",
        kw=3000.0,
        power_factor=0.9,
        exponent=2.0,
    )
    double = replace(feeder_of([(0, 1), ends], [(0, 2)]), loads=(load,))
    plain = replace(feeder_of([(0, 1)], []), loads=(load,))
    half = replace(plain, lines=(replace(plain.lines[0], length_km=0.5),))
    v = []
    for own in (double, half):
        network = compile_network(own)
        v.append(solve(network, steady_state(network)).v[network.node("1"), :, 0])
    np.testing.assert_allclose(v[0], v[1], rtol=1e-12)
