"""OpenDSS through dss-python on mixed events, driven in several ways.

Every driving keeps three circuits, so that nothing is ever put back: one that stays intact (all
states before, load and source steps), one whose conductors open, and one with a fault at every
node. States after an event come sorted by place, which saves OpenDSS matrices, not the product.
The first plays the loads and the EMF as daily shapes, so that no element is edited and the
matrix of an intact circuit is made once; the second writes every load, two batches a state, and
solves the matrix once; the third is that with a single circuit, opened and closed again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from dss import DSS  # type: ignore[import-not-found,import-untyped,unused-ignore]
from feeder_dss import ALMOST_NOTHING_OHM, circuit_of
from feeder_problem import FeederProblem
from numpy.typing import NDArray

__all__ = ["DRIVINGS", "Driven"]

MOST_ITERATIONS = 100

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Result = tuple[Complex, Complex, NDArray[np.bool_]]
Driven = Callable[[], Result]


class Circuit:
    """One context with the feeder in it."""

    def __init__(self, problem: FeederProblem, linear: bool, faults: bool, pu: float) -> None:
        self.engine = DSS.NewContext()
        self.engine.AllowForms = False
        self.engine.AdvancedTypes = False
        self.tell(circuit_of(problem.feeder, linear, faults))
        self.circuit = self.engine.ActiveCircuit
        self.lines = [f"line.{line.name}" for line in problem.feeder.lines]
        self.conductor = [
            {"abc".index(phase): n + 1 for n, phase in enumerate(line.phases)}
            for line in problem.feeder.lines
        ]
        self.opened: tuple[int, int] | None = None
        self.fault = ""
        self.tell([f"set tolerance={pu!r} maxiterations={MOST_ITERATIONS}"])
        self.tell(["set controlmode=off", "set mode=snap", "solve"])
        # without the checks that the package makes at every call
        self.solve = self.engine._api_util.lib.Solution_Solve

    def tell(self, commands: Sequence[str]) -> None:
        for command in commands:
            self.engine.Text.Command = command

    def cut(self, line: int, phase: int) -> None:
        """Have just this conductor open, at the line's to-end; -1: none."""
        wanted = (line, phase) if line >= 0 else None
        if wanted == self.opened:
            return
        if self.opened:
            self._element(self.opened[0]).Close(2, self.conductor[self.opened[0]][self.opened[1]])
        if wanted:
            self._element(line).Open(2, self.conductor[line][phase])
        self.opened = wanted

    def _element(self, line: int) -> Any:
        self.circuit.SetActiveElement(self.lines[line])
        return self.circuit.ActiveCktElement

    def set_fault(self, bus: int, phase: int, ohm: float) -> None:
        """Have just this fault; bus -1: none."""
        name = f"fault.b{bus}_{phase}" if bus >= 0 else ""
        if self.fault and self.fault != name:
            self.engine.Text.Command = f"{self.fault}.r={ALMOST_NOTHING_OHM!r}"
        if name:
            self.engine.Text.Command = f"{name}.r={ohm!r}"
        self.fault = name

    def voltages(self) -> Complex:
        """The solution itself, which begins with earth."""
        ffi = self.engine._api_util.ffi
        start = ffi.cast("char*", self.engine.YMatrix.GetVPointer())
        raw = ffi.buffer(start, 16 * (self.circuit.NumNodes + 1))
        values: Complex = np.frombuffer(raw, np.complex128)[1:]
        return values


class Batch:
    """Kilowatts and kvar of all loads, written at once."""

    def __init__(self, own: Circuit) -> None:
        util = own.engine._api_util
        self.util, ffi = util, util.ffi
        self.keep = ffi.new("void***"), ffi.new("int32_t[4]")
        util.lib.Batch_CreateByClassS(self.keep[0], self.keep[1], b"load")
        self.batch, self.count = self.keep[0][0], self.keep[1][0]
        self.set = util.lib_unpatched.Batch_SetFloat64ArrayS
        self.flags = 0

    def write(self, values: Sequence[tuple[bytes, Real]]) -> None:
        for name, each in values:
            at = self.util.ffi.cast("double*", each.ctypes.data)
            self.set(self.batch, self.count, name, at, self.flags)


def _shapes(problem: FeederProblem, linear: bool, pu: float) -> Driven:
    events = problem.events
    size = events.kind.size
    order = _order(problem)
    where = np.choose(events.kind[order], [1, 0, 2, 0, 0])
    circuits = [Circuit(problem, linear, faults=n == 2, pu=pu) for n in range(3)]
    kept = [order[where == n] for n in range(3)]
    # the intact circuit plays all the states before, then those after that leave it intact
    factors = [events.factor[1][:, kept[n]] for n in range(3)]
    factors[0] = np.concatenate([events.factor[0], factors[0]], axis=1)
    # a source's shape takes the place of its own pu
    own_pu = problem.feeder.source.emf_pu
    emf = [np.full(factor.shape[1], own_pu) for factor in factors]
    emf[0][size:] *= events.source[kept[0]]
    for own, factor, source in zip(circuits, factors, emf, strict=True):
        _play(own, factor, source)

    def run() -> Result:
        nodes = len(circuits[0].circuit.YNodeOrder)
        out = np.empty((2, size, nodes), np.complex128)
        good = np.ones((2, size), np.bool_)
        for own in circuits:
            own.circuit.Solution.dblHour = 0.0
        intact = circuits[0]
        solution = intact.circuit.Solution
        for s in range(size):
            intact.solve()
            good[0, s] = solution.Converged
            out[0, s] = intact.voltages()
        for own, chosen in zip(circuits, kept, strict=True):
            solution = own.circuit.Solution
            for s in chosen:
                _happen(own, problem, s)
                own.solve()
                good[1, s] = solution.Converged
                out[1, s] = own.voltages()
        return out[0], out[1], good

    return run


def _play(own: Circuit, factor: Real, source: Real) -> None:
    for n, values in enumerate([*factor, source]):
        name = f"s{n}"
        text = " ".join(map(repr, values.tolist()))
        own.tell([f"new loadshape.{name} npts={values.size} interval=1 mult=[{text}]"])
        which = f"load.l{n}" if n < len(factor) else "vsource.source"
        own.tell([f"{which}.daily={name}"])
    own.tell(["set mode=daily stepsize=1h number=1"])


def _direct(problem: FeederProblem, linear: bool, pu: float, contexts: int) -> Driven:
    events = problem.events
    size = events.kind.size
    order = _order(problem)
    where = np.choose(events.kind[order], [1, 0, 2, 0, 0])
    if contexts == 1:
        circuits = [Circuit(problem, linear, faults=True, pu=pu)] * 3
    else:
        circuits = [Circuit(problem, linear, faults=n == 2, pu=pu) for n in range(3)]
    batches = [Batch(own) for own in circuits]
    kw = np.array([load.kw for load in problem.feeder.loads])
    kvar = np.array([load.kvar for load in problem.feeder.loads], np.float64)
    powers = [
        (np.ascontiguousarray(factor.T * kw), np.ascontiguousarray(factor.T * kvar))
        for factor in events.factor
    ]
    for own in circuits:
        own.tell([f"set mode={'direct' if linear else 'snap'}", "solve"])
    emf = problem.feeder.source.emf_pu

    def write(batch: Batch, n: int, s: int) -> None:
        batch.write(((b"kw", powers[n][0][s]), (b"kvar", powers[n][1][s])))

    def run() -> Result:
        nodes = len(circuits[0].circuit.YNodeOrder)
        out = np.empty((2, size, nodes), np.complex128)
        good = np.ones((2, size), np.bool_)
        level = 1.0
        intact, batch = circuits[0], batches[0]
        for s, place in zip(order, where, strict=True):
            if level != 1.0:
                intact.circuit.Vsources.idx = 1
                intact.circuit.Vsources.pu = emf
                level = 1.0
            if contexts == 1:
                _happen(intact, problem, -1)
            write(batch, 0, s)
            intact.solve()
            good[0, s] = intact.circuit.Solution.Converged
            out[0, s] = intact.voltages()
            own = circuits[place]
            _happen(own, problem, s)
            if events.source[s] != 1.0:
                level = events.source[s]
                own.circuit.Vsources.idx = 1
                own.circuit.Vsources.pu = emf * level
            if own is not intact or events.kind[s] == 1:
                write(batches[place], 1, s)
            own.solve()
            good[1, s] = own.circuit.Solution.Converged
            out[1, s] = own.voltages()
        return out[0], out[1], good

    return run


def _happen(own: Circuit, problem: FeederProblem, s: int) -> None:
    events = problem.events
    line, bus = (events.line[s], events.bus[s]) if s >= 0 else (-1, -1)
    if line >= 0 or own.opened:
        own.cut(int(line), int(events.phase[s]))
    if bus >= 0 or own.fault:
        own.set_fault(int(bus), int(events.phase[s]), float(events.ohm[s]))


def _order(problem: FeederProblem) -> NDArray[np.int64]:
    own = problem.events
    return np.lexsort((own.phase, own.bus, own.line, own.kind))


def _names(problem: FeederProblem, linear: bool, pu: float) -> list[str]:
    circuit = Circuit(problem, linear, faults=False, pu=pu).circuit
    return [str(name) for name in circuit.YNodeOrder]


def _shaped(problem: FeederProblem, linear: bool, pu: float) -> tuple[list[str], Driven]:
    return _names(problem, linear, pu), _shapes(problem, linear, pu)


def _batched(problem: FeederProblem, linear: bool, pu: float) -> tuple[list[str], Driven]:
    return _names(problem, linear, pu), _direct(problem, linear, pu, 3)


def _alone(problem: FeederProblem, linear: bool, pu: float) -> tuple[list[str], Driven]:
    return _names(problem, linear, pu), _direct(problem, linear, pu, 1)


DRIVINGS: dict[str, Callable[[FeederProblem, bool, float], tuple[list[str], Driven]]] = {
    "three circuits, daily shapes": _shaped,
    "three circuits, batch writes": _batched,
    "one circuit, batch writes": _alone,
}
"""Each with loads linear or not and a tolerance; returns node names in order and what solves."""
