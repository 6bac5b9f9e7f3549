"""The settings sheet as input: one row per terminal, as ``size`` writes it."""

from __future__ import annotations

import csv
import math
from pathlib import Path

from ..detector.criteria import Options, Settings
from ..model.errors import Fault, InputError
from ..model.fields import did_you_mean
from ..model.parts import Feeder

__all__ = ["read_settings"]

NUMBERS = ("i_set_a", "v_set_pu", "z_set_ohm")


def read_settings(path: Path, feeder: Feeder) -> dict[tuple[str, str], Settings | None]:
    """Read settings by (local, remote); None where the sheet leaves a terminal without.

    Columns beyond local, remote, i_set_a, v_set_pu, z_set_ohm and negative_sign (True where
    there is none) are not needed here.

    Raises
    ------
    InputError
        With every fault: missing columns, unknown or doubled terminals, bad numbers.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            rows = list(reader)
            columns = reader.fieldnames or []
    except UnicodeDecodeError as error:
        raise InputError.single(str(path), "", None, "must be UTF-8 text") from error
    except (OSError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError.single(str(path), "", reason, "must be a CSV file to read") from error
    if len(columns) == 1 and ";" in columns[0]:
        raise InputError([_fault(path, 1, "columns", "must be separated by commas", "semicolons")])
    missing = [name for name in ("local", "remote", *NUMBERS) if name not in columns]
    if missing:
        raise InputError(_fault(path, 1, f"column {n}", "must be in the sheet") for n in missing)
    pairs = {(s.local, s.remote) for s in feeder.sections}
    pairs |= {(remote, local) for local, remote in pairs}
    found: dict[tuple[str, str], Settings | None] = {}
    faults: list[Fault] = []
    for line, row in enumerate(rows, start=2):
        pair = (row["local"] or "", row["remote"] or "")
        name = "→".join(pair)
        own, wrong = _settings(row)
        faults += [_fault(path, line, f"{name}: {key}", *fault) for key, *fault in wrong]
        if pair not in pairs:
            hint = did_you_mean(name, ["→".join(p) for p in sorted(pairs)])
            wanted = f"must be a terminal of '{feeder.name}'{hint}"
            faults.append(_fault(path, line, "local and remote", wanted, name))
        elif pair in found:
            faults.append(_fault(path, line, "each terminal", "must stand in one row", name))
        else:
            found[pair] = own
    if faults:
        raise InputError(faults)
    return found


def _fault(path: Path, line: int, where: str, wanted: str, found: str | None = None) -> Fault:
    return Fault(source=str(path), line=line, where=where, wanted=wanted, found=found)


def _settings(row: dict[str, str]) -> tuple[Settings | None, list[tuple[str, str, str]]]:
    """A row's settings, None where all are empty; and each fault as column, rule, text."""
    texts = {name: (row[name] or "").strip() for name in NUMBERS}
    if not any(texts.values()):
        return None, []
    numbers = {name: _number(text) for name, text in texts.items()}
    sign = (row.get("negative_sign") or "True").strip().lower()
    wrong = [
        (name, "must be a number > 0", repr(texts[name]))
        for name, number in numbers.items()
        if not 0.0 < number < math.inf
    ]
    if 1.0 < numbers["v_set_pu"] < math.inf:
        wrong.append(("v_set_pu", "must be <= 1, per unit and not percent", texts["v_set_pu"]))
    if sign not in ("true", "false"):
        wrong.append(("negative_sign", "must be True or False", repr(row["negative_sign"])))
    if wrong:
        return None, wrong
    return Settings(**numbers, options=Options(negative_sign=sign == "true")), []


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
