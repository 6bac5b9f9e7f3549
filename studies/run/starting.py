"""Voltages near the solution, from which a block's loads settle in fewer passes.

The result of a scenario does not depend on them, but for what the solver's tolerance leaves;
they depend on the network and the study alone, never on who draws which block.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...model.network import Network
from ...model.solve import quiet_state, solve
from ...model.states import BY_LAW
from ..spec.study_file import Study

__all__ = ["mean_voltages"]

SAMPLE = 64


def mean_voltages(network: Network, study: Study) -> NDArray[np.float64]:
    """(W, 1) means over a sample of states without events, as the solver's ``winding_v_pu``."""
    loads = len(network.loads)
    rng = np.random.Generator(np.random.SFC64(0))
    scale = study.loads.level.draw(rng, SAMPLE) * study.loads.each.draw(rng, (loads, SAMPLE))
    drawn = study.loads.exponent
    common = BY_LAW if isinstance(drawn, str) else np.clip(drawn.draw(rng, SAMPLE), 0.0, 2.0)
    state = quiet_state(network, scale, np.tile(common, (loads, 1)) + np.zeros_like(scale))
    found = solve(network, state, tolerance_pu=1e-7).winding_v_pu
    return np.asarray(found.mean(axis=1, keepdims=True))
