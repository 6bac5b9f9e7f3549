"""How everything on a feeder lies to a section: inside, upstream, downstream, on another branch."""

from __future__ import annotations

from collections.abc import Collection
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .network import Network

__all__ = ["Side", "edge_nodes", "joined", "sides_of"]

Flags = NDArray[np.bool_]
Sides = NDArray[np.int8]
Int = NDArray[np.int64]


class Side(IntEnum):
    """How a place lies to a section, in the state that the network is in."""

    PATH = 0  #: between the two points
    LATERAL = 1  #: on a lateral that tees off that path
    UPSTREAM = 2  #: on the way to it, or on what else hangs there
    DOWNSTREAM = 3  #: fed through it
    OTHER = 4  #: on another branch from the source bus
    NOWHERE = 5  #: an event that stands on no edge


def edge_nodes(network: Network) -> tuple[Int, Int]:
    """(edges,) upper and lower node of every edge; the source's has the source bus for both."""
    tree = network.tree
    upper = np.append(tree.parent, tree.tail)
    upper[0] = 0
    return upper, np.append(np.arange(tree.parent.size), tree.fork)


def joined(network: Network, kept: Flags) -> Int:
    """(nodes,) numbers of the parts that fall apart with the edges ``kept`` (edges,) alone."""
    upper, lower = (ends[kept] for ends in edge_nodes(network))
    count = len(network.nodes)
    graph = coo_array((np.ones(upper.size, np.int8), (upper, lower)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def sides_of(
    network: Network,
    on_path: Flags,
    in_section: Flags,
    ends: Collection[str],
    normal: Network | None = None,
) -> tuple[Sides, Sides]:
    """The Side of every edge and of every node.

    What the source reaches without the section's path is upstream, or on another branch, and
    what it does not is downstream. Branches are what falls apart without the buses that no
    line parts from the source. A loop that is closed in this state alone feeds a section from
    both sides; there it is the side of the normal state.

    Parameters
    ----------
    network : Network
    on_path, in_section : (edges,) arrays
        The section's path, and with its laterals.
    ends : collection of str
        Buses at which the section's own points stand on its side: they lie outside.
    normal : Network, optional
        The feeder's normal state; by default ``network`` itself.
    """
    if normal is not None and network.chords and not _alike(network, normal):
        return _as_in_normal_state(network, normal, on_path, in_section, ends)
    upper, lower = edge_nodes(network)
    fed = joined(network, ~on_path)
    reached = fed == fed[0]
    branch = _branches(network)
    of_edge = np.maximum(branch[upper], branch[lower])
    own = np.unique(of_edge[on_path & (of_edge >= 0)])
    # a line from one head bus to another is a branch by itself
    elsewhere = np.where(of_edge >= 0, ~np.isin(of_edge, own), network.length_km > 0)
    edges = np.full(on_path.size, Side.UPSTREAM, np.int8)
    edges[elsewhere] = Side.OTHER
    edges[~reached[lower]] = Side.DOWNSTREAM
    edges[in_section] = Side.LATERAL
    edges[on_path] = Side.PATH
    nodes = edges[: len(network.nodes)].copy()
    nodes[np.concatenate([upper[in_section], lower[in_section]])] = Side.LATERAL
    outer = [network.node(name) for name in ends]
    nodes[outer] = np.where(reached[outer], Side.UPSTREAM, Side.DOWNSTREAM)
    return edges, nodes


def _branches(network: Network) -> Int:
    """(nodes,) the branch of each node; -1 where no line parts it from the source."""
    upper, lower = edge_nodes(network)
    plain = joined(network, network.length_km == 0)
    head = plain == plain[0]
    return np.where(head, -1, joined(network, ~head[upper] & ~head[lower]))


def _alike(network: Network, normal: Network) -> bool:
    return {p.key for p in network.pieces if p} == {p.key for p in normal.pieces if p}


def _as_in_normal_state(
    network: Network,
    normal: Network,
    on_path: Flags,
    in_section: Flags,
    ends: Collection[str],
) -> tuple[Sides, Sides]:
    """The sides of the normal state; what it lacks, a closed tie, is upstream."""
    here = {piece.key: k for k, piece in enumerate(network.pieces) if piece is not None}
    place = [here.get(piece.key, -1) if piece is not None else 0 for piece in normal.pieces]
    there = np.array([k >= 0 for k in place])
    edges, nodes = sides_of(normal, there & on_path[place], there & in_section[place], ends)
    found = np.full(on_path.size, Side.UPSTREAM, np.int8)
    found[np.array(place)[there]] = edges[there]
    by_name = dict(zip(normal.nodes, nodes, strict=True))
    return found, np.array([by_name.get(name, Side.UPSTREAM) for name in network.nodes], np.int8)
