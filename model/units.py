"""What hangs on the nodes or stands in the edges, as arrays for the solver."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .machines import Machines, power_va
from .parts import Der, Feeder, Load, Source, Transformer
from .pieces import Piece, node_name
from .solver.bank import D_D, D_YG, Y_D, YG_D, YG_YG
from .symmetrical import phase_matrix

__all__ = [
    "CONNECTIONS",
    "Unit",
    "assumed_connection",
    "capacitor_shunts",
    "connection_of",
    "loads_of",
    "regulator_arrays",
    "regulator_rows",
    "unit_arrays",
    "units_of",
]

CONNECTIONS: dict[str, int] = {
    "Yg/Yg": YG_YG,
    "D/Yg": D_YG,
    "Yg/D": YG_D,
    "Y/D": Y_D,
    "D/D": D_D,
}


def assumed_connection(source: Source) -> str:
    """What an unknown winding connection counts as, until a study draws it."""
    return "Yg/Yg" if source.wires == 4 else "D/Yg"


Unit = Transformer | Load | Der


def units_of(feeder: Feeder) -> list[Unit]:
    """Everything that hangs on a node as a bank: transformers, and what has none."""
    loads = [load for load in feeder.loads if load.transformer is None]
    ders = [der for der in feeder.ders if der.transformer is None]
    return [*feeder.transformers, *loads, *ders]


def unit_arrays(feeder: Feeder, units: list[Unit], machines: Machines) -> dict[str, Any]:
    """Half leakage and magnetizing admittances of the units, referred to HV."""
    kv = feeder.source.kv_ll
    half, y0, ym = [], [], []
    for unit in units:
        leakage, x0, xm, base_ohm = 0j, None, None, 1.0
        if isinstance(unit, Transformer):
            leakage, x0, xm = unit.leakage_pu, unit.x0_pu, unit.xm_pu
            base_ohm = kv * kv / (unit.rating_kva / 1000.0)
        half.append(leakage * base_ohm / 2.0)
        y0.append(0j if x0 is None else 1.0 / (1j * x0 * base_ohm))
        ym.append(0j if xm is None else 1.0 / (1j * xm * base_ohm))
    z = np.array(half, np.complex128)
    return {
        "unit_zh_ohm": z,
        "unit_zl_ohm": z,
        "unit_y0_s": np.array(y0, np.complex128),
        "unit_ym_s": np.array(ym, np.complex128),
        "unit_plain": (np.array(ym) == 0) & ~np.isin(np.arange(len(units)), machines.unit),
    }


def connection_of(feeder: Feeder, unit: Unit) -> int:
    """Winding connection; what hangs on the feeder directly is a bank without leakage."""
    if isinstance(unit, Transformer):
        known = unit.connection != "unknown"
        return CONNECTIONS[unit.connection if known else assumed_connection(feeder.source)]
    return D_YG if isinstance(unit, Load) and unit.connection == "delta" else YG_YG


def loads_of(feeder: Feeder, units: list[Unit]) -> tuple[NDArray[np.int64], NDArray[np.complex128]]:
    """The unit of every load, and its admittance per winding at nominal voltage."""
    row = {id(unit): n for n, unit in enumerate(units)}
    by_name = {unit.name: n for n, unit in enumerate(units) if isinstance(unit, Transformer)}
    unit, y = [], []
    for load in feeder.loads:
        unit.append(row[id(load)] if load.transformer is None else by_name[load.transformer])
        va = power_va(load.kw, load.power_factor)
        y.append(va.conjugate() / 3.0 / feeder.source.v_phase_v**2)
    return np.array(unit, np.int64), np.array(y, np.complex128)


def capacitor_shunts(feeder: Feeder, index: dict[str, int]) -> NDArray[np.complex128]:
    """(B, 3, 3) admittance of the capacitor banks on each node."""
    shunt = np.zeros((len(index), 3, 3), np.complex128)
    for bank in feeder.capacitors:
        y = 1j * bank.kvar * 1000.0 / 3.0 / feeder.source.v_phase_v**2
        y0 = y if bank.connection == "wye" else 0j
        shunt[index[node_name(feeder, bank.place)]] += phase_matrix(y0, y, y)
    return shunt


def regulator_rows(feeder: Feeder, pieces: list[Piece | None]) -> NDArray[np.int64]:
    """Per edge the regulator at its upper end; -1: none."""
    names = [regulator.name for regulator in feeder.regulators]
    rows = [names.index(p.regulator) if p and p.regulator else -1 for p in pieces]
    return np.array(rows, np.int64)


def regulator_arrays(
    feeder: Feeder, pieces: list[Piece | None], upward: NDArray[np.bool_]
) -> dict[str, Any]:
    """Ratios, lower over upper voltage: inverted where a regulator is fed from its to-end."""
    ratio, step, ways = [], [], []
    for regulator in feeder.regulators:
        edge = next(k for k, p in enumerate(pieces) if p and p.regulator == regulator.name)
        taps = 1.0 + np.array(regulator.taps) * regulator.step_pct / 100.0
        ways.append(bool(upward[edge]))
        ratio.append(taps if upward[edge] else 1.0 / taps)
        step.append(regulator.step_pct / 100.0)
    return {
        "regulators": tuple(regulator.name for regulator in feeder.regulators),
        "ratio": np.array(ratio, np.float64).reshape(-1, 3),
        "ratio_step": np.array(step, np.float64),
        "ratio_most": np.array([r.most_taps for r in feeder.regulators], np.int64),
        "ratio_upward": np.array(ways, np.bool_),
    }
