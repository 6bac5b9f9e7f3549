"""In-line transformers and regulators as two-ports between the phases of two buses.

A transformer is made of coil pairs: each to-coil has the from-coil's voltage times the turns
ratio, less the drop of its leakage. Their admittances between the six terminals, neutrals
eliminated, add up where several units make one bank. The ladder takes them as

    V_low = T V_up - Z I_low,   I_up = T' I_low + Y V_up,

and the modes of V_low that no coil holds: behind an ungrounded winding the common one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .parts import InlineTransformer, Regulator
from .phases import conductors, phase_mask, phase_rows

__all__ = ["TwoPort", "bank_admittance", "regulator_impedance", "regulator_ratio", "two_port"]

Complex = NDArray[np.complex128]

EARTH = -1
FROM, TO = 0, 3  #: first terminal of either side
FROM_NEUTRAL, TO_NEUTRAL, STAR = 6, 7, 8
TINY = 1e-11  #: what rounding leaves of a zero, as a share of the largest entry


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TwoPort:
    """What stands in an edge, upper end first."""

    turn: Complex  #: (3, 3) T
    z_ohm: Complex  #: (3, 3) Z
    shunt_s: Complex  #: (3, 3) Y
    modes: NDArray[np.float64]  #: (n, 3)


def bank_admittance(units: Sequence[InlineTransformer], ends: tuple[str, str]) -> Complex:
    """(6, 6) admittance between the phases of two buses, those of ``ends[0]`` first."""
    total = np.zeros((6, 6), np.complex128)
    for unit in units:
        own = _unit_admittance(unit)
        if unit.from_bus != ends[0]:
            own = np.roll(own, 3, axis=(0, 1))
        total += own
    return total


def _unit_admittance(unit: InlineTransformer) -> Complex:
    """(6, 6) of one transformer, from-side first."""
    y = np.zeros((9, 9), np.complex128)
    if unit.connection == "centre-tap":
        _add_centre_tap(y, unit)
    else:
        _add_pairs(y, unit)
    return _without_inner(y)


def _add_pairs(y: Complex, unit: InlineTransformer) -> None:
    """The coil pairs of a two-winding transformer."""
    pairs = _coil_pairs(unit)
    from_kv, to_kv = _winding_kv(unit)
    ratio = to_kv * unit.to_tap / (from_kv * unit.from_tap)
    base = (to_kv * 1000.0) ** 2 * len(pairs) / (unit.rating_kva * 1000.0) * unit.to_tap**2
    series, across = 1.0 / (unit.leakage_pu * base), unit.magnetizing_pu / base
    for own, other in pairs:
        coil = _row(other) - ratio * _row(own)
        y += series * np.outer(coil, coil) + across * np.outer(_row(other), _row(other))
    for neutral, ohm in ((FROM_NEUTRAL, unit.from_neutral_ohm), (TO_NEUTRAL, unit.to_neutral_ohm)):
        if ohm != 0.0:
            y[neutral, neutral] += 1.0 / ohm


def _add_centre_tap(y: Complex, unit: InlineTransformer) -> None:
    """Three windings: their leakages meet in a star, in volts of one leg."""
    leg_kv = unit.kv_to / 2.0
    ratio = leg_kv * unit.to_tap / (unit.kv_from * unit.from_tap)
    base = (leg_kv * 1000.0) ** 2 / (unit.rating_kva * 1000.0) * unit.to_tap**2
    leg_pu = unit.leakage_pu if unit.leg_leakage_pu is None else unit.leg_leakage_pu
    star = np.zeros(9)
    star[STAR] = 1.0
    primary = star - ratio * _row(_single(unit.phases, FROM))
    y += np.outer(primary, primary) / (unit.leakage_pu * base)
    for phase, sign in zip(phase_rows(unit.to_phases), (1.0, -1.0), strict=True):
        leg = np.zeros(9)
        leg[TO + phase] = sign
        y += np.outer(star - leg, star - leg) / (leg_pu * base)
        if sign > 0.0:
            y += np.outer(leg, leg) * unit.magnetizing_pu / base


def _winding_kv(unit: InlineTransformer) -> tuple[float, float]:
    if unit.connection == "single":
        return unit.kv_from, unit.kv_to
    sides = unit.connection.split("/")
    kv = [v if side == "D" else v / 3.0**0.5 for side, v in zip(sides, _kv(unit), strict=True)]
    return kv[0], kv[1]


def _kv(unit: InlineTransformer) -> tuple[float, float]:
    return unit.kv_from, unit.kv_to


def _single(phases: str, first: int) -> tuple[int, int]:
    """Terminals of a winding over one phase and earth, or over two phases."""
    rows = [first + row for row in phase_rows(phases)]
    return rows[0], rows[1] if len(rows) > 1 else EARTH


def _coil_pairs(unit: InlineTransformer) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Terminals of each from-coil and of the to-coil on the same limb."""
    if unit.connection == "single":
        return [(_single(unit.phases, FROM), _single(unit.to_phases, TO))]
    from_side, to_side = unit.connection.split("/")
    lag = unit.shift == "lag"
    # a delta coil of phase i goes to the phase before it or after it
    from_next = 2 if lag and to_side != "D" else 1
    to_next = 1 if lag or from_side == "D" else 2

    def coil(side: str, i: int, first: int, neutral: int, onwards: int) -> tuple[int, int]:
        if side == "D":
            return first + i, first + (i + onwards) % 3
        earthed = (
            side == "Yg"
            and (unit.from_neutral_ohm if first == FROM else unit.to_neutral_ohm) == 0.0
        )
        return first + i, EARTH if earthed else neutral

    return [
        (
            coil(from_side, i, FROM, FROM_NEUTRAL, from_next),
            coil(to_side, i, TO, TO_NEUTRAL, to_next),
        )
        for i in range(3)
    ]


def _row(terminals: tuple[int, int]) -> NDArray[np.float64]:
    row = np.zeros(9)
    row[terminals[0]] = 1.0
    if terminals[1] != EARTH:
        row[terminals[1]] = -1.0
    return row


def _without_inner(y: Complex) -> Complex:
    """Neutrals and the star eliminated; what no current defines of them matters to nobody."""
    own, inner = y[:6, :6], y[6:, 6:]
    used = np.flatnonzero(np.abs(inner).max(axis=1) > 0.0)
    if not used.size:
        return own
    inner, to_inner = inner[np.ix_(used, used)], y[:6, 6 + used]
    return np.asarray(own - to_inner @ np.linalg.pinv(inner, rcond=1e-9) @ to_inner.T)


def two_port(y: Complex, upward: bool, name: str) -> TwoPort:
    """The bank as the ladder takes it, ``upward``: its first bus is the upper one.

    Raises InputError where its windings leave two modes or more at the lower bus undefined.
    """
    upper, lower = (slice(0, 3), slice(3, 6)) if upward else (slice(3, 6), slice(0, 3))
    y_uu, y_ul, y_lu, y_ll = y[upper, upper], y[upper, lower], y[lower, upper], y[lower, lower]
    there = np.flatnonzero(np.abs(y_ll).max(axis=1) > 0.0)
    z = np.zeros((3, 3), np.complex128)
    small = y_ll[np.ix_(there, there)]
    left, values, right = np.linalg.svd(small)
    held = values > 1e-9 * values.max(initial=0.0)
    modes = np.zeros((int((~held).sum()), 3))
    if modes.shape[0] > 1:
        raise InputError.single(
            name, "windings", f"{modes.shape[0]} voltages that nothing holds", "must be at most 1"
        )
    inverse = (right.conj().T[:, held] / values[held]) @ left.conj().T[held]
    z[np.ix_(there, there)] = inverse
    if modes.shape[0]:
        free = right[~held][0].conj()
        free = free / free[np.argmax(np.abs(free))]
        modes[0, there] = free.real
    turn = _clean(-z @ y_lu)
    return TwoPort(
        turn=turn,
        z_ohm=_clean(z),
        shunt_s=_clean(y_uu + y_ul @ turn, float(np.abs(y_uu).max())),
        modes=np.where(np.abs(modes) < 1e-9, 0.0, modes),
    )


def _clean(matrix: Complex, scale: float | None = None) -> Complex:
    """Exact zeros where rounding left almost nothing, real and imaginary part by themselves."""
    limit = TINY * (float(np.abs(matrix).max(initial=0.0)) if scale is None else scale)
    real = np.where(np.abs(matrix.real) < limit, 0.0, matrix.real)
    imag = np.where(np.abs(matrix.imag) < limit, 0.0, matrix.imag)
    return np.asarray(real + 1j * imag)


def regulator_ratio(part: Regulator, upward: bool) -> NDArray[np.float64]:
    """(3,) lower over upper voltage of each phase; 1 where there is no unit."""
    taps = 1.0 + np.array(part.taps) * part.step_pct / 100.0
    there = np.array([phase in part.phases for phase in "abc"])
    taps = np.where(there, taps, 1.0)
    if not upward and part.reference == "next":
        raise InputError.single(
            part.name, "reference", "'next', fed from its to-side", "must be fed from its from-side"
        )
    return np.asarray(taps if upward else 1.0 / taps)


def regulator_reference(part: Regulator) -> NDArray[np.int64]:
    """(3,) the phase that each phase refers to; -1: earth."""
    if part.reference == "earth":
        return np.full(3, EARTH, np.int64)
    if part.reference == "next":
        return np.array([1, 2, 0], np.int64)
    common = "abc".index(part.reference)
    return np.array([EARTH if i == common else common for i in range(3)], np.int64)


def regulator_impedance(part: Regulator, upward: bool) -> Complex:
    """(3, 3) series impedance seen from the lower side, at the file's taps."""
    z = np.zeros((3, 3), np.complex128)
    ratio = regulator_ratio(part, True)
    for phase in phase_rows(part.phases):
        z[phase, phase] = part.z_ohm * ratio[phase] ** 2
    if part.reference in "abc":
        # every unit's return current comes back through the phase they refer to
        rows = phase_rows(conductors(part))
        z[np.ix_(rows, rows)] += part.jumper_ohm
    if upward or not z.any():
        return z
    turn = np.diag(ratio).astype(np.complex128)
    for i, other in enumerate(regulator_reference(part)):
        if other >= 0:
            turn[i, other] += 1.0 - ratio[i]
    back = np.linalg.inv(turn)
    return np.asarray(back @ z @ back.T)


def mask_of(units: Sequence[InlineTransformer], bus: str) -> int:
    """Phases that the bank's windings touch at ``bus``."""
    masks = [phase_mask(u.phases if u.from_bus == bus else u.to_phases) for u in units]
    return int(np.bitwise_or.reduce(masks))
