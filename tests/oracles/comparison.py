"""Answers of the ladder beside those of the dense reference."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from oracles.dense import DenseSolution, NoSolutionError, NotConvergedError, solve_dense
from oracles.dense import Event as DenseEvent
from oracles.dense_inline import nominal_volts
from oracles.dense_parts import rows
from oracles.random_happenings import Happening, dense_event

from openphase.model.events.base import apply_event
from openphase.model.machine_state import carried_over
from openphase.model.network import Network, detached_end
from openphase.model.parts import Feeder
from openphase.model.solve import solve, steady_state
from openphase.model.solver.breaks import DEAD, FLOATING
from openphase.model.states import NOT_CONVERGED, UNEARTHED, Answer, unit_voltages

__all__ = ["TOLERANCE", "Case", "Outcome", "compare", "gap_pu", "outcomes"]

TOLERANCE = 1e-9
LOOSE = 1e-9
"""Share of a bus in a direction of the null space from which on the bus moves with it."""

Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """A feeder in one state of its switches, and an event."""

    feeder: Feeder
    closed: frozenset[str]
    opened: frozenset[str]
    network: Network
    happening: Happening

    @property
    def detached(self) -> dict[str, str]:
        """The reference's names of detached line ends, by those of the network."""
        points = [p for p in self.feeder.points if p.name in self.opened]
        return {detached_end(p.name): f"{p.line}@{p.bus}" for p in points}

    def event(self, *, after: bool) -> DenseEvent:
        """The reference's state before or after the event."""
        return dense_event(self.network, self.happening.event, self.detached, after=after)


def gap_pu(case: Case, answer: Answer, oracle: DenseSolution, event: DenseEvent) -> float:
    """Largest difference, of voltages in pu of nominal and currents in pu of 1 MVA.

    Where there are larger ones, at resonance or a fault, in pu of the largest. Of a voltage that
    is not determined in some direction, only what it is in the others counts.
    """
    network, feeder = case.network, case.feeder
    volts = _volts(case)
    known = [*oracle.v.items(), *oracle.stubs.items()]
    highest = max(1.0, *(float(np.abs(v).max()) / volts[name] for name, v in known))
    gaps = [0.0]

    def compare_v(name: str, ours: Complex, theirs: Complex) -> None:
        gap = ours - theirs
        if oracle.loose[name].shape[1]:
            u, s, _ = np.linalg.svd(oracle.loose[name])
            free = u[:, : int((s > LOOSE).sum())]
            gap = gap - free @ (free.conj().T @ gap)
        gaps.append(float(np.abs(gap).max()) / (volts[name] * highest))

    ours = {theirs: own for own, theirs in case.detached.items()}
    for bus, v in oracle.v.items():
        compare_v(bus, answer.v[network.node(ours.get(bus, bus)), :, 0], v)
    bases = _amperes(case, oracle, volts)
    for line in feeder.lines:
        i_base = bases[volts[line.from_bus]]
        edges = network.edges_of(line.name)
        first, last = edges[0], edges[-1]
        start = answer.i[2 * first + (not network.upward[first]), :, 0]
        stop = answer.i[2 * last + network.upward[last], :, 0]
        start = start if network.upward[first] else -start
        stop = -stop if network.upward[last] else stop
        gaps.append(np.abs(start - oracle.i_from[line.name]).max() / i_base)
        gaps.append(np.abs(stop - oracle.i_to[line.name]).max() / i_base)
    if event.open_line is not None:
        upward = network.upward[int(case.happening.event.edge[0])]
        for n, side in enumerate("pq" if upward else "qp"):
            name = f"{event.open_line}.{side}"
            compare_v(name, answer.stub[n, :, 0], oracle.stubs[name])
    return max(gaps)


def _volts(case: Case) -> dict[str, float]:
    """Nominal volts by the reference's names: buses, detached ends and stubs."""
    volts = nominal_volts(case.feeder)
    for line in case.feeder.lines:
        ends = (f"{line.name}@{bus}" for bus in (line.from_bus, line.to_bus))
        names = [*ends, f"{line.name}.p", f"{line.name}.q"]
        volts |= dict.fromkeys(names, volts[line.from_bus])
    return volts


def _amperes(case: Case, oracle: DenseSolution, volts: dict[str, float]) -> dict[float, float]:
    """Base current by nominal voltage."""
    bases = {v: 1e6 / (3 * v) for v in volts.values()}
    for line in case.feeder.lines:
        v = volts[line.from_bus]
        bases[v] = max(bases[v], float(np.abs(oracle.i_from[line.name]).max()))
    v = case.feeder.source.v_phase_v
    bases[v] = max(bases[v], float(np.abs(oracle.i_source).max()))
    return bases


def winding_voltages(
    case: Case, answer: Answer, event: DenseEvent
) -> dict[str, NDArray[np.float64]]:
    """The ladder's voltages, as a start for the reference."""
    network = case.network
    units, tree = unit_voltages(answer, len(network.units)), network.tree
    branches = answer.winding_v_pu[4 * (len(network.units) + 1) :, 0]
    found = {
        name: units[tree.load_unit[n], :3, 0]
        if tree.load_unit[n] >= 0
        else branches[_own_branches(case, n)]
        for n, name in enumerate(network.loads)
    }
    own = network.machines
    for m, unit in enumerate(own.unit):
        motors = own.motor_load.size
        name = (
            f"{network.loads[own.motor_load[m]]}.motor"
            if m < motors
            else f"{own.ders[m - motors]}.der"
        )
        found[name] = np.full(3, units[unit, 3, 0])
    for n, shunt in enumerate(event.shunts):
        if shunt.exponent != 2.0:
            found[f"shunt {n}"] = units[-1, [shunt.phase], 0]
    return found


def _own_branches(case: Case, load: int) -> list[int]:
    """Places of a direct load's branches, in the order that its phases have in the file."""
    tree, phases = case.network.tree, rows(case.feeder.loads[load].phases)
    ends = [{int(a), int(b)} for a, b in zip(tree.branch_from, tree.branch_to, strict=True)]
    pairs = [{k, -1} for k in phases]
    if case.feeder.loads[load].connection == "delta":
        around = zip(phases, [*phases[1:], phases[0]], strict=True)
        pairs = [{a, b} for a, b in around][: 1 if len(phases) == 2 else 3]
    branch_of = np.repeat(np.arange(tree.branch_node.size), np.diff(tree.branch_first))
    own = branch_of[tree.branch_load == load]
    return [next(int(k) for k in own if ends[k] == pair) for pair in pairs]


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How one state compares."""

    how: Literal["agree", "elsewhere", "differ", "unsettled", "no solution", "reference unsettled"]
    gap: float = np.inf
    floating: bool = False  #: the reference finds undetermined voltages
    flagged: bool = False  #: so does the ladder


def compare(
    case: Case, answer: Answer, event: DenseEvent, start: DenseSolution | None, **state: Any
) -> tuple[Outcome, DenseSolution | None]:
    """The ladder's answer against the reference; and the reference at the same state.

    Where several operating points exist the reference may have found another. Then what the
    ladder found must be one as well: the reference, held at the ladder's voltages, must give
    them back.
    """
    flagged = bool(answer.flags[0] & (DEAD | FLOATING | UNEARTHED))
    try:
        oracle = solve_dense(case.feeder, case.closed, event, start=start, **state)
    except NoSolutionError:
        return Outcome(how="no solution", flagged=flagged), None
    except NotConvergedError:
        return Outcome(how="reference unsettled", flagged=flagged), None
    found = Outcome(
        how="unsettled" if answer.flags[0] & NOT_CONVERGED else "agree",
        gap=gap_pu(case, answer, oracle, event),
        floating=bool(oracle.floating),
        flagged=flagged,
    )
    if found.how == "unsettled" or found.gap <= TOLERANCE:
        return found, oracle
    start = replace(oracle, load_pu=winding_voltages(case, answer, event))
    held = solve_dense(case.feeder, case.closed, event, start=start, hold=True, **state)
    moved = max(np.abs(held.load_pu[name] - pu).max() for name, pu in start.load_pu.items())
    gap = gap_pu(case, answer, held, event)
    if max(gap, moved) > TOLERANCE:
        return replace(found, how="differ"), oracle
    return replace(found, how="elsewhere", gap=gap), held


def outcomes(case: Case) -> list[Outcome]:
    """Before the event, and after it."""
    network, event = case.network, case.happening.event
    steady = steady_state(network)
    first, second = apply_event(network, steady, steady, event)
    answer = solve(network, first)
    state: dict[str, Any] = {"opened": case.opened}
    before, oracle = compare(case, answer, case.event(after=False), None, **state)
    if before.how not in ("agree", "elsewhere"):
        return [before]
    second = carried_over(network, first, answer, second, event.der_factor)
    answer = solve(network, second, start=answer.winding_v_pu)
    scale = {name: float(event.load_factor[n, 0]) for n, name in enumerate(network.loads)}
    state |= {"before": oracle, "load_scale": scale}
    return [before, compare(case, answer, case.event(after=True), oracle, **state)[0]]
