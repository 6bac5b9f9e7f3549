"""A feeder on which every class of events can occur, and a study that draws all it can.

                              X
                              |
    SUB -R1- R2 - M =REG= M2 - R3 - R4 -S- R4s - T
     |        |    |                 |
     |        K    L                tie
     +--------------R5-------------- R4b

The points and sections are the paper's; K, L, T and X hang on laterals: of the first section,
of the second, beyond the last, and of none. REG is a closed switch on three wires.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

from oracles.event_sites import without_regulators

from openphase.model import load_feeder
from openphase.model.distributions import Integers, Uniform
from openphase.model.feeder import make_feeder
from openphase.model.machines import DER_MODELS
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
)
from openphase.studies.spec.study_file import (
    Correlation,
    Events,
    Group,
    MotorDraw,
    Study,
    SwitchingDraw,
    SwitchState,
    TransformerDraw,
    check_study,
    default_study,
)

__all__ = ["UNKNOWN", "any_model", "whole_feeder", "whole_study"]

UNKNOWN = ("T2", "T5")
LATERALS = {"LK": ("R2", "K", 1.0), "LL": ("M", "L", 2.0), "LT": ("R4s", "T", 1.5)}


def whole_feeder(wires: int = 4) -> Feeder:
    """The feeder on four wires, earthed by a resistor; on three, isolated."""
    paper = load_feeder("paper")
    lines = {line.name: line for line in paper.lines}
    lines["R2-M"] = replace(lines["R2-R3"], name="R2-M", to_bus="M", length_km=2.0)
    lines["M2-R3"] = replace(lines.pop("R2-R3"), name="M2-R3", from_bus="M2", length_km=3.0)
    for name, (start, end, km) in {**LATERALS, "LX": ("SUB", "X", 4.0)}.items():
        lines[name] = replace(lines["R1-R2"], name=name, from_bus=start, to_bus=end, length_km=km)
    feeder = replace(
        paper,
        name="whole",
        source=replace(
            paper.source,
            wires=wires,
            neutral="resistor" if wires == 4 else "isolated",
            neutral_ohm=4.0 + 0j if wires == 4 else 0j,
        ),
        lines=tuple(_charged(line) for line in lines.values()),
        transformers=tuple(
            _unit(paper, name, wires) for name in ("T1", "T2", "T3", "T4", "T5", "T6")
        ),
        loads=(
            *(replace(load, motor_share=0.3, exponent=1.5) for load in paper.loads),
            *(_direct(name, at, kw, wires) for name, at, kw in DIRECT),
        ),
        ders=_ders(wires),
        capacitors=(
            Capacitor(
                name="C1",
                place=Place(bus="R3"),
                connection="wye" if wires == 4 else "delta",
                kvar=150.0,
            ),
            Capacitor(name="C2", place=Place(line="LT", at=0.5), connection="delta", kvar=100.0),
        ),
        regulators=(
            Regulator(
                name="REG", from_bus="M", to_bus="M2", taps=(3, -2, 1), step_pct=0.625, most_taps=16
            ),
        ),
        switches=(*paper.switches, Switch(name="S", from_bus="R4", to_bus="R4s", closed=True)),
        points=tuple(
            replace(point, line="R2-M") if point.name == "R2" else point for point in paper.points
        ),
    )
    feeder = feeder if wires == 4 else without_regulators(feeder)
    return make_feeder(**_fields(feeder))


DIRECT = (
    ("D1", Place(line="LK", at=0.5), 150.0),
    ("D2", Place(bus="L"), 200.0),
    ("D3", Place(bus="T"), 120.0),
    ("D4", Place(line="LX", at=0.75), 300.0),
)


def _fields(feeder: Feeder) -> dict[str, Any]:
    bare = {"imported_from", "origins"}
    return {f.name: getattr(feeder, f.name) for f in fields(feeder) if f.name not in bare}


def _charged(line: Line) -> Line:
    return replace(line, c1_nf_per_km=60.0, c0_nf_per_km=35.0)


def _unit(paper: Feeder, name: str, wires: int) -> Any:
    """A transformer of the paper's feeder, its connection unknown, or moved to where a line is."""
    unit = next(own for own in paper.transformers if own.name == name)
    if unit.place.line == "R2-R3":
        unit = replace(unit, place=Place(line="R2-M" if name == "T2" else "M2-R3", at=0.6))
    on_three: dict[str, Connection] = {"T3": "D/D", "T4": "Y/D"}
    connection = unit.connection if wires == 4 else on_three.get(name, "D/Yg")
    if name in UNKNOWN:
        return replace(unit, connection="unknown", x0_pu=None)
    x0_pu = unit.x0_pu if wires == 4 else None
    return replace(
        unit, connection=connection, x0_pu=x0_pu, xm_pu=50.0 if name in ("T1", "T4") else None
    )


def _direct(name: str, place: Place, kw: float, wires: int) -> Load:
    return Load(
        name=name,
        transformer=None,
        place=place,
        connection="wye" if wires == 4 and name != "D2" else "delta",
        kw=kw,
        power_factor=0.95,
        exponent=1.0,
    )


def _ders(wires: int) -> tuple[Der, ...]:
    """One of each model; two behind transformers, two by themselves."""
    z1 = 1.0 + 12.0j
    places = {"thevenin": "T6", "constant_current": "T3"}
    direct = {"generator": Place(bus="K"), "constant_power": Place(line="LL", at=0.5)}
    return tuple(
        Der(
            name=f"G {model}",
            transformer=places.get(model),
            place=direct.get(model),
            kw=150.0,
            power_factor=1.0 if n % 2 else 0.95,
            model=model,  # type: ignore[arg-type]
            z1_ohm=z1 if model in ("thevenin", "generator") else None,
            z2_ohm=0.7 * z1 if model in ("thevenin", "generator") else None,
            z0_ohm=0.5 * z1 if model == "generator" and wires == 4 else None,
        )
        for n, model in enumerate(DER_MODELS)
    )


def any_model(feeder: Feeder) -> Feeder:
    """``feeder`` with DER that have what all models stand on."""
    z = 1.0 + 12.0j
    ders = tuple(replace(der, model="generator", z1_ohm=z, z2_ohm=z) for der in feeder.ders)
    return replace(feeder, ders=ders)


def whole_study(feeder: Feeder) -> Study:
    """A study of ``feeder`` with two setting groups, that draws whatever can be drawn.

    In the second group the tie is closed and R1 open: all is fed by R5.
    """
    closed = tuple(switch.name for switch in feeder.switches if switch.closed)
    tied = SwitchState(closed=(*closed, "R4"))
    moved = replace(tied, opened=("R1",))
    base = default_study("paper")
    study = replace(
        base,
        motors=MotorDraw(share=Uniform(low=0.1, high=0.6), y2_y1=Uniform(low=3.0, high=7.0)),
        transformers=TransformerDraw(
            yg_d=("T4", "T6") if feeder.source.wires == 4 else (),
            yg_d_count=Integers(least=0, most=2 if feeder.source.wires == 4 else 0),
        ),
        network=replace(base.network, closed=None),
        correlations=(Correlation(between=("loads.level", "ders.level"), rank=-0.7),),
        groups=(
            Group(name="normal", closed=closed),
            Group(name="moved", closed=moved.closed, opened=moved.opened),
        ),
        events=_switching(base.events, tied, moved),
    )
    check_study(study, feeder, "the whole study")
    return study


def _switching(events: Events, tied: SwitchState, moved: SwitchState) -> Events:
    return replace(
        events,
        tie_switching=SwitchingDraw(states=(tied,)),
        transfer=SwitchingDraw(states=(tied, moved)),
    )
