"""Which of the feeder's DER an event takes, and where they stand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..distributions import Distribution
from ..network import Network

__all__ = ["der_nodes", "draw_tripped", "some_der_nodes"]


def der_nodes(network: Network) -> NDArray[np.int64]:
    """(D,) the nodes on which the DER hang, by themselves or behind a transformer."""
    machines = network.machines
    units = machines.unit[machines.unit.size - len(machines.ders) :]  # motors come first
    return network.tree.unit_node[units]


def some_der_nodes(network: Network) -> NDArray[np.int64]:
    """``der_nodes``, of which there must be one at least: raises ValueError otherwise."""
    nodes = der_nodes(network)
    if nodes.size == 0:
        raise ValueError("DER events: the network has 0 DER, wanted at least 1")
    return nodes


def draw_tripped(
    rng: np.random.Generator, size: int, network: Network, share: Distribution
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(S,) the node of one DER that trips, and (D, S) which do.

    ``share`` of the DER trip, rounded to whole ones and one at least; any of them are as
    likely as any others. Raises ValueError for a network without DER.
    """
    nodes = some_der_nodes(network)
    wanted = np.maximum(np.rint(share.draw(rng, size) * nodes.size), 1.0)
    rank = rng.permuted(np.tile(np.arange(nodes.size)[:, None], (1, size)), axis=0)
    return nodes[np.argmin(rank, axis=0)], rank < wanted
