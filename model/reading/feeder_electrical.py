"""What the parts of a feeder must be together for the model to represent them."""

from __future__ import annotations

from ..errors import KeyPath, Report
from ..parts import Feeder, Source
from .feeder_earth import check_isolated, check_three_wires
from .feeder_series import check_series
from .feeder_shunts import check_shunts
from .own_checks import OwnChecks, ohm

__all__ = ["check_electrical"]


def check_electrical(feeder: Feeder, report: Report) -> None:
    """Check values that only together can be right or wrong.

    A value that has been reported by itself says nothing beside others.
    """
    own = OwnChecks(report)
    _check_neutral(feeder.source, own)
    check_series(feeder, own)
    check_shunts(feeder, own)
    if feeder.source.wires == 3:
        check_three_wires(feeder, own)
    if feeder.source.neutral == "isolated" and not report.faults:
        check_isolated(feeder, own)


def _check_neutral(source: Source, own: OwnChecks) -> None:
    """The impedance of the neutral is there exactly where it is one."""
    path: KeyPath = ("source", "neutral_ohm")
    z, neutral = source.neutral_ohm, source.neutral
    beside = ("neutral",)
    if neutral in ("solid", "isolated"):
        if z != 0.0:
            rule = f"must be left out for a neutral that is {neutral}"
            own.add(path, beside, rule, ohm(z))
    elif z == 0.0:
        own.add(path, beside, f"is missing: neutral = '{neutral}' needs it", None)
    elif neutral == "resistor" and z.real == 0.0:
        own.add(path, beside, "must have a resistance > 0 for a resistor", ohm(z))
    elif neutral == "petersen" and z.imag <= 0.0:
        own.add(path, beside, "must have a reactance > 0 for a Petersen coil", ohm(z))
