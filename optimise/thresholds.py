"""The best representable setting: the most breaks found, no false trip, a margin kept.

Every setting of the grid is looked at, so the answer is exact. Many settings are equally
good; among those within one standard error of the best the order is: largest security
margin, most breaks still found when the settings are stiffened by the demanded margin,
nearest to the reference setting.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from .counts import Corners, Grid, count_tensor, merge
from .staircase import Front, margins, merge_fronts
from .windows import Window

__all__ = ["Choice", "Obstacle", "Refusal", "Sample", "allowed", "choose", "pool"]

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A chosen setting and what the training sample says of it."""

    i_set_a: float
    v_set_pu: float
    z_set_ohm: float
    detected: int
    margin: float


class Obstacle(Enum):
    """What leaves no setting to choose."""

    EMPTY_WINDOW = auto()  #: no Z_set lies in the window, whatever the device
    COARSE_DEVICE = auto()  #: some do, but none that the device can hold
    WINDOW_MARGIN = auto()  #: none in the window keeps the margin; outside there are some
    MARGIN = auto()  #: none at all keeps the margin


@dataclass(frozen=True, slots=True, kw_only=True)
class Refusal:
    """Why there is no choice."""

    obstacle: Obstacle
    closest: Choice | None  #: the most secure setting in the window; None: there is none in it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """What a training sample says about one terminal."""

    opens: Corners  #: breaks that must be found
    stiff: Corners  #: the same with |ΔI| and reach divided, |ΔV| multiplied by the margin
    trials: int  #: how many breaks there were, found or not
    front: Front  #: events that must not trip


def pool(samples: Sequence[Sample]) -> Sample:
    """One sample of several states of the network, for one setting that must serve in all.

    A break counts alike whichever state it was drawn in: equal numbers of breaks give the
    states equal weight.
    """
    return Sample(
        opens=merge([own.opens for own in samples]),
        stiff=merge([own.stiff for own in samples]),
        trials=sum(own.trials for own in samples),
        front=merge_fronts([own.front for own in samples]),
    )


def allowed(grid: Grid, front: Front, margin: float) -> Mask:
    """Settings that keep ``margin`` to every event of the front, shape ``grid.shape``.

    For no m from 1 to ``margin`` may an event trip the setting (I/m, V m, Z/m). A row asks
    for m >= max(1, I/|ΔI|, Z/reach, |ΔV|/V) and m < I/cap, so at one I_set it bars a
    quadrant of V_set and Z_set.
    """
    barred = np.zeros(grid.shape, np.bool_)
    for n, i_set_a in enumerate(grid.i_set_a):
        able = (front.cap_a < i_set_a) & (i_set_a <= front.di_a * margin)
        dv, z, cap = front.dv_pu[able], front.z_ohm[able], front.cap_a[able]
        with np.errstate(divide="ignore"):
            room = i_set_a / cap  # the least m that no longer trips
        # up to the margin itself, and below the room
        v = np.maximum(
            np.searchsorted(grid.v_set_pu, dv / margin, side="left"),
            np.searchsorted(grid.v_set_pu, dv / room, side="right"),
        )
        z = np.minimum(
            np.searchsorted(grid.z_set_ohm, z * margin, side="right"),
            np.searchsorted(grid.z_set_ohm, z * room, side="left"),
        )
        some = (v < grid.v_set_pu.size) & (z > 0)
        barred[v[some], n, z[some] - 1] = True
    barred = np.logical_or.accumulate(barred, axis=0)
    return ~np.logical_or.accumulate(barred[:, :, ::-1], axis=2)[:, :, ::-1]


def choose(
    grid: Grid,
    sample: Sample,
    margin: float,
    reference: tuple[float, float, float],
    only_v: int | None = None,
    window: Window | None = None,
) -> Choice | Refusal:
    """The best setting of the grid, or why there is none.

    Parameters
    ----------
    grid : Grid
    sample : Sample
        The training sample of one terminal, or of several states pooled.
    margin : float
        Demanded margin, at least 1.
    reference : tuple of (I_set, V_set, Z_set)
        Where ties end: amperes, pu, ohms.
    only_v : int, optional
        Look only at this index of ``grid.v_set_pu``.
    window : Window, optional
        Look only at Z_set in it.
    """
    z_able = np.ones(grid.shape[2], np.bool_) if window is None else window.holds(grid.z_set_ohm)
    if window is not None and not z_able.any():
        obstacle = Obstacle.EMPTY_WINDOW if window.empty else Obstacle.COARSE_DEVICE
        return Refusal(obstacle=obstacle, closest=None)
    v_able = np.ones(grid.shape[0], np.bool_)
    if only_v is not None:
        v_able[:] = np.arange(v_able.size) == only_v
    keeps = allowed(grid, sample.front, margin) & v_able[:, None, None]
    free = keeps & z_able
    found = count_tensor(grid, sample.opens)
    if free.any():
        best = int(found[free].max())
        n = sample.trials
        error = np.sqrt(best * (n - best) / n) if n else 0.0
        return _first(grid, sample, reference, found, free & (found >= best - error))
    # the larger Z_set and the smaller V_set the more secure; of I_set that holds without caps only
    secure = np.zeros(grid.shape, np.bool_)
    secure[np.flatnonzero(v_able)[0], :, np.flatnonzero(z_able)[-1]] = True
    return Refusal(
        obstacle=Obstacle.WINDOW_MARGIN if keeps.any() else Obstacle.MARGIN,
        closest=_first(grid, sample, reference, found, secure),
    )


def _first(
    grid: Grid,
    sample: Sample,
    reference: tuple[float, float, float],
    found: NDArray[np.int64],
    among: Mask,
) -> Choice:
    """The first of these settings: by security, stiff breaks, nearness to the reference."""
    v, i, z = np.nonzero(among)
    # a larger Z_set is never less secure: the last of a column tells which columns can win
    column = np.cumsum(np.diff(v * grid.shape[1] + i, prepend=-1) != 0) - 1
    last = np.flatnonzero(np.diff(column, append=-1) != 0)
    most = margins(
        sample.front, grid.i_set_a[i[last]], grid.v_set_pu[v[last]], grid.z_set_ohm[z[last]]
    )
    won = (most == most.max())[column]
    v, i, z = v[won], i[won], z[won]
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
