"""Feeder files: reading them, writing them, and the ones that ship with the package."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path

from .errors import Fault, InputError, Report
from .feeder import checked_feeder
from .feeder_document import document_from_feeder
from .fields import did_you_mean
from .parts import Feeder
from .toml_lines import locator, syntax_error_line

__all__ = ["dump_feeder", "feeder_from_toml", "load_feeder", "read_feeder", "shipped_feeders"]

_DATA = resources.files(__name__.rpartition(".")[0]) / "data"


def read_feeder(path: Path) -> Feeder:
    """Return the feeder that a file describes.

    Raises
    ------
    InputError
        If the file cannot be read, or with every fault of what it says.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError.single(str(path), "", None, "must be UTF-8 text") from error
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise InputError.single(str(path), "", reason, "must be a file to read") from error
    return feeder_from_toml(text, str(path))


def feeder_from_toml(text: str, source_name: str) -> Feeder:
    """Return the feeder that a TOML text describes; ``source_name`` begins each message.

    Raises
    ------
    InputError
        With every fault of the text.
    """
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError([_syntax_fault(error, text, source_name)]) from error
    return checked_feeder(Report(source=source_name, document=document, locate=locator(text)))


def _syntax_fault(error: Exception, text: str, source_name: str) -> Fault:
    message, line = syntax_error_line(str(error), text)
    return Fault(source=source_name, line=line, where="", wanted=f"is not valid TOML: {message}")


def load_feeder(name_or_path: str) -> Feeder:
    """Return a shipped feeder by its name, or else the feeder in the file of that path.

    Raises
    ------
    InputError
        If there is neither, or with every fault of the file.

    Examples
    --------
    >>> load_feeder("paper").source.kv_ll
    12.0
    """
    shipped = shipped_feeders()
    if name_or_path in shipped:
        file_name = f"{name_or_path}.toml"
        return feeder_from_toml((_DATA / file_name).read_text(encoding="utf-8"), file_name)
    path = Path(name_or_path)
    if path.exists():
        return read_feeder(path)
    rule = (
        f"must be a file or one of the shipped feeders, {', '.join(shipped)}"
        f"{did_you_mean(name_or_path, shipped)}"
    )
    raise InputError.single("", "feeder", repr(name_or_path), rule)


def shipped_feeders() -> tuple[str, ...]:
    """Return the names of the feeders that ship with the package, sorted."""
    names = sorted(entry.name for entry in _DATA.iterdir())
    return tuple(
        name.removesuffix(".toml")
        for name in names
        if name.endswith(".toml") and not name.endswith(".study.toml")
    )


def dump_feeder(feeder: Feeder) -> str:
    """Return the text of a feeder file that reads back as exactly this feeder."""
    document = document_from_feeder(feeder)
    blocks: list[str] = []
    top = {key: value for key, value in document.items() if not isinstance(value, (dict, list))}
    blocks.append(_rows_of(top))
    for table, value in document.items():
        if isinstance(value, dict):
            blocks.append(f"[{table}]\n{_rows_of(value)}")
        elif isinstance(value, list):
            blocks.extend(f"[[{table}]]\n{_rows_of(row)}" for row in value)
    return "\n".join(blocks)


def _rows_of(table: Mapping[str, object]) -> str:
    return "".join(f"{key} = {_toml_value(value)}\n" for key, value in table.items())


def _toml_value(value: object) -> str:
    """Return a value as TOML; the escapes of JSON are among TOML's."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, float):
        return repr(float(value))
    if isinstance(value, Sequence):
        return f"[{', '.join(_toml_value(item) for item in value)}]"
    return str(value)
