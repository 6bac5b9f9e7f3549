"""Which nodes of an OpenDSS circuit its source feeds, and what hangs behind an element."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator

from .dss_coils import coils_of
from .dss_records import RawCircuit, RawLoad

__all__ = ["Node", "element_names", "fed_kw", "live_nodes", "load_kw"]

Node = tuple[str, int]
_Pair = tuple[str, Node, Node]

_PHASES = (1, 2, 3)


def live_nodes(circuit: RawCircuit, without: Collection[str] = ()) -> set[Node]:
    """Return the phase nodes that the source feeds, some elements taken away.

    A transformer feeds the coils of its other windings where it has a voltage on one.
    """
    joined: defaultdict[Node, list[Node]] = defaultdict(list)
    for element, start, end in _joins(circuit):
        if element not in without:
            joined[start].append(end)
            joined[end].append(start)
    waiting = [
        (source.end.bus, node)
        for source in circuit.sources
        if f"vsource.{source.name}" not in without
        for node in source.end.nodes
    ]
    live = set(waiting)
    while waiting:
        for far in joined[waiting.pop()]:
            if far not in live:
                live.add(far)
                waiting.append(far)
    return live


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
    tables = {
        "vsource": circuit.sources,
        "line": circuit.lines,
        "transformer": circuit.transformers,
        "load": circuit.loads,
        "capacitor": circuit.capacitors,
        "reactor": circuit.reactors,
    }
    named = {f"{kind}.{part.name}" for kind, parts in tables.items() for part in parts}
    kinded = (*circuit.plants, *circuit.guards, *circuit.others)
    return named | {f"{part.kind}.{part.name}" for part in kinded}


def _joins(circuit: RawCircuit) -> Iterator[_Pair]:
    """Return the pairs of phase nodes that elements join, each with its element."""
    for line in circuit.lines:
        element = f"line.{line.name}"
        start, end = line.ends
        opened = zip(*line.opened, strict=True)
        for near, far, broken in zip(start.nodes, end.nodes, opened, strict=True):
            if near > 0 and far > 0 and not any(broken):
                yield element, (start.bus, near), (end.bus, far)
    for reactor in circuit.reactors:
        start, end = reactor.ends
        for near, far in zip(start.nodes, end.nodes, strict=True):
            if near > 0 and far > 0:
                yield f"reactor.{reactor.name}", (start.bus, near), (end.bus, far)
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
    for bank in circuit.capacitors:
        for near, far in zip(bank.end.nodes, bank.far.nodes, strict=True):
            if near > 0 and far > 0 and bank.far.bus not in ("", bank.end.bus):
                yield f"capacitor.{bank.name}", (bank.end.bus, near), (bank.far.bus, far)
    for other in circuit.others:
        for far_end in other.ends[1:]:
            for near, far in zip(other.ends[0].nodes, far_end.nodes, strict=False):
                if near > 0 and far > 0:
                    yield (
                        f"{other.kind}.{other.name}",
                        (other.ends[0].bus, near),
                        (far_end.bus, far),
                    )
