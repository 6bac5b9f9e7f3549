"""Properties and options of OpenDSS rewritten: full names, values that can do no harm."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from functools import lru_cache

from .dss_notes import Notes, Place
from .dss_rules import LARGEST, PROPERTIES_LEFT_OUT, PROPERTIES_REFUSED
from .dss_tokens import Parameter, quoted
from .dss_words import PROPERTIES, find_word, word_list

__all__ = ["MAX_VALUE_CHARS", "property_texts", "safe_value"]

MAX_VALUE_CHARS = 20_000

_MAX_NODES = 20
_MAX_NODE = 99
_NAMED = re.compile(r"file\s*=", re.IGNORECASE)
_WHOLE = re.compile(r"[+-]?\d{1,12}(\.0*)?")
_BUS_PROPERTIES = {"bus", "bus1", "bus2", "buses", "vbus"}
_NAME_PROPERTIES = _BUS_PROPERTIES | set(
    word_list(
        """linecode geometry spacing wire wires cncable cncables tscable tscables like
        transformer xfmrcode bank subname element capacitor monitoredobj switchedobj"""
    )
)
_NUMBER_BEYOND = re.compile(
    r"[+-]?(?:inf|infinity|nan|(?:\d+\.?\d*|\.\d+)e\+?\d{3,})", re.IGNORECASE
)
_BUS_NODES = re.compile(r"(?<=\.)[^.\s,]+")


def property_texts(
    notes: Notes, place: Place, kind: str, parameters: Iterable[Parameter]
) -> list[str]:
    """Return the properties of an element as ``Name=value``, without what is left out.

    Parameters
    ----------
    notes
        Takes what is refused or left out.
    place
        The line.
    kind
        The element's class.
    parameters
        The rest of the line behind the element's name.
    """
    names = PROPERTIES[kind]
    texts = []
    at = -1
    for parameter in parameters:
        if parameter.name:
            name = _property(kind, parameter.name)
            if name is None:
                notes.refuse(place, f"{kind}: {parameter.name}", "is not a known property")
                continue
            at = names.index(name)
        else:
            at += 1
            if at >= len(names):
                notes.refuse(place, kind, "has fewer properties than values", parameter.value)
                break
            name = names[at]
        if name.lower() in PROPERTIES_REFUSED:
            notes.refuse(place, f"{kind}: {name}", "would load a library and is never obeyed")
        elif name.lower() in PROPERTIES_LEFT_OUT:
            notes.leave_out(place, f"{kind}.{name}", "refers to a curve or asks for a record")
        else:
            text = safe_value(notes, place, f"{kind}: {name}", parameter)
            if text is not None:
                texts.append(f"{name}={text}")
    return texts


def safe_value(notes: Notes, place: Place, where: str, parameter: Parameter) -> str | None:
    """Return a value as it is handed over, None if it is refused.

    No value with ``=`` in it is handed over: inside of a value that sign can only name a file
    to read.
    """
    value = parameter.value
    name = where.rpartition(" ")[2].lower()
    wanted = None
    if len(value) > MAX_VALUE_CHARS:
        wanted = f"must have at most {MAX_VALUE_CHARS:,} characters"
    elif _NAMED.search(value):
        wanted = "must hold its values itself, not name a file"
    elif "=" in value:
        wanted = "must not hold '='"
    elif name in LARGEST and not _is_whole(value, LARGEST[name]):
        wanted = f"must be a whole number from 0 to {LARGEST[name]:,}"
    elif name not in _NAME_PROPERTIES and not _are_finite(value):
        wanted = "must be finite"
    elif name in _BUS_PROPERTIES and not _are_buses(value):
        wanted = f"must name at most {_MAX_NODES} nodes from 0 to {_MAX_NODE}"
    text = quoted(value, parameter.opening)
    if wanted is None and text is None:
        wanted = "must leave one kind of quote unused"
    if wanted is not None:
        notes.refuse(place, where, wanted, value)
        return None
    return text


@lru_cache(maxsize=4096)
def _property(kind: str, text: str) -> str | None:
    """Return the property of a class that ``text`` means."""
    return find_word(text, PROPERTIES[kind])


def _is_whole(value: str, largest: int) -> bool:
    """Return whether a value is a whole number from 0 to the largest."""
    text = value.strip()
    return bool(_WHOLE.fullmatch(text)) and 0 <= int(float(text)) <= largest


def _are_finite(value: str) -> bool:
    """Return whether no number in a value is infinite or none at all."""
    return not any(
        _NUMBER_BEYOND.fullmatch(word) and not math.isfinite(float(word))
        for word in re.split(r"[\s,|]+", value)
    )


def _are_buses(value: str) -> bool:
    """Return whether the nodes of a bus, or of a list of buses, are few and small numbers."""
    for bus in re.split(r"[\s,]+", value):
        nodes = _BUS_NODES.findall(bus.strip("\"'()[]{}"))
        if len(nodes) > _MAX_NODES:
            return False
        if not all(_WHOLE.fullmatch(node) and 0 <= int(float(node)) <= _MAX_NODE for node in nodes):
            return False
    return True
