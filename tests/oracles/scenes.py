"""What tests of the physics keep doing: open, step, solve, look at the points in sequences."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from openphase.detector.impedance import connection_impedance
from openphase.model import load_feeder
from openphase.model.network import Network, compile_network, locate
from openphase.model.parts import Connection, Feeder, Place
from openphase.model.points import Points, Terminal, find_points
from openphase.model.sequence_network import sequence_network, two_port
from openphase.model.solve import solve, steady_state
from openphase.model.states import Answer, State
from openphase.model.symmetrical import to_sequences

__all__ = [
    "Pair",
    "Scene",
    "change",
    "connected",
    "constants",
    "looks",
    "opened",
    "ring",
    "scene",
    "stepped",
]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A feeder in one switching state."""

    feeder: Feeder
    network: Network
    points: Points
    steady: State  #: one scenario

    def states(self, count: int) -> State:
        """The steady state, ``count`` times."""
        return steady_state(self.network, count)

    def terminal(self, local: str, remote: str) -> Terminal:
        """The terminal of a section at ``local``."""
        return next(t for t in self.points.terminals if (t.local, t.remote) == (local, remote))


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """A section's phasors before (0) and after (1), currents into the section; (2, 3, S)."""

    v_m: Complex
    v_n: Complex
    i_m: Complex

    def eq_5(self, k: int) -> tuple[Complex, NDArray[np.bool_]]:
        """Eq. (5) in sequence or phase ``k``, as the detector has it, and where undefined."""
        v, n, i = self.v_m[:, k], self.v_n[:, k], self.i_m[:, k]
        return connection_impedance(v[1], n[1], i[1], v[1] - v[0], n[1] - n[0], i[1] - i[0])

    def z(self, k: int = 1) -> Complex:
        """Eq. (5); 0 where it is undefined."""
        return self.eq_5(k)[0]

    def compensated(self, k: int = 1) -> tuple[Complex, Complex]:
        """ΔV_n* and ΔI_m*: the changes that V_m'/V_m does not explain."""
        factor = self.v_m[1, k] / self.v_m[0, k]
        return self.v_n[1, k] - factor * self.v_n[0, k], self.i_m[1, k] - factor * self.i_m[0, k]

    def rounding_ohm(self, k: int = 1) -> Real:
        """What errors of one part in 1e12 of every phasor may do to ``z``; infinite at 0/0."""
        z, undefined = self.eq_5(k)
        v, n, i = (np.abs(x[:, k]).max(axis=0) for x in (self.v_m, self.v_n, self.i_m))
        di = np.maximum(np.abs(self.compensated(k)[1]), 1e-300)
        return np.where(undefined, np.inf, 1e-12 * (v + n + np.abs(z) * i) / di)


def scene(feeder: Feeder, closed: frozenset[str] | None = None) -> Scene:
    """``feeder`` with the switches in ``closed`` closed, ready to solve."""
    network = compile_network(feeder, closed)
    return Scene(feeder, network, find_points(feeder, network), steady_state(network))


def opened(at: Scene, state: State, line: str, fraction: float, *masks: int) -> State:
    """``state`` with phases open at a place, one scenario for each mask."""
    edge, share = locate(at.network, line, fraction)
    size = len(masks)
    wide = {
        name: np.repeat(value, size, axis=-1) if value.shape[-1] == 1 else value
        for name, value in state._asdict().items()
    }
    return State(**wide)._replace(
        edge=np.full(size, edge), share=np.full(size, share), open_mask=np.array(masks)
    )


def stepped(
    at: Scene, state: State, line: str, fraction: float, watts: tuple[float, float, float]
) -> State:
    """``state`` with constant-impedance load at a place, watts per phase at nominal voltage."""
    edge, share = locate(at.network, line, fraction)
    size = state.emf_pu.size
    y = np.array(watts, complex)[:, None] / at.network.tree.v_nominal_v**2
    return state._replace(
        edge=np.full(size, edge), share=np.full(size, share), step_y_s=np.repeat(y, size, axis=1)
    )


def looks(at: Scene, state: State) -> Answer:
    """Everything, everywhere."""
    return solve(at.network, state)


def change(
    at: Scene, terminal: Terminal, before: Answer, after: Answer, *, phases: bool = False
) -> Pair:
    """What a terminal sees of two answers, in sequences 0, 1, 2 or in phases a, b, c."""
    m, n = terminal.local_point, terminal.remote_point
    nodes, edges, below = at.points.node, at.points.edge, at.points.below
    inward = terminal.into * (-1.0 if below[m] else 1.0)

    def pick(field: str, row: int, sign: float = 1.0) -> Complex:
        both = np.broadcast_arrays(getattr(before, field)[row], getattr(after, field)[row])
        found = sign * np.stack(both)
        return found if phases else to_sequences(found, axis=1)

    return Pair(
        v_m=pick("v", nodes[m]),
        v_n=pick("v", nodes[n]),
        i_m=pick("i", 2 * edges[m] + below[m], inward),
    )


def connected(feeder: Feeder, connection: Connection, *names: str) -> Feeder:
    """``feeder`` with these transformers connected that way, without magnetizing branch."""
    units = tuple(
        replace(unit, connection=connection, x0_pu=None) if unit.name in names else unit
        for unit in feeder.transformers
    )
    return replace(feeder, transformers=units)


def ring(rng: np.random.Generator) -> Feeder:
    """The paper's loop with other lines, places, ratings and loads."""
    paper = load_feeder("paper")
    lines = tuple(
        replace(
            line,
            z1_ohm_per_km=line.z1_ohm_per_km * rng.uniform(0.5, 2.0),
            z0_ohm_per_km=line.z0_ohm_per_km * rng.uniform(1.0, 6.0),
        )
        for line in paper.lines
    )
    places = {"T2": (0.05, 0.5), "T4": (0.65, 0.95)}
    units = tuple(
        replace(
            unit,
            rating_kva=1000.0 * rng.uniform(0.7, 1.4),
            place=replace(unit.place, at=float(rng.uniform(*places.get(unit.name, (0.1, 0.9))))),
        )
        for unit in paper.transformers
    )
    loads = tuple(replace(load, kw=load.kw * rng.uniform(0.5, 1.5)) for load in paper.loads)
    return replace(paper, lines=lines, transformers=units, loads=loads)


def constants(feeder: Feeder, upper: str, lower: str, broken: Place | None = None) -> Complex:
    """(2, 2) positive-sequence two-port constants between two nodes, taps included."""
    loads = tuple(replace(load, exponent=2.0) for load in feeder.loads)
    place = broken or Place(line=feeder.lines[0].name, at=0.5)
    return two_port(sequence_network(replace(feeder, loads=loads), place), upper, lower)[:, :, 1]
