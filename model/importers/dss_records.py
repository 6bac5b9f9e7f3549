"""What an OpenDSS circuit is made of, as its file says: plain records, nothing interpreted.

A node is a conductor of a bus: 1, 2, 3 are the phases, 0 is earth, others are neutrals.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = [
    "End",
    "Matrix",
    "OtherElement",
    "RawCapacitor",
    "RawCircuit",
    "RawGuard",
    "RawLine",
    "RawLoad",
    "RawPlant",
    "RawReactor",
    "RawSource",
    "RawTapControl",
    "RawTransformer",
    "Winding",
]

Matrix = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class End:
    """A terminal: its bus and the node of each conductor."""

    bus: str
    nodes: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RawSource:
    """A Vsource: an EMF of ``pu`` x ``kv_ll`` behind sequence impedances."""

    name: str
    end: End
    earthed: bool  #: its other side
    sequence: str  #: ``pos``: a, b, c
    phases: int
    kv_ll: float
    pu: float
    angle_deg: float
    z1_ohm: complex
    z2_ohm: complex
    z0_ohm: complex


@dataclass(frozen=True, slots=True, kw_only=True)
class RawLine:
    """A line; its matrices are per unit of ``length``, that unit being ``unit_m`` metres."""

    name: str
    ends: tuple[End, End]
    r_ohm: Matrix
    x_ohm: Matrix
    c_nf: Matrix
    length: float
    unit_m: float | None  #: None: the file names no unit
    build: str | None  #: name of the line code or geometry
    is_switch: bool
    opened: tuple[tuple[bool, ...], tuple[bool, ...]]  #: conductors open at either end


@dataclass(frozen=True, slots=True, kw_only=True)
class Winding:
    """A winding of a transformer; voltage line to line where it has more than one phase."""

    end: End
    delta: bool
    kv: float
    kva: float
    r_pct: float
    tap: float
    tap_step: float
    most_taps: int
    neutral_ohm: complex | None  #: beside whatever the neutral's node joins; None: nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class RawTransformer:
    """A transformer; reactances between windings 1-2, 1-3, 2-3 in percent of winding 1's kVA."""

    name: str
    phases: int
    windings: tuple[Winding, ...]
    x_pct: tuple[float, float, float]
    imag_pct: float
    noload_pct: float
    euro: bool  #: the low voltage leads (LeadLag)
    bank: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RawLoad:
    """A load; ``kv`` line to line where it has more than one phase."""

    name: str
    end: End
    phases: int
    delta: bool
    kv: float
    kw: float
    kvar: float
    model: int
    cvr: tuple[float, float]
    zipv: tuple[float, ...]
    v_min_pu: float
    v_max_pu: float
    v_low_pu: float
    fixed: bool  #: no load multiplier applies
    neutral_earthed: bool = False  #: by an impedance of its own


@dataclass(frozen=True, slots=True, kw_only=True)
class RawCapacitor:
    """A capacitor bank in steps, from ``end`` to ``far``."""

    name: str
    end: End
    far: End
    phases: int
    delta: bool
    kv: float
    kvar: tuple[float, ...]
    states: tuple[int, ...]
    damped: bool  #: with R or XL in series


@dataclass(frozen=True, slots=True, kw_only=True)
class RawReactor:
    """A reactor from one end to another, its series impedance as a matrix."""

    name: str
    ends: tuple[End, End]
    delta: bool
    r_ohm: Matrix
    x_ohm: Matrix


@dataclass(frozen=True, slots=True, kw_only=True)
class RawPlant:
    """A generator, PV system or storage, with the power it delivers in the snapshot."""

    kind: str
    name: str
    end: End
    phases: int
    kw: float
    kvar: float
    model: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RawGuard:
    """A fuse, recloser, relay or switch control at a terminal of another element."""

    kind: str
    name: str
    element: str
    terminal: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RawTapControl:
    """A RegControl: which winding of which transformer it taps."""

    name: str
    transformer: str
    winding: int


@dataclass(frozen=True, slots=True, kw_only=True)
class OtherElement:
    """An element of a class that is not read further."""

    kind: str
    name: str
    ends: tuple[End, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RawCircuit:
    """Everything enabled in a circuit, buses and names in lower case."""

    name: str
    frequency_hz: float
    load_mult: float
    sources: tuple[RawSource, ...]
    lines: tuple[RawLine, ...]
    transformers: tuple[RawTransformer, ...]
    loads: tuple[RawLoad, ...]
    capacitors: tuple[RawCapacitor, ...]
    reactors: tuple[RawReactor, ...]
    plants: tuple[RawPlant, ...]
    guards: tuple[RawGuard, ...]
    tap_controls: tuple[RawTapControl, ...]
    cap_controls: tuple[str, ...]  #: names alone
    others: tuple[OtherElement, ...]
    disabled: int
    opened: tuple[tuple[str, bool], ...] = ()  #: elements but lines, and whether all of each is
    coordinates: tuple[tuple[str, float, float], ...] = ()
