"""Positive-sequence impedance of a section's path, and of what closes a loop around it.

Voltages and currents are true at their own bus, and so is what eq. (5) shows: a part at the
nominal voltage V_k counts as ``z V_m V_n / V_k**2``, where V_m and V_n are those of the path's
ends. That is the B parameter of the chain of two-ports, and the same from either end.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .buses import to_side_volts
from .line_matrices import z1_ohm
from .network import Network
from .parts import Feeder, InlineTransformer, Line, Regulator
from .sides import edge_nodes

__all__ = ["Impedances", "impedances_of", "path_z1_ohm", "rest_of_loop_z1_ohm"]

Flags = NDArray[np.bool_]
Complex = NDArray[np.complex128]

Joint = frozenset[str]
"""The two buses of a part that is no line."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Impedances:
    """What has impedance on a feeder, and the nominal voltage of every node."""

    feeder: Feeder
    lines: Mapping[str, Line]
    banks: Mapping[Joint, list[InlineTransformer]]
    regulators: Mapping[Joint, Regulator]
    v_nominal_v: Mapping[str, float]  #: phase to earth


def impedances_of(feeder: Feeder, network: Network) -> Impedances:
    """Of all parts of the feeder."""
    banks: defaultdict[Joint, list[InlineTransformer]] = defaultdict(list)
    for unit in feeder.inline_transformers:
        banks[frozenset((unit.from_bus, unit.to_bus))].append(unit)
    return Impedances(
        feeder=feeder,
        lines={line.name: line for line in feeder.lines},
        banks=banks,
        regulators={frozenset((r.from_bus, r.to_bus)): r for r in feeder.regulators},
        v_nominal_v=dict(zip(network.nodes, network.node_v.tolist(), strict=True)),
    )


def path_z1_ohm(
    own: Impedances, steps: Iterable[tuple[str | None, tuple[str, str]]], ends: tuple[str, str]
) -> complex:
    """Of a path between two buses: each step's line, if it is one, and the step's two nodes."""
    return sum((_referred(own, line, joint, ends) for line, joint in steps), start=0j)


def _referred(
    own: Impedances, line: str | None, joint: tuple[str, str], ends: tuple[str, str]
) -> complex:
    """A part's impedance as it counts between ``ends``; 0 of a switch."""
    pair = frozenset(joint)
    if line is not None:
        z, v = z1_ohm(own.feeder, own.lines[line]), own.v_nominal_v[joint[0]]
    elif pair in own.banks:
        z, v = _of_bank(own.banks[pair])
    elif pair in own.regulators:
        part = own.regulators[pair]
        z, v = part.z_ohm, own.v_nominal_v[part.from_bus]
    else:
        return 0j
    return z * (own.v_nominal_v[ends[0]] * own.v_nominal_v[ends[1]] / (v * v))


def _of_bank(units: Iterable[InlineTransformer]) -> tuple[complex, float]:
    """Leakage of transformers side by side at the to-side, and the voltage there.

    Single-phase ones make a bank of their ratings together.
    """
    units = list(units)
    v = to_side_volts(units[0])
    y = sum(u.rating_kva * 1000.0 / (u.leakage_pu * u.to_tap**2) for u in units)
    return 3.0 * v * v / y, v


def rest_of_loop_z1_ohm(
    own: Impedances, network: Network, on_path: Flags, ends: tuple[str, str]
) -> complex | None:
    """Of all that joins the two ends of a path beside it; None where nothing does.

    In one loop that is the rest of it. Where loops meet, it is what their lines have between
    the two ends together.
    """
    looped = np.append(network.tree.in_loop, np.ones(network.chords, np.bool_))
    edges = np.flatnonzero(looped & ~on_path)
    if not edges.size:
        return None
    nodes = np.stack(edge_nodes(network))[:, edges]
    z = np.array([_of_piece(own, network, int(k), ends) for k in edges], np.complex128)
    count = len(network.nodes)
    # what has no impedance joins its two nodes to one
    part = _parts(nodes[:, z == 0], count)
    m, n = (int(part[network.node(bus)]) for bus in ends)
    sides = _parts(nodes, count)
    if sides[network.node(ends[0])] != sides[network.node(ends[1])]:
        return None
    return 0j if m == n else _between(part[nodes[:, z != 0]], 1.0 / z[z != 0], m, n)


def _of_piece(own: Impedances, network: Network, edge: int, ends: tuple[str, str]) -> complex:
    piece = network.pieces[edge]
    assert piece is not None
    share = 1.0 if piece.line is None else piece.length_km / own.lines[piece.line].length_km
    return share * _referred(own, piece.line, piece.ends, ends)


def _parts(nodes: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """(count,) numbers of the parts that edges (2, n) join."""
    graph = coo_array((np.ones(nodes.shape[1], np.int8), nodes), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def _between(nodes: NDArray[np.int64], y: Complex, m: int, n: int) -> complex:
    """Impedance between nodes m and n of admittances ``y`` between ``nodes`` (2, edges)."""
    # only what hangs together with them
    part = _parts(nodes, int(nodes.max()) + 1)
    here = part[nodes[0]] == part[m]
    names, flat = np.unique(nodes[:, here], return_inverse=True)
    a, b = flat.reshape(2, -1)
    laplacian = np.zeros((names.size, names.size), np.complex128)
    for rows, columns, sign in ((a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)):
        np.add.at(laplacian, (rows, columns), sign * y[here])
    kept = names != n  # node n is the reference
    inward = (names == m)[kept].astype(np.complex128)
    v = np.linalg.solve(laplacian[kept][:, kept], inward)
    return complex(v @ inward)
