"""Which buses are folded, and where: against a search that takes buses away one by one."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from openphase.model.parts import Feeder, Line, Place, Point, Source, Switch
from openphase.model.reduction.foldable import fold_roots, kept_by_default

SOURCE = Source(
    bus="s", kv_ll=12.0, emf_pu=1.0, z1_ohm=0.9j, z2_ohm=0.9j, z0_ohm=0.9j, frequency_hz=60.0
)


def feeder_of(
    ways: list[tuple[str, str]],
    phases: dict[int, str] | None = None,
    switches: tuple[Switch, ...] = (),
    points: tuple[Point, ...] = (),
) -> Feeder:
    """A feeder of lines alone."""
    lines = tuple(
        Line(
            name=f"L{n}",
            from_bus=start,
            to_bus=end,
            length_km=1.0,
            z1_ohm_per_km=0.3 + 0.4j,
            z0_ohm_per_km=0.5 + 1.2j,
            phases=(phases or {}).get(n, "abc"),
        )
        for n, (start, end) in enumerate(ways)
    )
    return Feeder(
        name="graph",
        source=SOURCE,
        lines=lines,
        transformers=(),
        loads=(),
        switches=switches,
        points=points,
        sections=(),
    )


def reached(ways: list[tuple[str, str]], start: str, without: str) -> set[str]:
    found, waiting = {start}, [start]
    while waiting:
        bus = waiting.pop()
        for a, b in ways:
            for near, far in ((a, b), (b, a)):
                if near == bus and far not in found and far != without:
                    found.add(far)
                    waiting.append(far)
    return found


def brute_roots(ways: list[tuple[str, str]], kept: set[str]) -> dict[str, str]:
    """A bus folds if some other bus, taken away, parts it from all that are kept."""
    buses = sorted({bus for way in ways for bus in way})
    doors = {
        bus: [
            door
            for door in buses
            if door != bus and not (reached(ways, bus, door) & (kept - {door}))
        ]
        for bus in buses
        if bus not in kept
    }
    folded = {bus for bus, found in doors.items() if found}
    # of its doors only one stays: the others are folded too
    return {bus: next(d for d in doors[bus] if d not in folded) for bus in folded}


@pytest.mark.parametrize("seed", range(40))
def test_a_bus_folds_exactly_where_one_bus_parts_it_from_all_that_are_kept(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 13))
    names = ["s", *(f"n{k}" for k in range(1, count))]
    ways = [(names[int(rng.integers(0, k))], names[k]) for k in range(1, count)]
    for _ in range(int(rng.integers(0, 4))):
        a, b = rng.choice(count, 2, replace=False)
        ways.append((names[a], names[b]))
    rng.shuffle(ways)
    ways = [(str(a), str(b)) for a, b in ways]
    kept = {"s"} | {name for name in names if rng.random() < 0.2}
    found = fold_roots(feeder_of(ways), kept)
    assert found == brute_roots(ways, kept)


def test_laterals_fold_and_the_three_phase_trunk_stays():
    ways = [("s", "t1"), ("t1", "t2"), ("t1", "x1"), ("x1", "x2")]
    feeder = feeder_of(ways, {2: "b", 3: "b"})
    assert fold_roots(feeder, kept_by_default(feeder)) == {"x1": "t1", "x2": "t1"}


def test_what_leads_to_a_switch_or_a_point_or_a_named_bus_stays():
    ways = [("s", "t"), *pairwise(["t", "x1", "x2", "x3"]), ("t", "y1"), ("t", "z1")]
    single = dict.fromkeys(range(1, 6), "a")
    fuse = Switch(name="F", from_bus="y1", to_bus="y2", closed=True, phases="a")
    feeder = feeder_of(
        [*ways, ("y2", "y3")],
        {**single, 6: "a"},
        switches=(fuse,),
        points=(Point(name="P", bus="x2", line="L2"),),
    )
    assert fold_roots(feeder, kept_by_default(feeder)) == {"x3": "x2", "z1": "t", "y3": "y2"}
    more = kept_by_default(feeder) | {"z1"}
    assert "z1" not in fold_roots(feeder, more)


def test_nothing_folds_where_all_is_three_phase():
    feeder = feeder_of([("s", "a"), ("a", "b"), ("a", "c")])
    assert fold_roots(feeder, kept_by_default(feeder)) == {}
    assert Place(bus="c").bus in kept_by_default(feeder)
