"""A reference's states solved once more, by an engine that is set more exactly.

The stored phasors have OpenDSS's habits in them: it stops at a tolerance of 1e-4, and it ties
every transformer winding to earth by a millionth of its rating. What is still apart from us
when these are taken away is a difference of models; the rest was the habit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from opendss.compare import eq5
from opendss.engine import new_context
from opendss.reference import OpenState, Pair, Reference

__all__ = ["solved_again"]

Three = NDArray[np.complex128]


def solved_again(
    root: Path, reference: Reference, *, antifloat_ppm: float | None, tolerance: float | None
) -> Reference:
    """The same states by the engine today; None leaves a setting as the engine has it.

    ``root`` is the folder of the feeders.
    """
    engine = new_context()
    text, circuit = engine.Text, engine.ActiveCircuit
    text.Command = f'compile "{root / reference.file}"'
    text.Command = "set controlmode=off"
    for name in circuit.Transformers.AllNames:
        if name in reference.taps:
            text.Command = f"transformer.{name}.wdg=2"
            text.Command = f"transformer.{name}.tap={reference.taps[name]}"
        if antifloat_ppm is not None:
            text.Command = f"transformer.{name}.ppm_antifloat={antifloat_ppm}"
    for name, steps in reference.capacitors.items():
        text.Command = f"capacitor.{name}.states=[{' '.join(map(str, steps))}]"
    if tolerance is not None:
        text.Command = f"set tolerance={tolerance} maxiterations=2000"
    nominal = _powers(circuit)
    scaled = any(state.load != 1.0 for state in reference.states)
    states: list[OpenState] = []
    bases: dict[tuple[str, float], dict[str, tuple[Three, Three, Three]]] = {}
    for state in reference.states:
        for name, (kw, kvar) in nominal.items() if scaled else ():
            text.Command = f"load.{name}.kw={kw * state.load!r} kvar={kvar * state.load!r}"
        solved, seen = _solved(engine, state, reference.pairs)
        if state.line is None:
            bases[state.mode, state.load] = seen
        else:
            z1 = {
                name: _z1(bases[state.mode, state.load][name], seen[name]) for name in state.z1_ohm
            }
            solved = replace(solved, z1_ohm=z1)
        states.append(solved)
    return replace(reference, states=tuple(states))


def _powers(circuit: Any) -> dict[str, tuple[float, float]]:
    powers = {}
    for name in circuit.Loads.AllNames:
        circuit.Loads.Name = name
        powers[str(name)] = (float(circuit.Loads.kW), float(circuit.Loads.kvar))
    return powers


def _z1(before: tuple[Three, Three, Three], after: tuple[Three, Three, Three]) -> complex:
    phasors = [np.stack([x, y], axis=1) for x, y in zip(before, after, strict=True)]
    return eq5(phasors[0], phasors[1], phasors[2])[0]


def _solved(
    engine: Any, state: OpenState, pairs: tuple[Pair, ...]
) -> tuple[OpenState, dict[str, tuple[Three, Three, Three]]]:
    """The state, and each pair's phasors: V at m, V at n, I from m."""
    text, circuit = engine.Text, engine.ActiveCircuit
    where = ""
    if state.line is not None and state.bus is not None and state.phase is not None:
        circuit.SetActiveElement(f"line.{state.line}")
        buses = [name.split(".")[0] for name in circuit.ActiveCktElement.BusNames]
        where = f"line.{state.line} {buses.index(state.bus) + 1} {'abc'.index(state.phase) + 1}"
        text.Command = f"open {where}"
    text.Command = f"set mode={state.mode} controlmode=off"
    text.Command = "solve"
    flat = np.asarray(circuit.YNodeVarray)
    nodes = [str(name).lower() for name in circuit.YNodeOrder]
    volts = dict(zip(nodes, flat[::2] + 1j * flat[1::2], strict=True))
    seen = {
        pair.name: (_three(volts, pair.m), _three(volts, pair.n), _current(circuit, pair))
        for pair in pairs
    }
    converged = bool(circuit.Solution.Converged)
    if where:
        text.Command = f"close {where}"
    found = {bus: _three(volts, bus) for bus in state.volts}
    told = {bus: (complex(v[0]), complex(v[1]), complex(v[2])) for bus, v in found.items()}
    return replace(state, volts=told, converged=converged), seen


def _three(volts: Mapping[str, complex], bus: str) -> Three:
    return np.array([volts[f"{bus}.{k}"] for k in (1, 2, 3)])


def _current(circuit: Any, pair: Pair) -> Three:
    """Amperes from m into what leads from there to the next bus, all such elements together."""
    total = np.zeros(3, np.complex128)
    for name in (*circuit.Lines.AllNames, *circuit.Transformers.AllNames):
        for kind in ("line", "transformer"):
            if circuit.SetActiveElement(f"{kind}.{name}") < 0:
                continue
            element = circuit.ActiveCktElement
            buses = [bus.split(".")[0].lower() for bus in element.BusNames]
            if set(buses[:2]) != {pair.m, pair.towards} or pair.m == pair.towards:
                continue
            flat = np.asarray(element.Currents)
            amperes = flat[::2] + 1j * flat[1::2]
            order = [int(node) for node in element.NodeOrder]
            each = element.NumConductors
            first = buses.index(pair.m) * each
            for node, ampere in zip(
                order[first : first + each], amperes[first : first + each], strict=True
            ):
                if 1 <= node <= 3:
                    total[node - 1] += ampere
    return total
