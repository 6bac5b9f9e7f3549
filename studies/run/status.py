"""The status of a terminal, and the reason for it in a reader's words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...optimise.staircase import Front, factors, nearest
from ...optimise.thresholds import Choice, Obstacle, Refusal
from ...optimise.windows import Window, loop_window, overlap, remedy
from ..spec.parts import Study
from .blocks import block_name
from .cases import Case
from .classes import REPORTED, DrawClass, Purpose
from .draw import BlockId

__all__ = [
    "common_window",
    "impedance_note",
    "load_side_status",
    "loop_note",
    "nearest_false_trip",
    "refusal_in_brief",
    "refusal_text",
    "scenario_name",
    "status_of",
    "window_of",
]

FEW_EFFECTIVE = 0.1  #: below this share of effective trials, zero trips show little
NAMED = 3  #: classes that a reason names before it only counts the rest

#: all three phases change alike, but for windings and loads that are not balanced
BALANCED = (
    DrawClass.SOURCE_STEP,
    DrawClass.CAPACITOR_STEP,
    DrawClass.MOTOR_START,
    DrawClass.REGULATOR_TAP,
    DrawClass.TIE_SWITCHING,
    DrawClass.TRANSFER,
    DrawClass.DER_TRIP,
    DrawClass.DER_RAMP,
    DrawClass.ENERGISATION,
    DrawClass.RECLOSING,
)

LOAD_SIDE = "with the section cut, nothing behind this terminal feeds it"

WORDS = {(own.name, own.side): own.words for own in REPORTED}
DRAWN_OF = {own.name: own.drawn for own in REPORTED}


# ---- of a terminal that has settings ----


def status_of(case: Case, row: dict[str, Any], front: Front, attempt: int) -> tuple[str, str]:
    """Status and reason, from a row's counts and the false trips that validation showed."""
    demand = case.study.certificate
    must_not = [own for own in row["classes"] if own["kind"] == "must_not_trip"]
    note = _weak_evidence(must_not)
    if row["false_trips"]:
        return "not_certified", _false_trips(case, row, must_not, front, attempt)
    if row["false_trip_upper"] > demand.target:
        return "not_certified", (
            f"no false trip, but the bound {row['false_trip_upper']:.2g} per event is above the "
            f"target {demand.target:.2g}: too few scenarios{note}"
        )
    sure = math.floor(row["dependability_low"] * 1000) / 1000
    if row["dependability_low"] >= demand.find_at_least:
        return "set", f"no false trip, finds at least {sure:.3f}{note}"
    return "weak", (
        f"no false trip, but finds only {sure:.3f} for sure, {demand.find_at_least:g} wanted{note}"
    )


def _false_trips(
    case: Case, row: dict[str, Any], must_not: list[dict[str, Any]], front: Front, attempt: int
) -> str:
    """The worst class with its count and worst scenario, and how many others tripped."""
    worst = max(must_not, key=lambda own: own["trips"] / max(own["trials"], 1))
    others = sum(own["trips"] > 0 for own in must_not) - 1
    more = f", and some in {_counted(others, 'other class', 'es')}" if others else ""
    of_worst = front.scenario[:, 0] == DRAWN_OF[worst["name"]]
    front = front.where(of_worst) if of_worst.any() else front
    n, _ = nearest(front, row["i_set_a"], row["v_set_pu"], row["z_set_ohm"])
    scenario = scenario_name(Purpose.VALIDATE, attempt, front.scenario[n])
    return (
        f"{_counted(worst['trips'], 'false trip')} of {worst['trials']} in {_words(worst)}{more}; "
        f"worst scenario {scenario}"
    )


def load_side_status(row: dict[str, Any] | None) -> tuple[str, str]:
    """Of a terminal that looks away from the source: without settings (None), or harmless."""
    if row is None:
        return "load_side", LOAD_SIDE
    sure = math.floor(row["dependability_low"] * 1000) / 1000
    return "load_side", f"{LOAD_SIDE}; no false trip, finds at least {sure:.3f} all the same"


def _weak_evidence(must_not: list[dict[str, Any]]) -> str:
    """A note that names the classes whose events hardly ever came near the thresholds."""
    hollow = [
        _words(own) for own in must_not if own["effective_trials"] < FEW_EFFECTIVE * own["trials"]
    ]
    if not hollow:
        return ""
    return f"; few of the {_listed(hollow)} come near the thresholds: their zero is weak evidence"


def _words(own: dict[str, Any]) -> str:
    """A class and its side in words."""
    return WORDS[own["name"], own["side"]]


def _listed(names: list[str]) -> str:
    """A few names; past them, how many more there are.

    Examples
    --------
    >>> _listed(["a", "b", "c"]), _listed(list("abcdef"))
    ('a, b and c', 'a, b, c and 3 other classes')
    """
    more = len(names) - NAMED
    if more > 1:
        names = [*names[:NAMED], f"{more} other classes"]
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _counted(count: int, noun: str, plural: str = "s") -> str:
    return f"{count} {noun}{plural if count > 1 else ''}"


# ---- of training ----


def scenario_name(purpose: Purpose, attempt: int, scenario: NDArray[np.int64]) -> str:
    """A scenario's identity: its block's name, and its place in the block."""
    drawn, block, index, group = (int(n) for n in scenario)
    which = BlockId(
        seed=0,  # no part of the name
        purpose=purpose,
        attempt=attempt,
        group=group,
        drawn=DrawClass(drawn),
        block=block,
    )
    return f"{block_name(which)}:{index}"


def nearest_false_trip(
    choice: Choice, training_front: Front, attempt: int
) -> dict[str, Any] | None:
    """The training event that a setting comes closest to tripping in."""
    n, factor = nearest(training_front, choice.i_set_a, choice.v_set_pu, choice.z_set_ohm)
    if n < 0 or not math.isfinite(factor):
        return None
    return {
        "class": DrawClass(int(training_front.scenario[n, 0])).name.lower(),
        "factor": factor,
        "scenario": scenario_name(Purpose.TRAIN, attempt, training_front.scenario[n]),
    }


def refusal_text(groups: Sequence[Case], t: int, refusal: Refusal, front: Front) -> str:
    """Why a terminal has no setting for these groups, and what may help."""
    if refusal.obstacle in (Obstacle.EMPTY_WINDOW, Obstacle.COARSE_DEVICE):
        return _closed_loops(groups, t, refusal)
    own = groups[0].study
    margin = own.certificate.margin
    blocking = _blocking(margin, refusal, front)
    which = "the device"
    ways = ["a lower margin"]
    if refusal.obstacle is Obstacle.WINDOW_MARGIN:
        which = f"the closed loop's window of Z_set, {_span(common_window(groups, t))},"
        ways += ["a device with a smaller V_set", "an open loop"]
    else:
        ways += ["a device with larger I_set and Z_set or a smaller V_set"]
    if blocking and blocking[0] in BALANCED and not own.detector.unbalance:
        ways.insert(0, "the detector's option unbalance, since these are balanced")
    said = f"no setting of {which} keeps the margin {margin:g} in training"
    if refusal.closest is not None and blocking:
        kept = math.floor(refusal.closest.margin * 100) / 100
        drawn, share = blocking
        said += f": the most secure keeps {kept:g}; {share:.0%} of what blocks it are {drawn.words}"
    return f"{said}. What may help: {_any_of(ways)}"


def refusal_in_brief(study: Study, refusal: Choice | Refusal, limit: str = "") -> str | None:
    """The same in a clause, for a setting within a ``limit``; None where there is a choice."""
    if isinstance(refusal, Choice):
        return None
    if refusal.obstacle in (Obstacle.EMPTY_WINDOW, Obstacle.COARSE_DEVICE):
        return "no Z_set keeps the closed loop's margins"
    loop = " in the closed loop's window" if refusal.obstacle is Obstacle.WINDOW_MARGIN else ""
    return f"no setting{limit}{loop} keeps the margin {study.certificate.margin:g}"


def _blocking(margin: float, refusal: Refusal, front: Front) -> tuple[DrawClass, float] | None:
    """The class that blocks the most secure setting most, and its share of the events that do."""
    own = refusal.closest
    if own is None or not front.size:
        return None
    settings = (np.array([x]) for x in (own.i_set_a, own.v_set_pu, own.z_set_ohm))
    each = factors(front, *settings)[:, 0]
    # an event may have several rows, one for each way to trip
    blocking = np.unique(front.scenario[each < margin], axis=0)[:, 0]
    if not blocking.size:
        return None
    drawn = DrawClass(int(np.bincount(blocking).argmax()))
    return drawn, float((blocking == drawn).mean())


def _any_of(ways: list[str]) -> str:
    """Ways to choose from, in words.

    Examples
    --------
    >>> _any_of(["a", "b", "c"]), _any_of(["a"])
    ('a, b, or c', 'a')
    """
    return ", ".join([*ways[:-1], f"or {ways[-1]}"]) if len(ways) > 1 else ways[0]


def impedance_note(row: dict[str, Any], margin: float) -> str | None:
    """What has to be said of a Z_set that does not lie between the line and the breaks.

    Examples
    --------
    >>> line = {"line_z1_ohm": [0.3, 0.4], "least_z_op_ohm": 80.0, "negative_sign": True}
    >>> impedance_note(line | {"z_set_ohm": 5.0}, 1.25) is None
    True
    >>> impedance_note(line | {"z_set_ohm": 0.5}, 1.25)
    'Z_set is 1 times the line of 0.5 Ω, which harmless events show: the sign keeps them out'
    """
    line, least, z = abs(complex(*row["line_z1_ohm"])), row["least_z_op_ohm"], row["z_set_ohm"]
    said = []
    if z < margin * line:
        why = "the sign keeps them out" if row["negative_sign"] else "none came near I_set"
        said.append(
            f"Z_set is {z / line:.2g} times the line of {line:.3g} Ω, which harmless events "
            f"show: {why}"
        )
    if least is not None and least <= z:
        said.append(f"some breaks show no more than Z_set, |Z1| down to {least:.3g} Ω")
    return "; ".join(said) or None


# ---- of a closed loop ----


def window_of(case: Case, t: int) -> Window | None:
    """Where Z_set must lie in the closed loop around a terminal's section; None: no loop."""
    terminal = case.points.terminals[t]
    if terminal.loop_z1_ohm is None:
        return None
    margins = case.study.certificate.loop_margins
    return loop_window(terminal.line_z1_ohm, terminal.loop_z1_ohm, margins)


def common_window(groups: Sequence[Case], t: int) -> Window | None:
    """What the loops of all these groups leave; None: there is none in any."""
    windows = [own for own in (window_of(case, t) for case in groups) if own is not None]
    return overlap(windows) if windows else None


def loop_note(case: Case, t: int, z_set_ohm: float) -> str | None:
    """What has to be said of a Z_set that a closed loop does not allow."""
    window = window_of(case, t)
    if window is None or bool(window.holds(np.array([z_set_ohm]))[0]):
        return None
    m1, m2 = case.study.certificate.loop_margins
    wanted = "no Z_set keeps both" if window.empty else f"{_span(window)} wanted"
    return (
        f"Z_set {z_set_ohm:.10g} Ω does not keep the closed loop's margins, {m1:g} towards "
        f"harmless events and {m2:g} towards breaks: {wanted}"
    )


def _closed_loops(groups: Sequence[Case], t: int, refusal: Refusal) -> str:
    """Why closed loops leave no Z_set that the device can hold, and what may help."""
    looped = [case for case in groups if window_of(case, t) is not None]
    separate = " or settings of their own for each group" if len(groups) > 1 else ""
    if len(looped) > 1:
        spans = " and ".join(f"{case.group.name}: {_span(window_of(case, t))}" for case in looped)
        return f"closed loops: no one Z_set lies in the windows of all groups, {spans}{separate}"
    case = looped[0]
    terminal, margins = case.points.terminals[t], case.study.certificate.loop_margins
    assert terminal.loop_z1_ohm is not None
    (m1, m2), whole = margins, terminal.loop_z1_ohm
    section, rest = abs(terminal.line_z1_ohm), abs(whole - terminal.line_z1_ohm)
    found = remedy(terminal.line_z1_ohm, whole, margins, np.array(case.study.device.z_grid()))
    none, ways = "no Z_set is", []
    if refusal.obstacle is Obstacle.COARSE_DEVICE:
        none = "no Z_set of the device is"
        ways.append(f"a device with a Z_set of {_span(window_of(case, t))}")
    if found.longest_section_ohm > 0:
        ways.append(f"a section of at most {_down(found.longest_section_ohm)} Ω")
    ways += [
        f"a loop margin {name} of at most {_down(value)} instead of {now:g}"
        for name, value, now in (("m1", found.m1, m1), ("m2", found.m2, m2))
        if 1.0 <= value < now
    ]
    ways.append(f"an open loop{separate}")
    return (
        f"closed loop: Z_set must be at least {m1:g} times the section's {section:.3g} Ω, that is "
        f"{m1 * section:.3g} Ω, and at most the {rest:.3g} Ω that a break inside shows, divided by "
        f"{m2:g}, that is {rest / m2:.3g} Ω; {none}. What may help: {_any_of(ways)}"
    )


def _down(value: float) -> str:
    """Rounded down, to three digits: what is said to do must do."""
    digits = 2 - math.floor(math.log10(value)) if value > 0 else 0
    return f"{math.floor(value * 10.0**digits) / 10.0**digits:.10g}"


def _span(window: Window | None) -> str:
    assert window is not None
    return f"{window.low_ohm:.3g} to {window.high_ohm:.3g} Ω"
