"""A load is switched on or off somewhere on a line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .base import Event, Places, draw_place, no_event
from .shunts import each_way, load, phase_shares, put, spot_on

__all__ = ["LoadStepLaw", "draw_load_step"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadStepLaw:
    """How large a step is, on how many phases, and how it follows the voltage."""

    kw: Distribution  #: at nominal voltage, all phases together
    single_phase_share: float  #: the rest are balanced
    exponent: Distribution  #: voltage exponent of the load switched


def draw_load_step(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    law: LoadStepLaw,
) -> Event:
    """A load at unity power factor, on or off as likely; every region as likely.

    With a neutral it is grounded wye, on one phase or on three. On three wires it lies between
    two phases or between all of them, and is constant impedance whatever ``law.exponent``. On
    lines of fewer than three phases it is always on one, or between two.
    """
    edge, share = draw_place(rng, size, regions)
    watts = law.kw.draw(rng, size) * 1000.0
    spot = spot_on(network, edge)
    shares = phase_shares(rng, spot, law.single_phase_share)
    before, after = each_way(rng, load(spot, (shares * watts).astype(np.complex128)))
    exponent = law.exponent.draw(rng, size)
    event = replace(
        no_event(network, size),
        edge=edge,
        share=share,
        exponent=np.where(spot.between, 2.0, exponent),
    )
    return put(event, before, after)
