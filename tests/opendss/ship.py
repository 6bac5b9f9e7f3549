"""Write the shipped feeders and their golden cases anew, from OpenDSS's files and phasors.

Run it by hand where both are at hand, from the checkout, with the extra ``[opendss]``:
``PYTHONPATH=tests python tests/opendss/ship.py ../shared/feeders``. Tests see that what is in
the repository is what this writes.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from opendss.reference import Reference, compact, read_reference, renamed

from openphase.model.importers.dss_feeder import import_opendss
from openphase.model.parts import Feeder
from openphase.model.reading.feeder_file import write_feeder
from openphase.model.spread import spread_points

__all__ = ["SHIPPED", "feeder_and_case", "imported_as_in", "ship"]

SHIPPED = {"ieee13": "ieee13", "ieee34": "ieee34_1", "ieee37": "ieee37", "ieee123": "ieee123"}
"""Feeder: name of its reference."""

ROOT = Path(__file__).resolve().parents[2]
ABOUT = """\
The {number}-bus test feeder of the IEEE PES Distribution Test Feeder Working Group, as it
comes with OpenDSS (BSD-3, EPRI and DSS-Extensions contributors):
{file}
Taps and capacitors stand where the file's own controls put them in a solution of the file.
Measuring points are this project's default spread; the source has none."""


def imported_as_in(root: Path, reference: Reference) -> tuple[Feeder, Reference]:
    """The feeder with its controls as in the reference, and the reference in its names."""
    imported = import_opendss(
        root / reference.file,
        taps={name: {"2": tap} for name, tap in reference.taps.items()},
        capacitor_states={name: list(steps) for name, steps in reference.capacitors.items()},
    )
    return imported.feeder, renamed(reference, imported.buses, imported.lines)


def feeder_and_case(root: Path, name: str) -> tuple[Feeder, Reference]:
    """One shipped feeder, with points, and its phasors."""
    reference = read_reference(root / "reference" / f"{SHIPPED[name]}.json")
    feeder, reference = imported_as_in(root, reference)
    return spread_points(replace(feeder, name=name)).feeder, reference


def ship(root: Path, data: Path, golden: Path) -> None:
    """Write all of them."""
    for name in SHIPPED:
        feeder, reference = feeder_and_case(root, name)
        about = ABOUT.format(number=name.removeprefix("ieee"), file=reference.file)
        write_feeder(feeder, data / f"{name}.toml", comment=about)
        (golden / name).mkdir(parents=True, exist_ok=True)
        (golden / name / "states.jsonl").write_text(compact(reference), encoding="utf-8")


if __name__ == "__main__":
    ship(Path(sys.argv[1]), ROOT / "model" / "data", ROOT / "tests" / "golden")
