"""Conductors break: one, two or all three phases open at a place on a line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..network import Network
from .base import Event, Places, draw_place, no_event
from .phases import THREE_PHASES, draw_mask

__all__ = ["draw_open_phase", "draw_open_three"]


def draw_open_phase(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    two_phase_share: float,
) -> Event:
    """One phase, or two with probability ``two_phase_share``; every region is as likely.

    Of the phases that the line has, each as likely; of one phase it is that one.
    """
    edge, share = draw_place(rng, size, regions)
    mask = draw_mask(rng, network.tree.phases[edge], two_phase_share)
    return replace(no_event(network, size), edge=edge, share=share, open_after=mask)


def draw_open_three(
    rng: np.random.Generator, size: int, network: Network, regions: Sequence[Places]
) -> Event:
    """All three phases: a loss of supply, told apart from open phases.

    Every region is as likely; they are of three-phase lines.
    """
    edge, share = draw_place(rng, size, regions)
    mask = np.full(size, THREE_PHASES, np.int64)
    return replace(no_event(network, size), edge=edge, share=share, open_after=mask)
