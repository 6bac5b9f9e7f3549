"""DER trip: what they delivered is gone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .along import place_of
from .base import Event, no_event
from .der_units import draw_tripped

__all__ = ["draw_der_trip"]


def draw_der_trip(
    rng: np.random.Generator, size: int, network: Network, share: Distribution
) -> Event:
    """``share`` of the DER trip, one at least.

    The event stands at one of them: at the end of the line that leads to it, or nowhere if
    none does. Raises ValueError for a network without DER.
    """
    node, tripped = draw_tripped(rng, size, network, share)
    edge, along = place_of(network, node)
    return replace(
        no_event(network, size),
        edge=edge,
        share=along,
        der_factor=np.where(tripped, 0.0, 1.0),
    )
