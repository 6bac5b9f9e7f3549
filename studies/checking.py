"""``openphase check``: all faults of a feeder file at once, or a summary per section."""

from __future__ import annotations

import argparse
import textwrap
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from ..model.errors import InputError, OpenPhaseError
from ..model.feeder_file import load_feeder
from ..model.network import Network, compile_network
from ..model.parts import Feeder
from ..model.points import Terminal, find_points
from .run.spec import Study, check_study, default_study
from .run.store import as_json
from .show.sheet import PAGE, wrapped

__all__ = ["check_command", "summary"]

LONG_LIST = 16  #: columns in which a list of names may run on below itself


def check_command(args: argparse.Namespace) -> int:
    """Run the verb; returns the exit code. Faults of the file have ended it before."""
    feeder = load_feeder(args.feeder)
    study = default_study(args.feeder)
    check_study(study, feeder, "study.toml")
    found = summary(feeder, study)
    if args.plot:
        _plot(feeder, args.plot)
    print(as_json(found) if args.json else _text(found), end="")
    return 0


def summary(feeder: Feeder, study: Study) -> dict[str, Any]:
    """What ``check --json`` prints."""
    network = compile_network(feeder)
    load_kw = sum(load.kw for load in feeder.loads)
    found: dict[str, Any] = {
        "feeder": feeder.name,
        "kv_ll": feeder.source.kv_ll,
        "line_km": float(network.length_km.sum()),
        "load_kw": load_kw,
        "points": [point.name for point in feeder.points],
        "sections": [],
        "loop": [switch.name for switch in feeder.switches if not switch.closed],
        "assumed": _assumed(feeder),
    }
    if feeder.sections:
        points = find_points(feeder, network)
        for terminal in points.terminals[::2]:
            found["sections"].append(_section(feeder, network, terminal, study))
    return found


def _section(feeder: Feeder, network: Network, terminal: Terminal, study: Study) -> dict[str, Any]:
    """One section: its line, what hangs in it and beyond it."""
    inside_nodes = _nodes(network, terminal)
    beyond_all = _kw_below(feeder, network, terminal, nearest=True)
    beyond_far = _kw_below(feeder, network, terminal, nearest=False)
    low = study.loads.level[0] * study.loads.each[0]
    high = study.loads.level[1] * study.loads.each[1]
    units = [
        name
        for name, node in zip(network.units, network.tree.unit_node, strict=True)
        if node in inside_nodes
    ]
    given = {t.name: t.connection for t in feeder.transformers}
    return {
        "local": terminal.local,
        "remote": terminal.remote,
        "length_km": float(network.length_km[terminal.on_path].sum()),
        "line_z1_ohm": [terminal.line_z1_ohm.real, terminal.line_z1_ohm.imag],
        "downstream_kw": [beyond_far * low, beyond_all * high],
        "downstream_kw_nominal": [beyond_far, beyond_all],
        "units": units,
        "yg_d": [name for name in units if given.get(name) == "Yg/D"],
        "yg_d_sampled": [name for name in units if name in study.transformers.yg_d],
        "regulators": 0,
        "switches": [
            s.name for s in feeder.switches if s.closed and _within(s, inside_nodes, network)
        ],
    }


def _within(switch: Any, nodes: set[int], network: Network) -> bool:
    return {network.node(switch.from_bus), network.node(switch.to_bus)} <= nodes


def _nodes(network: Network, terminal: Terminal) -> set[int]:
    """Nodes at the lower ends of the section's edges."""
    return {int(k) for k in np.flatnonzero(terminal.in_section) if k < len(network.nodes)}


def _kw_below(feeder: Feeder, network: Network, terminal: Terminal, *, nearest: bool) -> float:
    """Nominal kW beyond the section's first edge, or beyond its last."""
    path = [int(k) for k in np.flatnonzero(terminal.on_path)]
    edge = min(path) if nearest else max(path)
    loaded = network.below(edge)[network.tree.unit_node[network.tree.load_unit]]
    return float(sum(load.kw for load, own in zip(feeder.loads, loaded, strict=True) if own))


def _assumed(feeder: Feeder) -> list[str]:
    """What this version takes for granted about any feeder."""
    said = [
        "lines are transposed, without charging; loads are balanced over three phases",
        "downstream kW: nominal times the study's load range, at the section's far and near end",
    ]
    if any(line.z0_ohm_per_km == line.z1_ohm_per_km for line in feeder.lines):
        said.append("some lines have z0 = z1 (given so): overhead lines have z0 ≈ 3 z1")
    return said


def _plot(feeder: Feeder, path: Path) -> None:
    from .show.plots import plot_feeder, save_figure  # noqa: PLC0415  (only a picture needs it)

    if path.suffix.lower() not in (".png", ".svg"):
        raise InputError.single("--plot", "", path.name, "must end in .png or .svg")
    figure = plot_feeder(feeder).get_figure()
    try:
        save_figure(figure, path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OpenPhaseError(f"{path}: the picture cannot be written: {reason}") from error


def _text(found: dict[str, Any]) -> str:
    """The summary for people, in 100 columns."""
    lines = [
        *wrapped(
            f"{found['feeder']}: no faults; {found['kv_ll']:g} kV, {found['line_km']:g} km of "
            f"line, {found['load_kw']:g} kW, {len(found['points'])} measuring points"
        ),
        "",
        *(_sections(found["sections"]) or ["no sections: nothing to size"]),
        "",
        *wrapped(f"ties, normally open: {', '.join(found['loop']) or 'none'}"),
        "regulators: none",
        "assumed:",
    ]
    for text in found["assumed"]:
        lines += wrapped(f"- {text}")
    return "\n".join(lines) + "\n"


def _sections(rows: list[dict[str, Any]]) -> list[str]:
    """The table of the sections; none where there is no section."""
    if not rows:
        return []
    cells = [["section", "km", "|Z1| Ω", "downstream kW", "Yg/D known", "Yg/D sampled", "inside"]]
    for row in rows:
        low, high = row["downstream_kw"]
        cells.append(
            [
                f"{row['local']}–{row['remote']}",
                f"{row['length_km']:g}",
                f"{abs(complex(*row['line_z1_ohm'])):.3f}",
                f"{low:.0f} .. {high:.0f}",
                *(", ".join(row[key]) or "-" for key in ("yg_d", "yg_d_sampled")),
                ", ".join(row["units"] + row["switches"]) or "-",
            ]
        )
    wide = [max(len(line[n]) for line in cells) for n in range(7)]
    # long names stand above their row, long lists run on below themselves
    wide[4:6] = [min(w, LONG_LIST) for w in wide[4:6]]
    beside = sum(wide[:6]) + 2 * 6 + min(wide[6], LONG_LIST) <= PAGE
    if not beside:
        wide[0] = 0
    wide[6] = min(wide[6], PAGE - sum(wide[:6]) - 2 * 6)
    lines = []
    for name, *rest in cells:
        if not beside:
            lines += wrapped(name)
        parts = [[name if beside else ""], *([text] for text in rest[:3])]
        parts += [textwrap.wrap(text, w) for text, w in zip(rest[3:], wide[4:], strict=True)]
        for own in zip_longest(*parts, fillvalue=""):
            padded = (
                f"{text:>{w}}" if n in (1, 2, 3) else f"{text:<{w}}"
                for n, (text, w) in enumerate(zip(own, wide, strict=True))
            )
            lines.append("  ".join(padded).rstrip())
    return lines
