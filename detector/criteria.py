"""The criteria (22)-(24) and the sign: when a terminal trips, and why it does not."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from .evidence import Evidence

__all__ = ["Reason", "Settings", "reach_ohm", "verdict"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Thresholds of one terminal. ``negative_sign``: only Re Z < 0 trips."""

    i_set_a: float
    v_set_pu: float
    z_set_ohm: float
    negative_sign: bool = True


class Reason(IntEnum):
    """Why a terminal does or does not trip: the first criterion that fails."""

    TRIP = 0
    BLOCKED = 1  #: an end is dead
    CURRENT = 2  #: (22) |ΔI1| < I_set
    VOLTAGE = 3  #: (23) |ΔV1| > V_set: not at the source side
    IMPEDANCE = 4  #: (24) |Z| < Z_set, or no value
    SIGN = 5  #: Re Z >= 0

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
}


def verdict(evidence: Evidence, settings: Settings) -> NDArray[np.int8]:
    """A Reason for every terminal and scenario of ``evidence``, one setting for all."""
    reason = np.zeros(evidence.di1_a.shape, np.int8)
    # the last assignment wins, so the first criterion is written last; written as "not held",
    # so that a number that is none holds no criterion
    if settings.negative_sign:
        reason[~(evidence.z1_ohm.real < 0)] = Reason.SIGN
    reason[~(np.abs(evidence.z1_ohm) >= settings.z_set_ohm) | evidence.undefined] = Reason.IMPEDANCE
    reason[~(evidence.dv1_pu <= settings.v_set_pu)] = Reason.VOLTAGE
    reason[~(evidence.di1_a >= settings.i_set_a)] = Reason.CURRENT
    reason[evidence.blocked] = Reason.BLOCKED
    return reason


def reach_ohm(evidence: Evidence, negative_sign: bool) -> NDArray[np.float64]:
    """The largest Z_set at which (24), the sign and the blocking let a terminal trip; 0: none."""
    able = ~(evidence.blocked | evidence.undefined)
    if negative_sign:
        able &= evidence.z1_ohm.real < 0
    return np.where(able, np.abs(evidence.z1_ohm), 0.0)
