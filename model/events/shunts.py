"""What is switched on or off at a place: admittances to earth and between the phases."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..network import Network
from .base import Event

__all__ = [
    "LEAST_OHM",
    "Shunt",
    "between_phases",
    "each_way",
    "load",
    "no_shunt",
    "one_of_three",
    "phase_shares",
    "put",
    "put_far",
    "to_earth",
    "where",
]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Bool = NDArray[np.bool_]

LEAST_OHM = 1e-3  #: what a bolted fault counts as: an admittance must be finite


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shunt:
    """Admittances at one place in each of S scenarios, siemens at nominal voltage."""

    earth_s: Complex  #: (3, S) phases a, b, c to earth
    between_s: Complex  #: (3, S) between a-b, b-c, c-a


def no_shunt(size: int) -> Shunt:
    """Nothing connected."""
    nothing = np.zeros((3, size), np.complex128)
    return Shunt(earth_s=nothing, between_s=nothing)


def to_earth(network: Network, va: Complex) -> Shunt:
    """Grounded wye: ``va`` (3, S) is P + jQ of each phase at nominal voltage."""
    y = va.conj() / network.tree.v_nominal_v**2
    return Shunt(earth_s=y, between_s=np.zeros_like(y))


def between_phases(network: Network, va: Complex) -> Shunt:
    """Delta: ``va`` (3, S) is P + jQ between a-b, b-c, c-a at nominal voltage."""
    y = va.conj() / (3.0 * network.tree.v_nominal_v**2)
    return Shunt(earth_s=np.zeros_like(y), between_s=y)


def load(network: Network, va: Complex) -> Shunt:
    """``va`` (3, S) from each phase to the neutral, or, without one, from each to the next."""
    return between_phases(network, va) if network.three_wire else to_earth(network, va)


def where(chosen: Bool, one: Shunt, other: Shunt) -> Shunt:
    """``one`` in the scenarios ``chosen`` (S,), ``other`` in the rest."""
    return Shunt(
        earth_s=np.where(chosen, one.earth_s, other.earth_s),
        between_s=np.where(chosen, one.between_s, other.between_s),
    )


def each_way(rng: np.random.Generator, shunt: Shunt) -> tuple[Shunt, Shunt]:
    """``shunt`` before and after: it goes on or off, either as likely."""
    size: int = shunt.earth_s.shape[1]
    on = rng.random(size) < 0.5
    return where(on, no_shunt(size), shunt), where(on, shunt, no_shunt(size))


def put(event: Event, before: Shunt, after: Shunt) -> Event:
    """``event`` with these shunts on the upper side p of its place."""
    return replace(
        event,
        earth_before_s=before.earth_s,
        earth_after_s=after.earth_s,
        between_before_s=before.between_s,
        between_after_s=after.between_s,
    )


def put_far(event: Event, node: NDArray[np.int64], before: Shunt, after: Shunt) -> Event:
    """``event`` with these shunts at ``node``, its second place."""
    return replace(
        event,
        far_node=node,
        far_before_s=before.earth_s,
        far_after_s=after.earth_s,
        far_between_before_s=before.between_s,
        far_between_after_s=after.between_s,
    )


def one_of_three(rng: np.random.Generator, size: int) -> Bool:
    """(3, S) True for one phase of each scenario, every phase as likely."""
    return np.asarray(rng.integers(3, size=size) == np.arange(3)[:, None])


def phase_shares(rng: np.random.Generator, size: int, single_phase_share: float) -> Real:
    """(3, S) shares of a load: all of it on one phase that often, else a third on each."""
    alone = one_of_three(rng, size)
    single = rng.random(size) < single_phase_share
    return np.where(single, alone, 1.0 / 3.0)
