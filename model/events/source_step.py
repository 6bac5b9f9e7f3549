"""The source voltage changes: a tap change, or a disturbance upstream of the feeder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .base import Event, no_event

__all__ = ["draw_source_step"]


def draw_source_step(rng: np.random.Generator, size: int, pct: tuple[float, float]) -> Event:
    """All three phases of the EMF rise or fall together, uniform in ``pct`` percent."""
    return replace(no_event(size), emf_factor=1.0 + rng.uniform(*pct, size) / 100.0)
