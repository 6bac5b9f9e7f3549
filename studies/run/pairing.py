"""Two runs that drew the same scenarios, paired: what each one's settings said of every event."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...detector.criteria import Reason
from ...model.errors import Fault, InputError
from .classes import REPORTED, DrawClass, reported_row
from .store import block_array
from .verdicts import REASONS, unpack_verdicts

__all__ = ["Pairs", "Run", "differences", "pair_runs", "read_run"]

#: what two runs must have in common to have drawn the same scenarios with the same code
SAME = {
    "population_sha256": "population",
    "seed": "seed",
    "attempt": "attempt",
    "scenarios": "scenarios",
    "block": "scenarios of a block",
    "openphase": "version of openphase",
    "code_sha256": "code of openphase",
    "python": "version of Python",
    "libraries": "versions of the libraries",
}

BLOCK_NAME = re.compile(r"validate-\d+-(?:g(?P<group>\d+)-)?(?P<drawn>[a-z_]+)-\d+")


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A finished run of ``size`` or ``assess`` on disk."""

    path: Path
    manifest: dict[str, Any]
    result: dict[str, Any]
    blocks: tuple[str, ...]  #: names of the stored validation blocks


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pairs:
    """What A and B said of the same events, at one terminal in one group."""

    classes: NDArray[np.int64]  #: (R, 2, 2) per reported class, A did not or did trip, and B
    breaks: NDArray[np.int64]  #: (REASONS, REASONS) of breaks that can be seen: reasons of A, B


def read_run(path: Path) -> Run:
    """A finished run.

    Raises
    ------
    InputError
        Where the folder holds none.
    """
    try:
        manifest = json.loads((path / "manifest.json").read_text(encoding="utf-8"))
        result = json.loads((path / "result.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        wanted = "must be the folder of a finished run of size or assess"
        raise InputError.single(str(path), "", reason, wanted) from error
    known = isinstance(manifest, dict) and isinstance(result, dict)
    if not known or not SAME.keys() <= manifest.keys() or "sections" not in result:
        wanted = "must be the folder of a run of size or assess, of this version"
        raise InputError.single(str(path), "", None, wanted)
    blocks = sorted(file.stem for file in (path / "blocks").glob("validate-*.npz"))
    return Run(path=path, manifest=manifest, result=result, blocks=tuple(blocks))


def differences(a: Run, b: Run) -> list[Fault]:
    """Everything that keeps two runs from being compared; empty where nothing does."""
    faults = [
        _fault(
            b,
            _population(a, b) if key == "population_sha256" else what,
            f"must be as in {a.path}, {_short(a.manifest[key])}",
            b.manifest[key],
        )
        for key, what in SAME.items()
        if a.manifest[key] != b.manifest[key]
    ]
    if faults:
        return faults
    ours, theirs = ([_terminal(row) for row in run.result["sections"]] for run in (a, b))
    if ours != theirs:
        faults.append(_fault(b, "terminals", f"must be as in {a.path}", ", ".join(theirs)))
    drawn, other = (", ".join(sorted(_classes(run))) for run in (a, b))
    if drawn != other:
        return [*faults, _fault(b, "classes drawn", f"must be as in {a.path}, {drawn}", other)]
    missing = sorted(set(a.blocks) ^ set(b.blocks))
    if missing or not a.blocks:
        where = f"blocks/{missing[0]}.npz" if missing else "blocks"
        wanted = "must be there in both; the command of a run, given again, fills it in"
        faults.append(_fault(b, where, wanted))
    return faults


def _population(a: Run, b: Run) -> str:
    """Which of the two things that decide what is drawn is another one."""
    names = {"feeder_sha256": "feeder", "study_sha256": "what the study draws"}
    other = [name for key, name in names.items() if a.manifest.get(key) != b.manifest.get(key)]
    return " and ".join(other) or "population"


def _terminal(row: dict[str, Any]) -> str:
    return f"{row['local']}→{row['remote']} ({row['setting_group']})"


def _classes(run: Run) -> set[str]:
    """Names of the classes that a run has blocks of; a study may leave some out."""
    matches = (BLOCK_NAME.fullmatch(name) for name in run.blocks)
    return {match["drawn"] for match in matches if match is not None}


def _fault(run: Run, where: str, wanted: str, found: object = None) -> Fault:
    said = None if found is None else _short(found)
    return Fault(source=str(run.path), line=None, where=where, wanted=wanted, found=said)


def _short(value: object) -> str:
    """A value as a message shows it: of a hash its beginning."""
    text = value if isinstance(value, str) else json.dumps(value)
    return f"{text[:12]}…" if re.fullmatch(r"[0-9a-f]{64}", text) else text


def pair_runs(a: Run, b: Run) -> list[Pairs]:
    """Per row of the results, how the two runs' verdicts go together.

    Raises
    ------
    InputError
        Where a block is damaged, or the two were not drawn alike after all.
    """
    groups = list(dict.fromkeys(row["setting_group"] for row in a.result["sections"]))
    terminals = len(a.result["sections"]) // len(groups)
    found = [_nothing() for _ in a.result["sections"]]
    for name, group, drawn in _named(a):
        bytes_a, bytes_b = (_verdicts(run, name, terminals) for run in (a, b))
        for t in range(terminals):
            _count(found[group * terminals + t], drawn, bytes_a[t], bytes_b[t], (b, name))
    return found


def _named(run: Run) -> Iterator[tuple[str, int, DrawClass]]:
    """Every block with its group and class."""
    for name in run.blocks:
        match = BLOCK_NAME.fullmatch(name)
        drawn = match["drawn"].upper() if match else ""
        if match is None or drawn not in DrawClass.__members__:
            raise InputError([_fault(run, f"blocks/{name}.npz", "must be a block of this version")])
        yield name, int(match["group"] or 0), DrawClass[drawn]


def _verdicts(run: Run, name: str, terminals: int) -> NDArray[np.uint8]:
    found = block_array(run.path / "blocks" / f"{name}.npz", "verdicts")
    if found is None or found.ndim != 2 or found.shape[0] != terminals or found.dtype != np.uint8:
        wanted = "must be whole; the command of the run, given again, mends it"
        raise InputError([_fault(run, f"blocks/{name}.npz", wanted)])
    return found


def _nothing() -> Pairs:
    return Pairs(
        classes=np.zeros((len(REPORTED), 2, 2), np.int64),
        breaks=np.zeros((REASONS, REASONS), np.int64),
    )


def _count(
    pairs: Pairs,
    drawn: DrawClass,
    a: NDArray[np.uint8],
    b: NDArray[np.uint8],
    where: tuple[Run, str],
) -> None:
    """Add a block's scenarios at one terminal."""
    (reason_a, side, reachable), (reason_b, *same) = unpack_verdicts(a), unpack_verdicts(b)
    if not (np.array_equal(side, same[0]) and np.array_equal(reachable, same[1])):
        run, name = where
        raise InputError([_fault(run, f"blocks/{name}.npz", "must hold the same events")])
    row = reported_row(drawn)[side]
    counted = row >= 0
    cell = 4 * row + 2 * (reason_a == Reason.TRIP) + (reason_b == Reason.TRIP)
    pairs.classes.reshape(-1)[:] += np.bincount(cell[counted], minlength=pairs.classes.size)
    must_trip = np.array([own.kind == "must_trip" for own in REPORTED])
    seen = counted & reachable & must_trip[row]
    cell = REASONS * reason_a.astype(np.int64) + reason_b
    pairs.breaks.reshape(-1)[:] += np.bincount(cell[seen], minlength=pairs.breaks.size)
