"""Nodal equations of what may be folded besides loads: lines and single-phase transformers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..inline import bank_admittance
from ..line_matrices import shunt_nf_per_km, z_ohm_per_km
from ..parts import InlineTransformer, Line, LineCode
from ..phases import phase_rows

__all__ = ["Terminal", "line_primitive", "unit_primitive"]

Complex = NDArray[np.complex128]
Terminal = tuple[str, int]
"""A bus and the row of a phase."""

TO_EARTH = 1e-9


def line_primitive(
    line: Line, code: LineCode | None, frequency_hz: float
) -> tuple[list[Terminal], Complex]:
    """Terminals of a line, from-end first, and the admittance matrix between them (nominal pi)."""
    rows = phase_rows(line.phases)
    chosen = np.ix_(rows, rows)
    series = np.asarray(
        np.linalg.inv(z_ohm_per_km(line, code)[chosen] * line.length_km), np.complex128
    )
    farad = shunt_nf_per_km(line, code)[chosen] * 1e-9 * line.length_km
    half = 1j * math.tau * frequency_hz * farad / 2.0
    terminals = [(bus, row) for bus in (line.from_bus, line.to_bus) for row in rows]
    return terminals, np.block([[series + half, -series], [-series, series + half]])


def unit_primitive(unit: InlineTransformer) -> tuple[list[Terminal], Complex]:
    """Terminals of an in-line transformer, and the admittance matrix between them.

    A trace of it goes to earth, so that nothing behind a winding between phases can float.
    """
    there, here = phase_rows(unit.phases), phase_rows(unit.to_phases)
    chosen = [*there, *(3 + row for row in here)]
    y = bank_admittance([unit], (unit.from_bus, unit.to_bus))
    ends = [(unit.from_bus, row) for row in there] + [(unit.to_bus, row) for row in here]
    y = y[np.ix_(chosen, chosen)]
    return ends, y + TO_EARTH * np.diag(np.abs(y.diagonal()))
