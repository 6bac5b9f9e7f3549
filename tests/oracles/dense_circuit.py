"""Equations and unknowns of the dense reference, and how they are solved.

A circuit is a list of linear equations in SI units with a scale for every row and column,
and *groups*: branches between terminals whose admittance depends on their own voltage.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from oracles.dense_groups import Complex, Floats, Group, Terminal
from scipy.linalg.lapack import zgecon, zgetrf, zgetrs

__all__ = [
    "Circuit",
    "Found",
    "NoSolutionError",
    "NotConvergedError",
    "solve_circuit",
]

TOLERANCE = 1e-13
MAX_ITERATIONS = 1000
NULL_TOLERANCE = 1e-11
"""Singular values below this share of the largest count as zero."""
REFINEMENTS = 3
WELL_CONDITIONED = 1e-10
"""Reciprocal condition from which a matrix has no null space to look for."""


class NotConvergedError(RuntimeError):
    """No state was found in which voltages and what depends on them agree."""


class NoSolutionError(NotConvergedError):
    """No state fulfils the equations, such as a current source with no way back."""


@dataclass(slots=True)
class Circuit:
    """Equations and unknowns in SI; scales bring them to per unit before solving."""

    s_base: float
    column_scale: list[float] = field(default_factory=list)
    row_scale: list[float] = field(default_factory=list)
    entries: list[tuple[int, int, complex]] = field(default_factory=list)
    rhs: dict[int, complex] = field(default_factory=dict)
    nodes: dict[str, tuple[int, int]] = field(default_factory=dict)
    """First of the three voltage columns and of the three current-balance rows (of a ``point``
    the only ones)."""
    points: set[str] = field(default_factory=set)
    groups: dict[str, Group] = field(default_factory=dict)
    losses: list[tuple[Complex, list[int]]] = field(default_factory=list)
    charging: list[tuple[str, Complex]] = field(default_factory=list)
    neutral: tuple[int, complex] | None = None
    """Column of the source neutral's voltage, and its admittance to earth."""

    def columns(self, count: int, scale: float) -> list[int]:
        start = len(self.column_scale)
        self.column_scale += [scale] * count
        return list(range(start, start + count))

    def row(self, scale: float, terms: Sequence[tuple[int, complex]], rhs: complex = 0) -> int:
        index = len(self.row_scale)
        self.row_scale.append(scale)
        self.entries += [(index, column, value) for column, value in terms]
        self.rhs[index] = rhs
        return index

    def node(self, name: str, v_base: float) -> str:
        if name in self.nodes:
            raise ValueError(f"two nodes are called {name!r}")
        column = self.columns(3, v_base)[0]
        first, _, _ = (self.row(self.s_base / v_base, []) for _ in range(3))
        self.nodes[name] = (column, first)
        return name

    def point(self, name: str, v_base: float) -> Terminal:
        """A single conductor's node, such as a neutral."""
        if name in self.nodes:
            raise ValueError(f"two nodes are called {name!r}")
        self.nodes[name] = (self.columns(1, v_base)[0], self.row(self.s_base / v_base, []))
        self.points.add(name)
        return name, 0

    def absent(self) -> set[tuple[str, int]]:
        """Phases of nodes to which nothing is connected at all."""
        columns = {column for _, column, _ in self.entries}
        rows = {row for row, _, _ in self.entries}
        for group in self.groups.values():
            for terminal in (*group.plus, *group.minus):
                if terminal is not None:
                    columns.add(self.nodes[terminal[0]][0] + terminal[1])
        return {
            (name, k)
            for name, (column, row) in self.nodes.items()
            for k in range(3 if name not in self.points else 1)
            if column + k not in columns and row + k not in rows
        }

    def voltage(self, terminal: Terminal, sign: complex) -> list[tuple[int, complex]]:
        """Term ``sign * V`` of an equation; nothing for earth."""
        if terminal is None:
            return []
        return [(self.nodes[terminal[0]][0] + terminal[1], sign)]

    def leaves(self, terminal: Terminal, column: int, sign: complex) -> None:
        """Add ``sign`` times a current unknown to the balance of currents leaving a node."""
        if terminal is not None:
            self.entries.append((self.nodes[terminal[0]][1] + terminal[1], column, sign))

    def shunt(self, node: str, y: Complex) -> None:
        """A constant coupled admittance from the three phases of a node to earth."""
        column, row = self.nodes[node]
        self.entries += [
            (row + k, column + j, complex(y[k, j])) for k in range(3) for j in range(3) if y[k, j]
        ]
        self.charging.append((node, y))

    def series(
        self, a: str, b: str, z: Complex, v_base: float, phases: Sequence[int] = (0, 1, 2)
    ) -> list[int]:
        """Coupled conductors of some phases from node a to node b; currents flow from a to b.

        Row i of ``z`` is that of the phase that stands i-th in ``phases``.
        """
        current = self.columns(len(phases), self.s_base / v_base)
        for n, k in enumerate(phases):
            self.leaves((a, k), current[n], 1)
            self.leaves((b, k), current[n], -1)
            drop = [(current[j], complex(-z[n, j])) for j in range(len(phases))]
            self.row(v_base, self.voltage((a, k), 1) + self.voltage((b, k), -1) + drop)
        self.losses.append((z, current))
        return current

    def branch(self, a: Terminal, b: Terminal, z: complex, v_base: float) -> int:
        """One conductor between two terminals; the current flows from a to b."""
        (current,) = self.columns(1, self.s_base / v_base)
        self.leaves(a, current, 1)
        self.leaves(b, current, -1)
        self.row(v_base, self.voltage(a, 1) + self.voltage(b, -1) + [(current, -z)])
        self.losses.append((np.array([[z]]), [current]))
        return current

    def gap(
        self,
        a: str,
        b: str,
        open_phases: Sequence[int],
        v_base: float,
        phases: Sequence[int] = (0, 1, 2),
    ) -> list[int]:
        """Ideal conductors of ``phases`` from a to b, those of ``open_phases`` interrupted."""
        current = self.columns(len(phases), self.s_base / v_base)
        for n, k in enumerate(phases):
            self.leaves((a, k), current[n], 1)
            self.leaves((b, k), current[n], -1)
            if k in open_phases:
                self.row(self.s_base / v_base, [(current[n], 1)])
            else:
                self.row(v_base, self.voltage((a, k), 1) + self.voltage((b, k), -1))
        return current


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """A solved circuit: unknowns in SI, voltages across all branches, what is undetermined."""

    x: Complex
    across: dict[str, Complex]  #: by group, volts
    pu: dict[str, Floats]  #: by group, the voltages that count
    drawn_a: dict[str, Complex]  #: by group, amperes from plus to minus
    null: Complex  #: (unknowns, n)
    iterations: int


@dataclass(slots=True)
class _Matrices:
    """The circuit in per unit: ``(fixed + into @ Y @ across) x = rhs + into @ fed``."""

    fixed: Complex
    rhs: Complex
    into: Complex
    across: Complex


def _powers_of_two(scale: Sequence[float]) -> Floats:
    """The scales, rounded so that scaling costs no digit."""
    return np.asarray(2.0 ** np.round(np.log2(scale)), dtype=np.float64)


def _matrices(circuit: Circuit) -> _Matrices:
    size = len(circuit.column_scale)
    if len(circuit.row_scale) != size:
        raise AssertionError("the circuit has not as many equations as unknowns")
    columns = _powers_of_two(circuit.column_scale)
    rows = _powers_of_two(circuit.row_scale)
    fixed = np.zeros((size, size), dtype=np.complex128)
    for r, c, value in circuit.entries:
        fixed[r, c] += value
    for name, k in circuit.absent():
        column, row = circuit.nodes[name]
        fixed[row + k, column + k] = rows[row + k] / columns[column + k]
    rhs = np.zeros(size, dtype=np.complex128)
    for r, value in circuit.rhs.items():
        rhs[r] = value
    pairs = [
        pair
        for group in circuit.groups.values()
        for pair in zip(group.plus, group.minus, strict=True)
    ]
    into = np.zeros((size, len(pairs)), dtype=np.complex128)
    across = np.zeros((len(pairs), size), dtype=np.complex128)
    for b, (plus, minus) in enumerate(pairs):
        for terminal, sign in ((plus, 1.0), (minus, -1.0)):
            if terminal is not None:
                column, row = circuit.nodes[terminal[0]]
                across[b, column + terminal[1]] += sign
                into[row + terminal[1], b] += sign
    return _Matrices(
        fixed * columns / rows[:, None], rhs / rows, into / rows[:, None], across * columns
    )


def _null_spaces(matrix: Complex) -> tuple[Complex, Complex]:
    """Orthonormal left and right null spaces; the gap in the spectrum must be clear."""
    factors, _, singular = zgetrf(matrix)
    if not singular and zgecon(factors, np.linalg.norm(matrix, 1))[0] > WELL_CONDITIONED:
        return np.empty((len(matrix), 0), np.complex128), np.empty((len(matrix), 0), np.complex128)
    u, s, vh = np.linalg.svd(matrix)
    rank = int(np.sum(s > NULL_TOLERANCE * s[0]))
    if rank < len(s) and s[rank] > 1e-3 * s[rank - 1]:
        raise AssertionError(f"rank is not clear: {s[rank - 1 :] / s[0]}")
    return u[:, rank:], vh[rank:].conj().T


class _Bordered:
    """Least-norm solutions of a consistent system with known null spaces."""

    def __init__(self, matrix: Complex, left: Complex, right: Complex) -> None:
        self.size, free = right.shape
        if free:
            matrix = np.block([[matrix, left], [right.conj().T, np.zeros((free, free))]])
        self.free = free
        self.matrix = matrix
        self.factors, self.pivots, singular = zgetrf(matrix)
        if singular:
            raise NoSolutionError("the circuit's equations have no one solution")

    def solve(self, rhs: Complex) -> Complex:
        padded = np.concatenate([rhs, np.zeros((self.free, *rhs.shape[1:]))])
        x, _ = zgetrs(self.factors, self.pivots, padded)
        if rhs.ndim == 1:
            # residuals in extended precision: the reference has digits to spare
            wide = self.matrix.astype(np.clongdouble)
            for _ in range(REFINEMENTS):
                left_over = (padded - wide @ x.astype(np.clongdouble)).astype(np.complex128)
                x = x + zgetrs(self.factors, self.pivots, left_over)[0]
        self.contradiction = float(np.abs(x[self.size :]).max(initial=0.0))
        return np.asarray(x[: self.size], dtype=np.complex128)


def _block_diagonal(blocks: Sequence[Complex | float], sizes: Sequence[int]) -> Complex:
    full = np.zeros((sum(sizes), sum(sizes)), dtype=np.complex128)
    start = 0
    for block, size in zip(blocks, sizes, strict=True):
        full[start : start + size, start : start + size] = block
        start += size
    return full


def solve_circuit(circuit: Circuit, start: Mapping[str, Floats], *, hold: bool = False) -> Found:
    """Solve; what depends on voltage is iterated from ``start``, nominal where that has none.

    The network is reduced to the terminals of the groups once; with the admittances found
    there the whole is solved again. With ``hold`` they stay as they are at ``start``, and
    ``pu`` tells what voltages come of that.

    Raises
    ------
    NotConvergedError
        No fixed point within the iterations, or no solution at all.
    """
    parts = _matrices(circuit)
    groups = list(circuit.groups.values())
    sizes = [len(group.plus) for group in groups]
    spans = [slice(stop - size, stop) for size, stop in zip(sizes, np.cumsum(sizes), strict=True)]
    steady = _block_diagonal([group.fixed_s for group in groups], sizes)
    rhs = parts.rhs.copy()
    for group, span in zip(groups, spans, strict=True):
        rhs += parts.into[:, span] @ (group.fed_a * np.ones(len(group.plus)))

    def admittance(pu: Floats) -> Complex:
        varying = [group.varying(pu[span]) for group, span in zip(groups, spans, strict=True)]
        return steady + _block_diagonal(varying, sizes)

    def magnitudes(v: Complex) -> Floats:
        own = [group.magnitudes(v[span]) for group, span in zip(groups, spans, strict=True)]
        return np.concatenate([*own, np.empty(0)])

    def moves(one: Floats, other: Floats) -> float:
        """Largest change of a voltage that changes anything."""
        same = [g.same(one[span], other[span]) for g, span in zip(groups, spans, strict=True)]
        changed = ~np.concatenate([*same, np.empty(0, np.bool_)]).astype(bool)
        return float(np.abs(one - other)[changed].max(initial=0.0))

    given = [start.get(name, np.ones(len(g.plus))) for name, g in circuit.groups.items()]
    pu = np.concatenate([*given, np.empty(0)])
    y_start = admittance(pu)
    matrix = parts.fixed + parts.into @ y_start @ parts.across
    left, right = _null_spaces(matrix)
    seen = _Bordered(matrix, left, right).solve(np.column_stack([rhs, parts.into]))
    v_start, z = parts.across @ seen[:, 0], parts.across @ seen[:, 1:]
    eye = np.eye(len(pu))
    count = 0
    for count in range(1, 1 if hold else MAX_ITERATIONS + 1):
        reduced = eye + z @ (admittance(pu) - y_start)
        v = np.asarray(np.linalg.solve(reduced, v_start), dtype=np.complex128)
        found = magnitudes(v)
        if moves(found, pu) <= TOLERANCE:
            break
        pu = pu + (1.0 if count <= 100 else 0.5 if count <= 300 else 0.2) * (found - pu)
    else:
        if not hold:
            raise NotConvergedError(f"no fixed point after {MAX_ITERATIONS} iterations")

    y = admittance(pu)
    whole = _Bordered(parts.fixed + parts.into @ y @ parts.across, left, right)
    x = whole.solve(rhs)
    if whole.contradiction > 1e-9:
        raise NoSolutionError("the circuit's equations contradict one another")
    v = parts.across @ x
    # the reduction at the start's admittances may be worse conditioned than the whole
    worse = moves(magnitudes(v), pu)
    if not hold and worse > 1e-10 * max(1.0, pu.max(initial=0.0)):
        raise NotConvergedError("the reduced circuit and the whole disagree")
    names = list(circuit.groups)
    drawn = y @ v
    for group, span in zip(groups, spans, strict=True):
        drawn[span] -= group.fed_a
    return Found(
        x=np.asarray(x * _powers_of_two(circuit.column_scale)),
        across={name: v[span] for name, span in zip(names, spans, strict=True)},
        pu={name: magnitudes(v)[span] for name, span in zip(names, spans, strict=True)},
        drawn_a={name: drawn[span] for name, span in zip(names, spans, strict=True)},
        null=right,
        iterations=count,
    )
