"""DER deliver more or less than before: a cloud comes or goes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .base import Event, no_event
from .der_units import some_der_nodes

__all__ = ["draw_der_ramp"]


def draw_der_ramp(
    rng: np.random.Generator, size: int, network: Network, factor: Distribution
) -> Event:
    """All DER together deliver ``factor`` times as much; the event stands nowhere.

    Raises ValueError for a network without DER.
    """
    count = some_der_nodes(network).size
    alike = np.tile(factor.draw(rng, size), (count, 1))
    return replace(no_event(network, size), der_factor=alike)
