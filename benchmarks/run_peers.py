"""The product and its peers on the same broken conductors, in one process; prints JSON.

A peer is timed only after its voltages agree with the product's.
"""

from __future__ import annotations

import importlib
import json
import statistics
import sys
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from problem import Complex, Problem, draw_problem, first, pick

from openphase.model.solve import solve
from openphase.studies.run.engine import BLOCK

SCENARIOS = 40_000
REPEATS = 3

Run = Callable[[], tuple[Complex, Complex]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Peer:
    """An engine beside the product."""

    title: str
    module: str  #: beside this file; its function has the name after "peer_"
    scenarios: int
    tolerance_pu: float
    install: str = ""  #: what pip calls it


PEERS = (
    Peer(
        title="numpy ladder, 3×3",
        module="peer_numpy_ladder",
        scenarios=SCENARIOS,
        tolerance_pu=1e-9,
    ),
    Peer(title="numpy, dense batch", module="peer_dense", scenarios=4_000, tolerance_pu=1e-9),
    Peer(
        title="power-grid-model",
        module="peer_pgm",
        scenarios=8_000,
        tolerance_pu=1e-6,
        install="power-grid-model",
    ),
    Peer(
        title="OpenDSS (dss-python)",
        module="peer_opendss",
        scenarios=4_000,
        tolerance_pu=1e-6,
        install="dss-python",
    ),
)


def main() -> None:
    problem = draw_problem(SCENARIOS)
    product = _product(problem)
    product()
    rows = [{"title": "openphase", "per_s": problem.sound.size / _median_s(product), "gap_pu": 0.0}]
    rows += [_row(peer, first(problem, peer.scenarios)) for peer in PEERS]
    nodes, units = len(problem.network.nodes), len(problem.network.units)
    json.dump({"nodes": nodes, "units": units, "rows": rows}, sys.stdout)


def _product(problem: Problem) -> Callable[[], None]:
    """Both states of every scenario, block by block as a study solves them."""
    blocks = [
        tuple(pick(state, slice(s, s + BLOCK)) for state, _ in problem.parts)
        for s in range(0, problem.sound.size, BLOCK)
    ]

    def run() -> None:
        for before, after in blocks:
            start = solve(problem.network, before, problem.probes).winding_v_pu
            solve(problem.network, after, problem.probes, start=start)

    return run


def _row(peer: Peer, problem: Problem) -> dict[str, Any]:
    """One line of the table: scenarios per second, or why there are none."""
    row: dict[str, Any] = {"title": peer.title, "tolerance_pu": peer.tolerance_pu}
    try:
        module = importlib.import_module(peer.module)
    except ImportError:
        return row | {"why": f"not installed: pip install {peer.install}"}
    try:
        run: Run = getattr(module, peer.module.removeprefix("peer_"))(problem)
        gap = _gap_pu(problem, run())
    except Exception as error:  # noqa: BLE001 - a peer of another version may fail in any way
        return row | {"why": f"failed: {type(error).__name__}: {str(error)[:60]}"}
    if gap > peer.tolerance_pu:
        return row | {"why": f"does not agree: {gap:.1e} pu, wanted {peer.tolerance_pu:g}"}
    return row | {"gap_pu": gap, "per_s": problem.sound.size / _median_s(run)}


def _gap_pu(problem: Problem, found: tuple[Complex, Complex]) -> float:
    """Largest difference of a node's voltage, where no conductor is left dead."""
    nominal = problem.network.tree.v_nominal_v
    gaps = [np.abs(found[0] - problem.v[0]), np.abs(found[1] - problem.v[1])[..., problem.sound]]
    return max(float(gap.max()) for gap in gaps) / nominal


def _median_s(run: Callable[[], object]) -> float:
    spent = []
    for _ in range(REPEATS):
        start = perf_counter()
        run()
        spent.append(perf_counter() - start)
    return statistics.median(spent)


if __name__ == "__main__":
    main()
