"""The CSV tables that a feeder file names: read, and put where its own tables would stand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path, PurePosixPath

from ..errors import InputError, KeyPath, Locator, Report
from .csv_table import CsvTable, parse_csv
from .feeder_fields import ROWS, TABLES
from .feeder_refused import KEYS
from .table_check import REPORTED, check_table
from .toml_file import read_text

__all__ = ["with_csv_tables"]


def with_csv_tables(report: Report, folder: Path | None) -> Report:
    """Return the report with the rows of the document's CSV tables in the document.

    Parameters
    ----------
    report
        Holds the document; faults of the tables go to it.
    folder
        The feeder file's. None for a document that is no file, which cannot name tables.
    """
    named = report.document.get("tables")
    if not isinstance(named, Mapping):
        return report
    names = check_table(named, TABLES["tables"], ("tables",), report, KEYS["tables"])
    document = dict(report.document)
    elsewhere = dict(report.elsewhere)
    read: list[CsvTable] = []
    for table in (table for table in named if names.get(table)):
        path: KeyPath = ("tables", table)
        if table in report.document:
            rule = f"must be left out where the file has [[{table}]] of its own"
            report.add(path, rule, repr(names[table]))
            continue
        file = _inside(names[table], folder, path, report)
        text = None if file is None else _text(file, names[table], path, report)
        if file is None or text is None:
            document[table] = [{own.name: REPORTED for own in ROWS[table]}]
            continue
        found = parse_csv(text, table, ROWS[table], KEYS[table])
        document[table] = found.rows
        elsewhere[table] = (str(file), _locator(found))
        read.append(found)
    for table in named.keys() & ROWS.keys() - document.keys():
        document[table] = [{own.name: REPORTED for own in ROWS[table]}]
    whole = replace(report, document=document, elsewhere=elsewhere)
    for found in read:
        found.report(whole)
    return whole


def _inside(name: str, folder: Path | None, path: KeyPath, report: Report) -> Path | None:
    """Return the file of that name in the folder; report one that would stand elsewhere."""
    if folder is None:
        report.add(path, "must be left out of a feeder that is not read from a file", repr(name))
        return None
    parts = PurePosixPath(name)
    if parts.is_absolute() or ".." in parts.parts or "\\" in name:
        rule = "must be a path below the feeder file's folder, written with / and without .."
        report.add(path, rule, repr(name))
        return None
    file = folder / name
    try:
        stays = file.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # a link that leads to itself
        stays = False
    if not stays:
        report.add(path, "must stay in the feeder file's folder, which a link leaves", repr(name))
        return None
    return file


def _text(file: Path, name: str, path: KeyPath, report: Report) -> str | None:
    """Return the text of a file; report one that cannot be read."""
    if file.exists() and not file.is_file():
        report.add(path, "must name a file", repr(name))
        return None
    try:
        return read_text(file)
    except InputError as error:
        reason = error.faults[0].found
        rule = "a file of UTF-8 text" if reason is None else f"a file to read: {reason}"
        report.add(path, f"must name {rule}", repr(name))
        return None


def _locator(found: CsvTable) -> Locator:
    """Return a function that gives the line of a key path in the table's file."""

    def locate(path: KeyPath) -> int | None:
        prefixes = (path[:end] for end in range(len(path), 0, -1))
        return next((found.lines[prefix] for prefix in prefixes if prefix in found.lines), None)

    return locate
