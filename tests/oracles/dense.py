"""Brute-force reference: a feeder as a dense three-phase circuit in phase quantities.

Modified nodal analysis. Unknowns are the phase-to-earth voltages of every physical node
(buses, tees, both stubs of a break, LV terminals, floating neutrals) *and* the currents of
every line piece, switch, source and winding, so that zero impedances, closed switches,
isolated neutrals and open conductors are exact: an element is ``V_a - V_b - Z I = 0``, or
``I = 0`` where it is open. No sequence network, no reduction of the network to its tree, no
referral of LV quantities: transformers are single-phase units with their true turns ratios
and nodes of their own. A conductor that is not there has no equation but ``V = 0``.

What is not determined (an isolated conductor without a path to earth) lies in the null
space of the matrix; there the solution of least norm is taken and the nodes are reported in
``floating``.

Written without sight of the project's solver; it shares only the feeder's dataclasses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from oracles.dense_circuit import Circuit, Found, NoSolutionError, NotConvergedError, solve_circuit
from oracles.dense_groups import FORTESCUE, Complex, Group, Law
from oracles.dense_inline import Through, add_inline, add_regulator, nominal_volts, summed
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
    add_source,
    add_transformer,
    branches,
    hung_on_lines,
    rows,
    windings,
)
from oracles.dense_records import DenseSolution, Event, Shunt

from openphase.model.parts import Connection, Der, Feeder, Line, Load, Switch

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
ROOT = float(np.sqrt(3.0))
FLOATING_TOLERANCE = 1e-7
"""Component of a (unit) null vector from which a node counts as floating."""


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
    volts = handles.volts
    handles.lv = {
        t.name: add_transformer(
            circuit,
            t,
            kinds[t.name],
            node_of[f"T {t.name}"],
            volts[node_of[f"T {t.name}"]] * ROOT / 1000.0,
            delta_step,
        )
        for t in feeder.transformers
    }

    def where(part: Load | Der, key: str) -> Windings:
        if part.transformer is not None:
            kind = "wye" if kinds[part.transformer].endswith("/Yg") else "delta"
            return windings(f"{part.transformer}.lv", kind, KV_LV)
        node = node_of[key]
        if isinstance(part, Der):
            return branches(node, "wye", "abc", None, volts[node])
        return branches(node, part.connection, part.phases, part.branch_kv, volts[node])

    for load in feeder.loads:
        scale = (load_scale or {}).get(load.name, 1.0)
        exponent = (exponents or {}).get(load.name, load.exponent)
        add_load(circuit, load, where(load, f"L {load.name}"), scale, exponent)
    for der in feeder.ders:
        kept = None if before is None else before.kept[der.name]
        share = happening.ders.get(der.name, 1.0)
        hv = node_of[f"G {der.name}" if der.transformer is None else f"T {der.transformer}"]
        add_der(circuit, der, where(der, f"G {der.name}"), volts[hv], kept, share)
    for bank in feeder.capacitors:
        node = node_of[f"C {bank.name}"]
        at = branches(node, bank.connection, bank.phases, bank.branch_kv, volts[node])
        add_capacitor(circuit, bank, at)
    _add_step(circuit, happening, volts)
    _add_shunts(circuit, happening, far, volts)
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


def _add_step(circuit: Circuit, event: Event, volts: Mapping[str, float]) -> None:
    """The event's single- to three-phase grounded load at its tee."""
    if event.step_line is None:
        return
    count, v_phase = len(event.step_phases), volts[STEP_NODE]
    circuit.groups["step"] = Group(
        plus=[(STEP_NODE, k) for k in event.step_phases],
        minus=[None] * count,
        v_nominal=v_phase,
        y_s=event.step_kw * 1000.0 / count / v_phase**2 * np.eye(count, dtype=np.complex128),
        law=Law(exponent=event.step_exponent),
    )


def _add_shunts(
    circuit: Circuit, event: Event, far: str | None, volts: Mapping[str, float]
) -> None:
    nodes = {"p": f"{event.open_line}.p", "q": f"{event.open_line}.q", "far": far}
    for n, shunt in enumerate(event.shunts):
        node = nodes[shunt.where]
        assert node is not None
        circuit.groups[f"shunt {n}"] = Group(
            plus=[(node, shunt.phase)],
            minus=[None if shunt.other is None else (node, shunt.other)],
            v_nominal=volts[node],
            y_s=np.array([[shunt.siemens]], dtype=np.complex128),
            law=Law(exponent=shunt.exponent),
        )


@dataclass(slots=True)
class _Handles:
    """Where the asked quantities are among nodes and unknowns."""

    buses: list[str]
    stubs: list[str]
    emf: Complex
    i_source: list[int]
    ends: dict[str, tuple[LineEnd, LineEnd]]
    switches: dict[str, tuple[Switch, list[int]]]
    through: dict[str, Through]
    volts: dict[str, float]
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
    """Add buses, source, lines, switches, regulators and in-line transformers."""
    joined = {line.name: _ends(line, feeder, opened) for line in feeder.lines}
    volts = nominal_volts(feeder)
    for line in feeder.lines:
        own = volts[line.from_bus]
        names = [*joined[line.name], f"{line.name}.p", f"{line.name}.q", *hung[line.name]]
        volts |= dict.fromkeys(names, own)
    buses = _buses(feeder)
    buses += [end for ends in joined.values() for end in ends if "@" in end]
    for bus in buses:
        circuit.node(bus, volts[bus])
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
            circuit, feeder, line, hung[line.name], cut, joined[line.name], volts[line.from_bus]
        )
    switches = {}
    for s in feeder.switches:
        there = rows(s.phases)
        broken = () if s.name in closed else there
        gap = circuit.gap(s.from_bus, s.to_bus, broken, volts[s.from_bus], there)
        switches[s.name] = (s, gap)
    through = {}
    for regulator in feeder.regulators:
        factor = event.taps.get(regulator.name, (1.0, 1.0, 1.0))
        through[regulator.name] = add_regulator(
            circuit, regulator, factor, volts[regulator.from_bus]
        )
    for unit in feeder.inline_transformers:
        through[unit.name] = add_inline(circuit, unit, volts[unit.from_bus], volts[unit.to_bus])
    stubs = [f"{event.open_line}.{side}" for side in "pq"] if event.open_line else []
    return _Handles(buses, stubs, emf, i_source, ends, switches, through, volts)


def _solution(circuit: Circuit, handles: _Handles, found: Found, feeder: Feeder) -> DenseSolution:
    """From unknowns to names."""
    x = found.x
    loose = np.abs(found.null).max(axis=1, initial=0.0) > FLOATING_TOLERANCE

    def at(name: str) -> Complex:
        column, _ = circuit.nodes[name]
        return np.asarray(x[column : column + 3], dtype=np.complex128)

    def into(end: LineEnd) -> Complex:
        return _spread(end.sign * x[end.columns], end.phases) + end.y @ at(end.node)

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
    i_switch = {
        name: _spread(x[own], rows(switch.phases))
        for name, (switch, own) in handles.switches.items()
    }
    i_out = {name: summed(own.out, x) for name, own in handles.through.items()}
    i_switch |= {regulator.name: i_out[regulator.name] for regulator in feeder.regulators}
    named = [*handles.buses, *handles.stubs]
    places = {name: slice(circuit.nodes[name][0], circuit.nodes[name][0] + 3) for name in named}
    return DenseSolution(
        v={bus: at(bus) for bus in handles.buses},
        stubs={stub: at(stub) for stub in handles.stubs},
        lv={name: at(node) for name, node in handles.lv.items()},
        i_from={name: into(first) for name, (first, _) in handles.ends.items()},
        i_to={name: into(last) for name, (_, last) in handles.ends.items()},
        i_switch=i_switch,
        i_into={name: summed(own.into, x) for name, own in handles.through.items()},
        i_out=i_out,
        i_source=x[handles.i_source],
        floating={(name, k) for name in named for k in range(3) if loose[places[name]][k]},
        loose={name: found.null[places[name]] for name in named},
        absent={(name, k) for name, k in circuit.absent() if name in places},
        load_pu=found.pu,
        load_va={name: complex(v @ found.drawn_a[name].conj()) for name, v in found.across.items()},
        source_va=complex(handles.emf @ x[handles.i_source].conj()),
        loss_va=complex(sum(x[c].conj() @ z @ x[c] for z, c in circuit.losses)) + in_neutral,
        charging_va=complex(sum(at(n) @ (y @ at(n)).conj() for n, y in circuit.charging)),
        kept={der.name: kept(der.name) for der in feeder.ders},
        iterations=found.iterations,
    )


def _spread(values: Complex, phases: list[int]) -> Complex:
    """(3,) of what there is of some phases, 0 in the others."""
    whole = np.zeros(3, np.complex128)
    whole[phases] = values
    return whole


def _buses(feeder: Feeder) -> list[str]:
    """Every bus that is named anywhere, once, in order of appearance."""
    named = [feeder.source.bus]
    for edge in (
        *feeder.lines,
        *feeder.switches,
        *feeder.regulators,
        *feeder.inline_transformers,
    ):
        named += [edge.from_bus, edge.to_bus]
    for item in (*feeder.transformers, *feeder.loads, *feeder.ders, *feeder.capacitors):
        if item.place is not None and item.place.bus is not None:
            named.append(item.place.bus)
    return list(dict.fromkeys(named))
