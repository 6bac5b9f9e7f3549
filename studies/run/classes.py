"""The classes of events: how they are drawn, and what each means to a terminal."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...model.points import Terminal

__all__ = ["REPORTED", "DrawClass", "Purpose", "ReportedClass", "Side", "sides"]


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
    kind: Literal["must_trip", "must_not_trip", "apart"]
    side: Literal["inside", "outside"]
    drawn: DrawClass
    where: tuple[Side, ...]


INSIDE = (Side.PATH, Side.LATERAL)

REPORTED = (
    ReportedClass(
        name="open_inside",
        kind="must_trip",
        side="inside",
        drawn=DrawClass.OPEN_PHASE,
        where=(Side.PATH,),
    ),
    ReportedClass(
        name="load_step",
        kind="must_not_trip",
        side="inside",
        drawn=DrawClass.LOAD_STEP,
        where=INSIDE,
    ),
    ReportedClass(
        name="load_step",
        kind="must_not_trip",
        side="outside",
        drawn=DrawClass.LOAD_STEP,
        where=(Side.OUTSIDE,),
    ),
    ReportedClass(
        name="source_step",
        kind="must_not_trip",
        side="outside",
        drawn=DrawClass.SOURCE_STEP,
        where=(Side.OUTSIDE,),
    ),
    ReportedClass(
        name="open_outside",
        kind="must_not_trip",
        side="outside",
        drawn=DrawClass.OPEN_PHASE,
        where=(Side.OUTSIDE,),
    ),
    ReportedClass(
        name="open_lateral",
        kind="apart",
        side="inside",
        drawn=DrawClass.OPEN_PHASE,
        where=(Side.LATERAL,),
    ),
    ReportedClass(
        name="open_three", kind="apart", side="inside", drawn=DrawClass.OPEN_THREE, where=INSIDE
    ),
    ReportedClass(
        name="open_three",
        kind="apart",
        side="outside",
        drawn=DrawClass.OPEN_THREE,
        where=(Side.OUTSIDE,),
    ),
)


def sides(terminals: tuple[Terminal, ...], edge: NDArray[np.int64]) -> NDArray[np.int8]:
    """(T, S): the Side of each event's edge for each terminal; no edge is outside."""
    table = np.zeros((len(terminals), terminals[0].on_path.size + 1), np.int8)
    for t, terminal in enumerate(terminals):
        table[t, :-1] = np.where(
            terminal.on_path, Side.PATH, np.where(terminal.in_section, Side.LATERAL, Side.OUTSIDE)
        )
    return np.asarray(table[:, edge])
