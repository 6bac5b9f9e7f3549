"""A peer: power-grid-model (optional), asymmetric batches, the linear method.

An open phase is a line with a huge impedance in that phase. Scenarios that break the same
edge in the same phases share a grid, so that the topology stays as it is within a batch.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from power_grid_model import (  # type: ignore[import-not-found,import-untyped,unused-ignore]
    CalculationMethod,
    ComponentType,
    DatasetType,
    PowerGridModel,
    initialize_array,
)
from problem import Complex, Problem

__all__ = ["pgm"]

OPEN_OHM = 1e11
LINE, SOURCE, SHUNT = 100, 200, 300  #: first ids


def pgm(problem: Problem) -> Callable[[], tuple[Complex, Complex]]:
    """Return what computes (B, 3, S) voltages before and after."""
    state, tree = problem.after, problem.network.tree
    everyone = np.arange(problem.sound.size)
    jobs: list[tuple[int, np.ndarray, Any, Any]] = [
        (0, everyone, PowerGridModel(_grid(problem, -1, 0)), _update(problem, 0, everyone))
    ]
    kinds = np.unique(np.stack([state.edge, state.open_mask]), axis=1).T
    for edge, mask in kinds.tolist():
        own = np.flatnonzero((state.edge == edge) & (state.open_mask == mask))
        model = PowerGridModel(_grid(problem, edge, mask))
        jobs.append((1, own, model, _update(problem, 1, own)))

    def run() -> tuple[Complex, Complex]:
        out = np.empty((2, tree.parent.size, 3, everyone.size), np.complex128)
        for n, own, model, update in jobs:
            answer = model.calculate_power_flow(
                symmetric=False,
                calculation_method=CalculationMethod.linear,
                update_data=update,
                output_component_types={ComponentType.node: ["u", "u_angle"]},
            )
            node = answer[ComponentType.node]
            v = node["u"] * np.exp(1j * node["u_angle"])  # (S, B, 3)
            out[n][:, :, own] = v.transpose(1, 2, 0)
        return out[0], out[1]

    return run


def _grid(problem: Problem, edge: int, mask: int) -> dict[Any, Any]:
    tree = problem.network.tree
    count = tree.parent.size
    node = initialize_array(DatasetType.input, ComponentType.node, count)
    node["id"] = np.arange(count)
    node["u_rated"] = tree.v_nominal_v * 3**0.5
    intact = [k for k in range(1, count) if k != edge]
    line = initialize_array(DatasetType.input, ComponentType.line, len(intact))
    line["id"], line["from_node"], line["to_node"] = (
        np.array(intact) + LINE,
        tree.parent[intact],
        intact,
    )
    z = tree.z_ohm[intact]
    one, zero = z[:, 0, 0] - z[:, 0, 1], z[:, 0, 0] + 2.0 * z[:, 0, 1]
    line["r1"], line["x1"], line["r0"], line["x0"] = one.real, one.imag, zero.real, zero.imag
    for name in ("c1", "c0", "tan1", "tan0"):
        line[name] = 0.0
    line["from_status"] = line["to_status"] = 1
    out = {
        ComponentType.node: node,
        ComponentType.line: line,
        ComponentType.source: _source(problem),
        ComponentType.shunt: _shunt(problem),
    }
    if edge >= 0:
        out[ComponentType.asym_line] = _broken(problem, edge, mask)
    return out


def _source(problem: Problem) -> Any:
    tree = problem.network.tree
    z = tree.z_ohm[0]
    one, zero = z[0, 0] - z[0, 1], z[0, 0] + 2.0 * z[0, 1]
    source = initialize_array(DatasetType.input, ComponentType.source, 1)
    source["id"], source["node"], source["status"], source["u_ref"] = SOURCE, 0, 1, 1.0
    source["sk"] = 3.0 * tree.v_nominal_v**2 / abs(one)
    source["rx_ratio"] = one.real / one.imag
    source["z01_ratio"] = abs(zero) / abs(one)
    return source


def _shunt(problem: Problem) -> Any:
    tree = problem.network.tree
    shunt = initialize_array(DatasetType.input, ComponentType.shunt, tree.unit_node.size)
    shunt["id"] = np.arange(tree.unit_node.size) + SHUNT
    shunt["node"], shunt["status"] = tree.unit_node, 1
    for name in ("g1", "b1", "g0", "b0"):
        shunt[name] = 0.0
    return shunt


def _broken(problem: Problem, edge: int, mask: int) -> Any:
    tree = problem.network.tree
    line = initialize_array(DatasetType.input, ComponentType.asym_line, 1)
    line["id"], line["from_node"], line["to_node"] = LINE + edge, tree.parent[edge], edge
    line["from_status"] = line["to_status"] = 1
    z = tree.z_ohm[edge].copy()
    for phase in range(3):
        if mask & 1 << phase:
            z[phase] = z[:, phase] = 0.0
            z[phase, phase] = OPEN_OHM
    for a in range(3):
        for b in range(a + 1):
            name = f"{'abc'[a]}{'abc'[b]}"
            line[f"r_{name}"], line[f"x_{name}"] = z[a, b].real, z[a, b].imag
    line["c1"] = line["c0"] = 0.0
    return line


def _update(problem: Problem, n: int, own: np.ndarray) -> dict[Any, Any]:
    state, shunts = problem.parts[n]
    units = shunts.shape[0]
    shunt = initialize_array(DatasetType.update, ComponentType.shunt, (own.size, units))
    shunt["id"] = np.arange(units) + SHUNT
    y = shunts[..., own].transpose(2, 0, 1)
    shunt["g0"], shunt["b0"] = y[..., 0].real, y[..., 0].imag
    shunt["g1"], shunt["b1"] = y[..., 1].real, y[..., 1].imag
    source = initialize_array(DatasetType.update, ComponentType.source, (own.size, 1))
    source["id"], source["u_ref"] = SOURCE, state.emf_pu[own, None]
    return {ComponentType.shunt: shunt, ComponentType.source: source}
