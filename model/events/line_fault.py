"""Two phases touch each other somewhere on a line; the conductors stay whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .base import Event, Places, draw_place, no_event
from .phases import draw_pair, row_flags
from .shunts import LEAST_OHM, Shunt, each_way, put

__all__ = ["draw_line_fault"]


def draw_line_fault(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    ohm: Distribution,
    earth_share: float,
) -> Event:
    """``ohm`` between two phases and, with probability ``earth_share``, from either to earth too.

    The fault appears or, as likely, clears; every region is as likely, and every pair of the
    phases that the line has. ``regions`` are of lines with two at least.
    """
    edge, share = draw_place(rng, size, regions)
    y = (1.0 / np.maximum(ohm.draw(rng, size), LEAST_OHM)).astype(np.complex128)
    pair = row_flags(draw_pair(rng, network.tree.phases[edge]))  # a-b, b-c, c-a
    earthed = rng.random(size) < earth_share
    touched = pair | np.roll(pair, 1, axis=0)  # pair k joins phases k and k + 1
    fault = Shunt(earth_s=np.where(touched & earthed, y, 0j), between_s=np.where(pair, y, 0j))
    before, after = each_way(rng, fault)
    return put(replace(no_event(network, size), edge=edge, share=share), before, after)
