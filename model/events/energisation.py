"""A part of the feeder that was dead is energised: all its phases close at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..network import Network
from .along import fed_through
from .base import Event, Places, draw_place, no_event
from .der_units import der_nodes

__all__ = ["draw_energisation"]


def draw_energisation(
    rng: np.random.Generator, size: int, network: Network, regions: Sequence[Places]
) -> Event:
    """All phases of a line close somewhere on it; every region is as likely.

    What is beyond takes at once what it took when the network was whole; magnetizing inrush
    is not modelled. DER beyond stay disconnected: they wait for a steady voltage first.
    """
    edge, share = draw_place(rng, size, regions)
    dead = fed_through(network, edge, der_nodes(network))
    return replace(
        no_event(network, size),
        edge=edge,
        share=share,
        open_before=network.tree.phases[edge],
        der_factor=np.where(dead, 0.0, 1.0),
    )
