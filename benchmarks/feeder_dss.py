"""A feeder's circuit in OpenDSS's language, loads as single elements that follow a daily shape."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from openphase.model.buses import bus_phases, bus_volts
from openphase.model.parts import Feeder, Load
from openphase.model.phases import phase_rows

__all__ = ["ALMOST_NOTHING_OHM", "circuit_of", "unearthed_buses"]

AS_DSS = Path(__file__).resolve().parent.parent / "tests" / "opendss" / "as_dss.py"
ALMOST_NOTHING_OHM = 1e12  #: of a fault that is not there: moves a voltage by 1e-9 or less
MODELS = {0.0: 1, 1.0: 5, 2.0: 2}


def circuit_of(feeder: Feeder, linear: bool, faults: bool) -> list[str]:
    """Commands that build the circuit; with ``faults``, one that is almost nothing everywhere."""
    writer = _writer()
    bus_of = writer.joined_buses(feeder)
    held = [f"{bus_of(bus)}.1" for bus in unearthed_buses(feeder)]
    plain = writer.as_dss(feeder, None, held)
    out = [text for text in plain if not text.startswith("new load.")]
    out += [_load(load, n, bus_of(_bus(load)), linear) for n, load in enumerate(feeder.loads)]
    if faults:
        out += [
            f"new fault.b{n}_{phase} bus1={bus_of(bus)}.{phase + 1} phases=1 "
            f"r={ALMOST_NOTHING_OHM!r}"
            for n, (bus, mask) in enumerate(bus_phases(feeder).items())
            for phase in range(3)
            if mask >> phase & 1
        ]
    # without them, what has no voltage never counts as converged
    bases = sorted({volts * 3.0**0.5 / 1000.0 for volts in bus_volts(feeder).values()})
    return [*out, f"set voltagebases=[{' '.join(map(repr, bases))}]", "calcvoltagebases"]


def unearthed_buses(feeder: Feeder) -> list[str]:
    """Where a winding in delta begins an unearthed part: no load or bank of these feeders is there.

    Its common mode means nothing; OpenDSS gets one phase held, through which nothing flows.
    """
    return [unit.to_bus for unit in feeder.inline_transformers if unit.connection.endswith("/D")]


def _bus(load: Load) -> str:
    assert load.place is not None
    assert load.place.bus is not None
    return load.place.bus


def _load(load: Load, n: int, bus: str, linear: bool) -> str:
    assert load.branch_kv is not None
    count = 3 if load.connection == "delta" and len(load.phases) == 3 else len(load.phases)
    nodes = [str(row + 1) for row in phase_rows(load.phases)]
    kv, phases = load.branch_kv, 1
    if load.connection == "wye":
        phases = count
        kv *= 3.0**0.5 if count > 1 else 1.0
        nodes.append("0")
    elif count == 3:
        phases = 3
    law = "model=2" if linear else _law(load)
    return (
        f"new load.l{n} bus1={'.'.join([bus, *nodes])} phases={phases} conn={load.connection} "
        f"kv={kv!r} kw={load.kw!r} kvar={load.kvar!r} {law} status=variable"
    )


def _law(load: Load) -> str:
    exponents = (load.exponent, load.exponent if load.exponent_q is None else load.exponent_q)
    if exponents[0] != exponents[1]:
        model = f"model=4 cvrwatts={exponents[0]!r} cvrvars={exponents[1]!r}"
    else:
        model = f"model={MODELS[load.exponent]}"
    limits = f"vminpu={load.v_min_pu!r} vlowpu={load.v_low_pu or 0.0!r}"
    return f"{model} {limits} vmaxpu={load.v_max_pu or 9.0!r}"


def _writer() -> ModuleType:
    """What the tests write feeders with."""
    spec = importlib.util.spec_from_file_location("as_dss", AS_DSS)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # its records look there for their own names
    spec.loader.exec_module(module)
    return module
