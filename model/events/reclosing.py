"""A part of the feeder is energised again, and all its loads want to run at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .along import fed_through
from .base import Event, Places
from .energisation import draw_energisation

__all__ = ["draw_reclosing"]


def draw_reclosing(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    cold_load: Distribution,
) -> Event:
    """An energisation after which the loads beyond take ``cold_load`` times as much.

    Thermostats have all come to call meanwhile: cold-load pickup, one factor for all loads
    that had no supply.
    """
    event = draw_energisation(rng, size, network, regions)
    dead = fed_through(network, event.edge, network.load_node)
    factor = cold_load.draw(rng, size)
    return replace(event, load_factor=np.where(dead, factor, 1.0))
