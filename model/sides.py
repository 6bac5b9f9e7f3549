"""How everything on a feeder lies to a section: inside, upstream, downstream, on another branch."""

from __future__ import annotations

from collections.abc import Collection
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from .network import Network, compile_network
from .parts import Feeder

__all__ = ["Side", "sides_of"]

Flags = NDArray[np.bool_]
Sides = NDArray[np.int8]


class Side(IntEnum):
    """How a place lies to a section, in the state that the network is in."""

    PATH = 0  #: between the two points
    LATERAL = 1  #: on a lateral that tees off that path
    UPSTREAM = 2  #: on the way to it, or on what else hangs there
    DOWNSTREAM = 3  #: fed through it
    OTHER = 4  #: on another branch from the source bus
    NOWHERE = 5  #: an event that stands on no edge


def sides_of(
    feeder: Feeder,
    network: Network,
    on_path: Flags,
    in_section: Flags,
    ends: Collection[str],
) -> tuple[Sides, Sides]:
    """The Side of every edge and of every node.

    In a closed loop, which feeds a section from both sides, it is that of the normal state.

    Parameters
    ----------
    feeder, network : Feeder, Network
    on_path, in_section : (edges,) arrays
        The section's path, and with its laterals.
    ends : collection of str
        Buses at which the section's own points stand on its side: they lie outside.
    """
    if network.chords:
        return _as_in_normal_state(feeder, network, on_path, in_section, ends)
    ways = _ways(network)
    inside = {p.line for k, p in enumerate(network.pieces) if p and on_path[k]}
    before = [ways[network.tree.parent[k]] for k in np.flatnonzero(on_path) if k]
    nearest = min(before, key=len, default=[])
    branch = [name for name in nearest if name not in inside][:1]
    edges = np.full(on_path.size, Side.UPSTREAM, np.int8)
    for k, way in enumerate(ways):
        if on_path[k]:
            edges[k] = Side.PATH
        elif in_section[k]:
            edges[k] = Side.LATERAL
        elif inside & set(way):
            edges[k] = Side.DOWNSTREAM
        elif way and way[:1] != branch:
            edges[k] = Side.OTHER
    return edges, _of_nodes(network, edges, in_section, ends, inside, ways)


def _of_nodes(
    network: Network,
    edges: Sides,
    in_section: Flags,
    ends: Collection[str],
    inside: set[str | None],
    ways: list[list[str]],
) -> Sides:
    """A node's own side: that of the edge above it, but for the borders of the section."""
    touched = {
        name
        for k, piece in enumerate(network.pieces)
        if piece is not None and in_section[k]
        for name in piece.ends
    }
    nodes = edges[: len(network.nodes)].copy()
    for k, name in enumerate(network.nodes):
        if name in ends or (in_section[k] and name not in touched):
            nodes[k] = Side.DOWNSTREAM if inside & set(ways[k]) else Side.UPSTREAM
        elif name in touched:
            nodes[k] = Side.LATERAL
    return nodes


def _ways(network: Network) -> list[list[str]]:
    """Per edge of a radial network the lines from the source to its lower end."""
    ways: list[list[str]] = []
    for k, piece in enumerate(network.pieces):
        above = ways[network.tree.parent[k]] if k else []
        line = piece.line if piece is not None else None
        ways.append(above if line is None or above[-1:] == [line] else [*above, line])
    return ways


def _as_in_normal_state(
    feeder: Feeder,
    network: Network,
    on_path: Flags,
    in_section: Flags,
    ends: Collection[str],
) -> tuple[Sides, Sides]:
    """The sides of the normal state; what it lacks, a closed tie, is upstream."""
    normal = compile_network(feeder)
    here = {piece.key: k for k, piece in enumerate(network.pieces) if piece is not None}
    place = [here.get(piece.key, -1) if piece is not None else 0 for piece in normal.pieces]
    there = np.array([k >= 0 for k in place])
    edges, nodes = sides_of(feeder, normal, there & on_path[place], there & in_section[place], ends)
    found = np.full(on_path.size, Side.UPSTREAM, np.int8)
    found[np.array(place)[there]] = edges[there]
    by_name = dict(zip(normal.nodes, nodes, strict=True))
    return found, np.array([by_name.get(name, Side.UPSTREAM) for name in network.nodes], np.int8)
