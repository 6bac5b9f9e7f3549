"""Regulators and DER: which move, how far, and where the event stands."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from oracles.event_draws import draw
from oracles.event_sites import Site, site_of
from scipy.stats import kstest

from openphase.model.distributions import Fixed
from openphase.model.events.der_trip import draw_der_trip
from openphase.model.events.der_units import der_nodes
from openphase.model.events.regulator_tap import draw_regulator_tap
from openphase.model.events.source_step import draw_source_step

N = 4000


def test_source_steps_are_percents_of_the_emf(site: Site, rng: np.random.Generator) -> None:
    event = draw_source_step(rng, 5, site.network, Fixed(value=-2.5))
    np.testing.assert_allclose(event.emf_factor, 0.975, rtol=1e-15)
    assert (
        kstest(draw("source_step", site, N).emf_factor, "uniform", args=(0.95, 0.1)).pvalue > 1e-3
    )


def test_one_regulator_moves_on_one_phase_or_three(site: Site) -> None:
    event = draw("regulator_tap", site, N)
    moved = event.tap_factor != 1.0
    phases = moved.sum(axis=1)  # (R, S)
    assert ((phases > 0).sum(axis=0) == 1).all()
    count = phases.max(axis=0)
    assert set(count) == {1, 3}
    for share, expected in ((count == 1, 0.3), (phases[0] > 0, 0.5)):
        assert abs(share.mean() - expected) < 5.0 * math.sqrt(expected * (1 - expected) / N)
    single = moved[:, :, count == 1].any(axis=0)
    for phase in range(3):
        bound = 5.0 * math.sqrt(2.0 / 9.0 / single.shape[1])
        assert abs(single[phase].mean() - 1.0 / 3.0) < bound


def test_a_regulator_ends_on_a_whole_tap_of_its_own(site: Site) -> None:
    """Tap positions from the ratios, each regulator's to-end over its from-end."""
    network = site.network
    event = draw("regulator_tap", site, N)
    ratio = network.ratio[:, :, None] * event.tap_factor
    boost = np.where(network.ratio_upward[:, None, None], ratio, 1.0 / ratio)
    steps = np.array([r.step_pct for r in site.feeder.regulators])[:, None, None] / 100.0
    taps = (boost - 1.0) / steps
    was = np.array([r.taps for r in site.feeder.regulators])[:, :, None]
    moves = taps - was
    np.testing.assert_allclose(moves, np.rint(moves), atol=1e-9)
    assert set(np.rint(moves).ravel().astype(int)) == {-2, -1, 0, 1, 2}
    for move in (-2, -1, 1, 2):
        share = (np.rint(moves) == move).any(axis=(0, 1)).mean()
        assert abs(share - 0.25) < 5.0 * math.sqrt(0.25 * 0.75 / N)


@pytest.mark.parametrize(
    ("taps", "move", "share", "wanted"),
    [
        ((16, 15, -16), 2.0, 1.0, {(-2, 0, 0), (0, -2, 0), (0, 0, 2)}),
        ((16, 15, -16), -2.0, 1.0, {(-2, 0, 0), (0, -2, 0), (0, 0, 2)}),
        ((16, 14, 15), 1.0, 0.0, {(-1, -1, -1)}),
        ((15, 14, 15), 1.0, 0.0, {(1, 1, 1)}),
        ((-16, -16, -16), -2.0, 0.0, {(2, 2, 2)}),
    ],
)
def test_at_an_end_stop_a_move_goes_the_other_way(
    site: Site,
    rng: np.random.Generator,
    taps: tuple[int, int, int],
    move: float,
    share: float,
    wanted: set[tuple[int, int, int]],
) -> None:
    first, second = site.feeder.regulators
    first = replace(first, taps=taps)
    own = site_of(replace(site.feeder, regulators=(first, second)))
    event = draw_regulator_tap(rng, 60, own.network, Fixed(value=move), share)
    here = (event.tap_factor[0] != 1.0).any(axis=0)
    boost = own.network.ratio[0, :, None] * event.tap_factor[0]
    moves = (boost - 1.0) * 100.0 / first.step_pct - np.array(taps)[:, None]
    np.testing.assert_allclose(moves, np.rint(moves), atol=1e-9)
    assert {tuple(column) for column in np.rint(moves[:, here]).T.astype(int).tolist()} == wanted


def test_a_tap_change_is_at_its_regulator_and_on_no_line(
    site: Site, rng: np.random.Generator
) -> None:
    event = draw_regulator_tap(rng, 50, site.network, Fixed(value=1.0), 0.0)
    assert (event.edge == -1).all()
    for s in range(50):
        moved = int(np.flatnonzero((event.tap_factor[:, :, s] != 1.0).any(axis=1))[0])
        assert site.network.tree.regulator[event.at_edge[s]] == moved


@pytest.mark.parametrize(
    ("share", "count"), [(0.0, 1), (0.2, 1), (0.3, 1), (0.5, 2), (0.7, 3), (1.0, 4)]
)
def test_a_share_of_the_der_trips_and_one_at_least(
    site: Site, rng: np.random.Generator, share: float, count: int
) -> None:
    event = draw_der_trip(rng, N, site.network, Fixed(value=share))
    assert set(np.unique(event.der_factor)) <= {0.0, 1.0}
    tripped = event.der_factor == 0.0
    assert (tripped.sum(axis=0) == count).all()
    p = count / 4.0
    bound = 5.0 * math.sqrt(p * (1.0 - p) / N)
    assert (np.abs(tripped.mean(axis=1) - p) <= bound).all()


def test_a_trip_is_at_the_node_of_one_of_those_that_trip(site: Site) -> None:
    event = draw("der_trip", site, 400)
    nodes = der_nodes(site.network)
    assert (event.edge == -1).all()
    for s in range(400):
        assert event.at_node[s] in nodes[event.der_factor[:, s] == 0.0]
    assert set(event.at_node.tolist()) == set(nodes.tolist())


def test_all_der_ramp_alike(site: Site) -> None:
    factor = draw("der_ramp", site, N).der_factor
    np.testing.assert_array_equal(factor, np.broadcast_to(factor[0], factor.shape))
    assert kstest(factor[0], "uniform", args=(0.7, 0.6)).pvalue > 1e-3
