"""Exact counts for every setting that a relay can hold.

An event is one row or several. Its base row trips a terminal exactly where
I_set <= |ΔI1|, Z_set <= reach and V_set >= |ΔV1|: one corner of the grid of settings. A
fallback row (a phase, by section VI of the paper) does so too, with numbers of its own, but
only where I_set exceeds the base row's |ΔI1|. So the settings that trip are a box, and beyond
it a union of boxes with a common lower face; inclusion and exclusion write that union as a
sum of corners with signs. A histogram of corners, summed towards the origin, is the number
of events that trip at every setting, each counted once; histograms of blocks add.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Corners", "Grid", "corners_of", "count_tensor", "merge"]

Real = NDArray[np.float64]
Int = NDArray[np.int64]
Cells = tuple[Int, Int, Int]
"""Indices on the axes V, I, Z, each (n,)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Grid:
    """The representable settings: increasing, the very floats that a detector compares with."""

    i_set_a: Real  #: (nI,)
    v_set_pu: Real  #: (nV,)
    z_set_ohm: Real  #: (nZ,)

    @property
    def shape(self) -> tuple[int, int, int]:
        """(nV, nI, nZ), the axes of every tensor over the grid."""
        return self.v_set_pu.size, self.i_set_a.size, self.z_set_ohm.size


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Corners:
    """A sparse histogram: the sum of the signs of the corners in each grid cell.

    Only what :func:`count_tensor` makes of it counts events: one with fallback rows may have
    several corners, some of them negative.
    """

    cell: Int  #: (n,) flat index into ``Grid.shape``, increasing
    count: Int  #: (n,) never 0


def corners_of(grid: Grid, di_a: Real, dv_pu: Real, z_ohm: Real) -> Corners:
    """Histogram of the events' corners; what trips at no setting is in no cell.

    Parameters
    ----------
    grid : Grid
    di_a, dv_pu, z_ohm : (S,) or (K, S) arrays
        Per event, or row and event, the magnitude of the current's change, that of the
        voltage's, and the largest Z_set that still trips (0: none). Row 0 is the base row,
        the others trip only where ``di_a[0] < I_set``. A row with a NaN trips nothing, nor
        do fallback rows whose base row has no current.
    """
    di, dv, z = (np.atleast_2d(x) for x in (di_a, dv_pu, z_ohm))
    able = (di >= grid.i_set_a[0]) & (dv <= grid.v_set_pu[-1]) & (z >= grid.z_set_ohm[0])
    able[1:] &= di[1:] > di[0]
    base = able[0]
    flat = [np.ravel_multi_index(_cells(grid, di[0, base], dv[0, base], z[0, base]), grid.shape)]
    sign = [np.ones(flat[0].size, np.int64)]
    # most events have no usable fallback row, and end here
    further = np.flatnonzero(able[1:].any(axis=0))
    if further.size:
        cap = np.searchsorted(grid.i_set_a, di[0, further], side="right") - 1
        rows = _cells(grid, di[1:, further], dv[1:, further], z[1:, further])
        for cells, each in _beyond(cap, rows, able[1:, further]):
            flat.append(np.ravel_multi_index(cells, grid.shape))
            sign.append(np.full(flat[-1].size, each))
    return _summed(np.concatenate(flat), np.concatenate(sign))


def _cells(grid: Grid, di_a: Real, dv_pu: Real, z_ohm: Real) -> Cells:
    """The outermost setting that a row trips: lowest V_set, highest I_set and Z_set."""
    return (
        np.searchsorted(grid.v_set_pu, dv_pu, side="left"),
        np.searchsorted(grid.i_set_a, di_a, side="right") - 1,
        np.searchsorted(grid.z_set_ohm, z_ohm, side="right") - 1,
    )


def _beyond(cap: Int, rows: Cells, able: NDArray[np.bool_]) -> Iterator[tuple[Cells, int]]:
    """Signed corners of the union of an event's boxes, all beyond index ``cap`` of I_set.

    Boxes of some rows have in common the box of the least I_set and Z_set and the largest
    V_set; each box is a corner less the corner at ``cap``.
    """
    v, i, z = rows
    able = able & (i > cap)  # between cap and |ΔI| there may be no setting of the device
    for size in range(1, len(able) + 1):
        sign = 1 if size % 2 else -1
        for some in map(list, combinations(range(len(able)), size)):
            own = np.flatnonzero(able[some].all(axis=0))
            if not own.size:
                continue
            part = np.array(some)[:, None], own
            low, high, reach = cap[own], i[part].min(axis=0), z[part].min(axis=0)
            least_v = v[part].max(axis=0)
            yield (least_v, high, reach), sign
            inner = low >= 0
            yield (least_v[inner], low[inner], reach[inner]), -sign


def merge(parts: list[Corners]) -> Corners:
    """The histogram of all events of ``parts``, whatever their order."""
    if not parts:
        return Corners(cell=np.empty(0, np.int64), count=np.empty(0, np.int64))
    return _summed(
        np.concatenate([p.cell for p in parts]), np.concatenate([p.count for p in parts])
    )


def _summed(cell: NDArray[np.intp], count: Int) -> Corners:
    """Each cell once, with the sum of its counts; what cancels is left out."""
    order = np.argsort(cell)
    cell, count = cell[order].astype(np.int64, copy=False), count[order]
    first = np.flatnonzero(np.diff(cell, prepend=-1))
    total = np.add.reduceat(count, first) if first.size else count
    left = total != 0
    return Corners(cell=cell[first][left], count=total[left])


def count_tensor(grid: Grid, corners: Corners) -> Int:
    """Trips at every setting, shape ``grid.shape``: (V_set, I_set, Z_set)."""
    tensor = np.zeros(int(np.prod(grid.shape)), np.int64)
    tensor[corners.cell] = corners.count
    tensor = tensor.reshape(grid.shape)
    tensor = np.cumsum(tensor, axis=0)
    tensor = np.cumsum(tensor[:, ::-1], axis=1)[:, ::-1]
    return np.ascontiguousarray(np.cumsum(tensor[:, :, ::-1], axis=2)[:, :, ::-1])
