"""Our phasors and eq. (5) beside OpenDSS's, for every state of a reference.

Voltages are compared in pu of the bus's nominal phase voltage. What floats as a whole is
compared without its common mode, which nothing determines; a phase that floats beside others
that do not is left out. A pair is 0/0 where phasors as exact as OpenDSS's own do not determine
eq. (5): its condition number says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from opendss.as_dss import Cut
from opendss.galvanic import floating_nodes
from opendss.reference import OpenState, Pair, Reference

from openphase.model.buses import bus_volts
from openphase.model.network import Network, compile_network, locate
from openphase.model.parts import Feeder
from openphase.model.solve import quiet_state, solve
from openphase.model.states import NOT_CONVERGED, Probes

__all__ = ["EXACT", "Limits", "PairRow", "StateRow", "compare", "eq5", "limits_of"]

Complex = NDArray[np.complex128]

OWN_LAW = -1.0  #: as an exponent: the load varies by its own law
TURN = np.exp(2j * np.pi / 3.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What counts as agreement, and the relative exactness of OpenDSS's own phasors."""

    v_pu: float
    z_share: float
    z_ohm: float = 0.01
    phasor: float

    @property
    def condition(self) -> float:
        """A pair's largest condition number at which eq. (5) still tells something."""
        return self.z_share / self.phasor


EXACT = {
    "direct": Limits(v_pu=1e-4, z_share=0.005, phasor=1e-6),
    "snap": Limits(v_pu=1e-3, z_share=0.02, phasor=2e-5),
}
"""``direct``: what its anti-float shifts; ``snap``: what its tolerance of 1e-4 leaves over."""


def limits_of(mode: str) -> Limits:
    """The issue's tolerances of a mode."""
    return EXACT[mode]


@dataclass(frozen=True, slots=True, kw_only=True)
class StateRow:
    """How far off the voltages of one state are."""

    state: str
    worst_pu: float
    worst_bus: str
    worst_between_pu: float  #: the same without each bus's common mode
    compared: int  #: phases of buses
    without_common_mode: int
    left_out: int
    converged: bool  #: on both sides
    ours_flagged: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PairRow:
    """How far off eq. (5) of one pair is, in one break."""

    state: str
    pair: str
    ours_ohm: complex
    theirs_ohm: complex
    condition: float
    mode: str

    @property
    def off_ohm(self) -> float:
        """Absolute difference."""
        return abs(self.ours_ohm - self.theirs_ohm)

    @property
    def verdict(self) -> str:
        """``agrees``, ``0/0`` or ``misses``."""
        limits = limits_of(self.mode)
        if self.off_ohm <= max(limits.z_ohm, limits.z_share * abs(self.theirs_ohm)):
            return "agrees"
        return "0/0" if self.condition > limits.condition else "misses"


def compare(
    feeder: Feeder, reference: Reference, mode: str
) -> tuple[tuple[StateRow, ...], tuple[PairRow, ...]]:
    """Solve every state of one mode in one block, and hold it against the reference."""
    states = [state for state in reference.states if state.mode == mode]
    network = compile_network(feeder)
    cuts = [_cut(feeder, state) for state in states]
    v, current, flags = _solved(network, feeder, states, cuts, reference.pairs)
    volts = bus_volts(feeder)
    rows = []
    for s, state in enumerate(states):
        own = {bus: v[network.node(bus), :, s] for bus in state.volts}
        rows.append(_state_row(feeder, state, cuts[s], own, volts, int(flags[s])))
    pairs = []
    for s, state in enumerate(states):
        base = states.index(reference.base_of(state))
        if state.line is None or not (state.converged and states[base].converged):
            continue
        for p, pair in enumerate(reference.pairs):
            if pair.name in state.z1_ohm:
                here, there = network.node(pair.m), network.node(pair.n)
                ours, condition = eq5(*(x[:, [base, s]] for x in (v[here], v[there], current[p])))
                pairs.append(
                    PairRow(
                        state=state.name,
                        pair=pair.name,
                        ours_ohm=ours,
                        theirs_ohm=state.z1_ohm[pair.name],
                        condition=condition,
                        mode=mode,
                    )
                )
    return tuple(rows), tuple(pairs)


def _cut(feeder: Feeder, state: OpenState) -> Cut | None:
    if state.line is None or state.phase is None:
        return None
    line = next(line for line in feeder.lines if line.name == state.line)
    # a switch at the line's end has a bus of its own between; the other end tells
    at_end = line.to_bus == state.bus or (
        line.from_bus != state.bus and line.to_bus.startswith(f"{state.bus}_")
    )
    return Cut(line=line.name, at=1.0 if at_end else 0.0, phases=state.phase)


def _solved(
    network: Network,
    feeder: Feeder,
    states: Sequence[OpenState],
    cuts: Sequence[Cut | None],
    pairs: Sequence[Pair],
) -> tuple[Complex, Complex, NDArray[np.int64]]:
    """(nodes, 3, S) volts, (pairs, 3, S) amperes from m towards n, and flags."""
    count = len(states)
    scale = np.array([state.load for state in states])
    law = 2.0 if states[0].mode == "direct" else OWN_LAW
    state = quiet_state(
        network,
        np.repeat(scale[None, :], len(network.loads), axis=0),
        np.full((len(network.loads), count), law),
    )
    for s, cut in enumerate(cuts):
        if cut is not None:
            state.edge[s], state.share[s] = locate(network, cut.line, cut.at)
            state.open_mask[s] = 1 << "abc".index(cut.phases)
    ends = [_edge(network, pair) for pair in pairs]
    probes = Probes(
        v_node=np.arange(len(network.nodes), dtype=np.int64),
        i_edge=np.array([edge for edge, _ in ends], np.int64),
        i_below=np.array([below for _, below in ends], np.bool_),
    )
    answer = solve(network, state, probes)
    sign = np.array([-1.0 if below else 1.0 for _, below in ends])
    return answer.v, answer.i * sign[:, None, None], answer.flags


def _edge(network: Network, pair: Pair) -> tuple[int, bool]:
    """The edge that leaves m towards the next bus, and whether m is its lower end.

    A fuse or switch at the line's end may stand between, with a bus of its own.
    """
    ends = [set(piece.ends) if piece is not None else set() for piece in network.pieces]
    beside = {bus for pieces in ends if pair.towards in pieces for bus in pieces}
    for reached in ({pair.towards}, beside - {pair.m}):
        for k, piece in enumerate(network.pieces):
            if piece is not None and pair.m in ends[k] and ends[k] & reached:
                first = piece.ends[0] == pair.m
                return k, bool(first != network.upward[k])
    raise ValueError(f"nothing leads from {pair.m} to {pair.towards}")


def _state_row(
    feeder: Feeder,
    state: OpenState,
    cut: Cut | None,
    ours: dict[str, Complex],
    volts: dict[str, float],
    flags: int,
) -> StateRow:
    floating = floating_nodes(feeder, cut)
    compared = without = left_out = 0
    worst, worst_bus, between = 0.0, "", 0.0
    for bus, theirs in state.volts.items():
        parts = [floating.get((bus, phase)) for phase in "abc"]
        off = ours[bus] - np.array(theirs)
        there = np.array([part is None for part in parts])
        if not there.any() and len(set(parts)) == 1:
            off = off - off.mean()
            there[:] = True
            without += 3
        left_out += int((~there).sum())
        compared += int(there.sum())
        own = float(np.abs(off[there]).max(initial=0.0)) / volts[bus]
        if not own <= worst:
            worst, worst_bus = own, bus
        if there.all():
            between = max(between, float(np.abs(off - off.mean()).max()) / volts[bus])
    return StateRow(
        state=state.name,
        worst_pu=worst,
        worst_bus=worst_bus,
        worst_between_pu=between,
        compared=compared,
        without_common_mode=without,
        left_out=left_out,
        converged=state.converged and not flags & NOT_CONVERGED,
        ours_flagged=flags != 0,
    )


def _positive(abc: Complex) -> Complex:
    """Positive sequence of (3, 2) phasors, before and after."""
    return np.asarray((abc[0] + TURN * abc[1] + TURN**2 * abc[2]) / 3.0)


def eq5(v_m: Complex, v_n: Complex, i_m: Complex) -> tuple[complex, float]:
    """Equation (5) of the positive sequence, from (3, 2) phasors before and after.

    And how much it magnifies relative errors of these phasors, at worst: the products that
    numerator and denominator subtract, over what is left of them.
    """
    v_m, v_n, i_m = _positive(v_m), _positive(v_n), _positive(i_m)
    over = v_m[1] * v_n[0] - v_n[1] * v_m[0]
    under = i_m[1] * v_m[0] - v_m[1] * i_m[0]
    above = abs(v_m[1] * v_n[0]) + abs(v_n[1] * v_m[0])
    below = abs(i_m[1] * v_m[0]) + abs(v_m[1] * i_m[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        condition = 2.0 * (above / abs(over) + below / abs(under))
        return complex(over / under), float(condition)
