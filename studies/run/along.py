"""Distances along a section, from its local point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .draw import Case
from .engine import Observed

__all__ = ["distance_share", "path_starts"]


def distance_share(
    case: Case, point: int, on_path: NDArray[np.bool_], seen: Observed, chosen: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Distance of the chosen events from a point at the end of a path, as a share of the path."""
    starts, toward = path_starts(case, point, on_path)
    edge, share = seen.edge[chosen], seen.share[chosen]
    from_near = np.where(toward[edge], share, 1.0 - share)
    total = case.network.length_km[on_path].sum()
    return np.asarray((starts[edge] + from_near * case.network.length_km[edge]) / total)


def path_starts(
    case: Case, point: int, on_path: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Per edge of a path: km from the point to its nearer end; whether that is the upper end."""
    network = case.network
    ends = [
        (p.ends if network.upward[k] else p.ends[::-1]) if p is not None else ("", "")
        for k, p in enumerate(network.pieces)
    ]
    starts, toward = np.zeros(len(ends)), np.ones(len(ends), np.bool_)
    here = network.nodes[case.points.node[point]]
    left = set(np.flatnonzero(on_path).tolist())
    at = 0.0
    while left:
        k = next(k for k in left if here in ends[k])
        left.remove(k)
        starts[k], toward[k] = at, ends[k][0] == here
        at += network.length_km[k]
        here = ends[k][1] if toward[k] else ends[k][0]
    return starts, toward
