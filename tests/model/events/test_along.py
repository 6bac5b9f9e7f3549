"""Nodes and places, against searches of the graph."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest
from oracles.event_sites import LINES, Site

from openphase.model.events.along import draw_node, fed_through
from openphase.model.network import Network

N = 6000


def ends(network: Network) -> dict[int, tuple[str, str]]:
    """The nodes that every edge joins, by name."""
    return {k: piece.ends for k, piece in enumerate(network.pieces) if piece is not None}


@pytest.mark.parametrize("kind", ["site", "looped"])
def test_a_node_is_drawn_for_the_half_of_every_line_that_is_nearest_to_it(
    request: pytest.FixtureRequest, rng: np.random.Generator, kind: str
) -> None:
    own: Site = request.getfixturevalue(kind)
    network = own.network
    wanted: Counter[str] = Counter()
    for edge, pair in ends(network).items():
        piece = network.pieces[edge]
        if piece is not None and piece.line is not None:
            for end in pair:
                wanted[end] += (piece.stop - piece.start) / len(LINES) / 2.0
    drawn = Counter(network.nodes[k] for k in draw_node(rng, N, network, own.regions))
    assert set(drawn) <= set(wanted)
    assert sum(wanted.values()) == pytest.approx(1.0)
    for name, p in wanted.items():
        assert abs(drawn[name] / N - p) < 5.0 * math.sqrt(p * (1.0 - p) / N), name


@pytest.mark.parametrize("kind", ["site", "looped"])
def test_supply_is_lost_where_the_graph_without_the_edge_has_no_way_to_the_source(
    request: pytest.FixtureRequest, kind: str
) -> None:
    network: Network = request.getfixturevalue(kind).network
    edges = np.array([-1, *range(1, len(network.pieces))])
    found = fed_through(network, edges, np.arange(len(network.nodes)))
    assert found.any()
    for s, cut in enumerate(edges):
        left = [pair for edge, pair in ends(network).items() if edge != cut]
        reached = {"S"}
        while grown := {x for pair in left if reached & set(pair) for x in pair} - reached:
            reached |= grown
        assert found[:, s].tolist() == [name not in reached for name in network.nodes]
