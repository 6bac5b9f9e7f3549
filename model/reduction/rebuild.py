"""The parts that stand for what was folded at a root: its loads, and a line or units to them."""

from __future__ import annotations

import math
from collections.abc import Container
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..parts import Feeder, InlineTransformer, Line, LineCode, Load, Place, Regulator, Switch
from .equivalent import Equivalent, Fit, across

__all__ = ["Stub", "WasAt", "free_name", "moved_load", "names_in", "stub_of"]

Complex = NDArray[np.complex128]

SHORTEST_KM = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Stub:
    """The way from a root to the bus where its folded loads stand."""

    bus: str
    line: Line | None = None
    code: LineCode | None = None
    units: tuple[InlineTransformer, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class WasAt:
    """Where a load stood: what its branches were, at the level of the fold."""

    y_s: complex  #: of a branch, at its voltage
    factors: tuple[float, float]  #: its law's on conductance and susceptance, at ``v_pu``
    v_pu: float  #: of a branch, for its law


def moved_load(load: Load, bus: str, how: tuple[Fit, bool], was: WasAt, v: Complex) -> Load:
    """Return the load as it stands at ``bus``.

    Parameters
    ----------
    load : Load
    bus : str
    how : Fit, bool
        Where between the root's phases, and whether units have made phases of these pairs.
    was : WasAt
    v : (3,) array
        Voltages before the load, in the phases of the root.
    """
    fit, paired = how
    here = across(fit.phases, fit.connection)
    kv = float(np.abs(here @ v).mean()) / was.v_pu / 1000.0
    y = fit.share * was.y_s
    # what its law makes of it here, it has taken already
    g, b = (value / factor for value, factor in zip((y.real, y.imag), was.factors, strict=True))
    kva = complex(g, -b) * kv**2 * 1000.0 * len(here)
    return replace(
        load,
        place=Place(bus=bus),
        connection="wye" if paired else fit.connection,
        phases=fit.phases if not paired or fit.phases == "abc" else fit.phases[0],
        branch_kv=kv,
        kw=max(kva.real, 0.0) if load.kw >= 0.0 else kva.real,
        power_factor=1.0,
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
    kind = equivalent.kind
    if kind == "bus":
        return Stub(bus=root)
    if kind == "units":
        return Stub(bus=bus, units=_units(ends, equivalent, rating))
    between = bus if kind == "line" else f"{bus}.line"
    line, code = _line((root, between), equivalent, km, frequency_hz)
    units = () if kind == "line" else _units((between, bus), equivalent, rating)
    return Stub(bus=bus, line=line, code=code, units=units)


def _line(
    ends: tuple[str, str], equivalent: Equivalent, km: float, frequency_hz: float
) -> tuple[Line, LineCode]:
    """A line of a code of its own, in the phases that have an impedance."""
    root, bus = ends
    z = equivalent.line_z_ohm
    rows = np.flatnonzero(z.diagonal() != 0.0)
    chosen = np.ix_(rows, rows)
    length = max(km, SHORTEST_KM)
    nf = 2.0 * equivalent.half_s[chosen].imag / (math.tau * frequency_hz) * 1e9
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
    ends: tuple[str, str], equivalent: Equivalent, rating: tuple[float, float]
) -> tuple[InlineTransformer, ...]:
    """Single-phase transformers of ratio one, with their share of what the folded ones took."""
    root, bus = ends
    kva, volts = rating
    kv = volts / 1000.0 * (3.0**0.5 if equivalent.paired else 1.0)
    base = kv**2 * 1000.0 / kva
    pairs = ("ab", "bc", "ca") if equivalent.paired else ("a", "b", "c")
    return tuple(
        InlineTransformer(
            name=f"{bus}.{phases}",
            from_bus=root,
            to_bus=bus,
            connection="single",
            rating_kva=kva,
            kv_from=kv,
            kv_to=kv,
            leakage_pu=complex(equivalent.unit_z_ohm[row] / base),
            magnetizing_pu=complex(equivalent.unit_y_s[row] * base),
            phases=phases,
            to_phases="abc"[row],
        )
        for row, phases in enumerate(pairs)
        if equivalent.unit_z_ohm[row] != 0.0
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
