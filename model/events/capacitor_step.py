"""A capacitor bank is switched on or off somewhere on a line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .base import Event, Places, draw_place, no_event
from .shunts import between_phases, each_way, put, spot_on, to_earth, where

__all__ = ["draw_capacitor_step"]


def draw_capacitor_step(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    kvar: Distribution,
    delta_share: float,
) -> Event:
    """A balanced bank of ``kvar``, on or off as likely; every region as likely.

    It is a delta with probability ``delta_share``, and always without a neutral; a grounded wye
    otherwise. ``regions`` are of three-phase lines.
    """
    edge, share = draw_place(rng, size, regions)
    each = np.tile(-1j * kvar.draw(rng, size) * 1000.0 / 3.0, (3, 1))
    spot = spot_on(network, edge)
    delta = (rng.random(size) < delta_share) | spot.between
    bank = where(delta, between_phases(spot, each), to_earth(spot, each))
    before, after = each_way(rng, bank)
    return put(replace(no_event(network, size), edge=edge, share=share), before, after)
