"""Branches of the dense reference whose admittance depends on their own voltage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "FLOOR_PU",
    "FORTESCUE",
    "Complex",
    "Floats",
    "Group",
    "Law",
    "Terminal",
    "machine_matrix",
]

Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]
Terminal = tuple[str, int] | None
"""A node and its phase, or None: earth."""

FLOOR_PU = 0.7
"""Voltage below which what depends on it is a constant impedance, unless it says another."""

A = np.exp(2j * np.pi / 3)
FORTESCUE: Complex = np.array([[1, 1, 1], [1, A**2, A], [1, A, A**2]], dtype=np.complex128)
"""Phase from sequence quantities, in the order 0, 1, 2."""


def machine_matrix(y0: complex, y1: complex, y2: complex) -> Complex:
    """Admittance between three windings' voltages and currents, from that of each sequence."""
    return np.asarray(FORTESCUE @ np.diag([y0, y1, y2]) @ FORTESCUE.conj().T / 3)


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """How P and Q of a branch depend on its voltage: as ``|V|**exponent``, or by ``zip``."""

    exponent: float
    exponent_q: float | None = None
    zip: tuple[float, ...] | None = None
    v_min_pu: float = FLOOR_PU
    v_max_pu: float | None = None
    v_low_pu: float | None = None
    edge_exponent: float | None = None

    @property
    def bends(self) -> bool:
        """Whether a branch is anything but a constant impedance."""
        both = {self.exponent, self.exponent if self.exponent_q is None else self.exponent_q}
        return self.zip is not None or both != {2.0} or self.edge_exponent not in (None, 2.0)

    def factors(self, pu: Floats) -> tuple[Floats, Floats]:
        """Conductance and susceptance over the nominal ones, at these voltages."""
        p, q = (self._factor(n, pu) for n in range(2))
        return p, q

    def _factor(self, n: int, pu: Floats) -> Floats:
        """Of P (0) or Q (1). Down to ``v_low_pu`` it is the current that goes linearly."""
        low = self.v_min_pu * self._at_limit(n, self.v_min_pu)
        below = np.full(len(pu), low / self.v_min_pu)
        if self.v_low_pu is not None:
            current = np.interp(pu, [self.v_low_pu, self.v_min_pu], [self.v_low_pu, low])
            below = np.where(pu < self.v_low_pu, 1.0, current / np.maximum(pu, self.v_low_pu))
        within = self._over_square(n, np.clip(pu, self.v_min_pu, self.v_max_pu))
        found = np.where(pu < self.v_min_pu, below, within)
        if self.v_max_pu is not None:
            found = np.where(pu > self.v_max_pu, self._at_limit(n, self.v_max_pu), found)
        return np.asarray(found)

    def _at_limit(self, n: int, v: float) -> float:
        if self.edge_exponent is not None:
            return float(v ** (self.edge_exponent - 2.0))
        return float(self._over_square(n, np.array([v]))[0])

    def _over_square(self, n: int, v: Floats) -> Floats:
        """What P (0) or Q (1) is of its nominal value, over the square of the voltage."""
        if self.zip is None:
            exponent = self.exponent_q if n and self.exponent_q is not None else self.exponent
            return np.asarray(v ** (exponent - 2.0))
        z, i, p = self.zip[3 * n : 3 * n + 3]
        return np.asarray(z + i / v + p / v**2)


@dataclass(slots=True, kw_only=True)
class Group:
    """Branches whose nominal admittance varies by a law, P's part and Q's part by their own.

    Each branch by its own voltage; those of a machine all by their positive sequence.
    """

    plus: list[Terminal]
    minus: list[Terminal]
    v_nominal: float
    y_s: Complex  #: (n, n) at nominal voltage, varies as P
    law: Law
    y_q_s: Complex | float = 0.0  #: (n, n) besides, varies as Q
    machine: bool = False
    fixed_s: Complex | float = 0.0  #: (n, n) besides
    fed_a: Complex | float = 0.0  #: (n,) current fed in, whatever the voltage

    def magnitudes(self, v: Complex) -> Floats:
        """(n,) the voltages that count, pu."""
        if self.machine:
            return np.full(3, abs(FORTESCUE[:, 1].conj() @ v) / 3 / self.v_nominal)
        return np.asarray(np.abs(v) / self.v_nominal, dtype=np.float64)

    def varying(self, pu: Floats) -> Complex:
        """(n, n) voltage-dependent part of the admittance."""
        p, q = self.law.factors(pu)
        return np.asarray(self.y_s * p[:, None] + self.y_q_s * q[:, None], dtype=np.complex128)

    def same(self, one: Floats, other: Floats) -> NDArray[np.bool_]:
        """(n,) it is the same admittance at both voltages."""
        if not self.law.bends or not (np.any(self.y_s) or np.any(self.y_q_s)):
            return np.ones(len(one), np.bool_)
        (p, q), (p_other, q_other) = self.law.factors(one), self.law.factors(other)
        return np.asarray((p == p_other) & (q == q_other))
