"""Where the solver starts: near the solution, and without a part in what it finds."""

from __future__ import annotations

import numpy as np
import pytest

from openphase.model import load_feeder
from openphase.model.points import point_probes
from openphase.model.solve import solve
from openphase.studies.run.cases import make_case
from openphase.studies.run.classes import DrawClass, Purpose
from openphase.studies.run.draw import BlockId, draw_scenarios
from openphase.studies.spec.study_file import LoadDraw, Study

SIZE = 200
DRAWN = [DrawClass.LOAD_STEP, DrawClass.OPEN_PHASE, DrawClass.SOURCE_STEP]


@pytest.mark.parametrize("drawn", DRAWN)
@pytest.mark.parametrize(("name", "saved"), [("ieee13", -0.2), ("ieee34", 0.2), ("paper", -0.2)])
def test_it_saves_passes_where_voltages_sag_and_changes_nothing(
    name: str, saved: float, drawn: DrawClass
) -> None:
    case = make_case(load_feeder(name), Study())
    which = BlockId(seed=1, purpose=Purpose.TRAIN, attempt=1, drawn=drawn, block=0)
    state = draw_scenarios(case, which, SIZE).before
    probes = point_probes(case.points)
    near, flat = (
        solve(case.network, state, probes, start=own, tolerance_pu=1e-9)
        for own in (case.start, None)
    )
    assert case.start.shape == (near.winding_v_pu.shape[0], 1)
    assert near.passes.mean() < flat.passes.mean() - saved
    nominal = case.points.v_nominal_v[:, None, None]
    assert np.abs((near.v - flat.v) / nominal).max() < 1e-8


def test_it_is_the_same_for_whoever_makes_it() -> None:
    feeder = load_feeder("ieee13")
    one, other = (make_case(feeder, Study()).start for _ in range(2))
    np.testing.assert_array_equal(one, other)
    own_law = make_case(feeder, Study(loads=LoadDraw(exponent="file"))).start
    assert np.isfinite(own_law).all()
