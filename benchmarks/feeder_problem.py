"""Mixed events on a shipped feeder: what both engines are given.

Every scenario is a state before and one after: of ten, four break one conductor at the end of a
line, two change one load, one or two put a fault from one phase of a node to earth, as many change
the source, and one changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from openphase.model import load_feeder
from openphase.model.buses import bus_phases
from openphase.model.leaps import with_leaps
from openphase.model.network import Network, compile_network, locate
from openphase.model.parts import Feeder
from openphase.model.phases import letters
from openphase.model.points import find_points, point_probes
from openphase.model.solve import quiet_state
from openphase.model.states import Probes, State

__all__ = ["KINDS", "Events", "FeederProblem", "draw_feeder_problem"]

KINDS = {"open": 0.40, "load step": 0.20, "fault": 0.15, "source step": 0.15, "nothing": 0.10}
FACTORS = (0.3, 1.2)  #: every load's own, in every scenario
STEP_FACTORS = (0.2, 1.8)  #: of the load that steps, times that
SOURCE_FACTORS = (0.97, 1.03)
FAULT_OHM = (1.0, 40.0)

Real = NDArray[np.float64]
Int = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Events:
    """What happens in each of S scenarios; what does not apply there is -1 or 1."""

    kind: Int  #: (S,) index into ``KINDS``
    line: Int  #: (S,) which breaks, at its to-end
    phase: Int  #: (S,) which breaks or is faulted
    bus: Int  #: (S,) which is faulted
    ohm: Real  #: (S,) of the fault
    source: Real  #: (S,) factor on the EMF
    factor: tuple[Real, Real]  #: before, after: (L, S) factor on every load


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FeederProblem:
    """A feeder with its events, as the product's states."""

    feeder: Feeder
    network: Network
    leaping: Network  #: with what nobody looks at passed by
    probes: Probes  #: the measuring points
    events: Events
    before: State
    after: State


def draw_feeder_problem(name: str, linear: bool, size: int) -> FeederProblem:
    """Draw ``size`` scenarios on a shipped feeder, loads by their own laws or linear."""
    feeder = load_feeder(name)
    network = compile_network(feeder)
    probes = point_probes(find_points(feeder, network))
    events = _draw(feeder, np.random.default_rng(4), size)
    before, after = _states(feeder, network, events, linear)
    return FeederProblem(
        feeder=feeder,
        network=network,
        leaping=with_leaps(network, probes),
        probes=probes,
        events=events,
        before=before,
        after=after,
    )


def _draw(feeder: Feeder, rng: np.random.Generator, size: int) -> Events:
    masks = list(bus_phases(feeder).values())
    earthed = _earthed(feeder)
    lines = len(feeder.lines)
    kind = rng.choice(len(KINDS), size, p=list(KINDS.values()))
    opens, steps, faults, sources = (kind == n for n in range(4))
    line = np.where(opens, rng.integers(lines, size=size), -1)
    bus = np.where(faults, rng.choice(earthed, size), -1)
    there = ["abc"] * size
    for s in range(size):
        if opens[s]:
            there[s] = feeder.lines[line[s]].phases
        elif faults[s]:
            there[s] = letters(masks[bus[s]])
    phase = np.array(["abc".index(own[rng.integers(len(own))]) for own in there], np.int64)
    before = rng.uniform(*FACTORS, (len(feeder.loads), size))
    after = before.copy()
    stepped = np.flatnonzero(steps)
    which = rng.integers(len(feeder.loads), size=stepped.size)
    after[which, stepped] *= rng.uniform(*STEP_FACTORS, stepped.size)
    return Events(
        kind=kind,
        line=line,
        phase=phase,
        bus=bus,
        ohm=np.where(faults, rng.uniform(*FAULT_OHM, size), np.inf),
        source=np.where(sources, rng.uniform(*SOURCE_FACTORS, size), 1.0),
        factor=(before, after),
    )


def _earthed(feeder: Feeder) -> list[int]:
    """Buses that are not behind a winding in delta: there OpenDSS gets a phase held."""
    delta = {unit.to_bus for unit in feeder.inline_transformers if unit.connection.endswith("/D")}
    return [n for n, bus in enumerate(bus_phases(feeder)) if bus not in delta]


def _states(feeder: Feeder, network: Network, events: Events, linear: bool) -> tuple[State, State]:
    size = events.kind.size
    exponent = np.repeat(network.exponent[:, None], size, axis=1)
    if linear:
        exponent[:] = 2.0
    before, after = (quiet_state(network, factor, exponent) for factor in events.factor)
    after.emf_pu[:] *= events.source
    ends = [locate(network, line.name, 1.0) for line in feeder.lines]
    for s in np.flatnonzero(events.line >= 0):
        after.edge[s], after.share[s] = ends[events.line[s]]
        after.open_mask[s] = 1 << events.phase[s]
    nodes = np.array([network.node(bus) for bus in bus_phases(feeder)])
    faulted = np.flatnonzero(events.bus >= 0)
    after.far_node[faulted] = nodes[events.bus[faulted]]
    far_y_s: Any = np.zeros((3, size), np.complex128)
    far_y_s[events.phase[faulted], faulted] = 1.0 / events.ohm[faulted]
    return before, after._replace(far_y_s=far_y_s)
