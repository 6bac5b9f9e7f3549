"""The classes of events: how they are drawn, and what each means to a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...model.events.base import Event
from ...model.points import Terminal
from ...model.sides import Side

__all__ = [
    "FALLEN",
    "FALLEN_OHM",
    "INSIDE",
    "NETWORK",
    "REPORTED",
    "DrawClass",
    "Kind",
    "Purpose",
    "ReportedClass",
    "Side",
    "SideName",
    "reported_row",
    "sides",
]


Kind = Literal["must_trip", "must_not_trip", "apart"]
SideName = Literal["inside", "upstream", "downstream", "other", "network"]


class Purpose(IntEnum):
    """What a sample is for; part of its random stream, so append only."""

    TRAIN = 0
    HUNT = 1
    VALIDATE = 2
    PLACE = 3
    SENSITIVITY = 4


class DrawClass(IntEnum):
    """What is drawn; part of its random stream, so append only."""

    OPEN_PHASE = 0
    LOAD_STEP = 1
    SOURCE_STEP = 2
    OPEN_THREE = 3
    CAPACITOR_STEP = 4
    MOTOR_START = 5
    REGULATOR_TAP = 6
    EARTH_FAULT = 7
    LINE_FAULT = 8
    TIE_SWITCHING = 9
    TRANSFER = 10
    DER_TRIP = 11
    DER_RAMP = 12
    ENERGISATION = 13
    RECLOSING = 14
    SINGLE_POLE = 15
    FALLEN_SOURCE_SIDE = 16
    FALLEN_LOAD_SIDE = 17
    OPEN_WITH_LOAD_STEP = 18
    OPEN_WITH_DER_TRIP = 19
    LOAD_SWAP = 20
    STEP_WITH_TAP = 21
    WIRING = 22

    @property
    def words(self) -> str:
        """The class in a reader's words, in the plural."""
        return _WORDS[self]


_WORDS = {
    DrawClass.OPEN_PHASE: "breaks",
    DrawClass.LOAD_STEP: "load steps",
    DrawClass.SOURCE_STEP: "source steps",
    DrawClass.OPEN_THREE: "three-phase breaks",
    DrawClass.CAPACITOR_STEP: "capacitor steps",
    DrawClass.MOTOR_START: "motor starts",
    DrawClass.REGULATOR_TAP: "regulator taps",
    DrawClass.EARTH_FAULT: "earth faults",
    DrawClass.LINE_FAULT: "line faults",
    DrawClass.TIE_SWITCHING: "tie switchings",
    DrawClass.TRANSFER: "transfers",
    DrawClass.DER_TRIP: "DER trips",
    DrawClass.DER_RAMP: "DER ramps",
    DrawClass.ENERGISATION: "energisations",
    DrawClass.RECLOSING: "reclosings",
    DrawClass.SINGLE_POLE: "single-pole closings",
    DrawClass.FALLEN_SOURCE_SIDE: "conductors fallen on the source side",
    DrawClass.FALLEN_LOAD_SIDE: "conductors fallen on the load side",
    DrawClass.OPEN_WITH_LOAD_STEP: "breaks with a load step",
    DrawClass.OPEN_WITH_DER_TRIP: "breaks with a DER trip",
    DrawClass.LOAD_SWAP: "load swaps",
    DrawClass.STEP_WITH_TAP: "load steps with a source step",
    DrawClass.WIRING: "wiring faults",
}

_AT_SIDE: dict[SideName, str] = {
    "inside": " inside",
    "upstream": " upstream",
    "downstream": " downstream",
    "other": " on another branch",
    "network": "",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportedClass:
    """A class as the certificate lists it."""

    name: str
    kind: Kind
    side: SideName
    drawn: DrawClass
    where: tuple[Side, ...]

    @property
    def words(self) -> str:
        """The class and its side in a reader's words, in the plural."""
        if self.name == "open_lateral":
            return "breaks on laterals inside"
        if self.drawn == DrawClass.WIRING:
            return f"{self.drawn.words} of {'its own' if self.side == 'inside' else 'other'} points"
        return f"{self.drawn.words}{_AT_SIDE[self.side]}"


INSIDE = (Side.PATH, Side.LATERAL)
OUTSIDE: tuple[tuple[SideName, tuple[Side, ...]], ...] = (
    ("upstream", (Side.UPSTREAM, Side.NOWHERE)),
    ("downstream", (Side.DOWNSTREAM,)),
    ("other", (Side.OTHER,)),
)

#: classes that stand on no line: they concern the network as a whole
NETWORK = (
    DrawClass.SOURCE_STEP,
    DrawClass.TIE_SWITCHING,
    DrawClass.TRANSFER,
    DrawClass.DER_RAMP,
)

#: in neither count, wherever they stand
APART = (DrawClass.OPEN_THREE, DrawClass.WIRING)

#: open phases that something else hides or imitates: inside they are in neither count, and
#: outside they must not trip, like any open phase
DISGUISED = (
    DrawClass.SINGLE_POLE,
    DrawClass.FALLEN_SOURCE_SIDE,
    DrawClass.FALLEN_LOAD_SIDE,
    DrawClass.OPEN_WITH_LOAD_STEP,
    DrawClass.OPEN_WITH_DER_TRIP,
)

FALLEN = (DrawClass.FALLEN_SOURCE_SIDE, DrawClass.FALLEN_LOAD_SIDE)
FALLEN_OHM = (0.0, 100.0, 500.0, float("inf"))
"""Bands of fault resistance by which fallen conductors are counted besides."""


def _reported() -> Iterator[ReportedClass]:
    """Every class on every side, in the order in which results list them."""

    def row(
        name: str, kind: Kind, side: SideName, drawn: DrawClass, where: tuple[Side, ...]
    ) -> ReportedClass:
        return ReportedClass(name=name, kind=kind, side=side, drawn=drawn, where=where)

    yield row("open_inside", "must_trip", "inside", DrawClass.OPEN_PHASE, (Side.PATH,))
    for side, where in OUTSIDE:
        yield row("open_outside", "must_not_trip", side, DrawClass.OPEN_PHASE, where)
    yield row("open_lateral", "apart", "inside", DrawClass.OPEN_PHASE, (Side.LATERAL,))
    for drawn in DrawClass:
        name = drawn.name.lower()
        if drawn == DrawClass.OPEN_PHASE:
            continue
        if drawn in NETWORK:
            yield row(name, "must_not_trip", "network", drawn, tuple(Side))
            continue
        inside: Kind = "apart" if drawn in (*APART, *DISGUISED) else "must_not_trip"
        yield row(name, inside, "inside", drawn, INSIDE)
        for side, where in OUTSIDE:
            if drawn == DrawClass.WIRING and side != "other":
                continue  # at one of the terminal's own points, or at another
            yield row(name, "apart" if drawn in APART else "must_not_trip", side, drawn, where)


REPORTED = tuple(_reported())
"""Every class on every side; an event counts in one row at most."""


def reported_row(drawn: DrawClass) -> NDArray[np.int64]:
    """(Side,): the row of ``REPORTED`` in which an event counts, by its side; -1: in none."""
    rows = np.full(len(Side), -1, np.int64)
    for r, own in enumerate(REPORTED):
        if own.drawn == drawn:
            rows[list(own.where)] = r
    return rows


def sides(terminals: tuple[Terminal, ...], event: Event) -> NDArray[np.int8]:
    """(T, S): the Side of each event for each terminal: of its edge, or of its node."""
    edges = np.stack([np.append(terminal.edge_side, Side.NOWHERE) for terminal in terminals])
    nodes = np.stack([np.append(terminal.node_side, Side.NOWHERE) for terminal in terminals])
    edge = np.where(event.edge >= 0, event.edge, event.at_edge)
    found = np.where(edge >= 0, edges[:, edge], nodes[:, event.at_node])
    return np.asarray(found, np.int8)
