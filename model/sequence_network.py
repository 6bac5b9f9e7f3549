"""A broken conductor by sequence networks: the second way to the same phasors.

For balanced linear radial feeders the three sequences are separate scalar networks that
meet only at the break, where ``closed_form`` joins them. Nothing here is shared with the
three-phase ladder beyond the feeder's parts, so that each can be held against the other.

Arrays are (nodes, sequences), sequences in the order 0, 1, 2; the frame is that of phase a.
Node k hangs on ``parent[k]`` by the series impedance ``z_ohm[k]``, parents first. The
break stands on an edge without impedance from its upper stub ``p`` to the lower one ``q``.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import count, pairwise

import numpy as np
from numpy.typing import NDArray

from .closed_form import break_current, break_voltage, frame_turn
from .parts import Feeder, Load, Place, Transformer

__all__ = ["Flow", "SequenceNetwork", "after", "before", "loops", "sequence_network", "two_port"]

Complex = NDArray[np.complex128]
Int = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SequenceNetwork:
    """A radial feeder of N nodes in three sequences, with the place of its break."""

    nodes: tuple[str, ...]  #: buses, tees as LINE@FRACTION, stubs LINE.p and LINE.q
    parent: Int  #: (N,); -1 for the source bus, whose edge is the source impedance
    z_ohm: Complex  #: (N, 3) of the edge above
    y_s: Complex  #: (N, 3) what stands at the node itself
    emf_v: float
    q: int  #: the lower stub; the upper one is its parent


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flow:
    """Phasors of every node and edge."""

    v: Complex  #: (N, 3) volts to earth
    i: Complex  #: (N, 3) amperes down the edge above the node


def sequence_network(feeder: Feeder, broken: Place) -> SequenceNetwork:
    """Sequence networks of ``feeder`` with a break at a place on a line.

    Raises
    ------
    ValueError
        Where a load is not a constant impedance, the feeder is not radial, the break
        stands on no line, a Yg/Δ unit has no leakage, or the feeder has something that these
        networks leave out: charging, magnetizing branches, motors, DER, capacitors, regulators,
        an isolated neutral, an unknown connection.
    """
    _refuse_beyond(feeder)
    if broken.line is None or broken.at is None:
        raise ValueError("the break must stand on a line")
    shunts = _shunts(feeder)
    reach = _edges(feeder, broken, set(shunts))
    nodes, parent, z = [feeder.source.bus], [-1], [_source_ohm(feeder)]
    taken: set[int] = set()
    for name in nodes:  # grows while it is walked
        for n, far, z_ohm in reach[name]:
            if n in taken:
                continue
            taken.add(n)
            if far in nodes:
                raise ValueError(f"{feeder.name}: not radial at '{far}'")
            nodes.append(far)
            parent.append(nodes.index(name))
            z.append(z_ohm)
    p, q = sorted(nodes.index(f"{broken.line}.{end}") for end in "pq")
    nodes[p], nodes[q] = f"{broken.line}.p", f"{broken.line}.q"
    none = np.zeros(3, np.complex128)
    return SequenceNetwork(
        nodes=tuple(nodes),
        parent=np.array(parent),
        z_ohm=np.array(z),
        y_s=np.array([shunts.get(name, none) for name in nodes]),
        emf_v=feeder.source.emf_pu * feeder.source.v_phase_v,
        q=q,
    )


def _refuse_beyond(feeder: Feeder) -> None:
    """Name what the sequence networks cannot represent."""
    beyond = {
        "charging": any(line.c1_nf_per_km or line.c0_nf_per_km for line in feeder.lines),
        "magnetizing branches": any(unit.xm_pu is not None for unit in feeder.transformers),
        "unknown connections": any(unit.connection == "unknown" for unit in feeder.transformers),
        "motors": any(load.motor_share for load in feeder.loads),
        "DER": bool(feeder.ders),
        "capacitors": bool(feeder.capacitors),
        "regulators": bool(feeder.regulators),
        "an isolated neutral": feeder.source.neutral == "isolated",
    }
    found = [what for what, there in beyond.items() if there]
    if found:
        raise ValueError(f"{feeder.name}: sequence networks leave out {', '.join(found)}")


def _source_ohm(feeder: Feeder) -> Complex:
    source = feeder.source
    z0_ohm = source.z0_ohm + 3.0 * source.neutral_ohm
    return np.array([z0_ohm, source.z1_ohm, source.z2_ohm])


def _node(feeder: Feeder, place: Place) -> str:
    if place.bus is not None:
        return place.bus
    line = next(line for line in feeder.lines if line.name == place.line)
    ends = {0.0: line.from_bus, 1.0: line.to_bus}
    return ends.get(float(place.at or 0.0), f"{line.name}@{place.at}")


def _edges(
    feeder: Feeder, broken: Place, tees: set[str]
) -> defaultdict[str, list[tuple[int, str, Complex]]]:
    """Of every node: number, far node and impedance of what leaves it."""
    reach: defaultdict[str, list[tuple[int, str, Complex]]] = defaultdict(list)
    numbers = count()

    def join(one: str, other: str, z_ohm: Complex) -> None:
        number = next(numbers)
        reach[one].append((number, other, z_ohm))
        reach[other].append((number, one, z_ohm))

    for line in feeder.lines:
        whole = line.length_km * np.array(
            [line.z0_ohm_per_km, line.z1_ohm_per_km, line.z1_ohm_per_km]
        )
        stops = [(0.0, line.from_bus)]
        cuts = [name.rpartition("@") for name in tees]
        stops += [(float(at), f"{name}@{at}") for name, _, at in cuts if name == line.name]
        if line.name == broken.line:
            assert broken.at is not None
            stops += [(broken.at, f"{line.name}.p"), (broken.at, f"{line.name}.q")]
        stops.sort(key=lambda stop: stop[0])  # stable: a tee at the break's place comes first
        stops.append((1.0, line.to_bus))
        for (start, one), (stop, other) in pairwise(stops):
            join(one, other, np.asarray((stop - start) * whole, np.complex128))
    for switch in feeder.switches:
        if switch.closed:
            join(switch.from_bus, switch.to_bus, np.zeros(3, np.complex128))
    return reach


def _shunts(feeder: Feeder) -> dict[str, Complex]:
    """(3,) admittance of everything that stands at a node, by node."""
    found: defaultdict[str, Complex] = defaultdict(lambda: np.zeros(3, np.complex128))
    for unit in feeder.transformers:
        own = [load for load in feeder.loads if load.transformer == unit.name]
        y = sum((_admittance(feeder, load) for load in own), start=0j)
        kv = feeder.source.kv_ll
        base_ohm = 1000.0 * kv**2 / unit.rating_kva
        found[_node(feeder, unit.place)] += transformer_admittance(unit, base_ohm, y)
    for load in feeder.loads:
        if load.place is not None:
            y = _admittance(feeder, load)
            earthed = 1.0 if load.connection == "wye" else 0.0
            found[_node(feeder, load.place)] += y * np.array([earthed, 1.0, 1.0])
    return dict(found)


def _admittance(feeder: Feeder, load: Load) -> complex:
    """Positive-sequence admittance of a load: (P - jQ) / V²."""
    if load.exponent != 2.0:
        raise ValueError(f"load '{load.name}': only constant impedance is linear")
    kva = load.kw / abs(load.power_factor)
    angle = np.arccos(abs(load.power_factor)) * np.sign(load.power_factor)
    return complex(kva * np.exp(-1j * angle) / (1000.0 * feeder.source.kv_ll**2))


def transformer_admittance(unit: Transformer, base_ohm: float, y_s: complex) -> Complex:
    """(3,) what a unit with the balanced load ``y_s`` behind it is to the feeder.

    Notes
    -----
    Sequences 1 and 2 see the leakage and the load whatever the connection: a Δ winding
    turns them by ±30° and back. The zero sequence sees

    * Yg/Yg: half the leakage, and behind it the magnetizing branch beside the other half
      with the load;
    * Δ/Yg, Y/Δ and Δ/Δ: nothing, its current has no way back from a Δ or a Y;
    * Yg/Δ: the leakage alone, the closed Δ being a short circuit to it.
    """
    z = unit.leakage_pu * base_ohm
    series = y_s / (1.0 + z * y_s)
    if unit.connection in ("D/Yg", "Y/D", "D/D"):
        zero = 0j
    elif unit.connection == "Yg/D":
        if z == 0:
            raise ValueError(f"transformer '{unit.name}': a Yg/D unit needs leakage")
        zero = 1.0 / z
    else:
        middle = y_s / (1.0 + z / 2.0 * y_s)
        if unit.x0_pu is not None:
            middle += 1.0 / (1j * unit.x0_pu * base_ohm)
        zero = middle / (1.0 + z / 2.0 * middle)
    return np.array([zero, series, series])


def _below(network: SequenceNetwork) -> Complex:
    """(N, 3) admittance of each node and all that hangs below it."""
    y = network.y_s.copy()
    for k in range(len(network.nodes) - 1, 0, -1):
        y[network.parent[k]] += y[k] / (1.0 + network.z_ohm[k] * y[k])
    return y


def _path(network: SequenceNetwork, node: int) -> list[int]:
    """Nodes from ``node`` up to the source bus, both included."""
    found = [node]
    while network.parent[found[-1]] >= 0:
        found.append(int(network.parent[found[-1]]))
    return found


def loops(network: SequenceNetwork) -> tuple[Complex, Complex]:
    """(3,) impedances seen from the break: up from p, and down from q.

    Their sum is the loop impedance. What no sequence current can pass is infinite.
    """
    below = _below(network)
    z_up = network.z_ohm[0]
    path = _path(network, network.q)[::-1]
    for k, child in pairwise(path):
        beside = below[k] - below[child] / (1.0 + network.z_ohm[child] * below[child])
        z_up = z_up / (1.0 + z_up * beside) + network.z_ohm[child]
    y_down = below[network.q]
    empty = y_down == 0
    z_down = np.where(empty, np.inf, 1.0 / np.where(empty, 1.0, y_down))
    return z_up, z_down


def _descend(network: SequenceNetwork, below: Complex, v: Complex, i: Complex, start: int) -> None:
    """Fill in ``v`` and ``i`` of every node after ``start`` that has none yet."""
    for k in range(start, len(network.nodes)):
        if np.isnan(v[k]).any():
            v[k] = v[network.parent[k]] / (1.0 + network.z_ohm[k] * below[k])
            i[k] = below[k] * v[k]


def before(network: SequenceNetwork) -> Flow:
    """Phasors of the whole feeder."""
    below = _below(network)
    shape = below.shape
    v, i = np.full(shape, np.nan, np.complex128), np.zeros(shape, np.complex128)
    emf = np.array([0.0, network.emf_v, 0.0])
    v[0] = emf / (1.0 + network.z_ohm[0] * below[0])
    i[0] = below[0] * v[0]
    _descend(network, below, v, i, 1)
    return Flow(v=v, i=i)


def after(network: SequenceNetwork, phases_open: int, phase: int = 0) -> Flow:
    """Phasors with one, two or three phases open at the break.

    ``phase`` is the odd one: open of one, whole of two. The break must have load below it.

    Notes
    -----
    The change alone, without the EMF: ΔI flows down through the break, so the upper stub
    moves by -Z_up ΔI and the lower one, besides, by -V_pq. Above the break each node's
    current is that of the edge below plus what all else there draws at the changed voltage.
    """
    first = before(network)
    below = _below(network)
    z0, z1, z2 = np.add(*loops(network))
    if not np.isfinite(z1):
        raise ValueError(f"no load below the break at '{network.nodes[network.q]}'")
    current = first.i[network.q, 1]
    di = break_current(phases_open, current, z1, z2, z0, phase)
    v_pq = break_voltage(phases_open, current, z1, z2, z0) * frame_turn(phase)
    dv = np.full_like(first.v, np.nan)
    change = np.zeros_like(first.i)
    path = _path(network, network.q)
    change[path[0]] = di
    dv[path[1]] = -loops(network)[0] * di
    dv[path[0]] = dv[path[1]] - v_pq
    for child, k in pairwise(path):
        if child != path[0]:
            dv[k] = dv[child] + network.z_ohm[child] * change[child]
        beside = below[k] - below[child] / (1.0 + network.z_ohm[child] * below[child])
        change[k] = change[child] + beside * dv[k]
    _descend(network, below, dv, change, 0)
    return Flow(v=first.v + dv, i=first.i + change)


def two_port(network: SequenceNetwork, upper: str, lower: str) -> Complex:
    """(2, 2, 3) constants A, B, C, D of the path between two nodes, by sequence.

    V_upper = A V_lower + B I_lower and I_upper = C V_lower + D I_lower, both currents
    downwards. What stands at the two ends is left out; what is tapped between them is not.
    """
    below = _below(network)
    path = _path(network, network.nodes.index(lower))
    path = path[: path.index(network.nodes.index(upper)) + 1]
    one, none = np.ones(3, np.complex128), np.zeros(3, np.complex128)
    total = np.array([[one, none], [none, one]])
    for child, k in pairwise(path):
        series = np.array([[one, network.z_ohm[child]], [none, one]])
        total = np.einsum("ijs,jks->iks", series, total)
        if k != path[-1]:
            beside = below[k] - below[child] / (1.0 + network.z_ohm[child] * below[child])
            shunt = np.array([[one, none], [beside, one]])
            total = np.einsum("ijs,jks->iks", shunt, total)
    return total
