"""Study files: reading them, writing them, and the ones that ship with the package."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from ... import model
from ...model.errors import InputError, KeyPath, Locator, Report
from ...model.feeder_file import shipped_feeders
from ...model.fields import as_toml, did_you_mean
from ...model.parts import Feeder
from ...model.table_check import check_table
from ...model.toml_file import parse_toml, read_text, toml_rows
from .spec_fields import DOCUMENT, EVENTS, FORMAT, STEPS, TABLES, as_table
from .spec_parts import (
    Ambient,
    CertificateDemand,
    DetectorOptions,
    Device,
    Instruments,
    LoadDraw,
    LoadStepDraw,
    NetworkState,
    OpenPhaseDraw,
    ReferenceSettings,
    SourceStepDraw,
    Steps,
    Study,
    TransformerDraw,
)

__all__ = [
    "Ambient",
    "CertificateDemand",
    "DetectorOptions",
    "Device",
    "Instruments",
    "LoadDraw",
    "LoadStepDraw",
    "NetworkState",
    "OpenPhaseDraw",
    "ReferenceSettings",
    "SourceStepDraw",
    "Steps",
    "Study",
    "TransformerDraw",
    "check_study",
    "default_study",
    "dump_population",
    "dump_study",
    "read_study",
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
    study = _study(report)
    report.raise_if_any()
    return study


def default_study(feeder_name: str) -> Study:
    """Return the study that ships with a shipped feeder; for any other, all the defaults.

    Examples
    --------
    >>> default_study("paper").transformers.yg_d
    ('T4', 'T5', 'T6')
    >>> default_study("my feeder") == Study()
    True
    """
    file = _DATA / f"{feeder_name}.study.toml"
    if feeder_name not in shipped_feeders() or not file.is_file():
        return Study()
    return study_from_toml(file.read_text(encoding="utf-8"), file.name)


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
    _study(report)
    _check_transformers(study.transformers.yg_d, feeder, report)
    _check_switches(study.network.closed or (), feeder, report)
    report.raise_if_any()


def _document(study: Study) -> dict[str, object]:
    """Return the document that describes a study."""
    parts = {table: as_table(part) for table, part in _parts(study).items()}
    top = {table: part for table, part in parts.items() if "." not in table}
    events = {event.name: parts[f"events.{event.name}"] for event in EVENTS}
    return {"format": FORMAT, **top, "events": events}


def _parts(study: Study) -> dict[str, object]:
    """Return the parts of a study by the names of their tables."""
    return {table: getattr(study, table.rpartition(".")[2]) for table in TABLES}


def _check_transformers(names: Sequence[str], feeder: Feeder, report: Report) -> None:
    """The units are the feeder's, and may be Yg/D."""
    units = {unit.name: unit for unit in feeder.transformers}
    for index, name in enumerate(names):
        path = ("transformers", "yg_d", index)
        if name not in units:
            rule = f"must be a transformer of the feeder{did_you_mean(name, units)}"
            report.add(path, rule, repr(name))
        elif units[name].leakage_pu == 0.0:
            rule = "must have leakage, or as Yg/D it would short the zero sequence to earth"
            report.add(path, rule, repr(name))


def _check_switches(names: Sequence[str], feeder: Feeder, report: Report) -> None:
    """The switches are the feeder's."""
    known = [switch.name for switch in feeder.switches]
    for index, name in enumerate(names):
        if name not in known:
            rule = f"must be a switch of the feeder{did_you_mean(name, known)}"
            report.add(("network", "closed", index), rule, repr(name))


# ---- from the document to the study ----


def _study(report: Report) -> Study:
    """Return the study that the report's document describes; faults go to the report.

    Of use only while the report is empty.
    """
    top = check_table(report.document, DOCUMENT, (), report)
    events = _given(top["events"], "events", report)
    parts = {
        event.name: _given(events.get(event.name), f"events.{event.name}", report)
        for event in EVENTS
    }
    parts |= {table: _given(top[table], table, report) for table in TABLES if table in top}
    study = Study(
        loads=LoadDraw(**parts["loads"]),
        transformers=TransformerDraw(**parts["transformers"]),
        ambient=Ambient(**parts["ambient"]),
        network=NetworkState(**parts["network"]),
        open_phase=OpenPhaseDraw(**parts["open_phase"]),
        load_step=LoadStepDraw(**parts["load_step"]),
        source_step=SourceStepDraw(**parts["source_step"]),
        instruments=Instruments(**parts["instruments"]),
        device=Device(**parts["device"]),
        detector=DetectorOptions(**parts["detector"]),
        reference=ReferenceSettings(**parts["reference"]),
        certificate=CertificateDemand(**parts["certificate"]),
    )
    _check_together(study, report)
    return study


def _given(raw: Mapping[str, object] | None, table: str, report: Report) -> dict[str, Any]:
    """Return the checked values of those known keys that a table holds.

    What `check_table` cannot read, lists of names and steps, has a reader here.
    """
    raw = raw or {}
    path = tuple(table.split("."))
    readers = _READERS.get(table, {})
    others = {key: value for key, value in raw.items() if key not in readers}
    fields = EVENTS if table == "events" else TABLES[table]
    values = check_table(others, fields, path, report)
    for key, read in readers.items():
        if key in raw:
            values[key] = read(raw[key], (*path, key), report)
    return {key: values[key] for key in raw if key in values}


def _check_together(study: Study, report: Report) -> None:
    """Check what a field's own range cannot say."""
    draw = study.transformers
    if draw.yg_d_count[1] > len(draw.yg_d) and not _is_faulty(("transformers",), report):
        rule = f"must not exceed the {len(draw.yg_d)} units named by yg_d"
        report.add(("transformers", "yg_d_count"), rule, as_toml(draw.yg_d_count))
    path: KeyPath = ("certificate", "confidence")
    if study.certificate.confidence == 1.0 and not _is_faulty(path, report):
        report.add(path, "must be < 1", "1.0")
    device = study.device
    grids = {"i_set_a": device.i_grid, "z_set_ohm": device.z_grid, "v_set_pct": device.v_grid_pu}
    for key, grid in grids.items():
        if not _is_faulty(("device", key), report):
            _try_grid(grid, ("device", key), as_toml(as_table(device)[key]), report)


def _is_faulty(path: KeyPath, report: Report) -> bool:
    """Tell whether a value, or anything inside it, has been reported."""
    return any(found[: len(path)] == path for found in report.paths)


def _try_grid(grid: Callable[[], object], path: KeyPath, found: str, report: Report) -> None:
    """Report what a grid of settings says against being made."""
    try:
        grid()
    except InputError as error:
        report.add(path, error.faults[0].wanted, found)


# ---- readers of single values: a fault is reported, and a harmless value returned ----


def _read_event(value: object, path: KeyPath, report: Report) -> Mapping[str, object]:
    if not isinstance(value, Mapping):
        written = ".".join(str(part) for part in path)
        report.add(path, f"must be a table, written [{written}]", as_toml(value))
        return {}
    return value


def _read_names(value: object, path: KeyPath, report: Report) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        report.add(path, "must be a list of names", as_toml(value))
        return ()
    for index, name in enumerate(value):
        if name in value[:index]:
            report.add((*path, index), "must be there once", repr(name))
    return tuple(value)


def _read_counts(value: object, path: KeyPath, report: Report) -> tuple[int, int]:
    counts = [n for n in value if type(n) is int] if isinstance(value, list) else []
    if counts != value or len(counts) != 2 or not 0 <= counts[0] <= counts[1]:
        rule = "must be [least, most], whole numbers >= 0, least <= most"
        report.add(path, rule, as_toml(value))
        return 0, 0
    return counts[0], counts[1]


def _read_steps(value: object, path: KeyPath, report: Report) -> Steps:
    faults = len(report.faults)
    if not isinstance(value, Mapping):
        report.add(path, "must be { first = ..., last = ..., step = ... }", as_toml(value))
        value = None
    steps = Steps(**check_table(value, STEPS, path, report))
    if len(report.faults) == faults:
        _try_grid(steps.values, path, as_toml(value), report)
    return steps


def _read_ladder(value: object, path: KeyPath, report: Report) -> tuple[Steps, ...]:
    if not isinstance(value, list):
        report.add(
            path, "must be a list of { first = ..., last = ..., step = ... }", as_toml(value)
        )
        return ()
    return tuple(_read_steps(item, (*path, index), report) for index, item in enumerate(value))


_Reader = Callable[[object, KeyPath, Report], object]

_READERS: dict[str, dict[str, _Reader]] = {
    "events": {event.name: _read_event for event in EVENTS},
    "transformers": {"yg_d": _read_names, "yg_d_count": _read_counts},
    "network": {"closed": _read_names},
    "device": {"i_set_a": _read_steps, "z_set_ohm": _read_ladder},
}


# ---- writing ----


def dump_study(study: Study) -> str:
    """Return the text of a study file that reads back as exactly this study.

    Every default is written out, so the text says all that the study does.

    Examples
    --------
    >>> dump_study(Study()).splitlines()[:4]
    ['format = 1', '', '[loads]', 'level = [0.25, 1.0]']
    """
    blocks = [f"format = {FORMAT}\n"]
    for table, part in _parts(study).items():
        blocks.append(f"[{table}]\n{toml_rows(as_table(part))}")
    return "\n".join(blocks)


#: tables that say which scenarios there are; the others say what is demanded of settings
POPULATION = (
    "loads",
    "transformers",
    "ambient",
    "network",
    "events.open_phase",
    "events.load_step",
    "events.source_step",
    "instruments",
)


def dump_population(study: Study) -> str:
    """Return the part of a study's text that decides which scenarios are drawn."""
    parts = _parts(study)
    return "\n".join(f"[{table}]\n{toml_rows(as_table(parts[table]))}" for table in POPULATION)
