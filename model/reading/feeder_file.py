"""Feeder files: reading them, writing them, and the ones that ship with the package."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from importlib import resources
from pathlib import Path

from ..errors import InputError
from ..feeder import checked_feeder
from ..parts import Feeder
from .csv_write import csv_text
from .feeder_document import document_from_feeder
from .feeder_fields import CSV_TABLES, ROWS
from .fields import did_you_mean
from .toml_file import parse_toml, read_text, toml_rows, write_text

__all__ = [
    "dump_feeder",
    "feeder_content",
    "feeder_from_toml",
    "load_feeder",
    "read_feeder",
    "shipped_feeders",
    "write_feeder",
]

_DATA = resources.files(__name__.removesuffix(".reading.feeder_file")) / "data"

OPENDSS_SUFFIXES = (".dss", ".txt")
"""Files of these are imported."""


def read_feeder(path: Path) -> Feeder:
    """Return the feeder that a file describes.

    Raises
    ------
    InputError
        If the file cannot be read, or with every fault of what it says.
    """
    return feeder_from_toml(read_text(path), str(path), path.parent)


def feeder_from_toml(text: str, source_name: str, folder: Path | None = None) -> Feeder:
    """Return the feeder that a TOML text describes.

    Parameters
    ----------
    text
        The feeder file's text.
    source_name
        Begins each message.
    folder
        Where the CSV tables stand that the text may name; None: it may name none.

    Raises
    ------
    InputError
        With every fault of the text.
    """
    return checked_feeder(parse_toml(text, source_name), folder)


def load_feeder(name_or_path: str) -> Feeder:
    """Return a shipped feeder by its name, or else the feeder in the file of that path.

    A file of OpenDSS's is imported; that needs the extra ``opendss``.

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
    if path.exists() and path.suffix.lower() in OPENDSS_SUFFIXES:
        # the importer needs this package whole, and an extra besides
        from ..importers.dss_feeder import import_opendss  # noqa: PLC0415

        return import_opendss(path).feeder
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
    """Return the text of a feeder file that reads back as exactly this feeder, origins included."""
    return _as_text(document_from_feeder(feeder))


def _as_text(document: Mapping[str, object]) -> str:
    """Return a document as TOML: first its plain values, then its tables in their order."""
    blocks: list[str] = []
    top = {key: value for key, value in document.items() if not isinstance(value, (dict, list))}
    blocks.append(toml_rows(top))
    for table, value in document.items():
        if isinstance(value, dict):
            blocks.append(f"[{table}]\n{toml_rows(value)}")
        elif isinstance(value, list):
            blocks.extend(f"[[{table}]]\n{toml_rows(row)}" for row in value)
    return "\n".join(blocks)


def write_feeder(
    feeder: Feeder, path: Path, *, tables: bool = False, comment: str = ""
) -> tuple[Path, ...]:
    """Write a feeder file that reads back as exactly this feeder, origins included.

    Parameters
    ----------
    feeder
        What to write; equal feeders of equal origins give equal files.
    path
        Of the feeder file; what stands there is replaced.
    tables
        Write the tables that may stand in CSV files to files of their own beside it, called
        after it and the table: ``town.loads.csv``.
    comment
        Text at the head of the file, such as the source of its figures.

    Returns
    -------
    tuple of Path
        The files written, the feeder file first.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    document = document_from_feeder(feeder)
    apart: dict[str, str] = {}
    if tables:
        stem = re.sub(r"[^\w.-]+", "-", path.stem)
        named = {table: f"{stem}.{table}.csv" for table in CSV_TABLES if document[table]}
        apart = {name: _table_text(document.pop(table), table) for table, name in named.items()}
        document = {"format": document.pop("format"), "tables": named, **document}
    head = "".join(f"# {line}".rstrip() + "\n" for line in comment.splitlines())
    text = f"{head}\n{_as_text(document)}" if head else _as_text(document)
    files = {path: text, **{path.parent / name: rows for name, rows in apart.items()}}
    for file, content in files.items():
        write_text(file, content)
    return tuple(files)


def _table_text(rows: object, table: str) -> str:
    assert isinstance(rows, list)
    return csv_text(rows, ROWS[table])


def feeder_content(feeder: Feeder) -> str:
    """Return a text that is the same for equal feeders, wherever their values come from.

    That is what a hash should be taken of: a default counts the same when it is written out.
    """
    return dump_feeder(replace(feeder, imported_from=None, origins={}))
