"""A large motor starts somewhere on a line, or has just run up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..distributions import Distribution
from ..network import Network
from .base import Event, Places, draw_place, no_event
from .shunts import Shunt, Spot, between_phases, no_shunt, put, spot_on, where

__all__ = ["RUNNING_POWER_FACTOR", "MotorStartLaw", "draw_motor_start"]

RUNNING_POWER_FACTOR = 0.85  #: a usual nameplate value: what is left once the start is over


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorStartLaw:
    """How large the motor is, and what it takes while it starts."""

    kva: Distribution  #: rating
    times: Distribution  #: starting current over rated current
    power_factor: Distribution  #: while it starts


def draw_motor_start(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    law: MotorStartLaw,
) -> Event:
    """From nothing to the starting current or, as likely, from that to the rated one.

    A motor has no neutral, and at standstill the same impedance to either rotation of the
    field: a balanced delta. A start is long against the time between two frames, so its
    begin and its end are events of their own. Every region is as likely; they are of
    three-phase lines.
    """
    edge, share = draw_place(rng, size, regions)
    va = law.kva.draw(rng, size) * 1000.0
    times = law.times.draw(rng, size)
    spot = spot_on(network, edge)
    starting = _motor(spot, va * times, law.power_factor.draw(rng, size))
    running = _motor(spot, va, np.full(size, RUNNING_POWER_FACTOR))
    runs_up = rng.random(size) < 0.5
    return put(
        replace(no_event(network, size), edge=edge, share=share),
        where(runs_up, starting, no_shunt(size)),
        where(runs_up, running, starting),
    )


def _motor(spot: Spot, va: NDArray[np.float64], power_factor: NDArray[np.float64]) -> Shunt:
    drawn = va * (power_factor + 1j * np.sqrt(1.0 - power_factor**2))
    return between_phases(spot, np.tile(drawn / 3.0, (3, 1)))
