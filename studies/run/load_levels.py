"""The factor on every load: common to the feeder, or to what a measured place sees."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...model.load_regions import load_regions
from ...model.parts import Feeder
from ..spec.study_file import Study

__all__ = ["level_bounds", "load_levels", "load_places"]

Int = NDArray[np.int64]
Real = NDArray[np.float64]


def load_places(feeder: Feeder, study: Study) -> Int:
    """(L,) which of the study's measured places sees each load, -1 for none."""
    names = [item.point for item in study.measured]
    places = np.full(len(feeder.loads), -1, np.int64)
    if names:
        regions = load_regions(feeder, names)
        for name, loads in zip(regions.names, regions.loads, strict=True):
            places[list(loads)] = names.index(name)
    return places


def load_levels(study: Study, places: Int, scalars: Mapping[str, Real]) -> Real:
    """(L, S) level of every load, or (S,) where all have the common one."""
    common = scalars["loads.level"]
    if not study.measured:
        return common
    levels = np.stack([*(scalars[f"measured.{item.point}"] for item in study.measured), common])
    return np.asarray(levels[places])  # -1 is the last: the common one


def level_bounds(feeder: Feeder, study: Study) -> Real:
    """(L, 2) the least and the most that a study draws of each load, on the feeder file's kW."""
    levels = [item.level.support for item in study.measured]
    bounds = np.array([*levels, study.loads.level.support])
    return np.asarray(bounds[load_places(feeder, study)] * np.array(study.loads.each.support))
