"""Phases that were open are closed one by one: fuses, cut-outs, single-phase reclosers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..network import Network
from .base import Event, Places, draw_place, no_event
from .phases import draw_mask

__all__ = ["draw_single_pole"]


def draw_single_pole(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    two_phase_share: float,
) -> Event:
    """One phase closes, or two with probability ``two_phase_share``; every region as likely.

    Only closings: a pole that opens is an open phase, electrically and in ``open_phase``.
    """
    edge, share = draw_place(rng, size, regions)
    mask = draw_mask(rng, network.tree.phases[edge], two_phase_share)
    return replace(no_event(network, size), edge=edge, share=share, open_before=mask)
