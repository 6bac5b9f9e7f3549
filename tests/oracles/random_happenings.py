"""Random events of all kinds together, as the model has them and as the dense reference does.

An event of the model stands on an edge of the compiled network, its sides being upper and
lower; the reference knows the line's from-side and to-side. One scenario at a time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from oracles.dense import Event as DenseEvent
from oracles.dense import Shunt
from oracles.dense_inline import nominal_volts

from openphase.model.events.base import Event, no_event
from openphase.model.network import Network
from openphase.model.parts import Feeder, Place

__all__ = ["Happening", "dense_event", "phases_of", "random_happening"]

Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, kw_only=True)
class Happening:
    """One event and what it is made of."""

    event: Event
    what: frozenset[str]


def random_happening(rng: np.random.Generator, feeder: Feeder, network: Network) -> Happening:
    """Draw an event; every ingredient by itself, so that most pairs occur together.

    Where earth is not solid all phases of a regulator move together: unequal taps are a
    zero-sequence voltage in series, with which such a network would resonate.
    """
    event, what = no_event(network, 1), set()
    volts = nominal_volts(feeder)
    if rng.random() < 0.9 and np.any(network.length_km > 0):
        event = replace(event, edge=np.array([_edge(rng, network)]), share=np.array([_share(rng)]))
        edge = network.pieces[int(event.edge[0])]
        assert edge is not None
        line = next(line for line in feeder.lines if line.name == edge.line)
        event, found = _on_the_line(rng, volts[line.from_bus], event)
        event = _on_phases(event, line.phases)
        what |= found
    if rng.random() < 0.25:
        what.add("far")
        node = np.array([rng.integers(len(network.nodes))])
        where, there = _whereabouts(feeder, network.nodes[int(node[0])])
        v = volts[where]
        before, after = _steps(rng, v) if rng.random() < 0.6 else (_none(), _fault(rng))
        event = replace(event, far_node=node, far_before_s=before, far_after_s=after)
        if rng.random() < 0.4:
            what.add("far, between")
            before, after = _steps(rng, v) if rng.random() < 0.6 else (_none(), _fault(rng))
            event = replace(event, far_between_before_s=before, far_between_after_s=after)
        event = _far_on_phases(event, there)
    if rng.random() < 0.2:
        what.add("emf")
        event = replace(event, emf_factor=np.array([rng.uniform(0.9, 1.05)]))
    if network.regulators and rng.random() < 0.5:
        what.add("tap")
        ganged = feeder.source.neutral in ("petersen", "isolated")
        size = (len(network.regulators), 1 if ganged else 3, 1)
        taps = 1 + 0.00625 * rng.integers(-2, 3, size=size)
        taps = np.broadcast_to(taps, (len(network.regulators), 3, 1)).copy()
        for row, own in zip(taps, feeder.regulators, strict=True):
            # the ladder's z_ohm stays as the file's taps make it
            fixed = [own.z_ohm != 0 or phase not in own.phases for phase in "abc"]
            row[fixed] = 1.0
        event = replace(event, tap_factor=taps)
    if rng.random() < 0.25:
        what.add("loads")
        event = replace(event, load_factor=rng.uniform(0.0, 1.4, (len(network.loads), 1)))
    if network.machines.ders and rng.random() < 0.4:
        what.add("ders")
        factor = rng.choice([0.0, 0.5, 1.0, 1.2], size=(len(network.machines.ders), 1))
        event = replace(event, der_factor=factor)
    return Happening(event=event, what=frozenset(what))


def _whereabouts(feeder: Feeder, node: str) -> tuple[str, str]:
    """A bus of a node's voltage, and the phases that are there."""
    name, _, what = node.partition(":")
    if what == "open":
        point = next(point for point in feeder.points if point.name == name)
        line = next(line for line in feeder.lines if line.name == point.line)
        return line.from_bus, line.phases
    if what:
        line = next(line for line in feeder.lines if line.name == name)
        return line.from_bus, line.phases
    return node, phases_of(feeder, node)


def phases_of(feeder: Feeder, bus: str) -> str:
    """The conductors that reach a bus, by what is connected there."""
    found = "abc" if bus == feeder.source.bus else ""
    for part in (*feeder.lines, *feeder.switches, *feeder.regulators):
        if bus in (part.from_bus, part.to_bus):
            found += part.phases
    for regulator in feeder.regulators:
        if regulator.reference != "earth" and bus in (regulator.from_bus, regulator.to_bus):
            found += "abc" if regulator.reference == "next" else regulator.reference
    for unit in feeder.inline_transformers:
        found += unit.phases if bus == unit.from_bus else ""
        found += unit.to_phases if bus == unit.to_bus else ""
    return "".join(sorted(set(found) & set("abc")))


def _held(values: Complex, phases: str, *, between: bool = False) -> Complex:
    """(3, 1) without what hangs on phases that are not there."""
    there = np.array([phase in phases for phase in "abc"])
    if between:
        there = there & np.roll(there, -1)
    return np.where(there[:, None], values, 0.0).astype(np.complex128)


def _on_phases(event: Event, phases: str) -> Event:
    """What stands on a line, on the phases that it has."""
    mask = sum(1 << k for k in range(3) if "abc"[k] in phases)
    return replace(
        event,
        open_before=event.open_before & mask,
        open_after=event.open_after & mask,
        earth_before_s=_held(event.earth_before_s, phases),
        earth_after_s=_held(event.earth_after_s, phases),
        between_before_s=_held(event.between_before_s, phases, between=True),
        between_after_s=_held(event.between_after_s, phases, between=True),
        fallen_after_s=_held(event.fallen_after_s, phases),
    )


def _far_on_phases(event: Event, phases: str) -> Event:
    """The same at the second place."""
    return replace(
        event,
        far_before_s=_held(event.far_before_s, phases),
        far_after_s=_held(event.far_after_s, phases),
        far_between_before_s=_held(event.far_between_before_s, phases, between=True),
        far_between_after_s=_held(event.far_between_after_s, phases, between=True),
    )


def _edge(rng: np.random.Generator, network: Network) -> int:
    """A piece of line; where there is a loop, often one of it, and often its chord."""
    lines = np.flatnonzero(network.length_km > 0)
    chosen = lines
    if network.chords and rng.random() < 0.5:
        first = len(network.nodes)
        ring = [k for k in lines if k >= first or network.tree.in_loop[k]]
        chords = lines[lines >= first]
        chosen = chords if rng.random() < 0.4 and chords.size else np.array(ring or lines)
    return int(rng.choice(chosen))


def _share(rng: np.random.Generator) -> float:
    return float(rng.choice([0.0, 1.0, rng.uniform(0.02, 0.98)], p=[0.12, 0.12, 0.76]))


def _on_the_line(rng: np.random.Generator, v: float, event: Event) -> tuple[Event, set[str]]:
    what = set()
    if rng.random() < 0.65:
        after = int(rng.choice([1, 2, 4, 3, 5, 6, 7], p=[0.2, 0.2, 0.2, 0.1, 0.1, 0.1, 0.1]))
        what.add(f"open {after.bit_count()}")
        event = replace(event, open_after=np.array([after]))
        if rng.random() < 0.25:
            what.add("open before")
            before = after & int(rng.integers(8)) if rng.random() < 0.7 else int(rng.integers(8))
            event = replace(event, open_before=np.array([before]))
    elif rng.random() < 0.15:
        what.add("closing")
        event = replace(event, open_before=np.array([int(rng.integers(1, 8))]))
    kind = rng.random()
    if kind < 0.3:
        what.add("step")
        before_s, after_s = _steps(rng, v)
        exponent = float(rng.choice([0.0, 1.0, 2.0, rng.uniform(0, 2)]))
        event = replace(
            event,
            earth_before_s=before_s,
            earth_after_s=after_s,
            exponent=np.array([exponent]),
        )
    elif kind < 0.45:
        what.add("earth fault")
        event = replace(event, earth_after_s=_fault(rng))
    if rng.random() < 0.15:
        what.add("line fault")
        event = replace(event, between_after_s=_fault(rng))
        if rng.random() < 0.3:
            event = replace(event, between_before_s=_fault(rng) / 50)
    if rng.random() < 0.2:
        what.add("fallen")
        event = replace(event, fallen_after_s=_fault(rng))
    return event, what


def _none() -> Complex:
    return np.zeros((3, 1), np.complex128)


def _steps(rng: np.random.Generator, v: float) -> tuple[Complex, Complex]:
    """Loads of up to 100 kW a phase (of low voltage 10) before and after; some have none."""
    kw = rng.uniform(0, 100 if v > 1000 else 10, (2, 3, 1)) * rng.integers(0, 2, (2, 3, 1))
    y = (kw * 1000 * (1 - 0.3j) / v**2).astype(np.complex128)
    return y[0], y[1]


def _fault(rng: np.random.Generator) -> Complex:
    """One phase, sometimes two or three, of 0.5 to 1000 ohm."""
    ohm = np.exp(rng.uniform(np.log(0.5), np.log(1000), (3, 1)))
    hit = rng.permutation(3)[:, None] < rng.choice([1, 2, 3], p=[0.7, 0.2, 0.1])
    return np.asarray(hit / ohm, dtype=np.complex128)


def dense_event(
    network: Network, event: Event, detached: Mapping[str, str], *, after: bool
) -> DenseEvent:
    """The state before or after ``event``, as the reference takes it.

    ``detached``: the reference's names of detached line ends, by those of the network.
    """
    shunts: list[Shunt] = []
    found = DenseEvent()
    edge, share = int(event.edge[0]), float(event.share[0])
    if edge >= 0:
        piece = network.pieces[edge]
        assert piece is not None
        along = share if network.upward[edge] else 1.0 - share
        fraction = piece.start + along * (piece.stop - piece.start)
        upper: Literal["p", "q"] = "p" if network.upward[edge] else "q"
        lower: Literal["p", "q"] = "q" if network.upward[edge] else "p"
        mask = int((event.open_after if after else event.open_before)[0])
        found = DenseEvent(
            open_line=piece.line,
            open_fraction=piece.stop if along == 1.0 else fraction,
            open_phases=tuple(k for k in range(3) if mask >> k & 1),
            before_tees=along == 1.0,
        )
        earth = event.earth_after_s if after else event.earth_before_s
        between = event.between_after_s if after else event.between_before_s
        for k in range(3):
            shunts.append(
                Shunt(
                    where=upper,
                    phase=k,
                    siemens=complex(earth[k, 0]),
                    exponent=float(event.exponent[0]),
                )
            )
            shunts.append(
                Shunt(where=upper, phase=k, other=(k + 1) % 3, siemens=complex(between[k, 0]))
            )
            if after:
                shunts.append(
                    Shunt(where=lower, phase=k, siemens=complex(event.fallen_after_s[k, 0]))
                )
    far = None
    if event.far_node[0] >= 0:
        node = network.nodes[int(event.far_node[0])]
        far = Place(bus=detached[node]) if node in detached else _place(node)
        y = event.far_after_s if after else event.far_before_s
        between = event.far_between_after_s if after else event.far_between_before_s
        for k in range(3):
            shunts.append(Shunt(where="far", phase=k, siemens=complex(y[k, 0])))
            shunts.append(
                Shunt(where="far", phase=k, other=(k + 1) % 3, siemens=complex(between[k, 0]))
            )
    found = replace(found, shunts=tuple(x for x in shunts if x.siemens), far=far)
    if not after:
        return found
    taps = {}
    for row, name in enumerate(network.regulators):
        factor = event.tap_factor[row, :, 0]
        factor = factor if network.ratio_upward[row] else 1.0 / factor
        taps[name] = (float(factor[0]), float(factor[1]), float(factor[2]))
    ders = {name: float(event.der_factor[n, 0]) for n, name in enumerate(network.machines.ders)}
    return replace(found, emf_scale=float(event.emf_factor[0]), taps=taps, ders=ders)


def _place(node: str) -> Place:
    """Bus or tee of a node's name."""
    if ":" not in node:
        return Place(bus=node)
    line, at = node.split(":")
    return Place(line=line, at=float(at))
