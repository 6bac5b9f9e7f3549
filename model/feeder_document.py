"""The way between a `Feeder` and its document, the tables of plain values in a file.

Both directions exist so that a feeder built in a program passes the same checks as one
that was read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from .errors import KeyPath, Report
from .feeder_fields import DOCUMENT, FORMAT, TABLES
from .parts import Feeder, Line, Load, Place, Point, Section, Source, Switch, Transformer
from .table_check import check_table

__all__ = ["document_from_feeder", "feeder_from_document"]

_Row = dict[str, Any]

_PLACES = ({"bus"}, {"line", "at"})


def feeder_from_document(document: Mapping[str, object], report: Report) -> Feeder:
    """Return the feeder a document describes, every field checked on its own.

    Faults go to the report. Stand-ins take the place of faulty values, an empty text that
    of a faulty name, so the feeder is of use only to further checks until the report is
    known to be empty.
    """
    top = check_table(document, DOCUMENT, (), report)
    source = check_table(top["source"], TABLES["source"], ("source",), report)
    rows = {table: _rows(top[table], table, report) for table in TABLES if table != "source"}
    for index, row in enumerate(rows["transformers"]):
        _check_place(row, _PLACES, ("transformers", index), report)
    for index, (raw, row) in enumerate(zip(top["loads"], rows["loads"], strict=True)):
        _check_place(row, ({"transformer"}, *_PLACES), ("loads", index), report)
        _check_load_connection(raw, ("loads", index), report)
    return Feeder(
        name=top["name"],
        source=Source(**source),
        lines=tuple(_line(row) for row in rows["lines"]),
        transformers=tuple(_transformer(row) for row in rows["transformers"]),
        loads=tuple(_load(row) for row in rows["loads"]),
        switches=tuple(_switch(row) for row in rows["switches"]),
        points=tuple(Point(**row) for row in rows["points"]),
        sections=tuple(Section(**row) for row in rows["sections"]),
    )


def _rows(raw: Sequence[Mapping[str, object]], table: str, report: Report) -> list[_Row]:
    """Return the checked rows of an array of tables."""
    return [
        check_table(row, TABLES[table], (table, index), report) for index, row in enumerate(raw)
    ]


def _check_place(row: _Row, allowed: Sequence[set[str]], path: KeyPath, report: Report) -> None:
    """Report a row that says where it hangs in no way, half a way or two ways."""
    given = [key for key in ("transformer", "bus", "line", "at") if row.get(key) is not None]
    if set(given) not in allowed:
        ways = " or ".join(" and ".join(sorted(way, reverse=True)) for way in allowed)
        report.add(path, f"must say where it hangs, by {ways}", " and ".join(given) or "none")


def _check_load_connection(raw: Mapping[str, object], path: KeyPath, report: Report) -> None:
    """Report a connection where the winding above the load decides it."""
    if "transformer" in raw and "connection" in raw:
        rule = "must be left out behind a transformer, whose winding decides"
        report.add((*path, "connection"), rule)


def _line(row: _Row) -> Line:
    return Line(
        name=row["name"],
        from_bus=row["from"],
        to_bus=row["to"],
        length_km=row["length_km"],
        z1_ohm_per_km=row["z1_ohm_per_km"],
        z0_ohm_per_km=row["z0_ohm_per_km"],
    )


def _place(row: _Row) -> Place:
    return Place(bus=row["bus"], line=row["line"], at=row["at"])


def _transformer(row: _Row) -> Transformer:
    return Transformer(
        name=row["name"],
        place=_place(row),
        connection=row["connection"],
        rating_kva=row["rating_kva"],
        leakage_pu=row["leakage_pu"],
        x0_pu=row["x0_pu"],
    )


def _load(row: _Row) -> Load:
    return Load(
        name=row["name"],
        transformer=row["transformer"],
        place=_place(row) if row["transformer"] is None else None,
        connection=row["connection"],
        kw=row["kw"],
        power_factor=row["power_factor"],
        exponent=row["exponent"],
    )


def _switch(row: _Row) -> Switch:
    return Switch(name=row["name"], from_bus=row["from"], to_bus=row["to"], closed=row["closed"])


def document_from_feeder(feeder: Feeder) -> dict[str, object]:
    """Return the document that describes a feeder, with every default written out."""
    return {
        "format": FORMAT,
        "name": feeder.name,
        "source": _source_row(feeder.source),
        "lines": [_line_row(line) for line in feeder.lines],
        "transformers": [_transformer_row(unit) for unit in feeder.transformers],
        "loads": [_load_row(load) for load in feeder.loads],
        "switches": [_switch_row(switch) for switch in feeder.switches],
        "points": [{"name": p.name, "bus": p.bus, "line": p.line} for p in feeder.points],
        "sections": [{"local": s.local, "remote": s.remote} for s in feeder.sections],
    }


def _source_row(source: Source) -> _Row:
    return {
        "bus": source.bus,
        "kv_ll": source.kv_ll,
        "emf_pu": source.emf_pu,
        "z1_ohm": _rectangular(source.z1_ohm),
        "z2_ohm": _rectangular(source.z2_ohm),
        "z0_ohm": _rectangular(source.z0_ohm),
        "frequency_hz": source.frequency_hz,
    }


def _line_row(line: Line) -> _Row:
    return {
        "name": line.name,
        "from": line.from_bus,
        "to": line.to_bus,
        "length_km": line.length_km,
        "z1_ohm_per_km": _rectangular(line.z1_ohm_per_km),
        "z0_ohm_per_km": _rectangular(line.z0_ohm_per_km),
    }


def _transformer_row(unit: Transformer) -> _Row:
    row = {
        "name": unit.name,
        **_place_row(unit.place),
        "connection": unit.connection,
        "rating_kva": unit.rating_kva,
        "leakage_pu": _rectangular(unit.leakage_pu),
    }
    return row if unit.x0_pu is None else {**row, "x0_pu": unit.x0_pu}


def _load_row(load: Load) -> _Row:
    row: _Row = {"name": load.name, **_place_row(load.place)}
    if load.transformer is not None:
        row["transformer"] = load.transformer
    if load.transformer is None or load.connection != "wye":
        row["connection"] = load.connection
    return {
        **row,
        "kw": load.kw,
        "power_factor": load.power_factor,
        "exponent": load.exponent,
    }


def _switch_row(switch: Switch) -> _Row:
    return {
        "name": switch.name,
        "from": switch.from_bus,
        "to": switch.to_bus,
        "closed": switch.closed,
    }


def _place_row(place: Place | None) -> _Row:
    if place is None:
        return {}
    row = {"bus": place.bus, "line": place.line, "at": place.at}
    return {key: value for key, value in row.items() if value is not None}


def _rectangular(z: complex) -> list[float]:
    return [z.real, z.imag]
