"""What perfect instruments at the measuring points report of solved states."""

from __future__ import annotations

import numpy as np
from oracles.scenes import Scene, looks

from openphase.detector.evidence import Phasors
from openphase.model.points import into_line
from openphase.model.states import State

__all__ = ["true_phasors"]


def true_phasors(at: Scene, before: State, after: State) -> Phasors:
    """Both frames of every scenario."""
    probe = 2 * at.points.edge + at.points.below
    into = into_line(at.points)[:, None, None]
    frames = [looks(at, state) for state in (before, after)]
    v = np.broadcast_arrays(*(frame.v[at.points.node] for frame in frames))
    i = np.broadcast_arrays(*(frame.i[probe] for frame in frames))
    return Phasors(v=np.stack(v), i=np.stack(i) * into)
