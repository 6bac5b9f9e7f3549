"""One line of an OpenDSS file after the other: what it means, and what is handed over of it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import chain, islice

from .dss_notes import Notes, Place
from .dss_rules import (
    CLASSES,
    CLASSES_LEFT_OUT,
    COMMANDS_LEFT_OUT,
    COMMANDS_REFUSED,
    LIBRARY_CLASSES,
    LIBRARY_COMMANDS,
    MAX_NAME_CHARS,
    OPTIONS_KEPT,
    OPTIONS_REFUSED,
)
from .dss_tokens import Parameter, parameters, quoted
from .dss_values import property_texts, safe_value
from .dss_variables import VariableError, Variables
from .dss_words import COMMANDS, OPTIONS, find_word

__all__ = ["Command", "NamedFile", "State", "obey"]

MAX_COMMANDS = 1_000_000

_PATTERN = re.compile(r"[\w.*^$|\[\]%#&:-]+")
_TERMINAL = re.compile(r"\d{1,2}")


@dataclass(frozen=True, slots=True)
class Command:
    """A line for the engine, and where it comes from."""

    file: str
    line: int
    text: str


@dataclass(frozen=True, slots=True)
class NamedFile:
    """A file that a line names.

    Parameters
    ----------
    name
        As written.
    moves
        Whether names count from that file's place afterwards, as ``compile`` has it.
    coordinates_swapped
        Whether it holds y before x, None where it holds commands.
    """

    name: str
    moves: bool = False
    coordinates_swapped: bool | None = None


@dataclass(frozen=True, slots=True)
class _Element:
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
    active: _Element | None = None

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


_Rest = Iterator[Parameter]


def obey(state: State, place: Place, line: str) -> NamedFile | None:
    """Take one line in, and return the file it names if it names one to go on with."""
    rest = map(state.variables.put_in, parameters(line))
    try:
        first = next(rest, None)
        if first is None:
            return None
        if first.name:
            _assign(state, place, first, rest)
            return None
        word = find_word(first.value, COMMANDS)
        if word is None:
            state.notes.refuse(place, f"command {first.value!r}", "is not known")
        elif place.secret and word not in LIBRARY_COMMANDS:
            state.notes.refuse(place, "", "may only define catalogues, as it is not in the folder")
        elif word in COMMANDS_REFUSED:
            state.notes.refuse(place, f"command {word}", COMMANDS_REFUSED[word])
        elif word in _OBEYED:
            return _OBEYED[word](state, place, rest)
        else:
            why = COMMANDS_LEFT_OUT.get(word, "only calculates, shows or writes")
            state.notes.leave_out(place, f"command {word}", why)
    except VariableError as error:
        state.notes.refuse(place, "variable", str(error))
    return None


def _assign(state: State, place: Place, first: Parameter, rest: _Rest) -> None:
    """Take in ``class.name.property=value``, shorter forms of it and what follows."""
    parts = first.name.split(".", 2)
    element = state.active
    if len(parts) > 1:
        kind = element.kind if element else ""
        path = ".".join(parts[:-1] if len(parts) == 3 else [kind, parts[0]])
        element = _named_element(state, place, path)
    elif element is None:
        state.notes.refuse(place, f"property {first.name!r}", "belongs to no element")
    if element is not None:
        _edit(
            state, place, element, chain([Parameter(parts[-1], first.value, first.opening)], rest)
        )


def _element(state: State, place: Place, rest: _Rest) -> _Element | None:
    """Return the element that the next parameter names, None if that is refused."""
    parameter = next(rest, None)
    if parameter is None or not "object".startswith(parameter.name.lower()):
        found = parameter.name if parameter else ""
        state.notes.refuse(place, "command", "must be followed by class.name", found)
        return None
    path = parameter.value
    if "." not in path and state.active:
        path = f"{state.active.kind}.{path}"
    return _named_element(state, place, path)


def _named_element(state: State, place: Place, path: str) -> _Element | None:
    """Return the element of a path such as ``Line.a``, None if that is refused."""
    kind, _, name = path.partition(".")
    kind = kind.lower()
    if kind in CLASSES_LEFT_OUT:
        return _Element(kind, name, CLASSES_LEFT_OUT[kind])
    if kind not in CLASSES and kind != "circuit":
        state.notes.refuse(place, f"class {kind!r}", "is not known or not read")
    elif place.secret and CLASSES.get(kind) not in LIBRARY_CLASSES:
        state.notes.refuse(place, "", "may only define catalogues, as it is not in the folder")
    elif not 0 < len(name) <= MAX_NAME_CHARS or quoted(f"{kind}.{name}") is None:
        wanted = f"must have 1 to {MAX_NAME_CHARS} characters and leave one kind of quote unused"
        state.notes.refuse(place, f"name of a {kind}", wanted, name)
    elif "=" in name:
        state.notes.refuse(place, f"name of a {kind}", "must not hold '='", name)
    else:
        return _Element(CLASSES.get(kind, "Circuit"), name)
    return None


def _new(state: State, place: Place, rest: _Rest) -> None:
    """Take in a new element."""
    element = _element(state, place, rest)
    if element is None:
        return
    state.active = element
    if element.left_out:
        state.notes.leave_out(place, f"class {element.kind}", element.left_out)
        return
    if element.kind == "Circuit":
        if state.has_circuit:
            state.notes.refuse(place, "circuit", "must be the only one", element.name)
            return
        state.has_circuit = True
        # A new circuit is a source; what follows its name is the source's.
        state.active = _Element("Vsource", "source")
    names = state.names.setdefault(state.active.kind, {})
    if element.kind != "Circuit" and element.name.lower() in names:
        if element.kind in LIBRARY_CLASSES:
            _edit(state, place, element, rest)
        else:
            # Programs disagree on whether the second changes the first or does not count.
            state.notes.refuse(place, _path(element), "must be defined once")
        return
    names[state.active.name.lower()] = state.active.name
    texts = property_texts(state.notes, place, state.active.kind, rest)
    state.hand_over(place, " ".join(["New", _path(element), *texts]))


def _edit(state: State, place: Place, element: _Element, rest: _Rest) -> None:
    """Take in changes of an element."""
    state.active = element
    if element.left_out:
        state.notes.leave_out(place, f"class {element.kind}", element.left_out)
    elif element.kind == "Circuit":
        state.notes.leave_out(place, "change of a circuit", "the engine does not obey it either")
    elif element.name.lower() not in state.names.get(element.kind, {}):
        state.notes.refuse(place, _path(element), "is not defined before it is changed")
    else:
        texts = property_texts(state.notes, place, element.kind, rest)
        if texts:
            state.hand_over(place, " ".join(["Edit", _path(element), *texts]))


def _path(element: _Element) -> str:
    """Return ``Class.Name``, quoted where that is needed."""
    return quoted(f"{element.kind}.{element.name}") or ""


def _do_edit(state: State, place: Place, rest: _Rest) -> None:
    """Obey ``edit class.name …``."""
    element = _element(state, place, rest)
    if element is not None:
        _edit(state, place, element, rest)


def _do_more(state: State, place: Place, rest: _Rest) -> None:
    """Obey ``more …`` or ``~ …``."""
    if state.active is None:
        state.notes.refuse(place, "command More", "must follow an element")
    else:
        _edit(state, place, state.active, rest)


def _do_select(state: State, place: Place, rest: _Rest) -> None:
    """Obey ``select class.name``."""
    element = _element(state, place, rest)
    if element is not None and element.kind != "Circuit":
        state.active = element


def _do_batch_edit(state: State, place: Place, rest: _Rest) -> None:
    """Obey ``batchedit class.pattern …``, one element after the other."""
    pattern = _element(state, place, rest)
    if pattern is None or pattern.left_out or pattern.kind == "Circuit":
        return
    if not _PATTERN.fullmatch(pattern.name) or pattern.name.count("*") > 3:
        state.notes.refuse(place, "pattern", "must be plainer than this", pattern.name)
        return
    try:
        wanted = re.compile(pattern.name, re.IGNORECASE)
    except re.error:
        state.notes.refuse(place, "pattern", "is not one", pattern.name)
        return
    changes = list(rest)
    for name in list(state.names.get(pattern.kind, {}).values()):
        if wanted.search(name):
            _edit(state, place, _Element(pattern.kind, name), iter(changes))


def _do_switch(word: str) -> Callable[[State, Place, _Rest], None]:
    """Return what obeys ``enable``, ``disable``, ``open`` and ``close``."""

    def do(state: State, place: Place, rest: _Rest) -> None:
        element = _element(state, place, rest)
        if element is None:
            return
        if element.left_out or element.kind == "Circuit":
            state.notes.leave_out(place, f"command {word}", element.left_out or "of no effect")
            return
        numbers = []
        if word in ("Open", "Close"):
            numbers = [parameter.value for parameter in islice(rest, 2)]
        known = state.names.get(element.kind, {})
        every = element.name == "*" and word in ("Enable", "Disable")
        if element.name.lower() not in known and not every:
            state.notes.refuse(place, _path(element), "is not defined")
        elif not all(_TERMINAL.fullmatch(number) for number in numbers):
            state.notes.refuse(place, f"command {word}", "must name terminal and conductor")
        else:
            state.active = state.active if every else element
            state.hand_over(place, " ".join([word, _path(element), *numbers]))

    return do


def _do_set(state: State, place: Place, rest: _Rest) -> None:
    """Obey ``set option=value …``."""
    for parameter in rest:
        option = find_word(parameter.name, OPTIONS)
        if option is None:
            state.notes.refuse(place, f"option {parameter.name!r}", "is not known", parameter.value)
            continue
        name, value = option.lower(), parameter.value.lower()
        if name in OPTIONS_REFUSED:
            state.notes.refuse(place, f"option {option}", OPTIONS_REFUSED[name])
        elif name == "cktmodel" and not "multiphase".startswith(value):
            state.notes.refuse(place, f"option {option}", "must be multiphase", value)
        elif name == "mode" and "snapshot".startswith(value):
            state.hand_over(place, "Set mode=snapshot")
        elif name in OPTIONS_KEPT:
            text = safe_value(state.notes, place, f"option {option}", parameter)
            if text is not None:
                state.hand_over(place, f"Set {option}={text}")
        else:
            state.notes.leave_out(place, f"option {option}", "says nothing about the circuit")


def _do_solve(state: State, place: Place, rest: _Rest) -> None:
    """Leave ``solve`` out, but keep the options given with it."""
    state.notes.leave_out(place, "command Solve", "only calculates, shows or writes")
    _do_set(state, place, (parameter for parameter in rest if parameter.name))


def _do_set_kv_base(state: State, place: Place, rest: _Rest) -> None:
    """Obey ``setkvbase bus kvll kvln``."""
    names = ("Bus", "kVLL", "kVLN")
    texts = []
    for number, parameter in enumerate(rest):
        positional = names[min(number, 2)]
        name = find_word(parameter.name, names) if parameter.name else positional
        if name is None:
            state.notes.refuse(place, f"SetkVBase: {parameter.name}", "is not a known property")
            continue
        text = safe_value(state.notes, place, f"SetkVBase: {name}", parameter)
        if text is not None:
            texts.append(f"{name}={text}")
    state.hand_over(place, " ".join(["SetkVBase", *texts]))


def _do_set_bus_xy(state: State, place: Place, rest: _Rest) -> None:
    """Obey ``setbusxy bus x y``."""
    names = ("Bus", "X", "Y")
    found: dict[str, str] = {}
    for number, parameter in enumerate(rest):
        positional = names[min(number, 2)]
        name = find_word(parameter.name, names) if parameter.name else positional
        found[name or ""] = parameter.value
    state.take_coordinate(*(found.get(name, "") for name in names))


def _do_calculate_bases(state: State, place: Place, rest: _Rest) -> None:
    """Obey ``calcvoltagebases``."""
    state.hand_over(place, "CalcVoltageBases")


def _do_clear(state: State, place: Place, rest: _Rest) -> None:
    """Obey ``clear``: nothing is left."""
    state.hand_over(place, "Clear")
    state.coordinates.clear()
    state.names.clear()
    state.active = None
    state.has_circuit = False


def _do_variables(state: State, place: Place, rest: _Rest) -> None:
    """Obey ``var @name=value …``."""
    for parameter in rest:
        state.variables.define(parameter)


def _do_redirect(state: State, place: Place, rest: _Rest) -> NamedFile | None:
    """Obey ``redirect file``."""
    parameter = next(rest, None)
    return None if parameter is None else NamedFile(parameter.value)


def _do_compile(state: State, place: Place, rest: _Rest) -> NamedFile | None:
    """Obey ``compile file``."""
    parameter = next(rest, None)
    return None if parameter is None else NamedFile(parameter.value, moves=True)


def _do_coordinates(swapped: bool) -> Callable[[State, Place, _Rest], NamedFile | None]:
    """Return what obeys ``buscoords file`` and, swapped, ``latlongcoords file``."""

    def do(state: State, place: Place, rest: _Rest) -> NamedFile | None:
        parameter = next(rest, None)
        return (
            None if parameter is None else NamedFile(parameter.value, coordinates_swapped=swapped)
        )

    return do


_OBEYED: dict[str, Callable[[State, Place, _Rest], NamedFile | None]] = {
    "New": _new,
    "Edit": _do_edit,
    "More": _do_more,
    "M": _do_more,
    "~": _do_more,
    "Select": _do_select,
    "BatchEdit": _do_batch_edit,
    "Enable": _do_switch("Enable"),
    "Disable": _do_switch("Disable"),
    "Open": _do_switch("Open"),
    "Close": _do_switch("Close"),
    "Set": _do_set,
    "Solve": _do_solve,
    "SetkVBase": _do_set_kv_base,
    "SetBusXY": _do_set_bus_xy,
    "Calcvoltagebases": _do_calculate_bases,
    "Clear": _do_clear,
    "ClearAll": _do_clear,
    "var": _do_variables,
    "Redirect": _do_redirect,
    "Compile": _do_compile,
    "Buscoords": _do_coordinates(swapped=False),
    "LatLongCoords": _do_coordinates(swapped=True),
}
