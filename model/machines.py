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

import numpy as np
from numpy.typing import NDArray

from .parts import Der, Feeder, Load

__all__ = ["DER_MODELS", "Machines", "has_motor", "load_va", "machines_of", "power_va"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Int = NDArray[np.int64]

DER_MODELS = ("thevenin", "generator", "constant_current", "constant_power")
"""What DER keep when an event happens; an index into this stands for the model in arrays."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Machines:
    """The machines of a compiled network: motors of loads first, then DER."""

    unit: Int  #: (M,) across whose LV windings each stands
    motor_load: Int  #: (motors,) the load that each motor is part of
    motor_share: Real  #: (motors,) of that load, as in the file
    motor_y2_y1: Real  #: (motors,)
    motor_exponent: Real  #: (motors,) of those whose load follows a law of its own
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


def load_va(load: Load) -> complex:
    """P + jQ of a load at nominal voltage."""
    if load.kvar is None:
        return power_va(load.kw, load.power_factor)
    return complex(load.kw, load.kvar) * 1000.0


def has_motor(load: Load, motors: bool) -> bool:
    """Whether a load has motors; ``motors``: every one that can, with three phases."""
    return load.motor_share > 0.0 or (motors and len(load.phases) == 3)


def machines_of(feeder: Feeder, units: Sequence[object], motors: bool) -> Machines:
    """The machines of a feeder; ``motors``: in every load that can have one.

    ``units`` are the parts that hang on nodes: transformers, and loads and DER without one.
    """
    rows = [n for n, load in enumerate(feeder.loads) if has_motor(load, motors)]
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
        motor_exponent=np.array([load.exponent for load in loads], np.float64),
        load_va=np.array([load_va(load) for load in feeder.loads], np.complex128),
        ders=tuple(der.name for der in ders),
        der_va=np.array([power_va(der.kw, der.power_factor) for der in ders], np.complex128),
        der_model=np.array([DER_MODELS.index(der.model) for der in ders], np.int64),
        der_y_s=np.array(
            [[admittance(z) for z in (d.z0_ohm, d.z1_ohm, d.z2_ohm)] for d in ders], np.complex128
        ).reshape(-1, 3),
    )
