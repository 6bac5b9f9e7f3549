"""OpenDSS's own phasors of a feeder, as they were written down, and in the compact form we keep.

A reference holds states of two modes: ``direct`` (every load its nominal admittance) and
``snap`` (the file's load laws). Each is intact, or open in one phase at one end of one line.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

__all__ = ["OpenState", "Pair", "Reference", "compact", "read_compact", "read_reference", "renamed"]

DECIMALS = 3  #: of the volts that are kept


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """Measuring points at buses m and n; the current is that from ``m`` towards ``towards``."""

    name: str
    m: str
    n: str
    towards: str


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenState:
    """One solved state; ``line`` None: nothing is open."""

    name: str
    mode: str
    load: float  #: factor on every load
    line: str | None
    bus: str | None  #: the line's end that is open
    phase: str | None
    converged: bool
    volts: dict[str, tuple[complex, complex, complex]]  #: of the three-phase buses
    z1_ohm: dict[str, complex]  #: eq. (5) of each pair, against the intact state


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """All states of a feeder, and how its controls stood in them."""

    file: str
    taps: dict[str, float]
    capacitors: dict[str, tuple[int, ...]]
    pairs: tuple[Pair, ...]
    states: tuple[OpenState, ...]

    def base_of(self, state: OpenState) -> OpenState:
        """The intact state of the same loads."""
        return next(
            other
            for other in self.states
            if other.line is None and (other.mode, other.load) == (state.mode, state.load)
        )


def read_reference(path: Path) -> Reference:
    """Read a file of ``shared/feeders/reference``."""
    told = json.loads(path.read_text(encoding="utf-8"))
    whole = "pairs" in told
    pairs = [
        Pair(name=p["name"], m=p["m"], n=p["n"], towards=p["mu"][1]) for p in told.get("pairs", ())
    ]
    if not whole:  # the 4-bus feeders: one pair, over the line that breaks
        pairs = [Pair(name="line1", m="sourcebus", n="n2", towards="n2")]
    model = told["about"]["model"] if whole else told["model"]
    return Reference(
        file=model.split("/", 1)[1],
        taps={name: taps["2"] for name, taps in told.get("taps_not_1", {}).items()},
        capacitors={n: tuple(s) for n, s in told.get("capacitor_states", {}).items()},
        pairs=tuple(pairs),
        states=tuple(_state(name, said) for name, said in told["states"].items()),
    )


def renamed(reference: Reference, buses: Mapping[str, str], lines: Mapping[str, str]) -> Reference:
    """The same with a feeder's names of buses and lines, where an import changed them."""
    states = tuple(
        replace(
            state,
            line=state.line and lines.get(state.line, state.line),
            bus=state.bus and buses.get(state.bus, state.bus),
            volts={buses.get(bus, bus): v for bus, v in state.volts.items()},
        )
        for state in reference.states
    )
    pairs = tuple(
        replace(
            pair,
            m=buses.get(pair.m, pair.m),
            n=buses.get(pair.n, pair.n),
            towards=buses.get(pair.towards, pair.towards),
        )
        for pair in reference.pairs
    )
    return replace(reference, states=states, pairs=pairs)


def _state(name: str, said: dict[str, Any]) -> OpenState:
    parts = name.split(":")
    load = float(parts.pop(0).removeprefix("load")) if parts[0].startswith("load") else 1.0
    z1 = said.get("eq5") or {}
    if isinstance(z1, list):
        z1 = {"line1": z1}
    return OpenState(
        name=name,
        mode=parts[0],
        load=load,
        line=said["element"].split(".", 1)[1] if "element" in said else None,
        bus=said.get("terminal_bus"),
        phase="abc"[said["phase"] - 1] if "phase" in said else None,
        converged=bool(said["converged"]),
        volts={bus: _three(v) for bus, v in said["V"].items()},
        z1_ohm={pair: complex(*z) for pair, z in z1.items() if z},
    )


def _three(v: list[list[float]]) -> tuple[complex, complex, complex]:
    a, b, c = (complex(*x) for x in v)
    return a, b, c


def compact(reference: Reference) -> str:
    """What tests compare of a reference: one line of JSON for each state."""
    buses = list(reference.states[0].volts)
    head = {
        "file": reference.file,
        "taps": reference.taps,
        "capacitors": reference.capacitors,
        "pairs": [[p.name, p.m, p.n, p.towards] for p in reference.pairs],
        "buses": buses,
    }
    lines = [json.dumps(head)]
    for state in reference.states:
        v = [x for bus in buses for v in state.volts[bus] for x in (v.real, v.imag)]
        lines.append(
            json.dumps(
                {
                    "name": state.name,
                    "mode": state.mode,
                    "load": state.load,
                    "open": [state.line, state.bus, state.phase] if state.line else None,
                    "converged": state.converged,
                    "z1_ohm": {p: [z.real, z.imag] for p, z in state.z1_ohm.items()},
                    "volts": [round(x, DECIMALS) for x in v],
                },
                separators=(",", ":"),
            )
        )
    return "\n".join(lines) + "\n"


def read_compact(path: Path) -> Reference:
    """Read what ``compact`` wrote."""
    head, *states = (json.loads(line) for line in path.read_text(encoding="utf-8").splitlines())
    return Reference(
        file=head["file"],
        taps=head["taps"],
        capacitors={name: tuple(steps) for name, steps in head["capacitors"].items()},
        pairs=tuple(Pair(name=p[0], m=p[1], n=p[2], towards=p[3]) for p in head["pairs"]),
        states=tuple(_kept(head["buses"], state) for state in states),
    )


def _kept(buses: list[str], said: dict[str, Any]) -> OpenState:
    line, bus, phase = said["open"] or (None, None, None)
    flat = iter(said["volts"])
    volts = {b: [complex(next(flat), next(flat)) for _ in range(3)] for b in buses}
    return OpenState(
        name=said["name"],
        mode=said["mode"],
        load=said["load"],
        line=line,
        bus=bus,
        phase=phase,
        converged=said["converged"],
        volts={b: (v[0], v[1], v[2]) for b, v in volts.items()},
        z1_ohm={p: complex(*z) for p, z in said["z1_ohm"].items()},
    )
