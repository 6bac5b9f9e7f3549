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
    alpha = (1.0 - first.result["confidence"]) / max(_judged(first), 1)
    return {
        "version": first.result["version"],
        "feeder": first.result["feeder"],
        "seed": first.result["seed"],
        "attempt": first.result["attempt"],
        "scenarios": first.result["scenarios"],
        "confidence": first.result["confidence"],
        "runs": [_described(run) for run in runs],
        "comparisons": [_comparison(first, n, other, alpha) for n, other in enumerate(runs[1:], 1)],
    }


def _judged(run: Run) -> int:
    """Terminals and groups whose intervals are to hold together."""
    return sum(row["status"] != "load_side" for row in run.result["sections"])


def _described(run: Run) -> dict[str, Any]:
    return {
        "run": str(run.path),
        "verb": run.manifest["command"][0],
        "study_hash": run.result["study_hash"],
        "settings": run.result.get("assessed", {}).get("settings", "chosen"),
    }


def _comparison(a: Run, n: int, b: Run, alpha: float) -> dict[str, Any]:
    pairs = pair_runs(a, b)
    rows = zip(a.result["sections"], b.result["sections"], strict=True)
    return {
        "a": 0,
        "b": n,
        "sections": [_section(own, other, pairs[k], alpha) for k, (own, other) in enumerate(rows)],
    }


def _section(a: dict[str, Any], b: dict[str, Any], pairs: Pairs, alpha: float) -> dict[str, Any]:
    """What two runs say of one terminal in one group."""
    classes = [_class(r, pairs) for r in range(len(REPORTED)) if pairs.classes[r].any()]
    must_not = [own for own in classes if own["kind"] == "must_not_trip"]
    trip = np.arange(len(pairs.breaks)) == Reason.TRIP
    both, only_a = (int(pairs.breaks[trip][:, own].sum()) for own in (trip, ~trip))
    only_b, neither = (int(pairs.breaks[~trip][:, own].sum()) for own in (trip, ~trip))
    n = both + only_a + only_b + neither
    low, high = paired_difference(only_b, only_a, n, alpha)
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
        "difference_low": low if n else None,
        "difference_high": high if n else None,
        "security_trials": sum(own["trials"] for own in must_not),
        "false_trips": {
            key: sum(own[key] for own in must_not) for key in ("both", "only_a", "only_b")
        },
        "classes": classes,
        "gained": _causes(pairs.breaks[:, Reason.TRIP], a),
        "lost": _causes(pairs.breaks[Reason.TRIP], b),
    }


def _setting(row: dict[str, Any]) -> dict[str, Any]:
    keys = ("status", "i_set_a", "v_set_pu", "z_set_ohm", "detected", "false_trips")
    return {key: row[key] for key in keys}


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
