"""Random small feeders against the engine itself, where it is installed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from opendss.engine import new_context
from opendss.live import agreement
from opendss.random_mixed import random_cut, random_mixed_feeder

pytest.importorskip("dss", reason="needs the extra [opendss]")

LIMIT_PU = 1e-6
FEEDERS = 40
CUTS = 2


@pytest.fixture(scope="module")
def engine() -> Any:
    return new_context()


@pytest.mark.parametrize("loops", [0, 1, 3])
def test_random_feeders_agree_before_and_after_breaks(engine: Any, loops: int) -> None:
    compared = floating = 0
    for seed in range(FEEDERS):
        rng = np.random.default_rng([loops, seed])
        feeder = random_mixed_feeder(rng, steps=int(rng.integers(3, 13)), loops=loops)
        cuts = [None, *(random_cut(rng, feeder) for _ in range(CUTS))]
        for cut, row in zip(cuts, agreement(engine, feeder, cuts), strict=True):
            assert row.worst_pu < LIMIT_PU, (seed, cut, row)
            compared += row.compared
            floating += row.floating
    print(f"{loops} loops: {compared} nodes compared, {floating} float")
    assert compared > 10 * floating > 0
