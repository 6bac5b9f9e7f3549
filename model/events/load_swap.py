"""Load goes on at one place and off at another within one ΔT."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..distributions import Distribution
from ..network import Network
from .along import draw_node
from .base import Event, Places, draw_place, no_event
from .shunts import each_way, load, no_shunt, phase_shares, put, put_far, where

__all__ = ["LoadSwapLaw", "draw_load_swap"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadSwapLaw:
    """How large the two steps are, and on how many phases."""

    kw: Distribution  #: of the first at nominal voltage, all phases together
    ratio: Distribution  #: of the second to the first; negative: it goes the other way
    single_phase_share: float  #: on one phase, the same for both; the rest are balanced


def draw_load_swap(
    rng: np.random.Generator,
    size: int,
    network: Network,
    regions: Sequence[Places],
    law: LoadSwapLaw,
) -> Event:
    """The event stands at the first step, which goes on or off as likely; the second is at a node.

    Both are constant impedance at unity power factor. For either place every region is as
    likely.
    """
    edge, share = draw_place(rng, size, regions)
    node = draw_node(rng, size, network, regions)
    watts = law.kw.draw(rng, size) * 1000.0 * phase_shares(rng, size, law.single_phase_share)
    ratio = law.ratio.draw(rng, size)
    before, after = each_way(rng, load(network, watts.astype(np.complex128)))
    far = load(network, (np.abs(ratio) * watts).astype(np.complex128))
    # the second step is there after the event where the first is, or where it is not
    stays = after.earth_s.any(axis=0) | after.between_s.any(axis=0)
    stays ^= ratio < 0.0
    nothing = no_shunt(size)
    event = put(replace(no_event(network, size), edge=edge, share=share), before, after)
    return put_far(event, node, where(stays, nothing, far), where(stays, far, nothing))
