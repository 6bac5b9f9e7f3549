"""What is kept of a block: enough to choose settings, or to certify given ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...detector.criteria import Options, Reach, Reason, Settings, reach_of, verdict
from ...detector.evidence import only
from ...model.solver.breaks import DEAD, FLOATING
from ...model.states import NOT_CONVERGED, UNEARTHED
from ...optimise.counts import Corners, corners_of
from ...optimise.staircase import Front, front_of
from .along import distance_share
from .cases import Case
from .classes import FALLEN, FALLEN_OHM, INSIDE, REPORTED, DrawClass, reported_row
from .draw import BlockId, draw_scenarios
from .engine import BLOCK, Observed, observe
from .verdicts import pack_verdicts

__all__ = ["PLACES", "Tested", "Trained", "judge_block", "train_block"]

PLACES = 40  #: stretches of a section in which breaks are counted for the profile
KEPT = 40  #: scenarios of a block whose evidence is kept for pictures

FLAGGED = (DEAD, FLOATING, UNEARTHED, NOT_CONVERGED)
"""A dead conductor; a floating island; a part that nothing earths; no solution."""

Int = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trained:
    """What the choice of settings needs of a block, per terminal."""

    opens: tuple[Corners, ...]  #: internal breaks with something beyond them
    stiff: tuple[Corners, ...]  #: the same, reduced by the demanded margin
    false: tuple[Corners, ...]  #: events that must not trip
    front: tuple[Front, ...]  #: of the same events
    trials: Int  #: (R, T) per reported class
    reachable: Int  #: (T,)
    flags: Int  #: (4,) scenarios by ``FLAGGED``


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tested:
    """What given settings do in a block. K settings a terminal; the first is the chosen one."""

    trials: Int  #: (R, T) per reported class
    effective: Int  #: (R, T) with |ΔI| > I_set/2 and |ΔV| <= V_set, of any row that is judged
    trips: Int  #: (K, R, T)
    alarms: Int  #: (R, T) with the wiring alarm
    fallen: Int  #: (2, bands, T, 2) inside by end and ohms as in ``FALLEN``: all, and trips
    reachable: Int  #: (T,) internal breaks with something connected beyond them
    found: Int  #: (K, T) of these
    missed: Int  #: (T, Reason) of these, by the criterion that failed
    profile: Int  #: (T, PLACES, 2) internal breaks along the section: all, found
    front: tuple[Front, ...]  #: false trips of the chosen setting, per terminal
    least_z_ohm: NDArray[np.float64]  #: (T,) smallest |Z1| of these, see ``_least_z``
    flags: Int  #: (4,) scenarios by ``FLAGGED``
    verdicts: NDArray[np.uint8]  #: (T, S) what the first setting said, as ``pack_verdicts``
    sample: NDArray[np.float64]  #: (T, 5, KEPT) as ``_sample`` has it
    sample_side: NDArray[np.int8]  #: (T, KEPT)


def train_block(case: Case, which: BlockId, size: int = BLOCK) -> Trained:
    """Draw and judge a training block for every setting of the device at once."""
    options = case.study.detector.options()
    seen = observe(case, draw_scenarios(case, which, size), options)
    grid, margin = case.grid, case.study.certificate.margin
    reach = reach_of(seen.evidence, options)
    rows, identity = _rows(which.drawn, seen), _identity(which, size)
    opens, stiff, false, front = [], [], [], []
    for t, terminal in enumerate(case.points.terminals):
        i, v, z = reach.di_a[t], reach.dv_pu[t], reach.z_ohm[t]
        must = _of_kind("must_trip", rows[t]) & seen.connected
        must &= bool(case.judged[t]) and not terminal.load_side
        must &= seen.flags & NOT_CONVERGED == 0
        must_not = _of_kind("must_not_trip", rows[t]) & case.judged[t]
        own = i[:, must], v[:, must], z[:, must]
        other = i[:, must_not], v[:, must_not], z[:, must_not]
        opens.append(corners_of(grid, *own))
        stiff.append(corners_of(grid, own[0] / margin, own[1] * margin, own[2] / margin))
        false.append(corners_of(grid, *other))
        front.append(front_of(*other, identity[must_not]))
    return Trained(
        opens=tuple(opens),
        stiff=tuple(stiff),
        false=tuple(false),
        front=tuple(front),
        trials=_counted(rows),
        reachable=_reachable(rows, seen).sum(axis=1),
        flags=_flags(seen),
    )


def judge_block(
    case: Case, which: BlockId, settings: tuple[tuple[Settings | None, ...], ...], size: int = BLOCK
) -> Tested:
    """Draw and judge a validation block.

    ``settings[t]`` holds the K settings of terminal t, the chosen one first; None never trips.
    """
    asked = _asked(settings)
    seen = observe(case, draw_scenarios(case, which, size), *asked)
    evidence, rows = seen.evidence, _rows(which.drawn, seen)
    reason = _reasons(seen, settings, size)
    reachable = _reachable(rows, seen)
    # a break without a solution is no find
    reason[:, reachable & (seen.flags & NOT_CONVERGED != 0)] = Reason.BLOCKED
    trip = reason == Reason.TRIP
    terminals = range(len(settings))
    missed = reachable & ~trip[0]
    reach = [_reach(seen, t, settings[t][0]) for t in terminals]
    return Tested(
        trials=_counted(rows),
        effective=_counted(rows, _effective(seen, settings)),
        trips=np.stack([_counted(rows, own) for own in trip]),
        alarms=_counted(rows, _alarmed(seen)),
        fallen=_fallen(which.drawn, seen, trip[0]),
        reachable=reachable.sum(axis=1),
        found=(trip & reachable).sum(axis=2),
        missed=np.stack(
            [np.bincount(reason[0, t, missed[t]], minlength=len(Reason)) for t in terminals]
        ),
        profile=_profile(case, rows, seen, trip[0]),
        front=tuple(
            _false_trips(reach[t], rows[t], trip[0, t], _identity(which, size)) for t in terminals
        ),
        least_z_ohm=np.array([_least_z(seen, t, settings[t][0], reachable[t]) for t in terminals]),
        flags=_flags(seen),
        verdicts=pack_verdicts(reason[0], seen.side, seen.connected),
        sample=np.stack(
            [_sample(reach[t], np.abs(evidence.z1_ohm[t]), reason[0, t]) for t in terminals]
        ),
        sample_side=seen.side[:, :KEPT],
    )


def _asked(settings: tuple[tuple[Settings | None, ...], ...]) -> tuple[Options, ...]:
    """The options of all settings, each once."""
    found = [own.options for pair in settings for own in pair if own is not None]
    return tuple(dict.fromkeys(found))


def _reasons(
    seen: Observed, settings: tuple[tuple[Settings | None, ...], ...], size: int
) -> NDArray[np.int8]:
    """(K, T, S) a Reason for each setting; blocked where there is none."""
    shape = (len(settings[0]), len(settings), size)
    reason = np.full(shape, Reason.BLOCKED, np.int8)
    for t, pair in enumerate(settings):
        one = only(seen.evidence, t)
        for k, own in enumerate(pair):
            if own is not None:
                reason[k, t] = verdict(one, own)[0]
    return reason


def _effective(seen: Observed, settings: tuple[tuple[Settings | None, ...], ...]) -> Flags:
    """(T, S) scenarios that come near the thresholds of the first setting."""
    found = np.zeros(seen.side.shape, np.bool_)
    for t, (chosen, *_) in enumerate(settings):
        if chosen is not None:
            rows = 4 if chosen.options.fallback else 1
            near = seen.evidence.di_a[t, :rows] > chosen.i_set_a / 2
            near &= seen.evidence.dv_pu[t, :rows] <= chosen.v_set_pu
            near[1:] &= seen.evidence.di1_a[t] < chosen.i_set_a  # where phases stand in
            found[t] = near.any(axis=0) & ~seen.evidence.blocked[t]
    return found


def _fallen(drawn: DrawClass, seen: Observed, trip: Flags) -> Int:
    """Fallen conductors inside, by which end and what resistance: all, and those that trip."""
    terminals = seen.side.shape[0]
    found = np.zeros((len(FALLEN), len(FALLEN_OHM) - 1, terminals, 2), np.int64)
    if drawn not in FALLEN:
        return found
    band = np.searchsorted(FALLEN_OHM, seen.fallen_ohm, side="right") - 1
    inside = np.isin(seen.side, INSIDE)
    for b in range(len(FALLEN_OHM) - 1):
        own = inside & (band == b)
        found[FALLEN.index(drawn), b] = np.stack([own.sum(axis=1), (own & trip).sum(axis=1)], 1)
    return found


def _alarmed(seen: Observed) -> Flags:
    alarm = seen.evidence.alarm
    return np.zeros(seen.side.shape, np.bool_) if alarm is None else alarm != 0


def _flags(seen: Observed) -> Int:
    """(4,): scenarios by ``FLAGGED``."""
    return np.array([(seen.flags & bit != 0).sum() for bit in FLAGGED])


def _least_z(seen: Observed, t: int, chosen: Settings | None, reachable: Flags) -> float:
    """Smallest |Z1| of the breaks in which I_set and V_set leave it to Z_set; inf: of none."""
    if chosen is None:
        return float("inf")
    own = seen.evidence
    left = reachable & (seen.flags & NOT_CONVERGED == 0) & ~own.blocked[t] & ~own.undefined[t, 0]
    left &= (own.di1_a[t] >= chosen.i_set_a) & (own.dv1_pu[t] <= chosen.v_set_pu)
    return float(np.abs(own.z1_ohm[t, left]).min(initial=np.inf))


def _reach(seen: Observed, t: int, chosen: Settings | None) -> Reach:
    """Reach at terminal t with the options of its setting; without one, of the bare criteria."""
    return reach_of(only(seen.evidence, t), chosen.options if chosen else Options(fallback=False))


def _sample(
    reach: Reach, z1_ohm: NDArray[np.float64], reason: NDArray[np.int8]
) -> NDArray[np.float64]:
    """(5, KEPT): what pictures show of one terminal's events.

    By the positive sequence: current A, |ΔV1| pu, |Z1| Ω, and the largest Z_set at which it can
    trip, 0 for none; then the Reason that the first setting gives.
    """
    rows = (reach.di_a[0, 0], reach.dv_pu[0, 0], z1_ohm, reach.z_ohm[0, 0], reason)
    return np.stack([np.asarray(row, np.float64)[:KEPT] for row in rows])


def _false_trips(reach: Reach, rows: Int, trip: Flags, identity: Int) -> Front:
    """The front of the events that tripped the chosen setting of a terminal and must not."""
    bad = _of_kind("must_not_trip", rows) & trip
    return front_of(
        reach.di_a[0][:, bad], reach.dv_pu[0][:, bad], reach.z_ohm[0][:, bad], identity[bad]
    )


def _identity(which: BlockId, size: int) -> Int:
    """(S, 4): class, block, index and group, by which fronts know their scenarios."""
    found = np.empty((size, 4), np.int64)
    found[:, 0], found[:, 1], found[:, 3] = which.drawn, which.block, which.group
    found[:, 2] = np.arange(size)
    return found


def _rows(drawn: DrawClass, seen: Observed) -> Int:
    """(T, S): the row of ``REPORTED`` in which each event counts; -1: in none."""
    return reported_row(drawn)[seen.side]


_KINDS = np.array([own.kind for own in REPORTED] + [""])


def _of_kind(kind: str, rows: Int) -> Flags:
    """Events that count in rows of this kind."""
    return np.asarray(np.equal(_KINDS, kind)[rows])


def _counted(rows: Int, among: Flags | None = None) -> Int:
    """(R, T): events in each row of ``REPORTED``, or those of them that are ``among``."""
    found = np.zeros((len(REPORTED), rows.shape[0]), np.int64)
    for t, own in enumerate(rows):
        chosen = own if among is None else own[among[t]]
        found[:, t] = np.bincount(chosen[chosen >= 0], minlength=len(REPORTED))
    return found


def _reachable(rows: Int, seen: Observed) -> Flags:
    """(T, S): internal breaks with something connected beyond them."""
    return _of_kind("must_trip", rows) & seen.connected


def _profile(case: Case, rows: Int, seen: Observed, trip: Flags) -> Int:
    """(T, PLACES, 2): internal breaks by distance from the local point, all and found."""
    terminals = case.points.terminals
    counts = np.zeros((len(terminals), PLACES, 2), np.int64)
    for t, terminal in enumerate(terminals):
        inside = _of_kind("must_trip", rows[t])
        if not inside.any():
            continue
        along = distance_share(case, terminal.local_point, terminal.on_path, seen, inside)
        place = np.minimum((along * PLACES).astype(np.int64), PLACES - 1)
        counts[t, :, 0] = np.bincount(place, minlength=PLACES)
        counts[t, :, 1] = np.bincount(place[trip[t, inside]], minlength=PLACES)
    return counts
