"""A peer: OpenDSS through dss-python (optional), one circuit compiled once.

Every shunt is a wye load for its zero sequence and a delta load for the rest. Per scenario:
loads, source, solve directly; loads, source, open conductors, solve, close.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from dss import dss  # type: ignore[import-not-found,import-untyped,unused-ignore]
from problem import Complex, Problem

__all__ = ["opendss"]


def opendss(problem: Problem) -> Callable[[], tuple[Complex, Complex]]:
    """Return what computes (B, 3, S) voltages before and after."""
    _compile(problem)
    circuit = dss.ActiveCircuit
    nodes = [name.partition(".") for name in circuit.YNodeOrder]
    at = np.array([int(bus[1:]) * 3 + int(phase) - 1 for bus, _, phase in nodes])
    powers = [_powers(problem, n) for n in range(2)]
    size, count = problem.sound.size, problem.network.tree.parent.size

    def run() -> tuple[Complex, Complex]:
        out = np.empty((2, size, 3 * count), np.complex128)
        for s in range(size):
            _solve(circuit, powers[0][s], problem.before.emf_pu[s])
            out[0, s, at] = _voltages(circuit)
            circuit.SetActiveElement(f"line.e{problem.after.edge[s]}")
            mask = int(problem.after.open_mask[s])
            opened = [phase + 1 for phase in range(3) if mask & 1 << phase]
            for phase in opened:
                circuit.ActiveCktElement.Open(2, phase)
            _solve(circuit, powers[1][s], problem.after.emf_pu[s])
            out[1, s, at] = _voltages(circuit)
            circuit.SetActiveElement(f"line.e{problem.after.edge[s]}")
            for phase in opened:
                circuit.ActiveCktElement.Close(2, phase)
        v = out.reshape(2, size, count, 3).transpose(0, 2, 3, 1)
        return v[0], v[1]

    return run


def _compile(problem: Problem) -> None:
    network, tree = problem.network, problem.network.tree
    kv = tree.v_nominal_v * 3**0.5 / 1000.0
    z = tree.z_ohm[0]
    dss.AllowForms = False
    dss.AdvancedTypes = False
    text = [
        "clear",
        f"new circuit.paper basekv={kv!r} pu=1 bus1=b0 {_sequences(z, ('z1', 'z0'))}",
    ]
    for k in range(1, tree.parent.size):
        z = tree.z_ohm[k]
        text.append(
            f"new line.e{k} bus1=b{tree.parent[k]} bus2=b{k} phases=3 length=1 units=none "
            f"{_sequences(z, ('', ''))} c1=0 c0=0"
        )
    for unit, node in enumerate(tree.unit_node):
        for kind in ("wye", "delta"):
            text.append(
                f"new load.{kind}{unit} bus1=b{node} phases=3 conn={kind} kv={kv!r} model=2 "
                f"kw=1 kvar=1 vminpu=0.001 vmaxpu=9"
            )
    assert len(network.pieces) == tree.parent.size
    # the switching makes the first direct solution build its matrix anew, as all later ones do
    switching = ("open line.e1 2 1", "close line.e1 2 1")
    for line in (*text, "set mode=direct", "solve", *switching):
        dss.Text.Command = line


def _sequences(z: Complex, names: tuple[str, str]) -> str:
    """Z1 and Z0 of a balanced matrix, as OpenDSS writes them."""
    one, zero = complex(z[0, 0] - z[0, 1]), complex(z[0, 0] + 2.0 * z[0, 1])
    if names[0]:
        return f"z1=[{one.real!r} {one.imag!r}] z0=[{zero.real!r} {zero.imag!r}]"
    return f"r1={one.real!r} x1={one.imag!r} r0={zero.real!r} x0={zero.imag!r}"


def _powers(problem: Problem, n: int) -> Any:
    """(S, 2U, 2): kW and kvar of every load at nominal voltage: wye and delta of each unit."""
    shunt = problem.parts[n][1]
    wye, delta = shunt[:, 0], shunt[:, 1] - shunt[:, 0]
    va = 3.0 * problem.network.tree.v_nominal_v**2 * np.conj(np.stack([wye, delta], axis=1))
    kva = va.reshape(-1, va.shape[-1]).T / 1000.0
    return np.stack([kva.real, kva.imag], axis=-1).tolist()


def _solve(circuit: Any, powers: list[list[float]], emf_pu: float) -> None:
    loads = circuit.Loads
    for n, (kw, kvar) in enumerate(powers):
        loads.idx = n + 1
        loads.kW = kw
        loads.kvar = kvar
    circuit.Vsources.idx = 1
    circuit.Vsources.pu = emf_pu
    circuit.Solution.Solve()


def _voltages(circuit: Any) -> Complex:
    values: Complex = np.asarray(circuit.YNodeVarray, np.float64).view(np.complex128)
    return values
