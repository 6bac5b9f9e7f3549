"""A small feeder with everything that an event may touch, on four wires, on three, and looped.

    S - A =REG= A2 - B - C =OLD= C2 - D - - - E
    |                |                  tie   |
    |                L                        |
    +------------------------------------------+

Every line is a region of its own. OLD is a regulator that is fed from its to-end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from openphase.model.events.base import Event, Places, apply_event, places_on
from openphase.model.machine_state import carried_over
from openphase.model.network import Network, compile_network
from openphase.model.parts import (
    Der,
    Feeder,
    Line,
    Load,
    Place,
    Regulator,
    Source,
    Switch,
    Transformer,
)
from openphase.model.solve import solve, steady_state
from openphase.model.states import Answer

__all__ = ["LINES", "Site", "make", "site_of", "watched", "without_regulators"]

LINES = {
    "SA": ("S", "A", 2.0),
    "A2B": ("A2", "B", 3.0),
    "BC": ("B", "C", 1.0),
    "BL": ("B", "L", 2.5),
    "C2D": ("C2", "D", 1.5),
    "SE": ("S", "E", 4.0),
}


@dataclass(frozen=True, slots=True, eq=False)
class Site:
    """A feeder, compiled in one state of its tie."""

    feeder: Feeder
    network: Network
    lines: Places
    regions: tuple[Places, ...]

    def at(self, event: Event, s: int) -> Place:
        """Where the event of scenario ``s`` stands."""
        name, fraction = self.network.line_fraction(int(event.edge[s]), float(event.share[s]))
        return Place(line=name, at=fraction)

    def answers(self, event: Event) -> tuple[Answer, Answer]:
        """The file's own state before the event, and after it."""
        network, size = self.network, event.edge.size
        quiet = steady_state(network, size)
        first, second = apply_event(network, quiet, quiet, event)
        before = solve(network, first)
        return before, solve(
            network, carried_over(network, first, before, second, event.der_factor)
        )

    def watch(self, answer: Answer, s: int) -> NDArray[np.complex128]:
        """Every bus's voltages and the currents into every line, of one scenario."""
        return watched(self.network, answer, s)


def watched(network: Network, answer: Answer, s: int = 0) -> NDArray[np.complex128]:
    """(buses + lines, 3): what does not depend on where a network's lines are cut."""
    v = [answer.v[network.node(bus), :, s] for bus in ("S", "A", "B", "C", "D", "E", "L")]
    currents = []
    for line in LINES:
        edge = network.edges_of(line)[0]
        from_end = 2 * edge + (0 if network.upward[edge] else 1)
        currents.append(answer.i[from_end, :, s])
    return np.array([*v, *currents])


def site_of(feeder: Feeder, closed: Sequence[str] = ()) -> Site:
    """``feeder``, compiled with the switches ``closed``."""
    network = compile_network(feeder, frozenset(closed))
    regions = tuple(
        places_on(network, np.array([p is not None and p.line == name for p in network.pieces]))
        for name in LINES
    )
    return Site(feeder, network, places_on(network), regions)


def make(wires: int) -> Feeder:
    """The feeder, with a neutral (4) or without (3)."""
    grounded = "wye" if wires == 4 else "delta"
    z = {"z1_ohm": 0.2 + 0.9j, "z2_ohm": 0.2 + 0.9j, "z0_ohm": 0.3 + 1.5j}
    return Feeder(
        name="events",
        source=Source(bus="S", kv_ll=12.0, emf_pu=1.02, frequency_hz=60.0, wires=wires, **z),
        lines=tuple(
            Line(
                name=name,
                from_bus=start,
                to_bus=end,
                length_km=km,
                z1_ohm_per_km=0.1 + 0.3j,
                z0_ohm_per_km=0.3 + 0.9j,
            )
            for name, (start, end, km) in LINES.items()
        ),
        transformers=(
            Transformer(
                name="TL",
                place=Place(bus="L"),
                connection="D/Yg",
                rating_kva=1000.0,
                leakage_pu=0.005 + 0.06j,
                x0_pu=None,
            ),
        ),
        loads=tuple(
            Load(
                name=f"load {n}",
                transformer="TL" if place is None else None,
                place=place,
                connection=grounded,
                kw=kw,
                power_factor=0.95,
                exponent=2.0,
                motor_share=share,
            )
            for n, (place, kw, share) in enumerate(
                [
                    (Place(line="SA", at=0.5), 300.0, 0.0),
                    (Place(line="A2B", at=0.25), 200.0, 0.4),
                    (None, 250.0, 0.0),
                    (Place(bus="D"), 400.0, 0.5),
                    (Place(line="SE", at=0.75), 350.0, 0.0),
                ]
            )
        ),
        switches=(Switch(name="tie", from_bus="D", to_bus="E", closed=False),),
        points=(),
        sections=(),
        ders=tuple(
            Der(
                name=name,
                transformer=transformer,
                place=place,
                kw=kw,
                power_factor=1.0,
                model="thevenin",
                z1_ohm=2.0 + 15.0j,
                z2_ohm=None,
                z0_ohm=None,
            )
            for name, transformer, place, kw in [
                ("at C", None, Place(bus="C"), 150.0),
                ("behind TL", "TL", None, 100.0),
                ("at S", None, Place(bus="S"), 200.0),
                ("at C2", None, Place(bus="C2"), 120.0),
            ]
        ),
        regulators=(
            Regulator(
                name="REG",
                from_bus="A",
                to_bus="A2",
                taps=(4, -3, 0),
                step_pct=0.625,
                most_taps=16,
            ),
            Regulator(
                name="OLD",
                from_bus="C2",
                to_bus="C",
                taps=(2, 0, -5),
                step_pct=1.25,
                most_taps=8,
            ),
        ),
    )


def without_regulators(feeder: Feeder) -> Feeder:
    """``feeder`` with closed switches in their place."""
    joins = tuple(
        Switch(name=r.name, from_bus=r.from_bus, to_bus=r.to_bus, closed=True)
        for r in feeder.regulators
    )
    return replace(feeder, regulators=(), switches=(*feeder.switches, *joins))
