"""What the lines of an OpenDSS file have made so far."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import islice

from .dss_notes import Notes, Place
from .dss_tokens import parameters
from .dss_variables import Variables

__all__ = ["Command", "Element", "State"]

MAX_COMMANDS = 1_000_000


@dataclass(frozen=True, slots=True)
class Command:
    """A line for the engine, and where it comes from."""

    file: str
    line: int
    text: str


@dataclass(frozen=True, slots=True)
class Element:
    """An element that a line names; ``left_out`` says why it is not handed over."""

    kind: str
    name: str
    left_out: str = ""


@dataclass(slots=True)
class State:
    """What the lines so far have made."""

    commands: list[Command] = field(default_factory=list)
    coordinates: dict[str, tuple[float, float]] = field(default_factory=dict)
    notes: Notes = field(default_factory=Notes)
    directory: tuple[str, ...] = ()
    has_circuit: bool = False
    variables: Variables = field(default_factory=Variables)
    names: dict[str, dict[str, str]] = field(default_factory=dict)
    active: Element | None = None

    def hand_over(self, place: Place, text: str) -> None:
        """Add a command."""
        self.commands.append(Command(place.file, place.line or 0, text))
        if len(self.commands) > MAX_COMMANDS:
            self.notes.refuse(place, "the circuit", f"must have at most {MAX_COMMANDS:,} commands")
            self.notes.raise_if_any()

    def take_coordinates(self, rows: list[str], *, swapped: bool) -> None:
        """Add the coordinates of rows of bus, x, y; rows that are none are headings."""
        for row in rows:
            words = [parameter.value for parameter in islice(parameters(row), 3)]
            if len(words) == 3:
                x, y = (words[2], words[1]) if swapped else (words[1], words[2])
                self.take_coordinate(words[0], x, y)

    def take_coordinate(self, bus: str, x: str, y: str) -> None:
        """Add the coordinates of a bus if they are numbers."""
        try:
            place = (float(x), float(y))
        except ValueError:
            return
        if math.isfinite(place[0]) and math.isfinite(place[1]):
            self.coordinates[bus.partition(".")[0].lower()] = place
