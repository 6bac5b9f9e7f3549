"""The solver's door: states of many scenarios in, phasors out.

States and answers are structures of arrays with the scenario axis last.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .ladder import solve_block
from .network import Network
from .states import Answer, Probes, State, workspace

__all__ = ["FLOOR_PU", "all_probes", "new_answer", "solve", "steady_state"]

FLOOR_PU = 0.7  #: below it a load is constant impedance, at its admittance there
TOLERANCE_PU = 1e-12  #: largest change of a winding voltage in the last pass
MOST_PASSES = 200


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
    loads = len(network.loads)
    return State(
        emf_pu=np.full(scenarios, network.emf_pu),
        load_scale=np.ones((loads, scenarios)),
        exponent=np.repeat(network.exponent[:, None], scenarios, axis=1),
        connection=np.repeat(network.connection[:, None], scenarios, axis=1),
        edge=np.full(scenarios, -1, np.int64),
        share=np.zeros(scenarios),
        open_mask=np.zeros(scenarios, np.int64),
        step_y_s=np.zeros((3, scenarios), np.complex128),
        step_exponent=np.full(scenarios, 2.0),
    )


def new_answer(network: Network, probes: Probes, scenarios: int) -> Answer:
    """An empty answer whose fixed point starts from nominal voltages."""
    return Answer(
        v=np.empty((probes.v_node.size, 3, scenarios), np.complex128),
        i=np.empty((probes.i_edge.size, 3, scenarios), np.complex128),
        stub=np.empty((2, 3, scenarios), np.complex128),
        unit_v_pu=np.ones((len(network.units) + 1, 3, scenarios)),
        flags=np.zeros(scenarios, np.int64),
        passes=np.zeros(scenarios, np.int64),
    )


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
        S scenarios. An event is one thing: opened phases or a load step, not both.
    probes : Probes, optional
        Where to look; by default everywhere.
    start : (U + 1, 3, S) array, optional
        Winding voltages in pu from which the loads' fixed point starts, such as
        ``unit_v_pu`` of the state before the event; by default nominal.
    tolerance_pu : float
        Largest change of a winding voltage in the last pass.

    Returns
    -------
    Answer
        Undefined voltages (floating conductors) are 0 and flagged, never NaN.

    Raises
    ------
    ValueError
        Shapes that do not fit, a place outside an edge, or two events in one scenario.
    """
    _check(network, state)
    probes = probes or all_probes(network)
    answer = new_answer(network, probes, state.emf_pu.size)
    work = workspace(len(network.nodes), len(network.units))
    answer.unit_v_pu[:] = 1.0 if start is None else start
    solve_block(network.tree, state, probes, work, answer, tolerance_pu, MOST_PASSES, FLOOR_PU)
    return answer


def _check(network: Network, state: State) -> None:
    s = state.emf_pu.size
    loads, units = len(network.loads), len(network.units)
    wanted = {
        "load_scale": (loads, s),
        "exponent": (loads, s),
        "connection": (units, s),
        "edge": (s,),
        "share": (s,),
        "open_mask": (s,),
        "step_y_s": (3, s),
        "step_exponent": (s,),
    }
    for name, shape in wanted.items():
        found = getattr(state, name).shape
        if found != shape:
            raise ValueError(f"state.{name} has shape {found}, wanted {shape}")
    edge = state.edge
    if np.any((edge == 0) | (edge < -1) | (edge >= len(network.pieces))):
        raise ValueError("state.edge must be -1 or the index of a line's edge")
    if np.any((state.share < 0) | (state.share > 1)):
        raise ValueError("state.share must lie in 0..1")
    opened = state.open_mask != 0
    if np.any(opened & (edge < 0)) or np.any(opened & (state.step_y_s != 0).any(axis=0)):
        raise ValueError("a scenario opens phases on an edge, or switches a load there, not both")
