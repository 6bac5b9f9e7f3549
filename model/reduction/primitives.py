"""Nodal equations of the elements that may be folded: lines, single-phase transformers, loads."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..line_matrices import phase_rows, shunt_nf_per_km, z_ohm_per_km
from ..parts import Feeder, InlineTransformer, Line, Load

__all__ = [
    "Terminal",
    "branches_of",
    "law_factors",
    "line_primitive",
    "nominal_kv",
    "nominal_va",
    "unit_primitive",
]

Complex = NDArray[np.complex128]
Terminal = tuple[str, int]
"""A bus and the row of a phase."""


def line_primitive(feeder: Feeder, line: Line) -> tuple[list[Terminal], Complex]:
    """Terminals of a line, from-end first, and the admittance matrix between them (nominal pi)."""
    rows = phase_rows(line.phases)
    chosen = np.ix_(rows, rows)
    series = np.linalg.inv(z_ohm_per_km(feeder, line)[chosen] * line.length_km)
    farad = shunt_nf_per_km(feeder, line)[chosen] * 1e-9 * line.length_km
    half = 1j * math.tau * feeder.source.frequency_hz * farad / 2.0
    terminals = [(bus, row) for bus in (line.from_bus, line.to_bus) for row in rows]
    return terminals, np.block([[series + half, -series], [-series, series + half]])


def unit_primitive(unit: InlineTransformer) -> tuple[list[Terminal], Complex]:
    """Terminals of a single-phase or centre-tapped transformer, and the matrix between them."""
    there = [(unit.from_bus, row) for row in phase_rows(unit.phases)]
    here = [(unit.to_bus, row) for row in phase_rows(unit.to_phases)]
    # rows: windings, columns: terminals
    if unit.connection == "centre-tap":
        to = np.array([[1.0, 0.0], [0.0, -1.0]])
        v_leg = unit.kv_to * 500.0 * unit.to_tap
        windings = _three_windings(unit, v_leg)
    else:
        to = np.array([_across(len(here))])
        v_leg = unit.kv_to * 1000.0 * unit.to_tap
        windings = _two_windings(unit, v_leg)
    windings[1, 1] += unit.magnetizing_pu * unit.rating_kva * 1000.0 / v_leg**2
    turns = np.zeros((1 + len(to), len(there) + len(here)))
    turns[0, : len(there)] = _across(len(there))
    turns[1:, len(there) :] = to
    return [*there, *here], turns.T @ windings @ turns


def _across(count: int) -> list[float]:
    """A winding from a phase to earth, or between two."""
    return [1.0] if count == 1 else [1.0, -1.0]


def _two_windings(unit: InlineTransformer, v_to: float) -> Complex:
    y = unit.rating_kva * 1000.0 / v_to**2 / unit.leakage_pu
    ratio = v_to / (unit.kv_from * 1000.0 * unit.from_tap)
    return np.array([[ratio**2 * y, -ratio * y], [-ratio * y, y]])


def _three_windings(unit: InlineTransformer, v_leg: float) -> Complex:
    """The star of three leakages, on the rating."""
    leg = unit.leg_leakage_pu or 1e-9
    y = 1.0 / np.array([unit.leakage_pu or 1e-9, leg, leg], np.complex128)
    star = np.diag(y) - np.outer(y, y) / y.sum()
    v = np.array([unit.kv_from * 1000.0 * unit.from_tap, v_leg, v_leg])
    return np.asarray(star * (unit.rating_kva * 1000.0) / np.outer(v, v))


def branches_of(phases: str, connection: str) -> list[tuple[int, int]]:
    """Rows of the phases that each branch stands between; -1 is earth."""
    rows = phase_rows(phases)
    if connection == "wye":
        return [(row, -1) for row in rows]
    if len(rows) == 2:
        return [(rows[0], rows[1])]
    return [(rows[0], rows[1]), (rows[1], rows[2]), (rows[2], rows[0])]


def nominal_va(load: Load) -> complex:
    """P + jQ of all branches together, at ``branch_kv``."""
    if load.kvar is not None:
        return complex(load.kw, load.kvar) * 1000.0
    factor = load.power_factor
    reactive = math.sqrt(max(1.0 / factor**2 - 1.0, 0.0)) * (1.0 if factor > 0.0 else -1.0)
    return complex(load.kw, load.kw * reactive) * 1000.0


def nominal_kv(load: Load, bus_v: float) -> float:
    """Voltage of a branch at which it takes its power."""
    if load.branch_kv is not None:
        return load.branch_kv
    return bus_v / 1000.0 * (1.0 if load.connection == "wye" else 3.0**0.5)


def law_factors(load: Load, v_pu: float) -> tuple[float, float]:
    """Conductance and susceptance of a branch at ``v_pu``, over their nominal values."""
    least, most = load.v_min_pu, load.v_max_pu
    if most is not None and v_pu > most:
        v_pu = most
    if v_pu >= least:
        return _law(load, v_pu)
    at_least = _law(load, least)
    if load.v_low_pu is None:
        return at_least
    share = min(max((v_pu - load.v_low_pu) / (least - load.v_low_pu), 0.0), 1.0)
    return 1.0 + share * (at_least[0] - 1.0), 1.0 + share * (at_least[1] - 1.0)


def _law(load: Load, v: float) -> tuple[float, float]:
    """Powers over v squared, within the range of the load's law."""
    if load.zip is not None:
        zp, ip, pp, zq, iq, pq = load.zip
        return zp + ip / v + pp / v**2, zq + iq / v + pq / v**2
    other = load.exponent if load.exponent_q is None else load.exponent_q
    return v ** (load.exponent - 2.0), v ** (other - 2.0)
