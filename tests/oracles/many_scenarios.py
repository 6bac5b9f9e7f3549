"""States of many scenarios that differ in everything, on a random radial feeder."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from oracles.chains import with_chains
from oracles.random_happenings import random_happening
from oracles.random_mixed import random_mixed_feeder

from openphase.model.errors import InputError
from openphase.model.events.base import apply_event
from openphase.model.network import Network, compile_network
from openphase.model.parts import Feeder
from openphase.model.solve import quiet_state
from openphase.model.states import Probes, State

__all__ = ["Scenes", "chosen_scenarios", "few_probes", "scenes_of"]

Int = NDArray[np.int64]
Real = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scenes:
    """The states before and after the events; what DER keep from before is not filled in."""

    network: Network
    before: State
    after: State
    der_factor: Real  #: (D, S)
    rng: np.random.Generator  #: to go on with


def scenes_of(seed: int, scenarios: int) -> Scenes | None:
    """A feeder with chains, and events of all kinds on it; None: it is refused or has a loop."""
    rng = np.random.default_rng([seed, 91])
    feeder = with_chains(rng, random_mixed_feeder(rng, int(rng.integers(3, 14))))
    closed = frozenset(switch.name for switch in feeder.switches if switch.closed)
    try:
        network = compile_network(feeder, closed)
    except InputError:
        return None
    if network.tree.tail.size:
        return None
    drawn = [_scene(rng, feeder, network) for _ in range(scenarios)]
    before, after = (_joined([scene[n] for scene in drawn]) for n in range(2))
    factor = np.concatenate([scene[2] for scene in drawn], axis=-1)
    return Scenes(network=network, before=before, after=after, der_factor=factor, rng=rng)


def _scene(rng: np.random.Generator, feeder: Feeder, network: Network) -> tuple[State, State, Real]:
    """One scenario: loads by their laws, of constant impedance, by exponents, or mixed."""
    loads = (len(network.loads), 1)
    own, drawn = network.exponent[:, None].copy(), rng.choice([0.0, 1.0, 2.0], loads)
    mixed = np.where(rng.random(loads) < 0.5, own, drawn)
    kinds = (own, np.full(loads, 2.0), rng.uniform(0, 2, loads), mixed)
    state = quiet_state(network, rng.uniform(0, 1.5, loads), kinds[int(rng.integers(4))])
    event = random_happening(rng, feeder, network).event
    return *apply_event(network, state, state, event), event.der_factor


def _joined(states: list[State]) -> State:
    """Side by side."""
    fields = zip(*states, strict=True)
    return State(*(np.concatenate(own, axis=-1) for own in fields))


def chosen_scenarios(state: State, chosen: Int) -> State:
    """Some scenarios of a state, in this order."""
    return State(*(np.ascontiguousarray(own[..., chosen]) for own in state))


def few_probes(rng: np.random.Generator, network: Network) -> Probes:
    """Two nodes, and two edges at either end."""
    return Probes(
        v_node=rng.choice(len(network.nodes), 2),
        i_edge=rng.choice(len(network.pieces), 2).astype(np.int64),
        i_below=rng.random(2) < 0.5,
    )
