"""Every class of events with plain laws, ready to draw, and what of an event it touches."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from oracles.event_sites import Site

from openphase.model.distributions import Uniform, Values
from openphase.model.events.base import Event
from openphase.model.events.capacitor_step import draw_capacitor_step
from openphase.model.events.der_ramp import draw_der_ramp
from openphase.model.events.der_trip import draw_der_trip
from openphase.model.events.earth_fault import draw_earth_fault
from openphase.model.events.energisation import draw_energisation
from openphase.model.events.fallen import draw_fallen_load_side, draw_fallen_source_side
from openphase.model.events.line_fault import draw_line_fault
from openphase.model.events.load_step import LoadStepLaw, draw_load_step
from openphase.model.events.load_swap import LoadSwapLaw, draw_load_swap
from openphase.model.events.motor_start import MotorStartLaw, draw_motor_start
from openphase.model.events.open_phase import draw_open_phase, draw_open_three
from openphase.model.events.open_with_der_trip import draw_open_with_der_trip
from openphase.model.events.open_with_load_step import (
    OpenWithLoadStepLaw,
    draw_open_with_load_step,
)
from openphase.model.events.reclosing import draw_reclosing
from openphase.model.events.regulator_tap import draw_regulator_tap
from openphase.model.events.single_pole import draw_single_pole
from openphase.model.events.source_step import draw_source_step
from openphase.model.events.step_with_tap import draw_step_with_tap

__all__ = ["DRAWS", "KW", "LOAD_STEP", "OHM", "ON_REGIONS", "PCT", "TOUCHED", "draw"]

KW = Uniform(low=10.0, high=500.0)
OHM = Uniform(low=1.0, high=100.0)
PCT = Uniform(low=-5.0, high=5.0)
SHARE = Uniform(low=0.0, high=1.0)
LOAD_STEP = LoadStepLaw(kw=KW, single_phase_share=0.3, exponent=Uniform(low=0.5, high=1.5))
MOTOR = MotorStartLaw(
    kva=Uniform(low=50.0, high=300.0),
    times=Uniform(low=5.0, high=7.0),
    power_factor=Uniform(low=0.2, high=0.4),
)
SWAP = LoadSwapLaw(kw=KW, ratio=Uniform(low=-1.2, high=-0.8), single_phase_share=0.3)
OPEN_WITH_STEP = OpenWithLoadStepLaw(two_phase_share=0.2, kw=KW, single_phase_share=0.3)

Draw = Callable[[np.random.Generator, int, Site], Event]

DRAWS: dict[str, Draw] = {
    "open_phase": lambda rng, n, at: draw_open_phase(rng, n, at.network, at.regions, 0.2),
    "open_three": lambda rng, n, at: draw_open_three(rng, n, at.network, at.regions),
    "load_step": lambda rng, n, at: draw_load_step(rng, n, at.network, at.regions, LOAD_STEP),
    "source_step": lambda rng, n, at: draw_source_step(rng, n, at.network, PCT),
    "capacitor_step": lambda rng, n, at: draw_capacitor_step(
        rng, n, at.network, at.regions, Values(values=(150.0, 300.0, 600.0)), 0.25
    ),
    "motor_start": lambda rng, n, at: draw_motor_start(rng, n, at.network, at.regions, MOTOR),
    "regulator_tap": lambda rng, n, at: draw_regulator_tap(
        rng, n, at.network, Values(values=(-2.0, -1.0, 1.0, 2.0)), 0.3
    ),
    "earth_fault": lambda rng, n, at: draw_earth_fault(rng, n, at.network, at.regions, OHM),
    "line_fault": lambda rng, n, at: draw_line_fault(rng, n, at.network, at.regions, OHM, 0.3),
    "der_trip": lambda rng, n, at: draw_der_trip(rng, n, at.network, SHARE),
    "der_ramp": lambda rng, n, at: draw_der_ramp(rng, n, at.network, Uniform(low=0.7, high=1.3)),
    "energisation": lambda rng, n, at: draw_energisation(rng, n, at.network, at.regions),
    "reclosing": lambda rng, n, at: draw_reclosing(
        rng, n, at.network, at.regions, Uniform(low=1.5, high=3.0)
    ),
    "single_pole": lambda rng, n, at: draw_single_pole(rng, n, at.network, at.regions, 0.2),
    "fallen_source_side": lambda rng, n, at: draw_fallen_source_side(
        rng, n, at.network, at.regions, OHM
    ),
    "fallen_load_side": lambda rng, n, at: draw_fallen_load_side(
        rng, n, at.network, at.regions, OHM
    ),
    "open_with_load_step": lambda rng, n, at: draw_open_with_load_step(
        rng, n, at.network, at.regions, OPEN_WITH_STEP
    ),
    "open_with_der_trip": lambda rng, n, at: draw_open_with_der_trip(
        rng, n, at.network, at.regions, 0.2, SHARE
    ),
    "load_swap": lambda rng, n, at: draw_load_swap(rng, n, at.network, at.regions, SWAP),
    "step_with_tap": lambda rng, n, at: draw_step_with_tap(
        rng, n, at.network, at.regions, LOAD_STEP, PCT
    ),
}

PLACE = {"edge", "share"}
EARTH = {"earth_before_s", "earth_after_s"}
BETWEEN = {"between_before_s", "between_after_s"}
FAR = {"far_node", "far_before_s", "far_after_s"}

#: on four wires; all else is as in no event
TOUCHED: dict[str, set[str]] = {
    "open_phase": PLACE | {"open_after"},
    "open_three": PLACE | {"open_after"},
    "load_step": PLACE | EARTH | {"exponent"},
    "source_step": {"emf_factor"},
    "capacitor_step": PLACE | EARTH | BETWEEN,
    "motor_start": PLACE | BETWEEN,
    "regulator_tap": {"at_edge", "tap_factor"},
    "earth_fault": PLACE | EARTH,
    "line_fault": PLACE | EARTH | BETWEEN,
    "der_trip": {"at_node", "der_factor"},
    "der_ramp": {"der_factor"},
    "energisation": PLACE | {"open_before", "der_factor"},
    "reclosing": PLACE | {"open_before", "der_factor", "load_factor"},
    "single_pole": PLACE | {"open_before"},
    "fallen_source_side": PLACE | {"open_after", "earth_after_s"},
    "fallen_load_side": PLACE | {"open_after", "fallen_after_s"},
    "open_with_load_step": PLACE | FAR | {"open_after"},
    "open_with_der_trip": PLACE | {"open_after", "der_factor"},
    "load_swap": PLACE | EARTH | FAR,
    "step_with_tap": PLACE | EARTH | {"exponent", "emf_factor"},
}

#: those that are as likely in every region
ON_REGIONS = tuple(sorted(set(DRAWS) - {"source_step", "regulator_tap", "der_trip", "der_ramp"}))


def draw(name: str, site: Site, size: int, seed: int = 3) -> Event:
    """Events of a class, always the same ones for the same ``seed``."""
    return DRAWS[name](np.random.default_rng(seed), size, site)
