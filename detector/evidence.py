"""The few numbers a decision needs, per terminal and scenario."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..model.points import Terminal
from .impedance import connection_impedance
from .superimpose import positive_sequence, superimposed

__all__ = ["DEAD_PU", "Evidence", "Phasors", "evidence_of"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]

DEAD_PU = 0.2  #: a section is blocked while its highest phase voltage at either end is below


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Phasors:
    """What P measuring points report of S scenarios, ΔT before (0) and now (1).

    Volts to earth, and amperes positive into each point's line.
    """

    v: Complex  #: (2, P, 3, S)
    i: Complex  #: (2, P, 3, S)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evidence:
    """What T terminals see in S scenarios, in positive sequence; shape (T, S) each."""

    di1_a: Real  #: |ΔI1|
    dv1_pu: Real  #: |ΔV1| on nominal phase voltage
    z1_ohm: Complex  #: eq. (5); 0 where undefined
    blocked: NDArray[np.bool_]  #: either end is dead, now or ΔT ago
    undefined: NDArray[np.bool_]  #: eq. (5) has no value


def evidence_of(phasors: Phasors, terminals: tuple[Terminal, ...], v_nominal_v: float) -> Evidence:
    """Evidence of every directed terminal from what the points report."""
    v1, i1 = positive_sequence(phasors.v), positive_sequence(phasors.i)
    dv1, di1 = superimposed(v1[1], v1[0]), superimposed(i1[1], i1[0])
    alive = _alive(phasors.v, v_nominal_v)
    di1_a, dv1_pu = np.abs(di1), np.abs(dv1) / v_nominal_v
    shape = (len(terminals), v1.shape[-1])
    out = Evidence(
        di1_a=np.empty(shape),
        dv1_pu=np.empty(shape),
        z1_ohm=np.empty(shape, np.complex128),
        blocked=np.empty(shape, np.bool_),
        undefined=np.empty(shape, np.bool_),
    )
    for t, terminal in enumerate(terminals):
        m, n, into = terminal.local_point, terminal.remote_point, terminal.into
        out.di1_a[t] = di1_a[m]
        out.dv1_pu[t] = dv1_pu[m]
        out.blocked[t] = ~(alive[m] & alive[n])
        out.z1_ohm[t], out.undefined[t] = connection_impedance(
            v1[1, m], v1[1, n], into * i1[1, m], dv1[m], dv1[n], into * di1[m]
        )
    return out


def _alive(v: Complex, v_nominal_v: float) -> NDArray[np.bool_]:
    """(P, S): the highest phase voltage is up, now and ΔT ago."""
    squared = (v.real**2 + v.imag**2).max(axis=2)
    return np.asarray((squared >= (DEAD_PU * v_nominal_v) ** 2).all(axis=0))
