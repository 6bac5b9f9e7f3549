"""The feeder's parts as equations of a dense circuit, each with its true turns and nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from oracles.dense_circuit import FORTESCUE, Circuit, Complex, Group, Terminal, machine_matrix

from openphase.model.parts import (
    Capacitor,
    Connection,
    Der,
    Feeder,
    Line,
    Load,
    Place,
    Regulator,
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
    "add_regulator",
    "add_source",
    "add_transformer",
    "hung_on_lines",
    "power_va",
    "windings",
]

KV_LV = 0.48
"""Line-to-line LV voltage of every transformer, kV; HV quantities do not depend on it."""


def line_matrix(z1: complex, z0: complex) -> Complex:
    """Phase impedance of a transposed line: self (Z0+2 Z1)/3, mutual (Z0-Z1)/3."""
    mutual = (z0 - z1) / 3
    return np.full((3, 3), mutual, dtype=np.complex128) + z1 * np.eye(3)


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
    emf = (source.emf_pu * v * emf_scale * FORTESCUE[:, 1]).astype(np.complex128)
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
    sign: float
    node: str
    y: Complex


def add_line(
    circuit: Circuit,
    line: Line,
    source: Source,
    hung: Mapping[str, float],
    cut: Cut | None,
    ends: tuple[str, str],
) -> tuple[LineEnd, LineEnd]:
    """Chain of nominal pis through the tees and the cut; returns both ends' currents."""
    v = source.v_phase_v
    z = line_matrix(line.z1_ohm_per_km, line.z0_ohm_per_km) * line.length_km
    siemens_per_nf = 2j * np.pi * source.frequency_hz * 1e-9 * line.length_km
    y = line_matrix(line.c1_nf_per_km, line.c0_nf_per_km) * siemens_per_nf
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
        pieces.append((circuit.series(here, there, z * (at - done), v), half))
        for end in (here, there):
            circuit.shunt(end, half)
        here, done = there, at
        if is_cut:
            assert cut is not None
            here = circuit.node(f"{line.name}.q", v)
            circuit.gap(there, here, cut.open_phases, v)
    (first, y_first), (last, y_last) = pieces[0], pieces[-1]
    return LineEnd(first, 1.0, ends[0], y_first), LineEnd(last, -1.0, ends[1], y_last)


def add_regulator(
    circuit: Circuit, regulator: Regulator, factor: Sequence[float], v: float
) -> list[int]:
    """Three ideal autotransformers; returns the columns of the currents out of the to-side."""
    current = circuit.columns(3, circuit.s_base / v)
    for k in range(3):
        ratio = (1 + regulator.taps[k] * regulator.step_pct / 100) * factor[k]
        near, far = (regulator.from_bus, k), (regulator.to_bus, k)
        circuit.leaves(near, current[k], ratio)
        circuit.leaves(far, current[k], -1)
        circuit.row(v, circuit.voltage(far, 1) + circuit.voltage(near, -ratio))
    return current


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
    """Three branches to which something is connected, and their nominal voltage."""

    plus: list[Terminal]
    minus: list[Terminal]
    v_nominal: float


def windings(node: str, kind: str, kv_ll: float) -> Windings:
    """Wye or delta branches at a node whose line-to-line voltage is ``kv_ll``."""
    plus, minus = _wye(node) if kind == "wye" else _delta(node)
    return Windings(plus, minus, kv_ll * 1000.0 / (float(np.sqrt(3.0)) if kind == "wye" else 1.0))


def add_load(circuit: Circuit, load: Load, at: Windings, va: complex, exponent: float) -> None:
    """Static part as group NAME, motors as group ``NAME.motor`` where there are any."""
    y = np.conj(va) / 3 / at.v_nominal**2
    circuit.groups[load.name] = Group(
        plus=at.plus,
        minus=at.minus,
        v_nominal=at.v_nominal,
        y_s=(1 - load.motor_share) * y * np.eye(3),
        exponent=exponent,
    )
    if load.motor_share:
        circuit.groups[f"{load.name}.motor"] = Group(
            plus=at.plus,
            minus=at.minus,
            v_nominal=at.v_nominal,
            y_s=machine_matrix(0, load.motor_share * y, 0),
            exponent=exponent,
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
        exponent=0.0,
        machine=True,
        fixed_s=runs * machine_matrix(y0, fixed, y2),
        fed_a=runs * fed * FORTESCUE[:, 1],
    )


def add_capacitor(circuit: Circuit, bank: Capacitor, at: Windings) -> None:
    """Group ``NAME.capacitor``, a constant admittance."""
    y = 1j * bank.kvar * 1000.0 / 3 / at.v_nominal**2
    circuit.groups[f"{bank.name}.capacitor"] = Group(
        plus=at.plus,
        minus=at.minus,
        v_nominal=at.v_nominal,
        y_s=y * np.eye(3, dtype=np.complex128),
        exponent=2.0,
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
