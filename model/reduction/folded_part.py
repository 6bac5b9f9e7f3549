"""The part of a feeder that is folded, as nodal equations, and its state at given voltages."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csc_matrix, diags
from scipy.sparse.linalg import splu

from ..buses import bus_volts
from ..laws import law_rows
from ..machines import load_va
from ..parts import Feeder, Load
from ..solver.assemble import law_factors
from ..units import branches_of
from .primitives import Terminal, line_primitive, unit_primitive

__all__ = ["FoldedPart", "Seen", "folded_part", "seen_from_roots"]

Complex = NDArray[np.complex128]

PASSES = 60
SETTLED_PU = 1e-10


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoldedPart:
    """Terminals and elements of the buses that are folded, and of the roots they hang on."""

    inside: Mapping[Terminal, int]  #: rows of the terminals that are folded
    roots: tuple[str, ...]
    network: Any  #: sparse (inside, inside) admittances without loads
    towards: Any  #: sparse (inside, 3 R) to the roots' phases
    root_y_s: Complex  #: (R, 3, 3) what the folded elements put on their root alone
    owner: NDArray[np.int64]  #: (inside,) root of each
    loads: tuple[Load, ...]
    laws: NDArray[np.float64]  #: (L, 14) rows for ``law_factors``
    branch_load: NDArray[np.int64]  #: (P,)
    branch_from: NDArray[np.int64]  #: (P,) terminal
    branch_to: NDArray[np.int64]  #: (P,) terminal, or -1
    branch_y_s: Complex  #: (P,) nominal
    branch_v: NDArray[np.float64]  #: (P,) nominal


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Seen:
    """What the roots see of the folded part at one level of the loads."""

    y_s: Complex  #: (R, 3, 3)
    gain: Complex  #: (P, 3) branch voltage per voltage of its root's phases
    branch_y_s: Complex  #: (P,) at the load's voltage, at level 1
    branch_v: Complex  #: (P,)


def folded_part(feeder: Feeder, root_of: Mapping[str, str]) -> FoldedPart:
    """Assemble all that hangs between the folded buses and their roots."""
    roots = tuple(dict.fromkeys(root_of.values()))
    number = {bus: n for n, bus in enumerate(roots)}
    inside: dict[Terminal, int] = {}
    own, out = _Entries(), _Entries()
    root_y = np.zeros((len(roots), 3, 3), np.complex128)
    codes = {code.name: code for code in feeder.codes}
    hertz = feeder.source.frequency_hz
    elements = [
        line_primitive(line, codes.get(line.code or ""), hertz)
        for line in feeder.lines
        if line.from_bus in root_of or line.to_bus in root_of
    ]
    elements += [
        unit_primitive(unit)
        for unit in feeder.inline_transformers
        if unit.from_bus in root_of or unit.to_bus in root_of
    ]
    for terminals, y in elements:
        for i, (bus, row) in enumerate(terminals):
            for j, (other, column) in enumerate(terminals):
                if bus in root_of:
                    at = inside.setdefault((bus, row), len(inside))
                    if other in root_of:
                        own.add(at, inside.setdefault((other, column), len(inside)), y[i, j])
                    else:
                        out.add(at, 3 * number[other] + column, y[i, j])
                elif other == bus:
                    root_y[number[bus], row, column] += y[i, j]
    size = len(inside)
    return FoldedPart(
        inside=inside,
        roots=roots,
        network=own.matrix(size, size),
        towards=out.matrix(size, 3 * len(roots)),
        root_y_s=root_y,
        owner=np.array([number[root_of[bus]] for bus, _ in inside], np.int64),
        **_branches(feeder, root_of, inside),
    )


class _Entries:
    """Entries of a sparse matrix, added up."""

    def __init__(self) -> None:
        self.rows: list[int] = []
        self.columns: list[int] = []
        self.values: list[complex] = []

    def add(self, row: int, column: int, value: complex) -> None:
        self.rows.append(row)
        self.columns.append(column)
        self.values.append(value)

    def matrix(self, rows: int, columns: int) -> Any:
        places = (self.rows, self.columns)
        return coo_matrix((self.values, places), (rows, columns), np.complex128).tocsc()


def _branches(
    feeder: Feeder, root_of: Mapping[str, str], inside: Mapping[Terminal, int]
) -> dict[str, Any]:
    """The loads on folded buses, branch by branch."""
    volts = bus_volts(feeder)
    loads: list[Load] = []
    columns: defaultdict[str, list[Any]] = defaultdict(list)
    for load in feeder.loads:
        bus = load.place.bus if load.place is not None else None
        if bus is None or bus not in root_of:
            continue
        rows, v = branches_of(load, volts[bus])
        for start, end in rows:
            columns["load"].append(len(loads))
            columns["from"].append(inside[bus, start])
            columns["to"].append(inside[bus, end] if end >= 0 else -1)
            columns["y"].append(load_va(load).conjugate() / len(rows) / v**2)
            columns["v"].append(v)
        loads.append(load)
    return {
        "loads": tuple(loads),
        "laws": law_rows(replace(feeder, loads=tuple(loads)))[0],
        "branch_load": np.array(columns["load"], np.int64),
        "branch_from": np.array(columns["from"], np.int64),
        "branch_to": np.array(columns["to"], np.int64),
        "branch_y_s": np.array(columns["y"], np.complex128),
        "branch_v": np.array(columns["v"], np.float64),
    }


def seen_from_roots(
    part: FoldedPart, root_v: Complex, level: float, linear_s: Complex | None = None
) -> Seen:
    """Solve the folded part with its roots at ``root_v`` (R, 3) and all loads at ``level``.

    Each load's admittance settles at its own voltage, or is that of ``linear_s`` (P,); what the
    root sees is then that of a linear network with these admittances.
    """
    pick = _incidence(part)
    y = part.branch_y_s if linear_s is None else linear_s
    v = np.zeros(y.shape, np.complex128)
    for _ in range(PASSES):
        inverse = splu(csc_matrix(part.network + pick.T @ diags(level * y) @ pick))
        unit = -inverse.solve(_per_phase(part))
        gain = pick @ unit
        before, v = v, np.einsum("pk,pk->p", gain, root_v[_root_of_branch(part)])
        if (
            level == 0.0
            or linear_s is not None
            or np.all(np.abs(v - before) <= SETTLED_PU * part.branch_v)
        ):
            break
        y = _at_voltage(part, np.abs(v) / part.branch_v)
    return Seen(y_s=_from_roots(part, unit), gain=gain, branch_y_s=y, branch_v=v)


def _incidence(part: FoldedPart) -> Any:
    """Sparse (P, inside): a branch's voltage from those of the terminals."""
    branches = np.arange(part.branch_load.size)
    double = part.branch_to >= 0
    places = (
        np.concatenate([branches, branches[double]]),
        np.concatenate([part.branch_from, part.branch_to[double]]),
    )
    signs = np.concatenate([np.ones(branches.size), -np.ones(int(double.sum()))])
    return coo_matrix((signs, places), (branches.size, len(part.inside))).tocsr()


def _per_phase(part: FoldedPart) -> Complex:
    """(inside, 3) current from 1 V at one phase of every root: no branch has two roots."""
    choose = np.tile(np.eye(3), (len(part.roots), 1))
    current: Complex = part.towards @ choose
    return current


def _root_of_branch(part: FoldedPart) -> NDArray[np.int64]:
    return np.asarray(part.owner[part.branch_from])


def _at_voltage(part: FoldedPart, v_pu: NDArray[np.float64]) -> Complex:
    """(P,) admittance of every branch at its voltage."""
    laws = [
        law_factors(part.laws, k, v)
        for k, v in zip(part.branch_load.tolist(), v_pu.tolist(), strict=True)
    ]
    factors = np.array(laws).reshape(-1, 2)
    y = part.branch_y_s
    return np.asarray(y.real * factors[:, 0] + 1j * y.imag * factors[:, 1], np.complex128)


def _from_roots(part: FoldedPart, unit: Complex) -> Complex:
    """(R, 3, 3) current into the folded part per voltage of the root's phases."""
    roots = len(part.roots)
    y = part.root_y_s.copy()
    back = part.towards.tocoo()
    # the network is reciprocal: what a root's phase draws is what it sends, transposed
    np.add.at(y, (back.col // 3, back.col % 3), back.data[:, None] * unit[back.row])
    return np.asarray(y.reshape(roots, 3, 3))
