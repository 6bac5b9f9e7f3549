"""How often a study has been tried: the price of trying again is a smaller error probability.

``ledger.json`` stands beside the run folders. An attempt is a new seed or size of the same
feeder and study; repeating or resuming one keeps its number.
"""

from __future__ import annotations

import json
from pathlib import Path

from ...model.errors import OpenPhaseError
from .store import as_json, write_whole

__all__ = ["attempt_number"]


def attempt_number(path: Path, content: str, seed: int, scenarios: int) -> int:
    """Look up, or enter, the attempt's number (from 1) in the ledger at ``path``.

    ``content`` is the hash of feeder and study.
    """
    try:
        ledger = json.loads(path.read_text(encoding="utf-8"))
        entries = ledger.setdefault(content, [])
        entry = {"seed": seed, "scenarios": scenarios}
        if entry in entries:
            return int(entries.index(entry)) + 1
    except FileNotFoundError:
        ledger, entry = {content: []}, {"seed": seed, "scenarios": scenarios}
    except (OSError, ValueError, AttributeError) as error:
        raise OpenPhaseError(f"{path}: is no ledger of openphase: {error}") from error
    ledger[content].append(entry)
    write_whole(path, as_json(ledger).encode("utf-8"))
    return len(ledger[content])
