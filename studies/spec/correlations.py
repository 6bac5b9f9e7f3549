"""What has one value per scenario, drawn together so that it may be correlated."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...model.copula import contradiction, joint_uniforms, normal_correlations
from ...model.distributions import Distribution, Uniform
from .parts import Correlation, Study

__all__ = ["SCALARS", "contradicting", "draw_scalars", "scalar_of"]


def _source_change(study: Study) -> Distribution:
    most = study.ambient.source_pct
    return Uniform(low=-most, high=most)


def _exponent(study: Study) -> Distribution | None:
    drawn = study.loads.exponent
    return None if isinstance(drawn, str) else drawn


_SCALARS: dict[str, Callable[[Study], Distribution | None]] = {
    "loads.level": lambda study: study.loads.level,
    "loads.exponent": _exponent,
    "motors.share": lambda study: study.motors.share,
    "motors.y2_y1": lambda study: study.motors.y2_y1,
    "transformers.yg_d_count": lambda study: study.transformers.yg_d_count,
    "ders.level": lambda study: study.ders.level,
    "ambient.source_pct": _source_change,
}

SCALARS = tuple(_SCALARS)
"""Quantities with one value per scenario, by their table and key in a study file."""


def scalar_of(study: Study, name: str) -> Distribution | None:
    """Return the distribution of one of `SCALARS`; None where the feeder file has the values."""
    return _SCALARS[name](study)


def draw_scalars(
    rng: np.random.Generator, study: Study, size: int
) -> dict[str, NDArray[np.float64]]:
    """Draw the values of all `SCALARS` in ``size`` scenarios, correlated as the study says.

    Those that the feeder file decides are left out. The same random numbers are taken
    whatever the study says, so that studies differ only in what they draw differently.
    ``ambient.source_pct`` is the change itself, up or down. What was measured somewhere is
    there as ``measured.`` and the place: it takes the same random number as ``loads.level``.
    """
    uniforms = joint_uniforms(rng, size, _matrix(study.correlations))
    common = uniforms[SCALARS.index("loads.level")]
    drawn = {f"measured.{item.point}": item.level.quantile(common) for item in study.measured}
    for name, u in zip(SCALARS, uniforms, strict=True):
        distribution = scalar_of(study, name)
        if distribution is not None:
            drawn[name] = distribution.quantile(u)
    return drawn


def contradicting(correlations: tuple[Correlation, ...]) -> tuple[int, ...]:
    """Return the indices of those correlations that cannot all hold at once."""
    names = {SCALARS[k] for k in contradiction(_matrix(correlations))}
    return tuple(n for n, item in enumerate(correlations) if names.issuperset(item.between))


def _matrix(correlations: tuple[Correlation, ...]) -> NDArray[np.float64]:
    ranks = {
        (SCALARS.index(one), SCALARS.index(other)): item.rank
        for item in correlations
        for one, other in [item.between]
    }
    return normal_correlations(len(SCALARS), ranks)
