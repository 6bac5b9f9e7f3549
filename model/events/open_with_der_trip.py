"""A break, upon which DER trip within the same ΔT."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .base import Event, Places, draw_place, no_event
from .der_units import draw_tripped
from .phases import draw_mask

__all__ = ["draw_open_with_der_trip"]


def draw_open_with_der_trip(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    two_phase_share: float,
    share: Distribution,
) -> Event:
    """One phase opens, or two with probability ``two_phase_share``; every region as likely.

    ``share`` of the DER trip, one at least, wherever they stand. Raises ValueError for a
    network without DER.
    """
    edge, along = draw_place(rng, size, regions)
    mask = draw_mask(rng, network.tree.phases[edge], two_phase_share)
    _, tripped = draw_tripped(rng, size, network, share)
    return replace(
        no_event(network, size),
        edge=edge,
        share=along,
        open_after=mask,
        der_factor=np.where(tripped, 0.0, 1.0),
    )
