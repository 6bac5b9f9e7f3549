"""Events: from the study's laws for a class to the draws of ``model.events``."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...model.events.base import Event, no_event
from ...model.events.capacitor_step import draw_capacitor_step
from ...model.events.der_ramp import draw_der_ramp
from ...model.events.der_trip import draw_der_trip
from ...model.events.der_units import der_nodes
from ...model.events.earth_fault import draw_earth_fault
from ...model.events.energisation import draw_energisation
from ...model.events.fallen import draw_fallen_load_side, draw_fallen_source_side
from ...model.events.line_fault import draw_line_fault
from ...model.events.load_step import LoadStepLaw, draw_load_step
from ...model.events.load_swap import LoadSwapLaw, draw_load_swap
from ...model.events.motor_start import MotorStartLaw, draw_motor_start
from ...model.events.open_phase import draw_open_phase, draw_open_three
from ...model.events.open_with_der_trip import draw_open_with_der_trip
from ...model.events.open_with_load_step import OpenWithLoadStepLaw, draw_open_with_load_step
from ...model.events.reclosing import draw_reclosing
from ...model.events.regulator_tap import draw_regulator_tap
from ...model.events.single_pole import draw_single_pole
from ...model.events.source_step import draw_source_step
from ...model.events.step_with_tap import draw_step_with_tap
from ..spec.events import WIRING_KINDS
from .cases import Case, Sites
from .classes import NETWORK, REPORTED, DrawClass, sides

__all__ = ["draw_event", "draw_wiring", "event_sides", "possible_rows"]

Int = NDArray[np.int64]
_Draw = Callable[[np.random.Generator, Case, Sites, int], Event]

LEAST_PHASES = {
    DrawClass.OPEN_THREE: 3,
    DrawClass.CAPACITOR_STEP: 3,
    DrawClass.MOTOR_START: 3,
    DrawClass.LINE_FAULT: 2,
}
"""Classes that need more than one phase of the line on which they stand."""


def draw_event(rng: np.random.Generator, case: Case, drawn: DrawClass, size: int) -> Event:
    """The events of one class; switching and wrong wiring are no event on the feeder."""
    return _DRAWS[drawn](rng, case, _sites(case, drawn), size)


def draw_wiring(
    rng: np.random.Generator, case: Case, drawn: DrawClass, size: int
) -> tuple[Int, Int]:
    """(S,) each: the point that is wired wrongly, and the kind as ``miswire`` counts it."""
    if drawn != DrawClass.WIRING:
        return np.zeros(size, np.int64), np.zeros(size, np.int64)
    kinds = case.study.events.wiring.kinds
    variants = [WIRING_KINDS[name] for name in kinds.values]
    most = max(len(own) for own in variants)
    table = np.array([[own[k % len(own)] for k in range(most)] for own in variants])
    counts = np.array([len(own) for own in variants])
    picked = kinds.draw(rng, size)
    variant = rng.integers(0, counts[picked])
    return rng.integers(len(case.points.names), size=size), table[picked, variant]


def event_sides(case: Case, event: Event) -> NDArray[np.int8]:
    """(T, S): the Side of every event, seen from every terminal."""
    return sides(case.points.terminals, event)


def possible_rows(case: Case) -> NDArray[np.bool_]:
    """(R, T): the rows of ``REPORTED`` in which the study's events can count at a terminal.

    Equipment stands where it stands; every other class is drawn on all lines of medium voltage
    that have its phases.
    """
    network, terminals = case.network, case.points.terminals
    at_edges = {DrawClass.REGULATOR_TAP: np.flatnonzero(network.tree.regulator >= 0)}
    found = np.zeros((len(REPORTED), len(terminals)), np.bool_)
    for r, own in enumerate(REPORTED):
        if own.drawn not in case.drawn:
            continue
        for t, terminal in enumerate(terminals):
            seen = terminal.edge_side[at_edges.get(own.drawn, _sites(case, own.drawn).edges)]
            if own.drawn == DrawClass.DER_TRIP:
                seen = terminal.node_side[der_nodes(network)]
            whole = own.drawn in (*NETWORK, DrawClass.WIRING)
            found[r, t] = whole or bool(np.isin(seen, own.where).any())
    return found


def _sites(case: Case, drawn: DrawClass) -> Sites:
    """Where events of the class may stand: on lines that have its phases."""
    return case.places[LEAST_PHASES.get(drawn, 1)]


def _open_phase(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    share = case.study.events.open_phase.two_phase_share
    return draw_open_phase(rng, size, case.network, sites.alike, share)


def _open_three(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    return draw_open_three(rng, size, case.network, sites.alike)


def _load_step(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    return draw_load_step(rng, size, case.network, sites.regions, _step_law(case))


def _step_law(case: Case) -> LoadStepLaw:
    own = case.study.events.load_step
    return LoadStepLaw(kw=own.kw, single_phase_share=own.single_phase_share, exponent=own.exponent)


def _source_step(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    return draw_source_step(rng, size, case.network, case.study.events.source_step.pct)


def _capacitor_step(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    own = case.study.events.capacitor_step
    return draw_capacitor_step(rng, size, case.network, sites.regions, own.kvar, own.delta_share)


def _motor_start(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    own = case.study.events.motor_start
    law = MotorStartLaw(kva=own.kva, times=own.times, power_factor=own.power_factor)
    return draw_motor_start(rng, size, case.network, sites.regions, law)


def _regulator_tap(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    own = case.study.events.regulator_tap
    return draw_regulator_tap(rng, size, case.network, own.taps, own.single_phase_share)


def _earth_fault(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    ohm = case.study.events.earth_fault.ohm
    return draw_earth_fault(rng, size, case.network, sites.regions, ohm)


def _line_fault(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    own = case.study.events.line_fault
    return draw_line_fault(rng, size, case.network, sites.regions, own.ohm, own.earth_share)


def _nothing(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    return no_event(case.network, size)


def _der_trip(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    return draw_der_trip(rng, size, case.network, case.study.events.der_trip.share)


def _der_ramp(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    return draw_der_ramp(rng, size, case.network, case.study.events.der_ramp.factor)


def _energisation(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    return draw_energisation(rng, size, case.network, sites.regions)


def _reclosing(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    cold_load = case.study.events.reclosing.cold_load
    return draw_reclosing(rng, size, case.network, sites.regions, cold_load)


def _single_pole(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    share = case.study.events.single_pole.two_phase_share
    return draw_single_pole(rng, size, case.network, sites.regions, share)


def _fallen_source_side(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    ohm = case.study.events.fallen_source_side.ohm
    return draw_fallen_source_side(rng, size, case.network, sites.regions, ohm)


def _fallen_load_side(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    ohm = case.study.events.fallen_load_side.ohm
    return draw_fallen_load_side(rng, size, case.network, sites.regions, ohm)


def _open_with_load_step(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    events = case.study.events
    law = OpenWithLoadStepLaw(
        two_phase_share=events.open_phase.two_phase_share,
        kw=events.open_with_load_step.kw,
        single_phase_share=events.load_step.single_phase_share,
    )
    return draw_open_with_load_step(rng, size, case.network, sites.regions, law)


def _open_with_der_trip(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    events = case.study.events
    two, share = events.open_phase.two_phase_share, events.open_with_der_trip.share
    return draw_open_with_der_trip(rng, size, case.network, sites.regions, two, share)


def _load_swap(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    own = case.study.events.load_swap
    single = case.study.events.load_step.single_phase_share
    law = LoadSwapLaw(kw=own.kw, ratio=own.ratio, single_phase_share=single)
    return draw_load_swap(rng, size, case.network, sites.regions, law)


def _step_with_tap(rng: np.random.Generator, case: Case, sites: Sites, size: int) -> Event:
    own, step = case.study.events.step_with_tap, case.study.events.load_step
    law = LoadStepLaw(kw=own.kw, single_phase_share=step.single_phase_share, exponent=step.exponent)
    return draw_step_with_tap(rng, size, case.network, sites.regions, law, own.pct)


_DRAWS: dict[DrawClass, _Draw] = {
    DrawClass.OPEN_PHASE: _open_phase,
    DrawClass.LOAD_STEP: _load_step,
    DrawClass.SOURCE_STEP: _source_step,
    DrawClass.OPEN_THREE: _open_three,
    DrawClass.CAPACITOR_STEP: _capacitor_step,
    DrawClass.MOTOR_START: _motor_start,
    DrawClass.REGULATOR_TAP: _regulator_tap,
    DrawClass.EARTH_FAULT: _earth_fault,
    DrawClass.LINE_FAULT: _line_fault,
    DrawClass.TIE_SWITCHING: _nothing,
    DrawClass.TRANSFER: _nothing,
    DrawClass.DER_TRIP: _der_trip,
    DrawClass.DER_RAMP: _der_ramp,
    DrawClass.ENERGISATION: _energisation,
    DrawClass.RECLOSING: _reclosing,
    DrawClass.SINGLE_POLE: _single_pole,
    DrawClass.FALLEN_SOURCE_SIDE: _fallen_source_side,
    DrawClass.FALLEN_LOAD_SIDE: _fallen_load_side,
    DrawClass.OPEN_WITH_LOAD_STEP: _open_with_load_step,
    DrawClass.OPEN_WITH_DER_TRIP: _open_with_der_trip,
    DrawClass.LOAD_SWAP: _load_swap,
    DrawClass.STEP_WITH_TAP: _step_with_tap,
    DrawClass.WIRING: _load_step,
}
