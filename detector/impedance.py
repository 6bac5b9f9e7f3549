"""The connection impedance, equations (4)-(5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..model.compiled import compiled

__all__ = ["connection_impedance", "impedance_of"]

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
    z_ohm = np.empty(v_local.shape, np.complex128)
    undefined = np.empty(v_local.shape, np.bool_)
    _fill(
        v_local.ravel(),
        v_remote.ravel(),
        i_local.ravel(),
        dv_local.ravel(),
        dv_remote.ravel(),
        di_local.ravel(),
        z_ohm.reshape(-1),
        undefined.reshape(-1),
    )
    return z_ohm, undefined


@compiled
def impedance_of(
    v_local: complex,
    v_remote: complex,
    i_local: complex,
    dv_local: complex,
    dv_remote: complex,
    di_local: complex,
) -> tuple[complex, bool]:
    """Equation (5) of one terminal in one scenario, as in ``connection_impedance``."""
    explained = dv_local * i_local
    denominator = di_local * v_local - explained
    loading = v_local * i_local
    size = denominator.real**2 + denominator.imag**2
    largest = max(
        explained.real**2 + explained.imag**2,
        loading.real**2 + loading.imag**2,
    )
    if size <= ROUNDING * ROUNDING * largest:
        return 0j, True
    numerator = dv_local * v_remote - dv_remote * v_local
    return numerator * denominator.conjugate() / size, False


@compiled
def _fill(  # noqa: PLR0913
    v_local: Complex,
    v_remote: Complex,
    i_local: Complex,
    dv_local: Complex,
    dv_remote: Complex,
    di_local: Complex,
    z_ohm: Complex,
    undefined: NDArray[np.bool_],
) -> None:
    for k in range(z_ohm.size):
        z_ohm[k], undefined[k] = impedance_of(
            v_local[k], v_remote[k], i_local[k], dv_local[k], dv_remote[k], di_local[k]
        )
