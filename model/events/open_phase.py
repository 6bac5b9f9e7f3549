"""Conductors break: one, two or all three phases open at a place on a line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .base import Event, Places, no_event

__all__ = ["draw_open_phase", "draw_open_three"]

ONE_PHASE = np.array([0b001, 0b010, 0b100])
TWO_PHASES = np.array([0b011, 0b110, 0b101])
THREE_PHASES = 0b111


def draw_open_phase(
    rng: np.random.Generator, size: int, places: Places, two_phase_share: float
) -> Event:
    """One phase, or two with probability ``two_phase_share``; which ones is equally likely."""
    edge, share = places.draw(rng, size)
    which = rng.integers(3, size=size)
    two = rng.random(size) < two_phase_share
    mask = np.where(two, TWO_PHASES[which], ONE_PHASE[which])
    return replace(no_event(size), edge=edge, share=share, open_mask=mask)


def draw_open_three(rng: np.random.Generator, size: int, places: Places) -> Event:
    """All three phases: a loss of supply, told apart from open phases."""
    edge, share = places.draw(rng, size)
    return replace(no_event(size), edge=edge, share=share, open_mask=np.full(size, THREE_PHASES))
