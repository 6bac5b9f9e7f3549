"""A voltage regulator changes taps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..distributions import Distribution
from ..network import Network
from .base import Event, no_event
from .phases import draw_phase, row_flags

__all__ = ["draw_regulator_tap"]


def draw_regulator_tap(
    rng: np.random.Generator,
    size: int,
    network: Network,
    taps: Distribution,
    single_phase_share: float,
) -> Event:
    """One regulator moves by ``taps``: one phase that often, else all that it has alike.

    Every regulator is as likely, and every phase of it; those that step together always do. The
    event is at its edge. Raises ValueError for a network without regulators.
    """
    count = len(network.regulators)
    if count == 0:
        raise ValueError("regulator taps: the network has 0 regulators, wanted at least 1")
    which = rng.integers(count, size=size)
    moves = taps.draw(rng, size)
    there = network.ratio_phases[which]
    phase = row_flags(draw_phase(rng, there))
    together = (rng.random(size) >= single_phase_share) | network.ratio_gang[which]
    phase |= together & (there >> np.arange(3)[:, None] & 1 > 0)
    moved = phase & (which == np.arange(count)[:, None, None])
    edges = np.array([np.flatnonzero(network.tree.regulator == r)[0] for r in range(count)])
    return replace(
        no_event(network, size),
        at_edge=edges[which],
        tap_factor=_ratio_factor(network, moved * moves),
    )


def _ratio_factor(network: Network, moves: NDArray[np.float64]) -> NDArray[np.float64]:
    """(R, 3, S) new over old ratio, ``moves`` taps on; a tap adds to the to-end's voltage.

    Where a phase would pass its end stop, the move is the other way, as far as it goes.
    """
    upward, step = network.ratio_upward[:, None, None], network.ratio_step[:, None, None]
    most = network.ratio_most[:, None, None]
    old = network.ratio[:, :, None]
    tap = np.rint((np.where(upward, old, 1.0 / old) - 1.0) / step)
    beyond = (np.abs(tap + moves) > most).any(axis=(0, 1))
    boost = 1.0 + np.clip(tap + np.where(beyond, -moves, moves), -most, most) * step
    return np.asarray(np.where(upward, boost, 1.0 / boost) / old)
