"""``openphase import``: an OpenDSS file becomes a feeder file, with a fidelity report."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..model.errors import Gathered, InputError
from ..model.importers.dss_feeder import Imported, import_opendss
from ..model.importers.fidelity import Difference, differences
from ..model.importers.report import fidelity_report
from ..model.importers.report_text import report_markdown, report_text
from ..model.leaps import why_solved, with_leaps
from ..model.network import compile_network
from ..model.parts import Feeder
from ..model.points import find_points, point_probes
from ..model.reading.feeder_file import write_feeder
from ..model.reduction.fold import fold
from ..model.reduction.measure import LEVEL_RANGE, measure
from ..model.reduction.report import folded_json, folded_text
from ..model.spread import spread_points
from .own.connections import OwnConnections, read_connections, with_transformers
from .own.levels import measured_study_text
from .own.match import Match, match_json, match_text
from .own.peaks import with_peaks
from .own.readings import Readings, read_readings
from .own.reclosers import OwnPoints, read_points, with_points
from .run.session import say
from .run.store import as_json
from .show.sheet import PAGE, wrapped

__all__ = ["import_command"]

_T = TypeVar("_T")

_SEED = 1
"""Of the scenarios on which a reduction is measured."""

WORTH_A_WARNING_PU = 1e-3
"""A difference to OpenDSS's own voltages that is more than what either approximates."""


@dataclass(slots=True, kw_only=True)
class _Work:
    """The feeder on its way, and what is to be said of it."""

    feeder: Feeder
    matches: list[Match] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    parts: dict[str, Any] = field(default_factory=dict)
    study: str | None = None
    levels: tuple[float, float] = LEVEL_RANGE  #: of the loads, as a study will draw them


@dataclass(frozen=True, slots=True, kw_only=True)
class _Own:
    """The user's own tables, as far as they are given."""

    transformers: OwnConnections | None
    points: OwnPoints | None
    peaks: Readings | None


def import_command(args: argparse.Namespace) -> int:
    """Run the verb; returns the exit code. Refusals have ended it before."""
    _check_outputs(args)
    say(f"reading {args.file}")
    told = Gathered()
    own = told.of(lambda: _read_own(args))
    imported = told.of(
        lambda: import_opendss(args.file, drop=args.drop, solve_controls=args.solve_controls)
    )
    told.raise_if_any()
    assert own is not None
    assert imported is not None
    say(f"{len(imported.feeder.lines)} lines, {len(imported.feeder.loads)} loads; solving")
    found = differences(imported)
    report = fidelity_report(imported, found)
    work = _Work(feeder=imported.feeder)
    _own_data(work, own, writes=args.output is not None)
    if args.reduce:
        _fold(work)
    _count_buses(work)
    report |= {"own_data": [match_json(match) for match in work.matches], **work.parts}
    text = [*report_text(report), *work.lines]
    written = _write(work, args, imported)
    report["written"] = [str(path) for path in written]
    if args.report is not None:
        _write_report(args.report, report, work.lines)
        written.append(args.report)
    for path in written:
        say(f"wrote {path}")
    _warn(found)
    print(as_json(report) if args.json else _page(text), end="")
    return 0


def _warn(found: Sequence[Difference]) -> None:
    """Say what the table of differences shows only to those who read it."""
    for row in found:
        if row.largest_pu > WORTH_A_WARNING_PU:
            say(
                f"warning: {row.mode}: {row.largest_pu:.1e} pu from OpenDSS's own voltages at "
                f"{row.bus} {row.phase}: find out why before you rely on this feeder"
            )


def _check_outputs(args: argparse.Namespace) -> None:
    """Ask for somewhere to put the feeder before anything is worked out.

    Raises
    ------
    InputError
        Where nothing would be left, or an output would replace an input.
    """
    if args.output is None and args.report is None:
        rule = "must be given: the feeder file to write (or --report FILE for the report alone)"
        raise InputError.single("", "-o", None, rule)
    if args.output is not None and args.output.suffix.lower() != ".toml":
        raise InputError.single("", "-o", repr(str(args.output)), "must be a .toml file")
    if args.report is not None and args.report.suffix.lower() not in (".md", ".json"):
        raise InputError.single("", "--report", repr(str(args.report)), "must be .md or .json")


def _read_own(args: argparse.Namespace) -> _Own:
    """Read the user's own tables.

    Raises
    ------
    InputError
        With all faults of all of them.
    """
    told = Gathered()

    def read(path: Path | None, reader: Callable[[Path], _T]) -> _T | None:
        return None if path is None else told.of(partial(reader, path))

    own = _Own(
        transformers=read(args.transformers, read_connections),
        points=read(args.points, read_points),
        peaks=read(args.peaks, read_readings),
    )
    told.raise_if_any()
    return own


def _own_data(work: _Work, own: _Own, *, writes: bool) -> None:
    """Bring in what the user knows of the feeder, and points where there are none."""
    if own.transformers is not None:
        work.feeder, match = with_transformers(work.feeder, own.transformers)
        work.matches.append(match)
    if own.points is not None:
        work.feeder, match = with_points(work.feeder, own.points)
        work.matches.append(match)
    else:
        spread = spread_points(work.feeder)
        work.feeder = spread.feeder
        work.lines += ["", *spread.said]
        work.parts["points"] = {"said": list(spread.said), "inside": list(spread.inside)}
    if own.peaks is not None:
        work.feeder, measured, match = with_peaks(work.feeder, own.peaks)
        work.matches.append(match)
        ends = [item.level.support for item in measured]
        work.levels = (
            min(low for low, _ in [*ends, work.levels]),
            max(high for _, high in [*ends, work.levels]),
        )
        if measured and writes:
            work.study = measured_study_text(measured, own.peaks.source)
    for match in work.matches:
        work.lines += ["", *match_text(match)]


def _fold(work: _Work) -> None:
    """Fold laterals and low voltage, and measure what that changes."""
    say("folding, and measuring what it changes")
    folded = fold(work.feeder)
    measured = measure(work.feeder, folded, rng=np.random.default_rng(_SEED), levels=work.levels)
    work.feeder = folded.feeder
    work.lines += ["", *folded_text(folded, measured)]
    work.parts["reduction"] = folded_json(folded, measured)


def _count_buses(work: _Work) -> None:
    """Say how many buses the solver passes by, and why not the others."""
    network = compile_network(work.feeder)
    probes = point_probes(find_points(work.feeder, network))
    why = why_solved(with_leaps(network, probes), probes)
    kept, count = sum(why.values()), len(network.nodes)
    work.lines += [
        "",
        f"{kept} of {count} buses are solved in every scenario: {why['loads']} with loads or "
        f"machines, {why['points']} that points look at, {why['forks']} forks, {why['others']} at "
        f"the source, regulators, ungrounded windings or in loops; the other {count - kept} are "
        "passed by, exactly, until an event happens there",
    ]
    work.parts["merged"] = {"buses": count, "kept": kept, "why": why}


def _write(work: _Work, args: argparse.Namespace, imported: Imported) -> list[Path]:
    """Write the feeder file, and its study where loads were measured."""
    if args.output is None:
        return []
    folded = ", laterals and low voltage folded" if args.reduce else ""
    dropped = f", without {', '.join(imported.dropped)}" if imported.dropped else ""
    settled = ", taps where its controls settle" if args.solve_controls else ""
    changed = f"{dropped}{settled}{folded}"
    comment = f"Imported from {args.file.name} (OpenDSS){changed}."
    feeder = replace(work.feeder, imported_from=f"{args.file.name}{changed}")
    written = list(write_feeder(feeder, args.output, comment=comment))
    study = args.output.with_suffix(".study.toml")
    if work.study is not None:
        study.write_text(work.study, encoding="utf-8")
        written.append(study)
    elif study.exists():
        say(f"{study} is older and still goes with this feeder: remove it if it should not")
    return written


def _write_report(path: Path, report: dict[str, Any], lines: Sequence[str]) -> None:
    """Write the report as its suffix says."""
    if path.suffix.lower() == ".json":
        path.write_text(as_json(report), encoding="utf-8")
        return
    more = "\n".join(line if line else "" for line in lines)
    path.write_text(
        report_markdown(report) + (f"\n## Beside it\n{more}\n" if more else ""), encoding="utf-8"
    )


def _page(lines: Sequence[str]) -> str:
    """Return the lines on a page that is as wide as all of them."""
    wide = [part for line in lines for part in (wrapped(line) if len(line) > PAGE else [line])]
    return "\n".join(wide) + "\n"
