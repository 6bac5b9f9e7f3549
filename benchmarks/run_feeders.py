"""Mixed events on real feeders: the product and OpenDSS's drivings in turns; prints JSON.

A driving is timed only after its voltages agree with the product's, both solved to a much smaller
tolerance; nodes beyond a break that nothing feeds or holds, unearthed parts and states that
OpenDSS does not converge are left out and counted. Times are the process's own.
"""

from __future__ import annotations

import importlib
import json
import statistics
import sys
from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np
from feeder_dss import unearthed_buses
from feeder_problem import FeederProblem, draw_feeder_problem
from numpy.typing import NDArray

from openphase.model.after import solve_after
from openphase.model.buses import bus_volts
from openphase.model.phases import phase_mask
from openphase.model.solve import solve
from openphase.model.states import NOT_CONVERGED, UNEARTHED, State
from openphase.studies.run.engine import BLOCK, TOLERANCE_PU
from openphase.studies.run.starting import mean_voltages
from openphase.studies.spec.study_file import default_study

FEEDERS = ("ieee34", "ieee123")
SCENARIOS = 4000
OTHERS = 1000  #: for OpenDSS
REPEATS = 3
AGREE_PU = {True: 1e-6, False: 1e-4}  #: loads linear, or by their laws
TIGHT_PU = 1e-8  #: tolerance of both while they are compared
UNDEFINED = 8

Row = dict[str, Any]


def main() -> None:
    try:
        drivings = importlib.import_module("peer_feeders").DRIVINGS
    except ImportError:
        json.dump({"why": "not installed: pip install dss-python"}, sys.stdout)
        return
    rows = [_row(name, linear, drivings) for linear in (True, False) for name in FEEDERS]
    json.dump({"rows": rows}, sys.stdout)


def _row(name: str, linear: bool, drivings: dict[str, Any]) -> Row:
    product = _product(draw_feeder_problem(name, linear, SCENARIOS))
    problem = draw_feeder_problem(name, linear, OTHERS)
    product()
    peers: dict[str, Row] = {}
    runs: dict[str, Callable[[], Any]] = {}
    for title, drive in drivings.items():
        peers[title], run = _checked(problem, linear, drive)
        if run:
            runs[title] = run
    own: list[float] = []
    spent: dict[str, list[float]] = {title: [] for title in runs}
    for _ in range(REPEATS):
        own.append(_timed(product))
        for title, run in runs.items():
            own.append(_timed(product))
            spent[title].append(_timed(run))
    for title in runs:
        peers[title]["per_s"] = OTHERS / statistics.median(spent[title])
    row: Row = {"feeder": name, "linear": linear, "nodes": len(problem.network.nodes)}
    return row | {"per_s": SCENARIOS / statistics.median(own), "peers": peers}


def _timed(run: Callable[[], object]) -> float:
    start = process_time()
    run()
    return process_time() - start


def _product(problem: FeederProblem) -> Callable[[], None]:
    """Both states, block by block, started as a study starts them."""
    network, probes = problem.leaping, problem.probes
    start = mean_voltages(problem.network, default_study(problem.feeder.name))
    parts = [slice(s, s + BLOCK) for s in range(0, SCENARIOS, BLOCK)]
    blocks = [(_some(problem.before, part), _some(problem.after, part)) for part in parts]

    def run() -> None:
        for before, after in blocks:
            known = solve(network, before, probes, start=start, tolerance_pu=TOLERANCE_PU)
            none = np.zeros((0, before.emf_pu.size))
            solve_after(network, (before, known), after, (none, None), probes, TOLERANCE_PU)

    return run


def _some(state: State, chosen: slice) -> State:
    return State._make(np.ascontiguousarray(values[..., chosen]) for values in state)


def _checked(
    problem: FeederProblem, linear: bool, drive: Callable[..., Any]
) -> tuple[Row, Callable[[], Any] | None]:
    """How far a driving is from the product, and it at its own tolerance if that is near."""
    names, run = drive(problem, linear, TIGHT_PU)
    *found, good = run()
    gap, left_out = 0.0, 0
    for n, state in enumerate((problem.before, problem.after)):
        answer = solve(problem.network, state, tolerance_pu=TIGHT_PU)
        known, there = _expected(problem, names, answer.v, answer.flags, state)
        there &= (good[n] & (answer.flags & NOT_CONVERGED == 0))[:, None]
        # what its matrix leaves undefined is not a number
        off = np.abs(np.where(there, found[n], 0.0) - np.where(there, known, 0.0))
        gap = max(gap, float((off / _nominal(problem, names)).max()))
        left_out += int((~there).sum())
    row: Row = {"gap_pu": gap, "allowed_pu": AGREE_PU[linear]}
    row |= {"left_out": left_out / (2 * there.size)}
    timed = drive(problem, linear, TIGHT_PU if linear else TOLERANCE_PU)[1]
    *_, good = timed()
    row["not_converged"] = int((~good).sum())
    if gap > AGREE_PU[linear]:
        return row | {"why": f"does not agree: {gap:.1e} pu"}, None
    return row, timed


def _expected(
    problem: FeederProblem,
    names: list[str],
    v: NDArray[np.complex128],
    flags: NDArray[np.int64],
    state: State,
) -> tuple[NDArray[np.complex128], NDArray[np.bool_]]:
    """(S, nodes) the product's volts in OpenDSS's order, and which of them mean something."""
    rows = _rows(problem, names)
    network, held = problem.network, _held(problem)
    known = np.stack([v[k, phase] for k, phase in rows], axis=1)
    loose = {network.node(bus) for bus in unearthed_buses(problem.feeder)}
    there = np.tile([k not in loose for k, _ in rows], (flags.size, 1))
    for s in np.flatnonzero(flags & ~(UNEARTHED | NOT_CONVERGED)):
        below = network.below(int(state.edge[s]))
        there[s] &= [not (below[k] and flags[s] & UNDEFINED << phase) for k, phase in rows]
    for s in np.flatnonzero(state.open_mask):
        below = network.below(int(state.edge[s]))
        if not state.open_mask[s] & np.bitwise_or.reduce(held[below], initial=0):
            there[s] &= [not (below[k] and state.open_mask[s] >> phase & 1) for k, phase in rows]
    return known, there


def _held(problem: FeederProblem) -> NDArray[np.int64]:
    """(B,) the phases in which a load or bank hangs on each node.

    Where beyond a break there is none, a line's charging alone holds the conductor, and the
    1e-12 S that OpenDSS keeps across the break shows.
    """
    held = np.zeros(len(problem.network.nodes), np.int64)
    for part in (*problem.feeder.loads, *problem.feeder.capacitors):
        if part.place is not None and part.place.bus is not None:
            held[problem.network.node(part.place.bus)] |= phase_mask(part.phases)
    return held


def _rows(problem: FeederProblem, names: list[str]) -> list[tuple[int, int]]:
    at = {bus.upper(): k for k, bus in enumerate(problem.network.nodes)}
    split = [name.partition(".") for name in names]
    return [(at[bus], int(phase) - 1) for bus, _, phase in split]


def _nominal(problem: FeederProblem, names: list[str]) -> NDArray[np.float64]:
    volts = bus_volts(problem.feeder)
    return np.array([volts[problem.network.nodes[k]] for k, _ in _rows(problem, names)])


if __name__ == "__main__":
    main()
