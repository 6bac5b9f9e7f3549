"""Lines and series reactors of an OpenDSS circuit, reduced to the phases that are fed."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from statistics import median

import numpy as np
from numpy.typing import NDArray

from ..reactors import REACTOR
from .dss_live import Node
from .dss_records import Matrix, RawCircuit, RawLine, RawReactor
from .findings import Fate, Findings

__all__ = ["Span", "is_series", "merged", "spans_of"]

Real = NDArray[np.float64]

_SHORT_KM = 0.001
"""Length given to what has none: a switch, a jumper, a reactor."""

_USUAL_OHM_PER_KM = 0.5
"""Where |Z1| of most lines lies; it tells the unit of lengths that name none."""

_UNITS_KM = {"mi": 1.609344, "kft": 0.3048, "km": 1.0, "m": 0.001, "ft": 0.0003048}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Span:
    """A line's live conductors, with the matrices of the whole length."""

    name: str
    buses: tuple[str, str]
    nodes: tuple[int, ...]
    length_km: float
    r_ohm: Real
    x_ohm: Real
    c_nf: Real
    build: str | None
    opened: tuple[tuple[int, ...], tuple[int, ...]] = ((), ())  #: nodes open at either end
    also: tuple[str, ...] = field(default=())  #: lines of other phases that it took in


def spans_of(circuit: RawCircuit, live: set[Node], findings: Findings) -> list[Span]:
    """Return every line and series reactor that is fed."""
    coded = _usual_unit([line for line in circuit.lines if line.build], findings)
    own = _usual_unit([line for line in circuit.lines if not line.build], findings)
    found = [_span(line, coded if line.build else own, live, findings) for line in circuit.lines]
    found += [
        _reactor_span(reactor, live, findings) for reactor in filter(is_series, circuit.reactors)
    ]
    return [span for span in found if span is not None]


def is_series(reactor: RawReactor) -> bool:
    """Tell whether a reactor joins two buses."""
    near, far = reactor.ends
    return far.bus not in ("", near.bus) and any(node > 0 for node in far.nodes)


def _usual_unit(lines: Sequence[RawLine], findings: Findings) -> float:
    """Return the km of a unit of length where the file names none, by usual impedances."""
    ohms = []
    for line in lines:
        if line.unit_m is None and not line.is_switch:
            z = np.array(line.r_ohm) + 1j * np.array(line.x_ohm)
            count = len(z)
            mutual = (z.sum() - z.trace()) / (count * (count - 1)) if count > 1 else 0.0
            ohms.append(abs(z.trace() / count - mutual))
    if not ohms or median(ohms) <= 0.0:
        return _SHORT_KM
    middle = median(ohms)
    unit = min(
        _UNITS_KM, key=lambda name: abs(math.log(middle / _UNITS_KM[name] / _USUAL_OHM_PER_KM))
    )
    findings.note(
        f"{len(ohms)} lines have a length without a unit: taken as {unit}, which makes their "
        f"median |Z1| {middle / _UNITS_KM[unit]:.3g} ohm/km; impedances do not depend on it"
    )
    return _UNITS_KM[unit]


def _span(line: RawLine, unit_km: float, live: set[Node], findings: Findings) -> Span | None:
    """Return a line's live part, or nothing where there is none or it is refused."""
    near, far = line.ends
    kept: list[int] = []
    neutral: list[int] = []
    for n, pair in enumerate(zip(near.nodes, far.nodes, strict=True)):
        if all(node in (1, 2, 3) for node in pair):
            kept.append(n)
        else:
            neutral.append(n)
    pairs = [(near.nodes[n], far.nodes[n]) for n in kept]
    if any(a != b for a, b in pairs):
        why = f"its conductors change phase, from {near.nodes} to {far.nodes}"
        findings.add("line", line.name, "refused", why)
        return None
    if len({a for a, _ in pairs}) < len(pairs):
        findings.add("line", line.name, "refused", "two of its conductors are one phase")
        return None
    if near.bus == far.bus:
        findings.add("line", line.name, "approximated", "left out: both ends at one bus")
        return None
    if not kept:
        findings.add("line", line.name, "refused", "it has neutral conductors alone")
        return None
    fed = [n for n in kept if all((end.bus, near.nodes[n]) in live for end in line.ends)]
    opened = tuple(tuple(near.nodes[n] for n in fed if line.opened[end][n]) for end in (0, 1))
    if not fed or all(len(nodes) == len(fed) for nodes in opened):
        findings.add("line", line.name, "not fed")
        return None
    cut = [n for n in neutral if line.opened[0][n] or line.opened[1][n]]
    findings.add("line", line.name, *_fate(line, kept, fed, neutral, cut))
    length = line.length * line.unit_m / 1000.0 if line.unit_m else line.length * unit_km
    if not line.unit_m and line.is_switch:
        length = _SHORT_KM
    z = (np.array(line.r_ohm) + 1j * np.array(line.x_ohm)) * line.length
    # a neutral conductor that is open carries nothing
    z = _kron(z, [n for n in neutral if n not in cut], kept)
    pick = np.ix_([kept.index(n) for n in fed], [kept.index(n) for n in fed])
    return Span(
        name=line.name,
        buses=(near.bus, far.bus),
        nodes=tuple(near.nodes[n] for n in fed),
        length_km=length if length > 0.0 else _SHORT_KM,
        r_ohm=z.real[pick],
        x_ohm=z.imag[pick],
        c_nf=(np.array(line.c_nf) * line.length)[np.ix_(fed, fed)],
        build=line.build,
        opened=(opened[0], opened[1]),
    )


def _fate(
    line: RawLine,
    kept: Sequence[int],
    fed: Sequence[int],
    neutral: Sequence[int],
    cut: Sequence[int],
) -> tuple[Fate, str]:
    """Say what became of a line that is there."""
    how = []
    if cut:
        how.append("its neutral conductor is open: left out")
    elif neutral and any(node > 3 for end in line.ends for node in end.nodes):
        how.append("its neutral conductor is reduced, taken as earthed at both ends")
    if len(fed) < len(kept):
        how.append("without the phases that nothing feeds")
    return ("approximated", "; ".join(how)) if how else ("as it is", "")


def _kron(
    z: NDArray[np.complex128], neutral: Sequence[int], kept: Sequence[int]
) -> NDArray[np.complex128]:
    """Return the impedance of what is kept beside conductors that are earthed at both ends."""
    if not neutral:
        return np.asarray(z[np.ix_(kept, kept)])
    across = z[np.ix_(kept, neutral)]
    return z[np.ix_(kept, kept)] - across @ np.linalg.solve(z[np.ix_(neutral, neutral)], across.T)


def _reactor_span(reactor: RawReactor, live: set[Node], findings: Findings) -> Span | None:
    """Return a reactor between two buses as a short line."""
    near, far = reactor.ends
    name = f"{REACTOR}{reactor.name}"
    if near.nodes != far.nodes or reactor.delta or not set(near.nodes) <= {1, 2, 3}:
        findings.add("reactor", reactor.name, "refused", "it joins different phases")
        return None
    fed = [n for n, node in enumerate(near.nodes) if (near.bus, node) in live]
    if not fed:
        findings.add("reactor", reactor.name, "not fed")
        return None
    findings.add("reactor", reactor.name, "as it is", "a line of 1 m")
    pick = np.ix_(fed, fed)
    return Span(
        name=name,
        buses=(near.bus, far.bus),
        nodes=tuple(near.nodes[n] for n in fed),
        length_km=_SHORT_KM,
        r_ohm=np.array(reactor.r_ohm)[pick],
        x_ohm=np.array(reactor.x_ohm)[pick],
        c_nf=np.zeros((len(fed), len(fed))),
        build=None,
    )


def merged(spans: Sequence[Span], alone: Collection[str], findings: Findings) -> list[Span]:
    """Make one line of those that join the same two buses with different phases.

    Parameters
    ----------
    alone
        Lines that something stands in, which stay as they are.
    """
    beside: defaultdict[frozenset[str], list[Span]] = defaultdict(list)
    for span in spans:
        beside[frozenset(span.buses)].append(span)
    found: list[Span] = []
    for group in beside.values():
        taken = [node for span in group for node in span.nodes]
        free = all(not any(span.opened) and span.name not in alone for span in group)
        if len(group) > 1 and free and len(set(taken)) == len(taken):
            found.append(_joined(group))
            names = ", ".join(span.name for span in group)
            findings.note(f"lines {names} became one line: different phases between the same buses")
        else:
            found += group
    return found


def _joined(group: Sequence[Span]) -> Span:
    """Return one line with the conductors of all, nothing between those of different lines."""
    return Span(
        name=group[0].name,
        buses=group[0].buses,
        nodes=tuple(node for span in group for node in span.nodes),
        length_km=max(span.length_km for span in group),
        r_ohm=_blocks([span.r_ohm for span in group]),
        x_ohm=_blocks([span.x_ohm for span in group]),
        c_nf=_blocks([span.c_nf for span in group]),
        build=None,
        also=tuple(span.name for span in group[1:]),
    )


def _blocks(matrices: Sequence[Real]) -> Real:
    size = sum(len(matrix) for matrix in matrices)
    joined, start = np.zeros((size, size)), 0
    for matrix in matrices:
        joined[start : start + len(matrix), start : start + len(matrix)] = matrix
        start += len(matrix)
    return joined


def rows_per_km(matrix: Real, length_km: float) -> Matrix:
    """Return a matrix per km, its digits cut so that equal builds come out equal."""
    return tuple(
        tuple(0.0 if value == 0.0 else float(f"{value / length_km:.12g}") for value in row)
        for row in ((matrix + matrix.T) / 2.0).tolist()
    )
