"""The detector, one comparison at a time: slow, and easy to believe."""

from __future__ import annotations

from openphase.detector.criteria import Reason, Settings

__all__ = ["first_failing"]


def first_failing(
    di1_a: float, dv1_pu: float, z1: complex, blocked: bool, undefined: bool, settings: Settings
) -> Reason:
    """The criteria one after the other, as the paper states them."""
    if blocked:
        return Reason.BLOCKED
    if not di1_a >= settings.i_set_a:
        return Reason.CURRENT
    if not dv1_pu <= settings.v_set_pu:
        return Reason.VOLTAGE
    if undefined or not abs(z1) >= settings.z_set_ohm:
        return Reason.IMPEDANCE
    if settings.negative_sign and not z1.real < 0:
        return Reason.SIGN
    return Reason.TRIP
