"""Random small feeders against the engine itself, where it is installed."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from opendss.as_dss import as_dss, joined_buses, node_name
from opendss.engine import direct_voltages, new_context
from opendss.galvanic import floating_nodes
from opendss.live import agreement, our_voltages
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
    assert compared > 10 * floating > 0


def test_a_part_that_is_told_differently_is_seen(engine: Any) -> None:
    feeder = random_mixed_feeder(np.random.default_rng(3), steps=6)
    other = replace(feeder, loads=tuple(replace(load, kw=load.kw * 1.1) for load in feeder.loads))
    theirs, floating = direct_voltages(engine, partial(as_dss, other, None))
    ours, _ = our_voltages(feeder, [None])
    bus = feeder.lines[-1].to_bus
    node = node_name(bus, feeder.lines[-1].phases[0])
    assert node not in floating
    off = abs(ours[bus]["abc".index(feeder.lines[-1].phases[0]), 0] - theirs[node])
    assert off > LIMIT_PU * abs(theirs[node])


def test_what_floats_by_the_graph_floats_by_the_engines_matrix(engine: Any) -> None:
    found = 0
    for seed in range(40):
        rng = np.random.default_rng([7, seed])
        feeder = random_mixed_feeder(rng, steps=8)
        cut = random_cut(rng, feeder)
        theirs, by_matrix = direct_voltages(
            engine, lambda held, f=feeder, c=cut: as_dss(f, c, held)
        )
        bus_of = joined_buses(feeder)
        by_graph = {node_name(bus_of(bus), phase) for bus, phase in floating_nodes(feeder, cut)}
        found += len(by_graph & set(theirs))
        # the matrix knows more: windings that nothing feeds and nothing holds
        assert by_graph & set(theirs) <= by_matrix
    assert found > 0
