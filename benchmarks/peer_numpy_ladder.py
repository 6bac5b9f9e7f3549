"""A peer: the product's ladder in numpy, the scenario axis last, for a radial feeder.

The honest alternative to a compiled kernel. Buffers are made once; scenarios are sorted by
the edge that breaks, so that a block's breaks on an edge are a slice.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from problem import Complex, Problem, shunts_of, volts

from openphase.model.states import State

__all__ = ["numpy_ladder"]

CHUNK = 2048
SINGULAR = 1e-9  #: a driving-point admittance below this share of max|W| is a dead conductor


class Buffers:
    """Scratch of one block of S scenarios on B nodes."""

    def __init__(self, nodes: int, size: int) -> None:
        def empty(*shape: int) -> Complex:
            return np.empty((*shape, size), np.complex128)

        self.y, self.f, self.w = empty(nodes, 3, 3), empty(nodes, 3, 3), empty(nodes, 3, 3)
        self.v, self.low, self.p = empty(nodes, 3), empty(3, 3), empty(3, 3)
        self.a, self.b, self.c, self.one, self.two = (empty(3, 3) for _ in range(5))


def numpy_ladder(problem: Problem) -> Callable[[], tuple[Complex, Complex]]:
    """Return what computes (B, 3, S) voltages before and after."""
    tree, size = problem.network.tree, problem.sound.size
    nodes = tree.parent.size
    out = np.empty((2, nodes, 3, size), np.complex128)
    buffers = {n: Buffers(nodes, n) for n in {min(CHUNK, size), size % CHUNK} - {0}}

    def run() -> tuple[Complex, Complex]:
        for start in range(0, size, CHUNK):
            part = slice(start, min(start + CHUNK, size))
            own = buffers[part.stop - start]
            for n in range(2):
                _block(problem, n, part, own)
                out[n, ..., part] = own.v
        return out[0], out[1]

    return run


def _block(problem: Problem, n: int, part: slice, own: Buffers) -> None:
    tree = problem.network.tree
    state = problem.parts[n][0]
    _admittances(tree.unit_node, shunts_of(problem.network, state.load_scale[:, part]), own)
    edge = np.where(state.open_mask[part] != 0, state.edge[part], -1)
    broken = [
        slice(*np.searchsorted(edge, (k, k + 1))) if (edge == k).any() else None
        for k in range(tree.parent.size)
    ]
    for k in range(tree.parent.size - 1, -1, -1):
        _up(own, tree.z_ohm[k, ..., None], own.y[k], own.f[k], own.w[k])
        here = broken[k]
        if here is not None:
            _break(own, k, here, tree.z_ohm[k, ..., None], state, part)
        if k:
            own.y[tree.parent[k]] += own.w[k]
    above = volts(problem.network)[:, None] * state.emf_pu[part]
    for k in range(tree.parent.size):
        _times(own.f[k], own.v[tree.parent[k]] if k else above, own.v[k], own.a[0, 0])


def _admittances(unit_node: np.ndarray, shunt: Complex, own: Buffers) -> None:
    own.y[:] = 0.0
    for unit, node in enumerate(unit_node):
        zero, other = shunt[unit]
        own.y[node] += (zero - other) / 3.0
        for i in range(3):
            own.y[node, i, i] += other


def _up(own: Buffers, z: Complex, y: Complex, f: Complex, w: Complex) -> None:
    """F = (I + Z Y)^-1 and W = Y F into ``f`` and ``w``."""
    span = slice(0, y.shape[-1])
    m, t = own.a[..., span], own.one[0, 0, span]
    _product(z, y, m, t)
    for i in range(3):
        m[i, i] += 1.0
    _inverse(m, f, t, own.two[0, 0, span])
    _product(y, f, w, t)


def _product(a: Complex, b: Complex, out: Complex, t: Complex) -> None:
    for i in range(3):
        for k in range(3):
            np.multiply(a[i, 0], b[0, k], out=out[i, k])
            for j in (1, 2):
                np.multiply(a[i, j], b[j, k], out=t)
                out[i, k] += t


def _times(a: Complex, v: Complex, out: Complex, t: Complex) -> None:
    for i in range(3):
        np.multiply(a[i, 0], v[0], out=out[i])
        for j in (1, 2):
            np.multiply(a[i, j], v[j], out=t)
            out[i] += t


def _inverse(m: Complex, out: Complex, t: Complex, d: Complex) -> None:
    """By cofactors."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for r in range(3):
            s, u = (r + 1) % 3, (r + 2) % 3
            np.multiply(m[j, s], m[k, u], out=out[r, i])
            np.multiply(m[j, u], m[k, s], out=t)
            out[r, i] -= t
    np.multiply(m[0, 0], out[0, 0], out=d)
    for j in (1, 2):
        np.multiply(m[0, j], out[j, 0], out=t)
        d += t
    np.divide(1.0, d, out=d)
    out *= d


def _break(own: Buffers, k: int, here: slice, z: Complex, state: State, part: slice) -> None:
    """Eliminate edge k again where it is broken: below the break, the break, above it."""
    share = state.share[part][here]
    mask = state.open_mask[part][here]
    size = share.size
    low, p, w = own.low[..., :size], own.p[..., :size], own.w[k][..., here]
    y, below = own.b[..., :size], own.c[..., :size]
    _up(own, z * (1.0 - share), own.y[k][..., here], low, y)
    _open(y, mask, p)
    _up(own, z * share, y, below, w)
    # V = low P (above the break), and above the break V = below V_parent
    t = own.one[0, 0, :size]
    middle = own.a[..., :size]
    _product(p, below, middle, t)
    _product(low, middle, own.f[k][..., here], t)


def _open(w: Complex, mask: np.ndarray, p: Complex) -> None:
    """Open the phases in ``mask``: W in place, P the voltage below per voltage above."""
    p[:] = np.eye(3)[..., None]
    limit = SINGULAR * np.abs(w).max(axis=(0, 1))
    for a in range(3):
        at = np.flatnonzero(mask & (1 << a))
        alive = np.abs(w[a, a, at]) > limit[at]
        row = np.where(alive, -w[a][:, at] / np.where(alive, w[a, a, at], 1.0), 0.0)
        row[a] = 0.0
        for matrix in (w, p):
            chosen = matrix[..., at]
            column = chosen[:, a].copy()
            chosen[:, a] = 0.0
            chosen += column[:, None] * row
            matrix[..., at] = chosen
        w[a][:, at] = 0.0
