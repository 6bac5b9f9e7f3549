"""The window of Z_set in a closed loop.

Within a loop the far side of a break is fed the other way round, so a break in the section
shows |Z| = |Z_loop - Z_section| instead of the large impedance of the loads. Z_set must stay
below that by a margin m2. What happens outside the section shows the section's own impedance,
and Z_set must stay above that by a margin m1:

    m1 |Z_section| <= Z_set <= |Z_loop - Z_section| / m2

which a section can meet only up to |Z_loop| / (1 + m1 m2), where section and loop have one
angle. The paper's "less than the total line impedance" (section V) leaves more than there is.

The lower bound is worth no more than that. What happens inside the section may show more
without being a break: a load near an end 1.37 of 0.85 ohm in the paper's loop, and phases that
close inside the very |Z_loop - Z_section| of their opening, which no Z_set in the window keeps
out, however short the section is. So a window only says where to look; whether a setting in it
is secure is for the sample of harmless events to say.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Remedy", "Window", "loop_window", "overlap", "remedy"]

Real = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """Where Z_set must lie, both ends included."""

    low_ohm: float = 0.0
    high_ohm: float = math.inf

    @property
    def empty(self) -> bool:
        """Whether no Z_set lies in it, whatever the device."""
        return not self.low_ohm <= self.high_ohm

    def holds(self, z_set_ohm: Real) -> NDArray[np.bool_]:
        """Which of these values lie in it."""
        return np.asarray((self.low_ohm <= z_set_ohm) & (z_set_ohm <= self.high_ohm))


@dataclass(frozen=True, slots=True, kw_only=True)
class Remedy:
    """What would open an empty window, each with all else as it is.

    A margin below 1 says that lowering it does not help.
    """

    longest_section_ohm: float  #: |Z1| of the longest section, of the loop's angle; <= 0: none
    m1: float  #: largest with the present m2
    m2: float  #: largest with the present m1
    both: float  #: largest m1 = m2


def loop_window(
    section_ohm: complex, loop_ohm: complex, loop_margins: tuple[float, float]
) -> Window:
    """Where Z_set of a section in a closed loop must lie.

    Parameters
    ----------
    section_ohm, loop_ohm : complex
        Positive-sequence line impedance of the section, and of the whole loop with it.
    loop_margins : tuple of (m1, m2)
        Towards harmless events and towards breaks.
    """
    m1, m2 = loop_margins
    return Window(
        low_ohm=m1 * abs(section_ohm),
        high_ohm=abs(loop_ohm - section_ohm) / m2,
    )


def overlap(windows: Sequence[Window]) -> Window:
    """What lies in all of them: for one setting in several states of the network."""
    return Window(
        low_ohm=max((own.low_ohm for own in windows), default=0.0),
        high_ohm=min((own.high_ohm for own in windows), default=math.inf),
    )


def remedy(
    section_ohm: complex,
    loop_ohm: complex,
    loop_margins: tuple[float, float],
    z_set_ohm: Real | None = None,
) -> Remedy:
    """What would open the window of a loop, with the values of a device if they are given.

    Examples
    --------
    >>> found = remedy(1.0, 4.0, (2.0, 2.0))
    >>> found.longest_section_ohm, found.m1, found.m2, round(found.both, 3)
    (0.8, 1.5, 1.5, 1.732)
    """
    (m1, m2), section, loop = loop_margins, abs(section_ohm), abs(loop_ohm)
    rest = abs(loop_ohm - section_ohm)
    if z_set_ohm is None:
        return Remedy(
            longest_section_ohm=loop / (1.0 + m1 * m2),
            m1=_ratio(rest, m2 * section),
            m2=_ratio(rest, m1 * section),
            both=math.sqrt(_ratio(rest, section)),
        )
    each = z_set_ohm.tolist()
    return Remedy(
        longest_section_ohm=max((min(z / m1, loop - m2 * z) for z in each), default=0.0),
        m1=max((_ratio(z, section) for z in each if m2 * z <= rest), default=0.0),
        m2=max((_ratio(rest, z) for z in each if m1 * section <= z), default=0.0),
        both=max((min(_ratio(z, section), _ratio(rest, z)) for z in each), default=0.0),
    )


def _ratio(x: float, y: float) -> float:
    """x/y of two numbers that are not negative, also where y is 0."""
    return x / y if y else math.inf
