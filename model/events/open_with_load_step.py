"""A break, and a load step elsewhere, within one ΔT."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .along import draw_node
from .base import Event, Places, draw_place, no_event
from .phases import draw_mask
from .shunts import each_way, load, phase_shares, put_far, spot_at

__all__ = ["OpenWithLoadStepLaw", "draw_open_with_load_step"]


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenWithLoadStepLaw:
    """How many phases break, how large the load is, and on how many phases."""

    two_phase_share: float  #: the rest of the breaks open one
    kw: Distribution  #: of the load at nominal voltage, all phases together
    single_phase_share: float  #: the rest of the loads are balanced


def draw_open_with_load_step(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    law: OpenWithLoadStepLaw,
) -> Event:
    """The event stands at the break; the load is at a node, on or off as likely.

    It is constant impedance at unity power factor. For either place every region is as likely.
    """
    edge, share = draw_place(rng, size, regions)
    mask = draw_mask(rng, network.tree.phases[edge], law.two_phase_share)
    event = replace(no_event(network, size), edge=edge, share=share, open_after=mask)
    node = draw_node(rng, size, network, regions)
    watts = law.kw.draw(rng, size) * 1000.0
    spot = spot_at(network, node)
    shares = phase_shares(rng, spot, law.single_phase_share)
    before, after = each_way(rng, load(spot, (shares * watts).astype(np.complex128)))
    return put_far(event, node, before, after)
