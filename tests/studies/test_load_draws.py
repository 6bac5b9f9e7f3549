"""What loads take is drawn as whole arrays would be, whatever lies in the cache at a time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from openphase.model.distributions import Triangular
from openphase.model.states import BY_LAW
from openphase.studies.run import load_draws
from openphase.studies.run.load_draws import draw_loads
from openphase.studies.spec.study_file import default_study

LOADS, SIZE = 7, 50


@pytest.mark.parametrize("cached", [1, 3 * SIZE, load_draws.CACHED])
@pytest.mark.parametrize("by_law", [False, True])
def test_draws_are_those_of_whole_arrays(
    cached: int, by_law: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(load_draws, "CACHED", cached)
    study = default_study("any")
    law = Triangular(low=0.5, mode=0.9, high=1.5)
    study = replace(study, loads=replace(study.loads, each=law))
    level = np.random.default_rng(1).random((LOADS, SIZE))
    common = None if by_law else np.linspace(0.0, 2.0, SIZE)
    one, other = (np.random.Generator(np.random.SFC64(5)) for _ in range(2))
    scale, exponent, later = draw_loads(one, study, level, common)

    wanted = level * law.draw(other, level.shape)
    most = study.loads.exponent_spread
    spread = other.uniform(-most, most, level.shape)
    change = other.uniform(-study.ambient.load_pct, study.ambient.load_pct, level.shape) / 100.0
    np.testing.assert_array_equal(scale, wanted)
    if by_law:
        assert (exponent == BY_LAW).all()
    else:
        np.testing.assert_array_equal(exponent, np.clip(np.asarray(common) + spread, 0.0, 2.0))
    np.testing.assert_array_equal(later, wanted * (1.0 + change))
    assert one.random() == other.random()
