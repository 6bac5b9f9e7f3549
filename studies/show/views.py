"""What the pictures of a report show: plain data, taken from a finished sizing."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...detector.criteria import Reason
from ...optimise.certificate import two_sided
from ...optimise.staircase import Front, border
from ..run.along import path_starts
from ..run.cases import Case
from ..run.certify import Validation
from ..run.classes import REPORTED, DrawClass, reported_row
from ..run.status import window_of
from ..run.tally import PLACES
from .sheet import terminal_name

__all__ = [
    "Bar",
    "Cloud",
    "EvidenceView",
    "Family",
    "OverviewView",
    "ProfileView",
    "Setting",
    "evidence_view",
    "overview_view",
    "profile_view",
]

Real = NDArray[np.float64]

NEAR = 0.03  #: tees closer than this share of a section share a label


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """Thresholds of one terminal."""

    i_set_a: float
    v_set_pu: float
    z_set_ohm: float


class Family(StrEnum):
    """Classes that share a colour, in a reader's words."""

    INSIDE = "break inside: must trip"
    OUTSIDE = "open phase elsewhere"
    LOAD = "load, capacitor or motor step"
    SOURCE = "source step, regulator tap"
    FAULT = "fault"
    SWITCHING = "switching, energisation"
    DER = "DER trip or ramp"
    PAIR = "two events at once"


FAMILY = {
    DrawClass.OPEN_PHASE: Family.OUTSIDE,
    DrawClass.SINGLE_POLE: Family.OUTSIDE,
    DrawClass.FALLEN_SOURCE_SIDE: Family.OUTSIDE,
    DrawClass.FALLEN_LOAD_SIDE: Family.OUTSIDE,
    DrawClass.LOAD_STEP: Family.LOAD,
    DrawClass.CAPACITOR_STEP: Family.LOAD,
    DrawClass.MOTOR_START: Family.LOAD,
    DrawClass.SOURCE_STEP: Family.SOURCE,
    DrawClass.REGULATOR_TAP: Family.SOURCE,
    DrawClass.EARTH_FAULT: Family.FAULT,
    DrawClass.LINE_FAULT: Family.FAULT,
    DrawClass.TIE_SWITCHING: Family.SWITCHING,
    DrawClass.TRANSFER: Family.SWITCHING,
    DrawClass.ENERGISATION: Family.SWITCHING,
    DrawClass.RECLOSING: Family.SWITCHING,
    DrawClass.DER_TRIP: Family.DER,
    DrawClass.DER_RAMP: Family.DER,
    DrawClass.OPEN_WITH_LOAD_STEP: Family.PAIR,
    DrawClass.OPEN_WITH_DER_TRIP: Family.PAIR,
    DrawClass.LOAD_SWAP: Family.PAIR,
    DrawClass.STEP_WITH_TAP: Family.PAIR,
}
"""Of every class that may count as a false trip."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cloud:
    """The sampled events of one family of classes."""

    family: Family
    di1_a: Real
    z1_ohm: Real
    able: NDArray[np.bool_]  #: by its positive sequence it can trip, at this V_set
    trips: NDArray[np.bool_]  #: the setting trips, by whatever sequence or phase


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EvidenceView:
    """One terminal's events, and the settings among them, at one V_set."""

    terminal: str
    v_set_pu: float
    clouds: tuple[Cloud, ...]
    border: tuple[Real, Real] | None  #: of the settings that trip falsely; None: no training
    margin_border: tuple[Real, Real] | None  #: of those that do not keep the demanded margin
    margin: float
    chosen: Setting | None
    word: str  #: what the setting is called
    reference: Setting
    window_ohm: tuple[float, float] | None  #: of Z_set in a closed loop; None: no loop, or empty
    device_a: tuple[float, float]  #: smallest and largest I_set
    device_ohm: tuple[float, float]
    limits_a: tuple[float, float]  #: of the axes; events beyond are moved to the edge
    limits_ohm: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProfileView:
    """Share of the breaks that a terminal finds, along its section."""

    terminal: str
    local: str
    remote: str
    confidence: float
    edges_km: Real  #: (PLACES + 1,)
    share: Real  #: (PLACES,) NaN where no break was drawn
    low: Real
    high: Real
    found: int
    breaks: int
    blind_km: tuple[tuple[float, float], ...]  #: stretches with nothing connected beyond
    tees: tuple[tuple[float, str], ...]  #: km from the local point, and what leaves there


@dataclass(frozen=True, slots=True, kw_only=True)
class Bar:
    """One setting of one terminal; share None where there is none to show, or no setting."""

    share: float | None
    reason: str | None  #: why there is no setting
    low: float
    high: float
    false_trips: int
    trials: int


@dataclass(frozen=True, slots=True, kw_only=True)
class OverviewView:
    """The compared settings of all judged terminals."""

    names: tuple[str, ...]  #: of the settings
    terminals: tuple[str, ...]
    bars: tuple[tuple[Bar, ...], ...]  #: per terminal, one for each name


def evidence_view(
    case: Case, t: int, row: dict[str, Any], front: Front | None, validation: Validation
) -> EvidenceView:
    """What the evidence picture of terminal ``t`` shows; ``row`` is its part of the result."""
    study = case.study
    wanted = study.reference
    reference = Setting(
        i_set_a=wanted.i_set_a, v_set_pu=wanted.v_set_pct / 100.0, z_set_ohm=wanted.z_set_ohm
    )
    chosen = None
    if row["i_set_a"] is not None:
        chosen = Setting(
            i_set_a=row["i_set_a"], v_set_pu=row["v_set_pu"], z_set_ohm=row["z_set_ohm"]
        )
    v_set_pu = (chosen or reference).v_set_pu
    i_grid, z_grid = study.device.i_grid(), study.device.z_grid()
    clouds = _clouds(validation, t, v_set_pu)
    largest = max((float(c.di1_a.max()) for c in clouds if c.di1_a.size), default=0.0)
    margin, window = study.certificate.margin, window_of(case, t)
    return EvidenceView(
        terminal=_name(case, t),
        v_set_pu=v_set_pu,
        clouds=clouds,
        border=None if front is None else border(front, v_set_pu),
        margin_border=None if front is None else border(front, v_set_pu, margin),
        margin=margin,
        chosen=chosen,
        word="chosen" if front is not None else "assessed",
        reference=reference,
        window_ohm=(window.low_ohm, window.high_ohm) if window and not window.empty else None,
        device_a=(i_grid[0], i_grid[-1]),
        device_ohm=(z_grid[0], z_grid[-1]),
        limits_a=(0.5 * i_grid[0], 1.5 * max(i_grid[-1], largest)),
        limits_ohm=(0.5 * z_grid[0], 5.0 * z_grid[-1]),
    )


def _name(case: Case, t: int) -> str:
    """A terminal in titles, with its setting group where the study has several."""
    name = case.points.terminals[t].name
    return f"{name}, {case.group.name}" if len(case.study.setting_groups()) > 1 else name


def _clouds(validation: Validation, t: int, v_set_pu: float) -> tuple[Cloud, ...]:
    """The kept sample of terminal ``t`` by family, what must trip last, on top."""
    found: defaultdict[Family, list[Real]] = defaultdict(list)
    for which, sample, side in validation.samples:
        rows = reported_row(which.drawn)[side[t]]
        for r in np.unique(rows[rows >= 0]):
            kind = REPORTED[r].kind
            if kind != "apart":
                family = Family.INSIDE if kind == "must_trip" else FAMILY[which.drawn]
                found[family].append(sample[t][:, rows == r])
    clouds = []
    for family in (*list(Family)[1:], Family.INSIDE):
        if not found[family]:
            continue
        di1_a, dv1_pu, z1_ohm, reach_ohm, reason = np.concatenate(found[family], axis=1)
        cloud = Cloud(
            family=family,
            di1_a=di1_a,
            z1_ohm=z1_ohm,
            able=(dv1_pu <= v_set_pu) & (reach_ohm > 0),
            trips=reason == Reason.TRIP,
        )
        clouds.append(cloud)
    return tuple(clouds)


def profile_view(case: Case, t: int, validation: Validation) -> ProfileView:
    """What the picture of dependability along the section of terminal ``t`` shows."""
    terminal, confidence = case.points.terminals[t], case.study.certificate.confidence
    counts = validation.profile[t]
    intervals = np.array([two_sided(int(k), int(n), 1.0 - confidence) for n, k in counts])
    drawn = counts[:, 0] > 0
    length_km = float(case.network.length_km[terminal.on_path].sum())
    share = np.full(PLACES, np.nan)
    np.divide(counts[:, 1], counts[:, 0], out=share, where=drawn)
    return ProfileView(
        terminal=_name(case, t),
        local=terminal.local,
        remote=terminal.remote,
        confidence=confidence,
        edges_km=np.linspace(0.0, length_km, PLACES + 1),
        share=share,
        low=np.where(drawn, intervals[:, 0], np.nan),
        high=np.where(drawn, intervals[:, 1], np.nan),
        found=int(counts[:, 1].sum()),
        breaks=int(counts[:, 0].sum()),
        blind_km=_blind_km(case, t),
        tees=_tees(case, t, length_km),
    )


def _blind_km(case: Case, t: int) -> tuple[tuple[float, float], ...]:
    """Stretches of the section, in km from the local point, with nothing connected beyond."""
    terminal, network = case.points.terminals[t], case.network
    starts, _ = path_starts(case, terminal.local_point, terminal.on_path)
    merged: list[tuple[float, float]] = []
    for k in sorted(np.flatnonzero(terminal.on_path & ~network.equipped), key=lambda k: starts[k]):
        begin, end = float(starts[k]), float(starts[k] + network.length_km[k])
        if merged and begin <= merged[-1][1] + 1e-9:
            begin = merged.pop()[0]
        merged.append((begin, end))
    return tuple(merged)


def _tees(case: Case, t: int, length_km: float) -> tuple[tuple[float, str], ...]:
    """Where transformers and loads leave the section, those close to each other together."""
    terminal, network = case.points.terminals[t], case.network
    starts, toward = path_starts(case, terminal.local_point, terminal.on_path)
    at_km: dict[str, float] = {}
    for k in np.flatnonzero(terminal.on_path):
        piece = network.pieces[k]
        assert piece is not None
        near, far = piece.ends if toward[k] == network.upward[k] else piece.ends[::-1]
        at_km[near] = float(starts[k])
        at_km[far] = float(starts[k] + network.length_km[k])
    leaving: defaultdict[float, list[str]] = defaultdict(list)
    for unit, node in zip(network.units, network.tree.unit_node.tolist(), strict=True):
        # from a unit on a lateral up to where that lateral leaves the path
        while network.nodes[node] not in at_km and terminal.in_section[node]:
            node = int(network.tree.parent[node])
        if network.nodes[node] in at_km:
            leaving[at_km[network.nodes[node]]].append(unit)
    tees: list[tuple[float, str]] = []
    for km, units in sorted(leaving.items()):
        if tees and km - tees[-1][0] < NEAR * length_km:
            before = tees.pop()
            tees.append((before[0], ", ".join([before[1], *units])))
        else:
            tees.append((km, ", ".join(units)))
    return tuple(tees)


def overview_view(result: dict[str, Any]) -> OverviewView:
    """What the overview picture shows."""
    bars: defaultdict[str, dict[str, Bar]] = defaultdict(dict)
    names = tuple(dict.fromkeys(row["name"] for row in result["compared"]))
    groups = len({row["setting_group"] for row in result["compared"]})
    for row in result["compared"]:
        name = terminal_name(row)
        if groups > 1:
            name += f", {row['setting_group']}"
        found, reachable = row["detected"] is not None, row["opens"] - row["unreachable"]
        bars[name][row["name"]] = Bar(
            share=row["detected"] / reachable if found and reachable else None,
            reason=row["reason"],
            low=row["dependability_low"] if found else 0.0,
            high=row["dependability_high"] if found else 0.0,
            false_trips=row["false_trips"] if found else 0,
            trials=row["trials"],
        )
    return OverviewView(
        names=names,
        terminals=tuple(bars),
        bars=tuple(tuple(own[name] for name in names) for own in bars.values()),
    )
