"""``openphase size``: settings for every section of a feeder, with what they are worth."""

from __future__ import annotations

import argparse
import functools
import hashlib
import math
import platform
import sys
import time
from dataclasses import dataclass, replace
from importlib import metadata, resources
from pathlib import Path
from typing import Any

from .. import __version__
from ..detector.criteria import Settings
from ..model.errors import InputError, OpenPhaseError
from ..model.feeder_file import dump_feeder, load_feeder
from ..model.parts import Feeder
from ..model.toml_file import read_text
from ..model.toml_lines import locator
from ..optimise.certificate import needed_trials, share_of_alpha
from ..optimise.thresholds import Choice
from .run.blocks import run_blocks
from .run.certify import NOT_BUILT, Validation, add_up, compared_rows, judged, section_row
from .run.choose import Training, as_settings, choices, gather, more_blocks, planned_blocks
from .run.classes import Purpose
from .run.draw import BlockId, Case, make_case
from .run.engine import BLOCK
from .run.ledger import Attempt, find_attempt, reserve
from .run.spec import (
    Study,
    check_study,
    default_study,
    dump_population,
    dump_study,
    read_study,
)
from .run.store import RunFolder, as_json, npz, pack
from .run.tally import Tested, Trained, device_grid, judge_block, train_block
from .show.report import write_report
from .show.sheet import settings_csv, sheet_table

__all__ = ["Demand", "Sizing", "size_command", "size_feeder"]

LONG_RUN_S = 600  #: longer runs ask for --yes


@dataclass(frozen=True, slots=True, kw_only=True)
class Demand:
    """What is asked of a sizing run, beside feeder and study."""

    seed: int = 1
    scenarios: int | None = None
    jobs: int = 2
    yes: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sizing:
    """A finished sizing: the result as it is printed, and what the report draws."""

    result: dict[str, Any]
    case: Case
    training: Training
    validation: Validation


def say(text: str) -> None:
    """A message to the user; stdout carries the answer only."""
    print(text, file=sys.stderr, flush=True)


def size_command(args: argparse.Namespace) -> int:
    """Run the verb; returns the exit code."""
    feeder = load_feeder(args.feeder)
    if args.study:
        study = read_study(args.study)
        check_study(study, feeder, str(args.study), locator(read_text(args.study)))
    else:
        study = default_study(args.feeder)
        check_study(study, feeder, "the default study")
    if not feeder.sections:
        raise InputError.single(feeder.name, "sections", "none", "must name at least one section")
    out = args.out or Path("runs") / feeder.name
    demand = Demand(
        seed=1 if args.seed is None else args.seed,
        scenarios=args.scenarios,
        jobs=args.jobs,
        yes=args.yes,
    )
    sizing = size_feeder(feeder, study, demand, out)
    if args.json:
        print(as_json(sizing.result), end="")
    else:
        print(sheet_table(sizing.result))
        print(f"\nResults: {out} (report.html, settings.csv, result.json)")
    return exit_code(sizing.result)


def exit_code(result: dict[str, Any]) -> int:
    """0, or 3 where a section is left without a usable terminal or any is not certified."""
    rows = result["sections"]
    if any(row["status"] == "not_certified" for row in rows):
        return 3
    usable = {
        frozenset((row["local"], row["remote"])) for row in rows if row["status"] in ("set", "weak")
    }
    return 0 if usable == {frozenset((row["local"], row["remote"])) for row in rows} else 3


def size_feeder(feeder: Feeder, study: Study, demand: Demand, out: Path) -> Sizing:
    """Train, choose, validate once, and write the run folder ``out``.

    Raises
    ------
    InputError
        If feeder and study do not go together.
    OpenPhaseError
        If the folder cannot be used, or the run is long and ``demand.yes`` is not set.
    """
    case = make_case(feeder, study)
    book = out.resolve().parent / "ledger.json"
    entry = (
        population_digest(feeder, study),
        digest(dump_study(study)),
        demand.seed,
        demand.scenarios or functools.partial(_default_scenarios, case),
    )
    folder = RunFolder(out)
    likely = find_attempt(book, *entry)
    _announce(case, folder, _manifest(feeder, study, likely), likely, demand)
    attempt = reserve(book, *entry)
    folder.begin(_manifest(feeder, study, attempt))
    folder.write("study.toml", dump_study(study))
    folder.log(
        f"size {feeder.name}, seed {attempt.seed}, attempt {attempt.number}, n {attempt.scenarios}"
    )
    watch = Watch()
    train = planned_blocks(case, Purpose.TRAIN, attempt)
    training = _train(case, train, folder, demand.jobs, attempt.scenarios)
    watch.lap("train_s")
    chosen = choices(case, device_grid(case), training)
    watch.lap("choose_s")
    test = planned_blocks(case, Purpose.VALIDATE, attempt)
    settings = _compared_settings(case, chosen)
    validation = _validate(case, test, settings, folder, demand.jobs, attempt.scenarios)
    watch.lap("validate_s")
    answer = {
        "version": __version__,
        "seed": demand.seed,
        "feeder": feeder.name,
        "study_hash": digest(dump_study(study)),
        "confidence": study.certificate.confidence,
        "attempt": attempt.number,
        "scenarios": attempt.scenarios,
        **_certified(case, chosen, settings, training, validation, attempt.number),
    }
    sizing = Sizing(result=answer, case=case, training=training, validation=validation)
    folder.write("result.json", as_json(answer))
    folder.write("settings.csv", settings_csv(answer))
    folder.write("counts.npz", _counts(case, training))
    write_report(sizing.result, case, training.front, validation, folder)
    watch.lap("report_s")
    folder.write("timing.json", as_json(watch.laps))
    return sizing


def _counts(case: Case, training: Training) -> bytes:
    """What training knows of every representable setting, as sparse histograms per terminal."""
    grid = device_grid(case)
    arrays = pack(grid, "grid")
    for t, terminal in enumerate(case.points.terminals):
        if not terminal.load_side:
            arrays |= pack(training.opens[t], f"{t}.opens") | pack(training.false[t], f"{t}.false")
    return npz(arrays)


class Watch:
    """Laps of a run, in seconds."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._begun = time.perf_counter()

    def lap(self, name: str) -> None:
        """Note the time since the last lap."""
        now = time.perf_counter()
        self.laps[name], self._begun = round(now - self._begun, 3), now


def _compared_settings(
    case: Case, chosen: list[tuple[Choice | None, ...]]
) -> tuple[tuple[Settings | None, ...], ...]:
    """Per terminal the settings that are judged side by side, in the order of ``COMPARED``."""
    reference = Settings(
        i_set_a=case.study.reference.i_set_a,
        v_set_pu=case.study.reference.v_set_pct / 100.0,
        z_set_ohm=case.study.reference.z_set_ohm,
        negative_sign=case.study.detector.negative_sign,
    )
    return tuple(
        (*(as_settings(case, choice) for choice in own), None if terminal.load_side else reference)
        for own, terminal in zip(chosen, case.points.terminals, strict=True)
    )


def _certified(
    case: Case,
    chosen: list[tuple[Choice | None, ...]],
    settings: tuple[tuple[Settings | None, ...], ...],
    training: Training,
    validation: Validation,
    attempt: int,
) -> dict[str, Any]:
    """The part of the answer that rests on the two samples."""
    terminals = range(len(chosen))
    return {
        "sections": [
            section_row(case, t, chosen[t][0], validation, training.front[t], attempt)
            for t in terminals
        ],
        "compared": [
            row
            for t in terminals
            if not case.points.terminals[t].load_side
            for row in compared_rows(case, t, settings[t], validation, attempt)
        ],
        "feeder_false_trips": {
            "per_year_upper": None,
            "assumptions": list(NOT_BUILT),
        },
        "numerics": dict(
            zip(("dead", "floating", "not_converged"), validation.flags.tolist(), strict=True)
        ),
    }


def _train(
    case: Case, blocks: list[BlockId], folder: RunFolder, jobs: int, scenarios: int
) -> Training:
    compute = functools.partial(train_block, case)
    run = functools.partial(
        run_blocks, compute, Trained, folder=folder, jobs=jobs, title="training"
    )
    training = gather(block for _, block in run(wanted=blocks))
    while extra := more_blocks(case, blocks, training.trials, scenarios):
        blocks += extra
        training = gather(block for _, block in run(wanted=blocks))
    return training


def _validate(
    case: Case,
    blocks: list[BlockId],
    settings: tuple[tuple[Settings | None, ...], ...],
    folder: RunFolder,
    jobs: int,
    scenarios: int,
) -> Validation:
    compute = functools.partial(judge_block, case, settings=settings)
    run = functools.partial(
        run_blocks, compute, Tested, folder=folder, jobs=jobs, title="validation"
    )
    validation = add_up(run(wanted=blocks), BLOCK)
    while extra := more_blocks(case, blocks, validation.trials, scenarios):
        blocks += extra
        validation = add_up(run(wanted=blocks), BLOCK)
    return validation


def _default_scenarios(case: Case, attempt: int) -> int:
    """What the target needs at zero false trips."""
    demand = case.study.certificate
    alpha = share_of_alpha(demand.confidence, attempt, judged(case.points.terminals))
    return needed_trials(demand.target, alpha)


def _announce(
    case: Case,
    folder: RunFolder,
    manifest: dict[str, object],
    attempt: Attempt,
    demand: Demand,
) -> None:
    """Say how much there is to do and how long it takes; ask for --yes where that is long."""
    say(
        f"{case.feeder.name}: {len(case.points.terminals)} terminals, "
        f"{judged(case.points.terminals)} to judge; {attempt.scenarios:,} scenarios per class "
        f"and side at least, attempt {attempt.number}"
    )
    found = folder.finds(manifest)
    there = folder.count_blocks() if found == "this run" else 0
    train = planned_blocks(case, Purpose.TRAIN, attempt)
    if found == "another run":
        say(f"{folder.path}: inputs have changed since the last run; starting afresh")
    elif there:
        say(f"{folder.path}: resuming, {there} blocks are there")
    left = max(2 * len(train) - there, 0)
    if not left:
        return
    say("compiling the solver, at first use …")
    train_block(case, train[0], 10)
    begun = time.perf_counter()
    train_block(case, train[0], BLOCK)
    seconds = (time.perf_counter() - begun) * left / demand.jobs
    say(f"{left * BLOCK:,} scenarios to draw, about {_span(seconds)} on {demand.jobs} processes")
    if seconds > LONG_RUN_S and not demand.yes:
        raise OpenPhaseError(
            f"this takes about {_span(seconds)}: add --yes to start it, or --scenarios for fewer"
        )


def _span(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{math.ceil(seconds / 60)} min"


def digest(*texts: str) -> str:
    """SHA-256 of texts."""
    return hashlib.sha256("\0".join(texts).encode("utf-8")).hexdigest()


def population_digest(feeder: Feeder, study: Study) -> str:
    """SHA-256 of what decides which scenarios there are, however it is written or called."""
    closed = study.network.closed
    if closed is None:
        closed = tuple(switch.name for switch in feeder.switches if switch.closed)
    state = replace(study.network, closed=tuple(sorted(closed)))
    return digest(
        dump_feeder(replace(feeder, name="any")), dump_population(replace(study, network=state))
    )


def code_digest() -> str:
    """SHA-256 of the package's sources: blocks of one code are never mixed with another's."""
    root = resources.files(__package__.partition(".")[0])
    with resources.as_file(root) as folder:
        rooms = ("model", "detector", "optimise", "studies")
        files = sorted(path for room in rooms for path in (folder / room).rglob("*.py"))
        return digest(*(path.read_text(encoding="utf-8") for path in files))


def _manifest(feeder: Feeder, study: Study, attempt: Attempt) -> dict[str, object]:
    """What the run was made from; resuming needs the same."""
    libraries = ("numpy", "scipy", "numba")
    return {
        "command": [
            *("size", feeder.name, "--study", "study.toml"),
            *("--seed", attempt.seed, "--scenarios", attempt.scenarios),
        ],
        "openphase": __version__,
        "code_sha256": code_digest(),
        "python": platform.python_version(),
        "libraries": {name: metadata.version(name) for name in libraries},
        "feeder_sha256": digest(dump_feeder(feeder)),
        "study_sha256": digest(dump_study(study)),
        "seed": attempt.seed,
        "scenarios": attempt.scenarios,
        "attempt": attempt.number,
        "block": BLOCK,
    }
