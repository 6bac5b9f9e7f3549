"""The paper's simulations as this model solves them: variants of its feeder, an event each.

Steady states only: one before the event and one after it, without noise. Transients are not
modelled. Each variant changes one thing of the shipped feeder, and its name says which.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from ...detector.criteria import Reason, Settings, verdict
from ...detector.evidence import Phasors, evidence_of
from ...detector.impedance import connection_impedance
from ...detector.superimpose import superimposed
from ...model.errors import OpenPhaseError
from ...model.line_matrices import z1_ohm
from ...model.machine_state import carried_over
from ...model.network import compile_network, locate
from ...model.parts import Der, DerModel, Feeder, Line
from ...model.points import Points, Terminal, find_points, into_line, point_probes
from ...model.solve import solve, steady_state
from ...model.states import NOT_CONVERGED
from ...model.symmetrical import to_sequences

__all__ = [
    "BREAK_AT",
    "BROKEN_LINE",
    "PV_KW",
    "Case",
    "Part",
    "ideal_banks",
    "line_ohm",
    "open_phase_a",
    "pv_impedance",
    "unit_at",
    "with_pv",
    "yg_d",
    "z0_factor",
]

Complex = NDArray[np.complex128]
Int = NDArray[np.int64]

Part = Literal["0", "1", "2", "a", "b", "c"]
"""A symmetrical component, or a phase."""

BROKEN_LINE, BREAK_AT = "R2-R3", 0.6
PHASE_A = 0b001
PV_KW = 700.0
PV_RANGE_OHM = (1.0, 100.0)  #: sought in; from a twentieth to half of the PV's rated impedance


# ---- variants of the feeder ----


def yg_d(feeder: Feeder, *names: str) -> Feeder:
    """These transformers connected Yg/Δ; rating, load and place stay, X0 goes."""
    units = tuple(
        replace(unit, connection="Yg/D", x0_pu=None) if unit.name in names else unit
        for unit in feeder.transformers
    )
    return replace(feeder, transformers=units)


def ideal_banks(feeder: Feeder) -> Feeder:
    """Yg/Yg units without the zero-sequence path of a three-limb core."""
    units = tuple(replace(unit, x0_pu=None) for unit in feeder.transformers)
    return replace(feeder, transformers=units)


def unit_at(feeder: Feeder, name: str, at: float) -> Feeder:
    """One transformer moved along its line."""
    units = tuple(
        replace(unit, place=replace(unit.place, at=at)) if unit.name == name else unit
        for unit in feeder.transformers
    )
    return replace(feeder, transformers=units)


def z0_factor(feeder: Feeder, factor: float) -> Feeder:
    """Lines whose zero-sequence impedance is ``factor`` times their positive one."""
    lines = tuple(
        replace(x, z0_ohm_per_km=factor * z1_ohm(feeder, x) / x.length_km) for x in feeder.lines
    )
    return replace(feeder, lines=lines)


def line_ohm(feeder: Feeder, name: str, ohm: float) -> Feeder:
    """One line with another total |Z1|, at its own angle, and Z0 in proportion."""

    def scaled(line: Line) -> Line:
        assert line.z1_ohm_per_km is not None
        assert line.z0_ohm_per_km is not None
        factor = ohm / (abs(line.z1_ohm_per_km) * line.length_km)
        return replace(
            line,
            z1_ohm_per_km=line.z1_ohm_per_km * factor,
            z0_ohm_per_km=line.z0_ohm_per_km * factor,
        )

    lines = tuple(scaled(line) if line.name == name else line for line in feeder.lines)
    return replace(feeder, lines=lines)


# ---- one event, and what the measuring points report of it ----


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """One event: what perfect instruments at the points report before it and after it."""

    points: Points
    phasors: Phasors  #: one scenario
    v_nominal_v: float

    def v(self, point: str, part: Part) -> Complex:
        """(2,) volts to earth at a point, before and after."""
        return _part(self.phasors.v, part)[:, self.points.names.index(point), 0]

    def i(self, point: str, part: Part) -> Complex:
        """(2,) amperes positive into the point's line, before and after."""
        return _part(self.phasors.i, part)[:, self.points.names.index(point), 0]

    def di_a(self, point: str, part: Part) -> float:
        """|ΔI|, the size of the change of the phasor."""
        before, after = self.i(point, part)
        return float(abs(after - before))

    def dv_pct(self, point: str, part: Part) -> float:
        """|ΔV| in % of nominal phase voltage."""
        before, after = self.v(point, part)
        return float(100.0 * abs(after - before) / self.v_nominal_v)

    def terminal(self, local: str, remote: str) -> Terminal:
        """The terminal at ``local`` that looks at ``remote``."""
        pair = (local, remote)
        return next(t for t in self.points.terminals if (t.local, t.remote) == pair)

    def z_ohm(self, local: str, remote: str, part: Part = "1") -> complex:
        """Equation (5), in one sequence or one phase; 0 where it has no value."""
        last = np.ones(1, np.int64)
        return complex(self.z_between(local, remote, part, last, 0 * last)[0])

    def z_between(self, local: str, remote: str, part: Part, now: Int, earlier: Int) -> Complex:
        """Equation (5) from frames ``now`` and ``earlier``: arrays of 0 (before), 1 (after)."""
        at = self.terminal(local, remote)
        v_m, v_n = self.v(local, part), self.v(remote, part)
        i_m = at.into * self.i(local, part)
        z, _ = connection_impedance(
            v_m[now],
            v_n[now],
            i_m[now],
            *(superimposed(x[now], x[earlier]) for x in (v_m, v_n, i_m)),
        )
        return z

    def said(self, local: str, remote: str, settings: Settings) -> str:
        """What one terminal says with these settings: ``trip``, or the criterion that fails."""
        ends = (self.terminal(local, remote),)
        seen = evidence_of(self.phasors, ends, self.v_nominal_v, settings.options)
        reason = Reason(int(verdict(seen, settings)[0, 0]))
        return "trip" if reason == Reason.TRIP else f"no: {reason.name.lower().replace('_', ' ')}"


def _part(abc: Complex, part: Part) -> Complex:
    """One sequence or phase of (2, P, 3, S) phase quantities."""
    if part in "abc":
        return abc[:, :, "abc".index(part)]
    return to_sequences(abc, axis=2)[:, :, int(part)]


def open_phase_a(
    feeder: Feeder, *, tie_closed: bool = False, line: str = BROKEN_LINE, at: float = BREAK_AT
) -> Case:
    """Phase a breaks; the paper's place by default."""
    closed = frozenset(switch.name for switch in feeder.switches) if tie_closed else None
    network = compile_network(feeder, closed)
    points = find_points(feeder, network)
    probes = point_probes(points)
    edge, share = locate(network, line, at)
    before = steady_state(network)._replace(edge=np.array([edge]), share=np.array([share]))
    whole = solve(network, before, probes)
    after = before._replace(open_mask=np.array([PHASE_A]))
    after = carried_over(network, before, whole, after, np.ones((len(feeder.ders), 1)))
    broken = solve(network, after, probes, start=whole.winding_v_pu)
    if (whole.flags[0] | broken.flags[0]) & NOT_CONVERGED:
        raise OpenPhaseError(f"{feeder.name}: loads or generation did not settle")
    into = into_line(points)[:, None, None]
    return Case(
        points=points,
        phasors=Phasors(
            v=np.stack([whole.v, broken.v]), i=np.stack([whole.i * into, broken.i * into])
        ),
        v_nominal_v=network.tree.v_nominal_v,
    )


# ---- the PV system, of which the paper says no more than kW and place ----


def with_pv(feeder: Feeder, model: DerModel, z1_ohm: complex | None = None) -> Feeder:
    """The feeder with the paper's PV system behind T6; no path for the other sequences."""
    pv = Der(
        name="PV",
        transformer="T6",
        place=None,
        kw=PV_KW,
        power_factor=1.0,
        model=model,
        z1_ohm=z1_ohm,
        z2_ohm=None,
        z0_ohm=None,
    )
    return replace(feeder, ders=(pv,))


def pv_impedance(feeder: Feeder, degrees: float, wanted_ohm: float) -> complex:
    """Z_pv of this angle, behind which a constant EMF shows ``wanted_ohm`` as |Z1| at R2."""
    turn = np.exp(1j * np.radians(degrees))

    def gap(size_ohm: float) -> float:
        case = open_phase_a(with_pv(feeder, "thevenin", size_ohm * turn))
        return abs(case.z_ohm("R2", "R3")) - wanted_ohm

    return complex(turn * brentq(gap, *PV_RANGE_OHM))
