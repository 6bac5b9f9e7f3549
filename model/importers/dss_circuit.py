"""Reads a compiled OpenDSS circuit into plain records."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import TypeVar

from ..errors import Fault, Gathered
from .dss_branches import line_reader, raw_reactor
from .dss_engine import Engine, Props, count_of, rows_of, tell
from .dss_records import RawCircuit
from .dss_rows import (
    name_of,
    raw_capacitor,
    raw_guard,
    raw_load,
    raw_other,
    raw_plant,
    raw_source,
    raw_tap_control,
    raw_transformer,
)
from .dss_rules import WITHOUT_MODEL

__all__ = ["read_circuit"]

_T = TypeVar("_T")

_GUARDS = ("fuse", "recloser", "relay", "swtcontrol")
_PLANTS = ("generator", "pvsystem", "storage")


def read_circuit(engine: Engine, coordinates: dict[str, tuple[float, float]]) -> RawCircuit:
    """Return what the engine's circuit is made of, disabled elements left out.

    Raises
    ------
    InputError
        With every element whose values make none.
    """
    _let_switches_act(engine)
    solution = engine.circuit.Solution
    told = Gathered()
    each, each_of = partial(_each, engine, told), partial(_each_of, engine, told)
    circuit = RawCircuit(
        name=str(engine.circuit.Name),
        frequency_hz=float(solution.Frequency),
        load_mult=float(solution.LoadMult),
        sources=each("vsource", raw_source),
        lines=each("line", line_reader(engine)),
        transformers=each("transformer", raw_transformer),
        loads=each("load", raw_load),
        capacitors=each(
            "capacitor", partial(raw_capacitor, frequency_hz=float(solution.Frequency))
        ),
        reactors=each("reactor", partial(raw_reactor, engine)),
        plants=each_of(_PLANTS, partial(raw_plant, gen_mult=float(solution.GenMult))),
        guards=each_of(_GUARDS, raw_guard),
        tap_controls=each("regcontrol", raw_tap_control),
        cap_controls=each("capcontrol", name_of),
        others=each_of(WITHOUT_MODEL, raw_other),
        disabled=0,
        coordinates=tuple((bus, x, y) for bus, (x, y) in coordinates.items()),
    )
    told.raise_if_any()
    enabled = {
        "line": circuit.lines,
        "transformer": circuit.transformers,
        "load": circuit.loads,
        "capacitor": circuit.capacitors,
        "reactor": circuit.reactors,
    }
    circuit = replace(circuit, opened=_opened_elements(engine, circuit))
    counted = sum(count_of(engine, kind) - len(parts) for kind, parts in enabled.items())
    return replace(circuit, disabled=counted)


def _let_switches_act(engine: Engine) -> None:
    """Open what switch controls are to open: the engine itself does so when it first solves."""
    for row in rows_of(engine, "swtcontrol"):
        guard = raw_guard("swtcontrol", row)
        if guard.element and str(row["state"]).lower() == "open" and not row["lock"]:
            tell(engine, [f'Open "{guard.element}" {guard.terminal} 0'])


def _opened_elements(engine: Engine, circuit: RawCircuit) -> tuple[tuple[str, bool], ...]:
    """Return the elements other than lines that have open conductors, and whether all are."""
    names = [f"transformer.{unit.name}" for unit in circuit.transformers]
    names += [f"load.{load.name}" for load in circuit.loads]
    names += [f"capacitor.{bank.name}" for bank in circuit.capacitors]
    names += [f"reactor.{reactor.name}" for reactor in circuit.reactors]
    names += [f"{plant.kind}.{plant.name}" for plant in circuit.plants]
    found = []
    for name in names:
        engine.circuit.SetActiveElement(name)
        active = engine.circuit.ActiveCktElement
        terminals = range(1, int(active.NumTerminals) + 1)
        phases = range(1, int(active.NumPhases) + 1)
        if any(active.IsOpen(terminal, 0) for terminal in terminals):
            whole = any(all(active.IsOpen(t, phase) for phase in phases) for t in terminals)
            found.append((name, whole))
    return tuple(found)


def _each(engine: Engine, told: Gathered, kind: str, read: Callable[[Props], _T]) -> tuple[_T, ...]:
    """Read every element of a class; tell of what makes none: what is infinite comes as null."""
    found: list[_T] = []
    for row in told.of(lambda: rows_of(engine, kind)) or ():
        try:
            found.append(read(row))
        except (ArithmeticError, IndexError, TypeError, ValueError):
            where, rule = (
                f"{kind} {name_of(row)!r}",
                "must hold finite numbers that make an element",
            )
            told.faults.append(Fault(source=engine.source, line=None, where=where, wanted=rule))
    return tuple(found)


def _each_of(
    engine: Engine, told: Gathered, kinds: Iterable[str], read: Callable[[str, Props], _T]
) -> tuple[_T, ...]:
    """Read every element of several classes."""
    return tuple(part for kind in kinds for part in _each(engine, told, kind, partial(read, kind)))
