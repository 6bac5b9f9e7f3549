"""Drawn scenarios for the dense reference: one at a time, from the numbers of their states."""

from __future__ import annotations

import functools
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from oracles.dense import DenseSolution, NotConvergedError, solve_dense
from oracles.dense_parts import KV_LV
from oracles.random_happenings import dense_event

from openphase.detector.instruments import Errors, Wiring
from openphase.model.events.base import Event
from openphase.model.machines import DER_MODELS
from openphase.model.network import CONNECTIONS, compile_network, detached_end
from openphase.model.parts import Der, Feeder, Load
from openphase.model.states import State
from openphase.studies.run.cases import Case, Wired
from openphase.studies.run.draw import Scenarios
from openphase.studies.spec.study_file import Group, SwitchState

__all__ = ["Frames", "frames_of", "perfect", "reported"]

MOST_PU = 1.2  #: what DER bear
NAMES = {code: name for name, code in CONNECTIONS.items()}
SWITCHES = frozenset[str]
Ends = tuple[list[list[list[complex]]], list[list[list[complex]]]]
"""Volts and amperes by frame, end and phase."""


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """What the points of one scenario measure, ΔT before and now, and what floats there."""

    v: list[list[list[complex]]]  #: frame, point, phase
    i: list[list[list[complex]]]  #: positive into the point's line
    floating: set[int]  #: points whose voltage the circuit does not determine in either frame


def perfect(errors: Errors) -> Errors:
    """The same instruments without any error."""
    parts: dict[str, Any] = {f.name: np.zeros_like(getattr(errors, f.name)) for f in fields(errors)}
    return Errors(**parts)


def frames_of(case: Case, scenarios: Scenarios, s: int) -> Frames:
    """Scenario ``s``, solved by the reference, which carries DER over by itself.

    Where one of them then stands above what it bears, or nothing can carry its current, all trip.
    """
    feeder, event = _as_drawn(case, scenarios, s), _one(scenarios.event, s)
    watched = replace(feeder, loads=(*feeder.loads, *(_watch(der) for der in feeder.ders)))
    solved: list[DenseSolution] = []
    opened_in = []
    for after, wired, state in (
        (False, scenarios.first, scenarios.before),
        (True, scenarios.second, scenarios.after),
    ):
        closed, opened = _state_of(case, wired)
        detached = {
            detached_end(p.name): f"{p.line}@{p.bus}" for p in feeder.points if p.name in opened
        }
        factor = float(event.emf_factor[0]) if after else 1.0
        solve = functools.partial(
            solve_dense,
            watched,
            closed,
            load_scale=_scales(case, state, s),
            exponents=dict(zip(case.network.loads, state.exponent[:, s].tolist(), strict=True)),
            connections=_connections(case, state, s),
            emf_scale=float(state.emf_pu[s]) / case.network.emf_pu / factor,
            start=solved[0] if after else None,
            before=solved[0] if after else None,
            opened=opened,
        )
        happening = dense_event(case.network, event, detached, after=after)
        try:
            found = solve(happening)
            trips = after and any(_stands_pu(feeder, found, d) > MOST_PU for d in feeder.ders)
        except NotConvergedError:
            if not (after and feeder.ders):
                raise
            trips = True
        if trips:
            found = solve(replace(happening, ders={der.name: 0.0 for der in feeder.ders}))
        solved.append(found)
        opened_in.append(opened)
    return _measured(feeder, solved, opened_in)


def _stands_pu(feeder: Feeder, found: DenseSolution, der: Der) -> float:
    """What a DER sees: its highest phase; without a neutral the positive sequence."""
    if feeder.source.wires == 4:
        return float(found.load_pu[_watch(der).name].max())
    if der.transformer is not None:
        v, nominal = found.lv[der.transformer], KV_LV * 1000.0 / np.sqrt(3.0)
    else:
        assert der.place is not None
        lines = {line.name: line.to_bus for line in feeder.lines}
        bus = der.place.bus or lines[str(der.place.line)]  # a tee is as high as the line's end
        v, nominal = found.v[bus], feeder.source.v_phase_v
    turn = np.exp(2j * np.pi / 3.0)
    return float(abs(v @ np.array([1.0, turn, turn**2])) / 3.0 / nominal)


def reported(frames: Frames, points: tuple[int, int], wrong: tuple[int, int]) -> Ends:
    """V and I of the two ends of a section, ``wrong`` being a point and how it is wired."""
    v = [[list(frame[p]) for p in points] for frame in frames.v]
    i = [[list(frame[p]) for p in points] for frame in frames.i]
    for end, point in enumerate(points):
        if point == wrong[0]:
            for frame in (0, 1):
                v[frame][end], i[frame][end] = _miswired(v[frame][end], i[frame][end], wrong[1])
    return v, i


def _miswired(v: list[complex], i: list[complex], kind: int) -> tuple[list[complex], list[complex]]:
    """What is reported, by the name of the wrong wiring."""
    name = Wiring(kind).name
    order = [0, 1, 2]
    if "SWAPPED" in name:
        a, b = ("ABC".index(phase) for phase in name[-2:])
        order[a], order[b] = b, a
    elif "ROTATED" in name:
        order = ["ABC".index(phase) for phase in name[-3:]]
    turned = {"REVERSED_A": [0], "REVERSED_B": [1], "REVERSED_C": [2], "REVERSED_ALL": [0, 1, 2]}
    signs = [-1.0 if k in turned.get(name, []) else 1.0 for k in range(3)]
    for_i = [0, 1, 2] if name.startswith("VOLTAGES") else order
    return [v[k] for k in order], [signs[n] * i[k] for n, k in enumerate(for_i)]


def _watch(der: Der) -> Load:
    """Next to no load across the windings of a DER, whose voltages the reference then tells."""
    return Load(
        name=f"watch {der.name}",
        transformer=der.transformer,
        place=der.place,
        connection="wye",
        kw=1e-9,
        power_factor=1.0,
        exponent=2.0,
    )


def _one(event: Event, s: int) -> Event:
    parts: dict[str, Any] = {f.name: getattr(event, f.name)[..., [s]] for f in fields(event)}
    return Event(**parts)


def _motor(case: Case, n: int) -> int | None:
    """Row of load ``n``'s motor among the machines."""
    rows = np.flatnonzero(case.network.machines.motor_load == n)
    return int(rows[0]) if rows.size else None


def _motor_part(case: Case, state: State, n: int, s: int) -> float:
    """Power of a load's motor, in powers of the file's load."""
    row = _motor(case, n)
    if row is None:
        return 0.0
    return float((state.machine_va[row, s] / case.network.machines.load_va[n]).real)


def _scales(case: Case, state: State, s: int) -> dict[str, float]:
    return {
        name: float(state.load_scale[n, s]) + _motor_part(case, state, n, s)
        for n, name in enumerate(case.network.loads)
    }


def _connections(case: Case, state: State, s: int) -> Any:
    units = [unit.name for unit in case.feeder.transformers]
    return {name: NAMES[int(state.connection[u, s])] for u, name in enumerate(units)}


def _as_drawn(case: Case, scenarios: Scenarios, s: int) -> Feeder:
    """The feeder with the motors and DER of a scenario."""
    state, machines = scenarios.before, case.network.machines
    scales, loads = _scales(case, state, s), []
    for n, load in enumerate(case.feeder.loads):
        row, ratio = _motor(case, n), load.motor_y2_y1
        if row is not None and state.machine_va[row, s]:
            y1 = state.machine_va[row, s].conj() / (3.0 * case.feeder.source.v_phase_v**2)
            ratio = float((state.machine_y_s[row, 2, s] / y1).real)
        share = _motor_part(case, state, n, s) / scales[load.name]
        loads.append(replace(load, motor_share=share, motor_y2_y1=ratio))
    motors, ders = machines.motor_load.size, []
    for d, der in enumerate(case.feeder.ders):
        level = float((-state.machine_va[motors + d, s] / machines.der_va[d]).real)
        model: Any = DER_MODELS[int(scenarios.der_model[d, s])]
        ders.append(replace(der, kw=der.kw * level, model=model))
    return replace(case.feeder, loads=tuple(loads), ders=tuple(ders))


def _state_of(case: Case, wired: Wired) -> tuple[SWITCHES, SWITCHES]:
    """Switches that are closed and points that are open, where that makes this network."""
    events = case.study.events
    known: tuple[Group | SwitchState, ...] = (
        *case.study.setting_groups(),
        *events.tie_switching.states,
        *events.transfer.states,
    )
    for state in known:
        normal = [switch.name for switch in case.feeder.switches if switch.closed]
        closed = frozenset(normal if state.closed is None else state.closed)
        opened = frozenset(state.opened)
        if _keys(compile_network(case.feeder, closed, opened)) == _keys(wired.network):
            return closed, opened
    raise AssertionError("a network that the study does not name")


def _keys(network: Any) -> set[Any]:
    return {piece.key for piece in network.pieces if piece is not None}


def _measured(feeder: Feeder, solved: list[DenseSolution], opened_in: list[SWITCHES]) -> Frames:
    lines = {line.name: line for line in feeder.lines}
    v: list[list[list[complex]]] = []
    i: list[list[list[complex]]] = []
    floating: set[int] = set()
    for state, opened in zip(solved, opened_in, strict=True):
        volts: list[NDArray[np.complex128]] = []
        amperes: list[NDArray[np.complex128]] = []
        for n, point in enumerate(feeder.points):
            beyond = point.name in opened and point.voltage_side == "line"
            name = f"{point.line}@{point.bus}" if beyond else point.bus
            volts.append(state.v[name])
            at_from = lines[point.line].from_bus == point.bus
            amperes.append((state.i_from if at_from else state.i_to)[point.line])
            if any((name, phase) in state.floating for phase in range(3)):
                floating.add(n)
        v.append([own.tolist() for own in volts])
        i.append([own.tolist() for own in amperes])
    return Frames(v, i, floating)
