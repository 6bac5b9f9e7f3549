"""A conductor breaks, and one of its ends falls to the ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..distributions import Distribution
from ..network import Network
from .base import Event, Places, draw_place, no_event
from .phases import draw_phase, row_flags
from .shunts import LEAST_OHM

__all__ = ["draw_fallen_load_side", "draw_fallen_source_side"]


def draw_fallen_source_side(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    ohm: Distribution,
) -> Event:
    """The end towards the source lies on the ground: ``ohm`` to earth at p.

    One phase of the line's, each as likely, and every region as likely.
    """
    event, to_earth_s = _draw_broken(rng, size, network, regions, ohm)
    return replace(event, earth_after_s=to_earth_s)


def draw_fallen_load_side(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    ohm: Distribution,
) -> Event:
    """The end away from the source lies on the ground: ``ohm`` to earth at q; else as above."""
    event, to_earth_s = _draw_broken(rng, size, network, regions, ohm)
    return replace(event, fallen_after_s=to_earth_s)


def _draw_broken(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    ohm: Distribution,
) -> tuple[Event, NDArray[np.complex128]]:
    """One open phase, and (3, S) the admittance of its contact with the ground."""
    edge, share = draw_place(rng, size, regions)
    phase = draw_phase(rng, network.tree.phases[edge])
    y = 1.0 / np.maximum(ohm.draw(rng, size), LEAST_OHM)
    to_earth_s = np.where(row_flags(phase), y, 0j)
    event = replace(no_event(network, size), edge=edge, share=share, open_after=1 << phase)
    return event, to_earth_s
