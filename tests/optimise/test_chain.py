"""Choosing on one sample and certifying on another, on a section whose truth is known.

A made-up section: an event that must not trip has |ΔI1|, |ΔV1| and reach of known,
independent laws (exponential, uniform, and a Pareto tail), so the false-trip probability of
any setting is a product; breaks are larger in all three. 300 independent studies choose
settings and bound their false trips.

Bounds of the tests: with a coverage of at least .95, fewer than 270 of 300 hits (.90) have
a probability below 4e-4; seeds are fixed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.brute_settings import decimals, numbered

from openphase.optimise.certificate import two_sided, upper_bound
from openphase.optimise.counts import Grid, corners_of
from openphase.optimise.staircase import front_of
from openphase.optimise.thresholds import Choice, Sample, choose

Real = NDArray[np.float64]
Events = tuple[Real, Real, Real]

STUDIES, TRIALS, OPENS, ALPHA = 300, 400, 6000, 0.05
GRID = Grid(
    i_set_a=decimals(1, 150), v_set_pu=np.array([0.01, 0.02, 0.05]), z_set_ohm=decimals(5, 200)
)
REFERENCE = 1.0, 0.05, 5.0


def harmless(rng: np.random.Generator, size: int) -> Events:
    """|ΔI1| exponential of mean 1 A, |ΔV1| uniform to 0.1 pu, P(reach >= z) = min(1, 1/z)."""
    reach = 1.0 / (1.0 - rng.random(size))
    return rng.exponential(1.0, size), rng.uniform(0.0, 0.1, size), reach


def breaks(rng: np.random.Generator, size: int) -> Events:
    """The same laws at three times the current, half the voltage and four times the reach."""
    di1_a, dv1_pu, reach_ohm = harmless(rng, size)
    return 3.0 * di1_a, 0.5 * dv1_pu, 4.0 * reach_ohm


def truth(choice: Choice) -> tuple[float, float]:
    """Probabilities that the choice trips in a harmless event, and in a break."""
    i, v, z = choice.i_set_a, choice.v_set_pu, choice.z_set_ohm
    false = math.exp(-i) * v / 0.1 * min(1.0, 1.0 / z)
    return false, math.exp(-i / 3.0) * min(1.0, v / 0.05) * min(1.0, 4.0 / z)


def tripped(choice: Choice, events: Events) -> int:
    di1_a, dv1_pu, reach_ohm = events
    trip = (di1_a >= choice.i_set_a) & (dv1_pu <= choice.v_set_pu) & (reach_ohm >= choice.z_set_ohm)
    return int(trip.sum())


@dataclass(frozen=True)
class Outcome:
    """One study: what is true of its choice, and what it was certified to be."""

    false: float
    found: float
    false_k: int
    upper: float  #: from the validation sample
    naive: float  #: from the sample that the choice was made with
    low: float
    high: float


def study(seed: int, margin: float) -> Outcome:
    rng = np.random.default_rng([51, seed])
    opens, false = breaks(rng, OPENS), harmless(rng, TRIALS)
    stiff = opens[0] / margin, opens[1] * margin, opens[2] / margin
    sample = Sample(
        opens=corners_of(GRID, *opens),
        stiff=corners_of(GRID, *stiff),
        trials=OPENS,
        front=front_of(*false, numbered(TRIALS)),
    )
    choice = choose(GRID, sample, margin, REFERENCE)
    assert isinstance(choice, Choice)
    assert tripped(choice, false) == 0
    assert tripped(choice, opens) == choice.detected
    k = tripped(choice, harmless(rng, TRIALS))
    low, high = two_sided(tripped(choice, breaks(rng, TRIALS)), TRIALS, ALPHA)
    return Outcome(
        *truth(choice),
        false_k=k,
        upper=upper_bound(k, TRIALS, ALPHA),
        naive=upper_bound(0, TRIALS, ALPHA),
        low=low,
        high=high,
    )


@pytest.fixture(scope="module", params=[1.0, 1.25])
def outcomes(request: pytest.FixtureRequest) -> list[Outcome]:
    return [study(seed, request.param) for seed in range(STUDIES)]


def test_the_bound_of_an_untouched_sample_covers_the_truth(outcomes: list[Outcome]) -> None:
    covered = sum(own.false <= own.upper for own in outcomes)
    assert covered >= 0.90 * STUDIES


def test_dependability_of_an_untouched_sample_covers_the_truth(outcomes: list[Outcome]) -> None:
    covered = sum(own.low <= own.found <= own.high for own in outcomes)
    assert covered >= 0.90 * STUDIES


def test_a_clean_validation_is_seldom_a_false_claim(outcomes: list[Outcome]) -> None:
    """Both k = 0 and a truth above the bound: at most alpha of all studies, as the bound says."""
    wrong = sum(own.false_k == 0 and own.false > own.upper for own in outcomes)
    assert wrong <= 0.10 * STUDIES


@pytest.mark.parametrize("outcomes", [1.0], indirect=True)
def test_the_training_sample_itself_proves_nothing(outcomes: list[Outcome]) -> None:
    """Why there is a second sample: the same bound, from the first one, fails the same test."""
    covered = sum(own.false <= own.naive for own in outcomes)
    assert covered < 0.90 * STUDIES


def test_a_margin_makes_a_clean_validation_likelier() -> None:
    clean = [sum(study(seed, m).false_k == 0 for seed in range(100)) for m in (1.0, 1.5)]
    assert clean[1] > clean[0] + 25
