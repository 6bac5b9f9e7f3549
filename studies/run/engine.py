"""One block from random numbers to evidence: draw, solve, measure, judge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...detector.evidence import Evidence, Phasors, evidence_of
from ...detector.instruments import measure
from ...model.points import into_line, point_probes
from ...model.solve import solve, steady_state
from ...model.states import Answer, State
from .classes import sides
from .draw import Case, Scenarios

__all__ = ["BLOCK", "TOLERANCE_PU", "Observed", "observe"]

BLOCK = 2000  #: scenarios a block; part of every random stream, so never a matter of jobs
TOLERANCE_PU = 1e-7  #: last change of a winding voltage; the instruments add 1.3e-4

Int = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Observed:
    """A block's evidence with the truth."""

    evidence: Evidence  #: (T, S)
    side: NDArray[np.int8]  #: (T, S)
    connected: NDArray[np.bool_]  #: (S,) a break here has something connected beyond it
    edge: Int  #: (S,)
    share: NDArray[np.float64]  #: (S,)
    flags: Int  #: (S,)


def observe(case: Case, scenarios: Scenarios) -> Observed:
    """Solve both states, measure, and reduce to evidence."""
    probes = point_probes(case.points)
    before = solve(
        case.network,
        scenarios.before,
        probes,
        start=_guess(case, scenarios.before),
        tolerance_pu=TOLERANCE_PU,
    )
    after = solve(
        case.network,
        scenarios.after,
        probes,
        start=before.unit_v_pu * (scenarios.after.emf_pu / scenarios.before.emf_pu),
        tolerance_pu=TOLERANCE_PU,
    )
    edge = scenarios.event.edge
    return Observed(
        evidence=evidence_of(
            _measured(case, (before, after), scenarios),
            case.points.terminals,
            case.network.tree.v_nominal_v,
        ),
        side=sides(case.points.terminals, edge),
        connected=case.network.equipped[edge] & (edge >= 0),
        edge=edge,
        share=scenarios.event.share,
        flags=before.flags | after.flags,
    )


def _guess(case: Case, state: State) -> NDArray[np.float64]:
    """Winding voltages near the solution: the drop at nominal load, scaled by the mean load."""
    drop = 1.0 - solve(case.network, steady_state(case.network)).unit_v_pu
    return np.asarray(1.0 - drop * state.load_scale.mean(axis=0))


def _measured(case: Case, frames: tuple[Answer, Answer], scenarios: Scenarios) -> Phasors:
    """What the instruments make of the two solved frames."""
    instruments = case.study.instruments
    into = into_line(case.points)[:, None, None]
    v = [
        measure(frame.v, scenarios.v_error[n], instruments.tve_pct, 0.0)
        for n, frame in enumerate(frames)
    ]
    i = [
        measure(
            frame.i * into, scenarios.i_error[n], instruments.tve_pct, instruments.current_floor_a
        )
        for n, frame in enumerate(frames)
    ]
    return Phasors(v=np.stack(v), i=np.stack(i))
