"""The door through which every feeder comes: all its parts checked, alone and together.

A `Feeder` that came through `make_feeder` or `checked_feeder` has unique names, no loose
reference, parts that the model can represent, and a source that reaches every bus, with every
phase that something there needs, while its ties are open.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from .errors import Report
from .parts import (
    Capacitor,
    Coordinates,
    Der,
    Feeder,
    InlineTransformer,
    Line,
    LineCode,
    Load,
    Point,
    Regulator,
    Section,
    Source,
    Switch,
    Transformer,
)
from .reading.feeder_document import document_from_feeder, feeder_from_document
from .reading.feeder_electrical import check_electrical
from .reading.feeder_graph import check_graph, check_section_paths, graph_is_known
from .reading.feeder_names import STUB_SUFFIXES, check_ends, check_names, check_references
from .reading.feeder_phases import check_phases, check_volts
from .reading.feeder_tables import with_csv_tables
from .topology import buses

__all__ = ["STUB_SUFFIXES", "buses", "checked_feeder", "make_feeder"]


def make_feeder(  # noqa: PLR0913 - one argument for each field of Feeder
    *,
    name: str,
    source: Source,
    lines: Sequence[Line],
    transformers: Sequence[Transformer] = (),
    loads: Sequence[Load] = (),
    ders: Sequence[Der] = (),
    capacitors: Sequence[Capacitor] = (),
    regulators: Sequence[Regulator] = (),
    switches: Sequence[Switch] = (),
    points: Sequence[Point] = (),
    sections: Sequence[Section] = (),
    codes: Sequence[LineCode] = (),
    inline_transformers: Sequence[InlineTransformer] = (),
    coordinates: Sequence[Coordinates] = (),
    imported_from: str | None = None,
) -> Feeder:
    """Return a feeder built in a program, checked like one from a file.

    Its values count as given, or as imported where ``imported_from`` says from what; those
    that equal a default of the feeder file count as defaults.

    Raises
    ------
    InputError
        With every fault of the parts, on their own and together.
    """
    feeder = Feeder(
        name=name,
        source=source,
        lines=tuple(lines),
        transformers=tuple(transformers),
        loads=tuple(loads),
        ders=tuple(ders),
        capacitors=tuple(capacitors),
        regulators=tuple(regulators),
        switches=tuple(switches),
        points=tuple(points),
        sections=tuple(sections),
        codes=tuple(codes),
        inline_transformers=tuple(inline_transformers),
        coordinates=tuple(coordinates),
        imported_from=imported_from,
    )
    document = document_from_feeder(feeder)
    return checked_feeder(Report(source=name, document=document))


def checked_feeder(report: Report, folder: Path | None = None) -> Feeder:
    """Return the feeder that the report's document describes.

    Parameters
    ----------
    report
        Holds the document, and receives its faults.
    folder
        Where the CSV tables stand that the document names.

    Raises
    ------
    InputError
        With every fault of the document, and those that the report held already.
    """
    report = with_csv_tables(report, folder)
    feeder = feeder_from_document(report.document, report)
    check_names(feeder, report)
    check_references(feeder, report)
    check_ends(feeder, report)
    check_electrical(feeder, report)
    if graph_is_known(report):
        check_graph(feeder, report)
        check_phases(feeder, report)
        check_volts(feeder, report)
    if not report.faults:
        check_section_paths(feeder, report)
    report.raise_if_any()
    return feeder
