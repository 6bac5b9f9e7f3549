"""Verdicts against a scalar re-implementation, ties at the thresholds included."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from oracles.scalar_detector import first_failing

from openphase.detector.criteria import Reason, Settings, reach_ohm, verdict
from openphase.detector.evidence import Evidence

I_GRID = [0.1, 0.3, 0.7, 1.0]
V_GRID = [0.002, 0.005, 0.03, 0.05]
Z_GRID = [0.1, 0.3, 5.0, 13.0]
EXACT_Z = [complex(-3, 4), complex(3, 4), complex(-5, -12), complex(0, 5), complex(-0.0, 13)]
"""Their magnitudes, 5 and 13, are exact."""


def settings_of(i: float, v: float, z: float, negative_sign: bool = True) -> Settings:
    return Settings(i_set_a=i, v_set_pu=v, z_set_ohm=z, negative_sign=negative_sign)


def random_evidence(rng: np.random.Generator, shape: tuple[int, int]) -> Evidence:
    """Numbers of which more than half lie exactly on a threshold."""

    def near(grid: list[float]) -> np.ndarray:
        return np.where(
            rng.random(shape) < 0.6, rng.choice(grid, shape), rng.uniform(0, 1.5 * grid[-1], shape)
        )

    angle = np.exp(2j * np.pi * rng.random(shape))
    straight = rng.choice([-1.0, 1.0, 1j, -1j], shape)
    # off the axes a magnitude is rounded: keep it from the thresholds, where roundings differ
    z = near(Z_GRID) * np.where(rng.random(shape) < 0.5, straight, 0.99 * angle)
    z = np.where(rng.random(shape) < 0.2, rng.choice(EXACT_Z, shape), z)
    undefined = rng.random(shape) < 0.1
    return Evidence(
        di1_a=near(I_GRID),
        dv1_pu=near(V_GRID),
        z1_ohm=np.where(undefined, 0.0, z),
        blocked=rng.random(shape) < 0.1,
        undefined=undefined,
    )


def single(
    di1_a: float = 2.0,
    dv1_pu: float = 0.01,
    z1: complex = -10.0,
    blocked: bool = False,
    undefined: bool = False,
) -> Evidence:
    """One scenario at one terminal; as it stands it trips at 1 A, 5 %, 5 Ω."""
    return Evidence(
        di1_a=np.array([[di1_a]]),
        dv1_pu=np.array([[dv1_pu]]),
        z1_ohm=np.array([[z1]], np.complex128),
        blocked=np.array([[blocked]]),
        undefined=np.array([[undefined]]),
    )


@pytest.mark.parametrize("negative_sign", [True, False])
def test_verdict_is_the_scalar_one(negative_sign: bool) -> None:
    evidence = random_evidence(np.random.default_rng(1), (4, 500))
    columns = (
        evidence.di1_a,
        evidence.dv1_pu,
        evidence.z1_ohm,
        evidence.blocked,
        evidence.undefined,
    )
    rows: list[tuple[Any, Any, Any, Any, Any]] = list(
        zip(*(x.ravel().tolist() for x in columns), strict=True)
    )
    seen = set()
    for i in I_GRID:
        for v in V_GRID:
            for z in Z_GRID:
                settings = settings_of(i, v, z, negative_sign)
                found = verdict(evidence, settings)
                expected = [first_failing(*row, settings) for row in rows]
                np.testing.assert_array_equal(found.ravel(), expected)
                seen |= set(expected)
    assert seen == set(Reason) - (set() if negative_sign else {Reason.SIGN})


@pytest.mark.parametrize(
    ("evidence", "reason"),
    [
        (single(), Reason.TRIP),
        (single(di1_a=1.0), Reason.TRIP),  # |ΔI1| == I_set picks up
        (single(di1_a=np.nextafter(1.0, 0.0)), Reason.CURRENT),
        (single(dv1_pu=0.05), Reason.TRIP),  # |ΔV1| == V_set passes
        (single(dv1_pu=np.nextafter(0.05, 1.0)), Reason.VOLTAGE),
        (single(z1=-5.0), Reason.TRIP),  # |Z| == Z_set passes
        (single(z1=-3.0 + 4.0j), Reason.TRIP),
        (single(z1=np.nextafter(-5.0, 0.0)), Reason.IMPEDANCE),
        (single(z1=5.0j), Reason.SIGN),  # Re Z = 0 is not negative
        (single(z1=10.0), Reason.SIGN),
        (single(z1=0.0, undefined=True), Reason.IMPEDANCE),
        (single(blocked=True), Reason.BLOCKED),
    ],
)
def test_edges(evidence: Evidence, reason: Reason) -> None:
    assert verdict(evidence, settings_of(1.0, 0.05, 5.0))[0, 0] == reason


def test_the_reason_is_the_first_criterion_that_fails() -> None:
    faults: list[tuple[Reason, dict[str, float | bool]]] = [
        (Reason.BLOCKED, {"blocked": True}),
        (Reason.CURRENT, {"di1_a": 0.5}),
        (Reason.VOLTAGE, {"dv1_pu": 0.5}),
        (Reason.IMPEDANCE, {"z1": 1.0}),
        (Reason.SIGN, {"z1": 10.0}),
    ]
    for n, (reason, _) in enumerate(faults):
        # this one fails and all that come after it; the impedance's own case before the sign's
        both: dict[str, float | bool] = {}
        for _, fault in reversed(faults[n:]):
            both |= fault
        assert verdict(single(**both), settings_of(1.0, 0.05, 5.0))[0, 0] == reason  # type: ignore[arg-type]


def test_without_the_sign_a_positive_impedance_trips() -> None:
    assert verdict(single(z1=10.0), settings_of(1.0, 0.05, 5.0, False))[0, 0] == Reason.TRIP


@pytest.mark.parametrize("negative_sign", [True, False])
def test_reach_says_what_the_verdict_says_at_every_setting(negative_sign: bool) -> None:
    evidence = random_evidence(np.random.default_rng(2), (3, 700))
    reach = reach_ohm(evidence, negative_sign)
    assert (reach >= 0.0).all()
    for i in I_GRID:
        for v in V_GRID:
            for z in Z_GRID:
                by_reach = (evidence.di1_a >= i) & (evidence.dv1_pu <= v) & (reach >= z)
                trip = verdict(evidence, settings_of(i, v, z, negative_sign)) == Reason.TRIP
                np.testing.assert_array_equal(by_reach, trip)


def test_judging_leaves_the_evidence_alone() -> None:
    evidence = random_evidence(np.random.default_rng(3), (2, 50))
    before = evidence.z1_ohm.copy(), evidence.di1_a.copy()
    verdict(evidence, settings_of(1.0, 0.05, 5.0))
    reach_ohm(evidence, True)
    np.testing.assert_array_equal(evidence.z1_ohm, before[0])
    np.testing.assert_array_equal(evidence.di1_a, before[1])


def test_every_reason_has_words() -> None:
    texts = [reason.text for reason in Reason]
    assert len(set(texts)) == len(Reason)
    for reason, word in (("CURRENT", "(22)"), ("VOLTAGE", "(23)"), ("IMPEDANCE", "(24)")):
        assert word in Reason[reason].text
