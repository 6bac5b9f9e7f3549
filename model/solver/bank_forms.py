"""Banks in closed form, where their LV windings carry nothing but a load each.

The common case by far, and several times faster than ``bank``, which covers it too: the
tests hold the two together.
"""

from __future__ import annotations

from ..compiled import compiled
from .matrix3 import Matrix, Vector, reciprocal

__all__ = ["delta_wye", "wye_delta", "wye_wye"]


@compiled
def wye_wye(zh: complex, zl: complex, y0: complex, y: Vector) -> tuple[Matrix, Matrix]:
    """Shunt and LV winding voltages per bus voltage; the load ``y`` lies across each winding.

    ``w``: load behind zl. ``d``: zh above w. ``k``: what the shunt y0/3 in every entry adds.
    With F = diag(d) - k d d^T the voltage at the middle, Y = (diag(w) + y0/3) F.
    """
    g0 = reciprocal(1.0 + zl * y[0])
    g1 = reciprocal(1.0 + zl * y[1])
    g2 = reciprocal(1.0 + zl * y[2])
    w0, w1, w2 = y[0] * g0, y[1] * g1, y[2] * g2
    d0 = reciprocal(1.0 + zh * w0)
    d1 = reciprocal(1.0 + zh * w1)
    d2 = reciprocal(1.0 + zh * w2)
    third = y0 / 3.0
    spread = d0 + d1 + d2
    share = reciprocal(1.0 + zh * third * spread)
    k = zh * third * share
    # d_i d_j times this is entry (i, j) of Y beyond its diagonal: third*share - ... symmetric
    c = third * share
    shunt = (
        w0 * d0 + c * d0 * d0,
        c * d0 * d1,
        c * d0 * d2,
        c * d1 * d0,
        w1 * d1 + c * d1 * d1,
        c * d1 * d2,
        c * d2 * d0,
        c * d2 * d1,
        w2 * d2 + c * d2 * d2,
    )
    winding = (
        g0 * (d0 - k * d0 * d0),
        -g0 * k * d0 * d1,
        -g0 * k * d0 * d2,
        -g1 * k * d1 * d0,
        g1 * (d1 - k * d1 * d1),
        -g1 * k * d1 * d2,
        -g2 * k * d2 * d0,
        -g2 * k * d2 * d1,
        g2 * (d2 - k * d2 * d2),
    )
    return shunt, winding


@compiled
def delta_wye(z: complex, y: Vector) -> tuple[Matrix, Matrix]:
    """HV winding i lies between phases i and i+1, rated sqrt(3) times the phase voltage."""
    g0 = reciprocal(1.0 + z * y[0])
    g1 = reciprocal(1.0 + z * y[1])
    g2 = reciprocal(1.0 + z * y[2])
    b0, b1, b2 = y[0] * g0 / 3.0, y[1] * g1 / 3.0, y[2] * g2 / 3.0
    shunt = (b0 + b2, -b0, -b2, -b0, b0 + b1, -b1, -b2, -b1, b1 + b2)
    root = 3.0**-0.5
    r0, r1, r2 = root * g0, root * g1, root * g2
    zero = 0j
    winding = (r0, -r0, zero, zero, r1, -r1, -r2, zero, r2)
    return shunt, winding


@compiled
def wye_delta(z: complex, y: Vector) -> tuple[Matrix, Matrix]:
    """The closed LV delta forces its winding voltages to sum to zero; z must not be zero."""
    f0 = reciprocal(1.0 + z * y[0])
    f1 = reciprocal(1.0 + z * y[1])
    f2 = reciprocal(1.0 + z * y[2])
    c = reciprocal(f0 + f1 + f2)
    e = reciprocal(z)
    winding = (
        f0 - c * f0 * f0,
        -c * f0 * f1,
        -c * f0 * f2,
        -c * f1 * f0,
        f1 - c * f1 * f1,
        -c * f1 * f2,
        -c * f2 * f0,
        -c * f2 * f1,
        f2 - c * f2 * f2,
    )
    ce = c * e
    shunt = (
        y[0] * f0 + ce * f0 * f0,
        ce * f0 * f1,
        ce * f0 * f2,
        ce * f1 * f0,
        y[1] * f1 + ce * f1 * f1,
        ce * f1 * f2,
        ce * f2 * f0,
        ce * f2 * f1,
        y[2] * f2 + ce * f2 * f2,
    )
    return shunt, winding
