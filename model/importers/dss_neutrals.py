"""What stands between a neutral node of an OpenDSS circuit and earth."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

from .dss_live import Node
from .dss_records import RawCircuit, Winding

__all__ = ["Neutrals", "neutral_ohm", "neutrals_of"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Neutrals:
    """By neutral node: what earths it, and what else joins it."""

    earthing: dict[Node, list[complex]] = field(default_factory=dict)  #: siemens
    conductors: frozenset[Node] = frozenset()  #: joined by a line's neutral conductor
    shared: frozenset[Node] = frozenset()  #: of more than one transformer winding
    reactors: frozenset[str] = frozenset()  #: names of the reactors that earth a neutral
    loaded: frozenset[Node] = frozenset()  #: of loads
    held: frozenset[Node] = frozenset()  #: joined by anything but loads


def neutrals_of(circuit: RawCircuit) -> Neutrals:
    """Collect what the circuit does with nodes that are no phase."""
    earthing: defaultdict[Node, list[complex]] = defaultdict(list)
    reactors = set()
    for reactor in circuit.reactors:
        near, far = reactor.ends
        if len(near.nodes) == 1 and far.nodes == (0,) and near.nodes[0] > 3:
            z = complex(reactor.r_ohm[0][0], reactor.x_ohm[0][0])
            earthing[(near.bus, near.nodes[0])].append(1.0 / z)
            reactors.add(reactor.name)
    uses: defaultdict[Node, int] = defaultdict(int)
    for unit in circuit.transformers:
        for winding in unit.windings:
            if not winding.delta:
                uses[(winding.end.bus, winding.end.nodes[unit.phases])] += 1
    conductors = frozenset(
        (end.bus, node) for line in circuit.lines for end in line.ends for node in end.nodes
    )
    ends = [end for reactor in circuit.reactors for end in reactor.ends]
    ends += [end for bank in circuit.capacitors for end in (bank.end, bank.far)]
    ends += [end for other in circuit.others for end in other.ends]
    ends += [winding.end for unit in circuit.transformers for winding in unit.windings]
    joined = frozenset((end.bus, node) for end in ends for node in end.nodes)
    return Neutrals(
        earthing=dict(earthing),
        conductors=conductors,
        shared=frozenset(node for node, count in uses.items() if count > 1 and node[1] > 3),
        reactors=frozenset(reactors),
        loaded=frozenset(
            (load.end.bus, node) for load in circuit.loads for node in load.end.nodes if node > 3
        ),
        held=conductors | joined,
    )


def neutral_ohm(winding: Winding, phases: int, neutrals: Neutrals) -> complex | None:
    """Return the ohms between a wye's neutral and earth, None where it is not earthed."""
    node = (winding.end.bus, winding.end.nodes[phases])
    if node[1] == 0 or node in neutrals.conductors:
        return 0j
    siemens = list(neutrals.earthing.get(node, ()))
    if winding.neutral_ohm is not None:
        if winding.neutral_ohm == 0:
            return 0j
        siemens.append(1.0 / winding.neutral_ohm)
    total = sum(siemens)
    if not total:
        # what returns through a neutral that is earthed nowhere has it for its earth
        return 0j if node in neutrals.loaded else None
    return 1.0 / total
