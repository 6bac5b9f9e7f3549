"""Where the buses of a feeder are drawn: by their coordinates, else as a tree by kilometres."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Mapping
from dataclasses import dataclass

from ...model.buses import bus_volts
from ...model.parts import Feeder, Line, Switch
from ...model.zones import Edge, outwards

__all__ = ["LOW_V", "Places", "Spot", "has_coordinates", "place_buses"]

Spot = tuple[float, float]

ENOUGH = 0.5  #: share of the medium-voltage buses that must have coordinates for a map
LOW_V = 600.0  #: to earth: what has less is low voltage
JOINT = 0.008  #: of the reach, that whatever has no length takes
GAP = 0.012  #: of the reach, that branches in the same row are apart


@dataclass(frozen=True, slots=True, kw_only=True)
class Places:
    """Spots of the buses that are drawn.

    Parameters
    ----------
    at
        By bus; in a tree x is km from the source, and y counts rows, upwards.
    is_map
        Whether they are coordinates.
    near
        The bus towards the source, of every bus that has one.
    guessed
        How many buses without coordinates are drawn where their neighbours are.
    """

    at: Mapping[str, Spot]
    is_map: bool
    near: Mapping[str, str]
    guessed: int = 0

    def has(self, *buses: str) -> bool:
        """Return whether all these buses are drawn."""
        return all(bus in self.at for bus in buses)

    def span(self) -> tuple[float, float]:
        """Return the width and the height of what they cover."""
        xs, ys = zip(*self.at.values(), strict=True)
        return max(xs) - min(xs), max(ys) - min(ys)

    def way(self, start: str, end: str) -> list[Spot]:
        """Return the corners of what joins two buses."""
        a, b = self.at[start], self.at[end]
        if self.is_map or a[1] == b[1]:
            return [a, b]
        # a branch goes across at the km of the bus it leaves
        if self.near.get(start) == end:
            return [a, (b[0], a[1]), b]
        return [a, (a[0], b[1]), b]


def has_coordinates(feeder: Feeder) -> bool:
    """Whether most buses have coordinates, and these differ; low voltage counts if it is all."""
    volts, fed = bus_volts(feeder), outwards(feeder)
    buses = {bus for bus in fed if volts[bus] >= LOW_V} or set(fed)
    known = {own.bus: (own.x, own.y) for own in feeder.coordinates if own.bus in buses}
    return len(known) >= ENOUGH * len(buses) and len(set(known.values())) > 1


def place_buses(feeder: Feeder) -> Places:
    """Place every bus that the source feeds while ties are open, and those at open switches."""
    tree = outwards(feeder)
    near = {bus: step[0] for bus, step in tree.items() if step is not None}
    if has_coordinates(feeder):
        return _by_coordinates(feeder, near)
    at = _as_tree(tree, near)
    lowest = min(y for _, y in at.values())
    # what only open switches reach stands below
    conductors: list[Line | Switch] = [*feeder.lines, *feeder.switches]
    loose = dict.fromkeys(bus for part in conductors for bus in (part.from_bus, part.to_bus))
    for bus in loose:
        if bus not in at:
            lowest -= 1.0
            at[bus] = (0.0, lowest)
    return Places(at=at, is_map=False, near=near)


def _by_coordinates(feeder: Feeder, near: Mapping[str, str]) -> Places:
    """Coordinates; a bus without any stands midway between neighbours that have, or at one."""
    known: dict[str, Spot] = {own.bus: (own.x, own.y) for own in feeder.coordinates}
    joined: defaultdict[str, list[str]] = defaultdict(list)
    parts: list[Edge] = [*feeder.lines, *feeder.switches, *feeder.regulators]
    for part in [*parts, *feeder.inline_transformers]:
        joined[part.from_bus].append(part.to_bus)
        joined[part.to_bus].append(part.from_bus)
    given = {bus for bus in known if bus in joined}
    at = {bus: known[bus] for bus in given}
    waiting = deque(sorted(given))
    while waiting:
        for bus in joined[waiting.popleft()]:
            if bus not in at:
                around = [known[other] for other in joined[bus] if other in given]
                around = around or [at[other] for other in joined[bus] if other in at]
                at[bus] = (
                    sum(x for x, _ in around) / len(around),
                    sum(y for _, y in around) / len(around),
                )
                waiting.append(bus)
    return Places(at=at, is_map=True, near=near, guessed=len(at) - len(given))


def _as_tree(
    tree: Mapping[str, tuple[str, Edge] | None], near: Mapping[str, str]
) -> dict[str, Spot]:
    """Kilometres from the source, and for each branch the free row nearest to where it leaves."""
    reach = max(*_kilometres(tree, 0.0).values(), 1e-9)
    km = _kilometres(tree, JOINT * reach)
    farthest = dict(km)
    children: defaultdict[str, list[str]] = defaultdict(list)
    for bus in reversed(list(tree)):
        if bus in near:
            farthest[near[bus]] = max(farthest[near[bus]], farthest[bus])
            children[near[bus]].append(bus)
    gap = GAP * reach
    taken: defaultdict[int, list[tuple[float, float]]] = defaultdict(list)
    row: dict[str, int] = {}
    waiting = [next(iter(tree))]
    while waiting:
        head = waiting.pop()
        chain = _longest_way(head, children, farthest)
        start = km[near[head]] if head in near else km[head]
        stop = km[next(reversed(chain))]
        beside = row[near[head]] if head in near else 0
        own = _free_row(taken, beside, start - gap, stop + gap)
        taken[own].append((start - gap, stop + gap))
        for bus in chain:
            row[bus] = own
            onwards = [far for far in children[bus] if far not in chain]
            waiting += sorted(onwards, key=lambda far: (farthest[far], far))
    return {bus: (km[bus], float(row[bus])) for bus in tree}


def _kilometres(tree: Mapping[str, tuple[str, Edge] | None], joint_km: float) -> dict[str, float]:
    """Km of every bus from the source."""
    km: dict[str, float] = {}
    for bus, step in tree.items():
        length = step[1].length_km if step and isinstance(step[1], Line) else joint_km
        km[bus] = km[step[0]] + length if step else 0.0
    return km


def _longest_way(
    head: str, children: Mapping[str, list[str]], farthest: Mapping[str, float]
) -> dict[str, None]:
    """The buses from ``head`` on, always towards the farthest end."""
    chain = {head: None}
    bus = head
    while children[bus]:
        bus = max(children[bus], key=lambda far: (farthest[far], far))
        chain[bus] = None
    return chain


def _free_row(
    taken: Mapping[int, list[tuple[float, float]]], beside: int, start: float, stop: float
) -> int:
    """The row nearest to ``beside`` in which nothing stands from ``start`` to ``stop``."""
    distance = 0
    while True:
        for row in (beside + distance, beside - distance):
            if all(stop <= a or start >= b for a, b in taken.get(row, ())):
                return row
        distance += 1
