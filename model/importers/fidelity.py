"""How near an imported feeder comes to OpenDSS's own solution of the same circuit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..network import compile_network
from ..solve import solve, steady_state
from ..states import NOT_CONVERGED
from .dss_apart import Volts, solve_apart
from .dss_feeder import Imported
from .unearthed import unearthed_buses

__all__ = ["Difference", "differences"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]

_MODES = ("snap", "direct")

_DEAD_PU = 1e-6
"""Below it both sides agree that a conductor has no voltage."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """Voltages of all nodes with one kind of loads: ours against OpenDSS's.

    ``snap``: each load by its own law; ``direct``: each its nominal admittance. Buses that
    nothing but capacitance holds to earth are compared without their common mode, and counted
    as floating: OpenDSS holds them by an admittance of its own.
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
    """Solve the feeder here and in OpenDSS, its controls off, and compare every node.

    With a load multiplier there is no ``direct``, in which OpenDSS leaves it out.
    """
    modes = _MODES if imported.circuit.load_mult == 1.0 else _MODES[:1]
    source = imported.feeder.imported_from or ""
    theirs = solve_apart(imported.script, source, list(_as_imported(imported)), modes)
    return tuple(_difference(imported, mode, theirs[mode]) for mode in modes)


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
    # the engine puts what a fuse or recloser switches back into its normal state
    guarded = {guard.element for guard in imported.circuit.guards}
    for line in imported.circuit.lines:
        if f"line.{line.name}" in guarded:
            for terminal, conductors in enumerate(line.opened, start=1):
                for n, is_open in enumerate(conductors, start=1):
                    word = "Open" if is_open else "Close"
                    yield f'{word} "Line.{line.name}" {terminal} {n}'


def _difference(imported: Imported, mode: str, solved: Volts) -> Difference:
    """Compare one kind of loads."""
    feeder = imported.feeder
    network = compile_network(feeder, frozenset(s.name for s in feeder.switches if s.closed))
    state = steady_state(network)
    if mode == "direct":
        state = state._replace(exponent=np.full_like(state.exponent, 2.0))
    answer = solve(network, state)
    theirs, opendss_converged = solved
    floating = unearthed_buses(feeder)
    rows: list[_Bus] = []
    for name, nodes in _by_bus(theirs).items():
        bus = imported.buses.get(name)
        if bus is None:
            continue
        k = network.node(bus)
        phases = [p for p in nodes if int(network.node_phases[k]) >> p & 1]
        if phases:
            nominal = float(network.node_v[k])
            ours = np.array([answer.v[k, p, 0] for p in phases], np.complex128) / nominal
            wanted = np.array([nodes[p] for p in phases], np.complex128) / nominal
            rows.append(_Bus(bus, phases, ours, wanted, bus in floating))
    worst = max(rows, key=_largest, default=None)
    levels = np.abs(np.concatenate([row.ours for row in rows])) if rows else np.zeros(1)
    alive = levels[levels > _DEAD_PU]
    return Difference(
        mode=mode,
        largest_pu=_largest(worst) if worst else 0.0,
        bus=worst.name if worst else "",
        phase="abc"[worst.phases[int(np.argmax(worst.gap))]] if worst else "",
        nodes=len(levels),
        floating=sum(len(row.phases) for row in rows if row.floating),
        dead=len(levels) - len(alive),
        converged=not int(answer.flags[0]) & NOT_CONVERGED,
        opendss_converged=opendss_converged,
        lowest_pu=float(alive.min(initial=2.0)),
        highest_pu=float(alive.max(initial=0.0)),
    )


class _Bus(NamedTuple):
    """One bus as both see it, in pu."""

    name: str
    phases: list[int]
    ours: Complex
    wanted: Complex
    floating: bool

    @property
    def gap(self) -> Real:
        """Difference of each phase; between phases where nothing determines the rest."""
        gap = self.ours - self.wanted
        return np.asarray(np.abs(gap - gap.mean() if self.floating else gap))


def _largest(row: _Bus) -> float:
    return float(row.gap.max())


def _by_bus(volts: Mapping[tuple[str, int], complex]) -> dict[str, dict[int, complex]]:
    """Return the voltages of each bus by phase, neutrals left out."""
    found: dict[str, dict[int, complex]] = {}
    for (bus, node), value in volts.items():
        if node in (1, 2, 3):
            found.setdefault(bus, {})[node - 1] = value
    return found
