"""The edges of a compiled network: their matrices, what stands in them, the loops they close."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .inline import TwoPort, regulator_impedance, two_port
from .parts import Feeder
from .pieces import NO_PHASES, Piece, Span
from .units import regulator_rows

__all__ = ["Edges", "hang_edges"]

Complex = NDArray[np.complex128]
Int = NDArray[np.int64]

ALL = 0b111
PHASE_OF = {0b001: 0, 0b010: 1, 0b100: 2}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Edges:
    """What `Tree` says of edges, and what else comes of them."""

    fields: dict[str, Any]  #: of `Tree`
    upward: NDArray[np.bool_]  #: (edges,) the edge's upper end is the piece's first end
    shunt_s: Complex  #: (B, 3, 3) charging and open windings, on the nodes


def hang_edges(feeder: Feeder, pieces: list[Piece | None], spanned: Span, touched: Int) -> Edges:
    """Edge k of the tree ends at node k; the chords follow.

    ``touched`` (B,) are the phases of each node that something hangs on.
    """
    count, chords = len(spanned.order), len(spanned.chords)
    upper, lower, upward = _ends(pieces, spanned)
    parent = upper[:count]
    carried = _chains(parent, lower[count:], upper[count:])
    in_loop = carried.any(axis=1)
    node_phases = _all_touched(pieces, upper, lower, upward, touched)
    end_y = np.array([NO_PHASES if p is None else p.end_y_s for p in pieces])
    z = np.array([NO_PHASES if p is None else p.z_ohm for p in pieces])
    regulator = regulator_rows(feeder, pieces)
    ports = _ports(pieces, upward)
    for k, port in ports.items():
        z[k] = port.z_ohm
    for k in np.flatnonzero(regulator >= 0).tolist():
        z[k] = regulator_impedance(feeder.regulators[regulator[k]], bool(upward[k]))
    shunt = np.zeros((count, 3, 3), np.complex128)
    np.add.at(shunt, upper[1:], end_y[1:])
    np.add.at(shunt, lower[1:], end_y[1:])
    for k, port in ports.items():
        # a chord is met from its tail, which `upper` names last
        shunt[upper[k] if k < count else lower[k]] += port.shunt_s
    loose_from, loose = _loose(pieces[:count], ports, upward, node_phases)
    transformer = np.full(len(pieces), -1, np.int64)
    transformer[list(ports)] = np.arange(len(ports))
    phases = np.array([ALL if p is None else p.phases[0] & p.phases[1] for p in pieces], np.int64)
    turned = (regulator >= 0) | (transformer >= 0)
    plain = ~turned[:count] & ~in_loop & (np.diff(loose_from) == 0)
    lone = [
        PHASE_OF.get(int(phases[k]), -1) if plain[k] and phases[k] == node_phases[k] else -1
        for k in range(count)
    ]
    chord_edges = range(count, len(pieces))
    return Edges(
        fields={
            "parent": parent,
            "z_ohm": z,
            "phases": phases,
            "node_phases": node_phases,
            "lone_phase": np.array(lone, np.int64),
            "end_y_s": end_y,
            "charged": bool(end_y.any()),
            "regulator": regulator,
            "transformer": transformer,
            "turn": np.array([p.turn for p in ports.values()], np.complex128).reshape(-1, 3, 3),
            "loose_from": loose_from,
            "loose": loose,
            "carried": carried,
            "in_loop": in_loop,
            "fork": upper[count:],
            "tail": lower[count:],
            "chord_y_s": np.array(
                [_chord_admittance(pieces[k], z[k], bool(upward[k])) for k in chord_edges], z.dtype
            ).reshape(-1, 3, 3),
            "passed": np.full(count, -1, np.int64),
            "leap": np.full(count, -1, np.int64),
            "twigs": 0,
            "leap_from": np.zeros(0, np.int64),
            "leap_chain": np.zeros((0, 3, 3, 3), z.dtype),
            "region_from": np.zeros(1, np.int64),
            "region_node": np.zeros(0, np.int64),
            "alone": np.eye(chords, dtype=np.bool_),
        },
        upward=upward,
        shunt_s=shunt,
    )


def _ends(pieces: list[Piece | None], spanned: Span) -> tuple[Int, Int, NDArray[np.bool_]]:
    """Upper and lower node of every edge, and whether its piece leads downwards.

    A tree edge leads down to its own node; a chord's current is counted from its tail, the
    lower node, so that it leads upwards from there.
    """
    index = {name: k for k, name in enumerate(spanned.order)}
    count = len(index)
    upper, lower = np.full(len(pieces), -1, np.int64), np.zeros(len(pieces), np.int64)
    upward = np.ones(len(pieces), np.bool_)
    for k, piece in enumerate(pieces):
        if piece is None:
            continue
        first, second = (index[name] for name in piece.ends)
        if k < count:
            upward[k] = second == k
            upper[k], lower[k] = (first, second) if upward[k] else (second, first)
        else:
            upper[k], lower[k] = index[spanned.forks[k - count]], index[spanned.tails[k - count]]
            upward[k] = first == lower[k]
    return upper, lower, upward


def _chains(parent: Int, tail: Int, fork: Int) -> NDArray[np.bool_]:
    """(B, C) the nodes from each chord's tail up to its fork, which is none of them."""
    carried = np.zeros((parent.size, tail.size), np.bool_)
    for c in range(tail.size):
        k = int(tail[c])
        while k != int(fork[c]):
            carried[k, c] = True
            k = int(parent[k])
    return carried


def _all_touched(
    pieces: list[Piece | None], upper: Int, lower: Int, upward: NDArray[np.bool_], touched: Int
) -> Int:
    """(B,) the phases of each node that a conductor or anything else touches."""
    phases = touched.copy()
    phases[0] = ALL
    for k, piece in enumerate(pieces):
        if piece is not None:
            above, below = piece.phases if upward[k] == (k < touched.size) else piece.phases[::-1]
            phases[upper[k]] |= above
            phases[lower[k]] |= below
    return phases


def _ports(pieces: list[Piece | None], upward: NDArray[np.bool_]) -> dict[int, TwoPort]:
    """The two-port of every edge that is a bank of in-line transformers."""
    return {
        k: two_port(piece.bank_s, bool(upward[k]), f"in-line transformer '{piece.bank}'")
        for k, piece in enumerate(pieces)
        if piece is not None and piece.bank_s is not None
    }


def _loose(
    pieces: list[Piece | None],
    ports: dict[int, TwoPort],
    upward: NDArray[np.bool_],
    node_phases: Int,
) -> tuple[Int, NDArray[np.float64]]:
    """The modes that each edge leaves loose at its lower end.

    Where it does not bring a phase that exists there, that is fed by a loop, or dead.
    """
    start = [0]
    modes: list[NDArray[np.float64]] = []
    for k, piece in enumerate(pieces):
        if piece is not None:
            above, below = piece.phases if upward[k] else piece.phases[::-1]
            brought = below if k in ports else above
            missing = int(node_phases[k]) & ~brought
            if k in ports:
                modes += list(ports[k].modes)
            modes += [np.eye(3)[i] for i in range(3) if missing & (1 << i)]
        start.append(len(modes))
    return np.array(start, np.int64), np.array(modes, np.float64).reshape(-1, 3)


def _chord_admittance(piece: Piece | None, z: Complex, upward: bool) -> Complex:
    """(3, 3) of a chord seen from its fork, its other end at zero volts."""
    if piece is not None and piece.bank_s is not None:
        far = slice(3, 6) if upward else slice(0, 3)
        return piece.bank_s[far, far]
    there = np.flatnonzero(np.abs(z).max(axis=1) > 0.0)
    y = np.zeros((3, 3), np.complex128)
    y[np.ix_(there, there)] = np.linalg.inv(z[np.ix_(there, there)])
    return y
