"""Zones and neighbours, against a walk from every point towards the source."""

from dataclasses import replace

import numpy as np
import pytest
from oracles.trees import SOURCE, line, random_tree

from openphase.model import load_feeder
from openphase.model.load_regions import load_regions
from openphase.model.parts import Feeder, Place, Point, Regulator, Switch
from openphase.model.zones import adjacent_sections, nodes_of, zones_of


def walk_up(feeder, above, node):
    """Nodes from ``node`` to the source, each with the point passed on the way to it."""
    lines = {own.name: own for own in feeder.lines}
    at = {(point.bus, point.line): point.name for point in feeder.points}
    yield node, None
    while node != ("bus", feeder.source.bus):
        if node[0] == "bus":
            far = ("line", above[node[1]])
            passed = at.get((node[1], far[1]))
        else:
            own = lines[node[1]]
            upper = own.from_bus if above.get(own.to_bus) == own.name else own.to_bus
            far = ("bus", upper)
            passed = at.get((upper, own.name))
        node = far
        yield node, passed


def below(feeder, above, point):
    """The node on the side of a point that is away from the source."""
    return ("bus", point.bus) if above.get(point.bus) == point.line else ("line", point.line)


@pytest.mark.parametrize("seed", range(40))
def test_neighbours_are_those_that_a_walk_to_the_source_meets_next(seed):
    rng = np.random.default_rng(seed)
    feeder, above = random_tree(rng, int(rng.integers(1, 25)), int(rng.integers(1, 9)))
    wanted = set()
    for point in feeder.points:
        steps = list(walk_up(feeder, above, below(feeder, above, point)))
        passed = [(n, name) for n, (_, name) in enumerate(steps) if name]
        (first, name), later = passed[0], passed[1:]
        assert name == point.name
        if later:
            between = [node for node, _ in steps[first : later[0][0]]]
            if any(kind == "line" for kind, _ in between):
                wanted.add((later[0][1], point.name))
    sections, left_out = adjacent_sections(feeder, feeder.points)
    assert {(own.local, own.remote) for own in sections} == wanted
    assert not left_out


@pytest.mark.parametrize("seed", range(40))
def test_a_load_is_seen_by_the_next_measured_point_towards_the_source(seed):
    rng = np.random.default_rng(1000 + seed)
    feeder, above = random_tree(rng, int(rng.integers(1, 25)), int(rng.integers(1, 9)))
    chosen = [point.name for point in feeder.points if rng.random() < 0.7]
    measured = [*chosen, feeder.source.bus] if rng.random() < 0.5 else chosen
    whole = feeder.source.bus if feeder.source.bus in measured else None
    regions = load_regions(feeder, measured)
    assert regions.in_loop == ()
    seen = {k: name for name, own in zip(regions.names, regions.loads, strict=True) for k in own}
    for k, node in enumerate(nodes_of(feeder, feeder.loads)):
        passed = [name for _, name in walk_up(feeder, above, node) if name in chosen]
        assert seen.get(k) == (passed[0] if passed else whole)
    inwards = regions.outwards_in()
    assert sorted(inwards) == list(range(len(regions.names)))
    for n, further in enumerate(regions.beyond):
        assert all(inwards.index(far) < inwards.index(n) for far in further)


def test_the_papers_sections_follow_from_its_points():
    paper = load_feeder("paper")
    sections, _ = adjacent_sections(paper, paper.points)
    assert {frozenset((s.local, s.remote)) for s in sections} == {
        frozenset((s.local, s.remote)) for s in paper.sections
    }


def ring(*points):
    lines = [line("L1", "B0", "B1"), line("L2", "B1", "B2"), line("L3", "B2", "B0")]
    return Feeder(
        name="ring",
        source=SOURCE,
        lines=tuple(lines),
        transformers=(),
        loads=(),
        switches=(),
        points=tuple(Point(name=f"P{n}", bus=b, line=own) for n, (b, own) in enumerate(points)),
        sections=(),
    )


def test_two_points_around_a_part_of_a_ring_are_a_pair_and_more_are_left_out():
    two = ring(("B0", "L1"), ("B0", "L3"))
    assert [(s.local, s.remote) for s in adjacent_sections(two, two.points)[0]] == [("P0", "P1")]
    assert load_regions(two, ["P0", "P1"]).in_loop == ("P0", "P1")
    split = ring(("B0", "L1"), ("B1", "L2"), ("B0", "L3"))
    found = {frozenset((s.local, s.remote)) for s in adjacent_sections(split, split.points)[0]}
    assert found == {frozenset(("P0", "P1")), frozenset(("P1", "P2"))}
    spur = replace(two, lines=(*two.lines, line("L4", "B1", "B4")))
    spur = replace(spur, points=(*two.points, Point(name="P2", bus="B1", line="L4")))
    sections, left_out = adjacent_sections(spur, spur.points)
    assert sections == ()
    assert len(left_out) == 1
    assert "P0, P1, P2" in left_out[0]


def test_two_points_with_no_line_between_are_no_section():
    feeder = Feeder(
        name="joints",
        source=SOURCE,
        lines=(line("L1", "B0", "B1"), line("L2", "B3", "B4")),
        transformers=(),
        loads=(),
        switches=(
            Switch(name="s", from_bus="B1", to_bus="B2", closed=True),
            Switch(name="tie", from_bus="B4", to_bus="B0", closed=False),
        ),
        points=(Point(name="M1", bus="B1", line="L1"), Point(name="M2", bus="B3", line="L2")),
        sections=(),
        regulators=(
            Regulator(
                name="r", from_bus="B2", to_bus="B3", taps=(0, 0, 0), step_pct=0.6, most_taps=16
            ),
        ),
    )
    assert adjacent_sections(feeder, feeder.points) == ((), ())
    assert zones_of(feeder, feeder.points).entries == ((), (0,), (1,))
    ends = (Point(name="A", bus="B0", line="L1"), Point(name="Z", bus="B4", line="L2"))
    sections, _ = adjacent_sections(feeder, ends)
    assert [(s.local, s.remote) for s in sections] == [("A", "Z")]


def test_a_part_at_a_lines_end_stands_on_the_bus():
    feeder, _ = random_tree(np.random.default_rng(1), 3, 0)
    own = feeder.lines[1]
    loads = [
        replace(feeder.loads[0], place=Place(line=own.name, at=at), transformer=None)
        for at in (0.0, 0.3, 1.0)
    ]
    assert nodes_of(feeder, loads) == [
        ("bus", own.from_bus),
        ("line", own.name),
        ("bus", own.to_bus),
    ]
