"""An in-line transformer with nothing but loads behind it becomes one that hangs on the feeder.

A study draws what a hanging unit of unknown connection is; an in-line one keeps its windings.
"""

from __future__ import annotations

import math
from dataclasses import replace

from ...model.buses import to_side_volts
from ...model.parts import (
    Capacitor,
    Der,
    Feeder,
    InlineTransformer,
    Line,
    Load,
    Place,
    Regulator,
    Switch,
    Transformer,
)

__all__ = ["hang", "why_not_hanging"]

CLOSE = 0.002  #: relative difference of voltages that are nominally the same


def why_not_hanging(feeder: Feeder, unit: InlineTransformer) -> str | None:
    """Why a three-phase unit cannot hang on the feeder with its loads; None where it can."""
    bus = unit.to_bus
    joining: list[Line | Switch | Regulator] = [
        *feeder.lines,
        *feeder.switches,
        *feeder.regulators,
    ]
    beyond = [part.name for part in joining if bus in (part.from_bus, part.to_bus)]
    beyond += [
        other.name
        for other in feeder.inline_transformers
        if other is not unit and other.name != unit.name and bus in (other.from_bus, other.to_bus)
    ]
    if beyond:
        return f"a network lies behind it ({beyond[0]})"
    standing: list[Capacitor | Der | Transformer] = [
        *feeder.capacitors,
        *feeder.ders,
        *feeder.transformers,
    ]
    others = [part.name for part in standing if part.place == Place(bus=bus)]
    if others:
        return f"more than loads stands behind it ({others[0]})"
    uneven = [load.name for load in _behind(feeder, unit) if len(load.phases) < 3]
    if uneven:
        return f"a load behind it has not three phases ({uneven[0]})"
    if unit.leakage_pu == 0:
        return "it has no leakage, so that it cannot be every connection"
    return None


def hang(feeder: Feeder, unit: InlineTransformer) -> tuple[Feeder, list[str]]:
    """The feeder with the unit hanging on its from-bus, connection unknown, and its loads behind.

    Leakage, rating and magnetizing reactance are kept, and each load's power at nominal voltage.
    What such a unit or its loads cannot have is told.
    """
    loads = _behind(feeder, unit)
    hanging = Transformer(
        name=unit.name,
        place=Place(bus=unit.from_bus),
        connection="unknown",
        rating_kva=unit.rating_kva,
        leakage_pu=unit.leakage_pu,
        x0_pu=None,
        xm_pu=-1.0 / unit.magnetizing_pu.imag if unit.magnetizing_pu.imag < 0.0 else None,
    )
    names = {load.name for load in loads}
    kv = to_side_volts(unit) / 1000.0
    notes = []
    if unit.from_tap != 1.0 or unit.to_tap != 1.0:
        notes.append(f"{unit.name} hangs on the feeder now: its tap of winding is left out")
    if any(load.zip is not None or load.v_max_pu is not None for load in loads):
        notes.append(
            f"the loads behind {unit.name} keep their kW and exponent, "
            "not their shares of Z, I and P nor limits of voltage"
        )
    return (
        replace(
            feeder,
            transformers=(*feeder.transformers, hanging),
            inline_transformers=tuple(
                other for other in feeder.inline_transformers if other.name != unit.name
            ),
            loads=tuple(
                _behind_it(load, unit.name, kv) if load.name in names else load
                for load in feeder.loads
            ),
            coordinates=tuple(at for at in feeder.coordinates if at.bus != unit.to_bus),
        ),
        notes,
    )


def _behind(feeder: Feeder, unit: InlineTransformer) -> list[Load]:
    return [
        load for load in feeder.loads if load.place is not None and load.place.bus == unit.to_bus
    ]


def _behind_it(load: Load, unit: str, kv_phase: float) -> Load:
    """The load behind a hanging unit, with the power it takes at its bus's nominal voltage."""
    exponent_q = load.exponent if load.exponent_q is None else load.exponent_q
    own_kv = kv_phase * (3.0**0.5 if load.connection == "delta" else 1.0)
    v = 1.0 if load.branch_kv is None else own_kv / load.branch_kv
    if abs(v - 1.0) < CLOSE:
        v = 1.0
    p = load.kw * v**load.exponent
    if load.kvar is None:
        q = load.kw * math.tan(math.acos(abs(load.power_factor)))
        q = math.copysign(q, load.power_factor) * v**exponent_q
    else:
        q = load.kvar * v**exponent_q
    size = math.hypot(p, q)
    return replace(
        load,
        transformer=unit,
        place=None,
        connection="wye",
        phases="abc",
        branch_kv=None,
        kw=p,
        kvar=None,
        power_factor=math.copysign(p / size, q) if size and p else 1.0,
        exponent_q=None,
        zip=None,
        v_min_pu=0.7,
        v_max_pu=None,
        v_low_pu=None,
    )
