"""A load is switched on or off somewhere on a line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .base import Event, Places, no_event

__all__ = ["draw_load_step"]


def draw_load_step(
    rng: np.random.Generator,
    size: int,
    regions: Sequence[Places],
    kw: tuple[float, float],
    single_phase_share: float,
    exponent: tuple[float, float],
) -> Event:
    """A wye-grounded load at unity power factor, on or off with equal probability.

    Every region (section) is equally likely; within it the place is uniform in length.
    Power is uniform in ``kw``, on one phase with probability ``single_phase_share`` and
    shared by three otherwise; the voltage exponent is its own, uniform in ``exponent``.
    """
    region = rng.integers(len(regions), size=size)
    edge = np.empty(size, np.int64)
    share = np.empty(size)
    for n, places in enumerate(regions):
        here = region == n
        edge[here], share[here] = places.draw(rng, int(here.sum()))
    watts = rng.uniform(*kw, size) * 1000.0
    phase = rng.integers(3, size=size)
    single = rng.random(size) < single_phase_share
    per_phase = np.where(single, phase == np.arange(3)[:, None], 1.0 / 3.0) * watts
    on = rng.random(size) < 0.5
    return replace(
        no_event(size),
        edge=edge,
        share=share,
        step_before_w=np.where(on, 0.0, per_phase),
        step_after_w=np.where(on, per_phase, 0.0),
        step_exponent=rng.uniform(*exponent, size),
    )
