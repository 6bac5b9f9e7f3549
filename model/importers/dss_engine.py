"""The OpenDSS engine, handed one safe command at a time, and asked for what it holds."""

from __future__ import annotations

import importlib
import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import Fault, InputError, OpenPhaseError
from .dss_script import Command

__all__ = [
    "Engine",
    "Props",
    "count_of",
    "refusals_told",
    "rows_of",
    "settled_state",
    "solved_volts",
    "start",
    "tell",
    "version",
]

Props = Mapping[str, Any]

_FULL, _NO_DISABLED, _LOWER = 1, 32, 128
"""Options of the engine's JSON: every property, enabled elements alone, keys in lower case."""

_MOST_FAULTS = 20
"""After so many commands that failed the rest would fail for want of them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Engine:
    """An engine of its own with one compiled circuit in it."""

    context: Any
    circuit: Any
    source: str
    refusal: type[Exception]  #: what it raises


def start(commands: Iterable[Command], source: str) -> Engine:
    """Compile a circuit from its commands.

    Raises
    ------
    InputError
        With what the engine said to each command that it did not take.
    OpenPhaseError
        If the extra is not installed.
    """
    try:
        dss = importlib.import_module("dss")
    except ImportError as error:
        raise OpenPhaseError(
            f"{source}: an OpenDSS file needs the extra: pip install 'openphase[opendss]'"
        ) from error
    context = dss.DSS.NewContext()
    for option in ("AllowForms", "AllowEditor", "AllowChangeDir"):
        setattr(context, option, False)
    faults: list[Fault] = []
    for command in commands:
        try:
            context.Text.Command = command.text
        except dss.DSSException as error:
            where, rule = command.text[:80], f"is not taken by OpenDSS: {_said(error)}"
            faults.append(Fault(source=command.file, line=command.line, where=where, wanted=rule))
            if len(faults) >= _MOST_FAULTS:
                break
    if not faults and not context.NumCircuits:
        faults.append(
            Fault(source=source, line=None, where="", wanted="must make a circuit (New Circuit…)")
        )
    if faults:
        raise InputError(faults)
    return Engine(
        context=context, circuit=context.ActiveCircuit, source=source, refusal=dss.DSSException
    )


@contextmanager
def refusals_told(engine: Engine) -> Iterator[None]:
    """Turn what the engine says against the circuit as a whole into an error of the input."""
    try:
        yield
    except engine.refusal as error:
        rule = f"is not taken by OpenDSS: {_said(error)}"
        raise InputError.single(engine.source, "the circuit", None, rule) from None


def _said(error: Exception) -> str:
    """Return what the engine said, on one line."""
    return " ".join(str(error.args[-1]).split())[:300]


def rows_of(engine: Engine, kind: str, *, disabled: bool = False) -> list[Props]:
    """Return every property of each enabled element of a class, keys in lower case."""
    if engine.circuit.SetActiveClass(kind) < 0:
        return []
    options = _FULL | _LOWER | (0 if disabled else _NO_DISABLED)
    text = engine.circuit.ActiveClass.ToJSON(options)
    try:
        found = json.loads(text) if text else []
    except json.JSONDecodeError:
        # so it comes where a list of them holds an infinite one
        rule = "must hold finite numbers"
        raise InputError.single(engine.source, f"every {kind}", None, rule) from None
    return found if isinstance(found, list) else []


def version(engine: Engine) -> str:
    """Return the engine's name and version."""
    return str(engine.context.Version).split(" revision", maxsplit=1)[0]


def count_of(engine: Engine, kind: str) -> int:
    """Return how many elements of a class there are, disabled ones too."""
    engine.circuit.SetActiveClass(kind)
    return int(engine.circuit.ActiveClass.Count)


def tell(engine: Engine, commands: Iterable[str]) -> None:
    """Hand commands over that were made here, not read from a file."""
    for command in commands:
        engine.context.Text.Command = command


def solved_volts(
    engine: Engine, *, mode: str, told: Iterable[str] = ()
) -> tuple[dict[tuple[str, int], complex], bool]:
    """Let the engine solve, its controls off, and return each node's voltage to earth.

    Parameters
    ----------
    mode
        ``snap`` with the loads' own laws, ``direct`` with nominal admittances.
    told
        Commands that bring the circuit into the state of interest, which a mode undoes in part.
    """
    options = ("controlmode=off", "tolerance=1e-8", "maxiterations=500", f"mode={mode}")
    tell(engine, (f"Set {option}" for option in options))
    tell(engine, told)
    try:
        engine.circuit.Solution.Solve()
    except engine.refusal:
        return {}, False
    flat = np.asarray(engine.circuit.AllBusVolts, np.float64)
    volts = flat[0::2] + 1j * flat[1::2]
    nodes: dict[tuple[str, int], complex] = {}
    for name, value in zip(engine.circuit.AllNodeNames, volts, strict=True):
        bus, _, node = name.rpartition(".")
        nodes[(bus.lower(), int(node))] = complex(value)
    return nodes, bool(engine.circuit.Solution.Converged)


def settled_state(engine: Engine) -> tuple[dict[str, dict[str, float]], dict[str, list[int]]]:
    """Let the engine's own controls settle, and return all taps and capacitor steps.

    Raises
    ------
    InputError
        If they do not settle.
    """
    options = ("controlmode=static", "maxcontroliter=200", "maxiterations=500", "mode=snap")
    tell(engine, (f"Set {option}" for option in options))
    engine.circuit.Solution.Solve()
    if not engine.circuit.Solution.Converged or not engine.circuit.Solution.ControlActionsDone:
        rule = "do not settle: leave --solve-controls out, and taps stay as the file has them"
        raise InputError.single(engine.source, "the circuit's controls", None, rule)
    taps = {
        str(row["Name"]).lower(): {str(n): float(tap) for n, tap in enumerate(row["taps"], start=1)}
        for row in rows_of(engine, "transformer")
    }
    states = {
        str(row["Name"]).lower(): [int(state) for state in row["states"]]
        for row in rows_of(engine, "capacitor")
    }
    return taps, states
