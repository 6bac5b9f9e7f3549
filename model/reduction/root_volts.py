"""The voltages of the buses that a fold hangs on, at the level where it is exact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..laws import own_exponents
from ..network import compile_network
from ..parts import Feeder
from ..solve import quiet_state, solve
from ..states import NOT_CONVERGED, Probes

__all__ = ["root_volts"]

TURN = np.exp(-2j * np.pi / 3.0 * np.arange(3))


def root_volts(feeder: Feeder, roots: Sequence[str], level: float) -> NDArray[np.complex128]:
    """(R, 3) volts with all loads at ``level``; nominal where that state does not converge."""
    network = compile_network(feeder)
    index = {name: k for k, name in enumerate(network.nodes)}
    nodes = np.array([index[root] for root in roots], np.int64)
    nothing = np.zeros(0, np.int64)
    loads = len(network.loads)
    state = quiet_state(network, np.full((loads, 1), level), own_exponents(feeder)[:, None])
    probes = Probes(v_node=nodes, i_edge=nothing, i_below=nothing.astype(np.bool_))
    answer = solve(network, state, probes)
    if answer.flags[0] & NOT_CONVERGED:
        return np.asarray(network.node_v[nodes][:, None] * TURN, np.complex128)
    return np.asarray(answer.v[:, :, 0])
