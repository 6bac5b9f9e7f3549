"""The settings sheet as input: one row per terminal and setting group, as ``size`` writes it."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ..detector.criteria import Options, Settings
from ..model.errors import Fault, InputError
from ..model.parts import Feeder
from ..model.reading.fields import did_you_mean
from .run.options import parse_options

__all__ = ["SettingsSheet", "read_settings", "read_sheet"]

Pair = tuple[str, str]

KEYS = ("local", "remote")
NUMBERS = ("i_set_a", "v_set_pu", "z_set_ohm")


@dataclass(frozen=True, slots=True, kw_only=True)
class SettingsSheet:
    """Settings by group and (local, remote); None where a terminal is left without."""

    source: str  #: the file, as the user named it
    groups: dict[str, dict[Pair, Settings | None]]
    lines: dict[str, int]  #: where each group begins

    def for_groups(self, names: Sequence[str]) -> tuple[dict[Pair, Settings | None], ...]:
        """The settings of each of these groups; a sheet with one group serves them all.

        Raises
        ------
        InputError
            If the sheet has several groups, and they are others.
        """
        if len(self.groups) == 1:
            return tuple(next(iter(self.groups.values())) for _ in names)
        known = ", ".join(names)
        faults = [
            Fault(
                source=self.source,
                line=self.lines[name],
                where="setting_group",
                wanted=f"must be a group of the study: {known}{did_you_mean(name, list(names))}",
                found=repr(name),
            )
            for name in self.groups
            if name not in names
        ]
        faults += [
            Fault(
                source=self.source,
                line=None,
                where="",
                wanted=f"must hold the study's setting group {name!r}, or one group for all",
            )
            for name in names
            if name not in self.groups
        ]
        if faults:
            raise InputError(faults)
        return tuple(self.groups[name] for name in names)


def read_settings(path: Path, feeder: Feeder) -> dict[Pair, Settings | None]:
    """Read a sheet that has one setting group, by (local, remote).

    Raises
    ------
    InputError
        As `read_sheet`, and where there are several groups.
    """
    sheet = read_sheet(path, feeder)
    if len(sheet.groups) > 1:
        wanted = "must hold one setting group here"
        found = ", ".join(sheet.groups)
        raise InputError([_fault(path, None, "", wanted, found)])
    return next(iter(sheet.groups.values()))


def read_sheet(path: Path, feeder: Feeder, default: Options | None = None) -> SettingsSheet:
    """Read a settings sheet.

    Columns beyond local, remote, setting_group (one group where there is none), i_set_a,
    v_set_pu, z_set_ohm, negative_sign and options are not needed here.

    Parameters
    ----------
    path
        The sheet.
    feeder
        Whose terminals it must name.
    default
        The detector's options where the sheet has no columns for them.

    Raises
    ------
    InputError
        With every fault: missing columns, ragged rows, unknown or doubled terminals, bad numbers.
    """
    rows = _rows(path)
    pairs = {(s.local, s.remote) for s in feeder.sections}
    pairs |= {(remote, local) for local, remote in pairs}
    groups: dict[str, dict[Pair, Settings | None]] = {}
    lines: dict[str, int] = {}
    faults: list[Fault] = []
    for line, row, ragged in rows:
        if ragged is not None:
            faults.append(_fault(path, line, *ragged))
            continue
        pair, name = (row["local"], row["remote"]), "→".join((row["local"], row["remote"]))
        own, wrong = _settings(row, default or Options())
        faults += [_fault(path, line, f"{name}: {key}", *fault) for key, *fault in wrong]
        group = groups.setdefault(row.get("setting_group", ""), {})
        lines.setdefault(row.get("setting_group", ""), line)
        if pair not in pairs:
            hint = did_you_mean(name, ["→".join(p) for p in sorted(pairs)])
            wanted = f"must be a terminal of '{feeder.name}'{hint}"
            faults.append(_fault(path, line, "local and remote", wanted, name))
        elif pair in group:
            faults.append(_fault(path, line, "each terminal", "must stand in one row", name))
        else:
            group[pair] = own
    if not faults and not any(own for group in groups.values() for own in group.values()):
        faults.append(_fault(path, None, "", "must hold the settings of a terminal at least"))
    if faults:
        raise InputError(faults)
    return SettingsSheet(source=str(path), groups=groups, lines=lines)


Ragged = tuple[str, str, str]
Row = tuple[int, dict[str, str], Ragged | None]


def _rows(path: Path) -> list[Row]:
    """Every row as its line, its cells by column, and what is wrong with their number."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file, strict=True)
            columns = [name.strip() for name in next(reader, [])]
            _check_columns(path, columns)
            return list(_cells(columns, reader))
    except UnicodeDecodeError as error:
        raise InputError.single(str(path), "", None, "must be UTF-8 text") from error
    except csv.Error as error:
        raise InputError([_fault(path, reader.line_num, "", "must be CSV", str(error))]) from error
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError.single(str(path), "", reason, "must be a CSV file to read") from error


def _check_columns(path: Path, columns: list[str]) -> None:
    if len(columns) == 1 and ";" in columns[0]:
        raise InputError([_fault(path, 1, "columns", "must be separated by commas", "semicolons")])
    wanted = (*KEYS, *NUMBERS)
    faults = [
        _fault(path, 1, f"column {n}", f"must be in the sheet{did_you_mean(n, columns)}")
        for n in wanted
        if n not in columns
    ]
    faults += [
        _fault(path, 1, f"column {n}", "must be there once", str(columns.count(n)))
        for n in (*wanted, "setting_group", "negative_sign", "options")
        if columns.count(n) > 1
    ]
    if faults:
        raise InputError(faults)


def _cells(columns: list[str], reader: Iterator[list[str]]) -> Iterator[Row]:
    line = 2
    for cells in reader:
        here, line = line, reader.line_num + 1  # type: ignore[attr-defined]
        if not any(cell.strip() for cell in cells):
            continue
        row = {name: cell.strip() for name, cell in zip(columns, cells, strict=False)}
        ragged = ("a row", f"must have {len(columns)} cells", str(len(cells)))
        yield here, row, None if len(cells) == len(columns) else ragged


def _fault(
    path: Path, line: int | None, where: str, wanted: str, found: str | None = None
) -> Fault:
    return Fault(source=str(path), line=line, where=where, wanted=wanted, found=found)


def _settings(
    row: dict[str, str], default: Options
) -> tuple[Settings | None, list[tuple[str, str, str]]]:
    """A row's settings, None where all are empty; and each fault as column, rule, text."""
    texts = {name: row[name] for name in NUMBERS}
    if not any(texts.values()):
        return None, []
    numbers = {name: _number(text) for name, text in texts.items()}
    sign = (row.get("negative_sign") or str(default.negative_sign)).lower()
    wrong = [
        (name, "must be a number > 0", repr(texts[name]))
        for name, number in numbers.items()
        if not 0.0 < number < math.inf
    ]
    if 1.0 < numbers["v_set_pu"] < math.inf:
        wrong.append(("v_set_pu", "must be <= 1, per unit and not percent", texts["v_set_pu"]))
    if sign not in ("true", "false"):
        wrong.append(("negative_sign", "must be True or False", repr(row["negative_sign"])))
    options = replace(default, negative_sign=sign == "true")
    if "options" in row:
        try:
            options = parse_options(row["options"], options.negative_sign)
        except ValueError as error:
            wanted, _, found = str(error).partition(", got ")
            wrong.append(("options", wanted, found))
    if wrong:
        return None, wrong
    return Settings(**numbers, options=options), []


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
