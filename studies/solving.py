"""``openphase solve``: one break, the phasors before and after, and what each terminal says."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..detector.criteria import Options, Reason, Settings, reach_of, verdict
from ..detector.evidence import Evidence, Phasors, evidence_of, only
from ..model.after import solve_after
from ..model.errors import Fault, InputError, OpenPhaseError, Report
from ..model.network import Network, compile_network, locate
from ..model.parts import Feeder
from ..model.points import Points, find_points, into_line
from ..model.reading.fields import did_you_mean
from ..model.sides import edge_nodes
from ..model.solve import solve, steady_state
from ..model.solver.breaks import DEAD, FLOATING, UNDEFINED
from ..model.states import NOT_CONVERGED, UNEARTHED, Answer
from .loading import load_with_points
from .run.store import as_json
from .settings_file import read_settings
from .show.solve_text import solve_text

__all__ = ["Break", "parse_break", "solve_break", "solve_command"]

Complex = NDArray[np.complex128]
T = TypeVar("T")

#: without a sheet, every terminal has the paper's settings
NOTHING_A = 1e-9  #: a change of current below it is rounding, and shows no impedance
DEFAULTS = Settings(i_set_a=1.0, v_set_pu=0.05, z_set_ohm=5.0)

PHASES = "abc"
FLAGS = {"dead": DEAD, "floating": FLOATING, "unearthed": UNEARTHED}


@dataclass(frozen=True, slots=True, kw_only=True)
class Break:
    """A broken conductor: ``fraction`` from the line's from-end, ``phases`` 0, 1, 2."""

    line: str
    fraction: float
    phases: tuple[int, ...]


def solve_command(args: argparse.Namespace) -> int:
    """Run the verb; returns the exit code."""
    feeder, chosen = load_with_points(args.feeder)
    for text in chosen:
        print(f"{feeder.name}: {text}", file=sys.stderr)
    broken, closed, settings = _read_all(args, feeder)
    print("solving; the solver is compiled at first use …", file=sys.stderr, flush=True)
    answer = solve_break(feeder, broken, closed, settings)
    phases = "".join(PHASES[a] for a in broken.phases)
    title = f"{feeder.name}: phase {phases} open at {broken.fraction:g} of {broken.line}"
    print(as_json(answer) if args.json else solve_text(title, answer), end="")
    return 0


def _read_all(
    args: argparse.Namespace, feeder: Feeder
) -> tuple[Break, frozenset[str], dict[tuple[str, str], Settings | None] | None]:
    """Break, closed switches and settings; the faults of all three at once."""
    faults: list[Fault] = []

    def read(reader: Callable[[], T]) -> T | None:
        try:
            return reader()
        except InputError as error:
            faults.extend(error.faults)
            return None

    broken = read(lambda: parse_break(args.open, feeder))
    closed = read(lambda: _closed(args.close, feeder))
    sheet = read(lambda: read_settings(args.settings, feeder)) if args.settings else None
    if faults or broken is None or closed is None:
        raise InputError(faults)
    return broken, closed, sheet


def _one_of(what: str, name: str, known: list[str], feeder: Feeder) -> str:
    """The rule that a name breaks, with what it could be."""
    names = f": {', '.join(known)}" if len(known) <= 12 else ""
    return f"must be a {what} of '{feeder.name}'{names}{did_you_mean(name, known)}"


def parse_break(text: str, feeder: Feeder) -> Break:
    """Read ``LINE:FRACTION:PHASES``, such as ``R2-R3:0.6:a``; all faults at once."""
    report = Report(source="--open", document={})
    parts = text.rsplit(":", 2)
    if len(parts) != 3:
        raise InputError.single("--open", "", text, "must read LINE:FRACTION:PHASES")
    line, fraction_text, phases = parts
    names = [item.name for item in feeder.lines]
    if line not in names:
        report.add(("line",), _one_of("line", line, names, feeder), line)
    try:
        fraction = float(fraction_text)
    except ValueError:
        fraction = float("nan")
    if not 0.0 <= fraction <= 1.0:
        report.add(("fraction",), "must be a number in 0..1", fraction_text)
    letters = phases.lower()
    there = next((item.phases for item in feeder.lines if item.name == line), PHASES)
    if not letters or len(set(letters)) != len(letters) or set(letters) - set(PHASES):
        report.add(("phases",), "must be one, two or three of a, b, c", phases)
    elif set(letters) - set(there):
        report.add(("phases",), f"must be of those that the line has: {', '.join(there)}", phases)
    report.raise_if_any()
    return Break(
        line=line, fraction=fraction, phases=tuple(sorted(PHASES.index(x) for x in letters))
    )


def _closed(names: list[str], feeder: Feeder) -> frozenset[str]:
    """Switches that are closed: normally, or named by the user."""
    known = [switch.name for switch in feeder.switches]
    report = Report(source="--close", document={})
    for name in names:
        if name not in known:
            report.add(("name",), _one_of("switch", name, known, feeder), name)
    report.raise_if_any()
    return frozenset(s.name for s in feeder.switches if s.closed) | frozenset(names)


def solve_break(
    feeder: Feeder,
    broken: Break,
    closed: frozenset[str],
    settings: dict[tuple[str, str], Settings | None] | None = None,
) -> dict[str, Any]:
    """Phasors before and after the break and each terminal's view, without any noise.

    DER keep what they had before the break, or all trip where that leaves one of them above
    its voltage, as in every study.

    Returns what ``solve --json`` prints: volts to earth and amperes positive into the
    line, complex numbers as [re, im], null where a conductor floats.
    """
    network = compile_network(feeder, closed)
    edge, share = locate(network, broken.line, broken.fraction)
    intact = steady_state(network)._replace(edge=np.array([edge]), share=np.array([share]))
    before = solve(network, intact)
    opened = intact._replace(open_mask=np.array([sum(1 << a for a in broken.phases)]))
    after = solve_after(network, (intact, before), opened, (np.ones((len(feeder.ders), 1)), None))
    if (before.flags[0] | after.flags[0]) & NOT_CONVERGED:
        raise OpenPhaseError(f"{feeder.name}: loads or generation did not settle")
    if not all(np.isfinite(part).all() for part in (before.v, before.i, after.v, after.i)):
        raise OpenPhaseError(f"{feeder.name}: no finite solution; look for absurd values")
    lost = _lost_phases(broken, int(after.flags[0]))
    dark = network.below(edge)
    buses = {}
    at_tees = {piece.ends[1] for piece in network.pieces if piece and piece.stop < 1.0}
    for node, name in enumerate(network.nodes):
        if name in at_tees:
            continue
        absent = _absent(int(network.node_phases[node]))
        buses[name] = {
            "before": _pairs(before.v[node, :, 0], absent),
            "after": _pairs(after.v[node, :, 0], (*absent, *(lost if dark[node] else ()))),
            "v_nominal_v": float(network.node_v[node]),
        }
    absent = _absent(int(network.tree.phases[edge]))
    v_line = float(network.node_v[edge_nodes(network)[1][edge]])
    upper, lower = _stub_names(feeder, network, edge, broken)
    for n, name in ((0, upper), (1, lower)):
        buses[name] = {
            "before": _pairs(before.stub[n, :, 0], absent),
            "after": _pairs(after.stub[n, :, 0], (*absent, *(lost if n else ()))),
            "v_nominal_v": v_line,
        }
    edges = _edges_by_line(network)
    lines = {
        line.name: {
            "before": _line_currents(network, before, edges[line.name]),
            "after": _line_currents(network, after, edges[line.name]),
        }
        for line in feeder.lines
    }
    flags = int(before.flags[0] | after.flags[0])
    return {
        "buses": buses,
        "lines": lines,
        "flags": [name for name, bit in FLAGS.items() if flags & bit],
        "sections": _sections(feeder, network, (before, after), settings),
    }


def _absent(mask: int) -> tuple[int, ...]:
    """Phases that a mask does not have."""
    return tuple(phase for phase in range(3) if not mask >> phase & 1)


def _edges_by_line(network: Network) -> dict[str, tuple[int, int]]:
    """Each line's edges at its from-end and at its to-end."""
    found: dict[str, list[tuple[float, int]]] = {}
    for k, piece in enumerate(network.pieces):
        if piece is not None and piece.line is not None:
            found.setdefault(piece.line, []).append((piece.start, k))
    return {line: (min(own)[1], max(own)[1]) for line, own in found.items()}


def _lost_phases(broken: Break, flags: int) -> tuple[int, ...]:
    """Opened phases that have no voltage of their own beyond the break."""
    if flags & FLOATING and len(broken.phases) == 3:
        return broken.phases
    return tuple(a for a in broken.phases if flags & (UNDEFINED << a))


def _stub_names(feeder: Feeder, network: Network, edge: int, broken: Break) -> tuple[str, str]:
    """Names of the solver's upper and lower stub: p is the upstream one in the normal state."""
    normal = compile_network(feeder)
    usual, _ = locate(normal, broken.line, broken.fraction)
    p, q = f"{broken.line}.p", f"{broken.line}.q"
    return (p, q) if normal.upward[usual] == network.upward[edge] else (q, p)


def _pair(value: complex) -> list[float]:
    return [float(value.real), float(value.imag)]


def _pairs(abc: Complex, lost: tuple[int, ...] = ()) -> list[list[float] | None]:
    return [None if phase in lost else _pair(value) for phase, value in enumerate(abc)]


def _line_currents(network: Network, answer: Answer, ends: tuple[int, int]) -> dict[str, Any]:
    """Amperes into a line at both ends, whose edges are given."""
    first, last = ends
    absent = _absent(int(network.tree.phases[first]))
    # probes: edge k's upper end at 2k, its lower end at 2k + 1, both positive downwards
    start = answer.i[2 * first + (0 if network.upward[first] else 1), :, 0]
    stop = answer.i[2 * last + (1 if network.upward[last] else 0), :, 0]
    return {
        "from_end": _pairs(start if network.upward[first] else -start, absent),
        "to_end": _pairs(-stop if network.upward[last] else stop, absent),
    }


def _phasors(points: Points, frames: tuple[Answer, Answer]) -> Phasors:
    """What perfect instruments at the points report."""
    place = 2 * points.edge + points.below  # as all_probes looks: upper end, then lower end
    into = into_line(points)[:, None, None]
    return Phasors(
        v=np.stack([frame.v[points.node] for frame in frames]),
        i=np.stack([frame.i[place] * into for frame in frames]),
    )


def _sections(
    feeder: Feeder,
    network: Network,
    frames: tuple[Answer, Answer],
    settings: dict[tuple[str, str], Settings | None] | None,
) -> list[dict[str, Any]]:
    """Each terminal's evidence, verdict and reason."""
    if not feeder.sections:
        return []
    points = find_points(feeder, network)
    if settings is None:
        settings = {(t.local, t.remote): DEFAULTS for t in points.terminals}
    judged = [own.options for own in settings.values() if own is not None]
    shown = Options(fallback=True, compensated=True)
    evidence = evidence_of(
        _phasors(points, frames), points.terminals, points.v_nominal_v, shown, *judged
    )
    rows = []
    for t, terminal in enumerate(points.terminals):
        seen = only(evidence, t)
        assert seen.di_star_a is not None  # it is shown, and so was asked for
        undefined = seen.undefined[0, :, 0] | (seen.di_a[0, :, 0] < NOTHING_A)
        impedances = [
            None if none else _pair(z)
            for z, none in zip(seen.z_ohm[0, :, 0], undefined, strict=True)
        ]
        trip, reason = _judged(seen, settings.get((terminal.local, terminal.remote)))
        rows.append(
            {
                "local": terminal.local,
                "remote": terminal.remote,
                "di1_a": float(seen.di1_a[0, 0]),
                "di1_star_a": float(seen.di_star_a[0, 0, 0]),
                "dv1_pu": float(seen.dv1_pu[0, 0]),
                "z1_ohm": impedances[0],
                "zabc_ohm": impedances[1:],
                "di_abc_a": seen.di_a[0, 1:, 0].tolist(),
                "trip": trip,
                "reason": reason,
            }
        )
    return rows


def _judged(seen: Evidence, own: Settings | None) -> tuple[bool, str]:
    """Whether a terminal trips with its setting, and why."""
    if own is None:
        return False, "no setting in the sheet"
    reason = Reason(int(verdict(seen, own)[0, 0]))
    if reason != Reason.TRIP:
        return False, reason.text
    idle = reach_of(seen, own.options).di_a[0, 0, 0] < own.i_set_a
    return True, "trip: a phase, |ΔI1| being below I_set" if idle else reason.text
