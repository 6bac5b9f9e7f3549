"""Nodes and places: which node is nearest to a place, and what hangs below it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..network import Network
from .base import Places, draw_place

__all__ = ["draw_node", "fed_through"]

Int = NDArray[np.int64]


def draw_node(
    rng: np.random.Generator, size: int, network: Network, regions: Sequence[Places]
) -> Int:
    """(S,) the nodes nearest to places drawn as for any other event."""
    edge, share = draw_place(rng, size, regions)
    tree = network.tree
    # chords, the last edges, are no node's own: they lead from tails to forks
    upper = np.append(tree.parent, tree.tail)[edge]
    lower = np.append(np.arange(tree.parent.size), tree.fork)[edge]
    return np.where(share < 0.5, upper, lower)


def fed_through(network: Network, edge: Int, nodes: Int) -> NDArray[np.bool_]:
    """(n, S) which of ``nodes`` (n,) have no supply but through the edges (S,).

    An edge of a closed loop is no node's only supply.
    """
    tree = network.tree
    # nodes are in depth-first order: those below an edge follow its own without a gap
    below = np.ones(tree.parent.size, np.int64)
    for k in range(below.size - 1, 0, -1):
        below[tree.parent[k]] += below[k]
    own = np.where((edge > 0) & (edge < below.size), edge, 0)
    only = (own > 0) & ~tree.in_loop[own]
    after = nodes[:, None] - own
    return np.asarray(only & (after >= 0) & (after < below[own]))
