"""What every load takes in every scenario: its factor, its voltage exponent, its ambient change.

With a thousand loads these draws are most of what a scenario costs beside its solution, and
memory sets their pace. So they are made some loads at a time, while these lie in the cache;
the random numbers and their order are those of whole arrays.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...model.distributions import Distribution
from ...model.states import BY_LAW
from ..spec.study_file import Study

__all__ = ["draw_loads"]

Real = NDArray[np.float64]

CACHED = 16_384  #: numbers handled together, 128 kB; changes no result


def draw_loads(
    rng: np.random.Generator, study: Study, level: Real, common_exponent: Real | None
) -> tuple[Real, Real, Real]:
    """Draw what loads take, ambient changes alone between the two times.

    Parameters
    ----------
    rng
        Three uniform numbers a load and scenario are taken from it, whatever the study says.
    study
    level : (L, S) array
        Factor on every load before it gets one of its own.
    common_exponent : (S,) array or None
        Voltage exponent common to all loads. None: each load follows its own law.

    Returns
    -------
    scale, exponent, later_scale : (L, S) arrays
        Factors on the loads ΔT ago, their exponents, and their factors now.
    """
    scale = np.empty(level.shape)
    for part in _parts(scale):
        np.multiply(level[part], _drawn(rng, study.loads.each, scale[part]), out=scale[part])
    exponent = np.empty(level.shape)
    most = study.loads.exponent_spread
    for part in _parts(exponent):
        spread = _uniform(rng, most, exponent[part])
        if common_exponent is not None:
            spread += common_exponent
            np.clip(spread, 0.0, 2.0, out=spread)
    if common_exponent is None:
        exponent.fill(BY_LAW)
    later_scale = np.empty(level.shape)
    most = study.ambient.load_pct
    for part in _parts(later_scale):
        change = _uniform(rng, most, later_scale[part])
        change /= 100.0
        change += 1.0
        change *= scale[part]
    return scale, exponent, later_scale


def _parts(values: Real) -> Iterator[slice]:
    """Rows of an array (L, S), some at a time, in order."""
    loads, size = values.shape
    step = max(CACHED // max(size, 1), 1)
    return (slice(k, k + step) for k in range(0, loads, step))


def _drawn(rng: np.random.Generator, law: Distribution, out: Real) -> Real:
    """As many draws as ``out`` has room for; the uniform numbers are left in it."""
    return law.quantile(rng.random(out=out))


def _uniform(rng: np.random.Generator, most: float, out: Real) -> Real:
    """Fill ``out`` with numbers between ``-most`` and ``most``, as ``rng.uniform`` draws them."""
    rng.random(out=out)
    out *= most - -most
    out += -most
    return out
