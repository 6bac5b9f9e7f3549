"""The criteria (22)-(24), the sign and the options: when a terminal trips, and why it does not.

A setting trips an event exactly where I_set, V_set and Z_set lie within the reach of the
positive sequence; or, the trigger of that being below I_set, within the reach of a phase.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from .evidence import Evidence
from .options import BothEnds, Options

__all__ = [
    "FAR_FLOOR_A",
    "BothEnds",
    "Options",
    "Reach",
    "Reason",
    "Settings",
    "reach_of",
    "verdict",
]

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]
T = TypeVar("T", bound=np.generic)

#: a change below it is no measurement at the far end: two frames' errors of 0.05 A each
FAR_FLOOR_A = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Thresholds of one terminal, and the options with which they are judged."""

    i_set_a: float
    v_set_pu: float
    z_set_ohm: float
    options: Options = field(default_factory=Options)


class Reason(IntEnum):
    """Why a terminal does or does not trip: the first criterion that fails.

    Where the phases stand in and none trips, the PHASE reasons tell it of the one that fails last.
    """

    TRIP = 0
    BLOCKED = 1  #: an end is dead
    CURRENT = 2  #: (22) |ΔI| < I_set
    VOLTAGE = 3  #: (23) |ΔV1| > V_set: not at the source side
    IMPEDANCE = 4  #: (24) |Z| < Z_set, or no value
    SIGN = 5  #: Re Z >= 0
    FLOOR = 6  #: the far end has hardly moved
    UNBALANCE = 7  #: a balanced change
    DIRECTION = 8  #: a closing
    FAR_END = 9  #: the other end says otherwise
    PHASE_VOLTAGE = 10
    PHASE_IMPEDANCE = 11
    PHASE_SIGN = 12
    PHASE_FLOOR = 13
    PHASE_FAR_END = 14
    WIRING = 15  #: supervision doubts the wiring

    @property
    def text(self) -> str:
        """The reason in a reader's words."""
        return _TEXT[self]


_TEXT = {
    Reason.TRIP: "trip",
    Reason.BLOCKED: "blocked: an end of the section is dead",
    Reason.CURRENT: "(22): |ΔI1| below I_set",
    Reason.VOLTAGE: "(23): |ΔV1| above V_set",
    Reason.IMPEDANCE: "(24): |Z1| below Z_set",
    Reason.SIGN: "sign: Re Z1 is not negative",
    Reason.FLOOR: "floor: |ΔV1*| of the far end too small",
    Reason.UNBALANCE: "unbalance: a balanced change",
    Reason.DIRECTION: "direction: a closing, not an opening",
    Reason.FAR_END: "far end: its Z1 does not agree",
    Reason.PHASE_VOLTAGE: "(22): |ΔI1| below I_set; phases: (23), |ΔV| above V_set",
    Reason.PHASE_IMPEDANCE: "(22): |ΔI1| below I_set; phases: (24), |Z| below Z_set",
    Reason.PHASE_SIGN: "(22): |ΔI1| below I_set; phases: Re Z is not negative",
    Reason.PHASE_FLOOR: "(22): |ΔI1| below I_set; phases: |ΔV*| of the far end too small",
    Reason.PHASE_FAR_END: "(22): |ΔI1| below I_set; phases: the far end does not agree",
    Reason.WIRING: "blocked: the wiring is in doubt",
}

_IN_PHASES = np.array([int(reason) for reason in Reason], np.int8)
_IN_PHASES[[Reason.VOLTAGE, Reason.IMPEDANCE, Reason.SIGN, Reason.FLOOR, Reason.FAR_END]] = [
    Reason.PHASE_VOLTAGE,
    Reason.PHASE_IMPEDANCE,
    Reason.PHASE_SIGN,
    Reason.PHASE_FLOOR,
    Reason.PHASE_FAR_END,
]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reach:
    """Up to where settings trip, (T, R, S); R is 4 with the fallback, else 1.

    Row 0, the positive sequence, trips where I_set <= ``di_a``, V_set >= ``dv_pu`` and
    Z_set <= ``z_ohm``; rows 1..3, the phases, where besides I_set > ``di_a`` of row 0.
    """

    di_a: Real
    dv_pu: Real
    z_ohm: Real  #: the largest Z_set that trips; 0: none


def reach_of(evidence: Evidence, options: Options) -> Reach:
    """All settings that trip, options and blocking applied."""
    z_ohm = np.minimum(_size(evidence, options), _far_limit(evidence, options))
    for _, holds in _conditions(evidence, options):
        z_ohm = np.where(holds, z_ohm, 0.0)
    return Reach(
        di_a=_trigger(evidence, options),
        dv_pu=_judged(evidence.dv_pu, options),
        z_ohm=np.where(_barred(evidence)[:, None], 0.0, z_ohm),
    )


def verdict(evidence: Evidence, settings: Settings) -> NDArray[np.int8]:
    """A Reason for every terminal and scenario, (T, S), one setting for all."""
    options = settings.options
    di_a = _trigger(evidence, options)
    reason = np.zeros(di_a.shape, np.int8)
    in_order = [
        (Reason.CURRENT, di_a >= settings.i_set_a),
        (Reason.VOLTAGE, _judged(evidence.dv_pu, options) <= settings.v_set_pu),
        (Reason.IMPEDANCE, _size(evidence, options) >= settings.z_set_ohm),
        *_conditions(evidence, options),
        (Reason.FAR_END, _far_limit(evidence, options) >= settings.z_set_ohm),
    ]
    # the last one wins; a number that is none holds nothing
    for why, holds in reversed(in_order):
        reason *= holds  # products of small numbers: several times as fast as a choice
        reason += ~holds * np.int8(why)
    found = _stood_in(reason, di_a[:, 0] < settings.i_set_a)
    found[evidence.blocked] = Reason.BLOCKED
    if evidence.alarm is not None:
        found[evidence.alarm != 0] = Reason.WIRING
    return found


def _stood_in(reason: NDArray[np.int8], idle: Flags) -> NDArray[np.int8]:
    """(T, S) of (T, R, S): where row 0 is ``idle``, that of the phase that came furthest."""
    found = reason[:, 0].copy()
    phases = reason[:, 1:]
    if phases.shape[1]:
        # reasons stand in the order of the criteria, but for the trip
        furthest = np.where((phases == Reason.TRIP).any(axis=1), Reason.TRIP, phases.max(axis=1))
        found = np.where(idle, _IN_PHASES[furthest], found)
    return found


def _barred(evidence: Evidence) -> Flags:
    """(T, S): whatever the numbers, no trip."""
    if evidence.alarm is None:
        return evidence.blocked
    return np.asarray(evidence.blocked | (evidence.alarm != 0))


def _trigger(evidence: Evidence, options: Options) -> Real:
    """(T, R, S) the current that criterion (22) compares."""
    di_a = _judged(evidence.di_a, options)
    if options.compensated:
        di_a = np.minimum(di_a, _judged(evidence.di_star_a, options))
    if options.any_sequence:
        first = np.maximum(di_a[:, 0], _other_sequences(evidence))
        di_a = np.concatenate([first[:, None], di_a[:, 1:]], axis=1)
    return di_a


def _size(evidence: Evidence, options: Options) -> Real:
    """(T, R, S) |Z|; 0 where it has no value."""
    size = np.abs(_judged(evidence.z_ohm, options))
    size[_judged(evidence.undefined, options)] = 0.0
    return size


def _conditions(evidence: Evidence, options: Options) -> list[tuple[Reason, Flags]]:
    """What must hold whatever the thresholds, in their order, (T, R or 1, S)."""
    found = []
    if options.negative_sign:
        negative = _judged(evidence.z_ohm, options).real < 0
        if options.any_sequence:
            star_a = _judged(evidence.di_star_a, options)[:, 0]
            negative[:, 0] |= star_a < options.waive_sign_below_a
        found.append((Reason.SIGN, negative))
    if options.any_sequence:
        moved_v = _judged(evidence.dv_remote_star_v, options)
        found.append((Reason.FLOOR, moved_v >= options.floor_v))
    if options.unbalance > 0:
        enough = _other_sequences(evidence) >= options.unbalance * evidence.di1_a
        found.append((Reason.UNBALANCE, enough[:, None]))
    if options.direction:
        found.append((Reason.DIRECTION, (_known(evidence.unbalance_rise_a) >= 0)[:, None]))
    return found


def _far_limit(evidence: Evidence, options: Options) -> Real:
    """(T, R, S) the largest Z_set to which the far end does not object; infinite: any."""
    if options.both_ends == "off":
        return np.full((1, 1, 1), np.inf)
    z_ohm = _judged(evidence.far_z_ohm, options)
    speaks = _judged(evidence.far_di_a, options) >= FAR_FLOOR_A
    speaks &= ~_judged(evidence.far_undefined, options)
    if options.both_ends == "no_small_z":
        return np.where(speaks, np.abs(z_ohm), np.inf)
    return np.where(speaks & (z_ohm.real < 0), np.abs(z_ohm), 0.0)


def _other_sequences(evidence: Evidence) -> Real:
    """(T, S) the larger of |ΔI2| and |ΔI0|."""
    return np.maximum(_known(evidence.di2_a), _known(evidence.di0_a))


def _judged(values: NDArray[T] | None, options: Options) -> NDArray[T]:
    """The rows (T, R, S) that ``options`` judge by."""
    rows = 4 if options.fallback else 1
    return _known(values, rows)[:, :rows]


def _known(values: NDArray[T] | None, rows: int = 0) -> NDArray[T]:
    if values is None or values.shape[1] < rows:
        raise ValueError("evidence_of was not told of the options that its evidence is judged with")
    return values
