"""What folding does to one feeder: its results beside those of the whole feeder, and the time."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..leaps import with_leaps
from ..network import Network, compile_network, locate
from ..parts import Feeder
from ..points import Points, find_points, into_line, point_probes
from ..solve import quiet_state, solve
from ..states import BY_LAW, NOT_CONVERGED, Answer, Probes, State
from .fold import Folded

__all__ = ["LEVEL_RANGE", "OWN_RANGE", "Measured", "Spread", "measure"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Int = NDArray[np.int64]

LEVEL_RANGE = (0.25, 1.0)
"""Level of all loads of a scenario, as a study draws it by default."""
OWN_RANGE = (0.8, 1.2)
"""Each load's own factor on it."""
LEAST_DI1_A = 0.1
"""Changes of the current below this are not compared: no setting is as low."""
ROUNDING = 1e-9
TURN = np.exp(2j * np.pi / 3.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Median, 95 % quantile and largest of some errors; ``count`` of them."""

    median: float
    most: float  #: of 95 %
    worst: float
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """Errors of a folded feeder over the load range, and how much faster it is solved."""

    scenarios: int
    levels: tuple[float, float]  #: of all loads of a scenario, least and most
    voltage_pu: Spread  #: |V - V_folded| at every phase of every bus that both have, no break
    z_op: Spread  #: |Z - Z_folded| over |Z|, eq. (5), of breaks inside the sections
    di1: Spread  #: |dI1 - dI1_folded| over |dI1| of the same
    not_converged: int  #: scenarios left out, of either feeder
    undefined: int  #: breaks left out for 0/0, or a change of current below 0.1 A
    per_s: tuple[float, float]  #: states solved in a second, whole and folded

    @property
    def speed_ratio(self) -> float:
        """How many times as fast the folded feeder is."""
        return self.per_s[1] / self.per_s[0]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Case:
    """One of the two feeders, ready to be solved."""

    network: Network
    merged: Network  #: without the buses that only pass current on, as a study solves it
    points: Points
    nodes: Int  #: of the buses that are compared


def measure(
    feeder: Feeder,
    folded: Folded,
    *,
    rng: np.random.Generator,
    scenarios: int = 400,
    levels: tuple[float, float] = LEVEL_RANGE,
) -> Measured:
    """Solve both feeders with the same loads, without a break and with one inside a section.

    Each break is of one phase, on any place of a section's path, its line as likely as it is
    long. Every load keeps its own law and draws its own factor.

    Raises
    ------
    InputError
        For a feeder without sections: there is nothing to measure at.
    """
    if not feeder.sections:
        raise InputError.single(
            feeder.name, "sections", "none", "must be there: errors are measured at their points"
        )
    cases = _cases(feeder, folded)
    names = [load.name for load in feeder.loads]
    level = rng.uniform(*levels, scenarios)
    scale = level * rng.uniform(*OWN_RANGE, (len(names), scenarios))
    breaks = _breaks(cases[0], rng, scenarios)
    found = [_solved(case, names, scale, breaks) for case in cases]
    converged = np.ones(scenarios, np.bool_)
    for result in found:
        converged &= result.converged
    gaps = np.abs(found[0].v_pu - found[1].v_pu)
    (z, di1), (z_folded, di1_folded) = (
        _impedance(case, each, breaks.terminal) for case, each in zip(cases, found, strict=True)
    )
    usable = converged & ~np.isnan(z) & ~np.isnan(z_folded) & (np.abs(di1) > LEAST_DI1_A)
    return Measured(
        scenarios=scenarios,
        levels=levels,
        voltage_pu=_spread(gaps[:, :, converged].ravel()),
        z_op=_spread(np.abs((z_folded - z)[usable]) / np.abs(z[usable])),
        di1=_spread(np.abs((di1_folded - di1)[usable]) / np.abs(di1[usable])),
        not_converged=int((~converged).sum()),
        undefined=int((converged & ~usable).sum()),
        per_s=(found[0].per_s, found[1].per_s),
    )


def _cases(feeder: Feeder, folded: Folded) -> list[_Case]:
    networks = [compile_network(each) for each in (feeder, folded.feeder)]
    both = [bus for bus in networks[0].nodes if bus in set(networks[1].nodes) & folded.kept]
    cases = []
    for each, network in zip((feeder, folded.feeder), networks, strict=True):
        points = find_points(each, network)
        index = {name: k for k, name in enumerate(network.nodes)}
        cases.append(
            _Case(
                network=network,
                merged=with_leaps(network, point_probes(points)),
                points=points,
                nodes=np.array([index[bus] for bus in both], np.int64),
            )
        )
    return cases


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Breaks:
    """Where the conductors break, and the terminal that is to see it."""

    terminal: Int
    places: Sequence[tuple[str, float]]  #: line, fraction
    phase: Int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Solved:
    """The states before and after the break."""

    v_pu: Complex  #: (nodes, 3, S) before the break
    answers: Sequence[Answer]  #: at the points
    converged: NDArray[np.bool_]
    per_s: float


def _breaks(case: _Case, rng: np.random.Generator, count: int) -> _Breaks:
    """One break for each scenario, the sections in turn."""
    facing = [n for n, terminal in enumerate(case.points.terminals) if not terminal.load_side]
    terminal = np.array(facing, np.int64)[np.arange(count) % len(facing)]
    share = rng.random(count)
    places = []
    for n in range(count):
        km = case.network.length_km * case.points.terminals[terminal[n]].on_path
        edge = int(rng.choice(km.size, p=km / km.sum()))
        places.append(case.network.line_fraction(edge, float(share[n])))
    return _Breaks(terminal=terminal, places=places, phase=rng.integers(0, 3, count))


def _solved(case: _Case, names: Sequence[str], scale: Real, breaks: _Breaks) -> _Solved:
    """Both states of every scenario."""
    network = case.network
    row = {name: n for n, name in enumerate(names)}
    own = np.ascontiguousarray(scale[[row[name] for name in network.loads]])
    before = quiet_state(network, own, np.full(own.shape, BY_LAW))
    sites = [locate(network, *place) for place in breaks.places]
    after = before._replace(
        edge=np.array([edge for edge, _ in sites], np.int64),
        share=np.array([share for _, share in sites]),
        open_mask=np.left_shift(1, breaks.phase),
    )
    nowhere = np.zeros(0, np.int64)
    everywhere = Probes(v_node=case.nodes, i_edge=nowhere, i_below=nowhere.astype(np.bool_))
    quiet = solve(network, before, everywhere)
    probes = point_probes(case.points)
    solve(case.merged, _first(before), probes)  # the first call may compile
    start = time.perf_counter()
    answers = [solve(case.merged, state, probes) for state in (before, after)]
    took = time.perf_counter() - start
    flags = quiet.flags | answers[0].flags | answers[1].flags
    return _Solved(
        v_pu=np.asarray(quiet.v / network.node_v[case.nodes][:, None, None]),
        answers=answers,
        converged=np.asarray(flags & NOT_CONVERGED == 0),
        per_s=2.0 * scale.shape[1] / took,
    )


def _first(state: State) -> State:
    """Its first scenario alone."""
    return State._make(np.ascontiguousarray(values[..., :1]) for values in state)


def _impedance(case: _Case, solved: _Solved, terminal: Int) -> tuple[Complex, Complex]:
    """(S,) equation (5) in the positive sequence at each scenario's terminal, and dI1 there.

    NaN where the denominator is nothing but rounding.
    """
    points = case.points
    weights = np.array([1.0, TURN, TURN**2]) / 3.0
    into = into_line(points)[:, None]
    v = [np.einsum("k,pks->ps", weights, a.v) for a in solved.answers]
    i = [into * np.einsum("k,pks->ps", weights, a.i) for a in solved.answers]
    scenario = np.arange(terminal.size)
    here = np.array([t.local_point for t in points.terminals])[terminal]
    there = np.array([t.remote_point for t in points.terminals])[terminal]
    sign = np.array([t.into for t in points.terminals])[terminal]
    v_here, i_here = v[1][here, scenario], sign * i[1][here, scenario]
    dv, dv_far = ((v[1] - v[0])[at, scenario] for at in (here, there))
    di = sign * (i[1] - i[0])[here, scenario]
    below = di * v_here - dv * i_here
    above = dv * v[1][there, scenario] - dv_far * v_here
    size = np.maximum(np.abs(dv * i_here), np.abs(di * v_here))
    z = np.full(terminal.size, np.nan, np.complex128)
    np.divide(above, below, out=z, where=np.abs(below) > ROUNDING * size)
    return z, di


def _spread(errors: Real) -> Spread:
    if not errors.size:
        return Spread(median=np.nan, most=np.nan, worst=np.nan, count=0)
    median, most = np.quantile(errors, (0.5, 0.95))
    return Spread(
        median=float(median), most=float(most), worst=float(errors.max()), count=errors.size
    )
