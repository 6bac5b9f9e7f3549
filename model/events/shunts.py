"""What is switched on or off at a place: admittances to earth and between the phases."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..network import Network
from .base import Event
from .phases import THREE_PHASES, count_phases, draw_row, row_flags

__all__ = [
    "LEAST_OHM",
    "Shunt",
    "Spot",
    "between_phases",
    "each_way",
    "load",
    "no_shunt",
    "phase_shares",
    "put",
    "put_far",
    "spot_at",
    "spot_on",
    "to_earth",
    "where",
]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Int = NDArray[np.int64]
Bool = NDArray[np.bool_]

LEAST_OHM = 1e-3  #: what a bolted fault counts as: an admittance must be finite


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spot:
    """What there is to connect something to, in each of S scenarios."""

    phases: Int  #: (S,) masks of the phases
    v_nominal_v: Real  #: (S,) phase to earth
    neutral: Bool  #: (S,) there is one

    @property
    def between(self) -> Bool:
        """(S,) loads lie between phases: there is no neutral, but a second phase.

        One conductor alone returns through the earth, whatever feeds it.
        """
        return np.asarray(~self.neutral & (count_phases(self.phases) > 1))


def spot_on(network: Network, edge: Int) -> Spot:
    """The lines on which the events stand, (S,) edges."""
    # a line has the nominal voltage of either end
    lower = np.append(np.arange(len(network.nodes)), network.tree.tail)[edge]
    return Spot(
        phases=network.tree.phases[edge],
        v_nominal_v=network.node_v[lower],
        neutral=network.neutral[lower],
    )


def spot_at(network: Network, node: Int) -> Spot:
    """The nodes of second places, (S,)."""
    return Spot(
        phases=network.node_phases[node],
        v_nominal_v=network.node_v[node],
        neutral=network.neutral[node],
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shunt:
    """Admittances at one place in each of S scenarios, siemens at nominal voltage."""

    earth_s: Complex  #: (3, S) phases a, b, c to earth
    between_s: Complex  #: (3, S) between a-b, b-c, c-a


def no_shunt(size: int) -> Shunt:
    """Nothing connected."""
    nothing = np.zeros((3, size), np.complex128)
    return Shunt(earth_s=nothing, between_s=nothing)


def to_earth(spot: Spot, va: Complex) -> Shunt:
    """Grounded wye: ``va`` (3, S) is P + jQ of each phase at nominal voltage."""
    y = va.conj() / spot.v_nominal_v**2
    return Shunt(earth_s=y, between_s=np.zeros_like(y))


def between_phases(spot: Spot, va: Complex) -> Shunt:
    """Delta: ``va`` (3, S) is P + jQ between a-b, b-c, c-a at nominal voltage."""
    y = va.conj() / (3.0 * spot.v_nominal_v**2)
    return Shunt(earth_s=np.zeros_like(y), between_s=y)


def load(spot: Spot, va: Complex) -> Shunt:
    """``va`` (3, S) from each phase to the neutral, or, without one, from each to the next."""
    return where(spot.between, between_phases(spot, va), to_earth(spot, va))


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


def phase_shares(rng: np.random.Generator, spot: Spot, single_phase_share: float) -> Real:
    """(3, S) shares of a load: all of it on one phase that often, else a third on each.

    Where there are fewer than three phases, it is on one always. Rows are phases, or pairs of
    them where ``spot.between``.
    """
    alone = row_flags(draw_row(rng, spot.phases, spot.between))
    single = rng.random(spot.phases.size) < single_phase_share
    return np.where(single | (spot.phases != THREE_PHASES), alone, 1.0 / 3.0)
