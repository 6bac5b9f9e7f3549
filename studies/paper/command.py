"""``openphase paper``: the paper's results beside what the model makes of its feeder, and why."""

from __future__ import annotations

import argparse
import cmath
import math
import sys
import textwrap
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ... import __version__
from ...model.errors import OpenPhaseError
from ...model.parts import Feeder
from ...model.reading.feeder_file import load_feeder
from ..run.store import as_json, write_whole
from ..show.sheet import PAGE, wrapped
from .feeds import two_source_groups
from .printed import SETTINGS, Group, Printed, Row
from .rows import open_loop_groups

__all__ = ["paper_command", "paper_groups", "paper_result", "paper_table"]

BASIS = {
    "circuit": "follows from what the paper prints and from plain choices (angles, places)",
    "fit": "rests on a value that was chosen because the paper's figures come out with it: T4's "
    "place and the cores' X0, or what a row says it was solved for. No evidence.",
    "variant": "another feeder on purpose",
    "formula": "the paper's own approximation, without the model",
}
"""What the last column says, in words."""

WIDTHS = (39, 8, 18, 19, 8)
GAP = "  "


def paper_command(args: argparse.Namespace) -> int:
    """Run the verb; returns the exit code."""
    print("solving; the solver is compiled at first use …", file=sys.stderr, flush=True)
    feeder = load_feeder("paper")
    groups = paper_groups(feeder)
    if args.out:
        _check_folder(args.out)
        _write(args.out, feeder, groups)
    print(as_json(paper_result(groups)) if args.json else paper_table(groups), end="")
    return 0


def paper_groups(feeder: Feeder) -> tuple[Group, ...]:
    """Everything that is compared, figure by figure."""
    return (*open_loop_groups(feeder), *two_source_groups(feeder))


def _check_folder(folder: Path) -> None:
    """A folder that holds something else is left alone."""
    if folder.is_dir() and any(folder.iterdir()) and not (folder / "paper.txt").is_file():
        raise OpenPhaseError(f"{folder}: holds other files; choose another --out")


def _write(folder: Path, feeder: Feeder, groups: tuple[Group, ...]) -> None:
    """The answer, the table and the pictures."""
    from ..show.paper_figures import paper_pictures  # noqa: PLC0415
    from .courses import paper_panels  # noqa: PLC0415  (only pictures need it)

    write_whole(folder / "result.json", as_json(paper_result(groups)).encode())
    write_whole(folder / "paper.txt", paper_table(groups).encode())
    for name, content in paper_pictures(paper_panels(feeder)):
        write_whole(folder / name, content)
    print(f"pictures and tables are in {folder}", file=sys.stderr)


# ---- for programs ----


def paper_result(groups: Iterable[Group]) -> dict[str, Any]:
    """What ``paper --json`` prints: one object."""
    return {
        "version": __version__,
        "settings": {
            "i_set_a": SETTINGS.i_set_a,
            "v_set_pu": SETTINGS.v_set_pu,
            "z_set_ohm": SETTINGS.z_set_ohm,
        },
        "basis": BASIS,
        "figures": [
            {
                "name": group.name,
                "title": group.title,
                "rows": [_row_result(row) for row in group.rows],
            }
            for group in groups
        ],
    }


def _row_result(row: Row) -> dict[str, Any]:
    gap = _difference(row)
    size = None if isinstance(row.model, str) else abs(row.model)
    turned = isinstance(row.model, complex)
    return {
        "name": row.name,
        "quantity": row.quantity,
        "unit": row.unit,
        "paper": None if row.paper is None else row.paper.value,
        "paper_about": None if row.paper is None else row.paper.about,
        "paper_where": None if row.paper is None else row.paper.where,
        "model": size,
        "model_deg": math.degrees(cmath.phase(complex(row.model))) if turned else None,
        "model_text": _model(row),
        "difference": None if gap is None else gap[0],
        "difference_pct": None if gap is None else gap[1],
        "basis": row.basis,
        "why": row.why,
    }


def _difference(row: Row) -> tuple[float, float] | None:
    """Model less paper, and that in % of the paper's; magnitudes, as the paper prints them."""
    if row.paper is None or isinstance(row.model, str):
        return None
    gap = abs(row.model) - row.paper.value
    return gap, 100.0 * gap / row.paper.value


# ---- for people ----


def paper_table(groups: Iterable[Group]) -> str:
    """The comparison in 100 columns, reasons below their rows."""
    lines = [
        *wrapped(
            "The paper's results (its Section V) beside what the model makes of the shipped feeder "
            "`paper`: exact steady states before and after; transients are not modelled."
        ),
        "",
        _columns(("", "paper", "model", "difference", "basis")),
    ]
    for group in groups:
        lines += ["", *wrapped(f"{group.name}: {group.title}")]
        for row in group.rows:
            lines += _row_lines(row)
    lines += ["", "basis"]
    for name, text in BASIS.items():
        lines += wrapped(f"  {name}: {text}")
    return "\n".join(lines) + "\n"


def _row_lines(row: Row) -> list[str]:
    unit = f", {row.unit}" if row.unit else ""
    lines = [
        _columns(
            (f"{row.quantity}{unit}", _printed(row.paper), _model(row), _gap_text(row), row.basis)
        )
    ]
    begin = 4 * " "
    lines += textwrap.wrap(row.why, PAGE, initial_indent=begin, subsequent_indent=begin)
    return lines


def _columns(cells: tuple[str, ...]) -> str:
    """One line of the table; a text too wide for its column pushes the others."""
    first, *numbers, last = cells
    row = [f"{first:<{WIDTHS[0]}}"]
    row += [f"{text:>{width}}" for text, width in zip(numbers, WIDTHS[1:-1], strict=True)]
    return GAP.join([*row, last]).rstrip()


def _printed(paper: Printed | None) -> str:
    if paper is None:
        return "–"
    return f"{'≈ ' if paper.about else ''}{paper.value:g}"


def _model(row: Row) -> str:
    if isinstance(row.model, str):
        return row.model
    size = f"{abs(row.model):.{row.digits}f}"
    if isinstance(row.model, complex):
        return f"{size}∠{math.degrees(cmath.phase(row.model)):.1f}°"
    return size


def _gap_text(row: Row) -> str:
    gap = _difference(row)
    if gap is None or row.paper is None:
        return ""
    digits = 1 if row.paper.value >= 10.0 else 3
    digits = min(row.digits, digits)
    # rounded first, and zero added, so that no "-0.0" is printed
    size, share = round(gap[0], digits) + 0.0, round(gap[1], 1) + 0.0
    return f"{size:+.{digits}f} ({share:+.1f} %)"
