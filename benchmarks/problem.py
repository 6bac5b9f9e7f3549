"""What every engine of the comparison is given: broken conductors on the paper's feeder.

Loads are constant impedance and windings as in the file, so that one circuit serves all
scenarios. A transformer with its balanced load is then a shunt with one admittance in
sequences 1 and 2 and another in sequence 0; peers get these two numbers ready-made.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from openphase.model import load_feeder
from openphase.model.distributions import Fixed
from openphase.model.network import Network
from openphase.model.points import point_probes
from openphase.model.solve import all_probes, solve
from openphase.model.solver.bank import D_YG, YG_D
from openphase.model.states import Probes, State
from openphase.studies.run.classes import DrawClass, Purpose
from openphase.studies.run.draw import BlockId, Case, draw_scenarios, make_case
from openphase.studies.spec.study_file import Study, default_study

__all__ = [
    "Complex",
    "Problem",
    "draw_problem",
    "first",
    "paper_case",
    "pick",
    "shunts_of",
    "volts",
]

Complex = NDArray[np.complex128]
Int = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Problem:
    """S scenarios on B nodes with U units, sorted by the edge that breaks."""

    network: Network
    probes: Probes  #: the measuring points: all that the detector looks at
    before: State
    after: State
    shunt_s: tuple[Complex, Complex]  #: before, after: (U, 2, S), sequence 0 and sequences 1, 2
    v: tuple[Complex, Complex]  #: the product's answer: (B, 3, S)
    sound: NDArray[np.bool_]  #: (S,) no conductor is left connected to nothing

    @property
    def parts(self) -> tuple[tuple[State, Complex], tuple[State, Complex]]:
        """State and shunts, before and after."""
        return (self.before, self.shunt_s[0]), (self.after, self.shunt_s[1])


def paper_case(sampled: bool) -> Case:
    """The shipped feeder and its study, as it is or with constant-impedance loads."""
    study = default_study("paper")
    return make_case(load_feeder("paper"), study if sampled else _constant_impedance(study))


def _constant_impedance(study: Study) -> Study:
    two = Fixed(value=2.0)
    step = replace(study.events.load_step, exponent=two)
    return replace(
        study,
        loads=replace(study.loads, exponent=two, exponent_spread=0.0),
        events=replace(study.events, load_step=step),
    )


def draw_problem(size: int) -> Problem:
    """Draw ``size`` scenarios and solve them with the product."""
    case = paper_case(sampled=False)
    case = replace(case, yg_d_units=case.yg_d_units[:0])  # windings as in the file
    which = BlockId(
        seed=1, purpose=Purpose.VALIDATE, attempt=1, drawn=DrawClass.OPEN_PHASE, block=0
    )
    drawn = draw_scenarios(case, which, size)
    order = np.argsort(drawn.event.edge, kind="stable")
    before, after = (pick(state, order) for state in (drawn.before, drawn.after))
    everywhere = all_probes(case.network)
    answers = [solve(case.network, state, everywhere) for state in (before, after)]
    return Problem(
        network=case.network,
        probes=point_probes(case.points),
        before=before,
        after=after,
        shunt_s=(
            shunts_of(case.network, before.load_scale),
            shunts_of(case.network, after.load_scale),
        ),
        v=(answers[0].v, answers[1].v),
        sound=answers[1].flags == 0,
    )


def first(problem: Problem, count: int) -> Problem:
    """About ``count`` scenarios, spread evenly over the problem's."""
    size = problem.sound.size
    chosen = np.arange(0, size, max(size // count, 1))
    return replace(
        problem,
        before=pick(problem.before, chosen),
        after=pick(problem.after, chosen),
        shunt_s=(problem.shunt_s[0][..., chosen], problem.shunt_s[1][..., chosen]),
        v=(problem.v[0][..., chosen], problem.v[1][..., chosen]),
        sound=problem.sound[chosen],
    )


def pick(state: State, chosen: Int | slice) -> State:
    """The chosen scenarios of a state."""
    parts: list[Any] = [np.ascontiguousarray(values[..., chosen]) for values in state]
    return State(*parts)


def shunts_of(network: Network, load_scale: NDArray[np.float64]) -> Complex:
    """(U, 2, S): every unit with its load as admittances of sequence 0, and of 1 and 2."""
    tree = network.tree
    load_s = np.zeros((len(network.units), load_scale.shape[1]), np.complex128)
    np.add.at(load_s, tree.load_unit, tree.load_y_s[:, None] * load_scale)
    out = np.empty((load_s.shape[0], 2, load_s.shape[1]), np.complex128)
    for unit, y in enumerate(load_s):
        zh, zl, y0 = tree.unit_zh_ohm[unit], tree.unit_zl_ohm[unit], tree.unit_y0_s[unit]
        out[unit, 1] = y / (1.0 + (zh + zl) * y)
        connection = network.connection[unit]
        if connection == D_YG:
            out[unit, 0] = 0.0
        elif connection == YG_D:
            out[unit, 0] = 1.0 / (zh + zl)
        else:
            middle = y0 + y / (1.0 + zl * y)
            out[unit, 0] = middle / (1.0 + zh * middle)
    return out


def volts(network: Network) -> Complex:
    """(3,) the EMF at 1 pu, in volts."""
    out: Complex = network.tree.v_nominal_v * np.exp(-2j * np.pi / 3 * np.arange(3))
    return out
