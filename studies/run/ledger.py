"""How often a certificate has been tried for: trying again costs error probability.

``ledger.json`` stands beside the run folders. Attempts are counted per *population*: the
feeder, and what the study says of loads, events and instruments. What is demanded of the
settings (device, margin, target) is not part of it, or one could go on choosing on one
validation sample until it shows no false trip. Repeating a run keeps its number.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ...model.errors import OpenPhaseError
from .store import as_json, write_whole

__all__ = ["Attempt", "enter", "find_attempt"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """One try: its number from 1, its size, and where it stands in the ledger."""

    number: int
    scenarios: int
    population: str  #: hash of what is drawn
    study: str  #: hash of the whole study
    seed: int


def find_attempt(
    path: Path, population: str, study: str, seed: int, size: int | Callable[[int], int]
) -> Attempt:
    """Look an attempt up in the ledger at ``path``, or take the next number; nothing is written.

    ``size`` is the number of scenarios, or gives it for an attempt's number where the user
    named none: later attempts need more.
    """
    entries = _read(path).get(population, [])
    for number in range(1, len(entries) + 2):
        scenarios = size if isinstance(size, int) else size(number)
        entry = {"study": study, "seed": seed, "scenarios": scenarios}
        if number > len(entries) or entries[number - 1] == entry:
            break
    return Attempt(
        number=number, scenarios=scenarios, population=population, study=study, seed=seed
    )


def enter(path: Path, attempt: Attempt) -> None:
    """Write an attempt into the ledger, unless it is there."""
    ledger = _read(path)
    entries = ledger.setdefault(attempt.population, [])
    if attempt.number > len(entries):
        entries.append(
            {"study": attempt.study, "seed": attempt.seed, "scenarios": attempt.scenarios}
        )
        write_whole(path, as_json(ledger).encode("utf-8"))


def _read(path: Path) -> dict[str, list[dict[str, object]]]:
    """The ledger: attempts in order, by population. Raises OpenPhaseError where it is none."""
    try:
        ledger = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise OpenPhaseError(f"{path}: is no ledger of openphase: {error}") from error
    entries = list(ledger.values()) if isinstance(ledger, dict) else [None]
    if not all(
        isinstance(own, list) and all(isinstance(entry, dict) for entry in own) for own in entries
    ):
        raise OpenPhaseError(f"{path}: is no ledger of openphase: must list attempts")
    return dict(ledger)
