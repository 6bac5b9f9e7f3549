"""Exact counts for every setting that a relay can hold.

An event trips a terminal exactly where I_set <= |ΔI1|, Z_set <= reach and V_set >= |ΔV1|:
one corner of the grid of settings. A histogram of corners, summed towards the origin, is
the number of trips at every setting; histograms of blocks add.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Corners", "Grid", "corners_of", "count_tensor", "merge"]

Real = NDArray[np.float64]
Int = NDArray[np.int64]


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
    """A sparse histogram: how many events have their corner in each grid cell."""

    cell: Int  #: (n,) flat index into ``Grid.shape``, increasing
    count: Int  #: (n,)


def corners_of(grid: Grid, di1_a: Real, dv1_pu: Real, reach_ohm: Real) -> Corners:
    """Histogram of the events' corners; events that trip at no setting are in no cell.

    Parameters
    ----------
    grid : Grid
    di1_a, dv1_pu, reach_ohm : (S,) arrays
        Per event |ΔI1|, |ΔV1|, and the largest Z_set that still trips (0: none).
    """
    i = np.searchsorted(grid.i_set_a, di1_a, side="right") - 1
    z = np.searchsorted(grid.z_set_ohm, reach_ohm, side="right") - 1
    v = np.searchsorted(grid.v_set_pu, dv1_pu, side="left")
    inside = (i >= 0) & (z >= 0) & (v < grid.v_set_pu.size)
    flat = np.ravel_multi_index((v[inside], i[inside], z[inside]), grid.shape)
    cell, count = np.unique(flat, return_counts=True)
    return Corners(cell=cell.astype(np.int64), count=count.astype(np.int64))


def merge(parts: list[Corners]) -> Corners:
    """The histogram of all events of ``parts``, whatever their order."""
    if not parts:
        return Corners(cell=np.empty(0, np.int64), count=np.empty(0, np.int64))
    cell, place = np.unique(np.concatenate([p.cell for p in parts]), return_inverse=True)
    count = np.zeros(cell.size, np.int64)
    np.add.at(count, place, np.concatenate([p.count for p in parts]))
    return Corners(cell=cell, count=count)


def count_tensor(grid: Grid, corners: Corners) -> Int:
    """Trips at every setting, shape ``grid.shape``: (V_set, I_set, Z_set)."""
    tensor = np.zeros(int(np.prod(grid.shape)), np.int64)
    np.add.at(tensor, corners.cell, corners.count)
    tensor = tensor.reshape(grid.shape)
    tensor = np.cumsum(tensor, axis=0)
    tensor = np.cumsum(tensor[:, ::-1], axis=1)[:, ::-1]
    return np.ascontiguousarray(np.cumsum(tensor[:, :, ::-1], axis=2)[:, :, ::-1])
