"""A load step and a source step within one ΔT."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .base import Event, Places
from .load_step import LoadStepLaw, draw_load_step

__all__ = ["draw_step_with_tap"]


def draw_step_with_tap(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    step: LoadStepLaw,
    pct: Distribution,
) -> Event:
    """A load step, while the EMF changes by ``pct`` percent of what it was."""
    event = draw_load_step(rng, size, network, regions, step)
    return replace(event, emf_factor=1.0 + pct.draw(rng, size) / 100.0)
