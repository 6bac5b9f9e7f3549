"""Conductors break: one, two or all three phases open at a place on a line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..network import Network
from .base import Event, Places, no_event
from .phases import THREE_PHASES, draw_mask

__all__ = ["draw_open_phase", "draw_open_three"]


def draw_open_phase(
    rng: np.random.Generator, size: int, network: Network, places: Places, two_phase_share: float
) -> Event:
    """One phase, or two with probability ``two_phase_share``; uniform in length.

    Of the phases that the line has, each as likely; of one phase it is that one.
    """
    edge, share = places.draw(rng, size)
    mask = draw_mask(rng, network.tree.phases[edge], two_phase_share)
    return replace(no_event(network, size), edge=edge, share=share, open_after=mask)


def draw_open_three(rng: np.random.Generator, size: int, network: Network, places: Places) -> Event:
    """All three phases, uniform in length: a loss of supply, told apart from open phases.

    ``places`` are three-phase lines.
    """
    edge, share = places.draw(rng, size)
    mask = np.full(size, THREE_PHASES, np.int64)
    return replace(no_event(network, size), edge=edge, share=share, open_after=mask)
