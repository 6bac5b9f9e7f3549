"""From true phasors to what a device reports: bounded random error of each phasor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..model.compiled import compiled

__all__ = ["disc_noise", "measure"]

Complex = NDArray[np.complex128]

SIGMAS = 3.0  #: the bound is this many standard deviations of either axis


def disc_noise(rng: np.random.Generator, shape: tuple[int, ...]) -> Complex:
    """Complex errors in units of their bound, |e| <= 1.

    A normal law with standard deviation 1/3 per axis, truncated at radius 1: what falls
    outside (1.1 % of draws) is drawn again.
    """
    error = np.empty(shape, np.complex128)
    _fill(rng, error.reshape(-1))
    return error


@compiled
def _fill(rng: np.random.Generator, error: Complex) -> None:
    for k in range(error.size):
        x, y = rng.standard_normal(), rng.standard_normal()
        while x * x + y * y > SIGMAS * SIGMAS:
            x, y = rng.standard_normal(), rng.standard_normal()
        error[k] = complex(x / SIGMAS, y / SIGMAS)


def measure(true: Complex, error: Complex, tve_pct: float, floor: float) -> Complex:
    """Phasors as reported: ``true`` plus ``error`` times its bound.

    Parameters
    ----------
    true, error : complex arrays of one shape
        Phasors, and errors in units of the bound (``disc_noise``).
    tve_pct : float
        Bound of the total vector error in percent (IEEE/IEC 60255-118-1).
    floor : float
        Smallest bound, in the phasors' unit: a percentage of nothing is no error at all.
    """
    bound = np.abs(true)
    bound *= tve_pct / 100.0
    np.maximum(bound, floor, out=bound)
    return true + error * bound
