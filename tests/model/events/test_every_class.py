"""What holds for the events of every class.

Seeds are fixed; shares lie within 5 standard errors, Kolmogorov-Smirnov p above 0.001.
"""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest
from oracles.event_draws import DRAWS, ON_REGIONS, TOUCHED, draw
from oracles.event_sites import LINES, Site
from scipy.stats import kstest

from openphase.model.events.base import Event, no_event
from openphase.model.states import NOT_CONVERGED

N = 4000


def parts(event: Event) -> dict[str, np.ndarray]:
    return {field.name: getattr(event, field.name) for field in fields(event)}


@pytest.mark.parametrize("name", DRAWS)
def test_what_a_class_does_not_touch_is_as_in_no_event(site: Site, name: str) -> None:
    nothing = parts(no_event(site.network, N))
    touched = {
        key
        for key, value in parts(draw(name, site, N)).items()
        if not np.array_equal(value, nothing[key])
    }
    assert touched == TOUCHED[name]


@pytest.mark.parametrize("size", [0, 1, 7])
@pytest.mark.parametrize("name", DRAWS)
def test_shapes_and_kinds_of_number(site: Site, name: str, size: int) -> None:
    wanted = {k: (v.shape, v.dtype) for k, v in parts(no_event(site.network, size)).items()}
    assert {k: (v.shape, v.dtype) for k, v in parts(draw(name, site, size)).items()} == wanted


@pytest.mark.parametrize("name", DRAWS)
def test_events_depend_on_the_stream_only(site: Site, name: str) -> None:
    one, again, other = (parts(draw(name, site, 40, seed)) for seed in (5, 5, 6))
    assert all(np.array_equal(one[key], again[key]) for key in one)
    assert any(not np.array_equal(one[key], other[key]) for key in one)


@pytest.mark.parametrize("name", DRAWS)
@pytest.mark.parametrize("wires", ["site", "three_wire"])
def test_events_can_be_solved_before_and_after(
    request: pytest.FixtureRequest, wires: str, name: str
) -> None:
    own: Site = request.getfixturevalue(wires)
    event = draw(name, own, 60)
    before, after = own.answers(event)
    for answer in (before, after):
        assert not (answer.flags & NOT_CONVERGED).any()
        for values in (answer.v, answer.i, answer.stub):
            assert np.isfinite(values).all()
    changed = np.abs(after.i - before.i).max(axis=(0, 1)) > 1e-3
    # an empty line's end is the one place where something may open without a trace
    empty = (event.edge > 0) & ~own.network.equipped[event.edge]
    assert (changed | empty).all()
    assert not empty.all()


@pytest.mark.parametrize("name", ON_REGIONS)
def test_every_region_is_as_likely_and_uniform_in_length(site: Site, name: str) -> None:
    event = draw(name, site, N)
    places = [site.at(event, s) for s in range(N)]
    for line in LINES:
        at = np.array([place.at for place in places if place.line == line])
        p = 1.0 / len(LINES)
        assert abs(at.size / N - p) < 5.0 * math.sqrt(p * (1.0 - p) / N)
        assert kstest(at, "uniform").pvalue > 1e-3


@pytest.mark.parametrize("name", DRAWS)
def test_nothing_lies_to_earth_on_three_wires_but_faults(three_wire: Site, name: str) -> None:
    event = draw(name, three_wire, 200)
    earth = [event.earth_before_s, event.earth_after_s, event.far_before_s, event.far_after_s]
    faults = {"earth_fault", "line_fault", "fallen_source_side"}
    assert any(value.any() for value in earth) == (name in faults)


@pytest.mark.parametrize("name", ["regulator_tap", "der_trip", "der_ramp", "open_with_der_trip"])
def test_what_the_feeder_does_not_have_is_refused(bare: Site, looped: Site, name: str) -> None:
    own = looped if name == "regulator_tap" else bare
    with pytest.raises(ValueError, match=r"has 0 \w+, wanted at least 1"):
        draw(name, own, 5)
