"""What folding does to a feeder, measured with the product's own solver."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from oracles.laterals import feeder_with_laterals

from openphase.model.errors import InputError
from openphase.model.reduction.fold import fold
from openphase.model.reduction.measure import measure
from openphase.model.reduction.report import folded_json, folded_text


def measured(feeder, folded, scenarios=60):
    return measure(feeder, folded, rng=np.random.default_rng(3), scenarios=scenarios)


@pytest.mark.parametrize("linear", [True, False])
def test_a_folded_feeder_shows_nearly_the_same_open_phases(linear):
    feeder = feeder_with_laterals(0, linear=linear)
    found = measured(feeder, fold(feeder))
    assert found.z_op.count > 50
    assert found.z_op.worst < 1e-3
    assert found.di1.worst < 1e-3
    assert found.voltage_pu.worst < 1e-4
    assert found.not_converged == 0


def test_loads_at_the_root_itself_are_measured_to_be_worse():
    feeder = feeder_with_laterals(0, linear=True)
    # without length, they may go there
    bare = measured(feeder, fold(feeder, kinds=("bus",)))
    near = measured(feeder, fold(feeder))
    assert bare.z_op.median > 5.0 * near.z_op.median
    assert 1e-3 < bare.z_op.worst < 0.05


def test_what_is_not_folded_has_no_error():
    feeder = feeder_with_laterals(0, linear=True)
    trunk = replace(feeder, lines=feeder.lines[:2], loads=feeder.loads[:1], inline_transformers=())
    found = measured(trunk, fold(trunk))
    assert found.voltage_pu.worst == found.z_op.worst == found.di1.worst == 0.0


def test_the_same_draws_measure_the_same():
    feeder = feeder_with_laterals(1, linear=False)
    folded = fold(feeder)
    first, again = (replace(measured(feeder, folded), per_s=(1.0, 1.0)) for _ in range(2))
    assert first == again


def test_a_feeder_without_sections_is_refused():
    feeder = replace(feeder_with_laterals(0, linear=True), points=(), sections=())
    with pytest.raises(InputError, match=r"sections must be there: .*, got none"):
        measured(feeder, fold(feeder))


def test_the_report_says_what_became_of_the_buses_and_how_far_it_is_off():
    feeder = feeder_with_laterals(0, linear=True)
    folded = fold(feeder)
    text = "\n".join(folded_text(folded, measured(feeder, folded)))
    assert f"{folded.buses_before} buses become {folded.buses_after}" in text
    assert "21 loads" in text
    assert "|Z_op|" in text
    assert "times as fast" in text


def test_the_report_is_plain_data_even_where_nothing_could_be_measured():
    feeder = feeder_with_laterals(0, linear=True)
    folded = fold(feeder)
    # no load and no losses beyond the section: no break changes a current
    codes = tuple(replace(code, c_nf_per_km=None) for code in feeder.codes)
    bare = replace(feeder, lines=feeder.lines[:2], loads=(), inline_transformers=(), codes=codes)
    empty = replace(folded, feeder=bare)
    found = json.loads(json.dumps(folded_json(empty, measured(bare, empty)), allow_nan=False))
    assert found["measured"]["z_op"] == {"median": None, "p95": None, "worst": None, "count": 0}
    assert [root["root"] for root in found["roots"]] == [root.root for root in folded.roots]
