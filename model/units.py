"""What hangs on the nodes or stands in the edges, as arrays for the solver."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .inline import regulator_ratio, regulator_reference
from .machines import Machines, has_motor, load_va
from .neutrals import wires_at_unknown
from .parts import Capacitor, Der, Feeder, Load, Transformer
from .phases import phase_mask, phase_rows
from .pieces import Piece, node_name
from .solver.bank import D_D, D_YG, Y_D, YG_D, YG_YG

__all__ = [
    "CONNECTIONS",
    "Nodes",
    "Unit",
    "assumed_connection",
    "branches_of",
    "capacitor_shunts",
    "connection_of",
    "loads_of",
    "regulator_arrays",
    "regulator_references",
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


def assumed_connection(feeder: Feeder) -> str:
    """What an unknown winding connection counts as, until a study draws it."""
    return "Yg/Yg" if wires_at_unknown(feeder) == 4 else "D/Yg"


Unit = Transformer | Load | Der

ROOT = 3.0**0.5


class Nodes(NamedTuple):
    """The nodes of a network: the index of each name, and nominal volts."""

    row: dict[str, int]
    volts: NDArray[np.float64]


def units_of(feeder: Feeder, motors: bool) -> list[Unit]:
    """Everything that hangs on a node as a bank: transformers, and machines that have none.

    All other loads are branches between phases or to earth. ``motors``: every three-phase load
    has one.
    """
    loads = [load for load in feeder.loads if load.transformer is None and has_motor(load, motors)]
    ders = [der for der in feeder.ders if der.transformer is None]
    return [*feeder.transformers, *loads, *ders]


def unit_arrays(
    feeder: Feeder, units: list[Unit], machines: Machines, node_v: NDArray[np.float64]
) -> dict[str, Any]:
    """Half leakage and magnetizing admittances of the units, referred to HV.

    ``node_v`` (U,) is the nominal phase-to-earth voltage where each stands.
    """
    half, y0, ym, volts = [], [], [], []
    for unit, at_node in zip(units, node_v, strict=True):
        leakage, x0, xm, base_ohm, v = 0j, None, None, 1.0, float(at_node)
        if isinstance(unit, Transformer):
            leakage, x0, xm = unit.leakage_pu, unit.x0_pu, unit.xm_pu
            base_ohm = 3.0 * v * v / (unit.rating_kva * 1000.0)
        elif isinstance(unit, Load) and unit.branch_kv is not None:
            v = unit.branch_kv * 1000.0 / (ROOT if unit.connection == "delta" else 1.0)
        volts.append(v)
        half.append(leakage * base_ohm / 2.0)
        y0.append(0j if x0 is None else 1.0 / (1j * x0 * base_ohm))
        ym.append(0j if xm is None else 1.0 / (1j * xm * base_ohm))
    z = np.array(half, np.complex128)
    return {
        "unit_v": np.array(volts, np.float64),
        "unit_zh_ohm": z,
        "unit_zl_ohm": z,
        "unit_y0_s": np.array(y0, np.complex128),
        "unit_ym_s": np.array(ym, np.complex128),
        "unit_plain": (np.array(ym) == 0) & ~np.isin(np.arange(len(units)), machines.unit),
    }


def connection_of(unit: Unit, assumed: str) -> int:
    """Winding connection; what hangs on the feeder directly is a bank without leakage.

    ``assumed`` is that of a transformer whose connection is unknown.
    """
    if isinstance(unit, Transformer):
        return CONNECTIONS[assumed if unit.connection == "unknown" else unit.connection]
    return D_YG if isinstance(unit, Load) and unit.connection == "delta" else YG_YG


def loads_of(
    feeder: Feeder, units: list[Unit], unit_v: NDArray[np.float64], nodes: Nodes
) -> dict[str, Any]:
    """The unit of every load, -1 where it has branches, these, and its nominal admittances.

    Loads between the same phases of a node, with the same nominal voltage, share a branch.
    """
    row = {id(unit): n for n, unit in enumerate(units)}
    by_name = {unit.name: n for n, unit in enumerate(units) if isinstance(unit, Transformer)}
    unit_of, y = [], []
    branches: dict[tuple[int, int, int, float], list[int]] = {}
    for n, load in enumerate(feeder.loads):
        unit = row.get(id(load), -1) if load.transformer is None else by_name[load.transformer]
        unit_of.append(unit)
        if unit >= 0:
            y.append(load_va(load).conjugate() / 3.0 / unit_v[unit] ** 2)
            continue
        assert load.place is not None
        node = nodes.row[node_name(feeder, load.place)]
        pairs, volts = branches_of(load, float(nodes.volts[node]))
        for i, j in pairs:
            branches.setdefault((node, i, j, volts), []).append(n)
        y.append(load_va(load).conjugate() / len(pairs) / volts**2)
    columns = list(zip(*branches, strict=True)) or [()] * 4
    counts = [len(loads) for loads in branches.values()]
    return {
        "load_unit": np.array(unit_of, np.int64),
        "load_y_s": np.array(y, np.complex128),
        "branch_first": np.cumsum([0, *counts], dtype=np.int64),
        "branch_load": np.array([n for loads in branches.values() for n in loads], np.int64),
        "branch_node": np.array(columns[0], np.int64),
        "branch_from": np.array(columns[1], np.int64),
        "branch_to": np.array(columns[2], np.int64),
        "branch_v": np.array(columns[3], np.float64),
    }


def branches_of(part: Load | Capacitor, node_v: float) -> tuple[list[tuple[int, int]], float]:
    """Phases between which each branch lies (-1: earth), and nominal volts across it."""
    rows = phase_rows(part.phases)
    if part.connection == "wye":
        pairs = [(row, -1) for row in rows]
        volts = node_v
    else:
        pairs = list(zip(rows, [*rows[1:], rows[0]], strict=True))[: 3 if len(rows) > 2 else 1]
        volts = node_v * ROOT
    return pairs, volts if part.branch_kv is None else part.branch_kv * 1000.0


def capacitor_shunts(feeder: Feeder, nodes: Nodes) -> NDArray[np.complex128]:
    """(B, 3, 3) admittance of the capacitor banks on each node."""
    shunt = np.zeros((len(nodes.row), 3, 3), np.complex128)
    for bank in feeder.capacitors:
        node = nodes.row[node_name(feeder, bank.place)]
        pairs, volts = branches_of(bank, float(nodes.volts[node]))
        y = 1j * bank.kvar * 1000.0 / len(pairs) / volts**2
        for i, j in pairs:
            shunt[node, i, i] += y
            if j >= 0:
                shunt[node, j, j] += y
                shunt[node, i, j] -= y
                shunt[node, j, i] -= y
    return shunt


def regulator_rows(feeder: Feeder, pieces: list[Piece | None]) -> NDArray[np.int64]:
    """Per edge the regulator at its upper end; -1: none."""
    names = {regulator.name: n for n, regulator in enumerate(feeder.regulators)}
    rows = [names[p.regulator] if p and p.regulator else -1 for p in pieces]
    return np.array(rows, np.int64)


def regulator_arrays(
    feeder: Feeder, pieces: list[Piece | None], upward: NDArray[np.bool_]
) -> dict[str, Any]:
    """Ratios, lower over upper voltage: inverted where a regulator is fed from its to-end."""
    edges = {p.regulator: k for k, p in enumerate(pieces) if p and p.regulator}
    ways = [bool(upward[edges[part.name]]) for part in feeder.regulators]
    ratio = [regulator_ratio(part, way) for part, way in zip(feeder.regulators, ways, strict=True)]
    return {
        "regulators": tuple(regulator.name for regulator in feeder.regulators),
        "ratio": np.array(ratio, np.float64).reshape(-1, 3),
        "ratio_step": np.array([r.step_pct / 100.0 for r in feeder.regulators], np.float64),
        "ratio_most": np.array([r.most_taps for r in feeder.regulators], np.int64),
        "ratio_upward": np.array(ways, np.bool_),
        "ratio_phases": np.array([phase_mask(r.phases) for r in feeder.regulators], np.int64),
        "ratio_gang": np.array([r.gang for r in feeder.regulators], np.bool_),
    }


def regulator_references(feeder: Feeder) -> NDArray[np.int64]:
    """(R, 3) the phase that each phase of a regulator refers to; -1: earth."""
    rows = [regulator_reference(part) for part in feeder.regulators]
    return np.array(rows, np.int64).reshape(-1, 3)
