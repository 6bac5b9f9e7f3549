"""Merged buses change nothing: every answer is that of the network with all its buses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from oracles.random_happenings import random_happening
from oracles.random_mixed import random_mixed_feeder

from openphase.model.errors import InputError
from openphase.model.leaps import with_leaps
from openphase.model.network import Network, compile_network
from openphase.model.parts import Feeder, Line
from openphase.model.solve import solve, steady_state
from openphase.model.states import NOT_CONVERGED, Answer, Probes, State

FEEDERS = 80
TOLERANCE_PU = 1e-9


def with_chains(rng: np.random.Generator, feeder: Feeder) -> Feeder:
    """Lines cut into several by buses without anything, and some with a twig there."""
    lines: list[Line] = []
    tied = {place for point in feeder.points for place in (point.line,)}
    tied |= {part.place.line for part in (*feeder.capacitors, *feeder.transformers)}
    tied |= {part.place.line for part in (*feeder.loads, *feeder.ders) if part.place is not None}
    for line in feeder.lines:
        pieces = int(rng.integers(1, 5))
        if line.name in tied or pieces == 1:
            lines.append(line)
            continue
        buses = [line.from_bus, *(f"{line.name}.{n}" for n in range(1, pieces)), line.to_bus]
        shares = rng.dirichlet(np.ones(pieces))
        for n, share in enumerate(shares):
            ends = {"from_bus": buses[n], "to_bus": buses[n + 1]}
            if rng.random() < 0.3:
                ends = {"from_bus": buses[n + 1], "to_bus": buses[n]}
            km = line.length_km * float(share)
            lines.append(replace(line, name=f"{line.name}/{n}", length_km=km, **ends))
        if rng.random() < 0.4:
            far = f"{line.name}.twig"
            twig = replace(line, name=f"{line.name}/twig", from_bus=buses[1], to_bus=far)
            lines += [twig, replace(twig, name=f"{twig.name}/2", from_bus=far, to_bus=f"{far}.2")]
    return replace(feeder, lines=tuple(lines))


def cases() -> Iterator[tuple[Feeder, Network, State]]:
    """Feeders with chains, each before and after something happened."""
    for seed in range(FEEDERS):
        rng = np.random.default_rng([seed, 71])
        loops = int(rng.choice([0, 1, 2]))
        feeder = with_chains(rng, random_mixed_feeder(rng, int(rng.integers(3, 12)), loops))
        closed = frozenset(switch.name for switch in feeder.switches)
        try:
            network = compile_network(feeder, closed)
        except InputError:
            continue
        before = steady_state(network)
        yield feeder, network, before
        for _ in range(3):
            event = random_happening(rng, feeder, network).event
            yield feeder, network, happened(before, event)
