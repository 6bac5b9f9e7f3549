"""From true phasors to what devices report: errors of transformers, clocks and measurement.

A reported phasor is the true one times (1 + r) exp(jθ) of its voltage or current transformer,
turned by what the point's clock is off, and, in the frame of now, by what the common reference
has run away over ΔT; and a random error is added, bounded by the total vector error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..model.compiled import compiled
from .evidence import Phasors

__all__ = ["Bounds", "Errors", "Wiring", "disc_noise", "draw_errors", "measure", "miswire"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Single = NDArray[np.float32]

SIGMAS = 3.0  #: the bound is this many standard deviations of either axis


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """How large each error can be.

    ``tve_pct`` bounds the random error of a phasor in percent of it (IEEE/IEC 60255-118-1),
    of a current never less than ``current_floor_a``: a percentage of nothing is no error at
    all. ``ratio_pct``, ``angle_mrad`` belong to a transformer, ``clock_us`` to a point's clock.
    ``frequency_hz`` is what the frequency of the phasors' common reference may be off.
    """

    tve_pct: float
    current_floor_a: float
    ratio_pct: float = 0.3
    angle_mrad: float = 5.0
    clock_us: float = 1.0
    frequency_hz: float = 0.0
    nominal_hz: float = 60.0
    dt_s: float = 0.8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Errors:
    """Errors of P points in S scenarios, each in units of its bound."""

    v_noise: Complex  #: (2, P, 3, S) a fresh one in each frame
    i_noise: Complex  #: (2, P, 3, S)
    v_ratio: Single  #: (P, 3, S) the same in both frames, as all below
    v_angle: Single  #: (P, 3, S)
    i_ratio: Single  #: (P, 3, S)
    i_angle: Single  #: (P, 3, S)
    clock: Single  #: (P, S)
    frequency: Single  #: (S,)


def draw_errors(rng: np.random.Generator, points: int, size: int) -> Errors:
    """Independent errors: random ones in a disc (``disc_noise``), the lasting ones uniform ±1."""
    frames, channels = (2, points, 3, size), (points, 3, size)
    return Errors(
        v_noise=disc_noise(rng, frames),
        i_noise=disc_noise(rng, frames),
        v_ratio=_uniform(rng, channels),
        v_angle=_uniform(rng, channels),
        i_ratio=_uniform(rng, channels),
        i_angle=_uniform(rng, channels),
        clock=_uniform(rng, (points, size)),
        frequency=_uniform(rng, (size,)),
    )


def disc_noise(rng: np.random.Generator, shape: tuple[int, ...]) -> Complex:
    """Complex errors in units of their bound, |e| <= 1.

    A normal law with standard deviation 1/3 per axis, truncated at radius 1: what falls
    outside (1.1 % of draws) is drawn again.
    """
    error = np.empty(shape, np.complex128)
    _fill(rng, error.reshape(-1))
    return error


def measure(v: Complex, i: Complex, errors: Errors, bounds: Bounds) -> Phasors:
    """Phasors as the points report them.

    Parameters
    ----------
    v, i : (2, P, 3, S) complex arrays
        True volts to earth, and amperes positive into each point's line, ΔT before and now.
    errors : Errors
    bounds : Bounds
    """
    omega = 2.0 * np.pi * bounds.nominal_hz
    turn = errors.clock * np.float64(omega * bounds.clock_us / 1e6)
    drift = errors.frequency * np.float64(2.0 * np.pi * bounds.frequency_hz * bounds.dt_s)
    now = np.exp(1j * drift) if drift.any() else np.ones(drift.shape, np.complex128)
    ratio, angle = bounds.ratio_pct / 100.0, bounds.angle_mrad / 1000.0
    tve, floor_a = bounds.tve_pct / 100.0, bounds.current_floor_a
    reported = Phasors(v=np.empty(v.shape, np.complex128), i=np.empty(i.shape, np.complex128))
    v_own = _Own(noise=errors.v_noise, ratio=errors.v_ratio, angle=errors.v_angle)
    i_own = _Own(noise=errors.i_noise, ratio=errors.i_ratio, angle=errors.i_angle)
    _report(v, v_own, turn, now, (ratio, angle, tve, 0.0), reported.v)
    _report(i, i_own, turn, now, (ratio, angle, tve, floor_a), reported.i)
    return reported


class _Own(NamedTuple):
    """Errors of one kind of phasor, as in ``Errors``, for compiled code."""

    noise: Complex
    ratio: Single
    angle: Single


@compiled
def _report(
    true: Complex,
    own: _Own,
    turn: Real,
    now: Complex,
    most: tuple[float, float, float, float],
    reported: Complex,
) -> None:
    """Fill ``reported`` (2, P, 3, S); ``most`` bounds ratio, angle, and noise with its floor."""
    _, points, phases, size = true.shape
    ratio, angle, tve, floor = most
    for p in range(points):
        for k in range(phases):
            for s in range(size):
                theta = own.angle[p, k, s] * angle + turn[p, s]
                gain = 1.0 + own.ratio[p, k, s] * ratio
                turned = complex(gain * math.cos(theta), gain * math.sin(theta))
                for frame in range(2):
                    x = true[frame, p, k, s]
                    bound = max(math.sqrt(x.real * x.real + x.imag * x.imag) * tve, floor)
                    noise = own.noise[frame, p, k, s] * bound
                    if frame == 1:
                        reported[frame, p, k, s] = x * turned * now[s] + noise
                    else:
                        reported[frame, p, k, s] = x * turned + noise


class Wiring(IntEnum):
    """How a measuring point can be wired wrongly."""

    RIGHT = 0
    SWAPPED_AB = 1  #: two phases change places, V and I alike
    SWAPPED_BC = 2
    SWAPPED_CA = 3
    VOLTAGES_SWAPPED_AB = 4  #: the voltages alone
    VOLTAGES_SWAPPED_BC = 5
    VOLTAGES_SWAPPED_CA = 6
    REVERSED_A = 7  #: one current transformer's polarity
    REVERSED_B = 8
    REVERSED_C = 9
    REVERSED_ALL = 10
    ROTATED_BCA = 11  #: a, b, c report phases b, c, a, V and I alike
    ROTATED_CAB = 12


_SWAPS = [[1, 0, 2], [0, 2, 1], [2, 1, 0]]
_ROTATIONS = [[1, 2, 0], [2, 0, 1]]
_RIGHT = [0, 1, 2]
#: (kind, channel): the phase that a channel of a point reports
_V_PHASE = np.array([_RIGHT, *_SWAPS, *_SWAPS, *[_RIGHT] * 4, *_ROTATIONS])
_I_PHASE = np.array([_RIGHT, *_SWAPS, *[_RIGHT] * 7, *_ROTATIONS])
_I_SIGN = np.ones((len(Wiring), 3))
_I_SIGN[[Wiring.REVERSED_A, Wiring.REVERSED_B, Wiring.REVERSED_C], _RIGHT] = -1.0
_I_SIGN[Wiring.REVERSED_ALL] = -1.0


def miswire(phasors: Phasors, point: NDArray[np.int64], kind: NDArray[np.int64]) -> Phasors:
    """What is reported where ``point`` (S,) is wired as ``kind`` (S,), a ``Wiring``, says."""
    v, i = phasors.v.copy(), phasors.i.copy()
    wrong = np.flatnonzero(kind)
    at, how = point[wrong], kind[wrong]
    for k in range(3):
        v[:, at, k, wrong] = phasors.v[:, at, _V_PHASE[how, k], wrong]
        i[:, at, k, wrong] = _I_SIGN[how, k] * phasors.i[:, at, _I_PHASE[how, k], wrong]
    return Phasors(v=v, i=i)


def _uniform(rng: np.random.Generator, shape: tuple[int, ...]) -> Single:
    values = rng.random(shape, np.float32)
    values *= 2.0
    values -= 1.0
    return values


@compiled
def _fill(rng: np.random.Generator, error: Complex) -> None:
    for k in range(error.size):
        x, y = rng.standard_normal(), rng.standard_normal()
        while x * x + y * y > SIGMAS * SIGMAS:
            x, y = rng.standard_normal(), rng.standard_normal()
        error[k] = complex(x / SIGMAS, y / SIGMAS)
