"""Scenarios: one fresh draw of the feeder's state, one event on it, and the instruments' errors.

A block's random stream depends on the seed and on what the block is, never on who draws it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...detector.instruments import disc_noise
from ...model.events.base import Event, Places, apply_event, places_on
from ...model.events.load_step import draw_load_step
from ...model.events.open_phase import draw_open_phase, draw_open_three
from ...model.events.source_step import draw_source_step
from ...model.network import CONNECTIONS, Network, compile_network
from ...model.parts import Feeder
from ...model.points import Points, find_points
from ...model.states import State
from .classes import DrawClass, Purpose
from .spec import Study

__all__ = ["BlockId", "Case", "Scenarios", "draw_event", "draw_scenarios", "make_case", "stream"]


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockId:
    """Which block of scenarios: all that its random stream depends on."""

    seed: int
    purpose: Purpose
    attempt: int
    drawn: DrawClass
    block: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """A feeder and a study, compiled: everything that a block needs."""

    feeder: Feeder
    study: Study
    network: Network
    points: Points
    lines: Places  #: every line, for breaks
    regions: tuple[Places, ...]  #: each section's lines, and those in none, for load steps
    yg_d_units: NDArray[np.int64]  #: units that may be Yg/D, in order


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scenarios:
    """S scenarios: two network states, the event between them, and errors in units of bound."""

    before: State
    after: State
    event: Event
    v_error: NDArray[np.complex128]  #: (2, P, 3, S)
    i_error: NDArray[np.complex128]  #: (2, P, 3, S)


def make_case(feeder: Feeder, study: Study) -> Case:
    """Compile ``feeder`` for ``study``."""
    closed = study.network.closed
    network = compile_network(feeder, None if closed is None else frozenset(closed))
    points = find_points(feeder, network)
    sections = [terminal.in_section for terminal in points.terminals[::2]]
    rest = ~np.any(sections, axis=0)
    regions = [places_on(network, chosen) for chosen in [*sections, rest]]
    return Case(
        feeder=feeder,
        study=study,
        network=network,
        points=points,
        lines=places_on(network),
        regions=tuple(region for region in regions if region.edges.size),
        yg_d_units=np.array(
            [network.units.index(name) for name in study.transformers.yg_d], np.int64
        ),
    )


def stream(which: BlockId) -> np.random.Generator:
    """The block's own independent stream."""
    key = (int(which.purpose), which.attempt, int(which.drawn), which.block)
    seeds = np.random.SeedSequence(which.seed, spawn_key=key)
    return np.random.Generator(np.random.SFC64(seeds))


def draw_scenarios(case: Case, which: BlockId, size: int) -> Scenarios:
    """Draw one block of ``size`` scenarios."""
    rng = stream(which)
    before, after = _draw_states(rng, case, size)
    event = draw_event(rng, case, which.drawn, size)
    before, after = apply_event(case.network, before, after, event)
    shape = (2, len(case.points.names), 3, size)
    return Scenarios(
        before=before,
        after=after,
        event=event,
        v_error=disc_noise(rng, shape),
        i_error=disc_noise(rng, shape),
    )


def _draw_states(rng: np.random.Generator, case: Case, size: int) -> tuple[State, State]:
    """States ΔT ago and now, without the event: only the ambient changes lie between them."""
    loads, ambient, network = case.study.loads, case.study.ambient, case.network
    shape = (len(network.loads), size)
    scale = rng.uniform(*loads.level, size) * rng.uniform(*loads.each, shape)
    spread = rng.uniform(-loads.exponent_spread, loads.exponent_spread, shape)
    exponent = np.clip(rng.uniform(*loads.exponent, size) + spread, 0.0, 2.0)
    connection = np.repeat(network.connection[:, None], size, axis=1)
    fewest, most = case.study.transformers.yg_d_count
    count = rng.integers(fewest, most + 1, size)
    for n, unit in enumerate(case.yg_d_units):
        connection[unit, count > n] = CONNECTIONS["Yg/D"]
    emf = np.full(size, network.emf_pu)
    source_change = rng.uniform(-ambient.source_pct, ambient.source_pct, size) / 100.0
    load_change = rng.uniform(-ambient.load_pct, ambient.load_pct, shape) / 100.0
    before = State(
        emf_pu=emf,
        load_scale=scale,
        exponent=exponent,
        connection=connection,
        edge=np.full(size, -1, np.int64),
        share=np.zeros(size),
        open_mask=np.zeros(size, np.int64),
        step_y_s=np.zeros((3, size), np.complex128),
        step_exponent=np.full(size, 2.0),
    )
    after = before._replace(
        emf_pu=emf * (1.0 + source_change), load_scale=scale * (1.0 + load_change)
    )
    return before, after


def draw_event(rng: np.random.Generator, case: Case, drawn: DrawClass, size: int) -> Event:
    """The events of one class."""
    study = case.study
    if drawn == DrawClass.OPEN_PHASE:
        return draw_open_phase(rng, size, case.lines, study.open_phase.two_phase_share)
    if drawn == DrawClass.OPEN_THREE:
        return draw_open_three(rng, size, case.lines)
    if drawn == DrawClass.SOURCE_STEP:
        return draw_source_step(rng, size, study.source_step.pct)
    step = study.load_step
    return draw_load_step(rng, size, case.regions, step.kw, step.single_phase_share, step.exponent)
