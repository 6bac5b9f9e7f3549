"""The state after an event: what DER keep from before it, and which of them it trips."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .machine_state import carried_over
from .network import Network
from .solve import TOLERANCE_PU, solve
from .states import NOT_CONVERGED, Answer, Probes, State, unit_voltages

__all__ = ["OVERVOLTAGE_PU", "solve_after"]

OVERVOLTAGE_PU = 1.2
"""DER trip above it at any of their phases: within 0.16 s by IEEE 1547-2018, table 11."""


def solve_after(
    network: Network,
    first: tuple[State, Answer],
    after: State,
    ders: tuple[NDArray[np.float64], NDArray[np.int64] | None],
    probes: Probes | None = None,
    tolerance_pu: float = TOLERANCE_PU,
) -> Answer:
    """Solve the state after an event.

    DER go on with what they kept from before it. Where that leaves one of them above
    ``OVERVOLTAGE_PU``, or without any solution, as a current source is beyond open phases, all
    DER trip within ΔT, and the state is solved without them.

    Parameters
    ----------
    network : Network
    first : tuple of State, Answer
        The state before the event, and its solution.
    after : State
        The state after it, DER as they were.
    ders : tuple of two (D, S) arrays
        Factor on what the DER deliver, 0 for one that has tripped; and what they keep, as
        indices into ``machines.DER_MODELS``, None for the file's.
    probes, tolerance_pu
        As in ``solve``.
    """
    before, known = first
    der_factor, der_model = ders
    start = known.winding_v_pu * (after.emf_pu / before.emf_pu)
    state = carried_over(network, before, known, after, der_factor, der_model)
    answer = solve(network, state, probes, start=start, tolerance_pu=tolerance_pu)
    if not network.machines.ders:
        return answer
    lost = np.flatnonzero(_overvoltage(network, answer) | (answer.flags & NOT_CONVERGED != 0))
    if not lost.size:
        return answer
    nothing = np.zeros((len(network.machines.ders), lost.size))
    tripped = carried_over(
        network,
        _some(before, lost),
        known._replace(machine_v1_v=known.machine_v1_v[:, lost]),
        _some(after, lost),
        nothing,
    )
    again = solve(network, tripped, probes, start=start[..., lost], tolerance_pu=tolerance_pu)
    for whole, part in zip(answer, again, strict=True):
        whole[..., lost] = part
    return answer


def _overvoltage(network: Network, answer: Answer) -> NDArray[np.bool_]:
    """(S,) any DER stands above its limit.

    Where no neutral goes with the lines a DER has none either, and does not notice that of the
    network moving: there it is the positive sequence that counts.
    """
    units = network.machines.unit[network.machines.motor_load.size :]
    v_pu = unit_voltages(answer, len(network.units))[units]
    own = network.neutral[network.tree.unit_node[units]][:, None]
    seen = np.where(own, v_pu[:, :3].max(axis=1), v_pu[:, 3])
    return np.asarray(seen.max(axis=0) > OVERVOLTAGE_PU)


def _some(state: State, chosen: NDArray[np.int64]) -> State:
    """Some of the scenarios."""
    return State._make(np.ascontiguousarray(values[..., chosen]) for values in state)
