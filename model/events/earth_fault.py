"""One phase touches earth somewhere on a line; the conductors stay whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .base import Event, Places, draw_place, no_event
from .phases import draw_phase, row_flags
from .shunts import LEAST_OHM, Shunt, each_way, put

__all__ = ["draw_earth_fault"]


def draw_earth_fault(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    ohm: Distribution,
) -> Event:
    """A fault of ``ohm`` appears or, as likely, clears.

    Every region is as likely, and every phase that the line has.
    """
    edge, share = draw_place(rng, size, regions)
    y = 1.0 / np.maximum(ohm.draw(rng, size), LEAST_OHM)
    earth = np.where(row_flags(draw_phase(rng, network.tree.phases[edge])), y, 0j)
    fault = Shunt(earth_s=earth, between_s=np.zeros_like(earth))
    before, after = each_way(rng, fault)
    return put(replace(no_event(network, size), edge=edge, share=share), before, after)
