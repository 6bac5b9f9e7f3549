"""The connection impedance, equations (4)-(5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["connection_impedance"]

Complex = NDArray[np.complex128]

ROUNDING = 1e-10  #: a difference below this share of its terms is rounding, not physics


def connection_impedance(
    v_local: Complex,
    v_remote: Complex,
    i_local: Complex,
    dv_local: Complex,
    dv_remote: Complex,
    di_local: Complex,
) -> tuple[Complex, NDArray[np.bool_]]:
    """Equation (5) from phasors now and their changes over ΔT, all of one shape.

    Volts, and amperes positive into the section, in phase quantities or in one sequence.

    Returns
    -------
    z_ohm : complex array
        Z_LR; 0 where it is undefined.
    undefined : bool array
        Where the denominator vanishes, but for rounding: the local current change is just
        what the local voltage change explains, so that the impedance is 0/0 or unbounded.
    """
    numerator = dv_local * v_remote - dv_remote * v_local
    explained = dv_local * i_local
    denominator = di_local * v_local - explained
    rounding = ROUNDING * np.maximum(np.abs(explained), np.abs(v_local * i_local))
    undefined = np.asarray(np.abs(denominator) <= rounding)
    if undefined.any():
        denominator[undefined] = 1.0
        numerator[undefined] = 0.0
    return numerator / denominator, undefined
