"""Where each key of a TOML text stands, which the standard parser does not tell.

The scanner is meant for text that `tomllib` has accepted. It never raises: on anything
else it knows as many lines as it could read.
"""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_right
from collections.abc import Iterator
from functools import cache

from ..errors import KeyPath, Locator

__all__ = ["line_numbers", "locator", "syntax_error_line"]

_BLANK = re.compile(r"(?:\s|#[^\n]*)*")
_SPACE = re.compile(r"[ \t]*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_BARE_VALUE = re.compile(r"[^,\]}#\n]*")
_STRING = re.compile(
    r'"""(?:\\.|[^\\])*?"""(?!")'
    r"|'''.*?'''(?!')"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)


class _UnreadableError(Exception):
    """The text is not what the scanner takes for TOML."""


class _Scanner:
    """Walks once through a TOML text and yields every key path with its offset."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0

    def document(self) -> Iterator[tuple[KeyPath, int]]:
        """Yield the key paths of the whole text, those of tables at their headers."""
        table: KeyPath = ()
        rows: dict[KeyPath, int] = {}  # array of tables -> how many were opened so far
        self.skip(_BLANK)
        while self.at < len(self.text):
            start = self.at
            if self.take("["):
                is_row = self.take("[")
                keys = self.dotted_key()
                self.expect("]]" if is_row else "]")
                table = _last_rows(keys[:-1] if is_row else keys, rows)
                if is_row:
                    table += keys[-1:]
                    rows[table] = rows.get(table, 0) + 1
                    yield table, start
                    table += (rows[table] - 1,)
                yield table, start
            else:
                yield from self.key_and_value(table)
            self.skip(_BLANK)

    def key_and_value(self, table: KeyPath) -> Iterator[tuple[KeyPath, int]]:
        """Yield ``key = value``: the key, the tables its dots imply, and the value's own keys."""
        start = self.at
        keys = self.dotted_key()
        self.expect("=")
        for end in range(1, len(keys) + 1):
            yield table + keys[:end], start
        yield from self.value(table + keys)

    def value(self, path: KeyPath) -> Iterator[tuple[KeyPath, int]]:
        """Yield what stands inside a value, and step over it."""
        self.skip(_SPACE)
        if self.take("["):
            yield from self.array(path)
        elif self.take("{"):
            yield from self.inline_table(path)
        elif not self.skip(_STRING):
            self.skip(_BARE_VALUE)

    def array(self, path: KeyPath) -> Iterator[tuple[KeyPath, int]]:
        """Yield every element of an array and what stands inside it."""
        index = 0
        self.skip(_BLANK)
        while not self.take("]"):
            yield (*path, index), self.at
            yield from self.value((*path, index))
            self.separator("]")
            index += 1

    def inline_table(self, path: KeyPath) -> Iterator[tuple[KeyPath, int]]:
        """Yield the keys of ``{ ... }``."""
        self.skip(_BLANK)
        while not self.take("}"):
            yield from self.key_and_value(path)
            self.separator("}")

    def separator(self, closing: str) -> None:
        """Step over a comma; without one the closing bracket must follow."""
        self.skip(_BLANK)
        if not self.take(",") and not self.text.startswith(closing, self.at):
            raise _UnreadableError
        self.skip(_BLANK)

    def dotted_key(self) -> tuple[str, ...]:
        """Return the parts of ``a."b".c``."""
        parts = [self.key()]
        while self.take("."):
            parts.append(self.key())
        return tuple(parts)

    def key(self) -> str:
        """Return one bare or quoted key, without the spaces around it."""
        self.skip(_SPACE)
        start = self.at
        if self.skip(_STRING):
            key = str(tomllib.loads(f"key = {self.text[start : self.at]}")["key"])
        elif self.skip(_BARE_KEY):
            key = self.text[start : self.at]
        else:
            raise _UnreadableError
        self.skip(_SPACE)
        return key

    def skip(self, pattern: re.Pattern[str]) -> bool:
        """Step over the pattern; tell whether anything was there."""
        match = pattern.match(self.text, self.at)
        if match is None or match.end() == self.at:
            return False
        self.at = match.end()
        return True

    def take(self, literal: str) -> bool:
        """Step over the literal if it stands here."""
        if not self.text.startswith(literal, self.at):
            return False
        self.at += len(literal)
        return True

    def expect(self, literal: str) -> None:
        """Step over the literal, which must stand here."""
        if not self.take(literal):
            raise _UnreadableError


def _last_rows(keys: tuple[str, ...], rows: dict[KeyPath, int]) -> KeyPath:
    """Return the path of a header, which means the last row of every array it names."""
    path: KeyPath = ()
    for key in keys:
        path += (key,)
        if path in rows:
            path += (rows[path] - 1,)
    return path


def line_numbers(text: str) -> dict[KeyPath, int]:
    r"""Return the line, counted from 1, on which each key path of a TOML text first stands.

    Examples
    --------
    >>> line_numbers('format = 1\n[[lines]]\nname = "R1-R2"')[("lines", 0, "name")]
    3
    """
    starts = [0, *(match.end() for match in re.finditer("\n", text))]
    found: dict[KeyPath, int] = {}
    try:
        for path, offset in _Scanner(text).document():
            found.setdefault(path, bisect_right(starts, offset))
    except (_UnreadableError, tomllib.TOMLDecodeError, RecursionError):
        pass  # what was read so far is right, and the rest unknown
    return found


def locator(text: str) -> Locator:
    """Return a function that gives the line of a key path, or of the table it belongs to.

    A key that is missing is located where its table begins. The text is gone through at the first
    fault, since most have none.
    """
    lines = cache(line_numbers)

    def locate(path: KeyPath) -> int | None:
        known = lines(text)
        prefixes = (path[:end] for end in range(len(path), 0, -1))
        return next((known[prefix] for prefix in prefixes if prefix in known), None)

    return locate


def syntax_error_line(said: str, text: str) -> tuple[str, int | None]:
    """Split what the TOML parser says into the message and the line it speaks of.

    Examples
    --------
    >>> syntax_error_line("Invalid value (at line 3, column 9)", "")
    ('Invalid value', 3)
    """
    message, _, place = said.partition(" (at ")
    if place.startswith("end of document"):
        return message, text.count("\n", 0, len(text.rstrip())) + 1
    line = re.match(r"line (\d+)", place)
    return message, int(line[1]) if line else None
