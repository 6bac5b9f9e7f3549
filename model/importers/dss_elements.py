"""Elements of an OpenDSS circuit as its lines define and change them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import chain, islice

from .dss_notes import Place
from .dss_rules import CLASSES, CLASSES_LEFT_OUT, LIBRARY_CLASSES, MAX_NAME_CHARS
from .dss_state import Element, State
from .dss_tokens import Parameter, quoted
from .dss_values import property_texts

__all__ = [
    "ONLY_CATALOGUES",
    "Rest",
    "assign",
    "do_batch_edit",
    "do_edit",
    "do_more",
    "do_new",
    "do_select",
    "do_switch",
]

Rest = Iterator[Parameter]
"""What of a line is not yet read."""

ONLY_CATALOGUES = "may only define catalogues, as it is not in the folder"

_PATTERN = re.compile(r"[\w.*^$|\[\]%#&:-]+")
_TERMINAL = re.compile(r"\d{1,2}")


def assign(state: State, place: Place, first: Parameter, rest: Rest) -> None:
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


def _element(state: State, place: Place, rest: Rest) -> Element | None:
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


def _named_element(state: State, place: Place, path: str) -> Element | None:
    """Return the element of a path such as ``Line.a``, None if that is refused."""
    kind, _, name = path.partition(".")
    kind = kind.lower()
    if kind in CLASSES_LEFT_OUT:
        return Element(kind, name, CLASSES_LEFT_OUT[kind])
    if kind not in CLASSES and kind != "circuit":
        state.notes.refuse(place, f"class {kind!r}", "is not known or not read")
    elif place.secret and CLASSES.get(kind) not in LIBRARY_CLASSES:
        state.notes.refuse(place, "", ONLY_CATALOGUES)
    elif not 0 < len(name) <= MAX_NAME_CHARS or quoted(f"{kind}.{name}") is None:
        wanted = f"must have 1 to {MAX_NAME_CHARS} characters and leave one kind of quote unused"
        state.notes.refuse(place, f"name of a {kind}", wanted, name)
    elif "=" in name:
        state.notes.refuse(place, f"name of a {kind}", "must not hold '='", name)
    else:
        return Element(CLASSES.get(kind, "Circuit"), name)
    return None


def do_new(state: State, place: Place, rest: Rest) -> None:
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
        state.active = Element("Vsource", "source")
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


def _edit(state: State, place: Place, element: Element, rest: Rest) -> None:
    """Take in changes of an element."""
    if place.secret and element.kind not in LIBRARY_CLASSES:
        state.notes.refuse(place, "", ONLY_CATALOGUES)
        return
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


def _path(element: Element) -> str:
    """Return ``Class.Name``, quoted where that is needed."""
    return quoted(f"{element.kind}.{element.name}") or ""


def do_edit(state: State, place: Place, rest: Rest) -> None:
    """Obey ``edit class.name …``."""
    element = _element(state, place, rest)
    if element is not None:
        _edit(state, place, element, rest)


def do_more(state: State, place: Place, rest: Rest) -> None:
    """Obey ``more …`` or ``~ …``."""
    if state.active is None:
        state.notes.refuse(place, "command More", "must follow an element")
    else:
        _edit(state, place, state.active, rest)


def do_select(state: State, place: Place, rest: Rest) -> None:
    """Obey ``select class.name``."""
    element = _element(state, place, rest)
    if element is not None and element.kind != "Circuit":
        state.active = element


def do_batch_edit(state: State, place: Place, rest: Rest) -> None:
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
            _edit(state, place, Element(pattern.kind, name), iter(changes))


def do_switch(word: str) -> Callable[[State, Place, Rest], None]:
    """Return what obeys ``enable``, ``disable``, ``open`` and ``close``."""

    def do(state: State, place: Place, rest: Rest) -> None:
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
