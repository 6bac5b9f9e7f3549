"""One block from random numbers to evidence: draw, solve, measure, judge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...detector.criteria import Options
from ...detector.evidence import Evidence, evidence_of, with_alarm
from ...detector.instruments import Bounds, measure, miswire
from ...detector.supervision import fed_one_way, wiring_alarm
from ...model.after import solve_after
from ...model.events.base import Event
from ...model.points import into_line, point_probes
from ...model.sides import Side
from ...model.solve import solve
from ...model.states import Answer
from .cases import Case, Wired
from .draw import Scenarios
from .draw_event import event_sides

__all__ = ["BLOCK", "TOLERANCE_PU", "Observed", "bounds_of", "observe"]

BLOCK = 2000  #: scenarios a block; part of every random stream, so never a matter of jobs
TOLERANCE_PU = 2e-6  #: estimated error of a voltage; the instruments add 1.3e-4

Int = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Observed:
    """A block's evidence with the truth."""

    evidence: Evidence  #: of T terminals in S scenarios
    side: NDArray[np.int8]  #: (T, S)
    connected: NDArray[np.bool_]  #: (S,) a break here has something connected beyond it
    edge: Int  #: (S,)
    share: NDArray[np.float64]  #: (S,)
    flags: Int  #: (S,)
    fallen_ohm: NDArray[np.float64]  #: (S,) between a fallen conductor and earth; inf: none


def bounds_of(case: Case) -> Bounds:
    """The instruments' errors, at the feeder's frequency and over the detector's ΔT."""
    own = case.study.instruments
    return Bounds(
        tve_pct=own.tve_pct,
        current_floor_a=own.current_floor_a,
        ratio_pct=own.ratio_pct,
        angle_mrad=own.angle_mrad,
        clock_us=own.clock_us,
        frequency_hz=own.frequency_hz,
        nominal_hz=case.feeder.source.frequency_hz,
        dt_s=case.study.detector.dt_ms / 1000.0,
    )


def observe(case: Case, scenarios: Scenarios, *options: Options) -> Observed:
    """Solve both states, measure, and reduce to the evidence that ``options`` ask for."""
    first, second, event = scenarios.first, scenarios.second, scenarios.event
    before = solve(
        first.network,
        scenarios.before,
        point_probes(first.points),
        start=first.start,
        tolerance_pu=TOLERANCE_PU,
    )
    after = solve_after(
        second.network,
        (scenarios.before, before),
        scenarios.after,
        (event.der_factor, scenarios.der_model),
        point_probes(second.points),
        TOLERANCE_PU,
    )
    phasors = measure(
        np.stack([before.v, after.v]),
        np.stack([_into(first, before), _into(second, after)]),
        scenarios.errors,
        bounds_of(case),
    )
    point, kind = scenarios.miswired
    if kind.any():
        phasors = miswire(phasors, point, kind)
    terminals, v_nominal_v = case.points.terminals, case.points.v_nominal_v
    evidence = evidence_of(phasors, terminals, v_nominal_v, *options)
    # of the state before the event; behind generation power may flow either way
    one_way = fed_one_way(first.points.terminals) & (not case.feeder.ders)
    edge = event.edge
    return Observed(
        evidence=with_alarm(evidence, wiring_alarm(phasors, terminals, v_nominal_v, one_way)),
        side=_sides(case, scenarios),
        connected=case.network.equipped[edge] & (edge >= 0),
        edge=edge,
        share=event.share,
        flags=before.flags | after.flags,
        fallen_ohm=_fallen_ohm(event),
    )


def _sides(case: Case, scenarios: Scenarios) -> NDArray[np.int8]:
    """(T, S): where each event stands; of wrong wiring, whether it is at an own point."""
    side = event_sides(case, scenarios.event)
    point, kind = scenarios.miswired
    if not kind.any():
        return side
    own = np.array([(t.local_point, t.remote_point) for t in case.points.terminals])
    mine = (own[:, :, None] == point).any(axis=1)
    return np.where(kind > 0, np.where(mine, Side.PATH, Side.OTHER), side).astype(np.int8)


def _fallen_ohm(event: Event) -> NDArray[np.float64]:
    """(S,) resistance to earth of a break's fallen end."""
    broken = event.open_after != 0
    to_earth = np.abs(event.earth_after_s).max(axis=0) + np.abs(event.fallen_after_s).max(axis=0)
    lies = broken & (to_earth > 0)
    return np.where(lies, 1.0 / np.where(lies, to_earth, 1.0), np.inf)


def _into(wired: Wired, answer: Answer) -> NDArray[np.complex128]:
    """(P, 3, S) currents, positive into each point's line."""
    return answer.i * into_line(wired.points)[:, None, None]
