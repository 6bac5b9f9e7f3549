"""The OpenDSS engine, asked for one direct solution, floating nodes told apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["direct_voltages", "new_context"]

FLOATING = 1e-9
"""Singular values below this, of the matrix scaled to a unit diagonal: nothing holds the node, or
so little (a dead end's charging) that the engine's nodal matrix has no digits left for it."""
TRACE = 1e-6  #: a node that a floating pattern moves by more than this, of its largest

Complex = NDArray[np.complex128]


def new_context() -> Any:
    """An engine of its own that opens no window and follows no folder."""
    from dss import DSS

    engine = DSS.NewContext()
    engine.AllowForms = False
    engine.AllowEditor = False
    engine.AllowChangeDir = False
    return engine


def direct_voltages(
    engine: Any, build: Callable[[Sequence[str]], Sequence[str]]
) -> tuple[dict[str, complex], set[str]]:
    """Node voltages of the circuit that ``build(held)`` describes, and which nodes float.

    One floating part makes all voltages undefined. So the engine's own matrix is asked first
    for what floats; as many nodes are held by a resistor, through which nothing flows, and
    the circuit is solved once more.
    """
    _run(engine, [*build(()), "set mode=direct", "solve"])
    nodes = [str(n) for n in engine.ActiveCircuit.YNodeOrder]
    patterns = _floating(_matrix(engine))
    undetermined: set[str] = set()
    if patterns.shape[1]:
        held = _anchors(patterns, nodes)
        size = np.abs(patterns) / np.abs(patterns).max(axis=0)
        undetermined = {nodes[k] for k in np.flatnonzero((size > TRACE).any(axis=1))}
        _run(engine, [*build(held), "set mode=direct", "solve"])
        assert [str(n) for n in engine.ActiveCircuit.YNodeOrder] == nodes
    flat = np.asarray(engine.ActiveCircuit.YNodeVarray)
    return dict(zip(nodes, flat[::2] + 1j * flat[1::2], strict=True)), undetermined


def _run(engine: Any, commands: Sequence[str]) -> None:
    for command in commands:
        engine.Text.Command = command


def _matrix(engine: Any) -> Complex:
    """The system's admittance matrix, sources' impedances in it."""
    data, rows, starts = engine.YMatrix.GetCompressedYMatrix()
    count = len(starts) - 1
    values = np.asarray(data)
    values = values if np.iscomplexobj(values) else values[::2] + 1j * values[1::2]
    return sp.csc_matrix((values, rows, starts), shape=(count, count)).toarray()


def _floating(matrix: Complex) -> Complex:
    """(nodes, k) a basis of the voltages that draw no current anywhere."""
    root = 1.0 / np.sqrt(np.abs(np.diag(matrix)))
    _, values, right = np.linalg.svd(matrix * root[:, None] * root)
    return np.asarray(root[:, None] * right[values < FLOATING].conj().T)


def _anchors(patterns: Complex, nodes: Sequence[str]) -> list[str]:
    """As many nodes as there are patterns, which together pin all of them."""
    rest = patterns / np.abs(patterns).max(axis=0)
    chosen: list[str] = []
    for _ in range(rest.shape[1]):
        k = int(np.argmax(np.linalg.norm(rest, axis=1)))
        chosen.append(nodes[k])
        direction = rest[k].conj() / np.linalg.norm(rest[k])
        rest = rest - np.outer(rest @ direction, direction.conj())
    return chosen
