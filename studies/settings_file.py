"""The settings sheet as input: one row per terminal, as ``size`` writes it."""

from __future__ import annotations

import csv
import math
from pathlib import Path

from ..detector.criteria import Settings
from ..model.errors import Fault, InputError
from ..model.fields import did_you_mean
from ..model.parts import Feeder

__all__ = ["read_settings"]

NUMBERS = ("i_set_a", "v_set_pu", "z_set_ohm")


def read_settings(path: Path, feeder: Feeder) -> dict[tuple[str, str], Settings | None]:
    """Read settings by (local, remote); None where the sheet leaves a terminal without.

    Columns beyond local, remote, i_set_a, v_set_pu and z_set_ohm are not needed here.

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
        raise InputError.single(str(path), "", str(error), "must be a CSV file to read") from error
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
        if pair not in pairs:
            hint = did_you_mean(name, ["→".join(p) for p in sorted(pairs)])
            wanted = f"must be a terminal of '{feeder.name}'{hint}"
            faults.append(_fault(path, line, "local and remote", wanted, name))
        elif pair in found:
            faults.append(_fault(path, line, "each terminal", "must stand in one row", name))
        else:
            found[pair], wrong = _settings(row)
            faults += [
                _fault(path, line, f"{name}: {key}", "must be a number > 0", repr(text))
                for key, text in wrong
            ]
    if faults:
        raise InputError(faults)
    return found


def _fault(path: Path, line: int, where: str, wanted: str, found: str | None = None) -> Fault:
    return Fault(source=str(path), line=line, where=where, wanted=wanted, found=found)


def _settings(row: dict[str, str]) -> tuple[Settings | None, list[tuple[str, str]]]:
    """A row's settings, None where all are empty; and the columns that hold no number > 0."""
    texts = {name: (row[name] or "").strip() for name in NUMBERS}
    if not any(texts.values()):
        return None, []
    wrong = [(name, text) for name, text in texts.items() if not _positive(text)]
    if wrong:
        return None, wrong
    i_set_a, v_set_pu, z_set_ohm = (float(text) for text in texts.values())
    return Settings(i_set_a=i_set_a, v_set_pu=v_set_pu, z_set_ohm=z_set_ohm), []


def _positive(text: str) -> bool:
    try:
        return 0.0 < float(text) < math.inf
    except ValueError:
        return False
