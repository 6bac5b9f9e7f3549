"""Loads as measured: scaled to their maximum, and how far below it they go."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...model.buses import bus_volts
from ...model.distributions import Distribution, Quantiles, Uniform
from ...model.load_regions import LoadRegions, load_regions, measurable
from ...model.machines import power_va
from ...model.parts import Feeder, Load
from ...model.reading.fields import did_you_mean
from ..spec.study_file import LoadDraw, MeasuredLoad
from .match import Match, by_name
from .readings import Readings, Unit

__all__ = ["with_peaks"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

STEPS = 50  #: of probability, in which hourly values are kept
DIGITS = 5
MANY_LOST = 0.1  #: share of hours without a solution that is worth a sentence


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Region:
    """A region's solution.

    Parameters
    ----------
    factor
        On its loads, at each reading; NaN where there is no solution.
    through_kva
        What the place sees then, all that is beyond it included.
    """

    factor: Real
    through_kva: Complex


def with_peaks(
    feeder: Feeder, readings: Readings
) -> tuple[Feeder, tuple[MeasuredLoad, ...], Match]:
    """Scale the feeder's loads to what was measured, and say how a study draws them.

    A measured place, a measuring point or the source's bus, sees the loads beyond it; those that no
    further measured place sees are its own. They get one factor, such that what flows there at
    the measured maximum is what was measured: √3 V I at nominal voltage, or kW. Every load
    keeps its power factor; capacitors count, losses and the lines' charging do not, and
    generation does not run. The level that a study draws then is the measured minimum over the
    maximum to 1, or the quantiles of the hourly factors.

    Returns
    -------
    tuple
        The feeder, the levels for a study, and what was joined.
    """
    known = measurable(feeder)
    values: dict[str, Real] = {}
    not_joined: list[tuple[str, str]] = []
    for written, own in readings.values.items():
        name = by_name(known, written)
        if name is None:
            near = did_you_mean(written, known)
            not_joined.append((written, f"no measuring point, nor the source's bus{near}"))
        elif name in values:
            not_joined.append((written, f"an earlier one speaks of {name}"))
        elif np.isnan(own).all():
            not_joined.append((written, "nothing was read there"))
        else:
            values[name] = own
    regions = load_regions(feeder, tuple(values))
    loop = "it lies in a closed loop, and does not see all of its load"
    not_joined += [(name, loop) for name in regions.in_loop]
    solved = _solved(feeder, regions, readings.unit, values)
    scale = np.ones(len(feeder.loads))
    measured: list[MeasuredLoad] = []
    notes = [*readings.notes]
    for n, name in enumerate(regions.names):
        why = _why_not(regions, n, solved[n], readings, values[name])
        if why is not None:
            not_joined.append((name, why))
            continue
        level, peak, said = _level(solved[n].factor, values[name], readings.hourly)
        scale[list(regions.loads[n])] = peak
        measured.append(MeasuredLoad(point=name, level=level))
        before = sum(feeder.loads[k].kw for k in regions.loads[n])
        notes.append(
            f"{name}{_at_kv(feeder, name, readings.unit)}: "
            f"{len(regions.loads[n])} loads scaled by {peak:.4g} "
            f"from {before:.4g} to {before * peak:.4g} kW; {said}"
        )
        if regions.ders[n]:
            notes.append(f"{name}: {len(regions.ders[n])} DER are taken as standing still")
    joined = [item.point for item in measured]
    rest = len(feeder.loads) - sum(
        len(own) for name, own in zip(regions.names, regions.loads, strict=True) if name in joined
    )
    if rest:
        notes.append(f"{rest} of {len(feeder.loads)} loads are seen by no joined row")
    scaled = tuple(_times(load, factor) for load, factor in zip(feeder.loads, scale, strict=True))
    match = Match(
        source=readings.source,
        what="measured places",
        joined=tuple(joined),
        not_joined=tuple(not_joined),
        without_row=tuple(p.name for p in feeder.points if p.name not in values),
        notes=tuple(notes),
    )
    return replace(feeder, loads=scaled), tuple(measured), match


def _at_kv(feeder: Feeder, name: str, unit: Unit) -> str:
    """The nominal voltage at which amperes are taken; above a substation's transformer it tells."""
    if unit != "a":
        return ""
    bus = next((point.bus for point in feeder.points if point.name == name), feeder.source.bus)
    return f" (A at {bus_volts(feeder)[bus] * 3.0**0.5 / 1000.0:.4g} kV)"


def _solved(
    feeder: Feeder, regions: LoadRegions, unit: Unit, values: Mapping[str, Real]
) -> dict[int, _Region]:
    """The factor of each region at each reading, from the far ends inwards."""
    volts = bus_volts(feeder)
    bus_of = {point.name: point.bus for point in feeder.points}
    solved: dict[int, _Region] = {}
    for n in regions.outwards_in():
        name = regions.names[n]
        own = sum((_kva(feeder.loads[k]) for k in regions.loads[n]), start=0j)
        kvar = sum(feeder.capacitors[k].kvar for k in regions.capacitors[n])
        other = np.full(values[name].shape, -1j * kvar, np.complex128)
        for far in regions.beyond[n]:
            other += solved[far].through_kva
        read = values[name]
        if unit == "a":
            read = read * 3.0 * volts[bus_of.get(name, feeder.source.bus)] / 1000.0
        factor = _factor(own, other, read, unit)
        # where there is none, what was read is still what flows
        shape = np.where(np.isnan(factor), 1.0, factor) * own + other
        size = np.abs(shape) if unit == "a" else shape.real
        with np.errstate(divide="ignore", invalid="ignore"):
            through = np.asarray(np.where(size > 0.0, shape / size, 1.0) * read, np.complex128)
        solved[n] = _Region(factor=factor, through_kva=through)
    return solved


def _factor(own: complex, other: Complex, read: Real, unit: Unit) -> Real:
    """The factor on ``own`` that makes what flows as large as was read; NaN without any > 0.

    In amperes that is |k own + other| = read, of whose two roots the larger counts.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        if unit == "kw":
            factor = (read - other.real) / np.float64(own.real)
        else:
            a = np.float64(abs(own) ** 2)
            half_b = (own.conjugate() * other).real
            c = np.abs(other) ** 2 - read**2
            factor = (-half_b + np.sqrt(half_b**2 - a * c)) / a
    return np.where(np.isfinite(factor) & (factor > 0.0), factor, np.nan)


def _why_not(
    regions: LoadRegions, n: int, region: _Region, readings: Readings, read: Real
) -> str | None:
    """Why a region cannot be scaled; None where it can."""
    if not regions.loads[n]:
        return "no load lies between it and the next measured places"
    unit = "kW" if readings.unit == "kw" else "A"
    if readings.hourly:
        if np.isnan(region.factor).all():
            return "the measured places beyond it take all that it sees, in every hour"
        return None
    if np.isnan(region.factor[0]):
        return f"what lies beyond it takes more than the {read[0]:g} {unit} that it sees at most"
    return None


def _level(factor: Real, read: Real, hourly: bool) -> tuple[Distribution, float, str]:
    """How a study draws a region's level, the factor at its maximum, and what to say of it."""
    if hourly:
        good = factor[~np.isnan(factor)]
        peak = float(good.max())
        shares = np.quantile(good / peak, np.linspace(0.0, 1.0, STEPS + 1))
        values = tuple(float(value) for value in np.round(shares, DIGITS))
        lost = int(np.sum(np.isnan(factor) & ~np.isnan(read)))
        said = f"level {values[0]:.3g} to 1 by {good.size} hours"
        if lost > MANY_LOST * factor.size:
            said += f", {lost} more without a solution: what lies beyond it takes more"
        return Quantiles(values=values), peak, said
    peak = float(factor[0])
    if np.isnan(read[1]):
        level = LoadDraw().level
        low, high = level.support
        return level, peak, f"no minimum is given: level {low:g} to {high:g}, a guess"
    share = float(np.round(min(factor[1] / peak, 1.0), DIGITS))
    if np.isnan(share):
        share = float(np.round(read[1] / read[0], DIGITS))
        said = f"level {share:.3g} to 1, as what was read: its own minimum cannot be told"
    else:
        said = f"level {share:.3g} to 1"
    return Uniform(low=share, high=1.0), peak, said


def _kva(load: Load) -> complex:
    if load.kvar is not None:
        return complex(load.kw, load.kvar)
    return power_va(load.kw, load.power_factor) / 1000.0


def _times(load: Load, factor: float) -> Load:
    if factor == 1.0:
        return load
    kvar = None if load.kvar is None else load.kvar * factor
    return replace(load, kw=load.kw * factor, kvar=kvar)
