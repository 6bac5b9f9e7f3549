"""Conductors break: one, two or all three phases open at a place on a line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..network import Network
from .base import Event, Places, no_event

__all__ = ["THREE_PHASES", "draw_open_phase", "draw_open_three", "draw_phases"]

ONE_PHASE = np.array([0b001, 0b010, 0b100], np.int64)
TWO_PHASES = np.array([0b011, 0b110, 0b101], np.int64)
THREE_PHASES = 0b111


def draw_phases(rng: np.random.Generator, size: int, two_phase_share: float) -> NDArray[np.int64]:
    """(S,) masks of one phase, or of two that often; which ones is equally likely."""
    which = rng.integers(3, size=size)
    two = rng.random(size) < two_phase_share
    return np.where(two, TWO_PHASES[which], ONE_PHASE[which])


def draw_open_phase(
    rng: np.random.Generator, size: int, network: Network, places: Places, two_phase_share: float
) -> Event:
    """One phase, or two with probability ``two_phase_share``; uniform in length."""
    edge, share = places.draw(rng, size)
    mask = draw_phases(rng, size, two_phase_share)
    return replace(no_event(network, size), edge=edge, share=share, open_after=mask)


def draw_open_three(rng: np.random.Generator, size: int, network: Network, places: Places) -> Event:
    """All three phases, uniform in length: a loss of supply, told apart from open phases."""
    edge, share = places.draw(rng, size)
    mask = np.full(size, THREE_PHASES, np.int64)
    return replace(no_event(network, size), edge=edge, share=share, open_after=mask)
