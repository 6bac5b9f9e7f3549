"""Verdicts against a scalar re-implementation, and against the reach, ties included."""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.scalar_detector import first_failing, looks_of

from openphase.detector.criteria import (
    FAR_FLOOR_A,
    Options,
    Reason,
    Settings,
    reach_of,
    verdict,
)
from openphase.detector.evidence import Evidence

I_GRID = [0.1, 0.3, 0.7, 1.0]
V_GRID = [0.002, 0.005, 0.03, 0.05]
Z_GRID = [0.1, 0.3, 5.0, 13.0]
EXACT_Z = [complex(-3, 4), complex(3, 4), complex(-5, -12), complex(0, 5), complex(-0.0, 13)]
"""Their magnitudes, 5 and 13, are exact."""

FLOOR_V, WAIVE_A, UNBALANCE = 25.0, 0.3, 0.5

EVERY_OPTION = [
    Options(
        negative_sign=sign,
        fallback=fallback,
        compensated=compensated,
        any_sequence=any_sequence,
        floor_v=FLOOR_V,
        waive_sign_below_a=WAIVE_A,
        unbalance=unbalance,
        direction=direction,
        both_ends=both_ends,  # type: ignore[arg-type]
    )
    for sign, fallback, compensated, any_sequence, unbalance, direction, both_ends in product(
        (True, False),
        (True, False),
        (True, False),
        (True, False),
        (0.0, UNBALANCE),
        (True, False),
        ("off", "no_small_z", "agree"),
    )
]


def settings_of(i: float, v: float, z: float, **options: Any) -> Settings:
    return Settings(i_set_a=i, v_set_pu=v, z_set_ohm=z, options=Options(**options))


def random_evidence(rng: np.random.Generator, terminals: int, size: int) -> Evidence:
    """Numbers of which more than half lie exactly on a threshold; some are none at all."""
    wide, flat = (terminals, 4, size), (terminals, size)

    def near(grid: list[float], shape: tuple[int, ...] = wide) -> NDArray[np.float64]:
        exact = rng.choice(grid, shape)
        return np.where(rng.random(shape) < 0.6, exact, rng.uniform(0, 1.5 * grid[-1], shape))

    def impedances(undefined: NDArray[np.bool_]) -> NDArray[np.complex128]:
        angle = np.exp(2j * np.pi * rng.random(wide))
        straight = rng.choice([-1.0, 1.0, 1j, -1j], wide)
        # off the axes a magnitude is rounded: keep it from the thresholds, where roundings differ
        z = near(Z_GRID) * np.where(rng.random(wide) < 0.5, straight, 0.99 * angle)
        z = np.where(rng.random(wide) < 0.2, rng.choice(EXACT_Z, wide), z)
        z = np.where(rng.random(wide) < 0.3, -abs(z), z)
        return np.where(undefined, 0.0, z)

    undefined, far_undefined = rng.random(wide) < 0.1, rng.random(wide) < 0.1
    return Evidence(
        di_a=near([0.0, *I_GRID]),
        dv_pu=near([0.0, *V_GRID]),
        z_ohm=impedances(undefined),
        undefined=undefined,
        blocked=rng.random(flat) < 0.05,
        di_star_a=near([0.0, WAIVE_A, *I_GRID]),
        dv_remote_star_v=near([FLOOR_V, 2 * FLOOR_V]),
        di2_a=near([UNBALANCE * x for x in I_GRID], flat),
        di0_a=near([UNBALANCE * x for x in I_GRID], flat),
        unbalance_rise_a=rng.choice([-1.0, -1e-9, 0.0, 1e-9, 1.0, 2.0], flat),
        far_di_a=near([0.0, FAR_FLOOR_A, 1.0]),
        far_z_ohm=impedances(far_undefined),
        far_undefined=far_undefined,
        alarm=(rng.random(flat) < 0.05).astype(np.int8),
    )


def single(  # as it stands it trips at 1 A, 5 %, 5 Ω
    di1_a: float = 2.0,
    dv1_pu: float = 0.01,
    z1: complex = -10.0,
    blocked: bool = False,
    undefined: bool = False,
    phase: tuple[float, float, complex] = (0.0, 0.0, 0.0),
) -> Evidence:
    """One scenario at one terminal, where phase b has its own |ΔI|, |ΔV| and Z."""
    idle = (0.0, 0.0, 0.0)
    di, dv, z = zip((di1_a, dv1_pu, z1), idle, phase, idle, strict=True)
    return Evidence(
        di_a=np.array(di)[None, :, None],
        dv_pu=np.array(dv)[None, :, None],
        z_ohm=np.array(z, np.complex128)[None, :, None],
        undefined=np.array([undefined, True, False, True])[None, :, None],
        blocked=np.array([[blocked]]),
    )


def only_reason(evidence: Evidence, settings: Settings) -> Reason:
    return Reason(int(verdict(evidence, settings)[0, 0]))


PAPER = settings_of(1.0, 0.05, 5.0)


def test_verdict_is_the_scalar_one_with_every_option() -> None:
    rng = np.random.default_rng(1)
    evidence = random_evidence(rng, 2, 150)
    looks = [[looks_of(evidence, t, s) for s in range(150)] for t in range(2)]
    seen = set()
    for options in EVERY_OPTION:
        for _ in range(4):
            settings = Settings(
                i_set_a=rng.choice(I_GRID),
                v_set_pu=rng.choice(V_GRID),
                z_set_ohm=rng.choice(Z_GRID),
                options=options,
            )
            expected = [[first_failing(one, settings) for one in row] for row in looks]
            np.testing.assert_array_equal(verdict(evidence, settings), expected, str(settings))
            seen |= {reason for row in expected for reason in row}
    assert seen == set(Reason)


def test_reach_says_what_the_verdict_says_at_every_setting() -> None:
    evidence = random_evidence(np.random.default_rng(2), 2, 300)
    trips_seen = 0
    for options in EVERY_OPTION:
        reach = reach_of(evidence, options)
        assert reach.z_ohm.shape == (2, 4 if options.fallback else 1, 300)
        assert (reach.z_ohm >= 0.0).all()
        for i, v, z in product(I_GRID, V_GRID, Z_GRID):
            held = (reach.di_a >= i) & (reach.dv_pu <= v) & (reach.z_ohm >= z)
            held[:, 1:] &= (reach.di_a[:, 0] < i)[:, None]
            trip = (
                verdict(evidence, Settings(i_set_a=i, v_set_pu=v, z_set_ohm=z, options=options))
                == Reason.TRIP
            )
            np.testing.assert_array_equal(held.any(axis=1), trip)
            trips_seen += int(trip.sum())
    assert trips_seen > 10_000


@pytest.mark.parametrize("field", ["di_a", "dv_pu", "z_ohm", "di_star_a", "far_z_ohm", "di2_a"])
def test_what_is_no_number_trips_nothing(field: str) -> None:
    """A NaN in row 0 or in what all rows share leaves no criterion held."""
    evidence = random_evidence(np.random.default_rng(3), 2, 400)
    evidence = replace(evidence, **{field: np.full_like(getattr(evidence, field), np.nan)})
    options = Options(compensated=True, unbalance=0.1, both_ends="no_small_z", any_sequence=True)
    options = replace(options, any_sequence=field == "di2_a")
    reach = reach_of(evidence, options)
    speaks = evidence.far_di_a >= FAR_FLOOR_A if field == "far_z_ohm" else None
    for i, v, z in product(I_GRID, V_GRID, Z_GRID):
        settings = Settings(i_set_a=i, v_set_pu=v, z_set_ohm=z, options=options)
        trip = verdict(evidence, settings) == Reason.TRIP
        if speaks is None:
            assert not trip.any()
        held = (reach.di_a >= i) & (reach.dv_pu <= v) & (reach.z_ohm >= z)
        held[:, 1:] &= (reach.di_a[:, 0] < i)[:, None]
        np.testing.assert_array_equal(held.any(axis=1), trip)


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
    assert only_reason(evidence, PAPER) == reason


@pytest.mark.parametrize(
    ("di1_a", "phase", "reason"),
    [
        (0.5, (1.0, 0.05, -5.0), Reason.TRIP),  # every threshold just met
        (0.5, (np.nextafter(1.0, 0.0), 0.05, -5.0), Reason.CURRENT),
        (0.5, (1.0, np.nextafter(0.05, 1.0), -5.0), Reason.PHASE_VOLTAGE),
        (0.5, (1.0, 0.05, np.nextafter(-5.0, 0.0)), Reason.PHASE_IMPEDANCE),
        (0.5, (1.0, 0.05, 5.0), Reason.PHASE_SIGN),
        (np.nextafter(1.0, 0.0), (1.0, 0.05, -5.0), Reason.TRIP),
        # the positive sequence speaks for itself as soon as it may, and says no
        (1.0, (1.0, 0.05, -5.0), Reason.SIGN),
    ],
)
def test_a_phase_stands_in_below_the_current_threshold(
    di1_a: float, phase: tuple[float, float, complex], reason: Reason
) -> None:
    evidence = single(di1_a=di1_a, z1=10.0, phase=phase)
    assert only_reason(evidence, PAPER) == reason
    without = Reason.SIGN if di1_a >= 1.0 else Reason.CURRENT
    assert only_reason(evidence, settings_of(1.0, 0.05, 5.0, fallback=False)) == without


def test_one_phase_is_enough_and_the_one_that_came_furthest_is_told() -> None:
    evidence = single(di1_a=0.5)
    phases = {
        Reason.PHASE_VOLTAGE: (2.0, 0.5, -10.0),
        Reason.PHASE_IMPEDANCE: (2.0, 0.01, -1.0),
        Reason.PHASE_SIGN: (2.0, 0.01, 10.0),
        Reason.TRIP: (2.0, 0.01, -10.0),
    }
    told = list(phases)
    for worse, better in product(range(4), range(4)):
        if worse >= better:
            continue
        for first, second in ((worse, better), (better, worse)):
            pair = [phases[told[first]], phases[told[second]]]
            for field, values in zip(
                ("di_a", "dv_pu", "z_ohm"), zip(*pair, strict=True), strict=True
            ):
                getattr(evidence, field)[0, 1, 0] = values[0]
                getattr(evidence, field)[0, 3, 0] = values[1]
            evidence.undefined[:] = False
            assert only_reason(evidence, PAPER) == told[better]


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
        assert only_reason(single(**both), PAPER) == reason  # type: ignore[arg-type]


def test_a_doubted_wiring_comes_before_all() -> None:
    evidence = replace(single(blocked=True), alarm=np.array([[3]], np.int8))
    assert only_reason(evidence, PAPER) == Reason.WIRING
    assert (reach_of(evidence, Options()).z_ohm == 0).all()


def test_without_the_sign_a_positive_impedance_trips() -> None:
    loose = settings_of(1.0, 0.05, 5.0, negative_sign=False)
    assert only_reason(single(z1=10.0), loose) == Reason.TRIP


@pytest.mark.parametrize(
    "options",
    [
        Options(compensated=True),
        Options(any_sequence=True),
        Options(unbalance=0.1),
        Options(direction=True),
        Options(both_ends="no_small_z"),
        Options(both_ends="agree"),
    ],
)
def test_evidence_that_lacks_what_an_option_judges_by_is_refused(options: Options) -> None:
    settings = replace(PAPER, options=options)
    for judge in (lambda e: verdict(e, settings), lambda e: reach_of(e, options)):
        with pytest.raises(ValueError, match="evidence_of was not told of the options"):
            judge(single())


def test_evidence_without_phases_is_refused_where_they_may_stand_in() -> None:
    evidence = single()
    alone = {
        f.name: None if (x := getattr(evidence, f.name)) is None or x.ndim < 3 else x[:, :1]
        for f in fields(evidence)
    }
    bare = Evidence(**{**alone, "blocked": evidence.blocked})  # type: ignore[arg-type]
    assert only_reason(bare, settings_of(1.0, 0.05, 5.0, fallback=False)) == Reason.TRIP
    with pytest.raises(ValueError, match="evidence_of was not told"):
        verdict(bare, PAPER)


def test_judging_leaves_the_evidence_alone() -> None:
    evidence = random_evidence(np.random.default_rng(4), 2, 50)
    names = [f.name for f in fields(evidence)]
    before = {name: getattr(evidence, name).copy() for name in names}
    for options in EVERY_OPTION:
        verdict(evidence, replace(PAPER, options=options))
        reach_of(evidence, options)
    for name in names:
        np.testing.assert_array_equal(getattr(evidence, name), before[name])


def test_every_reason_has_words() -> None:
    texts = [reason.text for reason in Reason]
    assert len(set(texts)) == len(Reason)
    assert [int(reason) for reason in Reason] == list(range(len(Reason)))
    for reason, word in (("CURRENT", "(22)"), ("VOLTAGE", "(23)"), ("IMPEDANCE", "(24)")):
        assert word in Reason[reason].text
        if reason != "CURRENT":
            assert word in Reason[f"PHASE_{reason}"].text
