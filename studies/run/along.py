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
    # closed switches have no length, and lie on the way
    switches = [p is not None and p.line is None for p in network.pieces]
    here = {network.nodes[case.points.node[point]]}
    left = {int(k) for k in np.flatnonzero(on_path | switches)}
    at = 0.0
    while met := sorted((not switches[k], k) for k in left if here & set(ends[k])):
        _, k = met[0]
        left.remove(k)
        starts[k], toward[k] = at, ends[k][0] in here
        if switches[k]:
            here |= set(ends[k])
        else:
            at += network.length_km[k]
            here = {ends[k][1] if toward[k] else ends[k][0]}
    return starts, toward
