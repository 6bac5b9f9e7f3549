"""What is kept of a block: enough to choose settings, or to certify given ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...detector.criteria import Reason, Settings, reach_ohm, verdict
from ...detector.evidence import Evidence
from ...model.breaks import DEAD, FLOATING
from ...model.states import NOT_CONVERGED
from ...optimise.counts import Corners, Grid, corners_of
from ...optimise.staircase import Front, front_of
from .along import distance_share
from .classes import REPORTED, DrawClass
from .draw import BlockId, Case, draw_scenarios
from .engine import BLOCK, Observed, observe

__all__ = ["PLACES", "Tested", "Trained", "device_grid", "judge_block", "train_block"]

PLACES = 40  #: stretches of a section in which breaks are counted for the profile
KEPT = 40  #: scenarios of a block whose evidence is kept for pictures

Int = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trained:
    """What the choice of settings needs of a block, per terminal."""

    opens: tuple[Corners, ...]  #: internal breaks with something beyond them
    stiff: tuple[Corners, ...]  #: the same, reduced by the demanded margin
    false: tuple[Corners, ...]  #: events that must not trip
    front: tuple[Front, ...]  #: of the same events
    trials: Int  #: (R, T) per reported class
    reachable: Int  #: (T,)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tested:
    """What given settings do in a block. K settings a terminal; the first is the chosen one."""

    trials: Int  #: (R, T) per reported class
    effective: Int  #: (R, T) with |ΔI1| > I_set/2 and |ΔV1| <= V_set
    trips: Int  #: (K, R, T)
    reachable: Int  #: (T,) internal breaks with something connected beyond them
    found: Int  #: (K, T) of these
    missed: Int  #: (T, Reason) of these, by the criterion that failed
    profile: Int  #: (T, PLACES, 2) internal breaks along the section: all, found
    front: tuple[Front, ...]  #: false trips of the chosen setting, per terminal
    flags: Int  #: (3,) scenarios dead, floating, not converged
    sample: NDArray[np.float64]  #: (T, 4, KEPT) |ΔI1| A, |ΔV1| pu, Z1 real and imaginary Ω
    sample_side: NDArray[np.int8]  #: (T, KEPT)


def device_grid(case: Case) -> Grid:
    """The settings that the study's device can hold."""
    device = case.study.device
    return Grid(
        i_set_a=np.array(device.i_grid()),
        v_set_pu=np.array(device.v_grid_pu()),
        z_set_ohm=np.array(device.z_grid()),
    )


def train_block(case: Case, which: BlockId, size: int = BLOCK) -> Trained:
    """Draw and judge a training block for every setting of the device at once."""
    seen = observe(case, draw_scenarios(case, which, size))
    grid, margin = device_grid(case), case.study.certificate.margin
    evidence = seen.evidence
    reach = reach_ohm(evidence, case.study.detector.negative_sign)
    identity = _identity(which, size)
    terminals = range(len(case.points.terminals))
    opens, stiff, false, front = [], [], [], []
    for t in terminals:
        i, v, z = evidence.di1_a[t], evidence.dv1_pu[t], reach[t]
        judged = not case.points.terminals[t].load_side
        must = _of_kind("must_trip", which.drawn, seen.side[t]) & seen.connected & judged
        must_not = _of_kind("must_not_trip", which.drawn, seen.side[t]) & judged
        opens.append(corners_of(grid, i[must], v[must], z[must]))
        stiff.append(corners_of(grid, i[must] / margin, v[must] * margin, z[must] / margin))
        false.append(corners_of(grid, i[must_not], v[must_not], z[must_not]))
        front.append(front_of(i[must_not], v[must_not], z[must_not], identity[must_not]))
    return Trained(
        opens=tuple(opens),
        stiff=tuple(stiff),
        false=tuple(false),
        front=tuple(front),
        trials=_trials(which.drawn, seen.side),
        reachable=_reachable(which.drawn, seen).sum(axis=1),
    )


def judge_block(
    case: Case, which: BlockId, settings: tuple[tuple[Settings | None, ...], ...], size: int = BLOCK
) -> Tested:
    """Draw and judge a validation block.

    ``settings[t]`` holds the K settings of terminal t, the chosen one first; None never trips.
    """
    seen = observe(case, draw_scenarios(case, which, size))
    terminals, evidence = len(case.points.terminals), seen.evidence
    ways = len(settings[0])
    reason = np.full((ways, terminals, size), Reason.BLOCKED, np.int8)
    effective = np.zeros((len(REPORTED), terminals), np.int64)
    fronts = []
    identity = _identity(which, size)
    reach = reach_ohm(evidence, case.study.detector.negative_sign)
    for t in range(terminals):
        one = _only(evidence, t)
        for k, own in enumerate(settings[t]):
            if own is not None:
                reason[k, t] = verdict(one, own)[0]
        chosen = settings[t][0]
        if chosen is not None:
            near = (evidence.di1_a[t] > chosen.i_set_a / 2) & (
                evidence.dv1_pu[t] <= chosen.v_set_pu
            )
            effective[:, t] = [
                (near & _in_class(r, which.drawn, seen.side[t])).sum() for r in range(len(REPORTED))
            ]
        bad = _of_kind("must_not_trip", which.drawn, seen.side[t]) & (reason[0, t] == Reason.TRIP)
        fronts.append(
            front_of(evidence.di1_a[t, bad], evidence.dv1_pu[t, bad], reach[t, bad], identity[bad])
        )
    trip = reason == Reason.TRIP
    reachable = _reachable(which.drawn, seen)
    kept = slice(0, KEPT)
    return Tested(
        trials=_trials(which.drawn, seen.side),
        effective=effective,
        trips=np.stack([_trials(which.drawn, seen.side, trip[k]) for k in range(ways)]),
        reachable=reachable.sum(axis=1),
        found=(trip & reachable).sum(axis=2),
        missed=np.stack(
            [
                np.bincount(reason[0, t, reachable[t] & ~trip[0, t]], minlength=len(Reason))
                for t in range(terminals)
            ]
        ),
        profile=_profile(case, which.drawn, seen, trip[0]),
        front=tuple(fronts),
        flags=np.array([(seen.flags & bit != 0).sum() for bit in (DEAD, FLOATING, NOT_CONVERGED)]),
        sample=np.stack(
            [
                evidence.di1_a[:, kept],
                evidence.dv1_pu[:, kept],
                evidence.z1_ohm.real[:, kept],
                evidence.z1_ohm.imag[:, kept],
            ],
            axis=1,
        ),
        sample_side=seen.side[:, kept],
    )


def _identity(which: BlockId, size: int) -> Int:
    """(S, 3): class, block and index, by which fronts know their scenarios."""
    return np.column_stack(
        (np.full(size, int(which.drawn)), np.full(size, which.block), np.arange(size))
    )


def _only(evidence: Evidence, t: int) -> Evidence:
    """The evidence of one terminal, still two-dimensional."""
    one = slice(t, t + 1)
    return Evidence(
        di1_a=evidence.di1_a[one],
        dv1_pu=evidence.dv1_pu[one],
        z1_ohm=evidence.z1_ohm[one],
        blocked=evidence.blocked[one],
        undefined=evidence.undefined[one],
    )


def _in_class(r: int, drawn: DrawClass, side: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Scenarios that count in reported class r."""
    own = REPORTED[r]
    return np.isin(side, own.where) if own.drawn == drawn else np.zeros(side.shape, np.bool_)


def _of_kind(kind: str, drawn: DrawClass, side: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Scenarios in any reported class of this kind."""
    masks = [_in_class(r, drawn, side) for r, own in enumerate(REPORTED) if own.kind == kind]
    return np.asarray(np.any(masks, axis=0))


def _trials(
    drawn: DrawClass, side: NDArray[np.int8], among: NDArray[np.bool_] | None = None
) -> Int:
    """(R, T): scenarios in each reported class, or those of them that are ``among``."""
    masks = np.stack([_in_class(r, drawn, side) for r in range(len(REPORTED))])
    return np.asarray((masks if among is None else masks & among).sum(axis=2), np.int64)


def _reachable(drawn: DrawClass, seen: Observed) -> NDArray[np.bool_]:
    """(T, S): internal breaks with something connected beyond them."""
    return _of_kind("must_trip", drawn, seen.side) & seen.connected


def _profile(case: Case, drawn: DrawClass, seen: Observed, trip: NDArray[np.bool_]) -> Int:
    """(T, PLACES, 2): internal breaks by distance from the local point, all and found."""
    terminals = case.points.terminals
    counts = np.zeros((len(terminals), PLACES, 2), np.int64)
    for t, terminal in enumerate(terminals):
        inside = _of_kind("must_trip", drawn, seen.side[t])
        along = distance_share(case, terminal.local_point, terminal.on_path, seen, inside)
        place = np.minimum((along * PLACES).astype(np.int64), PLACES - 1)
        counts[t, :, 0] = np.bincount(place, minlength=PLACES)
        counts[t, :, 1] = np.bincount(place[trip[t, inside]], minlength=PLACES)
    return counts
