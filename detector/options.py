"""What a terminal may demand, or accept, beside the paper's criteria; all but two are off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["BothEnds", "Options"]

BothEnds = Literal["off", "no_small_z", "agree"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """Options of the criteria, for the positive sequence (row 0) and the phases (rows 1..3).

    Parameters
    ----------
    negative_sign : bool
        Only Re Z < 0 trips; both kinds of row.
    fallback : bool
        Where the trigger of the positive sequence stays below I_set, the phase-segregated
        impedance stands in for it (section VI of the paper).
    compensated : bool
        The trigger is the smaller of |ΔI| and |ΔI*|, ΔI* = I' - I V'/V being the part of the
        change that the local voltage does not explain. In the phases with their own V.
    any_sequence : bool
        The trigger of row 0 is the largest of |ΔI1|, |ΔI2| and |ΔI0|. Then the remote end must
        have moved: |ΔV_R*| >= ``floor_v``, in the phases their own; and in row 0 the sign is
        waived where |ΔI1*| < ``waive_sign_below_a``, too small to have one.
    floor_v, waive_sign_below_a : float
        See ``any_sequence``.
    unbalance : float
        A change must be unbalanced: max(|ΔI2|, |ΔI0|) >= ``unbalance`` |ΔI1|; 0 is off. It
        judges the event, and so holds for the phases too.
    direction : bool
        Only an opening trips. Eq. (5) is the same for a closing; but an opening leaves the local
        current less balanced than before, |I2| + |I0| has not fallen. Also of the event.
    both_ends : {"off", "no_small_z", "agree"}
        "no_small_z": the far end's impedance, where it has a change to measure it by, must not
        lie below Z_set. "agree": it must have one, negative and not below Z_set, as at both
        ends of an open conductor in a closed loop. Phases are compared with their like.
    """

    negative_sign: bool = True
    fallback: bool = True
    compensated: bool = False
    any_sequence: bool = False
    floor_v: float = 25.0
    waive_sign_below_a: float = 0.3
    unbalance: float = 0.0
    direction: bool = False
    both_ends: BothEnds = "off"
