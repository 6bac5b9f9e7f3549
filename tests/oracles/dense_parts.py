"""The feeder's parts as equations of a dense circuit, each with its true turns and nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from oracles.dense_circuit import Circuit
from oracles.dense_groups import FORTESCUE, Complex, Group, Law, Terminal, machine_matrix

from openphase.model.parts import (
    Capacitor,
    Connection,
    Der,
    Feeder,
    Line,
    Load,
    Place,
    Source,
    Transformer,
)

__all__ = [
    "Cut",
    "Kept",
    "Windings",
    "add_capacitor",
    "add_der",
    "add_line",
    "add_load",
    "add_source",
    "add_transformer",
    "branches",
    "capacitance",
    "hung_on_lines",
    "impedance",
    "power_va",
    "rows",
    "windings",
]

KV_LV = 0.48
"""Line-to-line LV voltage of every transformer, kV; HV quantities do not depend on it."""


def rows(phases: str) -> list[int]:
    """Numbers of the phases, in their order."""
    return [ord(phase) - ord("a") for phase in phases]


def line_matrix(first: complex, zero: complex) -> Complex:
    """Phase matrix of a transposed line: self (X0+2 X1)/3, mutual (X0-X1)/3."""
    mutual = (zero - first) / 3
    return np.full((3, 3), mutual, dtype=np.complex128) + first * np.eye(3)


def impedance(feeder: Feeder, line: Line) -> Complex:
    """(n, n) ohm of the whole line; row i is that of its i-th phase."""
    if line.code is None:
        assert line.z1_ohm_per_km is not None
        assert line.z0_ohm_per_km is not None
        z = line_matrix(line.z1_ohm_per_km, line.z0_ohm_per_km)[: len(line.phases)]
        return z[:, : len(line.phases)] * line.length_km
    code = next(code for code in feeder.codes if code.name == line.code)
    return (np.array(code.r_ohm_per_km) + 1j * np.array(code.x_ohm_per_km)) * line.length_km


def capacitance(feeder: Feeder, line: Line) -> Complex:
    """(n, n) nF of the whole line, ordered alike."""
    count = len(line.phases)
    if line.code is None:
        c = line_matrix(line.c1_nf_per_km, line.c0_nf_per_km)
        return c[:count, :count] * line.length_km
    code = next(code for code in feeder.codes if code.name == line.code)
    if code.c_nf_per_km is None:
        return np.zeros((count, count), np.complex128)
    return np.array(code.c_nf_per_km, np.complex128) * line.length_km


def source_matrix(source: Source) -> Complex:
    """Phase impedance of the source, circulant but not symmetric where Z1 and Z2 differ."""
    z012 = np.diag([source.z0_ohm, source.z1_ohm, source.z2_ohm]).astype(np.complex128)
    return FORTESCUE @ z012 @ FORTESCUE.conj().T / 3


def power_va(kw: float, power_factor: float) -> complex:
    """P + jQ; a negative power factor is leading, Q < 0."""
    p = kw * 1000.0
    q = abs(p) * float(np.sqrt(1.0 / power_factor**2 - 1.0))
    return complex(p, -q if power_factor < 0 else q)


def _wye(node: str) -> tuple[list[Terminal], list[Terminal]]:
    return [(node, k) for k in range(3)], [None, None, None]


def _delta(node: str, step: int = 1) -> tuple[list[Terminal], list[Terminal]]:
    return [(node, k) for k in range(3)], [(node, (k + step) % 3) for k in range(3)]


def add_source(circuit: Circuit, source: Source, emf_scale: float) -> tuple[list[int], Complex]:
    """EMF behind the sequence impedances; returns the currents' columns and the EMF.

    A neutral that is not solid has a voltage of its own, and passes the sum of the three
    currents: none where it is isolated.
    """
    v = source.v_phase_v
    z = source_matrix(source)
    size = source.emf_pu * v * emf_scale * np.exp(1j * np.radians(source.angle_deg))
    emf = (size * FORTESCUE[:, 1]).astype(np.complex128)
    current = circuit.columns(3, circuit.s_base / v)
    neutral: list[tuple[int, complex]] = []
    if source.neutral == "isolated" or source.neutral_ohm:
        (column,) = circuit.columns(1, v)
        neutral = [(column, -1)]
        y = 0j if source.neutral == "isolated" else 1 / source.neutral_ohm
        circuit.row(circuit.s_base / v, [*((c, 1 + 0j) for c in current), (column, y)])
        circuit.neutral = (column, y)
    for k in range(3):
        circuit.leaves((source.bus, k), current[k], -1)
        terms = [(current[j], complex(z[k, j])) for j in range(3)]
        circuit.row(v, [*circuit.voltage((source.bus, k), 1), *terms, *neutral], complex(emf[k]))
    circuit.losses.append((z, current))
    return current, emf


@dataclass(frozen=True, slots=True, kw_only=True)
class Cut:
    """Where an event cuts a line into a from-side stub p and a to-side stub q.

    ``before_tees``: a tee at exactly the fraction is on the to-side.
    """

    line: str
    fraction: float
    open_phases: tuple[int, ...]
    before_tees: bool


@dataclass(frozen=True, slots=True)
class LineEnd:
    """Current into a line: a series current and the charging beside it."""

    columns: list[int]
    phases: list[int]
    sign: float
    node: str
    y: Complex


def add_line(
    circuit: Circuit,
    feeder: Feeder,
    line: Line,
    hung: Mapping[str, float],
    cut: Cut | None,
    ends: tuple[str, str],
    v: float,
) -> tuple[LineEnd, LineEnd]:
    """Chain of nominal pis through the tees and the cut; returns both ends' currents."""
    phases = rows(line.phases)
    z = impedance(feeder, line)
    y = np.zeros((3, 3), np.complex128)
    siemens_per_nf = 2j * np.pi * feeder.source.frequency_hz * 1e-9
    y[np.ix_(phases, phases)] = capacitance(feeder, line) * siemens_per_nf
    stops = [(at, 1, node) for node, at in hung.items()]
    if cut is not None:
        stops.append((cut.fraction, 0 if cut.before_tees else 2, ""))
    stops.append((1.0, 3, ends[1]))
    pieces: list[tuple[list[int], Complex]] = []
    here, done = ends[0], 0.0
    for at, _, node in sorted(stops):
        if not 0.0 <= at <= 1.0:
            raise ValueError(f"line {line.name!r}: fraction must be 0..1, got {at}")
        is_cut = node == ""
        there = f"{line.name}.p" if is_cut else node
        if there != ends[1]:
            circuit.node(there, v)
        half: Complex = np.asarray(y * (at - done) / 2)
        pieces.append((circuit.series(here, there, z * (at - done), v, phases), half))
        for end in (here, there):
            circuit.shunt(end, half)
        here, done = there, at
        if is_cut:
            assert cut is not None
            here = circuit.node(f"{line.name}.q", v)
            circuit.gap(there, here, cut.open_phases, v, phases)
    (first, y_first), (last, y_last) = pieces[0], pieces[-1]
    return (
        LineEnd(first, phases, 1.0, ends[0], y_first),
        LineEnd(last, phases, -1.0, ends[1], y_last),
    )


def add_transformer(
    circuit: Circuit, unit: Transformer, connection: Connection, hv: str, kv_ll: float, step: int
) -> str:
    """Three two-winding units: half leakage, magnetizing shunts, ratio, half leakage.

    An ungrounded HV wye has a neutral of its own. The common mode of a D winding's LV
    terminals is undetermined, and set to zero.
    """
    v_hv, v_lv = (kv * 1000.0 / np.sqrt(3.0) for kv in (kv_ll, KV_LV))
    lv = circuit.node(f"{unit.name}.lv", v_lv)
    hv_kind, lv_kind = connection.split("/")
    hv_plus, hv_minus = _delta(hv, step) if hv_kind == "D" else _wye(hv)
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
    drawn: list[list[tuple[int, complex]]] = [[], [], []]
    if connection == "Yg/Yg" and unit.x0_pu is not None:
        x0 = 1j * unit.x0_pu * (kv_ll * 1000.0) ** 2 / (unit.rating_kva * 1000.0)
        (i_m,) = circuit.columns(1, circuit.s_base / v_hv)
        for own in drawn:
            own.append((i_m, -1))
        circuit.row(v_hv, [(e, 1 / 3) for e in inner] + [(i_m, -x0)])
        circuit.losses.append((np.array([[3 * x0]]), [i_m]))
    if unit.xm_pu is not None:
        xm = 1j * unit.xm_pu * rated_hv**2 / va
        magnetizing = circuit.columns(3, circuit.s_base / v_hv)
        for k, column in enumerate(magnetizing):
            drawn[k].append((column, -1))
            circuit.row(v_hv, [(inner[k], 1), (column, -xm)])
        circuit.losses.append((xm * np.eye(3), magnetizing))
    neutral: list[tuple[int, complex]] = []
    if hv_kind == "Y":
        (column,) = circuit.columns(1, v_hv)
        neutral = [(column, -1)]
        circuit.row(circuit.s_base / v_hv, [(c, 1) for c in i_hv])
    if lv_kind == "D":
        (earth,) = circuit.columns(1, circuit.s_base / v_lv)
        circuit.row(v_lv, [term for k in range(3) for term in circuit.voltage((lv, k), 1)])
        for k in range(3):
            circuit.leaves((lv, k), earth, 1)
    for k in range(3):
        circuit.leaves(hv_plus[k], i_hv[k], 1)
        circuit.leaves(hv_minus[k], i_hv[k], -1)
        circuit.leaves(lv_plus[k], i_lv[k], -1)
        circuit.leaves(lv_minus[k], i_lv[k], 1)
        across = circuit.voltage(hv_plus[k], 1) + circuit.voltage(hv_minus[k], -1) + neutral
        circuit.row(v_hv, [*across, (i_hv[k], -z_hv), (inner[k], -1)])
        across = circuit.voltage(lv_plus[k], -1) + circuit.voltage(lv_minus[k], 1)
        circuit.row(v_lv, [*across, (i_lv[k], -z_lv), (inner[k], 1 / turns)])
        circuit.row(circuit.s_base / v_hv, [(i_hv[k], 1), (i_lv[k], -1 / turns), *drawn[k]])
    circuit.losses.append((z_hv * np.eye(3, dtype=np.complex128), i_hv))
    circuit.losses.append((z_lv * np.eye(3, dtype=np.complex128), i_lv))
    return lv


@dataclass(frozen=True, slots=True)
class Windings:
    """Branches to which something is connected, and their nominal voltage."""

    plus: list[Terminal]
    minus: list[Terminal]
    v_nominal: float


def windings(node: str, kind: str, kv_ll: float) -> Windings:
    """Three wye or delta branches at a node whose line-to-line voltage is ``kv_ll``."""
    plus, minus = _wye(node) if kind == "wye" else _delta(node)
    return Windings(plus, minus, kv_ll * 1000.0 / (float(np.sqrt(3.0)) if kind == "wye" else 1.0))


def branches(
    node: str, kind: str, phases: str, branch_kv: float | None, v_phase: float
) -> Windings:
    """Those of a load or capacitor that stands on the feeder itself."""
    at = rows(phases)
    if kind == "wye":
        plus: list[Terminal] = [(node, k) for k in at]
        minus: list[Terminal] = [None] * len(at)
        nominal = v_phase
    else:
        pairs = [(0, 1)] if len(at) == 2 else [(0, 1), (1, 2), (2, 0)]
        plus = [(node, at[i]) for i, _ in pairs]
        minus = [(node, at[j]) for _, j in pairs]
        nominal = v_phase * float(np.sqrt(3.0))
    return Windings(plus, minus, nominal if branch_kv is None else branch_kv * 1000.0)


def add_load(circuit: Circuit, load: Load, at: Windings, scale: float, exponent: float) -> None:
    """Static part as group NAME, motors as group ``NAME.motor`` where there are any.

    An ``exponent`` of its own makes a load forget what else the file says of its law.
    """
    va = power_va(load.kw, load.power_factor) if load.kvar is None else load.kw * 1e3 + 0j
    va = (va + 1000j * (load.kvar or 0.0)) * scale
    count = len(at.plus)
    y = np.conj(va) / count / at.v_nominal**2
    own = ("exponent_q", "zip", "v_min_pu", "v_max_pu", "v_low_pu", "edge_exponent")
    law = Law(exponent=exponent)
    if exponent == load.exponent:
        law = Law(exponent=exponent, **{name: getattr(load, name) for name in own})
    static = (1 - load.motor_share) * np.eye(count, dtype=np.complex128)
    circuit.groups[load.name] = Group(
        plus=at.plus,
        minus=at.minus,
        v_nominal=at.v_nominal,
        y_s=y.real * static,
        y_q_s=1j * y.imag * static,
        law=law,
    )
    if load.motor_share:
        circuit.groups[f"{load.name}.motor"] = Group(
            plus=at.plus,
            minus=at.minus,
            v_nominal=at.v_nominal,
            y_s=machine_matrix(0, load.motor_share * y, 0),
            law=Law(exponent=exponent),
            machine=True,
            fixed_s=machine_matrix(0, 0, load.motor_share * y * load.motor_y2_y1),
        )


@dataclass(frozen=True, slots=True)
class Kept:
    """What a DER remembers of the state before: winding voltage and the current it fed in."""

    v1_v: complex
    i1_a: complex


def add_der(
    circuit: Circuit, der: Der, at: Windings, v_phase: float, kept: Kept | None, factor: float
) -> None:
    """Group ``NAME.der``: its power before an event, what its model keeps after it.

    ``factor`` multiplies what it delivers after the event, its EMF or current or power being
    set accordingly at the voltage before; at 0 it is disconnected.
    """
    refer = (v_phase / at.v_nominal) ** 2
    y1, y2, y0 = (0j if z is None else refer / z for z in (der.z1_ohm, der.z2_ohm, der.z0_ohm))
    power: complex = 0j
    fed, fixed = 0j, 0j
    if kept is None or der.model == "constant_power":
        power = -factor * np.conj(power_va(der.kw, der.power_factor)) / 3 / at.v_nominal**2
    elif der.model == "constant_current":
        fed = factor * kept.i1_a
    else:
        fed, fixed = factor * kept.i1_a + y1 * kept.v1_v, y1
    runs = factor != 0.0
    circuit.groups[f"{der.name}.der"] = Group(
        plus=at.plus,
        minus=at.minus,
        v_nominal=at.v_nominal,
        y_s=machine_matrix(0, power, 0),
        law=Law(exponent=0.0),
        machine=True,
        fixed_s=runs * machine_matrix(y0, fixed, y2),
        fed_a=runs * fed * FORTESCUE[:, 1],
    )


def add_capacitor(circuit: Circuit, bank: Capacitor, at: Windings) -> None:
    """Group ``NAME.capacitor``, a constant admittance."""
    y = 1j * bank.kvar * 1000.0 / len(at.plus) / at.v_nominal**2
    circuit.groups[f"{bank.name}.capacitor"] = Group(
        plus=at.plus,
        minus=at.minus,
        v_nominal=at.v_nominal,
        y_s=y * np.eye(len(at.plus), dtype=np.complex128),
        law=Law(exponent=2.0),
    )


def hung_on_lines(feeder: Feeder) -> tuple[dict[str, str], dict[str, dict[str, float]]]:
    """Node of everything that stands on the feeder itself, and the tee nodes of every line."""
    node_of: dict[str, str] = {}
    hung: dict[str, dict[str, float]] = {line.name: {} for line in feeder.lines}
    items: list[tuple[str, Place]] = [(f"T {t.name}", t.place) for t in feeder.transformers]
    items += [(f"L {x.name}", x.place) for x in feeder.loads if x.place is not None]
    items += [(f"G {x.name}", x.place) for x in feeder.ders if x.place is not None]
    items += [(f"C {x.name}", x.place) for x in feeder.capacitors]
    for key, place in items:
        if place.bus is not None:
            node_of[key] = place.bus
        else:
            assert place.line is not None
            assert place.at is not None
            node_of[key] = f"tee {key}"
            hung[place.line][f"tee {key}"] = place.at
    return node_of, hung
