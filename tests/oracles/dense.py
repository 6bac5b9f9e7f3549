"""Brute-force reference: a feeder as a dense three-phase circuit in phase quantities.

Modified nodal analysis. Unknowns are the phase-to-earth voltages of every physical node
(buses, tees, both stubs of a break, LV terminals, floating neutrals) *and* the currents of
every line piece, switch, source and winding, so that zero impedances, closed switches,
isolated neutrals and open conductors are exact: an element is ``V_a - V_b - Z I = 0``, or
``I = 0`` where it is open. No sequence network, no reduction of the network to its tree, no
referral of LV quantities: transformers are three single-phase two-winding units with their
true turns ratios and LV nodes of their own.

What is not determined (an isolated conductor without a path to earth) lies in the null
space of the matrix; there the solution of least norm is taken and the nodes are reported in
``floating``.

Written without sight of the project's solver; it shares only the feeder's dataclasses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from oracles.dense_circuit import (
    FORTESCUE,
    Circuit,
    Complex,
    Floats,
    Found,
    Group,
    NoSolutionError,
    NotConvergedError,
    solve_circuit,
)
from oracles.dense_parts import (
    KV_LV,
    Cut,
    Kept,
    LineEnd,
    Windings,
    add_capacitor,
    add_der,
    add_line,
    add_load,
    add_regulator,
    add_source,
    add_transformer,
    hung_on_lines,
    power_va,
    windings,
)

from openphase.model.parts import (
    Capacitor,
    Connection,
    Der,
    Feeder,
    Line,
    Load,
    Place,
    Regulator,
    Switch,
    Transformer,
)

__all__ = [
    "FORTESCUE",
    "DenseSolution",
    "Event",
    "NoSolutionError",
    "NotConvergedError",
    "Shunt",
    "solve_dense",
]

STEP_NODE = "tee step"
FLOATING_TOLERANCE = 1e-7
"""Component of a (unit) null vector from which a node counts as floating."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shunt:
    """An admittance at the event: from a phase to earth, or to another phase.

    ``where``: the from-side stub p, the to-side stub q, or the far place.
    """

    where: Literal["p", "q", "far"]
    phase: int
    other: int | None = None
    siemens: complex
    exponent: float = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """What is other than normal in the state that is solved; the defaults are nothing.

    A tee at exactly the fraction of a break hangs on the from-bus side, with
    ``before_tees`` on the to-bus side; a step load hangs on the from-bus side.

    Parameters
    ----------
    open_line, open_fraction, open_phases
        Conductors (0..2) broken at that fraction of the line, counted from its from-bus.
        The line is cut there even where no phase is open: its stubs are nodes, and its
        charging is shared between the parts.
    step_line, step_fraction, step_kw, step_phases, step_exponent
        Grounded-wye load of unity power factor; ``step_kw`` is the total at nominal
        voltage and is shared equally among the phases.
    shunts, far
        What is connected at the stubs and at a second place besides.
    emf_scale
        Factor on the source's EMF.
    taps, ders
        By regulator: factors on the ratio of the three phases. By DER: factor on what it
        delivers after the event; 0: tripped.
    """

    open_line: str | None = None
    open_fraction: float = 0.5
    open_phases: tuple[int, ...] = ()
    before_tees: bool = False
    step_line: str | None = None
    step_fraction: float = 0.5
    step_kw: float = 0.0
    step_phases: tuple[int, ...] = (0, 1, 2)
    step_exponent: float = 2.0
    shunts: tuple[Shunt, ...] = ()
    far: Place | None = None
    emf_scale: float = 1.0
    taps: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    ders: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DenseSolution:
    """Phasors of one state; every array has shape (3,), volts to earth or amperes.

    Parameters
    ----------
    v
        Voltage of each bus; of a detached line end as ``"<line>@<bus>"``.
    stubs
        Voltage of ``"<line>.p"`` and ``"<line>.q"``: from-bus and to-bus side of the break.
    lv
        LV terminal voltages of each transformer (their sum is zero behind a D winding).
    i_from, i_to
        Current INTO each line at its from and to end, the charging there included.
    i_switch
        Current through each switch and regulator, from its from-bus to its to-bus (of a
        regulator, on the to-side).
    i_source
        Current out of the source.
    floating
        (key of ``v`` or ``stubs``, phase) of voltages that the circuit does not determine.
    load_pu
        Voltage magnitudes on which loads, motors and DER depend, pu, by group.
    load_va, source_va, loss_va, charging_va
        Power taken by each load, motor (``NAME.motor``), DER (``NAME.der``), capacitor
        (``NAME.capacitor``), step load (``step``) and shunt (``shunt N``); given by the EMF;
        lost in the source's impedance and neutral, lines and transformers; taken by the
        lines' charging.
    kept
        By DER: positive-sequence winding voltage and the current fed in there.
    iterations
        Linear solutions that were needed.
    """

    v: dict[str, Complex]
    stubs: dict[str, Complex]
    lv: dict[str, Complex]
    i_from: dict[str, Complex]
    i_to: dict[str, Complex]
    i_switch: dict[str, Complex]
    i_source: Complex
    floating: set[tuple[str, int]]
    load_pu: dict[str, Floats]
    load_va: dict[str, complex]
    source_va: complex
    loss_va: complex
    charging_va: complex
    kept: dict[str, Kept]
    iterations: int


def solve_dense(
    feeder: Feeder,
    closed: frozenset[str],
    event: Event | None = None,
    load_scale: Mapping[str, float] | None = None,
    exponents: Mapping[str, float] | None = None,
    connections: Mapping[str, Connection] | None = None,
    emf_scale: float = 1.0,
    start: DenseSolution | None = None,
    *,
    before: DenseSolution | None = None,
    opened: frozenset[str] = frozenset(),
    delta_step: int = 1,
    hold: bool = False,
) -> DenseSolution:
    """Solve one state of a feeder, which is not changed.

    Parameters
    ----------
    closed
        Names of the switches that are closed; overrides ``Switch.closed``.
    load_scale, exponents
        By load name: factor on P and Q, and voltage exponent instead of the load's own.
    connections
        By transformer name: connection instead of the unit's own. ``x0_pu`` counts only
        where the connection in force is Yg/Yg.
    emf_scale
        Factor on the EMF, beside the event's own.
    start
        State from which voltage-dependent loads start; nominal voltage without it.
    before
        State from which DER keep what their model says; without it this is a state before
        an event, and they deliver their power.
    opened
        Points whose line end is detached from its bus.
    delta_step
        1 or 2: winding k of a D lies between phases k and k + delta_step (the vector group).
    hold
        Leave loads at their admittances at ``start`` instead of iterating them: where
        ``load_pu`` then comes out as it went in, ``start`` is an operating point.

    Raises
    ------
    NotConvergedError
        The voltage-dependent loads have no fixed point in reach; as NoSolutionError, no
        voltages fulfil the equations.
    """
    happening = event or Event()
    _check(feeder, happening, closed, opened)
    _known("load", {**(load_scale or {}), **(exponents or {})}, {x.name for x in feeder.loads})
    _known("transformer", connections or {}, {t.name for t in feeder.transformers})
    kinds = {t.name: (connections or {}).get(t.name, t.connection) for t in feeder.transformers}

    node_of, hung = hung_on_lines(feeder)
    if happening.step_line is not None:
        hung[happening.step_line][STEP_NODE] = happening.step_fraction
    far = happening.far.bus if happening.far is not None else None
    if happening.far is not None and happening.far.line is not None:
        assert happening.far.at is not None
        far = "tee far"
        hung[happening.far.line][far] = happening.far.at
    circuit = Circuit(s_base=1e6 / 3)
    handles = _add_network(circuit, feeder, closed, happening, opened, emf_scale, hung)
    kv = feeder.source.kv_ll
    handles.lv = {
        t.name: add_transformer(circuit, t, kinds[t.name], node_of[f"T {t.name}"], kv, delta_step)
        for t in feeder.transformers
    }

    def where(transformer: str | None, key: str, kind: str) -> Windings:
        if transformer is None:
            return windings(node_of[key], kind, kv)
        kind = "wye" if kinds[transformer].endswith("/Yg") else "delta"
        return windings(f"{transformer}.lv", kind, KV_LV)

    for load in feeder.loads:
        at = where(load.transformer, f"L {load.name}", load.connection)
        va = power_va(load.kw, load.power_factor) * (load_scale or {}).get(load.name, 1.0)
        add_load(circuit, load, at, va, (exponents or {}).get(load.name, load.exponent))
    for der in feeder.ders:
        at = where(der.transformer, f"G {der.name}", "wye")
        kept = None if before is None else before.kept[der.name]
        share = happening.ders.get(der.name, 1.0)
        add_der(circuit, der, at, feeder.source.v_phase_v, kept, share)
    for bank in feeder.capacitors:
        add_capacitor(circuit, bank, windings(node_of[f"C {bank.name}"], bank.connection, kv))
    _add_step(circuit, happening, feeder.source.v_phase_v)
    _add_shunts(circuit, happening, far, feeder.source.v_phase_v)
    found = solve_circuit(circuit, start.load_pu if start is not None else {}, hold=hold)
    return _solution(circuit, handles, found, feeder)


def _known(kind: str, given: Mapping[str, object], names: set[str]) -> None:
    if unknown := set(given) - names:
        raise ValueError(f"no {kind} {sorted(unknown)}")


def _check(feeder: Feeder, event: Event, closed: frozenset[str], opened: frozenset[str]) -> None:
    lines = {line.name for line in feeder.lines}
    for name in (event.open_line, event.step_line):
        if name is not None and name not in lines:
            raise ValueError(f"event: no line {name!r}")
    if not {*event.open_phases, *event.step_phases} <= {0, 1, 2}:
        raise ValueError("event: phases must be among 0, 1, 2")
    _known("switch", dict.fromkeys(closed), {s.name for s in feeder.switches})
    _known("point", dict.fromkeys(opened), {p.name for p in feeder.points})
    _known("regulator", event.taps, {r.name for r in feeder.regulators})
    _known("DER", event.ders, {d.name for d in feeder.ders})


def _add_step(circuit: Circuit, event: Event, v_phase: float) -> None:
    """The event's single- to three-phase grounded load at its tee."""
    if event.step_line is None:
        return
    count = len(event.step_phases)
    circuit.groups["step"] = Group(
        plus=[(STEP_NODE, k) for k in event.step_phases],
        minus=[None] * count,
        v_nominal=v_phase,
        y_s=event.step_kw * 1000.0 / count / v_phase**2 * np.eye(count, dtype=np.complex128),
        exponent=event.step_exponent,
    )


def _add_shunts(circuit: Circuit, event: Event, far: str | None, v_phase: float) -> None:
    nodes = {"p": f"{event.open_line}.p", "q": f"{event.open_line}.q", "far": far}
    for n, shunt in enumerate(event.shunts):
        node = nodes[shunt.where]
        assert node is not None
        circuit.groups[f"shunt {n}"] = Group(
            plus=[(node, shunt.phase)],
            minus=[None if shunt.other is None else (node, shunt.other)],
            v_nominal=v_phase,
            y_s=np.array([[shunt.siemens]], dtype=np.complex128),
            exponent=shunt.exponent,
        )


@dataclass(slots=True)
class _Handles:
    """Where the asked quantities are among nodes and unknowns."""

    buses: list[str]
    stubs: list[str]
    emf: Complex
    i_source: list[int]
    ends: dict[str, tuple[LineEnd, LineEnd]]
    switches: dict[str, list[int]]
    lv: dict[str, str] = field(default_factory=dict)


def _ends(line: Line, feeder: Feeder, opened: frozenset[str]) -> tuple[str, str]:
    """Nodes of a line's ends; a detached end is a node of its own."""
    off = {(p.line, p.bus) for p in feeder.points if p.name in opened}
    start, end = (
        f"{line.name}@{bus}" if (line.name, bus) in off else bus
        for bus in (line.from_bus, line.to_bus)
    )
    return start, end


def _add_network(
    circuit: Circuit,
    feeder: Feeder,
    closed: frozenset[str],
    event: Event,
    opened: frozenset[str],
    emf_scale: float,
    hung: Mapping[str, Mapping[str, float]],
) -> _Handles:
    """Add buses, source, lines, switches and regulators."""
    v = feeder.source.v_phase_v
    joined = {line.name: _ends(line, feeder, opened) for line in feeder.lines}
    buses = _buses(feeder)
    buses += [end for ends in joined.values() for end in ends if "@" in end]
    for bus in buses:
        circuit.node(bus, v)
    i_source, emf = add_source(circuit, feeder.source, emf_scale * event.emf_scale)
    ends = {}
    for line in feeder.lines:
        cut = None
        if line.name == event.open_line:
            cut = Cut(
                line=line.name,
                fraction=event.open_fraction,
                open_phases=event.open_phases,
                before_tees=event.before_tees,
            )
        ends[line.name] = add_line(
            circuit, line, feeder.source, hung[line.name], cut, joined[line.name]
        )
    switches = {
        s.name: circuit.gap(s.from_bus, s.to_bus, () if s.name in closed else (0, 1, 2), v)
        for s in feeder.switches
    }
    for regulator in feeder.regulators:
        factor = event.taps.get(regulator.name, (1.0, 1.0, 1.0))
        switches[regulator.name] = add_regulator(circuit, regulator, factor, v)
    stubs = [f"{event.open_line}.{side}" for side in "pq"] if event.open_line else []
    return _Handles(buses, stubs, emf, i_source, ends, switches)


def _solution(circuit: Circuit, handles: _Handles, found: Found, feeder: Feeder) -> DenseSolution:
    """From unknowns to names."""
    x = found.x
    loose = np.abs(found.null).max(axis=1, initial=0.0) > FLOATING_TOLERANCE

    def at(name: str) -> Complex:
        column, _ = circuit.nodes[name]
        return np.asarray(x[column : column + 3], dtype=np.complex128)

    def into(end: LineEnd) -> Complex:
        return np.asarray(end.sign * x[end.columns] + end.y @ at(end.node))

    def kept(name: str) -> Kept:
        forward = FORTESCUE[:, 1].conj() / 3
        group = f"{name}.der"
        return Kept(
            complex(forward @ found.across[group]), -complex(forward @ found.drawn_a[group])
        )

    in_neutral = 0j
    if circuit.neutral is not None:
        column, y = circuit.neutral
        in_neutral = complex(abs(x[column]) ** 2 * np.conj(y))
    return DenseSolution(
        v={bus: at(bus) for bus in handles.buses},
        stubs={stub: at(stub) for stub in handles.stubs},
        lv={name: at(node) for name, node in handles.lv.items()},
        i_from={name: into(first) for name, (first, _) in handles.ends.items()},
        i_to={name: into(last) for name, (_, last) in handles.ends.items()},
        i_switch={name: x[columns] for name, columns in handles.switches.items()},
        i_source=x[handles.i_source],
        floating={
            (name, k)
            for name in [*handles.buses, *handles.stubs]
            for k in range(3)
            if loose[circuit.nodes[name][0] + k]
        },
        load_pu=found.pu,
        load_va={name: complex(v @ found.drawn_a[name].conj()) for name, v in found.across.items()},
        source_va=complex(handles.emf @ x[handles.i_source].conj()),
        loss_va=complex(sum(x[c].conj() @ z @ x[c] for z, c in circuit.losses)) + in_neutral,
        charging_va=complex(sum(at(n) @ (y @ at(n)).conj() for n, y in circuit.charging)),
        kept={der.name: kept(der.name) for der in feeder.ders},
        iterations=found.iterations,
    )


def _buses(feeder: Feeder) -> list[str]:
    """Every bus that is named anywhere, once, in order of appearance."""
    named = [feeder.source.bus]
    edges: list[Line | Switch | Regulator] = [*feeder.lines, *feeder.switches, *feeder.regulators]
    for edge in edges:
        named += [edge.from_bus, edge.to_bus]
    items: list[Transformer | Load | Der | Capacitor] = [*feeder.transformers, *feeder.loads]
    items += [*feeder.ders, *feeder.capacitors]
    for item in items:
        if item.place is not None and item.place.bus is not None:
            named.append(item.place.bus)
    return list(dict.fromkeys(named))
