"""Random but valid feeders and events, to compare solvers on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from oracles.dense import Event

from openphase.model.parts import (
    Connection,
    Feeder,
    Line,
    Load,
    LoadConnection,
    Place,
    Point,
    Section,
    Source,
    Switch,
    Transformer,
)

__all__ = ["random_event", "random_feeder"]

KINDS: tuple[Connection, ...] = ("Yg/Yg", "D/Yg", "Yg/D")
LOAD_KINDS: tuple[LoadConnection, ...] = ("wye", "delta")


def _polar(magnitude: float, degrees: float) -> complex:
    return complex(magnitude * np.exp(1j * np.radians(degrees)))


@dataclass(frozen=True, slots=True)
class _Edge:
    """One step away from the source: by a line, or by a closed switch (no name)."""

    parent: str
    child: str
    line: str | None


def _random_tree(
    rng: np.random.Generator, n_lines: int, depth: float, closed_switch: bool
) -> tuple[list[_Edge], list[Line]]:
    """Random recursive tree; one bus is split by a switch where ``closed_switch`` is set."""
    buses = ["B0"]
    edges: list[_Edge] = []
    lines: list[Line] = []
    split = int(rng.integers(n_lines)) if closed_switch else -1
    for k in range(n_lines):
        deep = rng.random() < depth
        parent = buses[-1] if deep else buses[int(rng.integers(len(buses)))]
        child = f"B{k + 1}"
        ends = (parent, child) if rng.random() < 0.5 else (child, parent)
        z1 = _polar(rng.uniform(0.15, 0.7), rng.uniform(30, 78))
        lines.append(
            Line(
                name=f"L{k}",
                from_bus=ends[0],
                to_bus=ends[1],
                length_km=float(rng.uniform(0.1, 3.0)),
                z1_ohm_per_km=z1,
                z0_ohm_per_km=z1 * _polar(rng.uniform(1.4, 4.0), rng.uniform(-10, 10)),
            )
        )
        edges.append(_Edge(parent, child, f"L{k}"))
        buses.append(child)
        if k == split:
            edges.append(_Edge(child, f"{child}s", None))
            buses[-1] = f"{child}s"
    return edges, lines


def _random_place(rng: np.random.Generator, buses: Sequence[str], lines: Sequence[Line]) -> Place:
    if rng.random() < 0.4:
        return Place(bus=buses[int(rng.integers(len(buses)))])
    line = lines[int(rng.integers(len(lines)))]
    return Place(line=line.name, at=float(rng.uniform(0.03, 0.97)))


def _random_load(
    rng: np.random.Generator,
    name: str,
    transformer: str | None,
    place: Place | None,
    exponent: float | None,
) -> Load:
    """A load of arbitrary size; ``_sized`` fits all of them to the feeder."""
    sign = -1.0 if rng.random() < 0.2 else 1.0
    exponents = (0.0, 1.0, 2.0, float(rng.uniform(0, 2)))
    return Load(
        name=name,
        transformer=transformer,
        place=place,
        connection=LOAD_KINDS[int(rng.integers(2))] if place is not None else "wye",
        kw=float(rng.uniform(0.2, 1.0)),
        power_factor=1.0 if rng.random() < 0.2 else sign * float(rng.uniform(0.85, 0.999)),
        exponent=exponents[int(rng.integers(4))] if exponent is None else exponent,
    )


def _host(place: Place, edges: Sequence[_Edge]) -> str:
    """Bus farther from the source of the line on which a place lies."""
    if place.bus is not None:
        return place.bus
    return next(e.child for e in edges if e.line == place.line)


def _path(edges: Sequence[_Edge], bus: str) -> list[_Edge]:
    """Edges from the source to a bus."""
    above = {e.child: e for e in edges}
    path: list[_Edge] = []
    while bus in above:
        path.insert(0, above[bus])
        bus = path[0].parent
    return path


def _sized(
    loads: Sequence[Load],
    hosts: Sequence[str],
    edges: Sequence[_Edge],
    lines: Sequence[Line],
    source: Source,
    drop: float,
) -> list[Load]:
    """Scale all loads so that source and lines drop ``drop`` pu, in scalar sum, at worst."""
    ohm = {x.name: abs(x.z1_ohm_per_km) * x.length_km for x in lines}
    flow: dict[str, float] = {}
    for load, host in zip(loads, hosts, strict=True):
        for edge in _path(edges, host):
            flow[edge.child] = flow.get(edge.child, 0.0) + load.kw / abs(load.power_factor)
    total = sum(x.kw / abs(x.power_factor) for x in loads)
    worst = max(
        sum(ohm[e.line] * flow.get(e.child, 0.0) for e in _path(edges, bus) if e.line)
        for bus in {source.bus, *hosts}
    ) + total * abs(source.z1_ohm)
    factor = drop * source.kv_ll**2 * 1000.0 / worst
    return [replace(x, kw=x.kw * factor) for x in loads]


def _random_transformers(
    rng: np.random.Generator, count: int, buses: Sequence[str], lines: Sequence[Line]
) -> list[Transformer]:
    """Every connection occurs where ``count`` is three or more; ratings are set later."""
    order = rng.permutation(3)
    units: list[Transformer] = []
    for k in range(count):
        kind = KINDS[int(order[k % 3])]
        three_limb = kind == "Yg/Yg" and rng.random() < 0.6
        units.append(
            Transformer(
                name=f"T{k}",
                place=_random_place(rng, buses, lines),
                connection=kind,
                rating_kva=100.0,
                leakage_pu=_polar(rng.uniform(0.02, 0.07), rng.uniform(55, 88)),
                x0_pu=float(rng.uniform(0.3, 2.0)) if three_limb else None,
            )
        )
    return units


def _random_points(
    rng: np.random.Generator, edges: Sequence[_Edge], lines: Sequence[Line]
) -> tuple[list[Point], list[Section]]:
    """One or two adjacent sections down one path, and spare points off that path.

    The local terminal looks into its section. Between two sections one point is shared;
    it lies on the second section's first line.
    """
    above = {e.child: e for e in edges}
    leaves = [e.child for e in edges if e.line is not None]
    path = _path(edges, leaves[int(rng.integers(len(leaves)))])
    first = int(rng.choice([k for k, e in enumerate(path) if e.line is not None]))
    chosen = path[first:]
    starts = [0]
    inner = [k for k in range(1, len(chosen)) if chosen[k].line is not None]
    if inner and rng.random() < 0.6:
        starts.append(int(rng.choice(inner)))
    terminals = [(chosen[k].parent, chosen[k].line) for k in starts]
    terminals.append((chosen[-1].child, chosen[-1].line))
    points = [
        Point(name=f"P{k}", bus=bus, line=line)
        for k, (bus, line) in enumerate(terminals)
        if line is not None
    ]
    sections = [Section(local=a.name, remote=b.name) for a, b in pairwise(points)]
    used = {e.line for e in chosen}
    for line in lines:
        if line.name not in used and rng.random() < 0.3:
            far = next(e.child for e in above.values() if e.line == line.name)
            near = line.to_bus if line.from_bus == far else line.from_bus
            bus = far if rng.random() < 0.5 else near
            points.append(Point(name=f"P{len(points)}", bus=bus, line=line.name))
    return points, sections


def _random_switches(
    rng: np.random.Generator, edges: Sequence[_Edge], with_tie: bool
) -> list[Switch]:
    switches = [
        Switch(name="S0", from_bus=e.parent, to_bus=e.child, closed=True)
        for e in edges
        if e.line is None
    ]
    if with_tie:
        buses = ["B0", *(e.child for e in edges)]
        joined = {frozenset((e.parent, e.child)) for e in edges}
        free = [
            (a, b)
            for i, a in enumerate(buses)
            for b in buses[i + 1 :]
            if frozenset((a, b)) not in joined
        ] or [(edges[0].parent, edges[0].child)]
        a, b = free[int(rng.integers(len(free)))]
        switches.append(Switch(name="TIE", from_bus=a, to_bus=b, closed=False))
    return switches


def random_feeder(
    rng: np.random.Generator,
    n_lines: int = 6,
    with_tie: bool = False,
    *,
    depth: float = 0.6,
    n_transformers: int | None = None,
    n_direct_loads: int | None = None,
    exponent: float | None = None,
    closed_switch: bool = False,
) -> Feeder:
    """Build a random radial feeder, with one normally-open tie ``TIE`` if asked.

    Parameters
    ----------
    rng
        Source of all randomness.
    n_lines
        Number of lines ``L0``, ``L1``, ...; buses are ``B0`` (source), ``B1``, ...
    depth
        Share of lines that continue at the newest bus: 1 a chain, 0 a random recursive tree.
    n_transformers, n_direct_loads
        Counts; random if None. All three connections occur from three transformers on.
    exponent
        Voltage exponent of every load (2: a linear feeder); random in 0..2 if None.
    closed_switch
        Split one bus by a closed switch ``S0``.

    Notes
    -----
    Loads are sized so that source and lines together drop 1..6 %, and units are loaded to
    30..80 %, so every voltage stays near nominal before an event.
    """
    edges, lines = _random_tree(rng, n_lines, depth, closed_switch)
    buses = ["B0", *(e.child for e in edges)]
    kv = float(rng.choice([4.16, 12.0, 22.0]))
    z1 = _polar(kv**2 / rng.uniform(50, 300), rng.uniform(75, 88))
    source = Source(
        bus="B0",
        kv_ll=kv,
        emf_pu=float(rng.uniform(0.98, 1.05)),
        z1_ohm=z1,
        z2_ohm=z1 * _polar(rng.uniform(0.7, 1.3), rng.uniform(-5, 5)),
        z0_ohm=z1 * _polar(rng.uniform(0.4, 3.0), rng.uniform(-10, 5)),
        frequency_hz=float(rng.choice([50.0, 60.0])),
    )
    if n_transformers is None:
        n_transformers = int(rng.integers(1, n_lines + 2))
    if n_direct_loads is None:
        n_direct_loads = int(rng.integers(0, 4))
    units = _random_transformers(rng, n_transformers, buses, lines)
    loads: list[Load] = []
    hosts: list[str] = []
    for unit in units:
        for _ in range(int(rng.choice([0, 1, 1, 1, 1, 2]))):
            loads.append(_random_load(rng, f"D{len(loads)}", unit.name, None, exponent))
            hosts.append(_host(unit.place, edges))
    for _ in range(n_direct_loads if loads else max(1, n_direct_loads)):
        place = _random_place(rng, buses, lines)
        loads.append(_random_load(rng, f"D{len(loads)}", None, place, exponent))
        hosts.append(_host(place, edges))
    loads = _sized(loads, hosts, edges, lines, source, float(rng.uniform(0.01, 0.06)))
    for k, unit in enumerate(units):
        kva = sum(x.kw / abs(x.power_factor) for x in loads if x.transformer == unit.name)
        rating = kva / rng.uniform(0.3, 0.8) if kva else loads[0].kw * rng.uniform(0.5, 2.0)
        units[k] = replace(unit, rating_kva=float(rating))
    points, sections = _random_points(rng, edges, lines)
    return Feeder(
        name="random",
        source=source,
        lines=tuple(lines),
        transformers=tuple(units),
        loads=tuple(loads),
        switches=tuple(_random_switches(rng, edges, with_tie)),
        points=tuple(points),
        sections=tuple(sections),
    )


def random_event(
    rng: np.random.Generator,
    feeder: Feeder,
    kind: Literal["open", "step", "emf", "any"] = "any",
    *,
    exponent: float | None = None,
) -> Event:
    """Draw one event; "any" draws the kind too, half of the time a break.

    A break opens one to three phases strictly inside a line; a step switches up to 15 % of
    the feeder's load on or off, on one to three phases; the EMF moves by up to 5 %.
    """
    if kind == "any":
        kinds: tuple[Literal["open", "step", "emf"], ...] = ("open", "open", "step", "emf")
        kind = kinds[int(rng.integers(4))]
    line = feeder.lines[int(rng.integers(len(feeder.lines)))].name
    at = float(rng.uniform(0.02, 0.98))
    count = int(rng.choice([1, 1, 2, 3]))
    phases = tuple(sorted(int(p) for p in rng.permutation(3)[:count]))
    if kind == "open":
        return Event(open_line=line, open_fraction=at, open_phases=phases)
    if kind == "emf":
        return Event(emf_scale=float(rng.uniform(0.95, 1.05)))
    total = sum(x.kw for x in feeder.loads)
    return Event(
        step_line=line,
        step_fraction=at,
        step_kw=float(rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.15) * total),
        step_phases=phases,
        step_exponent=float(rng.choice([0.0, 1.0, 2.0])) if exponent is None else exponent,
    )
