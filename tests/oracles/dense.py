"""Brute-force reference: a feeder as a dense three-phase circuit in phase quantities.

Modified nodal analysis. Unknowns are the phase-to-earth voltages of every physical node
(buses, tees, both stubs of a break, LV terminals) *and* the currents of every line piece,
switch, source and winding, so that zero impedances, closed switches and open conductors
are exact: an element is ``V_a - V_b - Z I = 0``, or ``I = 0`` where it is open.
No sequence network, no reduction, no referral of LV quantities: transformers are three
single-phase two-winding units with their true turns ratios and LV nodes of their own.

What is not determined (an isolated conductor without a path to earth, the common mode of
a D winding's LV side) lies in the null space of the matrix; there the solution of least
norm is taken and the nodes are reported in ``floating``.

Written without sight of the project's solver; it shares only the feeder's dataclasses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from openphase.model.parts import (
    Connection,
    Feeder,
    Line,
    Load,
    LoadConnection,
    Place,
    Source,
    Transformer,
)

__all__ = ["DenseSolution", "Event", "NotConvergedError", "solve_dense"]

Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]
Terminal = tuple[str, int] | None
"""A node and its phase, or None: earth."""

STEP_NODE = "tee step"
KV_LV = 0.48
"""Line-to-line LV voltage of every transformer, kV; HV quantities do not depend on it."""
FLOOR_PU = 0.7
"""Per-phase voltage below which a load is a constant impedance."""
TOLERANCE = 1e-13
MAX_ITERATIONS = 500
NULL_TOLERANCE = 1e-11
"""Singular values below this share of the largest count as zero."""
FLOATING_TOLERANCE = 1e-7
"""Component of a (unit) null vector from which a node counts as floating."""

A = np.exp(2j * np.pi / 3)
FORTESCUE: Complex = np.array([[1, 1, 1], [1, A**2, A], [1, A, A**2]], dtype=np.complex128)
"""Phase from sequence quantities, in the order 0, 1, 2."""


class NotConvergedError(RuntimeError):
    """The fixed point of the voltage-dependent loads was not found."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """What happens at t = 0; the defaults are no change.

    A tee or a step load at exactly the fraction of a break hangs on the from-bus side.

    Parameters
    ----------
    open_line, open_fraction, open_phases
        Conductors (0..2) broken at that fraction of the line, counted from its from-bus.
    step_line, step_fraction, step_kw, step_phases, step_exponent
        Grounded-wye load of unity power factor; ``step_kw`` is the total at nominal
        voltage and is shared equally among the phases.
    emf_scale
        Factor on the source's EMF.
    """

    open_line: str | None = None
    open_fraction: float = 0.5
    open_phases: tuple[int, ...] = ()
    step_line: str | None = None
    step_fraction: float = 0.5
    step_kw: float = 0.0
    step_phases: tuple[int, ...] = (0, 1, 2)
    step_exponent: float = 2.0
    emf_scale: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DenseSolution:
    """Phasors of one state; every array has shape (3,), volts to earth or amperes.

    Parameters
    ----------
    v
        Voltage of each bus.
    stubs
        Voltage of ``"<line>.p"`` and ``"<line>.q"``: from-bus and to-bus side of the break.
    lv
        LV terminal voltages of each transformer (common mode arbitrary behind a D winding).
    i_from, i_to
        Current INTO each line at its from and to end.
    i_switch
        Current through each switch, from its from-bus to its to-bus.
    floating
        (key of ``v`` or ``stubs``, phase) of voltages that the circuit does not determine.
    load_pu
        Voltage magnitude across each branch of each load, in pu of its nominal voltage.
    load_va, source_va, loss_va
        Power taken by each load (``"step"``: the step load), given by the EMF, and lost in
        source impedance, lines and transformers.
    iterations
        Linear solutions that were needed.
    """

    v: dict[str, Complex]
    stubs: dict[str, Complex]
    lv: dict[str, Complex]
    i_from: dict[str, Complex]
    i_to: dict[str, Complex]
    i_switch: dict[str, Complex]
    floating: set[tuple[str, int]]
    load_pu: dict[str, Floats]
    load_va: dict[str, complex]
    source_va: complex
    loss_va: complex
    iterations: int


@dataclass(slots=True)
class _LoadBranches:
    """The single-phase branches of one load."""

    plus: list[Terminal]
    minus: list[Terminal]
    va: complex
    """Power of one branch at nominal voltage."""
    v_nominal: float
    exponent: float


@dataclass(slots=True)
class _Circuit:
    """Equations and unknowns in SI; scales bring them to per unit before solving."""

    s_base: float
    column_scale: list[float] = field(default_factory=list)
    row_scale: list[float] = field(default_factory=list)
    entries: list[tuple[int, int, complex]] = field(default_factory=list)
    rhs: dict[int, complex] = field(default_factory=dict)
    nodes: dict[str, tuple[int, int]] = field(default_factory=dict)
    """First of the three voltage columns and of the three current-balance rows."""
    loads: dict[str, _LoadBranches] = field(default_factory=dict)
    losses: list[tuple[Complex, list[int]]] = field(default_factory=list)

    def columns(self, count: int, scale: float) -> list[int]:
        start = len(self.column_scale)
        self.column_scale += [scale] * count
        return list(range(start, start + count))

    def row(self, scale: float, terms: Sequence[tuple[int, complex]], rhs: complex = 0) -> int:
        index = len(self.row_scale)
        self.row_scale.append(scale)
        self.entries += [(index, column, value) for column, value in terms]
        self.rhs[index] = rhs
        return index

    def node(self, name: str, v_base: float) -> str:
        if name in self.nodes:
            raise ValueError(f"two nodes are called {name!r}")
        column = self.columns(3, v_base)[0]
        first, _, _ = (self.row(self.s_base / v_base, []) for _ in range(3))
        self.nodes[name] = (column, first)
        return name

    def voltage(self, terminal: Terminal, sign: complex) -> list[tuple[int, complex]]:
        """Term ``sign * V`` of an equation; nothing for earth."""
        if terminal is None:
            return []
        return [(self.nodes[terminal[0]][0] + terminal[1], sign)]

    def leaves(self, terminal: Terminal, column: int, sign: complex) -> None:
        """Add ``sign`` times a current unknown to the balance of currents leaving a node."""
        if terminal is not None:
            self.entries.append((self.nodes[terminal[0]][1] + terminal[1], column, sign))

    def series(self, a: str, b: str, z: Complex, v_base: float) -> list[int]:
        """Coupled conductors from node a to node b; the currents flow from a to b."""
        current = self.columns(3, self.s_base / v_base)
        for k in range(3):
            self.leaves((a, k), current[k], 1)
            self.leaves((b, k), current[k], -1)
            drop = [(current[j], complex(-z[k, j])) for j in range(3)]
            self.row(v_base, self.voltage((a, k), 1) + self.voltage((b, k), -1) + drop)
        self.losses.append((z, current))
        return current

    def gap(self, a: str, b: str, open_phases: Sequence[int], v_base: float) -> list[int]:
        """Ideal conductors from a to b, those of ``open_phases`` interrupted."""
        current = self.columns(3, self.s_base / v_base)
        for k in range(3):
            self.leaves((a, k), current[k], 1)
            self.leaves((b, k), current[k], -1)
            if k in open_phases:
                self.row(self.s_base / v_base, [(current[k], 1)])
            else:
                self.row(v_base, self.voltage((a, k), 1) + self.voltage((b, k), -1))
        return current


def line_matrix(z1: complex, z0: complex) -> Complex:
    """Phase impedance of a transposed line: self (Z0+2 Z1)/3, mutual (Z0-Z1)/3."""
    mutual = (z0 - z1) / 3
    return np.full((3, 3), mutual, dtype=np.complex128) + z1 * np.eye(3)


def source_matrix(source: Source) -> Complex:
    """Phase impedance of the source, circulant but not symmetric where Z1 and Z2 differ."""
    z012 = np.diag([source.z0_ohm, source.z1_ohm, source.z2_ohm]).astype(np.complex128)
    return FORTESCUE @ z012 @ FORTESCUE.conj().T / 3


def power_va(kw: float, power_factor: float) -> complex:
    """P + jQ of a load; a negative power factor is leading, Q < 0."""
    p = kw * 1000.0
    q = abs(p) * float(np.sqrt(1.0 / power_factor**2 - 1.0))
    return complex(p, -q if power_factor < 0 else q)


def _wye(node: str) -> tuple[list[Terminal], list[Terminal]]:
    return [(node, k) for k in range(3)], [None, None, None]


def _delta(node: str, step: int = 1) -> tuple[list[Terminal], list[Terminal]]:
    return [(node, k) for k in range(3)], [(node, (k + step) % 3) for k in range(3)]


def _add_source(circuit: _Circuit, source: Source, emf_scale: float) -> tuple[list[int], Complex]:
    v = source.v_phase_v
    z = source_matrix(source)
    emf = (source.emf_pu * v * emf_scale * FORTESCUE[:, 1]).astype(np.complex128)
    current = circuit.columns(3, circuit.s_base / v)
    for k in range(3):
        circuit.leaves((source.bus, k), current[k], -1)
        terms = [(current[j], complex(z[k, j])) for j in range(3)]
        circuit.row(v, circuit.voltage((source.bus, k), 1) + terms, complex(emf[k]))
    circuit.losses.append((z, current))
    return current, emf


def _add_line(
    circuit: _Circuit, line: Line, v: float, hung: Mapping[str, float], event: Event
) -> tuple[list[int], list[int]]:
    """Chain of pieces through the tees and the break; returns first and last currents."""
    z = line_matrix(line.z1_ohm_per_km, line.z0_ohm_per_km) * line.length_km
    stops = [(at, 0, node) for node, at in hung.items()]
    if event.open_line == line.name:
        stops.append((event.open_fraction, 1, ""))
    pieces: list[list[int]] = []
    here, done = line.from_bus, 0.0
    for at, is_break, node in sorted(stops):
        if not 0.0 <= at <= 1.0:
            raise ValueError(f"line {line.name!r}: fraction must be 0..1, got {at}")
        stop = circuit.node(f"{line.name}.p" if is_break else node, v)
        pieces.append(circuit.series(here, stop, z * (at - done), v))
        here, done = stop, at
        if is_break:
            here = circuit.node(f"{line.name}.q", v)
            circuit.gap(stop, here, event.open_phases, v)
    pieces.append(circuit.series(here, line.to_bus, z * (1.0 - done), v))
    return pieces[0], pieces[-1]


def _add_transformer(
    circuit: _Circuit, unit: Transformer, connection: Connection, hv: str, kv_ll: float, step: int
) -> str:
    """Three two-winding units: half leakage, (zero-sequence shunt), ratio, half leakage."""
    v_hv, v_lv = (kv * 1000.0 / np.sqrt(3.0) for kv in (kv_ll, KV_LV))
    lv = circuit.node(f"{unit.name}.lv", v_lv)
    hv_kind, lv_kind = connection.split("/")
    hv_plus, hv_minus = _wye(hv) if hv_kind == "Yg" else _delta(hv, step)
    lv_plus, lv_minus = _wye(lv) if lv_kind == "Yg" else _delta(lv, step)
    rated_hv = v_hv * (np.sqrt(3.0) if hv_kind == "D" else 1.0)
    rated_lv = v_lv * (np.sqrt(3.0) if lv_kind == "D" else 1.0)
    turns = float(rated_hv / rated_lv)
    va = unit.rating_kva * 1000.0 / 3.0
    z_hv = unit.leakage_pu / 2 * rated_hv**2 / va
    z_lv = unit.leakage_pu / 2 * rated_lv**2 / va

    i_hv = circuit.columns(3, circuit.s_base / v_hv)
    i_lv = circuit.columns(3, circuit.s_base / v_lv)
    inner = circuit.columns(3, v_hv)
    magnetizing: list[tuple[int, complex]] = []
    if connection == "Yg/Yg" and unit.x0_pu is not None:
        x0 = 1j * unit.x0_pu * (kv_ll * 1000.0) ** 2 / (unit.rating_kva * 1000.0)
        (i_m,) = circuit.columns(1, circuit.s_base / v_hv)
        magnetizing = [(i_m, -1)]
        circuit.row(v_hv, [(e, 1 / 3) for e in inner] + [(i_m, -x0)])
        circuit.losses.append((np.array([[3 * x0]]), [i_m]))
    for k in range(3):
        circuit.leaves(hv_plus[k], i_hv[k], 1)
        circuit.leaves(hv_minus[k], i_hv[k], -1)
        circuit.leaves(lv_plus[k], i_lv[k], -1)
        circuit.leaves(lv_minus[k], i_lv[k], 1)
        across = circuit.voltage(hv_plus[k], 1) + circuit.voltage(hv_minus[k], -1)
        circuit.row(v_hv, [*across, (i_hv[k], -z_hv), (inner[k], -1)])
        across = circuit.voltage(lv_plus[k], -1) + circuit.voltage(lv_minus[k], 1)
        circuit.row(v_lv, [*across, (i_lv[k], -z_lv), (inner[k], 1 / turns)])
        circuit.row(circuit.s_base / v_hv, [(i_hv[k], 1), (i_lv[k], -1 / turns), *magnetizing])
    circuit.losses.append((z_hv * np.eye(3, dtype=np.complex128), i_hv))
    circuit.losses.append((z_lv * np.eye(3, dtype=np.complex128), i_lv))
    return lv


def _load_branches(
    node: str, kind: LoadConnection, kv_ll: float, va: complex, exponent: float
) -> _LoadBranches:
    plus, minus = _wye(node) if kind == "wye" else _delta(node)
    v = kv_ll * 1000.0 / (float(np.sqrt(3.0)) if kind == "wye" else 1.0)
    return _LoadBranches(plus, minus, va / 3, v, exponent)


def _tee_nodes(feeder: Feeder) -> tuple[dict[str, str], dict[str, dict[str, float]]]:
    """Node of every transformer and direct load, and the tee nodes of every line."""
    node_of: dict[str, str] = {}
    hung: dict[str, dict[str, float]] = {line.name: {} for line in feeder.lines}
    items: list[tuple[str, Place]] = [(f"T {t.name}", t.place) for t in feeder.transformers]
    items += [(f"L {x.name}", x.place) for x in feeder.loads if x.place is not None]
    for key, place in items:
        if place.bus is not None:
            node_of[key] = place.bus
        else:
            assert place.line is not None
            assert place.at is not None
            node_of[key] = f"tee {key}"
            hung[place.line][f"tee {key}"] = place.at
    return node_of, hung


def _add_loads(
    circuit: _Circuit,
    feeder: Feeder,
    node_of: Mapping[str, str],
    kinds: Mapping[str, Connection],
    va: Mapping[str, complex],
    exponents: Mapping[str, float],
) -> None:
    for load in feeder.loads:
        exponent = exponents.get(load.name, load.exponent)
        if load.transformer is None:
            node, kind, kv = node_of[f"L {load.name}"], load.connection, feeder.source.kv_ll
        else:
            wye_lv = kinds[load.transformer].endswith("Yg")
            node, kind, kv = f"{load.transformer}.lv", "wye" if wye_lv else "delta", KV_LV
        circuit.loads[load.name] = _load_branches(node, kind, kv, va[load.name], exponent)


def _add_step(circuit: _Circuit, event: Event, v_phase: float) -> None:
    """The event's single- to three-phase grounded load at its tee."""
    if event.step_line is None:
        return
    circuit.loads["step"] = _LoadBranches(
        plus=[(STEP_NODE, k) for k in event.step_phases],
        minus=[None for _ in event.step_phases],
        va=complex(event.step_kw * 1000.0 / len(event.step_phases)),
        v_nominal=v_phase,
        exponent=event.step_exponent,
    )


def _check_event(feeder: Feeder, event: Event) -> None:
    names = {line.name for line in feeder.lines}
    for name in (event.open_line, event.step_line):
        if name is not None and name not in names:
            raise ValueError(f"event: no line {name!r}")
    if not {*event.open_phases, *event.step_phases} <= {0, 1, 2}:
        raise ValueError("event: phases must be among 0, 1, 2")


def _known(kind: str, given: Mapping[str, object], names: set[str]) -> None:
    if unknown := set(given) - names:
        raise ValueError(f"no {kind} {sorted(unknown)}")


@dataclass(slots=True)
class _Matrices:
    """The circuit in per unit: ``(fixed + into @ diag(y) @ across) x = rhs``."""

    fixed: Complex
    rhs: Complex
    into: Complex
    across: Complex


def _matrices(circuit: _Circuit) -> _Matrices:
    size = len(circuit.column_scale)
    if len(circuit.row_scale) != size:
        raise AssertionError("the circuit has not as many equations as unknowns")
    columns = np.array(circuit.column_scale)
    rows = np.array(circuit.row_scale)
    fixed = np.zeros((size, size), dtype=np.complex128)
    for r, c, value in circuit.entries:
        fixed[r, c] += value
    rhs = np.zeros(size, dtype=np.complex128)
    for r, value in circuit.rhs.items():
        rhs[r] = value
    pairs = [
        pair for load in circuit.loads.values() for pair in zip(load.plus, load.minus, strict=True)
    ]
    into = np.zeros((size, len(pairs)), dtype=np.complex128)
    across = np.zeros((len(pairs), size), dtype=np.complex128)
    for b, (plus, minus) in enumerate(pairs):
        for terminal, sign in ((plus, 1.0), (minus, -1.0)):
            if terminal is not None:
                column, row = circuit.nodes[terminal[0]]
                across[b, column + terminal[1]] += sign
                into[row + terminal[1], b] += sign
    return _Matrices(
        fixed * columns / rows[:, None], rhs / rows, into / rows[:, None], across * columns
    )


def _null_spaces(matrix: Complex) -> tuple[Complex, Complex]:
    """Orthonormal left and right null spaces; the gap in the spectrum must be clear."""
    u, s, vh = np.linalg.svd(matrix)
    rank = int(np.sum(s > NULL_TOLERANCE * s[0]))
    if rank < len(s) and s[rank] > 1e-3 * s[rank - 1]:
        raise AssertionError(f"rank is not clear: {s[rank - 1 :] / s[0]}")
    return u[:, rank:], vh[rank:].conj().T


def _solve_bordered(matrix: Complex, left: Complex, right: Complex, rhs: Complex) -> Complex:
    """Least-norm solution of a consistent system with known null spaces."""
    size, free = right.shape
    if not free:
        return np.asarray(np.linalg.solve(matrix, rhs), dtype=np.complex128)
    bordered = np.block([[matrix, left], [right.conj().T, np.zeros((free, free))]])
    x = np.linalg.solve(bordered, np.concatenate([rhs, np.zeros(free)]))
    if np.abs(x[size:]).max() > 1e-9:
        raise AssertionError("the circuit's equations contradict one another")
    return np.asarray(x[:size], dtype=np.complex128)


def _fixed_point(
    circuit: _Circuit, parts: _Matrices, start: Floats
) -> tuple[Complex, Complex, Complex, int]:
    """Iterate load admittances; returns unknowns, admittances, null space and the count."""
    width = [len(load.plus) for load in circuit.loads.values()]
    loads = list(circuit.loads.values())
    v_nominal = np.repeat([load.v_nominal for load in loads], width)
    y_nominal = np.repeat([np.conj(load.va) / load.v_nominal**2 for load in loads], width)
    slope = np.repeat([load.exponent - 2.0 for load in loads], width)

    def admittance(pu: Floats) -> Complex:
        return np.asarray(y_nominal * np.maximum(pu, FLOOR_PU) ** slope, dtype=np.complex128)

    left, right = _null_spaces(parts.fixed + (parts.into * admittance(start)) @ parts.across)
    pu = start
    for count in range(1, MAX_ITERATIONS + 1):
        y = admittance(pu)
        matrix = parts.fixed + (parts.into * y) @ parts.across
        x = _solve_bordered(matrix, left, right, parts.rhs)
        found = np.abs(parts.across @ x) / v_nominal if len(pu) else pu
        change = found - pu
        relevant = change[(slope != 0.0) & (np.maximum(found, pu) > FLOOR_PU)]
        if not len(relevant) or np.abs(relevant).max() <= TOLERANCE:
            return x, y, right, count
        pu = pu + (1.0 if count <= 100 else 0.5 if count <= 250 else 0.2) * change
    raise NotConvergedError(f"no fixed point after {MAX_ITERATIONS} iterations: {change}")


def _start_pu(circuit: _Circuit, start: DenseSolution | None) -> Floats:
    given = start.load_pu if start is not None else {}
    values = [given.get(name, np.ones(len(x.plus))) for name, x in circuit.loads.items()]
    return np.concatenate([*values, np.empty(0)])


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
    delta_step: int = 1,
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
    delta_step
        1 or 2: winding k of a D lies between phases k and k + delta_step (the vector group).

    Raises
    ------
    NotConvergedError
        The voltage-dependent loads have no fixed point in reach.
    """
    happening = event or Event()
    _check_event(feeder, happening)
    _known("switch", dict.fromkeys(closed), {s.name for s in feeder.switches})
    _known("load", {**(load_scale or {}), **(exponents or {})}, {x.name for x in feeder.loads})
    _known("transformer", connections or {}, {t.name for t in feeder.transformers})
    va = {
        x.name: power_va(x.kw, x.power_factor) * (load_scale or {}).get(x.name, 1.0)
        for x in feeder.loads
    }
    kinds = {t.name: (connections or {}).get(t.name, t.connection) for t in feeder.transformers}

    node_of, hung = _tee_nodes(feeder)
    if happening.step_line is not None:
        hung[happening.step_line][STEP_NODE] = happening.step_fraction
    circuit = _Circuit(s_base=1e6 / 3)
    handles = _add_network(circuit, feeder, closed, happening, emf_scale, hung)
    handles.lv = {
        t.name: _add_transformer(
            circuit, t, kinds[t.name], node_of[f"T {t.name}"], feeder.source.kv_ll, delta_step
        )
        for t in feeder.transformers
    }
    _add_loads(circuit, feeder, node_of, kinds, va, exponents or {})
    _add_step(circuit, happening, feeder.source.v_phase_v)

    parts = _matrices(circuit)
    found = _fixed_point(circuit, parts, _start_pu(circuit, start))
    return _solution(circuit, handles, parts, found)


@dataclass(slots=True)
class _Handles:
    """Where the asked quantities are among nodes and unknowns."""

    buses: list[str]
    stubs: list[str]
    emf: Complex
    i_source: list[int]
    ends: dict[str, tuple[list[int], list[int]]]
    switches: dict[str, list[int]]
    lv: dict[str, str] = field(default_factory=dict)


def _add_network(
    circuit: _Circuit,
    feeder: Feeder,
    closed: frozenset[str],
    event: Event,
    emf_scale: float,
    hung: Mapping[str, Mapping[str, float]],
) -> _Handles:
    """Add buses, source, lines and switches."""
    v = feeder.source.v_phase_v
    buses = _buses(feeder)
    for bus in buses:
        circuit.node(bus, v)
    i_source, emf = _add_source(circuit, feeder.source, emf_scale * event.emf_scale)
    ends = {x.name: _add_line(circuit, x, v, hung[x.name], event) for x in feeder.lines}
    switches = {
        s.name: circuit.gap(s.from_bus, s.to_bus, () if s.name in closed else (0, 1, 2), v)
        for s in feeder.switches
    }
    stubs = [f"{event.open_line}.{side}" for side in "pq"] if event.open_line else []
    return _Handles(buses, stubs, emf, i_source, ends, switches)


def _solution(
    circuit: _Circuit,
    handles: _Handles,
    parts: _Matrices,
    found: tuple[Complex, Complex, Complex, int],
) -> DenseSolution:
    """Back to SI and to names."""
    x, y, right, count = found
    phasor: Complex = x * np.array(circuit.column_scale)
    branch_v: Complex = parts.across @ x
    loose = np.abs(right).max(axis=1, initial=0.0) > FLOATING_TOLERANCE

    def at(name: str) -> Complex:
        column, _ = circuit.nodes[name]
        return np.asarray(phasor[column : column + 3], dtype=np.complex128)

    bounds = np.cumsum([0, *(len(load.plus) for load in circuit.loads.values())])
    spans = {name: slice(bounds[k], bounds[k + 1]) for k, name in enumerate(circuit.loads)}
    return DenseSolution(
        v={bus: at(bus) for bus in handles.buses},
        stubs={stub: at(stub) for stub in handles.stubs},
        lv={name: at(node) for name, node in handles.lv.items()},
        i_from={name: phasor[first] for name, (first, _) in handles.ends.items()},
        i_to={name: -phasor[last] for name, (_, last) in handles.ends.items()},
        i_switch={name: phasor[columns] for name, columns in handles.switches.items()},
        floating={
            (name, k)
            for name in [*handles.buses, *handles.stubs]
            for k in range(3)
            if loose[circuit.nodes[name][0] + k]
        },
        load_pu={
            name: np.abs(branch_v[span]) / circuit.loads[name].v_nominal
            for name, span in spans.items()
        },
        load_va={
            name: complex(np.sum(np.abs(branch_v[span]) ** 2 * y[span].conj()))
            for name, span in spans.items()
        },
        source_va=complex(handles.emf @ phasor[handles.i_source].conj()),
        loss_va=complex(sum(phasor[c].conj() @ z @ phasor[c] for z, c in circuit.losses)),
        iterations=count,
    )


def _buses(feeder: Feeder) -> list[str]:
    """Every bus that is named anywhere, once, in order of appearance."""
    named = [feeder.source.bus]
    for line in feeder.lines:
        named += [line.from_bus, line.to_bus]
    for switch in feeder.switches:
        named += [switch.from_bus, switch.to_bus]
    items: list[Transformer | Load] = [*feeder.transformers, *feeder.loads]
    named += [x.place.bus for x in items if x.place is not None and x.place.bus is not None]
    return list(dict.fromkeys(named))
