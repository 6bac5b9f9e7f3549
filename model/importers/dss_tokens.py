"""A line of OpenDSS's language taken apart as the engine takes it apart.

A line is a row of parameters, ``value`` or ``name=value``, separated by blanks, tabs or
commas. A value may stand in quotes or brackets, which do not nest; ``!`` and ``//`` outside
of them begin a comment.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

__all__ = ["Parameter", "parameters", "quoted"]

_CLOSING = {"(": ")", '"': '"', "'": "'", "[": "]", "{": "}"}
_STOP = re.compile(r"[,= \t!]|//")
_BLANKS = re.compile(r"[ \t]*")
_UNSAFE = re.compile(r"^[(\"'\[{]|[,=\s!]|//")


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a line.

    Parameters
    ----------
    name
        What stands before ``=``, empty where there is none.
    value
        The value without its quotes.
    opening
        The quote or bracket it stood in, empty where there was none.
    """

    name: str
    value: str
    opening: str = ""


def parameters(line: str) -> Iterator[Parameter]:
    """Give the parameters of a line one by one, so that a long rest need not be read.

    Like the engine, stop at the first empty parameter: nothing behind it counts.

    Examples
    --------
    >>> [(p.name, p.value) for p in parameters("~ kv = 12.5, conns=(wye delta) ! rest")]
    [('', '~'), ('kv', '12.5'), ('conns', 'wye delta')]
    >>> [(p.name, p.value) for p in parameters('new load.a daily="" kw=3')]
    [('', 'new'), ('', 'load.a')]
    """
    text = line + " "
    at = _skip_blanks(text, 0)
    while at < len(text):
        value, opening, last, at = _token(text, at, " ")
        name = ""
        if last == "=":
            name = value
            value, opening, _, at = _token(text, at, "=")
        if not value:
            return
        yield Parameter(name, value, opening)


def quoted(value: str, opening: str = "") -> str | None:
    r"""Return ``value`` written so that the engine reads it back as it is, None if none does.

    Examples
    --------
    >>> quoted("671.1.2"), quoted("0.1 | 0 0.1", "("), quoted("a b"), quoted("'a]\"})")
    ('671.1.2', '(0.1 | 0 0.1)', '"a b"', None)
    """
    if not opening and not _UNSAFE.search(value):
        return value
    for first in (opening, *'"[({', "'"):
        if first and _CLOSING[first] not in value:
            return f"{first}{value}{_CLOSING[first]}"
    return None


def _token(text: str, at: int, last: str) -> tuple[str, str, str, int]:
    """Return the token at ``at``, its opening quote, what ended it and where to go on."""
    if at >= len(text):
        return "", "", last, at
    opening = text[at] if text[at] in _CLOSING else ""
    if opening:
        start = at + 1
        # Without its end, a quoted value goes on to the end of the line.
        end = text.find(_CLOSING[opening], start)
        end, at = (len(text) - 1, len(text) - 1) if end < 0 else (end, end + 1)
    else:
        start = at
        stop = _STOP.search(text, at)
        end = at = stop.start() if stop else len(text) - 1
        if stop:
            last = {"\t": " ", "//": "!"}.get(stop.group(), stop.group())
    token = text[start:end]
    if last == "!":
        return token, opening, last, len(text)
    if last == " ":
        at = _skip_blanks(text, at)
    if at < len(text) and text[at] in ",=":
        last = text[at]
        at += 1
    return token, opening, last, _skip_blanks(text, at)


def _skip_blanks(text: str, at: int) -> int:
    """Return the place of the next character that is no blank."""
    blanks = _BLANKS.match(text, at)
    return blanks.end() if blanks else at
