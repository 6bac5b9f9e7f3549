"""``openphase check``: all faults of a feeder file at once, or a summary per section."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.errors import InputError, OpenPhaseError
from ..model.events.phases import count_phases
from ..model.network import Network, assumed_connection, compile_network
from ..model.neutrals import bus_earthings, bus_neutrals, wires_at_unknown
from ..model.parts import Der, Feeder, InlineTransformer, Load, Place, Regulator, Switch
from ..model.points import Terminal, find_points
from ..model.reading.provenance import assumptions, count_origins
from ..model.sides import Side
from .loading import load_with_points
from .run.load_levels import level_bounds
from .run.store import as_json
from .show.check_text import check_text
from .spec.study_file import Study, check_study, default_study, own_study_file

__all__ = ["check_command", "summary"]

Real = NDArray[np.float64]

SHIFTING = ("D/Yg", "D/Y", "Yg/D", "Y/D")  #: the phasors of either side stand 30 degrees apart


def check_command(args: argparse.Namespace) -> int:
    """Run the verb; returns the exit code. Faults of the file have ended it before."""
    feeder, chosen = load_with_points(args.feeder)
    study = default_study(args.feeder)
    check_study(study, feeder, str(own_study_file(args.feeder) or "study.toml"))
    found = summary(feeder, study, chosen)
    if args.plot:
        _plot(feeder, args.plot)
    print(as_json(found) if args.json else check_text(found), end="")
    return 0


def summary(feeder: Feeder, study: Study, chosen: tuple[str, ...] = ()) -> dict[str, Any]:
    """What ``check --json`` prints; ``chosen`` tells how the points came about, if by default."""
    network = compile_network(feeder)
    source = feeder.source
    found: dict[str, Any] = {
        "feeder": feeder.name,
        "imported_from": feeder.imported_from,
        "kv_ll": source.kv_ll,
        "wires": source.wires,
        "neutral": source.neutral,
        "neutral_ohm": [source.neutral_ohm.real, source.neutral_ohm.imag],
        "line_km": float(network.length_km.sum()),
        "line_km_by_phases": _km_by_phases(network, network.length_km > 0),
        "load_kw": sum(load.kw for load in feeder.loads),
        "points": [point.name for point in feeder.points],
        "points_kv_ll": _kv_at_points(feeder, network),
        "points_neutral": _neutrals_at_points(feeder),
        "points_wires": _wires_at_points(feeder),
        "points_by_default": list(chosen),
        "sections": [],
        "loop": [switch.name for switch in feeder.switches if not switch.closed],
        "ders": [{"name": d.name, "kw": d.kw, "model": d.model} for d in feeder.ders],
        "capacitors": [
            {"name": c.name, "kvar": c.kvar, "connection": c.connection} for c in feeder.capacitors
        ],
        "regulators": [{"name": r.name, "taps": list(r.taps)} for r in feeder.regulators],
        "inline_transformers": [
            {"name": t.name, "connection": t.connection, "kv": [t.kv_from, t.kv_to]}
            for t in feeder.inline_transformers
        ],
        "values": count_origins(feeder),
        "assumed": [*_assumed(feeder), *_measured(study), *assumptions(feeder)],
    }
    if feeder.sections:
        points = find_points(feeder, network)
        for terminal in points.terminals[::2]:
            found["sections"].append(_section(feeder, network, terminal, study))
    return found


def _section(feeder: Feeder, network: Network, terminal: Terminal, study: Study) -> dict[str, Any]:
    """One section: its line, what hangs in it and beyond it."""
    inside = _inside(feeder, network, terminal)
    near = _kw_below(feeder, network, terminal, nearest=True)
    far = _kw_below(feeder, network, terminal, nearest=False)
    least, most = level_bounds(feeder, study).T
    units = [unit for unit in feeder.transformers if inside.holds(unit.place)]
    behind = {unit.name for unit in units}
    inline = [unit for unit in feeder.inline_transformers if inside.joins(unit)]
    earthed = wires_at_unknown(feeder) == 4

    def hanging(parts: Iterable[Load | Der]) -> list[str]:
        return [p.name for p in parts if p.transformer in behind or inside.holds(p.place)]

    return {
        "local": terminal.local,
        "remote": terminal.remote,
        "length_km": float(network.length_km[terminal.on_path].sum()),
        "line_z1_ohm": [terminal.line_z1_ohm.real, terminal.line_z1_ohm.imag],
        "laterals_km_by_phases": _km_by_phases(network, terminal.in_section & ~terminal.on_path),
        "downstream_kw": [float(far @ least), float(near @ most)],
        "downstream_kw_nominal": [float(far.sum()), float(near.sum())],
        "units": [unit.name for unit in units],
        "yg_d": [
            *(unit.name for unit in units if unit.connection == "Yg/D"),
            *(unit.name for unit in inline if unit.connection == "Yg/D"),
        ],
        "yg_d_sampled": [unit.name for unit in units if unit.name in study.transformers.yg_d],
        # without a neutral an unknown unit cannot be Yg
        "yg_d_unknown": [unit.name for unit in units if unit.connection == "unknown" and earthed],
        "loads": hanging(feeder.loads),
        "ders": hanging(feeder.ders),
        "capacitors": [bank.name for bank in feeder.capacitors if inside.holds(bank.place)],
        "inline_transformers": [unit.name for unit in inline],
        "shifted_by": [unit.name for unit in inline if unit.connection in SHIFTING],
        "regulators": [part.name for part in feeder.regulators if inside.joins(part)],
        "switches": [part.name for part in feeder.switches if part.closed and inside.joins(part)],
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class _Inside:
    """The lines and buses inside a section: the path, and laterals up to the next point."""

    lines: frozenset[str]
    buses: frozenset[str]
    ends: Mapping[str, tuple[str, str]]

    def holds(self, place: Place | None) -> bool:
        if place is None:
            return False
        if place.bus is not None:
            return place.bus in self.buses
        assert place.line is not None
        if place.at in (0.0, 1.0):
            return self.ends[place.line][int(place.at)] in self.buses
        return place.line in self.lines

    def joins(self, part: Switch | Regulator | InlineTransformer) -> bool:
        return {part.from_bus, part.to_bus} <= self.buses


def _inside(feeder: Feeder, network: Network, terminal: Terminal) -> _Inside:
    """Find what is inside; a bus is outside if a point measures what flows from it inwards."""
    pieces = [network.pieces[k] for k in np.flatnonzero(terminal.in_section)]
    ends = {line.name: (line.from_bus, line.to_bus) for line in feeder.lines}
    path = {p.line for k in np.flatnonzero(terminal.on_path) if (p := network.pieces[k])}
    lines = frozenset(p.line for p in pieces if p and p.line)
    outer = {
        p.bus
        for p in feeder.points
        if p.line in lines and (p.name in (terminal.local, terminal.remote) or p.line not in path)
    }
    touched = {bus for name in lines for bus in ends[name]}
    touched |= {bus for p in pieces if p and not p.line for bus in p.ends}
    return _Inside(lines=lines, buses=frozenset(touched - outer), ends=ends)


def _kv_at_points(feeder: Feeder, network: Network) -> list[float]:
    """Nominal voltages between phases at which points stand, rising."""
    volts = {network.node_v[network.node(point.bus)] for point in feeder.points}
    return sorted(round(float(v) * 3.0**0.5 / 1000.0, 6) for v in volts)


def _neutrals_at_points(feeder: Feeder) -> list[str]:
    """How the networks are earthed in which points stand, each way once."""
    earthings = bus_earthings(feeder)
    return sorted({earthings[point.bus] for point in feeder.points if point.bus in earthings})


def _wires_at_points(feeder: Feeder) -> list[int]:
    """How many wires there are where points stand, each number once."""
    neutral = bus_neutrals(feeder)
    return sorted({4 if neutral[p.bus] else 3 for p in feeder.points if p.bus in neutral})


def _km_by_phases(network: Network, chosen: NDArray[np.bool_]) -> list[float]:
    """Length of the chosen edges with one, two and three phases."""
    count = count_phases(network.tree.phases)
    return [float(network.length_km[chosen & (count == n)].sum()) for n in (1, 2, 3)]


def _kw_below(feeder: Feeder, network: Network, terminal: Terminal, *, nearest: bool) -> Real:
    """(L,) nominal kW of each load beyond the section's first edge, or beyond its last; else 0.

    Where loops are closed, that which the source reaches over the section alone.
    """
    path = [int(k) for k in np.flatnonzero(terminal.on_path)]
    below = network.below(min(path) if nearest else max(path))
    if network.chords:
        below = terminal.node_side == Side.DOWNSTREAM
        below |= nearest & (terminal.node_side == Side.LATERAL)
    loaded = below[network.load_node]
    return np.where(loaded, np.array([load.kw for load in feeder.loads]), 0.0)


def _assumed(feeder: Feeder) -> list[str]:
    """What the model takes for granted about this feeder."""
    applies = {
        "lines without a code are transposed": any(line.code is None for line in feeder.lines),
        "what hangs behind transformers is balanced": bool(feeder.transformers),
        "DER are balanced": bool(feeder.ders),
        "downstream kW: nominal times the study's load range, at the section's far and near end": (
            bool(feeder.sections)
        ),
    }
    said = [sentence for sentence, holds in applies.items() if holds]
    if any(unit.connection == "unknown" for unit in feeder.transformers):
        said.append(
            "transformers of unknown connection are drawn by a study; until then they count as "
            f"{assumed_connection(feeder)}"
        )
    if any(li.code is None and li.z0_ohm_per_km == li.z1_ohm_per_km for li in feeder.lines):
        said.append("some lines have z0 = z1 (given so): overhead lines have z0 ≈ 3 z1")
    return said


def _measured(study: Study) -> list[str]:
    """Where load was measured, and how far down it goes there."""
    levels = [
        f"{item.point} {item.level.support[0]:.3g} to {item.level.support[1]:.3g}"
        for item in study.measured
    ]
    return [f"level of the loads by what was measured at {', '.join(levels)}"] if levels else []


def _plot(feeder: Feeder, path: Path) -> None:
    # only a picture needs them
    from .show.feeder_plot import plot_feeder  # noqa: PLC0415
    from .show.figures import save_figure  # noqa: PLC0415

    if path == Path():  # --plot without a file
        path = Path(f"{feeder.name}.png")
    if path.suffix.lower() not in (".png", ".svg"):
        raise InputError.single("--plot", "", path.name, "must end in .png or .svg")
    figure = plot_feeder(feeder).get_figure()
    try:
        save_figure(figure, path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OpenPhaseError(f"{path}: the picture cannot be written: {reason}") from error
