"""DER trip: what they delivered is gone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .base import Event, no_event
from .der_units import draw_tripped

__all__ = ["draw_der_trip"]


def draw_der_trip(
    rng: np.random.Generator, size: int, network: Network, share: Distribution
) -> Event:
    """``share`` of the DER trip, one at least.

    It is at the node of one of them. Raises ValueError for a network without DER.
    """
    node, tripped = draw_tripped(rng, size, network, share)
    return replace(
        no_event(network, size),
        at_node=node,
        der_factor=np.where(tripped, 0.0, 1.0),
    )
