"""A peer: the nodal equations of all nodes, dense, many scenarios to one LAPACK call."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from problem import Complex, Problem, volts

__all__ = ["dense"]

CHUNK = 256
TO_EARTH_S = 1e-14  #: holds what a break leaves connected to nothing


def dense(problem: Problem) -> Callable[[], tuple[Complex, Complex]]:
    """Return what computes (B, 3, S) voltages before and after."""
    tree = problem.network.tree
    series = np.linalg.inv(tree.z_ohm[: tree.parent.size]).astype(np.complex128)
    opened = _opened(tree.z_ohm[: tree.parent.size]) - series[:, None]
    intact = _intact(series, tree.parent)

    def half(n: int) -> Complex:
        size = problem.sound.size
        out = np.empty((tree.parent.size, 3, size), np.complex128)
        for start in range(0, size, CHUNK):
            part = slice(start, min(start + CHUNK, size))
            out[..., part] = _solve(problem, n, part, intact, (series[0], opened))
        return out

    return lambda: (half(0), half(1))


def _opened(z_ohm: Complex) -> Complex:
    """(B, 8, 3, 3): the series admittance of every edge with the phases of a mask open."""
    out = np.zeros((z_ohm.shape[0], 8, 3, 3), np.complex128)
    for mask in range(7):
        closed = [phase for phase in range(3) if not mask & 1 << phase]
        grid = np.ix_(closed, closed)
        for k, z in enumerate(z_ohm):
            out[k, mask][grid] = np.linalg.inv(z[grid])
    return out


def _intact(series: Complex, parent: np.ndarray) -> Complex:
    """(3B, 3B): source and lines, no units."""
    count = parent.size
    out = np.zeros((count, 3, count, 3), np.complex128)
    for k, y in enumerate(series):
        out[k, :, k] += y
        if k:
            up = parent[k]
            out[up, :, up] += y
            out[up, :, k] -= y
            out[k, :, up] -= y
    square: Complex = out.reshape(3 * count, 3 * count)
    return square + TO_EARTH_S * np.eye(3 * count)


def _solve(
    problem: Problem, n: int, part: slice, intact: Complex, edges: tuple[Complex, Complex]
) -> Complex:
    tree = problem.network.tree
    state, shunts = problem.parts[n]
    shunt, emf, mask = shunts[..., part], state.emf_pu[part], state.open_mask[part]
    size, count = emf.size, tree.parent.size
    y = np.empty((size, *intact.shape), np.complex128)
    y[:] = intact
    blocks = y.reshape(size, count, 3, count, 3)
    for unit, node in enumerate(tree.unit_node):
        zero, other = shunt[unit]
        block = blocks[:, node, :, node]
        block += ((zero - other) / 3.0)[:, None, None]
        for i in range(3):
            block[:, i, i] += other
    if mask.any():
        edge, each = state.edge[part], np.arange(size)
        up, change = tree.parent[edge], edges[1][edge, mask]
        for a, b, sign in ((edge, edge, 1), (up, up, 1), (edge, up, -1), (up, edge, -1)):
            blocks[each, a, :, b] += sign * change
    right = np.zeros((size, 3 * count, 1), np.complex128)
    right[:, :3, 0] = emf[:, None] * (edges[0] @ volts(problem.network))
    v = np.linalg.solve(y, right).astype(np.complex128, copy=False)
    return v.reshape(size, count, 3).transpose(1, 2, 0)
