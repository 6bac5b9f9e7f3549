"""A feeder said in OpenDSS's language, so that its engine can be asked the same question.

Everything is written out: matrices for one length without a unit, windings' resistances, no
anti-float. Loads are single branches of constant admittance, to be solved in ``mode=direct``.
Only what stands on buses can be said; transformers that hang on the feeder and DER cannot.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from openphase.model.buses import bus_volts
from openphase.model.line_matrices import phase_rows, shunt_nf_per_km, z_ohm_per_km
from openphase.model.parts import (
    Capacitor,
    Feeder,
    InlineTransformer,
    Line,
    LineCode,
    Load,
    Regulator,
)
from openphase.model.phases import conductors

__all__ = ["Cut", "as_dss", "joined_buses", "node_name"]

ROOT = 3.0**0.5
SMALL_OHM = 1e-6  #: of what has no impedance at all and cannot be one bus


@dataclass(frozen=True, slots=True, kw_only=True)
class Cut:
    """Conductors open at a fraction of a line."""

    line: str
    at: float
    phases: str


def node_name(bus: str, phase: str) -> str:
    """The engine's name of a node."""
    return f"{bus}.{'abc'.index(phase) + 1}".upper()


def as_dss(feeder: Feeder, cut: Cut | None = None, held: Iterable[str] = ()) -> list[str]:
    """Commands that build ``feeder``, cut open if asked, with the ``held`` nodes earthed.

    A line that is cut is two lines: buses LINE_p and LINE_q are the stubs, one bus in the
    phases that stay whole.
    """
    if feeder.transformers or feeder.ders:
        raise ValueError("hanging transformers and DER are not written")
    volts = bus_volts(feeder)
    writer = _Writer(feeder, joined_buses(feeder))
    commands = ["clear", *writer.source()]
    for line in feeder.lines:
        commands += writer.line(line, cut if cut and cut.line == line.name else None)
    for unit in feeder.inline_transformers:
        commands += writer.transformer(unit)
    for regulator in feeder.regulators:
        commands += writer.regulator(regulator, volts[regulator.from_bus])
    for load in feeder.loads:
        assert load.place is not None
        assert load.place.bus is not None
        commands += writer.load(load, load.place.bus, volts[load.place.bus])
    for bank in feeder.capacitors:
        assert bank.place.bus is not None
        commands += writer.capacitor(bank, bank.place.bus, volts[bank.place.bus])
    for k, node in enumerate(held):
        commands.append(f"new reactor.held{k} phases=1 bus1={node} r=1 x=0")
    return commands


def joined_buses(feeder: Feeder) -> Callable[[str], str]:
    """Each bus's name in the circuit: buses that closed switches join are one.

    A switch must carry every phase that the bus behind it has.
    """
    parent: dict[str, str] = {}

    def root(bus: str) -> str:
        while bus in parent:
            bus = parent[bus]
        return bus

    for switch in feeder.switches:
        if switch.closed and root(switch.from_bus) != root(switch.to_bus):
            parent[root(switch.to_bus)] = root(switch.from_bus)
    return root


class _Writer:
    """Knows the circuit's buses and which of their neutral nodes are taken."""

    def __init__(self, feeder: Feeder, bus_of: Callable[[str], str]) -> None:
        self.feeder = feeder
        self.codes: dict[str | None, LineCode] = {code.name: code for code in feeder.codes}
        self.bus_of = bus_of
        self.neutrals: Counter[str] = Counter()

    def at(self, bus: str, phases: str, *more: int) -> str:
        nodes = [*(row + 1 for row in phase_rows(phases)), *more]
        return ".".join([self.bus_of(bus), *map(str, nodes)])

    def neutral(self, bus: str) -> int:
        """A node that nothing else uses."""
        self.neutrals[self.bus_of(bus)] += 1
        return 3 + self.neutrals[self.bus_of(bus)]

    def source(self) -> list[str]:
        own = self.feeder.source
        main = (
            f"new circuit.c bus1={self.bus_of(own.bus)} basekv={own.kv_ll!r} pu={own.emf_pu!r} "
            f"angle={own.angle_deg!r} basefreq={own.frequency_hz!r} frequency={own.frequency_hz!r} "
            f"z1={_pair(own.z1_ohm)} z2={_pair(own.z2_ohm)} z0={_pair(own.z0_ohm)}"
        )
        if own.neutral == "solid":
            return [main]
        main += " bus2=star.1.1.1"
        if own.neutral == "isolated":
            return [main]
        z = own.neutral_ohm
        return [main, f"new reactor.star phases=1 bus1=star.1 r={z.real!r} x={z.imag!r}"]

    def line(self, line: Line, cut: Cut | None) -> list[str]:
        start, end = self.at(line.from_bus, line.phases), self.at(line.to_bus, line.phases)
        if cut is None:
            return [self._piece(line, line.name, start, end)]
        if cut.at == 0:
            return [self._piece(line, line.name, self._opened(line, line.from_bus, cut), end)]
        if cut.at == 1:
            return [self._piece(line, line.name, start, self._opened(line, line.to_bus, cut))]
        stub = f"{line.name}_p"
        p = ".".join([stub, *(str(row + 1) for row in phase_rows(line.phases))])
        q = ".".join(
            [
                stub,
                *(str(row + 4 if phase in cut.phases else row + 1) for phase, row in _rows(line)),
            ]
        )
        return [
            self._piece(line, f"{line.name}_p", start, p, cut.at),
            self._piece(line, f"{line.name}_q", q, end, 1 - cut.at),
        ]

    def _opened(self, line: Line, bus: str, cut: Cut) -> str:
        """The line's end at ``bus``, with a node of its own for every open phase."""
        nodes = [
            self.neutral(bus) if phase in cut.phases else row + 1 for phase, row in _rows(line)
        ]
        return ".".join([self.bus_of(bus), *map(str, nodes)])

    def _piece(self, line: Line, name: str, start: str, end: str, share: float = 1.0) -> str:
        rows = phase_rows(line.phases)
        grid = np.ix_(rows, rows)
        km = line.length_km * share
        z = z_ohm_per_km(line, self.codes.get(line.code))[grid] * km
        c = shunt_nf_per_km(line, self.codes.get(line.code))[grid] * km
        return (
            f"new line.{name} phases={len(rows)} bus1={start} bus2={end} length=1 units=none "
            f"rmatrix={_matrix(z.real)} xmatrix={_matrix(z.imag)} cmatrix={_matrix(c)} "
            f"basefreq={self.feeder.source.frequency_hz!r}"
        )

    def load(self, load: Load, bus: str, volts: float) -> list[str]:
        reactive = load.kvar
        if reactive is None:
            angle = np.arccos(min(1.0, abs(load.power_factor)))
            reactive = float(load.kw * np.tan(angle) * np.sign(load.power_factor))
        branches = self._branches(load.connection, load.phases)
        kv = load.branch_kv or volts / 1000.0 * (ROOT if load.connection == "delta" else 1.0)
        return [
            f"new load.{load.name}_{k} phases=1 bus1={self.at(bus, ends)}"
            f"{'' if len(ends) == 2 else '.0'} conn={load.connection} kv={kv!r} model=2 "
            f"kw={load.kw / len(branches)!r} kvar={reactive / len(branches)!r}"
            for k, ends in enumerate(branches)
        ]

    def capacitor(self, bank: Capacitor, bus: str, volts: float) -> list[str]:
        branches = self._branches(bank.connection, bank.phases)
        kv = bank.branch_kv or volts / 1000.0 * (ROOT if bank.connection == "delta" else 1.0)
        return [
            f"new capacitor.{bank.name}_{k} phases=1 bus1={self.at(bus, ends[0])} "
            f"bus2={self.at(bus, ends[1]) if len(ends) == 2 else self.bus_of(bus) + '.0'} "
            f"kv={kv!r} kvar={bank.kvar / len(branches)!r}"
            for k, ends in enumerate(branches)
        ]

    @staticmethod
    def _branches(connection: str, phases: str) -> list[str]:
        if connection == "wye":
            return list(phases)
        return [phases] if len(phases) == 2 else ["ab", "bc", "ca"]

    def regulator(self, own: Regulator, volts: float) -> list[str]:
        """One transformer for each unit, 1 MVA, its leakage in ohms on the from-side."""
        if own.reference == "next":
            raise ValueError("a closed delta's series windings lie between two buses: not written")
        out = []
        for phase in conductors(own):
            if phase == own.reference:
                z = own.jumper_ohm or SMALL_OHM
                start, end = self.at(own.from_bus, phase), self.at(own.to_bus, phase)
                out.append(
                    f"new line.{own.name}_{phase} phases=1 bus1={start} bus2={end} length=1 "
                    f"units=none rmatrix=[{z.real!r}] xmatrix=[{z.imag!r}] cmatrix=[0]"
                )
                continue
            reference = own.reference
            ends = phase if reference == "earth" else phase + reference
            earth = (0,) if reference == "earth" else ()
            kv = volts / 1000.0 * (1.0 if reference == "earth" else ROOT)
            z_pu = own.z_ohm / (kv * kv)
            ratio = 1.0 + own.taps["abc".index(phase)] * own.step_pct / 100.0
            start, end = self.at(own.from_bus, ends, *earth), self.at(own.to_bus, ends, *earth)
            out.append(
                f"new transformer.{own.name}_{phase} phases=1 windings=2 xhl={z_pu.imag * 100!r} "
                f"%rs=[{z_pu.real * 50!r} {z_pu.real * 50!r}] buses=[{start} {end}] "
                f"conns=[wye wye] kvs=[{kv!r} {kv!r}] kvas=[1000 1000] taps=[1 {ratio!r}] "
                f"maxtap=2 mintap=0.5 ppm_antifloat=0"
            )
        return out

    def transformer(self, own: InlineTransformer) -> list[str]:
        if own.connection == "centre-tap":
            return [self._centre_tapped(own)]
        out: list[str] = []
        windings = (
            (own.from_bus, own.phases, own.from_neutral_ohm),
            (own.to_bus, own.to_phases, own.to_neutral_ohm),
        )
        buses, conns = [], []
        for k, (bus, phases, ohm) in enumerate(windings):
            if own.connection == "single":
                kind = "Yg" if len(phases) == 1 else "D"
            else:
                kind = own.connection.split("/")[k]
            star: tuple[int, ...] = ()
            if kind != "D":
                star = (0,) if kind == "Yg" and ohm == 0 else (self.neutral(bus),)
            if kind == "Yg" and ohm != 0:
                out.append(
                    f"new reactor.{own.name}_{k} phases=1 bus1={self.bus_of(bus)}.{star[0]} "
                    f"r={ohm.real!r} x={ohm.imag!r}"
                )
            buses.append(self.at(bus, phases, *star))
            conns.append("delta" if kind == "D" and own.connection != "single" else "wye")
        half = own.leakage_pu.real * 50
        phases = 1 if own.connection == "single" else 3
        # the engine shifts the side of lower voltage
        shift = own.shift
        if own.kv_to > own.kv_from:
            shift = "lead" if own.shift == "lag" else "lag"
        out.append(
            f"new transformer.{own.name} phases={phases} windings=2 "
            f"buses=[{' '.join(buses)}] conns=[{' '.join(conns)}] {self._ratings(own)} "
            f"%rs=[{half!r} {half!r}] xhl={own.leakage_pu.imag * 100!r} leadlag={shift}"
        )
        return out

    def _ratings(self, own: InlineTransformer) -> str:
        return (
            f"kvs=[{own.kv_from!r} {own.kv_to!r}] kvas=[{own.rating_kva!r} {own.rating_kva!r}] "
            f"taps=[{own.from_tap!r} {own.to_tap!r}] {self._magnetizing(own)}"
        )

    @staticmethod
    def _magnetizing(own: InlineTransformer) -> str:
        y = own.magnetizing_pu
        return f"%noloadloss={y.real * 100!r} %imag={-y.imag * 100!r} ppm_antifloat=0"

    def _centre_tapped(self, own: InlineTransformer) -> str:
        """Star branches into short-circuit values: the engine's way to say three windings."""
        leg = own.leg_leakage_pu or 0j
        first, second = own.to_phases
        earth = (0,) if len(own.phases) == 1 else ()
        ends: Sequence[str] = (
            self.at(own.from_bus, own.phases, *earth),
            self.at(own.to_bus, first, 0),
            ".".join([self.bus_of(own.to_bus), "0", str("abc".index(second) + 1)]),
        )
        through = (own.leakage_pu.imag + leg.imag) * 100
        leg_kv = own.kv_to / 2
        return (
            f"new transformer.{own.name} phases=1 windings=3 buses=[{' '.join(ends)}] "
            f"conns=[wye wye wye] kvs=[{own.kv_from!r} {leg_kv!r} {leg_kv!r}] "
            f"kvas=[{own.rating_kva!r} {own.rating_kva!r} {own.rating_kva!r}] "
            f"%rs=[{own.leakage_pu.real * 100!r} {leg.real * 100!r} {leg.real * 100!r}] "
            f"xhl={through!r} xht={through!r} xlt={leg.imag * 200!r} "
            f"taps=[{own.from_tap!r} {own.to_tap!r} {own.to_tap!r}] {self._magnetizing(own)}"
        )


def _rows(line: Line) -> list[tuple[str, int]]:
    return list(zip(line.phases, phase_rows(line.phases), strict=True))


def _pair(z: complex) -> str:
    return f"[{z.real!r} {z.imag!r}]"


def _matrix(values: NDArray[np.float64]) -> str:
    return "[" + " | ".join(" ".join(repr(float(v)) for v in row) for row in values) + "]"
