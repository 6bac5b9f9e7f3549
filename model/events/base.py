"""An event of many scenarios, where it may stand, and how it changes the network's state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..network import Network
from ..states import State
from .phases import count_phases

__all__ = ["Event", "Places", "apply_event", "draw_place", "no_event", "places_on"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Int = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Event:
    """One event in each of S scenarios; what does not happen is neutral.

    ``edge`` is -1 where the event stands nowhere on the feeder. What stands on it has two
    sides, p towards the source and q: opened phases between them, admittances to earth and
    between the phases (a-b, b-c, c-a) at p, to earth at q. Pairs have a second place, a node.
    What equipment does by itself is ``at_edge`` (a regulator's) or ``at_node`` (a DER's), which
    says where it happens and changes nothing.
    Admittances are siemens at nominal voltage, before the event and after it.
    """

    edge: Int  #: (S,)
    share: Real  #: (S,) from the edge's upper end
    at_edge: Int  #: (S,) -1: none
    at_node: Int  #: (S,) -1: none
    open_before: Int  #: (S,) bit a: phase a is open
    open_after: Int  #: (S,)
    earth_before_s: Complex  #: (3, S) at p
    earth_after_s: Complex  #: (3, S)
    exponent: Real  #: (S,) voltage exponent of what is at p to earth: 2 constant impedance
    between_before_s: Complex  #: (3, S) at p, constant impedance
    between_after_s: Complex  #: (3, S)
    fallen_after_s: Complex  #: (3, S) at q to earth
    far_node: Int  #: (S,) the second place; -1: none
    far_before_s: Complex  #: (3, S) there to earth, constant impedance
    far_after_s: Complex  #: (3, S)
    far_between_before_s: Complex  #: (3, S) there between the phases
    far_between_after_s: Complex  #: (3, S)
    emf_factor: Real  #: (S,) on the source EMF after the event
    tap_factor: Real  #: (R, 3, S) on the regulators' ratios after it
    load_factor: Real  #: (L, S) on the loads after it
    der_factor: Real  #: (D, S) on what the DER deliver after it; 0: tripped


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Places:
    """Stretches of line on which an event may stand."""

    edges: Int  #: (n,)
    length_km: Real  #: (n,)

    def draw(self, rng: np.random.Generator, size: int) -> tuple[Int, Real]:
        """Edges and shares, uniform in length."""
        stops = np.cumsum(self.length_km)
        along = rng.random(size) * stops[-1]
        pick = np.minimum(np.searchsorted(stops, along, side="right"), stops.size - 1)
        share = 1.0 - (stops[pick] - along) / self.length_km[pick]
        return self.edges[pick], np.clip(share, 0.0, 1.0)


def places_on(
    network: Network, chosen: NDArray[np.bool_] | None = None, least_phases: int = 1
) -> Places:
    """All line edges of the network, or those where ``chosen`` (edges,) is True.

    Lines of fewer than ``least_phases`` are left out.
    """
    wanted = (network.length_km > 0) & (count_phases(network.tree.phases) >= least_phases)
    if chosen is not None:
        wanted = wanted & chosen
    edges = np.flatnonzero(wanted)
    return Places(edges=edges, length_km=network.length_km[edges])


def draw_place(rng: np.random.Generator, size: int, regions: Sequence[Places]) -> tuple[Int, Real]:
    """Edges and shares: every region equally likely, within it uniform in length."""
    region = rng.integers(len(regions), size=size)
    edge = np.empty(size, np.int64)
    share = np.empty(size)
    for n, places in enumerate(regions):
        here = region == n
        edge[here], share[here] = places.draw(rng, int(here.sum()))
    return edge, share


def no_event(network: Network, size: int) -> Event:
    """An event in which nothing happens."""
    nothing = np.zeros((3, size), np.complex128)
    return Event(
        edge=np.full(size, -1, np.int64),
        share=np.zeros(size),
        at_edge=np.full(size, -1, np.int64),
        at_node=np.full(size, -1, np.int64),
        open_before=np.zeros(size, np.int64),
        open_after=np.zeros(size, np.int64),
        earth_before_s=nothing,
        earth_after_s=nothing,
        exponent=np.full(size, 2.0),
        between_before_s=nothing,
        between_after_s=nothing,
        fallen_after_s=nothing,
        far_node=np.full(size, -1, np.int64),
        far_before_s=nothing,
        far_after_s=nothing,
        far_between_before_s=nothing,
        far_between_after_s=nothing,
        emf_factor=np.ones(size),
        tap_factor=_ones(len(network.regulators), 3, size),
        load_factor=_ones(len(network.loads), size),
        der_factor=_ones(len(network.machines.ders), size),
    )


def _ones(*shape: int) -> Real:
    """Factors that change nothing, and take no memory: to be read only."""
    return np.broadcast_to(np.float64(1.0), shape)


def _is_one(factor: Real) -> bool:
    """Whether a factor is what ``_ones`` makes, told without reading it all."""
    return not any(factor.strides) and bool((factor.reshape(-1)[:1] == 1.0).all())


def _times(values: Real, factor: Real) -> Real:
    """The values times their factors; themselves where nothing changes them."""
    return values if _is_one(factor) else values * factor


def apply_event(network: Network, before: State, after: State, event: Event) -> tuple[State, State]:
    """The two states with the event between them.

    ``before`` and ``after`` carry what the loads and the source do of their own accord. What
    DER keep from before the event is filled in once that has been solved
    (``machine_state.carried_over``).
    """
    motor_load = network.machines.motor_load
    motors = slice(0, motor_load.size)
    va, y = after.machine_va, after.machine_y_s
    if motor_load.size and not _is_one(event.load_factor):
        va, y = va.copy(), y.copy()
        va[motors] *= event.load_factor[motor_load]
        y[motors] *= event.load_factor[motor_load][:, None]
    first = before._replace(
        edge=event.edge,
        share=event.share,
        open_mask=event.open_before,
        step_y_s=event.earth_before_s,
        step_exponent=event.exponent,
        between_y_s=event.between_before_s,
        fallen_y_s=np.zeros_like(event.fallen_after_s),
        far_node=event.far_node,
        far_y_s=event.far_before_s,
        far_between_y_s=event.far_between_before_s,
    )
    second = after._replace(
        emf_pu=after.emf_pu * event.emf_factor,
        ratio=_times(after.ratio, event.tap_factor),
        load_scale=_times(after.load_scale, event.load_factor),
        machine_va=va,
        machine_y_s=y,
        edge=event.edge,
        share=event.share,
        open_mask=event.open_after,
        step_y_s=event.earth_after_s,
        step_exponent=event.exponent,
        between_y_s=event.between_after_s,
        fallen_y_s=event.fallen_after_s,
        far_node=event.far_node,
        far_y_s=event.far_after_s,
        far_between_y_s=event.far_between_after_s,
    )
    return first, second
