"""``openphase assess``: what existing settings are worth, on the draws that ``size`` uses.

Nothing is chosen and nothing is trained, so no attempt of its own is spent: it is that of the
same feeder, study, seed and size, so that `compare` can pair the two runs scenario by scenario.
It is taken down all the same. Who changes the study after looking gets fresh draws; and of
several sheets that were judged on the same draws only the first can be certified by them.
"""

from __future__ import annotations

import argparse
import functools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..detector.criteria import Settings
from ..model.errors import Fault, InputError, OpenPhaseError
from ..model.parts import Feeder
from .run.cases import Case, make_cases
from .run.certify import Given, Rival, Validation, certified, sheets_of
from .run.choose import reference_settings
from .run.classes import Purpose
from .run.digests import (
    digest,
    feeder_digest,
    manifest,
    population_digest,
    settings_digest,
)
from .run.ledger import LEDGER, Attempt, find_attempt, reserve, sheets_before
from .run.options import options_text
from .run.session import (
    Demand,
    Watch,
    announce,
    answer_head,
    default_scenarios,
    exit_code,
    read_feeder,
    read_own_study,
    validate,
)
from .run.status import loop_note
from .run.store import RunFolder, as_json
from .settings_file import SettingsSheet, read_sheet
from .show.report import write_report
from .show.sheet import settings_csv, sheet_table
from .spec.study_file import Study, dump_study, resolved

__all__ = ["REFERENCE", "Assessment", "assess_command", "assess_feeder"]

REFERENCE = "reference"  #: in place of a sheet: the study's reference at every terminal

SAME_EVIDENCE = (
    "the sheet is that of the run beside it, which was judged on these very draws: this is the "
    "same evidence once more, and not further evidence"
)
CHOSEN_ON_THESE = (
    "the sheet was changed after the run beside it had been judged on these very draws: where that "
    "run's results guided the change, the settings were chosen on this sample and its bounds do "
    "not hold; another --seed draws a fresh one"
)

AFTER_OTHERS = (
    "these very draws have judged {others} other sheet(s) before: where their results guided this "
    "one, it was chosen on this sample and its bounds do not hold; another --seed draws a fresh one"
)

LEFT_OUT = "the sheet leaves this terminal without a setting"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Assessment:
    """A finished assessment, per group: the result as it is printed, and what the report draws."""

    result: dict[str, Any]
    cases: tuple[Case, ...]
    validations: tuple[Validation, ...]


def assess_command(args: argparse.Namespace) -> int:
    """Run the verb; returns the exit code."""
    feeder = read_feeder(args.feeder)
    study, sheet = _read_both(args, feeder)
    name = REFERENCE if sheet is None else Path(sheet.source).stem
    out = args.out or Path("runs") / f"{feeder.name}-{name}"
    if sheet is not None and out.resolve() == Path(sheet.source).resolve().parent:
        where, wanted = "--out", "must not be the folder that the sheet is in"
        raise InputError.single("", where, str(out), wanted)
    assessment = assess_feeder(feeder, study, sheet, Demand.of(args), out)
    if args.json:
        print(as_json(assessment.result), end="")
    else:
        print(sheet_table(assessment.result))
        print(f"\nResults: {out} (report.html, settings.csv, result.json)")
    return exit_code(assessment.result)


def _read_both(args: argparse.Namespace, feeder: Feeder) -> tuple[Study, SettingsSheet | None]:
    """Study and sheet; the faults of both at once."""
    faults: list[Fault] = []
    study: Study | None = None
    sheet: SettingsSheet | None = None
    try:
        study = read_own_study(args, feeder)
    except InputError as error:
        faults += error.faults
    if args.settings != REFERENCE:
        options = (study or Study()).detector.options()
        try:
            sheet = read_sheet(Path(args.settings), feeder, options)
        except InputError as error:
            faults += error.faults
    if faults or study is None:
        raise InputError(faults)
    return study, sheet


def assess_feeder(
    feeder: Feeder, study: Study, sheet: SettingsSheet | None, demand: Demand, out: Path
) -> Assessment:
    """Judge a sheet, None for the study's reference everywhere, and write the run folder ``out``.

    Raises
    ------
    InputError
        If feeder, study and sheet do not go together.
    OpenPhaseError
        If the folder cannot be used, or the run is long and ``demand.yes`` is not set.
    """
    cases = make_cases(feeder, study)
    given = _settings(cases, sheet)
    folder, attempt = _begin(cases, given, demand, out)
    watch = Watch()
    beside = sheet is not None
    rivals = [[_rivals(study, own, beside) for own in group] for group in given]
    validations = validate(cases, rivals, attempt, folder, demand.jobs)
    watch.lap("validate_s")
    rows = [
        [_given(case, t, own) for t, own in enumerate(group)]
        for case, group in zip(cases, given, strict=True)
    ]
    sheets = sheets_of(cases, validations, attempt.number, chosen=False)
    drawn = (population_digest(feeder, study), attempt.seed, attempt.number)
    assessed = _assessed(sheet, given, attempt, drawn, out.resolve().parent / LEDGER)
    answer = answer_head(cases, attempt) | {"assessed": assessed} | certified(sheets, rows, rivals)
    if assessed["sheets_before"] or assessed["note"] == CHOSEN_ON_THESE:
        _demote(answer["sections"], assessed["note"])
    folder.write("result.json", as_json(answer))
    folder.write("settings.csv", settings_csv(answer))
    write_report(answer, cases, None, validations, folder)
    watch.lap("report_s")
    folder.write("timing.json", as_json(watch.laps))
    return Assessment(result=answer, cases=cases, validations=validations)


def _settings(
    cases: Sequence[Case], sheet: SettingsSheet | None
) -> tuple[tuple[Settings | None, ...], ...]:
    """Per group and terminal what the sheet says, or the study's reference everywhere."""
    if sheet is None:
        reference = reference_settings(cases[0].study)
        return tuple(tuple(reference for _ in case.points.terminals) for case in cases)
    groups = sheet.for_groups([case.group.name for case in cases])
    return tuple(
        tuple(own.get((terminal.local, terminal.remote)) for terminal in case.points.terminals)
        for case, own in zip(cases, groups, strict=True)
    )


def _begin(
    cases: Sequence[Case],
    given: tuple[tuple[Settings | None, ...], ...],
    demand: Demand,
    out: Path,
) -> tuple[RunFolder, Attempt]:
    """Announce the run, take its attempt down, and make the folder its own."""
    feeder, study = cases[0].feeder, cases[0].study
    book = out.resolve().parent / LEDGER
    entry = (
        feeder_digest(feeder),
        digest(dump_study(study)),
        demand.seed,
        demand.scenarios or functools.partial(default_scenarios, cases),
    )
    attempt = find_attempt(book, *entry)
    folder = RunFolder(out)
    command = ("assess", feeder.name, "--settings", "settings.csv", "--study", "study.toml")
    made_from = manifest(command, feeder, study, attempt)
    made_from["settings_sha256"] = settings_digest(given)
    announce(cases, folder, made_from, attempt, demand, (Purpose.VALIDATE,))
    if reserve(book, *entry) != attempt:
        raise OpenPhaseError(f"{book}: another run took the attempt meanwhile; start again")
    folder.begin(made_from)
    folder.write("study.toml", dump_study(resolved(study, feeder)))
    folder.log(
        f"assess {feeder.name}, seed {attempt.seed}, attempt {attempt.number}, "
        f"n {attempt.scenarios}"
    )
    return folder, attempt


def _rivals(study: Study, own: Settings | None, beside: bool) -> tuple[Rival, ...]:
    """The sheet's setting, and the reference ``beside`` it unless that is what is assessed."""
    assessed = Rival(name="assessed", settings=own, missing=LEFT_OUT)
    reference = Rival(name="reference", settings=reference_settings(study))
    return (assessed, reference) if beside else (assessed,)


def _given(case: Case, t: int, own: Settings | None) -> Given:
    if own is None:
        return Given(settings=None, missing=LEFT_OUT)
    return Given(settings=own, note=loop_note(case, t, own.z_set_ohm))


# ---- where the sheet comes from ----


def _assessed(
    sheet: SettingsSheet | None,
    given: tuple[tuple[Settings | None, ...], ...],
    attempt: Attempt,
    drawn: tuple[str, int, int],
    book: Path,
) -> dict[str, Any]:
    """What was assessed, and whether these very draws had a part in choosing it.

    ``drawn`` is what tells the draws from others: population, seed and attempt.
    """
    sha = settings_digest(given)
    origin = None if sheet is None else _origin(Path(sheet.source).parent, sheet, drawn)
    sized = origin is not None and origin["same_draws"] and not origin["edited"]
    others = 0
    if sheet is not None and not (sized and origin and origin["verb"] == "size"):
        others = sheets_before(book, attempt, sha)
    note = None
    if origin is not None and origin["same_draws"]:
        note = SAME_EVIDENCE if sized else CHOSEN_ON_THESE
    if others:
        note = AFTER_OTHERS.format(others=others)
    return {
        "settings": REFERENCE if sheet is None else Path(sheet.source).name,
        "settings_sha256": sha,
        "sheets_before": others,
        "run_beside": origin,
        "note": note,
    }


def _demote(rows: list[dict[str, Any]], note: str) -> None:
    """Settings that may have been chosen on these draws are certified by nothing."""
    for row in rows:
        if row["status"] in ("set", "weak"):
            row["status"], row["reason"] = "not_certified", f"{note}; {row['reason']}"


def _origin(
    folder: Path, sheet: SettingsSheet, drawn: tuple[str, int, int]
) -> dict[str, Any] | None:
    """The run in whose folder the sheet lies; None where there is none."""
    try:
        made_from = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
        result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        there = tuple(made_from[key] for key in ("population_sha256", "seed", "attempt"))
        return {
            "verb": str(made_from["command"][0]),
            "seed": made_from["seed"],
            "attempt": made_from["attempt"],
            "same_draws": there == drawn,
            "edited": _sheet_values(sheet, result) != _result_values(result),
        }
    except (OSError, ValueError, KeyError, TypeError, IndexError, AttributeError):
        return None  # no run of this package


Values = dict[tuple[str, str, str], tuple[object, ...] | None]


def _sheet_values(sheet: SettingsSheet, result: dict[str, Any]) -> Values:
    """What the sheet says; one without groups speaks of the result's only one."""
    names = {row["setting_group"] for row in result["sections"]}
    only = names.pop() if len(names) == 1 else ""
    return {
        (group or only, *pair): None
        if own is None
        else (
            *(own.i_set_a, own.v_set_pu, own.z_set_ohm),
            *(own.options.negative_sign, options_text(own.options)),
        )
        for group, rows in sheet.groups.items()
        for pair, own in rows.items()
    }


def _result_values(result: dict[str, Any]) -> Values:
    keys = ("i_set_a", "v_set_pu", "z_set_ohm", "negative_sign", "options")
    return {
        (row["setting_group"], row["local"], row["remote"]): None
        if row["i_set_a"] is None
        else tuple(row[key] for key in keys)
        for row in result["sections"]
    }
