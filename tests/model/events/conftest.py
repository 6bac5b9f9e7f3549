"""Sites for the events, see ``oracles.event_sites``."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracles.event_sites import Site, make, site_of, without_regulators

from openphase.model.distributions import Uniform


@pytest.fixture(scope="session")
def site() -> Site:
    return site_of(make(4))


@pytest.fixture(scope="session")
def three_wire() -> Site:
    return site_of(make(3))


@pytest.fixture(scope="session")
def bare() -> Site:
    """No loads, DER or regulators' taps: only the source and the lines carry anything."""
    feeder = make(4)
    regulators = tuple(replace(r, taps=(0, 0, 0)) for r in feeder.regulators)
    return site_of(replace(feeder, loads=(), ders=(), transformers=(), regulators=regulators))


@pytest.fixture(scope="session")
def looped() -> Site:
    """Without regulators, whose ratios would drive a current around the loop."""
    return site_of(without_regulators(make(4)), ["tie", "REG", "OLD"])


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20240611)


@pytest.fixture(scope="session")
def kw() -> Uniform:
    return Uniform(low=10.0, high=500.0)
