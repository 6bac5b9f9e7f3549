"""What every verb that draws scenarios does alike: read, announce, validate, keep time."""

from __future__ import annotations

import argparse
import functools
import math
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ... import __version__
from ...model.errors import InputError, OpenPhaseError
from ...model.parts import Feeder
from ...model.reading.toml_file import read_text
from ...model.reading.toml_lines import locator
from ...optimise.certificate import needed_trials, share_of_alpha
from ..loading import load_with_points
from ..spec.study_file import Study, check_study, default_study, own_study_file, read_study
from .blocks import run_blocks
from .cases import Case
from .certify import Rival, Validation, add_up, judged_pairs
from .choose import more_blocks, planned_blocks
from .classes import Purpose
from .draw import BlockId
from .engine import BLOCK
from .ledger import Attempt
from .store import RunFolder
from .tally import Tested, judge_block, train_block

__all__ = [
    "LONG_RUN_S",
    "Demand",
    "Watch",
    "announce",
    "answer_head",
    "default_scenarios",
    "exit_code",
    "read_feeder",
    "read_own_study",
    "run_until_enough",
    "say",
    "validate",
]

LONG_RUN_S = 600  #: longer runs ask for --yes


@dataclass(frozen=True, slots=True, kw_only=True)
class Demand:
    """What is asked of a run, beside feeder and study."""

    seed: int = 1
    scenarios: int | None = None
    jobs: int = 2
    yes: bool = False

    @classmethod
    def of(cls, args: argparse.Namespace) -> Demand:
        """What the command line says."""
        seed = 1 if args.seed is None else args.seed
        return cls(seed=seed, scenarios=args.scenarios, jobs=args.jobs, yes=args.yes)


class Watch:
    """Laps of a run, in seconds."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._begun = time.perf_counter()

    def lap(self, name: str) -> None:
        """Note the time since the last lap."""
        now = time.perf_counter()
        self.laps[name], self._begun = round(now - self._begun, 3), now


def say(text: str) -> None:
    """A message to the user; stdout carries the answer only."""
    print(text, file=sys.stderr, flush=True)


# ---- inputs ----


def read_feeder(name: str) -> Feeder:
    """The feeder, with default points where it has none; InputError where there is no section."""
    feeder, said = load_with_points(name)
    for text in said:
        say(f"{feeder.name}: {text}")
    if not feeder.sections:
        raise InputError.single(feeder.name, "sections", "none", "must name at least one section")
    return feeder


def read_own_study(args: argparse.Namespace, feeder: Feeder) -> Study:
    """The study that was named, else the feeder's own; checked against the feeder."""
    file = args.study or own_study_file(args.feeder)
    if file:
        study = read_study(file)
        check_study(study, feeder, str(file), locator(read_text(file)))
        if not args.study:
            say(f"study: {file}, which stands beside the feeder file")
    else:
        study = default_study(args.feeder)
        check_study(study, feeder, "the default study")
    return study


def default_scenarios(cases: Sequence[Case], attempt: int) -> int:
    """What the target needs at zero false trips."""
    demand = cases[0].study.certificate
    alpha = share_of_alpha(demand.confidence, attempt, judged_pairs(cases))
    return needed_trials(demand.target, alpha)


# ---- before the run ----


def announce(
    cases: Sequence[Case],
    folder: RunFolder,
    manifest: dict[str, object],
    attempt: Attempt,
    demand: Demand,
    purposes: Sequence[Purpose],
) -> None:
    """Say how much there is to do and how long it takes; ask for --yes where that is long."""
    terminals = len(cases[0].points.terminals)
    groups = f" in {len(cases)} setting groups" if len(cases) > 1 else ""
    say(
        f"{cases[0].feeder.name}: {terminals} terminals{groups}, {judged_pairs(cases)} to judge; "
        f"{attempt.scenarios:,} scenarios per class and side at least, attempt {attempt.number}"
    )
    found = folder.finds(manifest)
    there = folder.count_blocks() if found == "this run" else 0
    blocks = [which for case in cases for which in planned_blocks(case, purposes[0], attempt)]
    if found == "another run":
        say(f"{folder.path}: inputs have changed since the last run; starting afresh")
    elif there:
        say(f"{folder.path}: resuming, {there} blocks are there")
    left = max(len(purposes) * len(blocks) - there, 0)
    if not left:
        return
    say("compiling the solver, at first use …")
    train_block(cases[0], blocks[0], 10)
    begun = time.perf_counter()
    train_block(cases[0], blocks[0], BLOCK)
    seconds = (time.perf_counter() - begun) * left / demand.jobs
    say(f"{left * BLOCK:,} scenarios to draw, about {_span(seconds)} on {demand.jobs} processes")
    if seconds > LONG_RUN_S and not demand.yes:
        raise OpenPhaseError(
            f"this takes about {_span(seconds)}: add --yes to start it, or --scenarios for fewer"
        )


def _span(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{math.ceil(seconds / 60)} min"


# ---- the run ----


class Counted(Protocol):
    """What blocks add up to."""

    @property
    def trials(self) -> NDArray[np.int64]:
        """(R, T) per reported class."""


C = TypeVar("C", bound=Counted)


def run_until_enough(
    case: Case, purpose: Purpose, attempt: Attempt, run: Callable[[list[BlockId]], C]
) -> C:
    """Run the planned blocks, and more until every judged class has its trials.

    ``run`` adds blocks up; those that are stored cost it little.
    """
    blocks = planned_blocks(case, purpose, attempt)
    found = run(blocks)
    while extra := more_blocks(case, blocks, found.trials, attempt):
        blocks += extra
        found = run(blocks)
    return found


def validate(
    cases: Sequence[Case],
    rivals: Sequence[Sequence[Sequence[Rival]]],
    attempt: Attempt,
    folder: RunFolder,
    jobs: int,
) -> tuple[Validation, ...]:
    """Judge settings on the untouched sample of every group.

    ``rivals`` are those that are judged side by side, by group and terminal.
    """
    return tuple(
        _validate(case, group, attempt, folder, jobs)
        for case, group in zip(cases, rivals, strict=True)
    )


def _validate(
    case: Case,
    rivals: Sequence[Sequence[Rival]],
    attempt: Attempt,
    folder: RunFolder,
    jobs: int,
) -> Validation:
    settings = tuple(tuple(rival.settings for rival in own) for own in rivals)
    compute = functools.partial(judge_block, case, settings=settings)

    def run(wanted: list[BlockId]) -> Validation:
        title = f"validation, {case.group.name}"
        return add_up(run_blocks(compute, Tested, wanted, folder, jobs, title), BLOCK)

    return run_until_enough(case, Purpose.VALIDATE, attempt, run)


# ---- after it ----


def answer_head(cases: Sequence[Case], attempt: Attempt) -> dict[str, Any]:
    """What every answer begins with."""
    return {
        "version": __version__,
        "seed": attempt.seed,
        "feeder": cases[0].feeder.name,
        "study_hash": attempt.study,
        "confidence": cases[0].study.certificate.confidence,
        "attempt": attempt.number,
        "scenarios": attempt.scenarios,
    }


def exit_code(result: dict[str, Any]) -> int:
    """0, or 3 where a section is left without a usable terminal or any is not certified."""
    rows = result["sections"]
    if any(row["status"] == "not_certified" for row in rows):
        return 3

    def sections(own: Iterable[dict[str, Any]]) -> set[tuple[str, frozenset[str]]]:
        return {(row["setting_group"], frozenset((row["local"], row["remote"]))) for row in own}

    # a setting that finds nothing serves nobody
    usable = [row for row in rows if row["status"] in ("set", "weak") and row["detected"]]
    return 0 if sections(usable) == sections(rows) else 3
