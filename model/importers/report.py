"""The fidelity report of an import: what was taken over, how, and how well it agrees."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from ..buses import bus_volts
from ..parts import Feeder
from .dss_feeder import Imported
from .fidelity import Difference
from .findings import Fate, Finding

__all__ = ["fidelity_report"]

_FATES: tuple[Fate, ...] = (
    "as it is",
    "approximated",
    "refused",
    "dropped",
    "not fed",
    "state kept",
)
_NAMED = 5
"""So many elements of a kind are named; JSON has no more."""


def fidelity_report(imported: Imported, differences: Sequence[Difference]) -> dict[str, Any]:
    """Return the report as plain data.

    ``classes`` counts what became of the elements of each class, ``how`` says it in groups,
    ``totals`` is what the feeder holds, ``opendss`` the largest differences of voltage.
    """
    return {
        "file": imported.feeder.imported_from,
        "feeder": imported.feeder.name,
        "engine": imported.engine,
        "classes": _classes(imported.findings.rows),
        "how": _groups(imported.findings.rows),
        "disabled": imported.circuit.disabled,
        "notes": list(imported.findings.notes),
        "left_out": _commands(imported.script.ignored),
        "totals": _totals(imported.feeder),
        "load_kw_of_file": _file_kw(imported),
        "load_multiplier": imported.circuit.load_mult,
        "opendss": [asdict(difference) for difference in differences],
    }


def _classes(rows: Sequence[Finding]) -> list[dict[str, Any]]:
    """Count the elements of each class by what became of them."""
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for row in rows:
        counts[row.kind][row.fate] += 1
    return [
        {"class": kind, **{fate.replace(" ", "_"): counts[kind][fate] for fate in _FATES}}
        for kind in counts
    ]


def _groups(rows: Sequence[Finding]) -> list[dict[str, Any]]:
    """Say how each group of elements was taken over that is not simply as it was."""
    groups: defaultdict[tuple[str, str, str], list[Finding]] = defaultdict(list)
    for row in rows:
        if row.fate != "as it is" or row.how:
            groups[(row.fate, row.kind, row.how)].append(row)
    order = sorted(groups, key=lambda key: (key[0] == "as it is", key))
    return [
        {
            "class": kind,
            "fate": fate,
            "how": how,
            "count": len(groups[(fate, kind, how)]),
            "names": [row.name for row in groups[(fate, kind, how)][:_NAMED]],
            "kw": round(sum(row.kw for row in groups[(fate, kind, how)]), 6),
        }
        for fate, kind, how in order
    ]


def _commands(ignored: Sequence[str]) -> dict[str, Any]:
    """Count what was left out of the files, and show the first."""
    return {"count": len(ignored), "first": list(ignored[:_NAMED])}


def _file_kw(imported: Imported) -> float:
    """Return the load of the file, whether fed or not."""
    circuit = imported.circuit
    return sum(load.kw * (1.0 if load.fixed else circuit.load_mult) for load in circuit.loads)


def _totals(feeder: Feeder) -> dict[str, Any]:
    """Return what the feeder holds."""
    km = [0.0, 0.0, 0.0]
    for line in feeder.lines:
        km[len(line.phases) - 1] += line.length_km
    volts = bus_volts(feeder)
    levels = Counter(round(v * 3.0**0.5 / 1000.0, 4) for v in volts.values())
    phases = Counter(load.phases if len(load.phases) < 3 else "abc" for load in feeder.loads)
    connections = Counter(unit.connection for unit in feeder.inline_transformers)
    unknown = sum(1 for unit in feeder.transformers if unit.connection == "unknown")
    return {
        "buses": len(volts),
        "lines": len(feeder.lines),
        "km_three_phase": km[2],
        "km_two_phase": km[1],
        "km_one_phase": km[0],
        "loads": len(feeder.loads),
        "load_kw": sum(load.kw for load in feeder.loads),
        "loads_by_phases": dict(sorted(phases.items())),
        "capacitors": len(feeder.capacitors),
        "capacitor_kvar": sum(bank.kvar for bank in feeder.capacitors),
        "ders": len(feeder.ders),
        "der_kw": sum(der.kw for der in feeder.ders),
        "regulators": {regulator.name: list(regulator.taps) for regulator in feeder.regulators},
        "switches_closed": sum(1 for switch in feeder.switches if switch.closed),
        "switches_open": sum(1 for switch in feeder.switches if not switch.closed),
        "connections_known": dict(sorted(connections.items())),
        "connections_unknown": unknown,
        "buses_by_kv": {f"{level:g}": count for level, count in sorted(levels.items())},
    }
