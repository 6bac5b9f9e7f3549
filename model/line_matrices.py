"""A line's matrices in phase coordinates, however the feeder gives them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .parts import Feeder, Line, LineCode
from .phases import phase_rows
from .symmetrical import phase_matrix

__all__ = ["shunt_nf_per_km", "z1_ohm", "z_ohm_per_km"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


def z_ohm_per_km(line: Line, code: LineCode | None) -> Complex:
    """(3, 3) series impedance per km; zero in the rows of phases that are not there.

    ``code`` is the one that the line names, None where it names none.
    """
    if code is not None:
        z = np.array(code.r_ohm_per_km, np.float64) + 1j * np.array(code.x_ohm_per_km, np.float64)
        return _placed(z, line.phases)
    assert line.z1_ohm_per_km is not None
    assert line.z0_ohm_per_km is not None
    z = phase_matrix(line.z0_ohm_per_km, line.z1_ohm_per_km, line.z1_ohm_per_km)
    return _of_phases(z, line.phases)


def shunt_nf_per_km(line: Line, code: LineCode | None) -> Real:
    """(3, 3) charging capacitance per km; zero in the rows of phases that are not there."""
    if code is None:
        c = phase_matrix(line.c0_nf_per_km, line.c1_nf_per_km, line.c1_nf_per_km)
        return np.asarray(_of_phases(c, line.phases).real)
    if code.c_nf_per_km is None:
        return np.zeros((3, 3))
    return np.asarray(_placed(np.array(code.c_nf_per_km, np.complex128), line.phases).real)


def z1_ohm(feeder: Feeder, line: Line) -> complex:
    """Positive-sequence impedance of the whole line.

    Of an untransposed one the mean self less the mean mutual impedance, which is what stands
    on the diagonal of its sequence matrix.
    """
    if line.code is None and line.z1_ohm_per_km is not None:
        return line.z1_ohm_per_km * line.length_km
    code = next((code for code in feeder.codes if code.name == line.code), None)
    z = z_ohm_per_km(line, code)
    count = len(line.phases)
    own = complex(np.trace(z)) / count
    mutual = (complex(z.sum()) - complex(np.trace(z))) / (count * (count - 1)) if count > 1 else 0j
    return (own - mutual) * line.length_km


def _of_phases(matrix: Complex, phases: str) -> Complex:
    """The transposed line's matrix without the rows and columns of missing phases."""
    there = np.array([phase in phases for phase in "abc"])
    return np.where(there[:, None] & there, matrix, 0.0)


def _placed(matrix: Complex, phases: str) -> Complex:
    """A code's matrix in the rows of the line's phases."""
    placed = np.zeros((3, 3), np.complex128)
    rows = phase_rows(phases)
    placed[np.ix_(rows, rows)] = matrix
    return placed
