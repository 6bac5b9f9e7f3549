"""Any event on a feeder, solved before and after: what tests of limits keep doing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from oracles.scenes import Pair, Scene, change, scene

from openphase.detector.criteria import Options, Reason, Settings, verdict
from openphase.detector.evidence import Evidence, Phasors, evidence_of
from openphase.model import load_feeder
from openphase.model.events.base import apply_event, no_event
from openphase.model.machine_state import carried_over
from openphase.model.network import locate
from openphase.model.parts import Der, DerModel, Feeder
from openphase.model.points import into_line
from openphase.model.solve import solve
from openphase.model.states import NOT_CONVERGED, Answer

__all__ = [
    "ALL",
    "ANY_SEQUENCE",
    "FALLBACK",
    "ONE",
    "PAPER",
    "TWO",
    "Seen",
    "happen",
    "scene_of",
    "seen",
    "three_phase_s",
    "with_pv",
]

Complex = NDArray[np.complex128]

#: by the positive sequence alone
PAPER = Settings(i_set_a=1.0, v_set_pu=0.05, z_set_ohm=5.0, options=Options(fallback=False))
FALLBACK = replace(PAPER, options=Options())
ANY_SEQUENCE = replace(PAPER, options=Options(fallback=False, any_sequence=True))

#: phases open, as a mask of each scenario
ONE, TWO, ALL = np.array([0b001]), np.array([0b011]), np.array([0b111])


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What one terminal sees of one event, without noise."""

    z_ohm: complex  #: eq. (5) in positive sequence
    evidence: Evidence
    pair: Pair

    @property
    def z(self) -> tuple[float, float]:
        """Magnitude, and angle in degrees."""
        return abs(self.z_ohm), float(np.degrees(np.angle(self.z_ohm)))

    @property
    def di1_a(self) -> float:
        return float(self.evidence.di1_a[0, 0])

    @property
    def dv1_pu(self) -> float:
        return float(self.evidence.dv1_pu[0, 0])

    def says(self, settings: Settings) -> Reason:
        return Reason(int(verdict(self.evidence, settings)[0, 0]))

    @property
    def reason(self) -> Reason:
        """With the paper's settings, by the positive sequence."""
        return self.says(PAPER)

    @property
    def with_phases(self) -> Reason:
        """With the paper's settings, where phases stand in."""
        return self.says(FALLBACK)


def three_phase_s(at: Scene, kw: float) -> Complex:
    """(3, 1) siemens per phase of a balanced load that takes ``kw`` at nominal voltage."""
    return np.full((3, 1), kw * 1e3 / 3.0 / at.network.tree.v_nominal_v**2, np.complex128)


def happen(
    at: Scene,
    line: str | None = None,
    fraction: float = 0.0,
    **event: Any,
) -> tuple[Answer, Answer]:
    """The answers before and after; fields of `Event` as keywords, one scenario."""
    own = replace(no_event(at.network, 1), **event)
    if line is not None:
        edge, share = locate(at.network, line, fraction)
        own = replace(own, edge=np.array([edge]), share=np.array([share]))
    before, after = apply_event(at.network, at.steady, at.steady, own)
    first = solve(at.network, before)
    after = carried_over(at.network, before, first, after, own.der_factor)
    then = solve(at.network, after, start=first.winding_v_pu)
    assert not (first.flags[0] | then.flags[0]) & NOT_CONVERGED
    return first, then


def seen(at: Scene, frames: tuple[Answer, Answer], local: str = "R2", remote: str = "R3") -> Seen:
    """What the terminal at ``local`` sees, and what it says with the paper's settings."""
    terminal = at.terminal(local, remote)
    pair = change(at, terminal, *frames)
    into = into_line(at.points)[:, None, None]
    place = 2 * at.points.edge + at.points.below
    phasors = Phasors(
        v=np.stack([frame.v[at.points.node] for frame in frames]),
        i=np.stack([frame.i[place] * into for frame in frames]),
    )
    v_nominal_v = at.network.tree.v_nominal_v
    asked = (PAPER.options, FALLBACK.options, ANY_SEQUENCE.options)
    return Seen(
        z_ohm=complex(pair.z()[0]),
        evidence=evidence_of(phasors, (terminal,), v_nominal_v, *asked),
        pair=pair,
    )


def scene_of(feeder: Feeder, *, tie_closed: bool = False) -> Scene:
    """The paper's feeder, or one like it, with its tie open or closed."""
    return scene(feeder, frozenset({"R4"}) if tie_closed else None)


def with_pv(model: DerModel, kw: float = 700.0, z1_ohm: complex | None = None) -> Feeder:
    """The paper's feeder with generation behind T6, which has no other sequences."""
    pv = Der(
        name="PV",
        transformer="T6",
        place=None,
        kw=kw,
        power_factor=1.0,
        model=model,
        z1_ohm=z1_ohm,
        z2_ohm=None,
        z0_ohm=None,
    )
    return replace(load_feeder("paper"), ders=(pv,))
