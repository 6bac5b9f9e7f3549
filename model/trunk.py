"""The trunk: the three-phase path from the feeder's head to the farthest three-phase load."""

from __future__ import annotations

import heapq
from collections import defaultdict, deque
from dataclasses import dataclass

from .buses import bus_volts
from .line_matrices import z1_ohm
from .parts import Feeder, InlineTransformer, Line, Regulator, Switch
from .reactors import is_reactor
from .zones import nodes_of, outwards

__all__ = ["Step", "Trunk", "find_trunk"]

ROOT = 3.0**0.5
MEDIUM_KV = (1.0, 60.0)  #: line to line; what has less is low voltage
LEAST_LOAD = 0.01  #: share of the feeder's load that makes a bus worth reaching
AT_HEAD = 0.02  #: share of the path's |Z1| within which a regulator belongs to the substation

Joint = Line | Switch | Regulator
Way = tuple[str, Joint]


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A line of the trunk, from the source on, and what stands between it and the line before.

    Series reactors stand between lines.
    """

    line: Line
    near: str  #: its bus towards the source
    far: str
    ohm: float  #: |Z1| of the line
    regulators: tuple[str, ...]  #: between it and the line before
    switches: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Trunk:
    """The lines of the trunk in their order, and why it ends where it does."""

    steps: tuple[Step, ...]
    head: str
    end: str
    kv_ll: float
    ends_at: str  #: why it ends there


def find_trunk(feeder: Feeder) -> Trunk | None:
    """Find the trunk; None where no three-phase line is.

    It lies in that medium-voltage network, between the in-line transformers, which has the most
    three-phase line (of a low-voltage feeder, in that low-voltage network). Its head is where
    the source feeds that network, behind regulators that stand there. Ways are measured by
    |Z1|; the end is the farthest bus that has or feeds load on all three phases, at least a
    hundredth of the feeder's.
    """
    volts = bus_volts(feeder)
    joined, fed = _joined(feeder), tuple(outwards(feeder))
    network = _longest_network(feeder, joined, {bus: volts[bus] for bus in fed})
    if not network:
        return None
    ohm = {name: abs(z1_ohm(feeder, line)) for name, line in network.items()}
    inside = {bus for line in network.values() for bus in (line.from_bus, line.to_bus)}
    head = next(bus for bus in fed if bus in inside)
    distance, before = _ways(head, joined, ohm)
    end, what = _farthest(feeder, distance)
    path: list[Way] = []
    at = end
    while at != head:
        near, part = before[at]
        path.append((near, part))
        at = near
    lines = {name for name, line in network.items() if not is_reactor(feeder, line)}
    path = [way for way in reversed(path) if not isinstance(way[1], Line) or way[1].name in lines]
    steps = _behind_the_substation(_steps(path, ohm))
    if not steps:
        return None
    return Trunk(
        steps=tuple(steps),
        head=steps[0].near,
        end=steps[-1].far,
        kv_ll=volts[head] * ROOT / 1000.0,
        ends_at=what,
    )


def _is_whole(part: Joint | InlineTransformer) -> bool:
    """Whether it has all three phases."""
    return len(part.phases) == 3 and (not isinstance(part, Switch) or part.closed)


def _joined(feeder: Feeder) -> dict[str, list[Way]]:
    """What three-phase lines, closed switches and regulators join, without transformers."""
    joined: defaultdict[str, list[Way]] = defaultdict(list)
    parts: list[Joint] = [*feeder.lines, *feeder.switches, *feeder.regulators]
    for part in parts:
        if _is_whole(part):
            joined[part.from_bus].append((part.to_bus, part))
            joined[part.to_bus].append((part.from_bus, part))
    return joined


def _longest_network(
    feeder: Feeder, joined: dict[str, list[Way]], volts: dict[str, float]
) -> dict[str, Line]:
    """The lines, by name, of the network with the most three-phase line; medium voltage first."""
    seen: set[str] = set()
    best: tuple[bool, float] = (False, 0.0)
    found: dict[str, Line] = {}
    for root, v in volts.items():
        if root in seen or root not in joined:
            continue
        buses, waiting = {root}, deque([root])
        while waiting:
            for far, _ in joined[waiting.popleft()]:
                if far not in buses:
                    buses.add(far)
                    waiting.append(far)
        seen |= buses
        own = {
            part.name: part for bus in buses for _, part in joined[bus] if isinstance(part, Line)
        }
        is_medium = MEDIUM_KV[0] < v * ROOT / 1000.0 <= MEDIUM_KV[1]
        rank = (is_medium, sum(line.length_km for line in own.values()))
        if own and rank > best:
            best, found = rank, {line.name: line for line in feeder.lines if line.name in own}
    return found


def _ways(
    head: str, joined: dict[str, list[Way]], ohm: dict[str, float]
) -> tuple[dict[str, float], dict[str, Way]]:
    """|Z1| of the shortest way from ``head`` to every bus, and the last step of it."""
    distance: dict[str, float] = {}
    before: dict[str, Way] = {}
    waiting: list[tuple[float, int, str, Way | None]] = [(0.0, 0, head, None)]
    count = 1
    while waiting:
        so_far, _, bus, way = heapq.heappop(waiting)
        if bus in distance:
            continue
        distance[bus] = so_far
        if way is not None:
            before[bus] = way
        for far, part in joined.get(bus, []):
            if far not in distance:
                further = so_far + (ohm[part.name] if isinstance(part, Line) else 0.0)
                heapq.heappush(waiting, (further, count, far, (bus, part)))
                count += 1
    return distance, before


def _farthest(feeder: Feeder, distance: dict[str, float]) -> tuple[str, str]:
    """The farthest bus that feeds enough load on all three phases, and why it is the end."""
    fed, kw = _fed(feeder)
    least = LEAST_LOAD * kw[feeder.source.bus]
    there = [
        bus
        for bus, ohm in distance.items()
        if ohm > 0.0 and len(fed[bus]) == 3 and kw[bus] >= least
    ]
    why = f"no three-phase line goes farther to {LEAST_LOAD * 100:g} % of the load on all phases"
    if not there:
        there, why = list(distance), "no three-phase load is on the way, and no bus farther"
    return max(there, key=lambda bus: distance[bus]), why


def _fed(feeder: Feeder) -> tuple[dict[str, set[str]], dict[str, float]]:
    """Phases that take load at every bus or beyond it as the source feeds them, and their kW."""
    before = outwards(feeder)
    place = {bus: n for n, bus in enumerate(before)}
    fed: dict[str, set[str]] = {bus: set() for bus in before}
    kw = dict.fromkeys(before, 0.0)
    ends = {line.name: (line.from_bus, line.to_bus) for line in feeder.lines}
    for load, (kind, name) in zip(feeder.loads, nodes_of(feeder, feeder.loads), strict=True):
        buses = (name,) if kind == "bus" else ends[name]
        known = [bus for bus in buses if bus in place]
        if known:
            phases = load.phases if load.transformer is None else "abc"
            bus = max(known, key=lambda bus: place[bus])
            fed[bus] |= set(phases)
            kw[bus] += load.kw
    for bus, step in reversed(before.items()):
        if step is not None and fed[bus]:
            near, part = step
            own = fed[bus] & set(part.phases)
            if isinstance(part, InlineTransformer):
                own = set(part.phases if part.from_bus == near else part.to_phases)
            fed[near] |= own
            kw[near] += kw[bus]
    return fed, kw


def _steps(path: list[Way], ohm: dict[str, float]) -> list[Step]:
    """The path's lines, with what stands before each."""
    steps: list[Step] = []
    regulators: list[str] = []
    switches: list[str] = []
    for near, part in path:
        if isinstance(part, Regulator):
            regulators.append(part.name)
        elif isinstance(part, Switch):
            switches.append(part.name)
        else:
            steps.append(
                Step(
                    line=part,
                    near=near,
                    far=part.to_bus if part.from_bus == near else part.from_bus,
                    ohm=ohm[part.name],
                    regulators=tuple(regulators),
                    switches=tuple(switches),
                )
            )
            regulators, switches = [], []
    return steps


def _behind_the_substation(steps: list[Step]) -> list[Step]:
    """The steps behind the last regulator that stands at the head."""
    total = sum(step.ohm for step in steps)
    so_far, first = 0.0, 0
    for n, step in enumerate(steps):
        if step.regulators and so_far <= AT_HEAD * total:
            first = n
        so_far += step.ohm
    return steps[first:]
