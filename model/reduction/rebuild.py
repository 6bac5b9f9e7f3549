"""The parts that stand for what was folded at a root: its loads, and a line or units to them."""

from __future__ import annotations

import math
from collections.abc import Container
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..parts import Feeder, InlineTransformer, Line, LineCode, Load, Place, Regulator, Switch
from .equivalent import Equivalent, Fit, across
from .primitives import law_factors

__all__ = ["Stub", "free_name", "moved_load", "names_in", "stub_of"]

Complex = NDArray[np.complex128]

SHORTEST_KM = 1e-3


UNITS_SHARE = 0.1
"""Of the impedance on the way, where a line and units share it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stub:
    """The way from a root to the bus where its folded loads stand."""

    bus: str
    line: Line | None = None
    code: LineCode | None = None
    units: tuple[InlineTransformer, ...] = ()


def moved_load(
    load: Load, bus: str, fit: Fit, there: tuple[complex, float, float], v: Complex
) -> Load:
    """Return the load as it stands at ``bus``.

    Parameters
    ----------
    load : Load
    bus : str
    fit : Fit
    there : complex, float, float
        Where it stood: the admittance of a branch at its voltage, that voltage, and the nominal
        one, volts.
    v : (3,) array
        Voltages of the phases of ``bus`` at the level of the fold.
    """
    y, v_was, v_nominal = there
    p_factor, q_factor = law_factors(load, v_was / v_nominal)
    here = across(fit.phases, fit.connection)
    v_now = float(np.abs(here @ v).mean())
    # its own law meets the same voltage in pu as before
    kv = v_nominal * v_now / v_was / 1000.0
    y = fit.share * y
    kva = complex(y.real / p_factor, -y.imag / q_factor) * kv**2 * 1000.0 * len(here)
    return replace(
        load,
        place=Place(bus=bus),
        connection=fit.connection,
        phases=fit.phases,
        branch_kv=kv,
        kw=max(kva.real, 0.0) if load.kw >= 0.0 else kva.real,
        kvar=kva.imag,
    )


def stub_of(
    ends: tuple[str, str],
    equivalent: Equivalent,
    km: float,
    rating: tuple[float, float],
    frequency_hz: float,
) -> Stub:
    """Return the parts between a root and its loads.

    Parameters
    ----------
    ends : two str
        The root, and the bus of the loads if there is to be one.
    equivalent : Equivalent
    km : float
        Length of a line between them.
    rating : two float
        kVA and phase-to-earth volts of transformers between them.
    frequency_hz : float
    """
    root, bus = ends
    kind, z, iron = equivalent.kind, equivalent.z_ohm, equivalent.far_s - equivalent.near_s
    if kind == "bus":
        return Stub(bus=root)
    if kind == "units":
        return Stub(bus=bus, units=_units((root, bus), z, iron, rating))
    if kind == "line":
        line, code = _line(ends, z, equivalent.near_s, km, frequency_hz)
        return Stub(bus=bus, line=line, code=code)
    middle = f"{bus}.line"
    leakage = UNITS_SHARE * np.diag(z.diagonal())
    line, code = _line((root, middle), z - leakage, equivalent.near_s, km, frequency_hz)
    return Stub(bus=bus, line=line, code=code, units=_units((middle, bus), leakage, iron, rating))


def _line(
    ends: tuple[str, str], z: Complex, half_s: Complex, km: float, frequency_hz: float
) -> tuple[Line, LineCode]:
    """A line of a code of its own, in the phases that have an impedance."""
    root, bus = ends
    rows = np.flatnonzero(z.diagonal() != 0.0)
    chosen = np.ix_(rows, rows)
    length = max(km, SHORTEST_KM)
    nf = 2.0 * half_s[chosen].imag / (math.tau * frequency_hz) * 1e9
    code = LineCode(
        name=bus,
        r_ohm_per_km=_as_rows(z[chosen].real / length),
        x_ohm_per_km=_as_rows(z[chosen].imag / length),
        c_nf_per_km=_as_rows(nf / length) if np.any(nf) else None,
    )
    line = Line(
        name=bus,
        from_bus=root,
        to_bus=bus,
        length_km=length,
        phases="".join("abc"[row] for row in rows),
        code=bus,
    )
    return line, code


def _units(
    ends: tuple[str, str], z: Complex, iron: Complex, rating: tuple[float, float]
) -> tuple[InlineTransformer, ...]:
    """Single-phase transformers of ratio one, with their share of what the folded ones took."""
    root, bus = ends
    kva, volts = rating
    base = volts**2 / (kva * 1000.0)
    return tuple(
        InlineTransformer(
            name=f"{bus}.{phase}",
            from_bus=root,
            to_bus=bus,
            connection="single",
            rating_kva=kva,
            kv_from=volts / 1000.0,
            kv_to=volts / 1000.0,
            leakage_pu=complex(z[row, row] / base),
            magnetizing_pu=complex(iron[row, row] * base),
            phases=phase,
            to_phases=phase,
        )
        for row, phase in enumerate("abc")
        if z[row, row] != 0.0
    )


def _as_rows(matrix: NDArray[np.float64]) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())


def names_in(feeder: Feeder) -> set[str]:
    """All names of a feeder that those of new parts must differ from."""
    ended: list[Line | Switch | Regulator | InlineTransformer] = [
        *feeder.lines,
        *feeder.switches,
        *feeder.regulators,
        *feeder.inline_transformers,
    ]
    taken = {name for part in ended for name in (part.name, part.from_bus, part.to_bus)}
    return taken | {code.name for code in feeder.codes} | {t.name for t in feeder.transformers}


def free_name(root: str, taken: Container[str]) -> str:
    """A name for what stands for the folded part of a root, that nothing else has."""
    name = f"{root}.folded"
    while name in taken:
        name += "+"
    return name
