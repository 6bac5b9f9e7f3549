"""TOML files of the user: read with their faults located, written so that they read back."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..errors import Fault, InputError, Report
from .toml_lines import locator, syntax_error_line

__all__ = ["parse_toml", "read_text", "toml_rows", "write_text"]


def read_text(path: Path) -> str:
    """Return the text of a file.

    Raises
    ------
    InputError
        If the file cannot be read or is not UTF-8.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        raise InputError.single(str(path), "", "no regular file", "must be a file to read")
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError.single(str(path), "", None, "must be UTF-8 text") from error
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise InputError.single(str(path), "", reason, "must be a file to read") from error


def write_text(path: Path, text: str) -> None:
    """Write a file of UTF-8 text, the same on every system.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    try:
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise InputError.single(str(path), "", reason, "must be a file to write") from error


def parse_toml(text: str, source_name: str) -> Report:
    """Return an empty report about the document in ``text``, ready for its checks.

    Raises
    ------
    InputError
        If the text is not TOML, with the line.
    """
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        message, line = syntax_error_line(str(error), text)
        wanted = f"is not valid TOML: {message}"
        raise InputError([Fault(source=source_name, line=line, where="", wanted=wanted)]) from error
    return Report(source=source_name, document=document, locate=locator(text))


def toml_rows(table: Mapping[str, object]) -> str:
    """Return a table's keys and values, one a line; floats read back exactly.

    Examples
    --------
    >>> print(toml_rows({"name": "T1", "at": 0.5}), end="")
    name = "T1"
    at = 0.5
    """
    return "".join(f"{key} = {_value(value)}\n" for key, value in table.items())


def _value(value: object) -> str:
    """Return a value as TOML; the escapes of JSON are among TOML's."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, float):
        return repr(float(value))
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {_value(item)}' for key, item in value.items())} }}"
    if isinstance(value, Sequence):
        return f"[{', '.join(_value(item) for item in value)}]"
    return str(value)
