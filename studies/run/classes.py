"""The classes of events: how they are drawn, and what each means to a terminal."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...model.points import Terminal

__all__ = ["REPORTED", "DrawClass", "Purpose", "ReportedClass", "Side", "sides"]


Kind = Literal["must_trip", "must_not_trip", "apart"]
SideName = Literal["inside", "outside"]


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


class Side(IntEnum):
    """Where an event stands, seen from a section."""

    OUTSIDE = 0
    PATH = 1  #: on the path between the two points
    LATERAL = 2  #: on a lateral that tees off that path


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportedClass:
    """A class as the certificate lists it."""

    name: str
    kind: Kind
    side: SideName
    drawn: DrawClass
    where: tuple[Side, ...]


INSIDE = (Side.PATH, Side.LATERAL)

#: name, kind, side, how it is drawn, and where the event must stand
_TABLE: tuple[tuple[str, Kind, SideName, DrawClass, tuple[Side, ...]], ...] = (
    ("open_inside", "must_trip", "inside", DrawClass.OPEN_PHASE, (Side.PATH,)),
    ("load_step", "must_not_trip", "inside", DrawClass.LOAD_STEP, INSIDE),
    ("load_step", "must_not_trip", "outside", DrawClass.LOAD_STEP, (Side.OUTSIDE,)),
    ("source_step", "must_not_trip", "outside", DrawClass.SOURCE_STEP, (Side.OUTSIDE,)),
    ("open_outside", "must_not_trip", "outside", DrawClass.OPEN_PHASE, (Side.OUTSIDE,)),
    ("open_lateral", "apart", "inside", DrawClass.OPEN_PHASE, (Side.LATERAL,)),
    ("open_three", "apart", "inside", DrawClass.OPEN_THREE, INSIDE),
    ("open_three", "apart", "outside", DrawClass.OPEN_THREE, (Side.OUTSIDE,)),
)

REPORTED = tuple(
    ReportedClass(name=name, kind=kind, side=side, drawn=drawn, where=where)
    for name, kind, side, drawn, where in _TABLE
)


def sides(terminals: tuple[Terminal, ...], edge: NDArray[np.int64]) -> NDArray[np.int8]:
    """(T, S): the Side of each event's edge for each terminal; no edge is outside."""
    table = np.zeros((len(terminals), terminals[0].on_path.size + 1), np.int8)
    for t, terminal in enumerate(terminals):
        table[t, :-1] = np.where(
            terminal.on_path, Side.PATH, np.where(terminal.in_section, Side.LATERAL, Side.OUTSIDE)
        )
    return np.asarray(table[:, edge])
