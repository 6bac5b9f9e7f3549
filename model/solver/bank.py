"""Transformer banks with what hangs on them, as a 3x3 shunt at their bus.

Everything is referred to HV. Winding pairs are T-equivalents: half the leakage ``zh``, the
magnetizing branch, the other half ``zl``; across each LV winding lies the load. In winding
quantities (voltages u at HV, w at the middle, e at LV) the load draws  y e - j.
"""

from __future__ import annotations

from ..compiled import compiled
from .bank_forms import delta_wye, wye_delta, wye_wye
from .matrix3 import (
    IDENTITY,
    Matrix,
    Vector,
    add,
    column_sums,
    inverse,
    outer,
    plus_diagonal,
    plus_everywhere,
    product,
    reciprocal,
    row_sums,
    times,
    weighted,
)

__all__ = ["D_D", "D_YG", "YG_D", "YG_YG", "Y_D", "bank", "plain_bank"]

YG_YG, D_YG, YG_D, Y_D, D_D = 0, 1, 2, 3, 4  #: winding connections, HV first

ROOT = complex(3.0**-0.5)
TO_DELTA: Matrix = (ROOT, -ROOT, 0j, 0j, ROOT, -ROOT, -ROOT, 0j, ROOT)  #: u = TO_DELTA V
FROM_DELTA: Matrix = (ROOT, 0j, -ROOT, -ROOT, ROOT, 0j, 0j, -ROOT, ROOT)  #: its transpose


@compiled
def plain_bank(
    connection: int, zh: complex, zl: complex, y0: complex, y: Vector
) -> tuple[Matrix, Matrix]:
    """``bank`` without magnetizing branch, ``y`` alone across each winding: shunt and winding.

    Only for the connections up to ``YG_D``.
    """
    if connection == D_YG:
        return delta_wye(zh + zl, y)
    if connection == YG_D:
        return wye_delta(zh + zl, y)
    return wye_wye(zh, zl, y0, y)


@compiled
def bank(
    connection: int, zh: complex, zl: complex, y0: complex, ym: complex, y: Matrix, j: Vector
) -> tuple[Matrix, Vector, Matrix, Vector]:
    """What the bank draws from its bus, and its LV winding voltages.

    ``ym`` is the magnetizing admittance of each winding pair, ``y0`` what a three-limb
    Yg/Yg core adds to it in the zero sequence. A load directly on the bus is a bank without
    leakage: wye as Yg/Yg, delta as D/Yg.

    Returns
    -------
    shunt, drawn, winding, fed : matrix, vector, matrix, vector
        The bus current is  shunt V + drawn,  the winding voltages are  winding V + fed.
    """
    if connection >= YG_D:
        w_y, w_j, e_w, e_j = _low_delta(zl, y, j)
    else:
        w_y, w_j, e_w, e_j = _low_wye(zl, y, j)
    if ym != 0.0:
        w_y = plus_diagonal(w_y, (ym, ym, ym))
    if connection == YG_YG and y0 != 0.0:
        w_y = plus_everywhere(w_y, y0 / 3.0)
    if zh != 0.0:
        # w = (1 + zh w_y)^-1 (u - zh w_j)
        f = inverse(plus_diagonal(weighted(w_y, zh), (1 + 0j, 1 + 0j, 1 + 0j)))
        u_y, u_j = product(w_y, f), times(f, w_j)
        e_u = product(e_w, f)
        back = times(e_u, w_j)
        e_j = (e_j[0] - zh * back[0], e_j[1] - zh * back[1], e_j[2] - zh * back[2])
    else:
        u_y, u_j, e_u = w_y, w_j, e_w
    if connection in (D_YG, D_D):
        shunt = product(FROM_DELTA, product(u_y, TO_DELTA))
        return shunt, times(FROM_DELTA, u_j), product(e_u, TO_DELTA), e_j
    if connection == Y_D:
        return _float_neutral(u_y, u_j, e_u, e_j)
    return u_y, u_j, e_u, e_j


@compiled
def _low_wye(z: complex, y: Matrix, j: Vector) -> tuple[Matrix, Vector, Matrix, Vector]:
    """From the middle down, LV in grounded wye: e = (1 + z y)^-1 (w + z j)."""
    if z == 0.0:
        return y, (-j[0], -j[1], -j[2]), IDENTITY, (0j, 0j, 0j)
    g = inverse(plus_diagonal(weighted(y, z), (1 + 0j, 1 + 0j, 1 + 0j)))
    lost = times(g, j)
    return (
        product(y, g),
        (-lost[0], -lost[1], -lost[2]),
        g,
        (z * lost[0], z * lost[1], z * lost[2]),
    )


@compiled
def _low_delta(z: complex, y: Matrix, j: Vector) -> tuple[Matrix, Vector, Matrix, Vector]:
    """From the middle down, LV in closed delta: a circulating current makes sum(e) zero.

    With G = (1 + z y)^-1 it is  z c = 1^T G (w + z j) / 1^T G 1; z must not be zero.
    """
    g = inverse(plus_diagonal(weighted(y, z), (1 + 0j, 1 + 0j, 1 + 0j)))
    sums = column_sums(g)
    share = reciprocal(sums[0] + sums[1] + sums[2])
    e_w = add(g, outer(row_sums(g), sums, -share))
    circulating = outer((1 + 0j, 1 + 0j, 1 + 0j), sums, share * reciprocal(z))
    w_y = add(product(y, e_w), circulating)
    e_j, drawn = times(e_w, j), times(w_y, j)
    return (
        w_y,
        (z * drawn[0] - j[0], z * drawn[1] - j[1], z * drawn[2] - j[2]),
        e_w,
        (z * e_j[0], z * e_j[1], z * e_j[2]),
    )


@compiled
def _float_neutral(
    u_y: Matrix, u_j: Vector, e_u: Matrix, e_j: Vector
) -> tuple[Matrix, Vector, Matrix, Vector]:
    """HV in wye without neutral: u = V - n, with the n at which the currents sum to zero."""
    rows, sums = row_sums(u_y), column_sums(u_y)
    share = reciprocal(sums[0] + sums[1] + sums[2])
    n_j = share * (u_j[0] + u_j[1] + u_j[2])
    windings = row_sums(e_u)
    return (
        add(u_y, outer(rows, sums, -share)),
        (u_j[0] - rows[0] * n_j, u_j[1] - rows[1] * n_j, u_j[2] - rows[2] * n_j),
        add(e_u, outer(windings, sums, -share)),
        (e_j[0] - windings[0] * n_j, e_j[1] - windings[1] * n_j, e_j[2] - windings[2] * n_j),
    )
