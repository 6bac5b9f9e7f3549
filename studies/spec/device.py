"""The grids of settings that a relay can hold."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Literal

from ...model.errors import InputError

__all__ = ["MOST_STEPS", "CurrentUnit", "Device", "Steps"]

MOST_STEPS = 10_000
"""The most numbers that `Steps` may hold: beyond it a mistyped step is likelier."""

CurrentUnit = Literal["A", "pu"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """Numbers in even steps, both ends among them.

    Examples
    --------
    >>> Steps(first=0.1, last=0.4, step=0.1).values()
    (0.1, 0.2, 0.3, 0.4)
    """

    first: float
    last: float
    step: float

    def values(self) -> tuple[float, ...]:
        """Return the numbers, each the float nearest to its decimal.

        Adding up floats would miss: three steps of 0.1 are 0.30000000000000004, which is
        not the 0.3 that a relay is set to.

        Raises
        ------
        InputError
            If the steps do not lead from first to last, or are more than `MOST_STEPS`.
        """
        first, last, step = (Fraction(str(x)) for x in (self.first, self.last, self.step))
        if step <= 0 or last < first:
            raise _unfit("must have a step > 0 and last >= first")
        count = (last - first) / step
        if count.denominator != 1:
            raise _unfit("must reach last from first in whole steps")
        if count >= MOST_STEPS:
            raise _unfit(f"must hold at most {MOST_STEPS} numbers")
        return tuple(float(first + k * step) for k in range(int(count) + 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class Device:
    """The settings that a relay can hold: guesses, until its manual is at hand.

    Parameters
    ----------
    unit
        What `i_set` is in: primary A, or pu of `ct_primary_a`.
    i_set
        Current threshold of eq. (22).
    z_set_ohm
        Impedance threshold of eq. (24), primary ohm: ranges, one above the other.
    v_set_pct
        Voltage threshold of eq. (23), percent of the nominal phase voltage, rising.
    ct_primary_a
        Primary current that is 1 pu to the relay, A. The 100 A is a guess, with which the
        0.01 pu in the paper's Table I is the 1 A it is said to be.
    """

    unit: CurrentUnit = "A"
    i_set: Steps = Steps(first=0.1, last=10.0, step=0.1)
    z_set_ohm: tuple[Steps, ...] = (
        Steps(first=0.1, last=50.0, step=0.1),
        Steps(first=51.0, last=300.0, step=1.0),
    )
    v_set_pct: tuple[float, ...] = (0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0)
    ct_primary_a: float = 100.0

    def i_grid(self) -> tuple[float, ...]:
        """Return the values of I_set in rising order, primary A whatever the unit.

        Raises
        ------
        InputError
            If there are none, or they do not rise; likewise from the other grids.

        Examples
        --------
        >>> per_unit = Steps(first=0.001, last=0.003, step=0.001)
        >>> Device(unit="pu", i_set=per_unit, ct_primary_a=600.0).i_grid()
        (0.6, 1.2, 1.8)
        """
        one = Fraction(1) if self.unit == "A" else Fraction(str(self.ct_primary_a))
        return _rising(float(Fraction(str(value)) * one) for value in self.i_set.values())

    def z_grid(self) -> tuple[float, ...]:
        """Return the values of Z_set in rising order, primary ohm."""
        return _rising(value for steps in self.z_set_ohm for value in steps.values())

    def v_grid_pu(self) -> tuple[float, ...]:
        """Return the values of V_set in rising order, pu of the nominal phase voltage.

        Examples
        --------
        >>> Device(v_set_pct=(0.7, 7.0)).v_grid_pu()
        (0.007, 0.07)
        """
        return _rising(float(Fraction(str(pct)) / 100) for pct in self.v_set_pct)


def _rising(numbers: Iterable[float]) -> tuple[float, ...]:
    """Return the numbers; raise if there are none or if one is not above that before it."""
    values = tuple(numbers)
    if not values:
        raise _unfit("must hold at least one number")
    if any(after <= before for before, after in pairwise(values)):
        raise _unfit("must hold numbers that rise")
    return values


def _unfit(rule: str) -> InputError:
    return InputError.single("", "a grid of settings", None, rule)
