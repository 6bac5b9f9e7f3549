"""Study files: reading them, writing them, and the ones that ship with the package."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import TypeVar

from ... import model
from ...model.errors import Locator, Report
from ...model.neutrals import wires_at_unknown
from ...model.parts import Feeder
from ...model.reading.feeder_file import shipped_feeders
from ...model.reading.toml_file import parse_toml, read_text, toml_rows
from .checks import check_against_feeder
from .device import Device, Steps
from .event_fields import EVENT_TABLES
from .events import (
    Events,
    LoadStepDraw,
    OpenPhaseDraw,
    SourceStepDraw,
    SwitchingDraw,
    SwitchState,
)
from .fields import (
    FORMAT,
    TABLES,
    part_of,
)
from .parts import (
    UNKNOWN_CONNECTION,
    Ambient,
    CertificateDemand,
    Correlation,
    DerDraw,
    DetectorOptions,
    Group,
    Instruments,
    LoadDraw,
    MeasuredLoad,
    MotorDraw,
    NetworkState,
    ReferenceSettings,
    Study,
    TransformerDraw,
)
from .reading import study_of
from .values import as_table

__all__ = [
    "Ambient",
    "CertificateDemand",
    "Correlation",
    "DerDraw",
    "DetectorOptions",
    "Device",
    "Events",
    "Group",
    "Instruments",
    "LoadDraw",
    "LoadStepDraw",
    "MeasuredLoad",
    "MotorDraw",
    "NetworkState",
    "OpenPhaseDraw",
    "ReferenceSettings",
    "SourceStepDraw",
    "Steps",
    "Study",
    "SwitchState",
    "SwitchingDraw",
    "TransformerDraw",
    "check_study",
    "default_study",
    "dump_population",
    "dump_study",
    "own_study_file",
    "read_study",
    "resolved",
    "study_beside",
    "study_from_toml",
]

_DATA = resources.files(model) / "data"


def read_study(path: Path) -> Study:
    """Return the study that a file describes.

    Raises
    ------
    InputError
        If the file cannot be read, or with every fault of what it says.
    """
    return study_from_toml(read_text(path), str(path))


def study_from_toml(text: str, source_name: str) -> Study:
    """Return the study that a TOML text describes; ``source_name`` begins each message.

    Raises
    ------
    InputError
        With every fault of the text.

    Examples
    --------
    >>> study_from_toml("format = 1", "empty.toml") == Study()
    True
    """
    report = parse_toml(text, source_name)
    study = study_of(report)
    report.raise_if_any()
    return study


def default_study(feeder_name: str) -> Study:
    """Return the study that ships with a shipped feeder, or stands beside a feeder's file.

    Beside ``NAME.toml``, whatever its ending, that is ``NAME.study.toml``. Without either, all
    the defaults.

    Raises
    ------
    InputError
        With every fault of that study.

    Examples
    --------
    >>> default_study("paper").transformers.yg_d
    ('T4', 'T5', 'T6')
    >>> default_study("my feeder") == Study()
    True
    """
    beside = own_study_file(feeder_name)
    if beside is not None:
        return read_study(beside)
    file = _DATA / f"{feeder_name}.study.toml"
    if feeder_name not in shipped_feeders() or not file.is_file():
        return Study()
    return study_from_toml(file.read_text(encoding="utf-8"), file.name)


def own_study_file(feeder_name: str) -> Path | None:
    """Return the study file beside a feeder's file; None where there is none."""
    beside = study_beside(Path(feeder_name))
    return beside if feeder_name not in shipped_feeders() and beside.is_file() else None


def study_beside(feeder_file: Path) -> Path:
    """Return where the study of a feeder file stands, if it has one.

    Examples
    --------
    >>> study_beside(Path("east.toml")).name
    'east.study.toml'
    """
    return feeder_file.with_name(f"{feeder_file.stem}.study.toml")


def check_study(
    study: Study, feeder: Feeder, source_name: str, locate: Locator | None = None
) -> None:
    """Check a study by itself, and its names against the feeder.

    A study that was made in a program passes the same checks here as one that was read.

    Parameters
    ----------
    study, feeder
        The two that are to go together.
    source_name
        Begins each message: the study's file, or whatever else it came from.
    locate
        Gives the lines of the study's file, where there is one.

    Raises
    ------
    InputError
        With every fault.
    """
    report = Report(source=source_name, document=_document(study))
    if locate is not None:
        report.locate = locate
    study_of(report)
    check_against_feeder(study, feeder, report)
    report.raise_if_any()


def resolved(study: Study, feeder: Feeder) -> Study:
    """Return the study with what it leaves to the feeder written out, names in order.

    Two studies that mean the same for this feeder then read the same. What each load and DER
    has by itself, such as a motor's share, still stands in the feeder file.

    Examples
    --------
    >>> from openphase.model import load_feeder
    >>> resolved(Study(), load_feeder("paper")).network.closed
    ()
    """
    normal = tuple(switch.name for switch in feeder.switches if switch.closed)

    def named(state: _State) -> _State:
        closed = normal if state.closed is None else state.closed
        return replace(state, closed=tuple(sorted(closed)), opened=tuple(sorted(state.opened)))

    def switching(draw: SwitchingDraw) -> SwitchingDraw:
        return replace(draw, states=tuple(named(state) for state in draw.states))

    closed, unknown = study.network.closed, study.transformers.unknown
    if not study.groups:
        closed = tuple(sorted(normal if closed is None else closed))
    if any(unit.connection == "unknown" for unit in feeder.transformers):
        unknown = unknown or UNKNOWN_CONNECTION[wires_at_unknown(feeder)]
    events = study.events
    return replace(
        study,
        transformers=replace(study.transformers, unknown=unknown),
        network=replace(study.network, closed=closed),
        groups=tuple(named(group) for group in study.groups),
        events=replace(
            events,
            tie_switching=switching(events.tie_switching),
            transfer=switching(events.transfer),
        ),
    )


_State = TypeVar("_State", Group, SwitchState)


# ---- writing ----


def dump_study(study: Study) -> str:
    """Return the text of a study file that reads back as exactly this study.

    Every default is written out, so the text says all that the study does; what is left to
    the feeder file stays out.

    Examples
    --------
    >>> dump_study(Study()).splitlines()[:4]
    ['format = 1', '', '[loads]', 'level = [0.25, 1.0]']
    """
    return f"format = {FORMAT}\n\n{_dump(study, {})}"


_DEMANDS = {
    "network": ("settings",),
    "events": ("without",),
    "device": None,
    "detector": None,
    "reference": None,
    "certificate": None,
}
"""What is demanded of settings, and not part of the population: keys by table, None for all.

A class that is left out changes no draw of the others, whose settings would be chosen on the
same sample again.
"""


def dump_population(study: Study) -> str:
    """Return the part of a study's text that decides which scenarios are drawn."""
    return _dump(study, _DEMANDS)


def _dump(study: Study, without: Mapping[str, Collection[str] | None]) -> str:
    """Return the tables of a study's file, those left out that ``without`` names."""
    blocks = []
    for table in TABLES:
        left_out = without.get(table, ())
        if left_out is not None:
            row = {key: value for key, value in _row(study, table).items() if key not in left_out}
            blocks.append(f"[{table}]\n{toml_rows(row)}")
    blocks += [f"[[measured]]\n{toml_rows(as_table(item))}" for item in study.measured]
    blocks += [f"[[groups]]\n{toml_rows(as_table(group))}" for group in study.groups]
    blocks += [f"[[correlations]]\n{toml_rows(as_table(item))}" for item in study.correlations]
    return "\n".join(blocks)


def _row(study: Study, table: str) -> dict[str, object]:
    """Return the keys and values of one table, without the tables inside it."""
    row = as_table(part_of(study, table))
    return {field.name: row[field.name] for field in TABLES[table] if field.name in row}


def _document(study: Study) -> dict[str, object]:
    """Return the document that describes a study."""
    rows = {table: _row(study, table) for table in TABLES}
    events = rows["events"] | {name: rows.pop(f"events.{name}") for name in EVENT_TABLES}
    return {
        "format": FORMAT,
        **rows,
        "events": events,
        "measured": [as_table(item) for item in study.measured],
        "groups": [as_table(group) for group in study.groups],
        "correlations": [as_table(item) for item in study.correlations],
    }
