"""How often a certificate has been tried for: trying again costs error probability.

``ledger.json`` stands beside the run folders. Attempts are counted per *feeder*, whatever is
studied on it: with another margin, another law of some event or another seed one could go on
until a validation sample shows no false trip. Each gets draws of its own. Repeating a run
keeps its number. Sheets that were judged on an attempt's draws are noted with it, for a sheet
that was changed after looking at them is certified by nothing.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ...model.errors import OpenPhaseError
from .store import as_json, write_whole

__all__ = ["LEDGER", "Attempt", "find_attempt", "reserve", "sheets_before"]

LEDGER = "ledger.json"  #: beside the run folders

LOCK_TRIES, LOCK_WAIT_S = 100, 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """One try: its number from 1, its size, and where it stands in the ledger."""

    number: int
    scenarios: int
    feeder: str  #: hash of the feeder
    study: str  #: hash of the whole study
    seed: int


def find_attempt(
    path: Path, feeder: str, study: str, seed: int, size: int | Callable[[int], int]
) -> Attempt:
    """Look an attempt up in the ledger at ``path``, or take the next number; nothing is written.

    ``size`` is the number of scenarios, or gives it for an attempt's number where the user
    named none: later attempts need more.
    """
    entries = _read(path).get(feeder, [])
    for number in range(1, len(entries) + 2):
        scenarios = size if isinstance(size, int) else size(number)
        entry = {"study": study, "seed": seed, "scenarios": scenarios}
        if number > len(entries) or entry.items() <= entries[number - 1].items():
            break
    return Attempt(number=number, scenarios=scenarios, feeder=feeder, study=study, seed=seed)


def reserve(
    path: Path, feeder: str, study: str, seed: int, size: int | Callable[[int], int]
) -> Attempt:
    """Find the attempt and write it into the ledger, so that no other run gets its number."""
    with _locked(path):
        attempt = find_attempt(path, feeder, study, seed, size)
        ledger = _read(path)
        entries = ledger.setdefault(feeder, [])
        if attempt.number > len(entries):
            entries.append({"study": study, "seed": seed, "scenarios": attempt.scenarios})
            write_whole(path, as_json(ledger).encode("utf-8"))
    return attempt


def sheets_before(path: Path, attempt: Attempt, sheet: str) -> int:
    """Note that a sheet (its hash) is judged on an attempt's draws; how many others were before.

    A sheet that is judged again keeps its place.
    """
    with _locked(path):
        ledger = _read(path)
        entry = ledger[attempt.feeder][attempt.number - 1]
        seen = entry.setdefault("sheets", [])
        if not isinstance(seen, list):
            raise OpenPhaseError(f"{path}: is no ledger of openphase: must list sheets")
        if sheet not in seen:
            seen.append(sheet)
            write_whole(path, as_json(ledger).encode("utf-8"))
        return seen.index(sheet)


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Keep other runs from the ledger for the moment it takes to write it."""
    lock = path.with_name(path.name + ".lock")
    for _ in range(LOCK_TRIES):
        try:
            lock.parent.mkdir(parents=True, exist_ok=True)
            lock.touch(exist_ok=False)
            break
        except FileExistsError:
            if not lock.parent.is_dir():
                raise OpenPhaseError(f"{path.parent}: must be a folder") from None
            time.sleep(LOCK_WAIT_S)
        except OSError as error:
            raise OpenPhaseError(f"{path}: {error.strerror or error}") from error
    else:
        raise OpenPhaseError(f"{lock}: another run holds the ledger; remove it if there is none")
    try:
        yield
    finally:
        lock.unlink(missing_ok=True)


def _read(path: Path) -> dict[str, list[dict[str, object]]]:
    """The ledger: attempts in order, by feeder. Raises OpenPhaseError where it is none."""
    try:
        ledger = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise OpenPhaseError(f"{path}: cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise OpenPhaseError(f"{path}: is no ledger of openphase: {error}") from error
    entries = list(ledger.values()) if isinstance(ledger, dict) else [None]
    if not all(
        isinstance(own, list) and all(isinstance(entry, dict) for entry in own) for own in entries
    ):
        raise OpenPhaseError(f"{path}: is no ledger of openphase: must list attempts")
    return dict(ledger)
