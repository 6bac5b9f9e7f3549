"""Regulators and in-line transformers as coils of a dense circuit, and what voltages they make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from oracles.dense_circuit import Circuit
from oracles.dense_groups import Complex, Terminal
from oracles.dense_parts import rows

from openphase.model.parts import Feeder, InlineTransformer, Regulator

__all__ = ["Through", "add_inline", "add_regulator", "nominal_volts", "summed"]

ROOT = float(np.sqrt(3.0))
NEXT = {0: 1, 1: 2, 2: 0}
BEFORE = {1: 0, 2: 1, 0: 2}


def nominal_volts(feeder: Feeder) -> dict[str, float]:
    """Phase to earth at every bus, from the source outwards."""
    volts = {feeder.source.bus: feeder.source.v_phase_v}
    joined = [
        (part.from_bus, part.to_bus, None, None)
        for part in (*feeder.lines, *feeder.switches, *feeder.regulators)
    ]
    steps = [*joined, *((u.from_bus, u.to_bus, *_two_sides(u)) for u in feeder.inline_transformers)]
    grown = True
    while grown:
        grown = False
        for start, end, v_start, v_end in steps:
            if start in volts and end not in volts:
                volts[end] = volts[start] if v_end is None else v_end
                grown = True
            elif end in volts and start not in volts:
                volts[start] = volts[end] if v_start is None else v_start
                grown = True
    return volts


def _two_sides(unit: InlineTransformer) -> tuple[float, float]:
    """Volts phase to earth that a transformer's rating gives to its buses."""
    near, far = unit.kv_from * 1000.0 / ROOT, unit.kv_to * 1000.0 / ROOT
    if unit.connection in ("single", "centre-tap") and len(unit.phases) == 1:
        near = unit.kv_from * 1000.0
    if unit.connection == "single" and len(unit.to_phases) == 1:
        far = unit.kv_to * 1000.0
    if unit.connection == "centre-tap":
        far = unit.kv_to * 500.0
    return near, far


@dataclass(slots=True)
class Through:
    """By phase, the current unknowns whose weighted sum is taken at one bus, given at the other."""

    into: list[list[tuple[int, float]]] = field(default_factory=lambda: [[], [], []])
    out: list[list[tuple[int, float]]] = field(default_factory=lambda: [[], [], []])


def add_regulator(
    circuit: Circuit, regulator: Regulator, factor: Sequence[float], v: float
) -> Through:
    """One autotransformer for each phase; its unknown is the current out of the to-side.

    From phase to reference ``V_to = ratio * (V_from - z * I_from)``, where both sides' currents
    return to the reference of their own side. Of a closed delta, whose references move
    themselves, the winding in series adds ``ratio - 1`` of what the from-side has between them.
    """
    through = Through()
    near, far = regulator.from_bus, regulator.to_bus

    def passes(phase: int, column: int, into: float, out: float) -> None:
        circuit.leaves((near, phase), column, into)
        circuit.leaves((far, phase), column, -out)
        through.into[phase].append((column, into))
        through.out[phase].append((column, out))

    for k in rows(regulator.phases):
        ratio = (1 + regulator.taps[k] * regulator.step_pct / 100) * factor[k]
        (current,) = circuit.columns(1, circuit.s_base / v)
        passes(k, current, ratio, 1.0)
        terms = [*circuit.voltage((far, k), 1), *circuit.voltage((near, k), -ratio)]
        if regulator.reference == "next":
            passes(NEXT[k], current, 1.0 - ratio, 0.0)
            terms += circuit.voltage((near, NEXT[k]), ratio - 1.0)
        elif regulator.reference != "earth":
            (other,) = rows(regulator.reference)
            passes(other, current, -ratio, -1.0)
            terms += [*circuit.voltage((far, other), -1), *circuit.voltage((near, other), ratio)]
        z = regulator.z_ohm * ratio**2
        circuit.row(v, [*terms, (current, z)])
        circuit.losses.append((np.array([[z]]), [current]))
    if regulator.reference in ("a", "b", "c"):
        (k,) = rows(regulator.reference)
        (current,) = circuit.columns(1, circuit.s_base / v)
        passes(k, current, 1.0, 1.0)
        terms = [*circuit.voltage((near, k), 1), *circuit.voltage((far, k), -1)]
        circuit.row(v, [*terms, (current, -regulator.jumper_ohm)])
        circuit.losses.append((np.array([[regulator.jumper_ohm]]), [current]))
    return through


@dataclass(frozen=True, slots=True)
class _Coil:
    """A winding between two terminals, with its rated volts."""

    plus: Terminal
    minus: Terminal
    v_rated: float


def add_inline(circuit: Circuit, unit: InlineTransformer, v_near: float, v_far: float) -> Through:
    """Ideal pairs of coils with leakage behind them, magnetizing branches across the to-coils."""
    maker = _centre_tap if unit.connection == "centre-tap" else _pairs_of
    return maker(circuit, unit, v_near, v_far)


def _neutral(circuit: Circuit, unit: InlineTransformer, side: str, kind: str, v: float) -> Terminal:
    """Earth, or a node of its own: behind an impedance, or with no connection."""
    ohm = unit.from_neutral_ohm if side == "from" else unit.to_neutral_ohm
    if kind == "D" or (kind == "Yg" and not ohm):
        return None
    point = circuit.point(f"{unit.name}.{side}.n", v)
    if kind == "Yg":
        circuit.branch(point, None, ohm, v)
    return point


def _coils(unit: InlineTransformer, circuit: Circuit, side: str, v: float) -> list[_Coil]:
    """The windings of one side, in the order of the pairs."""
    bus, kv, letters = (
        (unit.from_bus, unit.kv_from, unit.phases)
        if side == "from"
        else (unit.to_bus, unit.kv_to, unit.to_phases)
    )
    if unit.connection == "single":
        at = rows(letters)
        return [_Coil((bus, at[0]), (bus, at[1]) if len(at) == 2 else None, kv * 1000.0)]
    kinds = unit.connection.split("/")
    kind, other = kinds if side == "from" else kinds[::-1]
    if kind != "D":
        neutral = _neutral(circuit, unit, side, kind, v)
        return [_Coil((bus, k), neutral, kv * 1000.0 / ROOT) for k in range(3)]
    # opposite phase a of a star: of D/Y lag the coil from a to c, of Y/D lag that from a to b
    backwards = other != "D" and (unit.shift == "lag") == (side == "from")
    step = BEFORE if backwards else NEXT
    return [_Coil((bus, k), (bus, step[k]), kv * 1000.0) for k in range(3)]


def _pairs_of(circuit: Circuit, unit: InlineTransformer, v_near: float, v_far: float) -> Through:
    through = Through()
    near = _coils(unit, circuit, "from", v_near)
    far = _coils(unit, circuit, "to", v_far)
    va = unit.rating_kva * 1000.0 / len(near)
    for a, b in zip(near, far, strict=True):
        turns = b.v_rated * unit.to_tap / (a.v_rated * unit.from_tap)
        z = unit.leakage_pu * (b.v_rated * unit.to_tap) ** 2 / va
        (current,) = circuit.columns(1, circuit.s_base / v_far)
        _passes(circuit, through.into, a, current, turns)
        _passes(circuit, through.out, b, current, 1.0, leaving=-1.0)
        terms = [*circuit.voltage(b.plus, 1), *circuit.voltage(b.minus, -1)]
        terms += [*circuit.voltage(a.plus, -turns), *circuit.voltage(a.minus, turns)]
        circuit.row(v_far, [*terms, (current, z)])
        circuit.losses.append((np.array([[z]]), [current]))
        if unit.magnetizing_pu:
            y = unit.magnetizing_pu * va / (b.v_rated * unit.to_tap) ** 2
            _passes(circuit, through.out, b, circuit.branch(b.plus, b.minus, 1 / y, v_far), -1.0, 0)
    return through


def _passes(
    circuit: Circuit,
    counted: list[list[tuple[int, float]]],
    coil: _Coil,
    column: int,
    weight: float,
    leaving: float = 1.0,
) -> None:
    """Count a coil's current at its phases; ``leaving`` 0: it is in the balances already."""
    for terminal, sign in ((coil.plus, 1.0), (coil.minus, -1.0)):
        if terminal is None:
            continue
        if leaving:
            circuit.leaves(terminal, column, sign * weight * leaving)
        if terminal[0] not in circuit.points:
            counted[terminal[1]].append((column, sign * weight))


def _centre_tap(circuit: Circuit, unit: InlineTransformer, v_near: float, v_far: float) -> Through:
    """A winding and two legs, joined in a star; the second leg is turned round."""
    through = Through()
    at = rows(unit.phases)
    own: Terminal = (unit.from_bus, at[1]) if len(at) == 2 else None
    near = _Coil((unit.from_bus, at[0]), own, unit.kv_from * 1000.0)
    legs = [_Coil((unit.to_bus, k), None, unit.kv_to * 500.0) for k in rows(unit.to_phases)]
    va = unit.rating_kva * 1000.0
    turned = near.v_rated * unit.from_tap, legs[0].v_rated * unit.to_tap
    turns = turned[1] / turned[0]
    assert unit.leg_leakage_pu is not None
    z_near, z_leg = unit.leakage_pu * turned[0] ** 2 / va, unit.leg_leakage_pu * turned[1] ** 2 / va
    (emf,) = circuit.columns(1, v_near)
    drawn, first, second = (
        circuit.columns(1, circuit.s_base / v)[0] for v in (v_near, v_far, v_far)
    )
    _passes(circuit, through.into, near, drawn, 1.0)
    across = [*circuit.voltage(near.plus, 1), *circuit.voltage(near.minus, -1)]
    circuit.row(v_near, [*across, (drawn, -z_near), (emf, -1)])
    for leg, column, way in ((legs[0], first, turns), (legs[1], second, -turns)):
        _passes(circuit, through.out, leg, column, 1.0, leaving=-1.0)
        circuit.row(v_far, [*circuit.voltage(leg.plus, 1), (column, z_leg), (emf, -way)])
    circuit.row(circuit.s_base / v_near, [(drawn, 1), (first, -turns), (second, turns)])
    for z, column in ((z_near, drawn), (z_leg, first), (z_leg, second)):
        circuit.losses.append((np.array([[z]]), [column]))
    if unit.magnetizing_pu:
        z = turned[1] ** 2 / va / unit.magnetizing_pu
        column = circuit.branch(legs[0].plus, None, z, v_far)
        _passes(circuit, through.out, legs[0], column, -1.0, 0)
    return through


def summed(terms: Sequence[Sequence[tuple[int, float]]], x: Complex) -> Complex:
    """(3,) the currents that ``Through`` names."""
    return np.array([sum(x[c] * weight for c, weight in own) for own in terms], np.complex128)
