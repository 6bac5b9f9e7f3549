"""Load goes on at one place and off at another within one ΔT."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..distributions import Distribution
from ..network import Network
from .along import draw_node
from .base import Event, Places, draw_place, no_event
from .phases import count_phases
from .shunts import (
    Spot,
    each_way,
    load,
    no_shunt,
    phase_shares,
    put,
    put_far,
    spot_at,
    spot_on,
    where,
)

__all__ = ["LoadSwapLaw", "draw_load_swap"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadSwapLaw:
    """How large the two steps are, and on how many phases."""

    kw: Distribution  #: of the first at nominal voltage, all phases together
    ratio: Distribution  #: of the second to the first; negative: it goes the other way
    single_phase_share: float  #: on one phase, the same if both places have it; the rest balanced


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
    near, far, apart = _common(spot_on(network, edge), spot_at(network, node))
    watts = law.kw.draw(rng, size) * 1000.0
    shares = phase_shares(rng, near, law.single_phase_share)
    ratio = law.ratio.draw(rng, size)
    before, after = each_way(rng, load(near, (watts * shares).astype(np.complex128)))
    if apart.any():
        shares = np.where(apart, phase_shares(rng, far, law.single_phase_share), shares)
    there = load(far, (np.abs(ratio) * watts * shares).astype(np.complex128))
    # the second step is there after the event where the first is, or where it is not
    stays = after.earth_s.any(axis=0) | after.between_s.any(axis=0)
    stays ^= ratio < 0.0
    nothing = no_shunt(size)
    event = put(replace(no_event(network, size), edge=edge, share=share), before, after)
    return put_far(event, node, where(stays, nothing, there), where(stays, there, nothing))


def _common(near: Spot, far: Spot) -> tuple[Spot, Spot, NDArray[np.bool_]]:
    """Both with the phases that both have, but where (S,) they have none in common to load."""
    both = near.phases & far.phases
    apart = np.where(near.between | far.between, count_phases(both) < 2, both == 0)
    return (
        replace(near, phases=np.where(apart, near.phases, both)),
        replace(far, phases=np.where(apart, far.phases, both)),
        apart,
    )
