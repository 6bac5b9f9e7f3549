"""An event of many scenarios, where it may stand, and how it changes the network's state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..network import Network
from ..states import State

__all__ = ["Event", "Places", "apply_event", "no_event", "places_on"]

Real = NDArray[np.float64]
Int = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Event:
    """One event in each of S scenarios; what does not happen is neutral.

    ``edge`` is -1 where the event stands nowhere on the feeder. A load step is present
    before the event, after it, or both with different size.
    """

    edge: Int  #: (S,)
    share: Real  #: (S,) from the edge's upper end
    open_mask: Int  #: (S,) bit a: phase a opens
    step_before_w: Real  #: (3, S) watts per phase at nominal voltage
    step_after_w: Real  #: (3, S)
    step_exponent: Real  #: (S,)
    emf_factor: Real  #: (S,) on the source EMF after the event


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


def places_on(network: Network, chosen: NDArray[np.bool_] | None = None) -> Places:
    """All line edges of the network, or those where ``chosen`` (edges,) is True."""
    wanted = network.length_km > 0
    if chosen is not None:
        wanted = wanted & chosen
    edges = np.flatnonzero(wanted)
    return Places(edges=edges, length_km=network.length_km[edges])


def no_event(size: int) -> Event:
    """An event in which nothing happens."""
    return Event(
        edge=np.full(size, -1, np.int64),
        share=np.zeros(size),
        open_mask=np.zeros(size, np.int64),
        step_before_w=np.zeros((3, size)),
        step_after_w=np.zeros((3, size)),
        step_exponent=np.full(size, 2.0),
        emf_factor=np.ones(size),
    )


def apply_event(network: Network, before: State, after: State, event: Event) -> tuple[State, State]:
    """The two states with the event between them.

    ``before`` and ``after`` carry what the loads and the source do of their own accord.
    """
    per_watt = 1.0 / network.tree.v_nominal_v**2
    opened = np.where(event.open_mask != 0, event.edge, -1)
    stepped = np.where((event.step_before_w + event.step_after_w).any(axis=0), event.edge, -1)
    return (
        before._replace(
            edge=stepped,
            share=event.share,
            open_mask=np.zeros_like(event.open_mask),
            step_y_s=(event.step_before_w * per_watt).astype(np.complex128),
            step_exponent=event.step_exponent,
        ),
        after._replace(
            emf_pu=after.emf_pu * event.emf_factor,
            edge=np.maximum(opened, stepped),
            share=event.share,
            open_mask=event.open_mask,
            step_y_s=(event.step_after_w * per_watt).astype(np.complex128),
            step_exponent=event.step_exponent,
        ),
    )
