"""One bus that stands for all that is folded at a root: its loads, and the way there.

With branch admittances y_j at level x and the series impedances between, the root sees
x sum(y_j) less a part that grows with x squared. A single impedance Z before a sum B of loads gives
B - B Z B + ...: so each load is what it is without the others' drop, Z carries the second order,
and is such that the total is exact at the level of the fold.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .primitives import branches_of

__all__ = [
    "Equivalent",
    "Fit",
    "Kind",
    "SeenLoad",
    "across",
    "equivalent_of",
    "seen_through",
]

Complex = NDArray[np.complex128]
Kind = Literal["bus", "line", "units", "both"]

LEAST_Z = 1e-6
"""Least impedance of an equivalent, as a share of that of its loads."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """How a load stands at the equivalent's bus: between which phases, and how much of it."""

    phases: str
    connection: Literal["wye", "delta"]
    share: complex  #: its admittance there, per branch, over that of a branch of its own


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Equivalent:
    """Loads at the root ("bus"), or beyond a line, single-phase units, or first one then the other.

    ``z_ohm`` is that of all on the way.
    """

    kind: Kind
    z_ohm: Complex  #: (3, 3) between the root and the loads; 0 for "bus"
    near_s: Complex  #: (3, 3) to earth at the root
    far_s: Complex  #: (3, 3) to earth at the loads
    fits: tuple[Fit, ...]
    stub_gain: Complex  #: (3, 3) voltage at the loads per voltage at the root, at the fold's level


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeenLoad:
    """A load that is folded: (branches, 3) voltages of its branches per voltage at the root."""

    y_s: complex  #: of a branch, at level 1
    gain: Complex  #: at the level of the fold
    bare_gain: Complex  #: without loads


def equivalent_of(
    kind: Kind, level: float, whole_s: Complex, bare_s: Complex, loads: Sequence[SeenLoad]
) -> Equivalent:
    """Fit an equivalent of one kind.

    Parameters
    ----------
    kind : Kind
    level : float
        Of all loads, at which the fold is exact.
    whole_s, bare_s : (3, 3) arrays
        What the root sees at that level, and without loads.
    loads : sequence of SeenLoad
    """
    if kind == "bus":
        return _at_the_root(level, whole_s, loads)
    near, far = _shunts(kind, bare_s)
    fits = tuple(_fit(load.bare_gain) for load in loads)
    b = _loaded(level, fits, loads) + far
    size = _loaded(level, fits, loads, np.abs)
    z = _passive(_series(kind, whole_s - near, b, size), size)
    gain = np.asarray(np.linalg.inv(np.eye(3) + z @ b), np.complex128)
    return Equivalent(kind=kind, z_ohm=z, near_s=near, far_s=far, fits=fits, stub_gain=gain)


def _at_the_root(level: float, whole_s: Complex, loads: Sequence[SeenLoad]) -> Equivalent:
    """Every load by its effect at the level of the fold, and a factor for the total."""
    nothing = np.zeros((3, 3), np.complex128)
    fits = [_fit(load.gain) for load in loads]
    b = _loaded(level, fits, loads)
    factor = _projection(whole_s, b) if loads else 1.0
    return Equivalent(
        kind="bus",
        z_ohm=nothing,
        near_s=nothing,
        far_s=nothing,
        fits=tuple(replace(fit, share=fit.share * factor) for fit in fits),
        stub_gain=np.eye(3, dtype=np.complex128),
    )


def seen_through(equivalent: Equivalent, level: float, loads: Sequence[SeenLoad]) -> Complex:
    """(3, 3) what a root sees of its equivalent with linear loads, all at ``level``."""
    b = _loaded(level, equivalent.fits, loads) + equivalent.far_s
    inverse = np.linalg.inv(np.eye(3) + b @ equivalent.z_ohm)
    return np.asarray(equivalent.near_s + inverse @ b)


def _shunts(kind: Kind, bare: Complex) -> tuple[Complex, Complex]:
    """What is there without loads: half of the charging at either end, magnetizing beyond."""
    half = np.zeros((3, 3), np.complex128)
    if kind in ("line", "both"):
        half = np.asarray(0.5j * _capacitive(bare), np.complex128)
    if kind == "line":
        return half, half
    left = (bare - 2.0 * half).diagonal()
    iron = np.maximum(left.real, 0.0) + 1j * np.minimum(left.imag, 0.0)
    return half, half + _diagonal_of(iron)


def _capacitive(bare: Complex) -> NDArray[np.float64]:
    """Susceptances that a line's capacitances can have: none negative from a phase to earth."""
    b = (bare.imag + bare.imag.T) / 2.0
    between = np.minimum(b - np.diag(b.diagonal()), 0.0)
    return np.asarray(between + np.diag(np.maximum(b.diagonal(), -between.sum(axis=1))))


def _unit_shapes() -> list[tuple[str, Literal["wye", "delta"], Complex]]:
    """All ways a load may stand at a bus, with the sum of its branches' outer products."""
    shapes: list[tuple[str, Literal["wye", "delta"]]] = [
        ("".join(some), "wye") for count in (1, 2, 3) for some in combinations("abc", count)
    ]
    shapes += [("ab", "delta"), ("bc", "delta"), ("ca", "delta"), ("abc", "delta")]
    found = []
    for phases, connection in shapes:
        total = np.zeros((3, 3), np.complex128)
        for branch in across(phases, connection):
            total += np.outer(branch, branch)
        found.append((phases, connection, total))
    return found


@cache
def across(phases: str, connection: str) -> NDArray[np.float64]:
    """(branches, 3) voltage of each branch per voltage of the phases."""
    rows = np.zeros((0, 3))
    for start, end in branches_of(phases, connection):
        branch = np.zeros(3)
        branch[start] = 1.0
        if end >= 0:
            branch[end] = -1.0
        rows = np.vstack([rows, branch])
    return rows


SHAPES = _unit_shapes()


def _fit(gain: Complex) -> Fit:
    """The way to stand at a bus that comes nearest to a load with these voltage gains."""
    wanted = gain.T @ gain
    best, least = None, np.inf
    for phases, connection, shape in SHAPES:
        share = _projection(wanted, shape)
        left = float(np.abs(wanted - share * shape).sum())
        if left < least * (1.0 - 1e-9):
            best, least = Fit(phases=phases, connection=connection, share=share), left
    assert best is not None
    return best


def _projection(wanted: Complex, shape: Complex) -> complex:
    """The factor that brings ``shape`` nearest to ``wanted``."""
    return complex(np.vdot(shape, wanted) / np.vdot(shape, shape))


def _loaded(
    level: float,
    fits: Sequence[Fit],
    loads: Sequence[SeenLoad],
    measure: Callable[[complex], complex] = complex,
) -> Complex:
    """(3, 3) admittance of all loads at the equivalent's bus, or the sum of their ``measure``."""
    total = np.zeros((3, 3), np.complex128)
    for fit, load in zip(fits, loads, strict=True):
        total += measure(level * fit.share * load.y_s) * _SHAPE[fit.phases, fit.connection]
    return total


_SHAPE = {(phases, connection): shape for phases, connection, shape in SHAPES}


def _series(kind: Kind, whole: Complex, beyond: Complex, loads: Complex) -> Complex:
    """(3, 3) the impedance before ``beyond`` that makes it look like ``whole``, where loads are."""
    there = np.abs(loads).sum(axis=1) > 0.0
    _, sizes, vectors = np.linalg.svd(loads.real)
    basis = vectors[sizes > 1e-6 * sizes.max(initial=0.0)].T
    z = np.linalg.inv(basis.T @ whole @ basis) - np.linalg.inv(basis.T @ beyond @ basis)
    z = (z + z.T) / 2.0
    if kind == "units":
        return _diagonal(z, basis, there)
    full = basis @ z @ basis.T
    rest = np.diag(there.astype(float)) - basis @ basis.T
    return np.asarray(full + np.trace(z) / len(z) * rest)


def _passive(z: Complex, loads: Complex) -> Complex:
    """The impedance, or one that a line can have: where it is next to nothing, rounding rules."""
    own = z.diagonal()
    there = np.abs(loads).sum(axis=1) > 0.0
    if np.all(~there | ((own.real >= 0.0) & (own.imag > 0.0))):
        return z
    least = LEAST_Z / np.abs(loads).max()
    values = np.maximum(own.real, 0.0) + 1j * np.maximum(own.imag, least)
    return _diagonal_of(np.where(there, values, 0.0))


def _diagonal(z: Complex, basis: NDArray[np.float64], there: NDArray[np.bool_]) -> Complex:
    """Impedances of the phases alone that come nearest to ``z`` in the directions of ``basis``."""
    columns = np.array([np.outer(row, row).ravel() for row in basis[there]]).T
    values, *_ = np.linalg.lstsq(columns.astype(np.complex128), z.ravel(), rcond=None)
    found = np.zeros(3, np.complex128)
    found[there] = values
    return _diagonal_of(found)


def _diagonal_of(values: Complex) -> Complex:
    return np.asarray(np.diag(values), np.complex128)
