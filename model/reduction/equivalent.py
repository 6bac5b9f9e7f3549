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

from ..phases import phase_rows

__all__ = [
    "Equivalent",
    "Fit",
    "Kind",
    "SeenLoad",
    "across",
    "equivalent_of",
    "gain_through",
    "seen_through",
]

Complex = NDArray[np.complex128]
Kind = Literal["bus", "line", "units", "both"]

LEAST_Z = 1e-6
"""Least impedance of an equivalent, as a share of that of its loads."""

UNITS_SHARE = 0.1
"""Of the impedance on the way, where a line and units share it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """How a load stands at the equivalent's bus: between which phases, and how much of it."""

    phases: str
    connection: Literal["wye", "delta"]
    share: complex  #: its admittance there, per branch, over that of a branch of its own


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Equivalent:
    """Loads at the root ("bus"), or beyond a line, single-phase units, or first one then the other.

    Units stand on one phase each and lead to the same phase, or where all loads are between
    phases (``paired``) on ab, bc, ca, and lead to a, b, c.
    """

    kind: Kind
    paired: bool
    line_z_ohm: Complex  #: (3, 3)
    half_s: Complex  #: (3, 3) charging at either end of the line
    unit_z_ohm: Complex  #: (3,) leakage of each unit; 0: there is none
    unit_y_s: Complex  #: (3,) magnetizing admittance
    fits: tuple[Fit, ...]

    @property
    def z_ohm(self) -> Complex:
        """(3, 3) between the root and the loads."""
        turns = np.linalg.pinv(_turns(self.paired, self.unit_z_ohm != 0.0))
        units = turns @ np.diag(self.unit_z_ohm[self.unit_z_ohm != 0.0]) @ turns.T
        return np.asarray(self.line_z_ohm + units, np.complex128)

    @property
    def far_s(self) -> Complex:
        """(3, 3) what there is at the loads besides them."""
        turns = _turns(self.paired, np.ones(3, np.bool_))
        return np.asarray(self.half_s + turns.T @ np.diag(self.unit_y_s) @ turns, np.complex128)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeenLoad:
    """A load that is folded: (branches, 3) voltages of its branches per voltage at the root."""

    y_s: Complex  #: (branches,) at level 1
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
    fits = tuple(_fit(load.bare_gain) for load in loads)
    paired = kind in ("units", "both") and all(fit.connection == "delta" for fit in fits)
    half = np.zeros((3, 3), np.complex128)
    if kind != "units":
        half = np.asarray(0.5j * _capacitive(bare_s), np.complex128)
    bare = Equivalent(
        kind=kind,
        paired=paired,
        line_z_ohm=np.zeros((3, 3), np.complex128),
        half_s=half,
        unit_z_ohm=np.zeros(3, np.complex128),
        unit_y_s=np.zeros(3, np.complex128) if kind == "line" else _iron(bare_s - 2 * half, paired),
        fits=fits,
    )
    size = _loaded(level, fits, loads, np.abs)
    basis = _basis(size)
    z = _series(basis, whole_s - half, _loaded(level, fits, loads) + bare.far_s)
    if kind == "line":
        return replace(bare, line_z_ohm=_of_line(basis, z, size))
    unit_z = _of_units(basis, z, size, paired)
    if kind == "units":
        return replace(bare, unit_z_ohm=unit_z)
    shared = replace(bare, unit_z_ohm=UNITS_SHARE * unit_z)
    return replace(shared, line_z_ohm=_of_line(basis, z, size) - shared.z_ohm)


def _at_the_root(level: float, whole_s: Complex, loads: Sequence[SeenLoad]) -> Equivalent:
    """Every load by its effect at the level of the fold, and a factor for the total."""
    fits = [_fit(load.gain) for load in loads]
    b = _loaded(level, fits, loads)
    factor = _projection(whole_s, b) if b.any() else 1.0
    return Equivalent(
        kind="bus",
        paired=False,
        line_z_ohm=np.zeros((3, 3), np.complex128),
        half_s=np.zeros((3, 3), np.complex128),
        unit_z_ohm=np.zeros(3, np.complex128),
        unit_y_s=np.zeros(3, np.complex128),
        fits=tuple(replace(fit, share=fit.share * factor) for fit in fits),
    )


def seen_through(equivalent: Equivalent, level: float, loads: Sequence[SeenLoad]) -> Complex:
    """(3, 3) what a root sees of its equivalent with linear loads, all at ``level``."""
    b = _loaded(level, equivalent.fits, loads) + equivalent.far_s
    inverse = np.linalg.inv(np.eye(3) + b @ equivalent.z_ohm)
    return np.asarray(equivalent.half_s + inverse @ b)


def gain_through(equivalent: Equivalent, level: float, loads: Sequence[SeenLoad]) -> Complex:
    """(3, 3) voltage before the loads, in the phases of the root, per voltage of the root."""
    b = _loaded(level, equivalent.fits, loads) + equivalent.far_s
    return np.asarray(np.linalg.inv(np.eye(3) + equivalent.z_ohm @ b), np.complex128)


def _turns(paired: bool, there: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(units, 3) voltage across each unit per voltage of the root's phases."""
    return across("abc", "delta" if paired else "wye")[there]


def _iron(bare: Complex, paired: bool) -> Complex:
    """(3,) what the units take without load: losses, and no capacitance."""
    y = bare.diagonal()
    if paired:
        y = -np.array([bare[0, 1], bare[1, 2], bare[2, 0]])
    return np.maximum(y.real, 0.0) + 1j * np.minimum(y.imag, 0.0)


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
    own = np.eye(3)[phase_rows(phases)]
    if connection == "wye":
        return own
    return (own - np.roll(own, -1, axis=0))[: 3 if len(own) > 2 else 1]


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
        branches = across(fit.phases, fit.connection)
        values = [measure(level * fit.share * y) for y in _of_branches(load, branches)]
        total += branches.T @ np.diag(values) @ branches
    return total


def _of_branches(load: SeenLoad, branches: NDArray[np.float64]) -> Complex:
    """Admittances of a load in other branches: of those most like them, if they are as many."""
    if len(branches) != load.y_s.size or load.y_s.size == 1:
        return np.full(len(branches), load.y_s.mean())
    return np.asarray(load.y_s[np.abs(branches @ load.bare_gain.T).argmax(axis=1)])


def _basis(loads: Complex) -> NDArray[np.float64]:
    """(3, n) the modes of the phases in which there are loads."""
    _, sizes, vectors = np.linalg.svd(loads.real)
    return np.asarray(vectors[sizes > 1e-6 * sizes.max(initial=0.0)].T)


def _series(basis: NDArray[np.float64], whole: Complex, beyond: Complex) -> Complex:
    """(n, n) the impedance before ``beyond`` that makes it look like ``whole``, in these modes."""
    z = np.linalg.inv(basis.T @ whole @ basis) - np.linalg.inv(basis.T @ beyond @ basis)
    return np.asarray((z + z.T) / 2.0)


def _of_line(basis: NDArray[np.float64], z: Complex, loads: Complex) -> Complex:
    """(3, 3) of a line with ``z`` in the modes that matter.

    Where it is next to nothing, rounding may leave what no line can have: then the least.
    """
    there = np.abs(loads).sum(axis=1) > 0.0
    rest = np.diag(there.astype(float)) - basis @ basis.T
    whole = basis @ z @ basis.T + np.trace(z) / len(z) * rest
    own = whole.diagonal()
    if np.all(~there | ((own.real >= 0.0) & (own.imag > 0.0))):
        return np.asarray(whole)
    return np.asarray(np.diag(np.where(there, _passive(own, loads), 0.0)), np.complex128)


def _of_units(basis: NDArray[np.float64], z: Complex, loads: Complex, paired: bool) -> Complex:
    """(3,) leakages that come nearest to ``z`` in these modes."""
    turns = across("abc", "delta" if paired else "wye")
    there = np.abs(turns @ loads).max(axis=1) > 0.0
    if paired:
        there = -np.array([loads[0, 1], loads[1, 2], loads[2, 0]]).real > 0.0
    through = basis.T @ np.linalg.pinv(turns[there])
    columns = np.array([np.outer(each, each).ravel() for each in through.T]).T
    values, *_ = np.linalg.lstsq(columns.astype(np.complex128), z.ravel(), rcond=None)
    found = np.zeros(3, np.complex128)
    found[there] = _passive(np.asarray(values, np.complex128), loads)
    return found


def _passive(z: Complex, loads: Complex) -> Complex:
    """No negative resistance, and some reactance."""
    least = LEAST_Z / float(np.abs(loads).max())
    return np.maximum(z.real, 0.0) + 1j * np.where(z.imag > 0.0, z.imag, least)
