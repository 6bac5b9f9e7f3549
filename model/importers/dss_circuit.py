"""Reads a compiled OpenDSS circuit into plain records."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import Fault, InputError
from .dss_engine import Engine, Props, count_of, rows_of, tell
from .dss_records import (
    End,
    Matrix,
    OtherElement,
    RawCapacitor,
    RawCircuit,
    RawGuard,
    RawLine,
    RawLoad,
    RawPlant,
    RawReactor,
    RawSource,
    RawTapControl,
    RawTransformer,
    Winding,
)

__all__ = ["read_circuit"]

_T = TypeVar("_T")

_METRES = {
    "mi": 1609.344,
    "kft": 304.8,
    "km": 1000.0,
    "m": 1.0,
    "ft": 0.3048,
    "in": 0.0254,
    "cm": 0.01,
    "mm": 0.001,
}
_GUARDS = ("fuse", "recloser", "relay", "swtcontrol")
_PLANTS = ("generator", "pvsystem", "storage")
_UNREAD = (
    "isource",
    "vccs",
    "fault",
    "upfc",
    "espvlcontrol",
    "indmach012",
    "gicsource",
    "autotrans",
    "gicline",
    "gictransformer",
    "vsconverter",
)


def read_circuit(engine: Engine, coordinates: dict[str, tuple[float, float]]) -> RawCircuit:
    """Return what the engine's circuit is made of, disabled elements left out."""
    _let_switches_act(engine)
    solution = engine.circuit.Solution
    circuit = RawCircuit(
        name=str(engine.circuit.Name),
        frequency_hz=float(solution.Frequency),
        load_mult=float(solution.LoadMult),
        sources=_each(engine, "vsource", _source),
        lines=_lines(engine),
        transformers=_each(engine, "transformer", _transformer),
        loads=_each(engine, "load", _load),
        capacitors=_each(
            engine, "capacitor", partial(_capacitor, frequency_hz=float(solution.Frequency))
        ),
        reactors=_each(engine, "reactor", partial(_reactor, engine)),
        plants=_each_of(engine, _PLANTS, partial(_plant, gen_mult=float(solution.GenMult))),
        guards=_each_of(engine, _GUARDS, _guard),
        tap_controls=_each(engine, "regcontrol", _tap_control),
        cap_controls=_each(engine, "capcontrol", _name),
        others=_each_of(engine, _UNREAD, _other),
        disabled=0,
        coordinates=tuple((bus, x, y) for bus, (x, y) in coordinates.items()),
    )
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
        guard = _guard("swtcontrol", row)
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


def _each(engine: Engine, kind: str, read: Callable[[Props], _T]) -> tuple[_T, ...]:
    """Read every element of a class.

    Raises
    ------
    InputError
        With every element whose values make none: an infinite one is told as nothing.
    """
    found: list[_T] = []
    faults: list[Fault] = []
    for row in rows_of(engine, kind):
        try:
            found.append(read(row))
        except (ArithmeticError, IndexError, TypeError, ValueError):
            where, rule = f"{kind} {_name(row)!r}", "must hold finite numbers that make an element"
            faults.append(Fault(source=engine.source, line=None, where=where, wanted=rule))
    if faults:
        raise InputError(faults)
    return tuple(found)


def _each_of(
    engine: Engine, kinds: Sequence[str], read: Callable[[str, Props], _T]
) -> tuple[_T, ...]:
    """Read every element of several classes."""
    return tuple(part for kind in kinds for part in _each(engine, kind, partial(read, kind)))


def end_of(text: str, conductors: int, phases: int) -> End:
    """Return the terminal that ``bus.1.2.3`` means: phases by default, then earth.

    Examples
    --------
    >>> end_of("671.3.1", 2, 1)
    End(bus='671', nodes=(3, 1))
    >>> end_of("B", 4, 3)
    End(bus='b', nodes=(1, 2, 3, 0))
    """
    bus, *given = text.strip().lower().split(".")
    nodes = [int(node) for node in given if node.strip()][:conductors]
    nodes += [n + 1 if n < phases else 0 for n in range(len(nodes), conductors)]
    return End(bus=bus, nodes=tuple(nodes))


def _name(row: Props) -> str:
    return str(row["Name"] if "Name" in row else row["name"]).lower()


def _complex(pair: Sequence[float]) -> complex:
    return complex(pair[0], pair[1])


def _matrix(rows: Any) -> Matrix:
    return tuple(tuple(float(value) for value in row) for row in rows)


def _source(row: Props) -> RawSource:
    phases = int(row["phases"])
    ideal = str(row["model"]).lower() == "ideal"
    ohms = float(row["basekv"]) ** 2 / float(row["basemva"])
    z1, z2, z0 = (_complex(row[key]) for key in ("z1", "z2", "z0"))
    if ideal:
        z1 = z2 = z0 = _complex(row["puzideal"]) * ohms
    return RawSource(
        name=_name(row),
        end=end_of(row["bus1"], phases, phases),
        earthed=not row["bus2"] or not any(end_of(row["bus2"], phases, phases).nodes),
        sequence=str(row["sequence"]).lower(),
        phases=phases,
        kv_ll=float(row["basekv"]),
        pu=float(row["pu"]),
        angle_deg=float(row["angle"]),
        z1_ohm=z1,
        z2_ohm=z2,
        z0_ohm=z0,
    )


def _lines(engine: Engine) -> tuple[RawLine, ...]:
    units = {_name(row): row.get("units") for row in rows_of(engine, "linecode", disabled=True)}
    return _each(engine, "line", partial(_line, engine, units))


def _line(engine: Engine, code_units: dict[str, Any], row: Props) -> RawLine:
    phases = int(row["phases"])
    code = row.get("linecode")
    unit = str(row["units"]).lower()
    if unit not in _METRES and code:
        # a length without a unit is in that of its code
        unit = str(code_units.get(str(code).lower())).lower()
    build = code or row.get("geometry") or row.get("spacing")
    r_ohm, x_ohm = _matrix(row["rmatrix"]), _matrix(row["xmatrix"])
    opened = _opened(engine, f"line.{_name(row)}", phases)
    times = float(engine.circuit.Solution.Frequency) / float(row["basefreq"])
    if times != 1.0 and not any(map(any, opened)):
        r_ohm, x_ohm = _at_frequency(engine, row)
    elif times != 1.0:
        x_ohm = _matrix((np.array(x_ohm) * times).tolist())
    return RawLine(
        name=_name(row),
        ends=(end_of(row["bus1"], phases, phases), end_of(row["bus2"], phases, phases)),
        r_ohm=r_ohm,
        x_ohm=x_ohm,
        c_nf=_matrix(row["cmatrix"]),
        length=float(row["length"]),
        unit_m=_METRES.get(unit),
        build=str(build).lower() if build else None,
        is_switch=bool(row["switch"]),
        opened=opened,
    )


def _at_frequency(engine: Engine, row: Props) -> tuple[Matrix, Matrix]:
    """Return R and X, per unit of length, of a line whose matrices are of another frequency.

    The earth's part of the impedance is not proportional to it, so they come from the line's
    own admittance matrix, in which no conductor may be open.
    """
    size = int(row["phases"])
    y = _own_admittances(engine, f"line.{_name(row)}")
    own = np.linalg.inv(-y[:size, size:]) / float(row["length"])
    z = np.asarray((own + own.T) / 2.0)
    return _matrix(z.real), _matrix(z.imag)


def _own_admittances(engine: Engine, element: str) -> NDArray[np.complex128]:
    """Return the admittance matrix of an element by itself."""
    engine.circuit.SetActiveElement(element)
    flat = np.asarray(engine.circuit.ActiveCktElement.Yprim, np.float64)
    if flat.size < 8:
        engine.circuit.Solution.BuildYMatrix(0, 1)
        engine.circuit.SetActiveElement(element)
        flat = np.asarray(engine.circuit.ActiveCktElement.Yprim, np.float64)
    y = flat[0::2] + 1j * flat[1::2]
    size = math.isqrt(y.size)
    return y.reshape(size, size)


def _opened(engine: Engine, element: str, phases: int) -> tuple[tuple[bool, ...], tuple[bool, ...]]:
    engine.circuit.SetActiveElement(element)
    active = engine.circuit.ActiveCktElement
    near, far = (
        tuple(bool(active.IsOpen(terminal, n + 1)) for n in range(phases)) for terminal in (1, 2)
    )
    return near, far


def _transformer(row: Props) -> RawTransformer:
    phases = int(row["phases"])
    across = [float(value) for value in row["xscarray"]] + [0.0, 0.0]
    return RawTransformer(
        name=_name(row),
        phases=phases,
        windings=tuple(_winding(row, n, phases) for n in range(len(row["kvs"]))),
        # what counts: xhl, xht and xlt may tell a default that the engine does not use
        x_pct=(across[0], across[1], across[2]),
        imag_pct=float(row["%imag"]),
        noload_pct=float(row["%noloadloss"]),
        euro=str(row["leadlag"]).lower() in {"lead", "euro"},
        bank=str(row["bank"]).lower(),
    )


def _winding(row: Props, n: int, phases: int) -> Winding:
    r_neutral = float(row["rneut"][n])
    steps = max(int(row["numtaps"][n]), 1)
    return Winding(
        end=end_of(row["buses"][n], phases + 1, phases),
        delta=str(row["conns"][n]).lower().startswith("d"),
        kv=float(row["kvs"][n]),
        kva=float(row["kvas"][n]),
        r_pct=float(row["%rs"][n]),
        tap=float(row["taps"][n]),
        tap_step=(float(row["maxtap"][n]) - float(row["mintap"][n])) / steps,
        most_taps=max(steps // 2, 1),
        neutral_ohm=complex(r_neutral, float(row["xneut"][n])) if r_neutral >= 0.0 else None,
    )


def _load(row: Props) -> RawLoad:
    phases = int(row["phases"])
    delta = str(row["conn"]).lower().startswith(("d", "l"))
    conductors = phases if delta and phases > 2 else phases + 1
    return RawLoad(
        name=_name(row),
        end=end_of(row["bus1"], conductors, phases),
        phases=phases,
        delta=delta,
        kv=float(row["kv"]),
        kw=float(row["kw"]),
        kvar=float(row["kvar"]),
        model=int(row["model"]),
        cvr=(float(row["cvrwatts"]), float(row["cvrvars"])),
        zipv=tuple(float(value) for value in row["zipv"]),
        v_min_pu=float(row["vminpu"]),
        v_max_pu=float(row["vmaxpu"]),
        v_low_pu=float(row["vlowpu"]),
        fixed=str(row["status"]).lower() != "variable",
        neutral_earthed=float(row["rneut"]) >= 0.0,
    )


def _capacitor(row: Props, frequency_hz: float) -> RawCapacitor:
    phases = int(row["phases"])
    delta = str(row["conn"]).lower().startswith(("d", "l"))
    kv = float(row["kv"])
    branch_kv = kv / 3.0**0.5 if phases > 1 and not delta else kv
    # microfarads are what counts: the engine makes them of kvar in its own way
    kvar_of_uf = 2.0e-3 * math.pi * frequency_hz * branch_kv**2 * phases
    conductors = phases + 1 if delta and phases < 3 else phases
    return RawCapacitor(
        name=_name(row),
        end=end_of(row["bus1"], conductors, phases),
        far=end_of(row["bus2"] or "", phases, phases),
        phases=phases,
        delta=delta,
        kv=kv,
        kvar=tuple(float(f"{kvar_of_uf * float(value):.12g}") for value in row["cuf"]),
        states=tuple(int(value) for value in row["states"]),
        damped=any(float(value) != 0.0 for key in ("r", "xl") for value in row[key]),
    )


def _reactor(engine: Engine, row: Props) -> RawReactor:
    """Read a reactor, its impedance out of its own admittance matrix: that covers every way."""
    phases = int(row["phases"])
    delta = str(row["conn"]).lower().startswith(("d", "l"))
    own = _own_admittances(engine, f"reactor.{_name(row)}")[:phases, :phases]
    # a delta's matrix has no inverse; its branches are the same in all of them
    z = np.diag(np.full(phases, -1.0 / own[0, 1])) if delta and phases > 1 else np.linalg.inv(own)
    return RawReactor(
        name=_name(row),
        ends=(
            end_of(row["bus1"], phases, phases),
            end_of(row["bus2"] or "", phases, phases),
        ),
        delta=delta,
        r_ohm=_matrix(z.real),
        x_ohm=_matrix(z.imag),
    )


def _plant(kind: str, row: Props, *, gen_mult: float) -> RawPlant:
    kw, kvar = float(row["kw"]) if "kw" in row else 0.0, float(row["kvar"])
    if kind == "pvsystem":
        made = float(row["pmpp"]) * float(row["irradiance"]) * float(row["%pmpp"]) / 100.0
        kw = min(made, float(row["kva"]))
    if kind == "generator" and str(row["status"]).lower() != "fixed":
        kw, kvar = kw * gen_mult, kvar * gen_mult
    phases = int(row["phases"])
    return RawPlant(
        kind=kind,
        name=_name(row),
        end=end_of(row["bus1"], phases + 1, phases),
        phases=phases,
        kw=kw,
        kvar=kvar,
        model=int(row["model"]),
    )


def _guard(kind: str, row: Props) -> RawGuard:
    # a relay or recloser that names nothing to switch, switches what it watches
    return RawGuard(
        kind=kind,
        name=_name(row),
        element=str(row["switchedobj"] or row.get("monitoredobj") or "").lower(),
        terminal=int(row["switchedterm"]),
    )


def _tap_control(row: Props) -> RawTapControl:
    return RawTapControl(
        name=_name(row),
        transformer=str(row["transformer"]).lower().rpartition(".")[2],
        winding=int(row["tapwinding"]),
    )


def _other(kind: str, row: Props) -> OtherElement:
    phases = int(row.get("phases") or 3)
    texts = [row[key] for key in ("bus1", "bus2") if row.get(key)] or list(row.get("buses") or ())
    ends = tuple(end_of(text, phases, phases) for text in texts)
    return OtherElement(kind=kind, name=_name(row), ends=ends)
