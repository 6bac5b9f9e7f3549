"""How loads of a feeder follow the voltage, as rows for the solver."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .parts import Feeder, Load
from .states import BY_LAW

__all__ = ["law_rows", "own_exponents"]

HELD_PU = 0.7  #: below it a load without limits of its own is a constant impedance


def law_rows(feeder: Feeder) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(L, 14) laws and (L,) whether they are none at all: a constant impedance.

    Columns 0 to 4 are P's constant impedance, current and power, an exponent and the share that
    goes with it, 5 to 9 are Q's; then the limits: least, most, and the voltage at which a load
    is back to its nominal impedance, 0 where it never is; last the exponent that counts at the
    limits, -1 for the law itself.
    """
    rows = np.array([_row(load) for load in feeder.loads], np.float64).reshape(-1, 14)
    p_linear, q_linear = (_is_impedance(rows[:, at : at + 5]) for at in (0, 5))
    return rows, p_linear & q_linear & np.isin(rows[:, 13], (-1.0, 2.0))


def own_exponents(feeder: Feeder) -> NDArray[np.float64]:
    """(L,) the file's exponent, or `BY_LAW` for a load that says more than that."""
    return np.array([_exponent(load) for load in feeder.loads], np.float64)


def _exponent(load: Load) -> float:
    plain = (
        load.zip is None
        and load.exponent_q in (None, load.exponent)
        and load.v_min_pu == HELD_PU
        and load.v_max_pu is None
        and load.v_low_pu is None
        and load.edge_exponent is None
    )
    return load.exponent if plain else BY_LAW


def _row(load: Load) -> list[float]:
    if load.zip is not None:
        p, q = [*load.zip[:3], 2.0, 0.0], [*load.zip[3:], 2.0, 0.0]
    else:
        exponent_q = load.exponent if load.exponent_q is None else load.exponent_q
        p, q = _of_exponent(load.exponent), _of_exponent(exponent_q)
    edge = -1.0 if load.edge_exponent is None else load.edge_exponent
    most = math.inf if load.v_max_pu is None else load.v_max_pu
    return [*p, *q, load.v_min_pu, most, load.v_low_pu or 0.0, edge]


def _of_exponent(exponent: float) -> list[float]:
    """Whole exponents are constant power, current or impedance, which cost no power function."""
    if exponent in (0.0, 1.0, 2.0):
        return [*(float(exponent == whole) for whole in (2.0, 1.0, 0.0)), 2.0, 0.0]
    return [0.0, 0.0, 0.0, exponent, 1.0]


def _is_impedance(law: NDArray[np.float64]) -> NDArray[np.bool_]:
    no_zip = (law[:, :3] == 0.0).all(axis=1) & (law[:, 3] == 2.0)
    return np.asarray(no_zip | ((law[:, 1:3] == 0.0).all(axis=1) & (law[:, 4] == 0.0)))
