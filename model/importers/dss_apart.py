"""What is asked of the engine, asked in a process that may die and cannot write."""

from __future__ import annotations

from collections.abc import Sequence

from .dss_child import run_apart
from .dss_circuit import read_circuit
from .dss_engine import refusals_told, settled_state, solved_volts, start, tell, version
from .dss_records import RawCircuit
from .dss_script import Script

__all__ = ["Volts", "read_apart", "settle_apart", "solve_apart"]

Volts = tuple[dict[tuple[str, int], complex], bool]
"""Voltage to earth of each (bus, node), and whether the solution converged."""

Settled = tuple[dict[str, dict[str, float]], dict[str, list[int]]]
"""Per transformer the tap of each winding, and per capacitor its steps."""

_SECONDS = 600.0


def read_apart(script: Script, source: str) -> tuple[RawCircuit, str]:
    """Return what the engine makes of a script, and which engine it is.

    Raises
    ------
    InputError
        If the engine does not take a command, dies or takes too long.
    OpenPhaseError
        If the extra is not installed.
    """
    return run_apart(_read, (script, source), source=source, seconds=_SECONDS)


def solve_apart(
    script: Script, source: str, told: Sequence[str], modes: Sequence[str]
) -> dict[str, Volts]:
    """Return the engine's own solutions of a script, by the mode of its loads.

    Parameters
    ----------
    script, source
        The circuit and the name of its file.
    told
        Further commands, made here, that bring it into the state of interest.
    modes
        As in `solved_volts`.
    """
    request = (script, source, tuple(told), tuple(modes))
    return run_apart(_solve, request, source=source, seconds=_SECONDS)


def settle_apart(script: Script, source: str) -> Settled:
    """Return the taps and capacitor steps at which the engine's own controls settle.

    Raises
    ------
    InputError
        If they do not, or the engine dies or takes too long.
    """
    return run_apart(_settle, (script, source), source=source, seconds=_SECONDS)


def _settle(request: tuple[Script, str]) -> Settled:
    """Compile and let the controls act: the child's side."""
    script, source = request
    engine = start(script.commands, source)
    with refusals_told(engine):
        return settled_state(engine)


def _read(request: tuple[Script, str]) -> tuple[RawCircuit, str]:
    """Compile and read: the child's side."""
    script, source = request
    engine = start(script.commands, source)
    with refusals_told(engine):
        # Until it has needed them, the engine tells default matrices for lines without a code.
        tell(engine, ("CalcVoltageBases",))
        return read_circuit(engine, script.coordinates), version(engine)


def _solve(request: tuple[Script, str, tuple[str, ...], tuple[str, ...]]) -> dict[str, Volts]:
    """Compile and solve: the child's side."""
    script, source, told, modes = request
    engine = start(script.commands, source)
    with refusals_told(engine):
        return {mode: solved_volts(engine, mode=mode, told=told) for mode in modes}
