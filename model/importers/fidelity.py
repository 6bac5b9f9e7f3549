"""How near an imported feeder comes to OpenDSS's own solution of the same circuit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..network import compile_network
from ..solve import solve, steady_state
from ..states import NOT_CONVERGED, UNEARTHED
from .dss_engine import solved_volts, tell
from .dss_feeder import Imported

__all__ = ["Difference", "differences"]

_MODES = ("snap", "direct")

_DEAD_PU = 1e-6
"""Below it both sides agree that a conductor has no voltage."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """Voltages of all nodes with one kind of loads: ours against OpenDSS's.

    ``snap``: each load by its own law; ``direct``: each its nominal admittance. A bus whose
    common mode nothing determines is compared between phases, and counted as floating.
    """

    mode: str
    largest_pu: float
    bus: str
    phase: str
    nodes: int
    floating: int
    dead: int
    converged: bool
    opendss_converged: bool
    lowest_pu: float
    highest_pu: float


def differences(imported: Imported) -> tuple[Difference, ...]:
    """Solve the feeder here and in OpenDSS, its controls off, and compare every node."""
    tell(imported.engine, _as_imported(imported))
    return tuple(_difference(imported, mode) for mode in _MODES)


def _as_imported(imported: Imported) -> Iterator[str]:
    """Yield commands that bring the engine's circuit into the state that was imported."""
    for element in imported.dropped:
        yield f'Disable "{element}"'
    for unit in imported.circuit.transformers:
        for n, winding in enumerate(unit.windings, start=1):
            yield f'Edit "Transformer.{unit.name}" Wdg={n} Tap={winding.tap:.12g}'
    for bank in imported.circuit.capacitors:
        states = " ".join(str(state) for state in bank.states)
        yield f'Edit "Capacitor.{bank.name}" States=[{states}]'


def _difference(imported: Imported, mode: str) -> Difference:
    """Compare one kind of loads."""
    feeder = imported.feeder
    network = compile_network(feeder, frozenset(s.name for s in feeder.switches if s.closed))
    state = steady_state(network)
    if mode == "direct":
        state = state._replace(exponent=np.full_like(state.exponent, 2.0))
    answer = solve(network, state)
    volts, opendss_converged = solved_volts(imported.engine, mode=mode)
    unearthed = bool(int(answer.flags[0]) & UNEARTHED)
    named: dict[str, list[tuple[int, complex]]] = {}
    for (bus, node), value in volts.items():
        if bus in imported.buses and node in (1, 2, 3):
            named.setdefault(imported.buses[bus], []).append((node - 1, value))
    largest, where = 0.0, ("", "")
    counts = {"nodes": 0, "floating": 0, "dead": 0}
    levels: list[float] = []
    for bus, theirs in named.items():
        k = network.node(bus)
        there = [(p, v) for p, v in theirs if int(network.node_phases[k]) >> p & 1]
        nominal = float(network.node_v[k])
        ours = np.array([answer.v[k, p, 0] for p, _ in there])
        wanted = np.array([v for _, v in there])
        counts["nodes"] += len(there)
        if not len(there):
            continue
        gap = np.abs(ours - wanted) / nominal
        if unearthed and len(there) > 1 and float(gap.max()) > _DEAD_PU:
            apart = (ours - ours.mean()) - (wanted - wanted.mean())
            spread = np.abs(apart) / nominal
            if float(spread.max()) < 0.1 * float(gap.max()):
                gap = spread
                counts["floating"] += len(there)
        dead = np.abs(wanted) / nominal < _DEAD_PU
        counts["dead"] += int(dead.sum())
        levels += [float(abs(v)) / nominal for v in ours[~dead]]
        worst = int(np.argmax(gap))
        if not float(gap[worst]) <= largest:
            largest, where = float(gap[worst]), (bus, "abc"[there[worst][0]])
    return Difference(
        mode=mode,
        largest_pu=largest,
        bus=where[0],
        phase=where[1],
        nodes=counts["nodes"],
        floating=counts["floating"],
        dead=counts["dead"],
        converged=not int(answer.flags[0]) & NOT_CONVERGED,
        opendss_converged=opendss_converged,
        lowest_pu=min(levels, default=0.0),
        highest_pu=max(levels, default=0.0),
    )
