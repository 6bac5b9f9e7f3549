"""Machines: motors within loads, and DER; what sees the sequences apart.

A machine takes or delivers power in the positive sequence and is an admittance of its own
to the negative. Before an event DER deliver what is asked of them; after it each keeps
something: the EMF behind its impedance, its current, or its power. A current that has no way
back beyond open phases has no solution: such conductors are flagged, and answered with 0 V.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .parts import Der, Feeder, Load
from .states import Answer, State

if TYPE_CHECKING:
    from .network import Network

__all__ = ["DER_MODELS", "Machines", "carried_over", "machine_state", "machines_of", "power_va"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Int = NDArray[np.int64]

DER_MODELS = ("thevenin", "generator", "constant_current", "constant_power")
"""What DER keep when an event happens; an index into this stands for the model in arrays."""

FLOOR_PU = 0.7  #: below it a load is constant impedance, at its admittance there


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Machines:
    """The machines of a compiled network: motors of loads first, then DER."""

    unit: Int  #: (M,) across whose LV windings each stands
    motor_load: Int  #: (motors,) the load that each motor is part of
    motor_share: Real  #: (motors,) of that load, as in the file
    motor_y2_y1: Real  #: (motors,)
    load_va: Complex  #: (L,) P + jQ of every load, as in the file
    ders: tuple[str, ...]
    der_va: Complex  #: (D,) P + jQ delivered
    der_model: Int  #: (D,) index into ``DER_MODELS``
    der_y_s: Complex  #: (D, 3) admittances behind the EMF, sequences 0, 1, 2

    @property
    def count(self) -> int:
        """How many there are."""
        return self.unit.size


def power_va(kw: float, power_factor: float) -> complex:
    """P + jQ in volt-amperes; a negative power factor is leading."""
    p = kw * 1000.0
    return complex(p, math.copysign(p * math.sqrt(1.0 / power_factor**2 - 1.0), power_factor))


def machines_of(feeder: Feeder, units: Sequence[object], motors: bool) -> Machines:
    """The machines of a feeder; ``motors``: in every load.

    ``units`` are the parts that hang on nodes: transformers, and loads and DER without one.
    """
    rows = [n for n, load in enumerate(feeder.loads) if motors or load.motor_share > 0.0]
    loads: list[Load] = [feeder.loads[n] for n in rows]
    names = [unit.name for unit in feeder.transformers]

    def unit_of(part: Load | Der) -> int:
        if part.transformer is not None:
            return names.index(part.transformer)
        return next(n for n, unit in enumerate(units) if unit is part)

    def admittance(z: complex | None) -> complex:
        return 0j if z is None else 1.0 / z

    ders = feeder.ders
    parts: list[Load | Der] = [*loads, *ders]
    return Machines(
        unit=np.array([unit_of(part) for part in parts], np.int64),
        motor_load=np.array(rows, np.int64),
        motor_share=np.array([load.motor_share for load in loads], np.float64),
        motor_y2_y1=np.array([load.motor_y2_y1 for load in loads], np.float64),
        load_va=np.array([power_va(x.kw, x.power_factor) for x in feeder.loads], np.complex128),
        ders=tuple(der.name for der in ders),
        der_va=np.array([power_va(der.kw, der.power_factor) for der in ders], np.complex128),
        der_model=np.array([DER_MODELS.index(der.model) for der in ders], np.int64),
        der_y_s=np.array(
            [[admittance(z) for z in (d.z0_ohm, d.z1_ohm, d.z2_ohm)] for d in ders], np.complex128
        ).reshape(-1, 3),
    )


def machine_state(
    network: Network,
    load_scale: Real,
    exponent: Real,
    *,
    share: Real | None = None,
    y2_y1: Real | None = None,
    der_level: Real | None = None,
) -> dict[str, Any]:
    """The fields of a `State` that depend on motors and DER, before any event.

    Parameters
    ----------
    network : Network
    load_scale, exponent : (L, S) arrays
        Factor on every load, motors included, and voltage exponent.
    share, y2_y1 : (motors, S) arrays, optional
        Motor share and ratio of the motors' admittances; by default the file's.
    der_level : (D, S) array, optional
        Factor on what the DER deliver; by default 1. At 0 they are disconnected.
    """
    own, v = network.machines, network.tree.v_nominal_v
    size = load_scale.shape[1]
    motors, load = own.motor_load.size, own.motor_load
    share = np.tile(own.motor_share[:, None], size) if share is None else share
    y2_y1 = np.tile(own.motor_y2_y1[:, None], size) if y2_y1 is None else y2_y1
    level = np.ones((len(own.ders), size)) if der_level is None else der_level
    va = np.zeros((own.count, size), np.complex128)
    va[:motors] = own.load_va[load, None] * load_scale[load] * share
    va[motors:] = -own.der_va[:, None] * level
    follows = np.zeros((own.count, size))
    follows[:motors] = exponent[load]
    y = np.zeros((own.count, 3, size), np.complex128)
    y[:motors, 2] = y2_y1 * va[:motors].conj() / (3.0 * v * v)
    connected = va[motors:] != 0.0
    y[motors:, 0] = np.where(connected, own.der_y_s[:, 0, None], 0.0)
    y[motors:, 2] = np.where(connected, own.der_y_s[:, 2, None], 0.0)
    static = load_scale.copy()
    static[load] *= 1.0 - share
    return {
        "load_scale": static,
        "exponent": exponent,
        "machine_va": va,
        "machine_exponent": follows,
        "machine_y_s": y,
        "machine_j_a": np.zeros((own.count, size), np.complex128),
    }


def carried_over(
    network: Network,
    before: State,
    answer: Answer,
    after: State,
    factor: Real,
    model: Int | None = None,
) -> State:
    """``after`` with what the DER keep from before the event.

    Parameters
    ----------
    before, answer : State, Answer
        The state before the event, and its solution.
    after : State
        The state after it.
    factor : (D, S) array
        On what the DER deliver; 0 for one that has tripped, which leaves nothing.
    model : (D, S) array of int, optional
        Indices into ``DER_MODELS``; by default the file's.
    """
    own, tree = network.machines, network.tree
    if not own.ders:
        return after
    ders = slice(own.motor_load.size, None)
    kind = np.tile(own.der_model[:, None], factor.shape[1]) if model is None else model
    v1 = answer.machine_v1_v[ders]
    factor = np.where(before.machine_va[ders] == 0.0, 0.0, factor)  # not even connected
    asked = before.machine_va[ders].conj() / (3.0 * tree.v_nominal_v**2)
    current = -asked * np.maximum(np.abs(v1) / tree.v_nominal_v, FLOOR_PU) ** -2.0 * v1 * factor
    behind = np.isin(kind, (0, 1))
    y1 = np.where(behind, own.der_y_s[:, 1, None], 0.0)
    kept = kind != DER_MODELS.index("constant_power")
    y = after.machine_y_s.copy()
    y[ders, 1] = y1
    y[ders] = np.where((factor != 0.0)[:, None], y[ders], 0.0)
    va, j = after.machine_va.copy(), after.machine_j_a.copy()
    va[ders] = np.where(kept, 0.0, before.machine_va[ders] * factor)
    j[ders] = np.where(kept & (factor != 0.0), current + y1 * v1, 0.0)
    return after._replace(machine_va=va, machine_y_s=y, machine_j_a=j)
