"""Scenarios: one fresh draw of the feeder's state, one event on it, and the instruments' errors.

A block's random stream depends on the seed and on what the block is, never on who draws it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...detector.instruments import Errors, draw_errors
from ...model.events.base import Event, apply_event
from ...model.machine_state import machine_state
from ...model.machines import DER_MODELS
from ...model.network import CONNECTIONS
from ...model.solve import quiet_state
from ...model.states import State
from ..spec.correlations import draw_scalars
from .cases import Case, Group, Wired, make_case, make_cases
from .classes import DrawClass, Purpose
from .draw_event import draw_event, draw_wiring
from .load_draws import draw_loads
from .load_levels import load_levels

__all__ = [
    "BlockId",
    "Case",
    "Group",
    "Scenarios",
    "draw_scenarios",
    "make_case",
    "make_cases",
    "stream",
    "whole_rounds",
]

Int = NDArray[np.int64]
Real = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockId:
    """Which block of scenarios: all that its random stream depends on."""

    seed: int
    purpose: Purpose
    attempt: int
    drawn: DrawClass
    block: int
    group: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scenarios:
    """S scenarios: two network states, the event between them, and the instruments' errors."""

    first: Wired  #: the network before the event
    second: Wired  #: and after it; the same but for switching
    before: State
    after: State
    event: Event
    der_model: Int  #: (D, S) index into ``DER_MODELS``
    errors: Errors
    miswired: tuple[Int, Int]  #: (S,) point and kind of its wrong wiring; kind 0: none


def stream(which: BlockId) -> np.random.Generator:
    """The block's own independent stream."""
    key = [int(which.purpose), which.attempt, int(which.drawn), which.block]
    if which.group:  # a study with one network state has the contract's four
        key.append(which.group)
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(which.seed, spawn_key=key)))


def draw_scenarios(case: Case, which: BlockId, size: int) -> Scenarios:
    """Draw one block of ``size`` scenarios."""
    rng = stream(which)
    before, after, der_model = _draw_states(rng, case, size)
    event = draw_event(rng, case, which.drawn, size)
    before, after = apply_event(case.network, before, after, event)
    first, second = _switched(case, which)
    if first.network is not second.network:
        before = before._replace(ratio=_file_ratio(first, size))
        after = after._replace(ratio=_file_ratio(second, size))
    errors = draw_errors(rng, len(case.points.names), size)
    return Scenarios(
        first=first,
        second=second,
        before=before,
        after=after,
        event=event,
        der_model=der_model,
        errors=errors,
        miswired=draw_wiring(rng, case, which.drawn, size),
    )


def whole_rounds(case: Case, drawn: DrawClass, blocks: int) -> int:
    """Blocks of a class, in whole rounds where each goes to one other state or comes from it."""
    each = max(2 * len(_other_states(case, drawn)), 1)
    return -(-blocks // each) * each


def _other_states(case: Case, drawn: DrawClass) -> tuple[Wired, ...]:
    states = {DrawClass.TIE_SWITCHING: case.ties, DrawClass.TRANSFER: case.transfers}
    return states.get(drawn, ())


def _switched(case: Case, which: BlockId) -> tuple[Wired, Wired]:
    """The network before and after: blocks of switching go to each other state and back."""
    others = _other_states(case, which.drawn)
    if not others:
        return case.wired, case.wired
    other = others[which.block // 2 % len(others)]
    return (other, case.wired) if which.block % 2 else (case.wired, other)


def _file_ratio(wired: Wired, size: int) -> Real:
    return np.repeat(wired.network.ratio[:, :, None], size, axis=2)


def _draw_states(rng: np.random.Generator, case: Case, size: int) -> tuple[State, State, Int]:
    """States ΔT ago and now, without the event, and what the DER are.

    Only the ambient changes lie between the two.
    """
    study, network = case.study, case.network
    scalars = draw_scalars(rng, study, size)
    shape = (len(network.loads), size)
    level = np.broadcast_to(load_levels(study, case.load_places, scalars), shape)
    scale, exponent, later_scale = draw_loads(rng, study, level, scalars.get("loads.exponent"))
    source_change = scalars["ambient.source_pct"] / 100.0
    machines = _machine_draws(case, scalars, size)
    before = quiet_state(
        network, scale, exponent, machine_state(network, scale, exponent, **machines)
    )
    before = before._replace(connection=_draw_connections(rng, case, scalars, before))
    later = machine_state(network, later_scale, exponent, **machines)
    after = before._replace(**later)
    after = after._replace(emf_pu=before.emf_pu * (1.0 + source_change))
    return before, after, _draw_der_models(rng, case, size)


def _machine_draws(case: Case, scalars: dict[str, Real], size: int) -> dict[str, Real]:
    """Those arguments of ``machine_state`` that the study draws."""
    machines = case.network.machines
    rows = {
        "share": ("motors.share", machines.motor_load.size),
        "y2_y1": ("motors.y2_y1", machines.motor_load.size),
        "der_level": ("ders.level", len(machines.ders)),
    }
    return {
        name: np.broadcast_to(scalars[scalar], (count, size))
        for name, (scalar, count) in rows.items()
        if scalar in scalars
    }


def _draw_connections(
    rng: np.random.Generator, case: Case, scalars: dict[str, Real], state: State
) -> Int:
    """(U, S) winding connections: the file's, the unknown ones drawn, some of them Yg/D."""
    connection = state.connection.copy()
    size = connection.shape[1]
    for unit in case.unknown_units:
        choices = case.unknown_choices.draw(rng, size)
        connection[unit] = case.unknown_connections[choices]
    for n, unit in enumerate(case.yg_d_units):
        connection[unit, scalars["transformers.yg_d_count"] > n] = CONNECTIONS["Yg/D"]
    return connection


def _draw_der_models(rng: np.random.Generator, case: Case, size: int) -> Int:
    """(D, S) what each DER keeps when something happens."""
    machines, choices = case.network.machines, case.study.ders.model
    if choices is None:
        return np.repeat(machines.der_model[:, None], size, axis=1)
    codes = np.array([DER_MODELS.index(name) for name in choices.values], np.int64)
    return codes[choices.draw(rng, (len(machines.ders), size))]
