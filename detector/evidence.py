"""The few numbers a decision needs, per terminal and scenario."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..model.compiled import compiled
from ..model.points import Terminal
from .impedance import impedance_of
from .options import Options
from .superimpose import (
    compensated,
    negative_sequence,
    positive_sequence,
    superimposed,
    zero_sequence,
)

__all__ = [
    "DEAD_PU",
    "Evidence",
    "Phasors",
    "evidence_of",
    "only",
    "reversed_terminals",
    "with_alarm",
]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Flags = NDArray[np.bool_]
Int = NDArray[np.int64]

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
    """What T terminals see in S scenarios.

    Of R rows the first is the positive sequence; where the fallback was asked for, three more
    are the phases a, b, c. Fields that no option asked for are None.
    """

    di_a: Real  #: (T, R, S) |ΔI|
    dv_pu: Real  #: (T, R, S) |ΔV| on the nominal phase voltage there
    z_ohm: Complex  #: (T, R, S) eq. (5); 0 where undefined
    undefined: Flags  #: (T, R, S) eq. (5) has no value
    blocked: Flags  #: (T, S) either end is dead, now or ΔT ago
    di_star_a: Real | None = None  #: (T, R, S) |ΔI*|, what the local voltage does not explain
    dv_remote_star_v: Real | None = None  #: (T, R, S) |ΔV*| of the remote end, likewise
    di2_a: Real | None = None  #: (T, S) |ΔI2|
    di0_a: Real | None = None  #: (T, S) |ΔI0|
    unbalance_rise_a: Real | None = None  #: (T, S) |I2| + |I0|, now less ΔT ago
    far_di_a: Real | None = None  #: (T, R, S) |ΔI| at the far end
    far_z_ohm: Complex | None = None  #: (T, R, S) eq. (5) there
    far_undefined: Flags | None = None  #: (T, R, S)
    alarm: NDArray[np.int8] | None = None  #: (T, S) a wiring ``Alarm``; 0: none

    @property
    def di1_a(self) -> Real:
        """|ΔI1|, (T, S)."""
        return self.di_a[:, 0]

    @property
    def dv1_pu(self) -> Real:
        """|ΔV1| on nominal phase voltage, (T, S)."""
        return self.dv_pu[:, 0]

    @property
    def z1_ohm(self) -> Complex:
        """Eq. (5) in the positive sequence, (T, S); 0 where undefined."""
        return self.z_ohm[:, 0]


def evidence_of(
    phasors: Phasors, terminals: tuple[Terminal, ...], v_nominal_v: float | Real, *options: Options
) -> Evidence:
    """Evidence of every directed terminal from what the points report.

    Parameters
    ----------
    phasors : Phasors
    terminals : tuple of Terminal
        Where both ends are compared, both directions of each section.
    v_nominal_v : float or (P,) array
        Nominal phase voltage, of all points or of each.
    *options : Options
        What will be judged with the evidence, ``Options()`` where none is given; what none of
        them asks for is not computed.
    """
    asked = options or (Options(),)
    v1, i1 = positive_sequence(phasors.v), positive_sequence(phasors.i)
    v, i = [v1[:, :, None]], [i1[:, :, None]]
    if any(own.fallback for own in asked):
        v.append(phasors.v)
        i.append(phasors.i)
    nominal = np.broadcast_to(np.asarray(v_nominal_v, np.float64), phasors.v.shape[1:2])
    evidence = _base(v, i, terminals, _alive(phasors.v, nominal), nominal)
    if any(own.compensated or own.any_sequence for own in asked):
        evidence = _with_star(evidence, v, i, terminals)
    if any(own.any_sequence or own.unbalance > 0 or own.direction for own in asked):
        evidence = _with_unbalance(evidence, phasors.i, terminals)
    if any(own.both_ends != "off" for own in asked):
        evidence = _with_far_end(evidence, terminals)
    return evidence


def only(evidence: Evidence, t: int) -> Evidence:
    """The evidence of one terminal, its axis kept at length one."""
    parts: dict[str, Any] = {}
    for field in fields(evidence):
        values = getattr(evidence, field.name)
        parts[field.name] = None if values is None else values[t : t + 1]
    return Evidence(**parts)


def with_alarm(evidence: Evidence, alarm: NDArray[np.int8]) -> Evidence:
    """The evidence of terminals that do not trip where their wiring is in doubt, (T, S)."""
    return replace(evidence, alarm=alarm)


def reversed_terminals(terminals: tuple[Terminal, ...]) -> Int:
    """(T,) index of each terminal's other direction; -1 where it is not among them."""
    place = {(t.local_point, t.remote_point): n for n, t in enumerate(terminals)}
    return np.array([place.get((t.remote_point, t.local_point), -1) for t in terminals], np.int64)


def _base(
    v: list[Complex],
    i: list[Complex],
    terminals: tuple[Terminal, ...],
    alive: Flags,
    v_nominal_v: Real,
) -> Evidence:
    """The paper's quantities; ``v`` and ``i`` hold rows, (2, P, r, S) each."""
    local, remote = _ends(terminals)
    into = np.array([terminal.into for terminal in terminals])
    shape = (len(terminals), sum(rows.shape[2] for rows in v), v[0].shape[-1])
    seen = _Seen(
        di_a=np.empty(shape),
        dv_pu=np.empty(shape),
        z_ohm=np.empty(shape, np.complex128),
        undefined=np.empty(shape, np.bool_),
    )
    stop = 0
    for volts, amperes in zip(v, i, strict=True):
        rows = slice(stop, stop + volts.shape[2])
        own = _Seen(
            di_a=seen.di_a[:, rows],
            dv_pu=seen.dv_pu[:, rows],
            z_ohm=seen.z_ohm[:, rows],
            undefined=seen.undefined[:, rows],
        )
        _look(volts, amperes, local, remote, into, own)
        stop = rows.stop
    np.divide(seen.dv_pu, v_nominal_v[local, None, None], out=seen.dv_pu)
    return Evidence(
        di_a=seen.di_a,
        dv_pu=seen.dv_pu,
        z_ohm=seen.z_ohm,
        undefined=seen.undefined,
        blocked=~(alive[local] & alive[remote]),
    )


class _Seen(NamedTuple):
    """As in ``Evidence``, for compiled code."""

    di_a: Real
    dv_pu: Real
    z_ohm: Complex
    undefined: Flags


@compiled
def _look(v: Complex, i: Complex, local: Int, remote: Int, into: Real, seen: _Seen) -> None:
    """Fill ``seen``, (T, r, S), from rows of (2, P, r, S); ``dv_pu`` in volts yet."""
    terminals, rows, size = seen.di_a.shape
    for t in range(terminals):
        m, n = local[t], remote[t]
        for r in range(rows):
            for s in range(size):
                dv, di = v[1, m, r, s] - v[0, m, r, s], i[1, m, r, s] - i[0, m, r, s]
                seen.di_a[t, r, s] = math.sqrt(di.real * di.real + di.imag * di.imag)
                seen.dv_pu[t, r, s] = math.sqrt(dv.real * dv.real + dv.imag * dv.imag)
                seen.z_ohm[t, r, s], seen.undefined[t, r, s] = impedance_of(
                    v[1, m, r, s],
                    v[1, n, r, s],
                    into[t] * i[1, m, r, s],
                    dv,
                    v[1, n, r, s] - v[0, n, r, s],
                    into[t] * di,
                )


def _with_star(
    evidence: Evidence, v: list[Complex], i: list[Complex], terminals: tuple[Terminal, ...]
) -> Evidence:
    """Add the changes that the local voltage does not explain."""
    local, remote = _ends(terminals)
    di, dv = [], []
    for volts, amperes in zip(v, i, strict=True):
        own = volts[1, local], volts[0, local]
        di.append(np.abs(compensated(amperes[1, local], amperes[0, local], *own)))
        dv.append(np.abs(compensated(volts[1, remote], volts[0, remote], *own)))
    return replace(
        evidence,
        di_star_a=np.concatenate(di, axis=1),
        dv_remote_star_v=np.concatenate(dv, axis=1),
    )


def _with_unbalance(evidence: Evidence, i: Complex, terminals: tuple[Terminal, ...]) -> Evidence:
    """Add what the other two sequences of the current do."""
    local, _ = _ends(terminals)
    i2, i0 = negative_sequence(i), zero_sequence(i)
    in_all = np.abs(i2) + np.abs(i0)
    return replace(
        evidence,
        di2_a=np.abs(superimposed(i2[1], i2[0]))[local],
        di0_a=np.abs(superimposed(i0[1], i0[0]))[local],
        unbalance_rise_a=(in_all[1] - in_all[0])[local],
    )


def _with_far_end(evidence: Evidence, terminals: tuple[Terminal, ...]) -> Evidence:
    """Add what the other end of each section says."""
    far = reversed_terminals(terminals)
    if (far < 0).any():
        alone = ", ".join(t.name for t, other in zip(terminals, far, strict=True) if other < 0)
        raise ValueError(f"both ends are compared, and the far end is not asked: {alone}")
    return replace(
        evidence,
        far_di_a=evidence.di_a[far],
        far_z_ohm=evidence.z_ohm[far],
        far_undefined=evidence.undefined[far],
    )


def _ends(terminals: tuple[Terminal, ...]) -> tuple[Int, Int]:
    """(T,) local and remote points."""
    pairs = np.array([(t.local_point, t.remote_point) for t in terminals], np.int64).reshape(-1, 2)
    return pairs[:, 0].copy(), pairs[:, 1].copy()


def _alive(v: Complex, v_nominal_v: Real) -> Flags:
    """(P, S): the highest phase voltage is up, now and ΔT ago."""
    squared = (v.real**2 + v.imag**2).max(axis=2)
    return np.asarray((squared >= ((DEAD_PU * v_nominal_v) ** 2)[:, None]).all(axis=0))
