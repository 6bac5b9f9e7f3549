"""One line of an OpenDSS file after the other: what it means, and what is handed over of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from .dss_elements import (
    ONLY_CATALOGUES,
    Rest,
    assign,
    do_batch_edit,
    do_edit,
    do_more,
    do_new,
    do_select,
    do_switch,
)
from .dss_notes import Place
from .dss_rules import (
    COMMANDS_LEFT_OUT,
    COMMANDS_REFUSED,
    LIBRARY_COMMANDS,
    OPTIONS_KEPT,
    OPTIONS_REFUSED,
)
from .dss_state import State
from .dss_tokens import parameters
from .dss_values import safe_value
from .dss_variables import VariableError
from .dss_words import COMMANDS, OPTIONS, find_word

__all__ = ["NamedFile", "obey"]


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


def obey(state: State, place: Place, line: str) -> NamedFile | None:
    """Take one line in, and return the file it names if it names one to go on with."""
    rest = map(state.variables.put_in, parameters(line))
    try:
        first = next(rest, None)
        if first is None:
            return None
        if first.name:
            assign(state, place, first, rest)
            return None
        word = find_word(first.value, COMMANDS)
        if word is None:
            state.notes.refuse(place, f"command {first.value!r}", "is not known")
        elif place.secret and word not in LIBRARY_COMMANDS:
            state.notes.refuse(place, "", ONLY_CATALOGUES)
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


def _do_set(state: State, place: Place, rest: Rest) -> None:
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


def _do_solve(state: State, place: Place, rest: Rest) -> None:
    """Leave ``solve`` out, but keep the options given with it."""
    state.notes.leave_out(place, "command Solve", "only calculates, shows or writes")
    _do_set(state, place, (parameter for parameter in rest if parameter.name))


def _do_set_kv_base(state: State, place: Place, rest: Rest) -> None:
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


def _do_set_bus_xy(state: State, place: Place, rest: Rest) -> None:
    """Obey ``setbusxy bus x y``."""
    names = ("Bus", "X", "Y")
    found: dict[str, str] = {}
    for number, parameter in enumerate(rest):
        positional = names[min(number, 2)]
        name = find_word(parameter.name, names) if parameter.name else positional
        found[name or ""] = parameter.value
    state.take_coordinate(*(found.get(name, "") for name in names))


def _do_calculate_bases(state: State, place: Place, rest: Rest) -> None:
    """Obey ``calcvoltagebases``."""
    state.hand_over(place, "CalcVoltageBases")


def _do_clear(state: State, place: Place, rest: Rest) -> None:
    """Obey ``clear``: nothing is left."""
    state.hand_over(place, "Clear")
    state.coordinates.clear()
    state.names.clear()
    state.active = None
    state.has_circuit = False


def _do_variables(state: State, place: Place, rest: Rest) -> None:
    """Obey ``var @name=value …``."""
    for parameter in rest:
        state.variables.define(parameter)


def _do_redirect(state: State, place: Place, rest: Rest) -> NamedFile | None:
    """Obey ``redirect file``."""
    parameter = next(rest, None)
    return None if parameter is None else NamedFile(parameter.value)


def _do_compile(state: State, place: Place, rest: Rest) -> NamedFile | None:
    """Obey ``compile file``."""
    parameter = next(rest, None)
    return None if parameter is None else NamedFile(parameter.value, moves=True)


def _do_coordinates(swapped: bool) -> Callable[[State, Place, Rest], NamedFile | None]:
    """Return what obeys ``buscoords file`` and, swapped, ``latlongcoords file``."""

    def do(state: State, place: Place, rest: Rest) -> NamedFile | None:
        parameter = next(rest, None)
        return (
            None if parameter is None else NamedFile(parameter.value, coordinates_swapped=swapped)
        )

    return do


_OBEYED: dict[str, Callable[[State, Place, Rest], NamedFile | None]] = {
    "New": do_new,
    "Edit": do_edit,
    "More": do_more,
    "M": do_more,
    "~": do_more,
    "Select": do_select,
    "BatchEdit": do_batch_edit,
    "Enable": do_switch("Enable"),
    "Disable": do_switch("Disable"),
    "Open": do_switch("Open"),
    "Close": do_switch("Close"),
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
