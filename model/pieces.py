"""Lines cut where something stands, and the tree that these pieces and all else form."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .inline import bank_admittance, mask_of
from .line_matrices import shunt_nf_per_km, z_ohm_per_km
from .parts import (
    Capacitor,
    Der,
    Feeder,
    InlineTransformer,
    Line,
    LineCode,
    Load,
    Place,
    Regulator,
    Switch,
    Transformer,
)
from .phases import conductors, phase_mask

__all__ = [
    "ALL_PHASES",
    "NO_PHASES",
    "Piece",
    "Span",
    "check_fed",
    "detached_end",
    "node_name",
    "pieces_of",
    "place_of",
    "span",
]

ALL_PHASES = 0b111
NO_PHASES: NDArray[np.complex128] = np.zeros((3, 3), np.complex128)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Piece:
    """A stretch of line between two nodes; a closed switch, a regulator or a bank elsewhere."""

    line: str | None
    regulator: str | None = None
    bank: str | None = None  #: the first of its in-line transformers
    ends: tuple[str, str]  #: node names, in the direction of the line or other part
    phases: tuple[int, int] = (0b111, 0b111)  #: masks of the conductors at either end
    start: float  #: fraction of the line at the first end
    stop: float  #: and at the second
    length_km: float
    z_ohm: NDArray[np.complex128]  #: (3, 3)
    end_y_s: NDArray[np.complex128]  #: (3, 3) half of the charging
    bank_s: NDArray[np.complex128] | None = None  #: (6, 6) admittance of a bank
    has_drop: bool = False  #: of a regulator: it has impedance

    @property
    def is_switch(self) -> bool:
        """Whether nothing but a closed switch joins the ends."""
        return self.line is None and self.regulator is None and self.bank is None

    @property
    def is_bare(self) -> bool:
        """Whether nothing lies between the ends that a voltage could drop at."""
        return self.line is None and self.bank is None and not self.has_drop

    @property
    def label(self) -> str:
        """As messages call it."""
        kind = "switch" if self.is_switch else "regulator" if self.regulator else "transformer"
        name = self.line or self.regulator or self.bank
        return f"{kind} '{name}'" if name else f"the {kind} '{self.ends[0]}'–'{self.ends[1]}'"

    @property
    def key(self) -> tuple[str | None, tuple[str, str]]:
        """What tells this piece from all others, in whichever state the network is."""
        return self.line or self.bank or self.regulator, self.ends


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """A spanning tree of a network, and what closes its loops."""

    order: list[str]  #: node names, parents before children
    parent_piece: dict[str, int]  #: the piece between each node and its parent
    chords: tuple[Piece, ...]
    forks: tuple[str, ...]  #: upper node of each chord, an ancestor of its tail
    tails: tuple[str, ...]


def check_fed(feeder: Feeder, pieces: list[Piece], order: list[str]) -> None:
    """Every bus hangs on the source, one way or another."""
    parts: list[Line | Switch | Regulator | InlineTransformer]
    parts = [*feeder.lines, *feeder.switches, *feeder.regulators, *feeder.inline_transformers]
    buses = {bus for part in parts for bus in (part.from_bus, part.to_bus)}
    apart = (buses | {end for piece in pieces for end in piece.ends}) - set(order)
    if apart:
        names = ", ".join(repr(name) for name in sorted(apart))
        raise InputError.single(
            feeder.name,
            "network",
            names if len(names) < 60 else f"{len(apart)} buses apart",
            f"must be connected with '{feeder.source.bus}' in every state of the switches",
        )


def detached_end(point: str) -> str:
    """Name of the line end behind a measuring point's open recloser."""
    return f"{point}:open"


def _tee(line: str, fraction: float) -> str:
    # no name may hold a colon, so no bus is called like a tee
    return f"{line}:{fraction!r}"


def node_name(feeder: Feeder, place: Place) -> str:
    """The node of a place: its bus, or its tee; the ends of a line are buses."""
    if place.bus is not None:
        return place.bus
    assert place.line is not None
    assert place.at is not None
    line = next(item for item in feeder.lines if item.name == place.line)
    if place.at == 0.0:
        return line.from_bus
    if place.at == 1.0:
        return line.to_bus
    return _tee(place.line, place.at)


def place_of(part: Transformer | Load | Der | Capacitor) -> Place:
    """Where a part hangs that hangs on the feeder itself."""
    assert part.place is not None
    return part.place


def _places(feeder: Feeder) -> list[Place]:
    loose: list[Load | Der | Capacitor] = [*feeder.loads, *feeder.ders, *feeder.capacitors]
    own = [part.place for part in loose if part.place is not None]
    return [t.place for t in feeder.transformers] + own


def pieces_of(feeder: Feeder, closed: frozenset[str], opened: frozenset[str]) -> list[Piece]:
    """All stretches of line, then the closed switches, the regulators and the banks."""
    cuts: dict[str, set[float]] = defaultdict(set)
    for place in _places(feeder):
        if place.line is not None and place.at is not None:
            cuts[place.line].add(place.at)
    omega = 2.0 * np.pi * feeder.source.frequency_hz
    codes = {code.name: code for code in feeder.codes}
    behind: dict[str, dict[str, str]] = defaultdict(dict)
    for point in feeder.points:
        if point.name in opened:
            behind[point.line][point.bus] = point.name
    pieces = []
    for line in feeder.lines:
        pieces += _cut(line, codes, cuts[line.name], behind[line.name], omega)
    joining: list[Regulator | Switch] = [s for s in feeder.switches if s.name in closed]
    for part in [*joining, *feeder.regulators]:
        mask = phase_mask(conductors(part) if isinstance(part, Regulator) else part.phases)
        name = part.name if isinstance(part, Regulator) else None
        ends = (part.from_bus, part.to_bus)
        drop = isinstance(part, Regulator) and _drops(part)
        pieces.append(_without_length(ends, (mask, mask), regulator=name, has_drop=drop))
    return pieces + _banks(feeder)


def _drops(regulator: Regulator) -> bool:
    """Whether all its conductors have impedance, that which goes through included."""
    through = regulator.reference in ("a", "b", "c")
    return regulator.z_ohm != 0.0 and (regulator.jumper_ohm != 0.0 or not through)


def _without_length(
    ends: tuple[str, str],
    phases: tuple[int, int],
    *,
    regulator: str | None = None,
    bank: str | None = None,
    bank_s: NDArray[np.complex128] | None = None,
    has_drop: bool = False,
) -> Piece:
    return Piece(
        line=None,
        regulator=regulator,
        bank=bank,
        ends=ends,
        phases=phases,
        start=0.0,
        stop=1.0,
        length_km=0.0,
        z_ohm=NO_PHASES,
        end_y_s=NO_PHASES,
        bank_s=bank_s,
        has_drop=has_drop,
    )


def _banks(feeder: Feeder) -> list[Piece]:
    """In-line transformers; those between the same two buses are one bank."""
    together: dict[frozenset[str], list[InlineTransformer]] = defaultdict(list)
    for unit in feeder.inline_transformers:
        together[frozenset((unit.from_bus, unit.to_bus))].append(unit)
    pieces = []
    for units in together.values():
        ends = (units[0].from_bus, units[0].to_bus)
        pieces.append(
            _without_length(
                ends,
                (mask_of(units, ends[0]), mask_of(units, ends[1])),
                bank=units[0].name,
                bank_s=bank_admittance(units, ends),
            )
        )
    return pieces


def _cut(
    line: Line,
    codes: dict[str, LineCode],
    at: set[float],
    detached: dict[str, str],
    omega: float,
) -> list[Piece]:
    """The line between its tees; ``detached``: ends that an open recloser keeps from the bus."""
    fractions = sorted({0.0, 1.0, *at})
    ends = [
        detached_end(detached[bus]) if bus in detached else bus
        for bus in (line.from_bus, line.to_bus)
    ]
    names = [ends[0], *(_tee(line.name, x) for x in fractions[1:-1]), ends[1]]
    code = None if line.code is None else codes[line.code]
    whole = line.length_km * z_ohm_per_km(line, code)
    farad = 0.5e-9 * line.length_km * shunt_nf_per_km(line, code)
    half = np.asarray(1j * omega * farad, np.complex128)
    mask = phase_mask(line.phases)
    return [
        Piece(
            line=line.name,
            ends=(names[n], names[n + 1]),
            phases=(mask, mask),
            start=fractions[n],
            stop=fractions[n + 1],
            length_km=line.length_km * (fractions[n + 1] - fractions[n]),
            z_ohm=whole * (fractions[n + 1] - fractions[n]),
            end_y_s=half * (fractions[n + 1] - fractions[n]),
        )
        for n in range(len(names) - 1)
    ]


def span(feeder: Feeder, pieces: list[Piece]) -> Span:
    """Span the network by a tree; what is left over, with impedance, are the chords.

    Depth-first, so that every chord joins a node to an ancestor of its own, its fork.
    """
    order, parent_piece, left = _walk(feeder.source.bus, pieces, {})
    place = {name: k for k, name in enumerate(order)}
    forks = {n: min(pieces[n].ends, key=place.__getitem__) for n in left}
    if any(pieces[n].is_bare for n in left):
        # Buses that closed switches join have one voltage: all stand for the first one reached,
        # and a loop of switches alone needs no chord.
        together = _joined(pieces)
        order, parent_piece, left = _walk(feeder.source.bus, pieces, together)
        forks = _forks(pieces, order, left, together)
    bare = [pieces[n] for n in forks if pieces[n].is_bare]
    if bare:
        raise InputError.single(
            feeder.name,
            f"the loop over {bare[0].label}",
            "no impedance where the loop closes",
            "must close over a line, a transformer or a regulator with `z_ohm`",
        )
    chords = sorted(forks)
    place = {name: k for k, name in enumerate(order)}
    tails = [max(pieces[n].ends, key=place.__getitem__) for n in chords]
    return Span(
        order=order,
        parent_piece=parent_piece,
        chords=tuple(pieces[n] for n in chords),
        forks=tuple(forks[n] for n in chords),
        tails=tuple(tails),
    )


def _joined(pieces: list[Piece]) -> dict[str, list[str]]:
    """Every bus that closed three-phase switches join to others, and all of these."""
    together: dict[str, list[str]] = {}
    for piece in pieces:
        if piece.is_switch and piece.phases[0] == ALL_PHASES:
            one, other = (together.get(end, [end]) for end in piece.ends)
            if one is not other:
                both = [*one, *other]
                together |= dict.fromkeys(both, both)
    return together


def _forks(
    pieces: list[Piece],
    order: list[str],
    left: list[int],
    together: dict[str, list[str]],
) -> dict[int, str]:
    """The fork of every piece left over, but for switches that close a loop of switches."""
    place = {name: k for k, name in enumerate(order)}
    forks = {}
    for n in left:
        upper, lower = sorted(pieces[n].ends, key=place.__getitem__)
        group = together.get(upper, [upper])
        if pieces[n].is_switch and lower in group:
            continue
        forks[n] = min(group, key=place.__getitem__)
    return forks


def _other(piece: Piece, end: str) -> str:
    return piece.ends[0] if piece.ends[1] == end else piece.ends[1]


def _walk(
    root: str, pieces: list[Piece], together: dict[str, list[str]]
) -> tuple[list[str], dict[str, int], list[int]]:
    """Depth-first walk; returns order, parent pieces, and pieces to known nodes left over.

    Buses that are ``together`` are entered one straight after the other, and what has no
    impedance is walked before lines are.
    """
    touching: dict[str, list[int]] = defaultdict(list)
    ranks = list(range(len(pieces)))
    if together:
        ranks.sort(key=lambda n: (not pieces[n].is_bare, pieces[n].line is not None, n))
    for n in ranks:
        for end in pieces[n].ends:
            touching[end].append(n)
    order: list[str] = []
    parent_piece: dict[str, int] = {}
    used: set[int] = set()
    left: list[int] = []
    stack: list[tuple[str, int]] = [(root, -1)]
    while stack:
        name, came = stack.pop()
        if came in used:
            continue
        if came >= 0:
            used.add(came)
        if name in parent_piece or (order and name == root):
            left.append(came)
            continue
        order.append(name)
        if came >= 0:
            parent_piece[name] = came
        entered = [name]
        if name in together:
            entered = _enter(name, pieces, touching, parent_piece, used, set(together[name]))
            order += entered[1:]
        for member in reversed(entered):
            for n in reversed(touching[member]):
                if n not in used:
                    stack.append((_other(pieces[n], member), n))
    return order, parent_piece, left


def _enter(
    name: str,
    pieces: list[Piece],
    touching: dict[str, list[int]],
    parent_piece: dict[str, int],
    used: set[int],
    members: set[str],
) -> list[str]:
    """All buses joined to ``name`` by switches, each after the one that it hangs on."""
    entered = [name]
    for member in entered:
        for n in touching[member]:
            far = _other(pieces[n], member)
            joins = pieces[n].is_switch and pieces[n].phases[0] == ALL_PHASES
            if joins and n not in used and far in members and far not in entered:
                used.add(n)
                parent_piece[far] = n
                entered.append(far)
    return entered
