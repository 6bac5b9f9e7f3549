"""The best representable setting: the most breaks found, no false trip, a margin kept.

Every setting of the grid is looked at, so the answer is exact. Many settings are equally
good; among those within one standard error of the best the order is: largest security
margin, most breaks still found when the settings are stiffened by the demanded margin,
nearest to the reference setting.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .counts import Corners, Grid, corners_of, count_tensor
from .staircase import Front, margins

__all__ = ["Choice", "Sample", "allowed", "choose"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A chosen setting and what the training sample says of it."""

    i_set_a: float
    v_set_pu: float
    z_set_ohm: float
    detected: int
    margin: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """What a training sample says about one terminal."""

    opens: Corners  #: breaks that must be found
    stiff: Corners  #: the same with |ΔI1| and reach divided, |ΔV1| multiplied by the margin
    trials: int  #: how many breaks there were, found or not
    front: Front  #: events that must not trip


def allowed(grid: Grid, front: Front, margin: float) -> NDArray[np.bool_]:
    """Settings that keep ``margin`` to every event of the front, shape ``grid.shape``.

    An event must not trip the setting (I/m, V m, Z/m), so it must not trip the setting
    itself when the event is magnified by m.
    """
    magnified = corners_of(
        grid, front.di1_a * margin, front.dv1_pu / margin, front.reach_ohm * margin
    )
    return np.asarray(count_tensor(grid, magnified) == 0)


def choose(
    grid: Grid,
    sample: Sample,
    margin: float,
    reference: tuple[float, float, float],
    only_v: int | None = None,
) -> Choice | None:
    """The best setting of the grid, or None where no setting keeps the margin.

    Parameters
    ----------
    grid : Grid
    sample : Sample
        The training sample of one terminal.
    margin : float
        Demanded margin, at least 1.
    reference : tuple of (I_set, V_set, Z_set)
        Where ties end: amperes, pu, ohms.
    only_v : int, optional
        Look only at this index of ``grid.v_set_pu``.
    """
    free = allowed(grid, sample.front, margin)
    if only_v is not None:
        mask = np.zeros(grid.shape[0], np.bool_)
        mask[only_v] = True
        free &= mask[:, None, None]
    if not free.any():
        return None
    found = np.where(free, count_tensor(grid, sample.opens), -1)
    best = int(found.max())
    n = sample.trials
    error = np.sqrt(best * (n - best) / n) if n else 0.0
    v, i, z = np.nonzero(free & (found >= best - error))
    settings = grid.i_set_a[i], grid.v_set_pu[v], grid.z_set_ohm[z]
    security = margins(sample.front, *settings)
    stiff = count_tensor(grid, sample.stiff)[v, i, z]
    distance = np.abs(np.log(np.stack(settings) / np.array(reference)[:, None])).sum(axis=0)
    # lexsort: last key first
    pick = int(np.lexsort((z, i, v, distance, -stiff, -security))[0])
    return Choice(
        i_set_a=float(settings[0][pick]),
        v_set_pu=float(settings[1][pick]),
        z_set_ohm=float(settings[2][pick]),
        detected=int(found[v[pick], i[pick], z[pick]]),
        margin=float(security[pick]),
    )
