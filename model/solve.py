"""The solver's door: states of many scenarios in, phasors out.

States and answers are structures of arrays with the scenario axis last.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .machine_state import FLOOR_PU, machine_state
from .network import Network
from .solver.ladder import solve_block
from .solver.wide.solve import solve_wide
from .solver.wide.work import wide_workspace
from .states import Answer, Probes, State, workspace

__all__ = ["FLOOR_PU", "all_probes", "new_answer", "quiet_state", "solve", "steady_state"]

TOLERANCE_PU = 1e-12  #: estimated error of a winding voltage
MOST_PASSES = 300


def all_probes(network: Network) -> Probes:
    """Look everywhere: every node's voltage, every edge's current at both ends."""
    edges = np.arange(len(network.pieces), dtype=np.int64)
    return Probes(
        v_node=np.arange(len(network.nodes), dtype=np.int64),
        i_edge=np.repeat(edges, 2),
        i_below=np.tile(np.array([False, True]), edges.size),
    )


def steady_state(network: Network, scenarios: int = 1) -> State:
    """The file's own loads, connections and EMF, without any event."""
    return quiet_state(
        network,
        np.ones((len(network.loads), scenarios)),
        np.repeat(network.exponent[:, None], scenarios, axis=1),
    )


def quiet_state(
    network: Network,
    load_scale: NDArray[np.float64],
    exponent: NDArray[np.float64],
    machines: Mapping[str, Any] | None = None,
) -> State:
    """A state without event at the file's EMF, ratios and connections.

    ``load_scale`` and ``exponent`` are (L, S); ``machines`` are the fields that
    ``machine_state`` makes, by default at the file's own shares and levels.
    """
    scenarios = load_scale.shape[1]
    nothing = np.zeros((3, scenarios), np.complex128)
    fields = machine_state(network, load_scale, exponent) if machines is None else machines
    return State(
        emf_pu=np.full(scenarios, network.emf_pu),
        **fields,
        connection=np.repeat(network.connection[:, None], scenarios, axis=1),
        ratio=np.repeat(network.ratio[:, :, None], scenarios, axis=2),
        edge=np.full(scenarios, -1, np.int64),
        share=np.zeros(scenarios),
        open_mask=np.zeros(scenarios, np.int64),
        step_y_s=nothing,
        step_exponent=np.full(scenarios, 2.0),
        between_y_s=nothing,
        fallen_y_s=nothing,
        far_node=np.full(scenarios, -1, np.int64),
        far_y_s=nothing,
        far_between_y_s=nothing,
    )


def new_answer(
    network: Network,
    probes: Probes,
    scenarios: int,
    start: NDArray[np.float64] | None = None,
) -> Answer:
    """An empty answer whose fixed point starts from nominal voltages, or from these (N, S)."""
    windings = 4 * (len(network.units) + 1) + network.tree.branch_node.size
    return Answer(
        v=np.empty((probes.v_node.size, 3, scenarios), np.complex128),
        i=np.empty((probes.i_edge.size, 3, scenarios), np.complex128),
        stub=np.empty((2, 3, scenarios), np.complex128),
        winding_v_pu=_started(start, windings, scenarios),
        machine_v1_v=np.zeros((network.machines.count, scenarios), np.complex128),
        flags=np.zeros(scenarios, np.int64),
        passes=np.zeros(scenarios, np.int64),
    )


def _ordinary(values: NDArray[Any]) -> NDArray[Any]:
    """The array, or a copy that is one piece and may be written: others are compiled anew."""
    return np.require(values, requirements=["C", "W"])


def _started(
    start: NDArray[np.float64] | None, windings: int, scenarios: int
) -> NDArray[np.float64]:
    if start is None:
        return np.ones((windings, scenarios))
    return np.broadcast_to(start, (windings, scenarios)).copy()


def solve(
    network: Network,
    state: State,
    probes: Probes | None = None,
    *,
    start: NDArray[np.float64] | None = None,
    tolerance_pu: float = TOLERANCE_PU,
) -> Answer:
    """Solve every scenario of ``state``.

    Parameters
    ----------
    network : Network
    state : State
        S scenarios.
    probes : Probes, optional
        Where to look; by default everywhere.
    start : (N, S) or (N, 1) array, optional
        Winding and branch voltages in pu from which the loads' fixed point starts, such as
        ``winding_v_pu`` of the state before the event; by default nominal.
    tolerance_pu : float
        Error of a winding voltage as the passes show it: an estimate, not a bound.

    Returns
    -------
    Answer
        Undefined voltages (floating conductors) are 0 and flagged, never NaN.

    Raises
    ------
    ValueError
        Shapes that do not fit, or a place outside an edge.
    """
    _check(network, state)
    probes = probes or all_probes(network)
    if np.any(network.tree.passed[probes.v_node] >= 0):
        raise ValueError("probes look at a node that a leap passes by")
    scenarios, tree = state.emf_pu.size, network.tree
    state = State._make(map(_ordinary, state))
    probes = Probes._make(map(_ordinary, probes))
    limits = tolerance_pu, MOST_PASSES, FLOOR_PU
    answer = new_answer(network, probes, scenarios, start)
    if tree.tail.size:
        solve_block(tree, state, probes, workspace(tree), answer, *limits)
        return answer
    order = np.lexsort((state.far_node, state.edge))
    solve_wide(
        tree, state, probes, wide_workspace(tree, probes), workspace(tree), answer, order, *limits
    )
    return answer


def _check(network: Network, state: State) -> None:
    s = state.emf_pu.size
    loads, units, machines = len(network.loads), len(network.units), network.machines.count
    wanted = {
        "load_scale": (loads, s),
        "exponent": (loads, s),
        "connection": (units, s),
        "ratio": (len(network.regulators), 3, s),
        "machine_va": (machines, s),
        "machine_exponent": (machines, s),
        "machine_y_s": (machines, 3, s),
        "machine_j_a": (machines, s),
        "edge": (s,),
        "share": (s,),
        "open_mask": (s,),
        "step_y_s": (3, s),
        "step_exponent": (s,),
        "between_y_s": (3, s),
        "fallen_y_s": (3, s),
        "far_node": (s,),
        "far_y_s": (3, s),
        "far_between_y_s": (3, s),
    }
    for name, shape in wanted.items():
        found = getattr(state, name).shape
        if found != shape:
            raise ValueError(f"state.{name} has shape {found}, wanted {shape}")
    edge = state.edge
    if np.any((edge == 0) | (edge < -1) | (edge >= len(network.pieces))):
        raise ValueError("state.edge must be -1 or the index of a line's edge")
    on_line = network.length_km[edge] > 0
    if np.any((edge > 0) & ~on_line):
        raise ValueError("state.edge must be a line's edge, not a switch or regulator")
    if np.any((state.share < 0) | (state.share > 1)):
        raise ValueError("state.share must lie in 0..1")
    if np.any((state.far_node < -1) | (state.far_node >= len(network.nodes))):
        raise ValueError("state.far_node must be -1 or the index of a node")
    here = network.tree.phases[edge]
    if np.any((state.open_mask & ~here != 0) & (edge >= 0)):
        raise ValueError("a scenario opens phases that its edge does not have")
    if np.any((state.open_mask != 0) & (edge < 0)):
        raise ValueError("a scenario opens phases, but on no edge")
