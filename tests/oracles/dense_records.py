"""What the dense reference is asked, and what it answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from oracles.dense_groups import Complex, Floats
from oracles.dense_parts import Kept

from openphase.model.parts import Place

__all__ = ["DenseSolution", "Event", "Shunt"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Shunt:
    """An admittance at the event: from a phase to earth, or to another phase.

    ``where``: the from-side stub p, the to-side stub q, or the far place.
    """

    where: Literal["p", "q", "far"]
    phase: int
    other: int | None = None
    siemens: complex
    exponent: float = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """What is other than normal in the state that is solved; the defaults are nothing.

    A tee at exactly the fraction of a break hangs on the from-bus side, with
    ``before_tees`` on the to-bus side; a step load hangs on the from-bus side.

    Parameters
    ----------
    open_line, open_fraction, open_phases
        Conductors (0..2) broken at that fraction of the line, counted from its from-bus.
        The line is cut there even where no phase is open: its stubs are nodes, and its
        charging is shared between the parts.
    step_line, step_fraction, step_kw, step_phases, step_exponent
        Grounded-wye load of unity power factor; ``step_kw`` is the total at nominal
        voltage and is shared equally among the phases.
    shunts, far
        What is connected at the stubs and at a second place besides.
    emf_scale
        Factor on the source's EMF.
    taps, ders
        By regulator: factors on the ratio of the three phases. By DER: factor on what it
        delivers after the event; 0: tripped.
    """

    open_line: str | None = None
    open_fraction: float = 0.5
    open_phases: tuple[int, ...] = ()
    before_tees: bool = False
    step_line: str | None = None
    step_fraction: float = 0.5
    step_kw: float = 0.0
    step_phases: tuple[int, ...] = (0, 1, 2)
    step_exponent: float = 2.0
    shunts: tuple[Shunt, ...] = ()
    far: Place | None = None
    emf_scale: float = 1.0
    taps: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    ders: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DenseSolution:
    """Phasors of one state; every array has shape (3,), volts to earth or amperes.

    Parameters
    ----------
    v
        Voltage of each bus; of a detached line end as ``"<line>@<bus>"``.
    stubs
        Voltage of ``"<line>.p"`` and ``"<line>.q"``: from-bus and to-bus side of the break.
    lv
        LV terminal voltages of each transformer (their sum is zero behind a D winding).
    i_from, i_to
        Current INTO each line at its from and to end, the charging there included.
    i_switch
        Current through each switch and regulator, from its from-bus to its to-bus (of a
        regulator, on the to-side).
    i_into, i_out
        Of each regulator and in-line transformer: what it takes at its from-bus, and gives at
        its to-bus.
    i_source
        Current out of the source.
    floating
        (key of ``v`` or ``stubs``, phase) of voltages that the circuit does not determine.
    loose
        By key of ``v`` or ``stubs``: (3, n) directions in which they may move together.
    absent
        (key of ``v`` or ``stubs``, phase) of conductors that are not there, at 0 V.
    load_pu
        Voltage magnitudes on which loads, motors and DER depend, pu, by group.
    load_va, source_va, loss_va, charging_va
        Power taken by each load, motor (``NAME.motor``), DER (``NAME.der``), capacitor
        (``NAME.capacitor``), step load (``step``) and shunt (``shunt N``); given by the EMF;
        lost in the source's impedance and neutral, lines, regulators and transformers; taken by
        the lines' charging.
    kept
        By DER: positive-sequence winding voltage and the current fed in there.
    iterations
        Linear solutions that were needed.
    """

    v: dict[str, Complex]
    stubs: dict[str, Complex]
    lv: dict[str, Complex]
    i_from: dict[str, Complex]
    i_to: dict[str, Complex]
    i_switch: dict[str, Complex]
    i_into: dict[str, Complex]
    i_out: dict[str, Complex]
    i_source: Complex
    floating: set[tuple[str, int]]
    loose: dict[str, Complex]
    absent: set[tuple[str, int]]
    load_pu: dict[str, Floats]
    load_va: dict[str, complex]
    source_va: complex
    loss_va: complex
    charging_va: complex
    kept: dict[str, Kept]
    iterations: int
