"""One feeder, intact and cut open, solved by us and by the engine on the same day."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from opendss.as_dss import Cut, as_dss, joined_buses, node_name
from opendss.engine import direct_voltages

from openphase.model.buses import bus_phases, bus_volts
from openphase.model.network import compile_network, locate
from openphase.model.parts import Feeder
from openphase.model.solve import quiet_state, solve

__all__ = ["Agreement", "agreement", "our_voltages"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """How one state came out on both sides."""

    worst_pu: float
    worst_node: str
    compared: int
    floating: int  #: nodes that the engine's matrix does not determine
    flags: int  #: ours


def our_voltages(
    feeder: Feeder, cuts: list[Cut | None]
) -> tuple[dict[str, NDArray[np.complex128]], NDArray[np.int64]]:
    """(3, S) volts of every bus, and flags, each scenario with its cut."""
    network = compile_network(feeder)
    count = len(cuts)
    loads = len(network.loads)
    state = quiet_state(network, np.ones((loads, count)), np.full((loads, count), 2.0))
    for s, cut in enumerate(cuts):
        if cut is not None:
            state.edge[s], state.share[s] = locate(network, cut.line, cut.at)
            state.open_mask[s] = sum(1 << "abc".index(phase) for phase in cut.phases)
    answer = solve(network, state)
    return dict(zip(network.nodes, answer.v, strict=True)), answer.flags


def agreement(engine: Any, feeder: Feeder, cuts: list[Cut | None]) -> list[Agreement]:
    """The largest difference in every state, of the bus's nominal voltage to earth."""
    ours, flags = our_voltages(feeder, cuts)
    volts, masks = bus_volts(feeder), bus_phases(feeder)
    alias = _aliases(feeder)
    rows = []
    for s, cut in enumerate(cuts):
        theirs, floating = direct_voltages(engine, partial(as_dss, feeder, cut))
        worst, worst_node, compared, left_out = 0.0, "", 0, 0
        for bus, mask in masks.items():
            for row, phase in enumerate("abc"):
                node = node_name(alias.get(bus, bus), phase)
                if not mask >> row & 1 or node not in theirs:
                    continue
                if node in floating:
                    left_out += 1
                    continue
                compared += 1
                off = abs(ours[bus][row, s] - theirs[node]) / volts[bus]
                if not off <= worst:
                    worst, worst_node = float(off), node
        rows.append(
            Agreement(
                worst_pu=worst,
                worst_node=worst_node,
                compared=compared,
                floating=left_out,
                flags=int(flags[s]),
            )
        )
    return rows


def _aliases(feeder: Feeder) -> dict[str, str]:
    """The bus whose name stands for several that closed switches join."""
    bus_of = joined_buses(feeder)
    return {bus: bus_of(bus) for s in feeder.switches for bus in (s.from_bus, s.to_bus)}
