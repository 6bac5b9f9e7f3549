"""The source voltage changes: a tap change, or a disturbance upstream of the feeder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .base import Event, no_event

__all__ = ["draw_source_step"]


def draw_source_step(
    rng: np.random.Generator, size: int, network: Network, pct: Distribution
) -> Event:
    """All three phases of the EMF change together, by ``pct`` percent of what it was."""
    return replace(no_event(network, size), emf_factor=1.0 + pct.draw(rng, size) / 100.0)
