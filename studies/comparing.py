"""``openphase compare``: runs that share their draws, scenario by scenario."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..detector.criteria import Reason
from ..model.errors import InputError
from ..optimise.certificate import paired_difference
from .run.classes import REPORTED
from .run.pairing import Pairs, Run, differences, pair_runs, read_run
from .run.store import as_json
from .show.comparison import comparison_text

__all__ = ["compare_command", "compare_runs"]

#: what a comparison repeats of a row: all that decides what its terminal says, and its result
OF_A_SETTING = (
    "status",
    "i_set_a",
    "v_set_pu",
    "z_set_ohm",
    "dt_ms",
    "negative_sign",
    "options",
    "detected",
    "false_trips",
)

NO_SETTING = "no_setting"  #: why a terminal that has none misses every break


def compare_command(args: argparse.Namespace) -> int:
    """Run the verb; returns the exit code."""
    if len(args.runs) < 2:
        wanted = "must be two folders at least"
        raise InputError.single("", "RUN", str(args.runs[0]), wanted)
    result = compare_runs(args.runs)
    print(as_json(result) if args.json else comparison_text(result), end="")
    return 0


def compare_runs(paths: Sequence[Path]) -> dict[str, Any]:
    """Compare every run with the first.

    Returns
    -------
    dict
        What ``compare --json`` prints: ``runs``, and per pair of the first run (A) and a
        further one (B) a row for every terminal and group.

    Raises
    ------
    InputError
        Where a folder holds no finished run, or the runs did not draw the same scenarios:
        with everything that makes them incomparable.
    """
    runs = [read_run(path) for path in paths]
    faults = [fault for other in runs[1:] for fault in differences(runs[0], other)]
    if faults:
        raise InputError(faults)
    first = runs[0]
    with_interval = _rows_with_a_setting(runs)
    alpha = (1.0 - first.result["confidence"]) / max(len(with_interval) * (len(runs) - 1), 1)
    return {
        "version": first.result["version"],
        "feeder": first.result["feeder"],
        "seed": first.result["seed"],
        "attempt": first.result["attempt"],
        "scenarios": first.result["scenarios"],
        "confidence": first.result["confidence"],
        "runs": [_described(run) for run in runs],
        "comparisons": [
            {"a": 0, "b": n, "sections": _sections(first, other, with_interval, alpha)}
            for n, other in enumerate(runs[1:], 1)
        ],
    }


def _rows_with_a_setting(runs: Sequence[Run]) -> frozenset[int]:
    """Rows in which any run has a setting, load-side ones too: each has an interval.

    They are known before an event is looked at, and the same in whatever order the runs come.
    """
    return frozenset(
        k for run in runs for k, row in enumerate(run.result["sections"]) if row["i_set_a"]
    )


def _described(run: Run) -> dict[str, Any]:
    return {
        "run": str(run.path),
        "verb": run.manifest["command"][0],
        "study_hash": run.result["study_hash"],
        "settings": run.result.get("assessed", {}).get("settings", "chosen"),
    }


def _sections(a: Run, b: Run, with_interval: frozenset[int], alpha: float) -> list[dict[str, Any]]:
    """A row for every terminal and group; each interval misses with probability ``alpha``."""
    rows = zip(a.result["sections"], b.result["sections"], pair_runs(a, b), strict=True)
    return [
        _section(own, other, pairs, alpha if k in with_interval else None)
        for k, (own, other, pairs) in enumerate(rows)
    ]


def _section(
    a: dict[str, Any], b: dict[str, Any], pairs: Pairs, alpha: float | None
) -> dict[str, Any]:
    """What two runs say of one terminal in one group; no interval where ``alpha`` is None."""
    classes = [_class(r, pairs) for r in range(len(REPORTED)) if pairs.classes[r].any()]
    must_not = [own for own in classes if own["kind"] == "must_not_trip"]
    trip = np.arange(len(pairs.breaks)) == Reason.TRIP
    both, only_a = (int(pairs.breaks[trip][:, own].sum()) for own in (trip, ~trip))
    only_b, neither = (int(pairs.breaks[~trip][:, own].sum()) for own in (trip, ~trip))
    n = both + only_a + only_b + neither
    interval = (None, None) if alpha is None else paired_difference(only_b, only_a, n, alpha)
    return {
        "local": a["local"],
        "remote": a["remote"],
        "setting_group": a["setting_group"],
        "a": _setting(a),
        "b": _setting(b),
        "reachable": n,
        "both": both,
        "only_a": only_a,
        "only_b": only_b,
        "neither": neither,
        "difference": (only_b - only_a) / n if n else None,
        "difference_low": interval[0] if n else None,
        "difference_high": interval[1] if n else None,
        "security_trials": sum(own["trials"] for own in must_not),
        "false_trips": {
            key: sum(own[key] for own in must_not) for key in ("both", "only_a", "only_b")
        },
        "classes": classes,
        "gained": _causes(pairs.breaks[:, Reason.TRIP], a),
        "lost": _causes(pairs.breaks[Reason.TRIP], b),
    }


def _setting(row: dict[str, Any]) -> dict[str, Any]:
    return {key: row[key] for key in OF_A_SETTING}


def _class(r: int, pairs: Pairs) -> dict[str, Any]:
    """How often each run tripped in one class."""
    own, counts = REPORTED[r], pairs.classes[r].tolist()
    return {
        "name": own.name,
        "kind": own.kind,
        "side": own.side,
        "trials": int(pairs.classes[r].sum()),
        "both": counts[1][1],
        "only_a": counts[1][0],
        "only_b": counts[0][1],
    }


def _causes(counts: NDArray[np.int64], row: dict[str, Any]) -> list[dict[str, Any]]:
    """Why one run missed the breaks that the other alone found, the commonest first."""
    missed = {reason: int(counts[reason]) for reason in Reason if reason != Reason.TRIP}
    if row["i_set_a"] is None:
        total = sum(missed.values())
        return [{"criterion": NO_SETTING, "breaks": total}] if total else []
    return [
        {"criterion": reason.name.lower(), "breaks": count}
        for reason, count in sorted(missed.items(), key=lambda own: (-own[1], own[0]))
        if count
    ]
