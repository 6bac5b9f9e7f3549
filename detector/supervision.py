"""Supervision of the wiring: what a terminal's two ends report while nothing happens.

It looks at the frame before the event, so that no event can look like wrong wiring, and doubts
only what a feeder in service cannot be. It sees

- swapped phases, or voltages alone: the negative sequence of V exceeds the positive;
- rotated phases at one end: the two ends' V1 lie far apart;
- two currents interchanged: I2 at least twice I1 and I0, beside voltages that have next to
  no V2, which no load makes; interchanging any two phases swaps the sizes of I1 and I2;
- one reversed current transformer: I2 or I0 exceeds I1, which no load makes that takes power
  in every phase, and turning one phase's current round leaves little of either. Seen
  whatever the phase while the true |I2| and |I0| are below a seventh of |I1|, and up to half
  of it for favourable angles. Where the section can be fed from both sides, phases may in truth
  carry power in opposite directions; there the turn, or the interchange, must also balance what
  the section takes, the sum of the currents into it;
- all current transformers of one end reversed: power flows out of the section at the end towards
  the source, or into it at the other. Only where the section can be fed from one side alone.

It does not see: currents below ``least_a``, so nothing at a point through which none flows;
labels wrong at both ends alike, or currents alone wrong by whole rotations; a reversal of all
currents in a closed loop or beside generation; one reversed or two interchanged in a current that
is itself very unbalanced. And beside generation together with much load on one or two phases a
phase may rightly carry power against the others: a false alarm.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ..model.compiled import compiled
from ..model.points import Terminal
from ..model.symmetrical import A
from .evidence import Phasors, reversed_terminals
from .superimpose import negative_sequence, positive_sequence, zero_sequence

__all__ = ["Alarm", "Limits", "fed_one_way", "wiring_alarm"]

Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Real = NDArray[np.float64]


class Alarm(IntEnum):
    """What is doubted, in the order in which it is told."""

    NONE = 0
    PHASE_ORDER = 1
    ENDS_APART = 2
    CURRENT_ORDER = 3
    ONE_CURRENT = 4
    ALL_CURRENTS = 5

    @property
    def text(self) -> str:
        """The doubt in a reader's words."""
        return _TEXT[self]


_TEXT = {
    Alarm.NONE: "none",
    Alarm.PHASE_ORDER: "voltages in the wrong phase order: |V2| above |V1|",
    Alarm.ENDS_APART: "V1 of the two ends far apart: labels rotated?",
    Alarm.CURRENT_ORDER: "two currents interchanged: |I2| far above |I1|",
    Alarm.ONE_CURRENT: "one current reversed: |I2| or |I0| above |I1|",
    Alarm.ALL_CURRENTS: "all currents of one end reversed: power flows towards the source",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """From where on the wiring is doubted.

    Parameters
    ----------
    live_pu : float
        Voltages are judged while every phase of the end (of both ends, to compare them) is
        above: a feeder in service is, with an open phase or an earth fault it need not be.
    apart_pu : float
        How far V1 of the two ends may lie apart, per unit of the larger: 29° or half its size.
        A section drops a tenth at most; a rotation makes 1.73.
    unbalance_pu : float
        V2 up to which interchanged currents are judged: twice what a supply may have for long
        (2 %, EN 50160) and some more. Above it motors and generators may in truth take more I2
        than I1, as beside a fault between two phases.
    least_a : float
        Positive-sequence current, for the direction of power its active part, below which
        currents are not judged: twenty times the error floor of 0.05 A of the contract.
    turned : float
        Share of I1 that I2 and I0 may have once the suspected current is turned round, or the
        suspected two are put back.
    taken : float
        Share that may be left of I2 and I0 of the sum of both ends' currents once the suspected
        are turned round or put back. In the paper's closed loop, with up to 500 kW on one phase
        anywhere, no state of 16,000 was doubted at a quarter, 140 at a half.
    """

    live_pu: float = 0.8
    apart_pu: float = 0.5
    unbalance_pu: float = 0.05
    least_a: float = 1.0
    turned: float = 0.5
    taken: float = 0.25


LIMITS = Limits()


def wiring_alarm(
    phasors: Phasors,
    terminals: tuple[Terminal, ...],
    v_nominal_v: float | Real,
    one_way: Flags | None = None,
    limits: Limits = LIMITS,
) -> NDArray[np.int8]:
    """An Alarm for every terminal and scenario, (T, S), from the frame before the event.

    Parameters
    ----------
    phasors : Phasors
    terminals : tuple of Terminal
    v_nominal_v : float or (P,) array
        Nominal phase voltage, of all points or of each.
    one_way : (T,) bool array, optional
        Sections that are fed from one side alone, whichever (``fed_one_way``). By default none.
    limits : Limits, optional

    Raises
    ------
    ValueError
        A terminal's other direction is not among ``terminals``.
    """
    nominal = np.broadcast_to(np.asarray(v_nominal_v, np.float64), phasors.v.shape[1:2])
    v, i = phasors.v[0], phasors.i[0]
    far = reversed_terminals(terminals)
    if (far < 0).any():
        raise ValueError("wiring is judged by both ends: give both directions of each section")
    v1, v_sizes = _sequences(v)
    i1, i_sizes = _sequences(i)
    v2 = v_sizes[1]
    live = v_sizes[3] >= limits.live_pu * nominal[:, None]
    disordered = live & (v2 > v_sizes[0])
    orderly = live & (v2 <= limits.unbalance_pu * nominal[:, None])
    turned = _turned(i, i_sizes, limits)
    crossed = _crossed(i_sizes, limits) & orderly[:, None]
    active_a = (i1 * v1.conj()).real / nominal[:, None]
    alarm = np.zeros((len(terminals), v.shape[-1]), np.int8)
    for t, terminal in enumerate(terminals):
        if far[t] < t:  # the other direction of a section that is judged
            alarm[t] = alarm[far[t]]
            continue
        ends = [terminal.local_point, terminal.remote_point]
        into = np.array([terminal.into, terminals[far[t]].into])
        sure = one_way is not None and bool(one_way[t])
        # the last assignment wins: what is told first is written last
        if sure:
            onward = np.where([terminal.load_side, not terminal.load_side], -into, into)
            back = active_a[ends] * onward[:, None] <= -limits.least_a
            alarm[t, back.any(axis=0)] = Alarm.ALL_CURRENTS
        for suspect, mend, doubt in (
            (turned, _turn, Alarm.ONE_CURRENT),
            (crossed, _cross, Alarm.CURRENT_ORDER),
        ):
            found = suspect[ends]
            if not sure and found.any():
                found = _balanced_by(mend, i[ends] * into[:, None, None], found, limits)
            alarm[t, found.any(axis=(0, 1))] = doubt
        ends_pu = v1[ends] / nominal[ends, None]
        gap = np.abs(ends_pu[0] - ends_pu[1])
        apart = gap > limits.apart_pu * np.abs(ends_pu).max(axis=0)
        alarm[t, apart & live[ends].all(axis=0)] = Alarm.ENDS_APART
        alarm[t, disordered[ends].any(axis=0)] = Alarm.PHASE_ORDER
    return alarm


def fed_one_way(terminals: tuple[Terminal, ...]) -> Flags:
    """(T,) sections of which just one end is a load side; of a feeder without generation."""
    far = reversed_terminals(terminals)
    load_side = np.array([terminal.load_side for terminal in terminals], np.bool_)
    return np.asarray((far >= 0) & (load_side != load_side[far]))


def _turned(i: Complex, sizes: Real, limits: Limits) -> Flags:
    """(P, 3, S): phases whose current, of (P, 3, S), seems to be turned round."""
    found = np.zeros(i.shape, np.bool_)
    size, i2, i0 = sizes[:3]
    suspect = np.maximum(i2, i0) > size
    if suspect.any():
        p, s = np.nonzero(suspect)
        for k in range(3):
            size, i2, i0 = _sizes(_turn(i[p, :, s].T, k))
            found[p, k, s] = np.maximum(i2, i0) <= limits.turned * size
            found[p, k, s] &= size >= limits.least_a
    return found


def _crossed(sizes: Real, limits: Limits) -> Flags:
    """(P, 3, S): phases k whose current seems to be that of k+1 and the reverse.

    The sizes of I1, I2 and I0 do not say which two: all three pairs, or none.
    """
    i1, size, i0 = sizes[:3]
    found = (np.maximum(i1, i0) <= limits.turned * size) & (size >= limits.least_a)
    return np.repeat(found[:, None], 3, axis=1)


def _balanced_by(
    mend: Callable[[Complex, int], Complex], inward: Complex, suspect: Flags, limits: Limits
) -> Flags:
    """Those of ``suspect`` (2 ends, 3, S) that, mended, let the section take balanced current."""
    found = suspect.copy()
    taken = inward.sum(axis=0)
    _, i2, i0 = _sizes(taken)
    most = limits.taken * np.maximum(i2, i0)
    for end, k in np.argwhere(suspect.any(axis=-1)):
        _, i2, i0 = _sizes(taken - inward[end] + mend(inward[end], k))
        found[end, k] &= np.maximum(i2, i0) <= most
    return found


def _sequences(abc: Complex) -> tuple[Complex, Real]:
    """Of phases (P, 3, S): X1, (P, S); and |X1|, |X2|, |X0| and the least phase, (4, P, S)."""
    points, _, size = abc.shape
    first, sizes = np.empty((points, size), np.complex128), np.empty((4, points, size))
    _fill_sequences(abc, first, sizes)
    return first, sizes


@compiled
def _fill_sequences(abc: Complex, first: Complex, sizes: Real) -> None:
    for p in range(abc.shape[0]):
        for s in range(abc.shape[2]):
            a, b, c = abc[p, 0, s], abc[p, 1, s], abc[p, 2, s]
            x1 = (a + A * b + A.conjugate() * c) / 3.0
            x2 = (a + A.conjugate() * b + A * c) / 3.0
            x0 = (a + b + c) / 3.0
            first[p, s] = x1
            sizes[0, p, s] = math.sqrt(x1.real * x1.real + x1.imag * x1.imag)
            sizes[1, p, s] = math.sqrt(x2.real * x2.real + x2.imag * x2.imag)
            sizes[2, p, s] = math.sqrt(x0.real * x0.real + x0.imag * x0.imag)
            least = min(
                a.real * a.real + a.imag * a.imag,
                b.real * b.real + b.imag * b.imag,
                c.real * c.real + c.imag * c.imag,
            )
            sizes[3, p, s] = math.sqrt(least)


def _sizes(i: Complex) -> tuple[Real, Real, Real]:
    """|I1|, |I2| and |I0| of phases on the axis before the last."""
    return np.abs(positive_sequence(i)), np.abs(negative_sequence(i)), np.abs(zero_sequence(i))


def _turn(i: Complex, k: int) -> Complex:
    """(3, S) with phase k turned round."""
    other = i.copy()
    other[k] *= -1.0
    return other


def _cross(i: Complex, k: int) -> Complex:
    """(3, S) with phases k and k+1 interchanged."""
    other = i.copy()
    other[[k, (k + 1) % 3]] = i[[(k + 1) % 3, k]]
    return other
