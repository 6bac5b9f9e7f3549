"""OpenDSS circuits as feeders: everything converted, or refused all at once."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..buses import bus_volts
from ..errors import Fault, InputError
from ..feeder import make_feeder
from ..parts import Coordinates, Feeder, InlineTransformer, Load, Place, Regulator, Source
from .dss_apart import read_apart, settle_apart
from .dss_choices import (
    CapacitorStates,
    Taps,
    chosen,
    raise_refusals,
    with_states,
    with_taps,
    without,
)
from .dss_lines import LineParts, line_parts
from .dss_live import Node, live_nodes
from .dss_loads import LoadWork, capacitor_of, der_of, loads_of
from .dss_names import Names, clean, letters
from .dss_neutrals import neutrals_of
from .dss_records import RawCircuit, RawReactor
from .dss_regulators import regulators_of, with_tap_changer
from .dss_script import Script, read_script
from .dss_spans import is_series, spans_of
from .dss_stars import add_stars
from .dss_transformers import Banks, inline_parts
from .findings import Findings

__all__ = ["Imported", "import_opendss"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Imported:
    """A feeder made from an OpenDSS file, and how."""

    feeder: Feeder
    findings: Findings
    circuit: RawCircuit
    script: Script  #: what the files' circuit is made of, and what was left out of them
    engine: str  #: name and version of the engine that read it
    dropped: tuple[str, ...]
    buses: Mapping[str, str]  #: the feeder's name of each bus of the file
    lines: Mapping[str, str]  #: and of each line


@dataclass(slots=True, kw_only=True)
class _Build:
    """What has been converted so far."""

    circuit: RawCircuit
    live: set[Node]
    findings: Findings
    faults: list[Fault]  #: of the input, beside what the findings refuse
    buses: Names = field(default_factory=Names)
    load_names: Names = field(default_factory=Names)
    inline: list[InlineTransformer] = field(default_factory=list)
    regulators: list[Regulator] = field(default_factory=list)
    loads: list[Load] = field(default_factory=list)
    built: LineParts = field(default_factory=LineParts)


def import_opendss(
    path: Path,
    *,
    drop: Collection[str] = (),
    taps: Taps | None = None,
    capacitor_states: CapacitorStates | None = None,
    solve_controls: bool = False,
) -> Imported:
    """Return the feeder that an OpenDSS file describes.

    Parameters
    ----------
    path
        The file that makes the circuit.
    drop
        Elements to leave out, as ``class.name``; ``*`` stands for any letters.
    taps, capacitor_states
        Positions other than those of the file.
    solve_controls
        Take the positions at which OpenDSS's own controls settle, where none are given.

    Raises
    ------
    InputError
        With every element that no part of a feeder can stand for, or with everything in the
        files that may not be handed to the engine.
    OpenPhaseError
        If the extra is not installed.
    """
    script = read_script(path, drop=drop)
    circuit, engine = read_apart(script, path.name)
    if solve_controls:
        settled_taps, settled_states = settle_apart(script, path.name)
        taps = settled_taps if taps is None else taps
        capacitor_states = settled_states if capacitor_states is None else capacitor_states
    if taps is not None:
        circuit = with_taps(circuit, taps)
    if capacitor_states is not None:
        circuit = with_states(circuit, capacitor_states)
    findings = Findings()
    if solve_controls:
        findings.note("taps and capacitor steps are those at which OpenDSS's controls settle")
    dropped, faults = chosen(circuit, drop, path.name)
    circuit = without(circuit, dropped, findings)
    live = live_nodes(circuit)
    build = _Build(circuit=circuit, live=live, findings=findings, faults=faults)
    feeder = _feeder(build, path.name)
    _note_names(build)
    return Imported(
        feeder=feeder,
        findings=findings,
        circuit=circuit,
        script=script,
        engine=engine,
        dropped=dropped,
        buses=dict(build.buses.given),
        lines=dict(build.built.names.given),
    )


def _feeder(build: _Build, source_name: str) -> Feeder:
    """Convert every part of the circuit, and check what comes out."""
    circuit, live, findings = build.circuit, build.live, build.findings
    source = _source(build, source_name)
    # every bus of the file keeps its own name before new ones are made up
    for bus in sorted({bus for bus, _ in live}):
        build.buses.of(bus)
    _add_series(build)
    loads = LoadWork(
        load_mult=circuit.load_mult,
        live=live,
        neutrals=neutrals_of(circuit),
        buses=build.buses,
        names=build.load_names,
        findings=findings,
    )
    build.loads += [part for load in circuit.loads for part in loads_of(load, loads)]
    build.loads += add_stars(loads.stars, build.buses, build.load_names, findings)
    names = Names()
    capacitors = [
        part
        for bank in circuit.capacitors
        for part in capacitor_of(bank, live, build.buses, names, findings)
    ]
    names = Names()
    ders = [
        part
        for plant in circuit.plants
        for part in der_of(plant, live, build.buses, names, findings)
    ]
    for control in circuit.tap_controls:
        findings.add("regcontrol", control.name, "state kept", "taps stay as the file has them")
    for name in circuit.cap_controls:
        findings.add("capcontrol", name, "state kept", "steps stay as the file has them")
    for other in circuit.others:
        findings.add(other.kind, other.name, "refused", "a class that has no model")
    shunts = _shunts(build)
    raise_refusals(circuit, findings, source_name, build.faults)
    feeder = Feeder(
        name=clean(circuit.name).translate({ord("/"): "_", ord("\\"): "_"}).strip(".") or "circuit",
        source=source,
        lines=tuple(build.built.lines),
        transformers=(),
        loads=tuple(build.loads),
        switches=tuple(build.built.switches),
        points=(),
        sections=(),
        ders=tuple(ders),
        capacitors=tuple(capacitors),
        regulators=tuple(build.regulators),
        codes=tuple(build.built.codes.values()),
        inline_transformers=tuple(build.inline),
        imported_from=source_name,
    )
    volts = bus_volts(feeder)
    placed = {
        build.buses.given[bus]: (x, y)
        for bus, x, y in circuit.coordinates
        if bus in build.buses.given
    }
    feeder = replace(
        feeder,
        loads=(
            *feeder.loads,
            *(load for shunt in shunts for load in _shunt_loads(shunt, volts, build)),
        ),
        coordinates=tuple(
            Coordinates(bus=bus, x=x, y=y) for bus, (x, y) in placed.items() if bus in volts
        ),
    )
    return _checked(feeder)


def _checked(feeder: Feeder) -> Feeder:
    """Send a feeder through the door that all feeders come through."""
    return make_feeder(
        name=feeder.name,
        source=feeder.source,
        lines=feeder.lines,
        loads=feeder.loads,
        ders=feeder.ders,
        capacitors=feeder.capacitors,
        regulators=feeder.regulators,
        switches=feeder.switches,
        codes=feeder.codes,
        inline_transformers=feeder.inline_transformers,
        coordinates=feeder.coordinates,
        imported_from=feeder.imported_from,
    )


def _source(build: _Build, source_name: str) -> Source:
    """Return the one source; further ones are refused.

    It is a fault of the input if the circuit's own source is none of three phases, earthed and
    in positive sequence.

    Raises
    ------
    InputError
        If there is none.
    """
    if not build.circuit.sources:
        wanted = "must be there: nothing feeds this"
        fault = Fault(source=source_name, line=None, where="vsource", wanted=wanted)
        raise InputError([*build.faults, fault])
    first, *others = build.circuit.sources
    for other in others:
        build.findings.add("vsource", other.name, "refused", "a second source")
    told = [
        (
            "must have three phases on nodes 1, 2, 3",
            f"{first.phases} on nodes {first.end.nodes}",
            first.phases == 3 and first.end.nodes == (1, 2, 3),
        ),
        ("bus2 must be earth, node 0: give its impedance as z0", "another", first.earthed),
        ("sequence must be pos", first.sequence, first.sequence.startswith("p")),
    ]
    where = f"vsource {first.name!r}"
    build.faults += [
        Fault(source=source_name, line=None, where=where, wanted=wanted, found=found)
        for wanted, found, right in told
        if not right
    ]
    build.findings.add("vsource", first.name, "as it is")
    return Source(
        bus=build.buses.of(first.end.bus),
        kv_ll=first.kv_ll,
        emf_pu=first.pu,
        z1_ohm=first.z1_ohm,
        z2_ohm=first.z2_ohm,
        z0_ohm=first.z0_ohm,
        frequency_hz=build.circuit.frequency_hz,
        angle_deg=first.angle_deg,
    )


def _add_series(build: _Build) -> None:
    """Convert what joins buses: transformers, regulators, lines and what stands in them."""
    circuit, findings = build.circuit, build.findings
    neutrals = neutrals_of(circuit)
    for name in sorted(neutrals.reactors):
        findings.add("reactor", name, "as it is", "between a neutral and earth")
    banks = Banks(
        buses=build.buses, names=Names(), neutrals=neutrals, live=build.live, findings=findings
    )
    spans = spans_of(circuit, build.live, findings)
    regulated = regulators_of(circuit.transformers, circuit.tap_controls, spans, banks)
    build.regulators += regulated.regulators
    regulator_names = Names(taken={regulator.name for regulator in regulated.regulators})
    for unit in circuit.transformers:
        if unit.name in regulated.units:
            continue
        for row in inline_parts(unit, banks):
            inline, regulator = with_tap_changer(row, unit, circuit.tap_controls, banks)
            build.inline.append(inline)
            if regulator is not None:
                name = regulator_names.new(regulator.name)
                build.regulators.append(replace(regulator, name=name))
    spans += banks.spans
    kept = [span for span in spans if span.name not in regulated.jumpers]
    build.built = line_parts(kept, circuit.guards, build.buses, findings)


def _shunts(build: _Build) -> list[RawReactor]:
    """Return the reactors that stand between phases and earth; others are refused."""
    neutral = neutrals_of(build.circuit).reactors
    found = []
    for reactor in build.circuit.reactors:
        if reactor.name in neutral or is_series(reactor):
            continue
        near, far = reactor.ends
        size = len(near.nodes)
        fed = [n for n in range(size) if (near.bus, near.nodes[n]) in build.live]
        usual = set(near.nodes) <= {1, 2, 3} and (reactor.delta or not any(far.nodes))
        if not fed:
            build.findings.add("reactor", reactor.name, "not fed")
        elif not usual or len(fed) < size or (reactor.delta and size != 3):
            build.findings.add("reactor", reactor.name, "refused", "a shunt of unusual connection")
        else:
            how = "a load of constant impedance, which a study varies as loads"
            build.findings.add("reactor", reactor.name, "approximated", how)
            found.append(reactor)
    return found


def _shunt_loads(reactor: RawReactor, volts: Mapping[str, float], build: _Build) -> list[Load]:
    """Return a shunt reactor as a load: what its mean branch takes at nominal voltage."""
    bus = build.buses.of(reactor.ends[0].bus)
    branch_v = volts[bus] * (3.0**0.5 if reactor.delta else 1.0)
    own = complex(np.trace(np.array(reactor.r_ohm) + 1j * np.array(reactor.x_ohm)))
    count = len(reactor.r_ohm)
    power = branch_v**2 / (own / count).conjugate() * count / 1000.0
    return [
        Load(
            name=build.load_names.of(f"reactor_{reactor.name}"),
            transformer=None,
            place=Place(bus=bus),
            connection="delta" if reactor.delta else "wye",
            kw=power.real,
            kvar=power.imag,
            power_factor=1.0,
            exponent=2.0,
            phases=letters(reactor.ends[0].nodes),
            branch_kv=branch_v / 1000.0,
        )
    ]


def _note_names(build: _Build) -> None:
    """Say what had to be called otherwise."""
    for what, names in (("bus", build.buses), ("line", build.built.names)):
        changed = names.changed
        if changed:
            some = ", ".join(f"{old} → {new}" for old, new in list(changed.items())[:3])
            build.findings.note(f"{len(changed)} {what} names changed: {some}")
