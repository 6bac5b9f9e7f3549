"""Which nodes of an OpenDSS circuit its source feeds, and what hangs behind an element."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence

from .dss_coils import coils_of
from .dss_records import End, RawCircuit, RawLine, RawLoad

__all__ = ["Node", "element_names", "fed_kw", "live_nodes", "load_kw"]

Node = tuple[str, int]
_Ends = tuple[Node, Node]
_Pair = tuple[str, Node, Node]

_PHASES = (1, 2, 3)


def live_nodes(circuit: RawCircuit, without: Collection[str] = ()) -> set[Node]:
    """Return the phase nodes that the source feeds, some elements taken away.

    A transformer feeds the coils of its other windings where it has a voltage on one. Behind a
    line's open conductor a phase counts as fed where another conductor of the line feeds that
    end: loads and windings between the phases bring it a voltage.
    """
    joined: defaultdict[Node, list[Node]] = defaultdict(list)
    for element, start, end in _joins(circuit):
        if element not in without:
            joined[start].append(end)
            joined[end].append(start)
    lines = [line for line in circuit.lines if f"line.{line.name}" not in without]
    partly = [(closed, opened) for closed, opened in map(_closed_and_open, lines) if opened]
    waiting = [
        (source.end.bus, node)
        for source in circuit.sources
        if f"vsource.{source.name}" not in without
        for node in source.end.nodes
    ]
    live = set(waiting)
    while waiting:
        while waiting:
            for far in joined[waiting.pop()]:
                if far not in live:
                    live.add(far)
                    waiting.append(far)
        for closed, opened in partly:
            if any(set(pair) <= live for pair in closed):
                waiting += [node for pair in opened if live & set(pair) for node in pair]
        waiting = [node for node in dict.fromkeys(waiting) if node not in live]
        live.update(waiting)
    return live


def _closed_and_open(line: RawLine) -> tuple[list[_Ends], list[_Ends]]:
    """Return the ends of a line's phase conductors, of the closed and of the open ones."""
    near, far = line.ends
    cuts = [any(ends) for ends in zip(*line.opened, strict=True)]
    found: tuple[list[_Ends], list[_Ends]] = ([], [])
    for start, end, cut in zip(near.nodes, far.nodes, cuts, strict=True):
        if start in _PHASES and end in _PHASES:
            found[cut].append(((near.bus, start), (far.bus, end)))
    return found


def load_kw(load: RawLoad, load_mult: float) -> float:
    """Nominal kW of a load as the circuit multiplies it."""
    return load.kw * (1.0 if load.fixed else load_mult)


def fed_kw(circuit: RawCircuit, without: Collection[str] = ()) -> float:
    """Load that is fed, some elements taken away."""
    live = live_nodes(circuit, without)
    return sum(
        load_kw(load, circuit.load_mult)
        for load in circuit.loads
        if f"load.{load.name}" not in without
        and any((load.end.bus, node) in live for node in load.end.nodes)
    )


def element_names(circuit: RawCircuit) -> set[str]:
    """Return every element that may be dropped, as ``class.name``."""
    names = {
        "vsource": [part.name for part in circuit.sources],
        "line": [part.name for part in circuit.lines],
        "transformer": [part.name for part in circuit.transformers],
        "load": [part.name for part in circuit.loads],
        "capacitor": [part.name for part in circuit.capacitors],
        "reactor": [part.name for part in circuit.reactors],
    }
    named = {f"{kind}.{name}" for kind, found in names.items() for name in found}
    named |= {f"{part.kind}.{part.name}" for part in circuit.plants}
    named |= {f"{part.kind}.{part.name}" for part in circuit.guards}
    return named | {f"{part.kind}.{part.name}" for part in circuit.others}


def _joins(circuit: RawCircuit) -> Iterator[_Pair]:
    """Return the pairs of phase nodes that elements join, each with its element."""
    for line in circuit.lines:
        opened = [any(broken) for broken in zip(*line.opened, strict=True)]
        yield from _through(f"line.{line.name}", line.ends, opened)
    for reactor in circuit.reactors:
        yield from _through(f"reactor.{reactor.name}", reactor.ends)
    for bank in circuit.capacitors:
        yield from _through(f"capacitor.{bank.name}", (bank.end, bank.far))
    for other in circuit.others:
        for far in other.ends[1:]:
            yield from _through(f"{other.kind}.{other.name}", (other.ends[0], far))
    for unit in circuit.transformers:
        for coils in coils_of(unit):
            nodes = [
                (winding.end.bus, node)
                for winding, coil in zip(unit.windings, coils, strict=True)
                for node in coil
                if node in _PHASES
            ]
            for node in nodes[1:]:
                yield f"transformer.{unit.name}", nodes[0], node


def _through(
    element: str, ends: tuple[End, End], opened: Sequence[bool] | None = None
) -> Iterator[_Pair]:
    """Return what a series element joins, conductor by conductor, but for the open ones."""
    near, far = ends
    if far.bus in ("", near.bus):
        return
    for n, (start, end) in enumerate(zip(near.nodes, far.nodes, strict=False)):
        if start > 0 and end > 0 and not (opened and opened[n]):
            yield element, (near.bus, start), (far.bus, end)
