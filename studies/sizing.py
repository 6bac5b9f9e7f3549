"""``openphase size``: settings for every section of a feeder, with what they are worth."""

from __future__ import annotations

import argparse
import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..model.parts import Feeder
from ..optimise.thresholds import Refusal
from .run.blocks import run_blocks
from .run.cases import Case, make_cases
from .run.certify import Given, Rival, Validation, certified, sheets_of
from .run.choose import Chosen, Training, as_settings, choices, gather, reference_settings
from .run.classes import Purpose
from .run.digests import digest, feeder_digest, manifest, settings_digest
from .run.draw import BlockId
from .run.ledger import LEDGER, Attempt, find_attempt, reserve, sheets_before
from .run.session import (
    Demand,
    Watch,
    announce,
    answer_head,
    default_scenarios,
    exit_code,
    read_feeder,
    read_own_study,
    run_until_enough,
    validate,
)
from .run.status import nearest_false_trip, refusal_in_brief, refusal_text
from .run.store import RunFolder, as_json, npz, pack
from .run.tally import Trained, train_block
from .show.report import write_report
from .show.sheet import settings_csv, sheet_table
from .spec.study_file import Study, dump_study, resolved

__all__ = ["Sizing", "size_command", "size_feeder"]

BEST_AT_REFERENCE = "best at reference V_set"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sizing:
    """A finished sizing, per group: the result as it is printed, and what the report draws."""

    result: dict[str, Any]
    cases: tuple[Case, ...]
    trainings: tuple[Training, ...]
    validations: tuple[Validation, ...]


def size_command(args: argparse.Namespace) -> int:
    """Run the verb; returns the exit code."""
    feeder = read_feeder(args.feeder)
    study = read_own_study(args, feeder)
    out = args.out or Path("runs") / feeder.name
    sizing = size_feeder(feeder, study, Demand.of(args), out)
    if args.json:
        print(as_json(sizing.result), end="")
    else:
        print(sheet_table(sizing.result))
        print(f"\nResults: {out} (report.html, settings.csv, result.json)")
    return exit_code(sizing.result)


def size_feeder(feeder: Feeder, study: Study, demand: Demand, out: Path) -> Sizing:
    """Train, choose, validate once, and write the run folder ``out``.

    Raises
    ------
    InputError
        If feeder and study do not go together.
    OpenPhaseError
        If the folder cannot be used, or the run is long and ``demand.yes`` is not set.
    """
    cases = make_cases(feeder, study)
    folder, attempt = _begin(cases, demand, out)
    watch = Watch()
    trainings = tuple(_train(case, attempt, folder, demand.jobs) for case in cases)
    watch.lap("train_s")
    chosen = choices(cases, trainings)
    watch.lap("choose_s")
    rivals = [
        [_rivals(case, own) for own in group] for case, group in zip(cases, chosen, strict=True)
    ]
    # no other sheet is certified by these draws, but a fresh one
    sheet = settings_digest([[own[0].settings for own in group] for group in rivals])
    sheets_before(out.resolve().parent / LEDGER, attempt, sheet)
    given = [[_given(study, t, own, attempt) for t, own in enumerate(group)] for group in chosen]
    validations = validate(cases, rivals, attempt, folder, demand.jobs)
    watch.lap("validate_s")
    sheets = sheets_of(cases, validations, attempt.number, chosen=True)
    answer = answer_head(cases, attempt) | certified(
        sheets, given, rivals, np.sum([own.flags for own in trainings], axis=0)
    )
    sizing = Sizing(result=answer, cases=cases, trainings=trainings, validations=validations)
    folder.write("result.json", as_json(answer))
    folder.write("settings.csv", settings_csv(answer))
    folder.write("counts.npz", _counts(cases, trainings))
    fronts = tuple(own.front for own in trainings)
    write_report(answer, cases, fronts, validations, folder)
    watch.lap("report_s")
    folder.write("timing.json", as_json(watch.laps))
    return sizing


def _begin(cases: Sequence[Case], demand: Demand, out: Path) -> tuple[RunFolder, Attempt]:
    """Announce the run, take its attempt, and make the folder its own."""
    feeder, study = cases[0].feeder, cases[0].study
    book = out.resolve().parent / LEDGER
    entry = (
        feeder_digest(feeder),
        digest(dump_study(study)),
        demand.seed,
        demand.scenarios or functools.partial(default_scenarios, cases),
    )
    folder = RunFolder(out)
    command = ("size", feeder.name, "--study", "study.toml")
    likely = find_attempt(book, *entry)
    purposes = (Purpose.TRAIN, Purpose.VALIDATE)
    announce(cases, folder, manifest(command, feeder, study, likely), likely, demand, purposes)
    attempt = reserve(book, *entry)
    folder.begin(manifest(command, feeder, study, attempt))
    folder.write("study.toml", dump_study(resolved(study, feeder)))
    folder.log(
        f"size {feeder.name}, seed {attempt.seed}, attempt {attempt.number}, n {attempt.scenarios}"
    )
    return folder, attempt


def _train(case: Case, attempt: Attempt, folder: RunFolder, jobs: int) -> Training:
    compute = functools.partial(train_block, case)

    def run(wanted: list[BlockId]) -> Training:
        title = f"training, {case.group.name}"
        return gather(own for _, own in run_blocks(compute, Trained, wanted, folder, jobs, title))

    return run_until_enough(case, Purpose.TRAIN, attempt, run)


def _counts(cases: Sequence[Case], trainings: Sequence[Training]) -> bytes:
    """What training knows of every representable setting, per row of the sheet."""
    arrays = pack(cases[0].grid, "grid")
    for n, (case, training) in enumerate(zip(cases, trainings, strict=True)):
        for t in case.judged.nonzero()[0]:
            row = n * len(case.judged) + int(t)
            arrays |= pack(training.opens[t], f"{row}.opens")
            arrays |= pack(training.false[t], f"{row}.false")
    return npz(arrays)


# ---- the rows of the result ----


def _rivals(case: Case, chosen: Chosen | None) -> tuple[Rival, ...]:
    """The settings of a terminal that are judged side by side, the chosen one first."""
    study = case.study
    if chosen is None:
        names = ("chosen", BEST_AT_REFERENCE, "reference")
        return tuple(Rival(name=name, settings=None) for name in names)
    wanted = f"V_set {study.reference.v_set_pct:.10g} %"
    return (
        Rival(
            name="chosen",
            settings=as_settings(study, chosen.best),
            missing=refusal_in_brief(study, chosen.best),
        ),
        Rival(
            name=BEST_AT_REFERENCE,
            settings=as_settings(study, chosen.at_reference_v),
            missing=f"the device has no {wanted.replace('V_set', 'V_set of')}"
            if chosen.at_reference_v is None
            else refusal_in_brief(study, chosen.at_reference_v, f" with {wanted}"),
        ),
        Rival(name="reference", settings=reference_settings(study)),
    )


def _given(study: Study, t: int, chosen: Chosen | None, attempt: Attempt) -> Given:
    """The chosen setting with what training says of it, or why there is none."""
    if chosen is None:
        return Given(settings=None)
    best = chosen.best
    if isinstance(best, Refusal):
        return Given(settings=None, missing=refusal_text(chosen.groups, t, best, chosen.front))
    return Given(
        settings=as_settings(study, best),
        margin=best.margin,
        nearest=nearest_false_trip(best, chosen.front, attempt.number),
    )
