"""Voltages that come loose: open phases at a break, and modes that a transformer leaves free.

Below such a place the network draws  I = W V + sum X_c V_c + x  from it, and  I' = X'_c V +
sum U_cd V_d + u  from the fork of each loop c whose chain runs through it (x and u where machines
feed in current). Along a loose mode e no current flows: e' I = 0. The voltage below is that above
plus a multiple of the mode,

    t = -(e' W V + sum e' X_c V_c + e' x) / (e' W e),

which goes everywhere; mode by mode, so that one, two or three are one thing. An open phase is
the mode of that phase alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, compiled_apart
from ..states import UNEARTHED, Tree, Work
from .matrix3 import IDENTITY, ZERO, reciprocal, store, store_vector

__all__ = [
    "DEAD",
    "FLOATING",
    "NOTHING_S",
    "SINGULAR",
    "UNDEFINED",
    "free_modes",
    "open_phases",
    "squared",
]

Flags = NDArray[np.bool_]
Row = tuple[complex, complex, complex, complex]  #: a mode's t per voltage above, and alone

DEAD = 1  #: an opened conductor's far side is connected to nothing, or to no source
FLOATING = 2  #: an opened conductor's far side has equipment, but no way to earth
UNDEFINED = 8  #: times 2^a: phase a has no voltage of its own beyond the break

SINGULAR = 1e-9  #: a driving-point admittance below this share of max|W| counts as zero
NOTHING_S = 1e-12  #: and so does one below this, which idle windings leave of rounding


@compiled
def start(work: Work, carried: Flags) -> float:
    """P is the identity, H is zero; returns the square of what counts as no admittance."""
    w = work.here[0]
    store(work.here, 1, IDENTITY)
    store_vector(work.here_j, 1, (0j, 0j, 0j))
    for c in range(carried.size):
        if carried[c]:
            store(work.here_h, c, ZERO)
    largest = 0.0
    for i in range(3):
        for j in range(3):
            largest = max(largest, squared(w[i, j]))
    return max(SINGULAR**2 * largest, NOTHING_S**2)


@compiled
def open_phases(mask: int, work: Work, carried: Flags) -> int:
    """Open the phases in ``mask``; returns flags.

    ``work.here`` holds W first, ``here_x`` X and ``here_j`` x, changed in place like the running
    X', U and u; they receive P, H and h: the voltage below the break is P V + sum H V_fork + h,
    V the voltage above it. A phase that is connected to nothing or to no earth below gets zero
    volts and a flag.
    """
    w, p = work.here[0], work.here[1]
    limit = start(work, carried)
    empty = 0
    for i in range(3):
        if max(squared(w[i, 0]), squared(w[i, 1]), squared(w[i, 2])) <= limit:
            empty |= 1 << i
    flags = 0
    for a in range(3):
        if not mask & (1 << a):
            continue
        zero = squared(w[a, a]) <= limit
        if zero:
            flags |= UNDEFINED << a
            flags |= DEAD if empty & (1 << a) else FLOATING
            for i in range(3):  # an opened phase that hangs on this one is as little defined
                if i != a and mask & (1 << i) and squared(p[i, a]) > SINGULAR**2:
                    flags |= UNDEFINED << i
        replace_phase(a, zero, work, carried)
    return flags


@compiled
def replace_phase(a: int, zero: bool, work: Work, carried: Flags) -> None:
    """Put the voltage of an open phase, or zero, in terms of the others."""
    w, p, x_j = work.here[0], work.here[1], work.here_j[0]
    here_x, xt, row = work.here_x, work.xt, work.row
    scale = 0j if zero else -reciprocal(w[a, a])
    own0, own1, own2, own_j = scale * w[a, 0], scale * w[a, 1], scale * w[a, 2], scale * x_j[a]
    if a == 0:
        own0 = 0j
    elif a == 1:
        own1 = 0j
    else:
        own2 = 0j
    chords = carried.size
    for c in range(chords):
        if carried[c]:
            for j in range(3):
                row[c, j] = scale * here_x[c, a, j]
    own = (own0, own1, own2, own_j)
    for i in range(3):
        add_row(work, carried, i, (w[i, a], p[i, a]), own)
        w[i, a] = p[i, a] = 0.0
        for c in range(chords):
            if carried[c]:
                add_fork_row(work, carried, (c, i), xt[c, i, a], own)
                xt[c, i, a] = 0.0
    for j in range(3):
        w[a, j] = 0.0
        for c in range(chords):
            if carried[c]:
                here_x[c, a, j] = 0.0
    x_j[a] = 0.0


@compiled
def add_row(work: Work, carried: Flags, i: int, factors: tuple[complex, complex], own: Row) -> None:
    """Add to row i of W, X and x, and of P, H and h, the row of the mode times a factor."""
    w, p, from_w, from_p = work.here[0], work.here[1], factors[0], factors[1]
    for j in range(3):
        w[i, j] += from_w * own[j]
        p[i, j] += from_p * own[j]
    work.here_j[0, i] += from_w * own[3]
    work.here_j[1, i] += from_p * own[3]
    for c in range(carried.size):
        if carried[c]:
            for j in range(3):
                work.here_x[c, i, j] += from_w * work.row[c, j]
                work.here_h[c, i, j] += from_p * work.row[c, j]


@compiled
def add_fork_row(
    work: Work, carried: Flags, where: tuple[int, int], factor: complex, own: Row
) -> None:
    """Add to a row of a loop's X', U and u the row of the mode times a factor."""
    c, i = where
    for j in range(3):
        work.xt[c, i, j] += factor * own[j]
        for d in range(carried.size):
            if carried[d]:
                work.u[c, d, i, j] += factor * work.row[d, j]
    work.u_j[c, i] += factor * own[3]


@compiled_apart
def free_modes(tree: Tree, k: int, work: Work, carried: Flags) -> int:
    """Let loose the modes of edge k at its lower end; returns flags.

    Like ``open_phases``, from any mode. Where the network below does not hold it either, it
    gets no voltage, and a flag.
    """
    p, x_j = work.here[1], work.here_j[0]
    here_x, xt, row = work.here_x, work.xt, work.row
    limit = start(work, carried)
    chords = carried.size
    flags = 0
    for n in range(tree.loose_from[k], tree.loose_from[k + 1]):
        e = tree.loose[n]
        from0, from1, from2 = w_times(work, e, 0), w_times(work, e, 1), w_times(work, e, 2)
        own0, own1, own2 = times_w(work, e, 0), times_w(work, e, 1), times_w(work, e, 2)
        driving = e[0] * from0 + e[1] * from1 + e[2] * from2
        if squared(driving) <= limit:
            flags |= UNEARTHED
            continue
        scale = -reciprocal(driving)
        own_j = scale * (e[0] * x_j[0] + e[1] * x_j[1] + e[2] * x_j[2])
        own = (scale * own0, scale * own1, scale * own2, own_j)
        for c in range(chords):
            if carried[c]:
                for j in range(3):
                    row[c, j] = scale * (
                        e[0] * here_x[c, 0, j] + e[1] * here_x[c, 1, j] + e[2] * here_x[c, 2, j]
                    )
        for i in range(3):
            from_w = from0 if i == 0 else (from1 if i == 1 else from2)
            from_p = p[i, 0] * e[0] + p[i, 1] * e[1] + p[i, 2] * e[2]
            add_row(work, carried, i, (from_w, from_p), own)
            for c in range(chords):
                if carried[c]:
                    from_xt = xt[c, i, 0] * e[0] + xt[c, i, 1] * e[1] + xt[c, i, 2] * e[2]
                    add_fork_row(work, carried, (c, i), from_xt, own)
    return flags


@compiled
def w_times(work: Work, e: NDArray[np.float64], i: int) -> complex:
    """``(W e)_i``."""
    w = work.here[0]
    return complex(w[i, 0] * e[0] + w[i, 1] * e[1] + w[i, 2] * e[2])


@compiled
def times_w(work: Work, e: NDArray[np.float64], j: int) -> complex:
    """``(e' W)_j``."""
    w = work.here[0]
    return complex(e[0] * w[0, j] + e[1] * w[1, j] + e[2] * w[2, j])


@compiled
def squared(value: complex) -> float:
    """``|value|**2``."""
    return value.real * value.real + value.imag * value.imag
