"""What opens, what closes, and what falls."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from oracles.event_draws import OHM, draw
from oracles.event_sites import Site
from scipy.stats import kstest

from openphase.model.events.along import fed_through

N = 6000
OPENINGS = ["open_phase", "open_with_load_step", "open_with_der_trip"]


def assert_share(chosen: Any, expected: float) -> None:
    assert abs(chosen.mean() - expected) < 5.0 * math.sqrt(expected * (1 - expected) / chosen.size)


@pytest.mark.parametrize("name", [*OPENINGS, "single_pole"])
def test_one_phase_or_two_change_and_which_is_as_likely(site: Site, name: str) -> None:
    event = draw(name, site, N)
    changed, other = event.open_after, event.open_before
    if name == "single_pole":
        changed, other = other, changed
    assert not other.any()
    for one, two in ((0b001, 0b011), (0b010, 0b110), (0b100, 0b101)):
        assert_share(changed == one, 0.8 / 3.0)
        assert_share(changed == two, 0.2 / 3.0)


@pytest.mark.parametrize("name", ["fallen_source_side", "fallen_load_side"])
def test_a_fallen_conductor_is_the_open_one(site: Site, name: str) -> None:
    event = draw(name, site, N)
    y = event.earth_after_s + event.fallen_after_s
    np.testing.assert_array_equal(
        event.open_after, ((y != 0.0) * np.array([[1], [2], [4]])).sum(axis=0)
    )
    for mask in (0b001, 0b010, 0b100):
        assert_share(event.open_after == mask, 1.0 / 3.0)
    ohm = 1.0 / y.sum(axis=0).real
    assert kstest(ohm, "uniform", args=(OHM.low, OHM.high - OHM.low)).pvalue > 1e-3


def test_closings_close_all_three_phases(site: Site) -> None:
    for name in ("energisation", "reclosing"):
        event = draw(name, site, N)
        assert (event.open_before == 0b111).all()
        assert not event.open_after.any()
    assert (draw("open_three", site, N).open_after == 0b111).all()


@pytest.mark.parametrize("kind", ["site", "looped"])
def test_cold_load_is_taken_beyond_the_place_only(
    request: pytest.FixtureRequest, kind: str
) -> None:
    site: Site = request.getfixturevalue(kind)
    event = draw("reclosing", site, N)
    beyond = fed_through(site.network, event.edge, site.network.load_node)
    assert beyond.any()
    assert not beyond.all()
    assert (event.load_factor[~beyond] == 1.0).all()
    factor = event.load_factor.max(axis=0)
    np.testing.assert_array_equal(
        event.load_factor[beyond], np.broadcast_to(factor, beyond.shape)[beyond]
    )
    some = factor[beyond.any(axis=0)]
    assert kstest(some, "uniform", args=(1.5, 1.5)).pvalue > 1e-3


@pytest.mark.parametrize("kind", ["site", "looped"])
@pytest.mark.parametrize("name", ["energisation", "reclosing"])
def test_der_beyond_a_closing_are_not_connected_and_others_are(
    request: pytest.FixtureRequest, kind: str, name: str
) -> None:
    site: Site = request.getfixturevalue(kind)
    network = site.network
    event = draw(name, site, N)
    nodes = np.array([network.node(bus) for bus in ("C", "L", "S", "C2")])
    wanted = np.where(fed_through(network, event.edge, nodes), 0.0, 1.0)
    assert (wanted == 0.0).any()
    np.testing.assert_array_equal(event.der_factor, wanted)


def test_a_reclosing_is_an_energisation_with_other_loads(site: Site) -> None:
    one, other = draw("energisation", site, 50), draw("reclosing", site, 50)
    for name in ("edge", "share", "open_before", "der_factor"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
