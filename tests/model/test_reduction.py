"""Folded feeders against the whole ones, both solved by the dense oracle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracles.dense import solve_dense
from oracles.laterals import SOURCE, TRUNK, feeder_with_laterals

from openphase.model.parts import Feeder
from openphase.model.reduction.fold import LEVEL, fold


def scaled(feeder: Feeder, factor: dict[str, float]) -> Feeder:
    return replace(
        feeder,
        loads=tuple(
            replace(
                each,
                kw=each.kw * factor[each.name],
                kvar=None if each.kvar is None else each.kvar * factor[each.name],
            )
            for each in feeder.loads
        ),
    )


def largest_gap_pu(whole: Feeder, folded: Feeder, factor: dict[str, float]) -> float:
    """Largest difference of a voltage on the trunk."""
    a, b = (solve_dense(scaled(each, factor), frozenset()) for each in (whole, folded))
    gaps = [np.abs(np.asarray(a.v[bus]) - np.asarray(b.v[bus])).max() for bus in TRUNK]
    return max(gaps) / SOURCE.v_phase_v


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("linear", [True, False])
def test_at_its_level_a_fold_is_exact(seed, linear):
    feeder = feeder_with_laterals(seed, linear=linear)
    factor = dict.fromkeys((each.name for each in feeder.loads), LEVEL)
    # the trunk's own voltages are nominal in the fold; laws bend that a little
    assert largest_gap_pu(feeder, fold(feeder).feeder, factor) < (1e-7 if linear else 3e-6)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("linear", [True, False])
def test_over_the_load_range_it_stays_near(seed, linear):
    feeder = feeder_with_laterals(seed, linear=linear)
    folded = fold(feeder).feeder
    rng = np.random.default_rng(seed)
    for _ in range(5):
        level = rng.uniform(0.25, 1.0)
        factor = {each.name: level * rng.uniform(0.8, 1.2) for each in feeder.loads}
        assert largest_gap_pu(feeder, folded, factor) < 1e-4


def test_the_lateral_is_there_only_as_far_as_its_loads():
    feeder = feeder_with_laterals(1, linear=True)
    nothing = dict.fromkeys((each.name for each in feeder.loads), 0.0)
    assert largest_gap_pu(feeder, fold(feeder).feeder, nothing) < 1e-6


def test_loads_at_the_root_itself_miss_more_than_beyond_an_equivalent():
    feeder = feeder_with_laterals(2, linear=True)
    rng = np.random.default_rng(0)
    factor = {each.name: rng.uniform(0.25, 0.3) for each in feeder.loads}
    rough = largest_gap_pu(feeder, fold(feeder, kinds=("bus",)).feeder, factor)
    fine = largest_gap_pu(feeder, fold(feeder).feeder, factor)
    assert rough > 10.0 * fine


def test_every_load_keeps_its_name_its_order_and_its_law():
    feeder = feeder_with_laterals(3, linear=False)
    folded = fold(feeder).feeder
    same = ("name", "exponent", "exponent_q", "zip", "v_min_pu", "v_max_pu", "v_low_pu")
    for was, now in zip(feeder.loads, folded.loads, strict=True):
        assert [getattr(was, key) for key in same] == [getattr(now, key) for key in same]


def test_the_account_counts_what_is_gone():
    feeder = feeder_with_laterals(0, linear=True)
    folded = fold(feeder)
    buses = {bus for each in folded.feeder.lines for bus in (each.from_bus, each.to_bus)}
    buses |= {unit.to_bus for unit in folded.feeder.inline_transformers}
    km = sum(each.length_km for each in feeder.lines)
    assert folded.buses_before == 3 + 3 * 3 * 2 + 3
    assert folded.buses_after == len(buses)
    assert folded.kept == set(TRUNK)
    assert {root.root: root.buses for root in folded.roots} == {"t1": 18, "t2": 3}
    assert sum(root.loads for root in folded.roots) == len(feeder.loads) - 1
    assert sum(each.length_km for each in folded.feeder.lines) == pytest.approx(km)


def test_what_must_be_kept_is():
    feeder = feeder_with_laterals(0, linear=True)
    folded = fold(feeder, keep=("a1",))
    assert {"a0", "a1"} <= folded.kept
    assert "b1" not in folded.kept


def test_folding_twice_takes_no_further_bus():
    once = fold(feeder_with_laterals(0, linear=True))
    twice = fold(once.feeder)
    assert twice.buses_after == once.buses_after
    factor = dict.fromkeys((each.name for each in once.feeder.loads), 0.4)
    assert largest_gap_pu(once.feeder, twice.feeder, factor) < 1e-6


def test_a_feeder_of_nothing_but_trunk_is_left_alone():
    feeder = feeder_with_laterals(0, linear=True)
    trunk = replace(feeder, lines=feeder.lines[:2], loads=feeder.loads[:1], inline_transformers=())
    assert fold(trunk).feeder is trunk


def test_a_reactive_load_alone_is_folded_too():
    feeder = feeder_with_laterals(0, linear=True)
    alone = tuple(
        replace(each, kw=0.0, kvar=8.0) if each.name == "load a2" else each for each in feeder.loads
    )
    whole = replace(feeder, loads=alone)
    factor = dict.fromkeys((each.name for each in whole.loads), LEVEL)
    assert largest_gap_pu(whole, fold(whole).feeder, factor) < 1e-5
