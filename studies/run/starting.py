"""Voltages near the solution, from which a block's loads settle in fewer passes.

The result of a scenario does not depend on them, but for what the solver's tolerance leaves;
they depend on the network and the study alone, never on who draws which block.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.network import Network
from ...model.sides import edge_nodes
from ...model.solve import quiet_state, solve, steady_state
from ...model.states import BY_LAW, State
from ...model.symmetrical import to_sequences
from ..spec.study_file import Study

__all__ = ["Start", "fit_start", "start_of"]

Real = NDArray[np.float64]

MOST_LOADS = 300  #: beyond it, a voltage follows from the loads' mean alone
LEAST_PU, MOST_PU = 0.3, 1.3  #: no start lies beyond
ROWS = 64  #: voltages that are computed together; changes no result


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Start:
    """How voltages follow from what loads take: fitted once for a network and a study."""

    of_features: Real  #: (W, F) voltages in pu, as ``winding_v_pu`` has them; 0 at the event node
    individual: bool  #: every load is a feature of its own
    node_drop: Real  #: (B, 4) at the file's loads: |V| of three phases, and |V1|


def fit_start(network: Network, study: Study) -> Start:
    """Solve a sample of states without events, and fit their voltages by least squares."""
    loads = len(network.loads)
    individual = loads <= MOST_LOADS
    size = 64 + (2 * loads if individual else 0)
    rng = np.random.Generator(np.random.SFC64(0))
    scale = study.loads.level.draw(rng, size) * study.loads.each.draw(rng, (loads, size))
    drawn = study.loads.exponent
    common = BY_LAW if isinstance(drawn, str) else np.clip(drawn.draw(rng, size), 0.0, 2.0)
    state = quiet_state(network, scale, np.tile(common, (loads, 1)) + np.zeros_like(scale))
    windings = solve(network, state, tolerance_pu=1e-7).winding_v_pu
    windings[_stub_rows(network)] = 0.0
    features = _features(state, individual, _mean(state.load_scale))
    fitted = np.linalg.lstsq(features.T, windings.T, rcond=1e-8)[0]
    v = solve(network, steady_state(network)).v[:, :, 0]
    abc_and_1 = np.concatenate([v, to_sequences(v, axis=1)[:, 1:2]], axis=1)
    v_pu = np.abs(abc_and_1) / network.node_v[:, None]
    return Start(
        of_features=np.ascontiguousarray(fitted.T),
        individual=individual,
        node_drop=np.where(v_pu > LEAST_PU, 1.0 - v_pu, 0.0),
    )


def start_of(start: Start, network: Network, state: State) -> Real:
    """(4 (U + 1) + P, S) voltages for the solver, as its ``winding_v_pu``."""
    mean = _mean(state.load_scale)
    features = _features(state, start.individual, mean)
    upper, lower = edge_nodes(network)
    share = state.share[:, None]
    drop = (1.0 - share) * start.node_drop[upper[state.edge]]
    drop += share * start.node_drop[lower[state.edge]]
    found = np.empty((len(start.of_features), mean.size))
    for k in range(0, len(found), ROWS):  # while they lie in the cache
        part = slice(k, k + ROWS)
        rows = np.matmul(start.of_features[part], features, out=found[part])
        np.clip(rows, LEAST_PU, MOST_PU, out=rows)
    stub = 1.0 - np.where(state.edge >= 0, mean, 0.0) * drop.T
    np.clip(stub, LEAST_PU, MOST_PU, out=found[_stub_rows(network)])
    return found


def _stub_rows(network: Network) -> slice:
    """Rows of the event node among the winding voltages."""
    units = 4 * len(network.units)
    return slice(units, units + 4)


def _mean(load_scale: Real) -> Real:
    return np.asarray(load_scale.sum(axis=0) / max(load_scale.shape[0], 1))


def _features(state: State, individual: bool, mean: Real) -> Real:
    """(F, S): powers of the loads' mean and of their mean exponent, and each load's own part."""
    exponent = _mean(state.exponent)
    common = np.stack(
        [
            np.ones_like(mean),
            mean,
            mean**2,
            mean * exponent,
            mean**2 * exponent,
            mean * exponent**2,
        ]
    )
    return np.concatenate([common, state.load_scale - mean]) if individual else common
