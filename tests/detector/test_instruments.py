"""The law of the instruments' errors, and what it does to a phasor."""

from __future__ import annotations

import cmath
import math
from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kstest

from openphase.detector.criteria import Options
from openphase.detector.evidence import Phasors, evidence_of
from openphase.detector.instruments import (
    Bounds,
    Errors,
    Wiring,
    disc_noise,
    draw_errors,
    measure,
    miswire,
)
from openphase.model.points import Terminal

Complex = NDArray[np.complex128]

POSITIVE = np.exp([[0j], [-2j * np.pi / 3], [2j * np.pi / 3]])

N = 400_000
LEFT_OUT = math.exp(-4.5)
"""Share of a Rayleigh law beyond three standard deviations of an axis."""

MEAN_SQUARE = (2.0 - 9.0 * LEFT_OUT / (1.0 - LEFT_OUT)) / 9.0
"""E|e|² of the truncated law: 2σ² less what the cut takes, σ = 1/3."""

# Seeds are fixed. A mean must lie within 5 standard errors (one false alarm in 2 million
# draws of the seed), a Kolmogorov-Smirnov p above 0.001.


@pytest.fixture(scope="module")
def errors() -> NDArray[np.complex128]:
    return disc_noise(np.random.default_rng(11), (N,))


def assert_mean(values: NDArray[np.float64], expected: float) -> None:
    assert abs(values.mean() - expected) < 5.0 * values.std() / math.sqrt(values.size)


def test_no_error_leaves_its_bound(errors: NDArray[np.complex128]) -> None:
    assert np.abs(errors).max() <= 1.0 + 1e-15
    assert np.abs(errors).max() > 0.999  # and the bound is nearly reached


def test_the_moments_are_those_of_the_truncated_law(errors: NDArray[np.complex128]) -> None:
    for axis in (errors.real, errors.imag):
        assert_mean(axis, 0.0)
        assert_mean(axis**2, MEAN_SQUARE / 2.0)
    assert_mean(np.abs(errors) ** 2, MEAN_SQUARE)
    # the test can tell it from the law without the cut, by more than 20 standard errors
    square = np.abs(errors) ** 2
    assert (2.0 / 9.0 - square.mean()) / (square.std() / math.sqrt(N)) > 20.0


def test_the_radius_follows_the_truncated_rayleigh_law(errors: NDArray[np.complex128]) -> None:
    def law(r: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.clip((1.0 - np.exp(-4.5 * r**2)) / (1.0 - LEFT_OUT), 0.0, 1.0)

    assert kstest(np.abs(errors), law).pvalue > 1e-3


def test_no_direction_is_preferred(errors: NDArray[np.complex128]) -> None:
    turn = np.angle(errors) / (2.0 * np.pi) + 0.5
    assert kstest(turn, "uniform").pvalue > 1e-3
    assert_mean(errors.real * errors.imag, 0.0)
    # also where the cut has been at work
    assert kstest(turn[np.abs(errors) > 0.9], "uniform").pvalue > 1e-3


def test_errors_of_one_block_are_independent() -> None:
    pairs = disc_noise(np.random.default_rng(3), (2, N // 2))
    assert_mean((pairs[0] * pairs[1].conj()).real, 0.0)
    assert_mean((pairs[0] * pairs[1].conj()).imag, 0.0)


@pytest.mark.parametrize("shape", [(1,), (2, 3), (2, 6, 3, 50)])
def test_shape_and_seed(shape: tuple[int, ...]) -> None:
    first = disc_noise(np.random.default_rng(5), shape)
    assert first.shape == shape
    assert first.dtype == np.complex128
    np.testing.assert_array_equal(first, disc_noise(np.random.default_rng(5), shape))


NOTHING = Bounds(tve_pct=0.0, current_floor_a=0.0, ratio_pct=0.0, angle_mrad=0.0, clock_us=0.0)
CONTRACT = Bounds(tve_pct=0.05, current_floor_a=0.05)


def random_phasors(rng: np.random.Generator, size: int, points: int = 2) -> tuple[Complex, Complex]:
    """Volts and amperes of every magnitude."""
    shape = (2, points, 3, size)
    v, i = (10.0 ** rng.uniform(-3, 4, shape) * disc_noise(rng, shape) for _ in range(2))
    return v, i


def no_errors(points: int, size: int) -> Errors:
    frames, channels = (2, points, 3, size), (points, 3, size)
    lasting = {name: np.zeros(channels, np.float32) for name in LASTING}
    return Errors(
        v_noise=np.zeros(frames, complex),
        i_noise=np.zeros(frames, complex),
        clock=np.zeros((points, size), np.float32),
        frequency=np.zeros(size, np.float32),
        **lasting,
    )


LASTING = ("v_ratio", "v_angle", "i_ratio", "i_angle")


def test_errors_have_their_shapes_and_their_seed() -> None:
    first, again = (draw_errors(np.random.default_rng(5), 4, 100) for _ in range(2))
    for field in fields(Errors):
        values = getattr(first, field.name)
        shape = {"clock": (4, 100), "frequency": (100,)}.get(field.name, (4, 3, 100))
        assert values.shape == ((2, *shape) if "noise" in field.name else shape)
        np.testing.assert_array_equal(values, getattr(again, field.name))


def test_lasting_errors_are_uniform_within_their_bounds_and_independent() -> None:
    errors = draw_errors(np.random.default_rng(6), 3, 20_000)
    flat = [getattr(errors, name).astype(float) for name in (*LASTING, "clock", "frequency")]
    for values in flat:
        assert np.abs(values).max() <= 1.0
        assert kstest(values.ravel(), "uniform", args=(-1.0, 2.0)).pvalue > 1e-3
    channels = np.concatenate([values.reshape(-1, 20_000) for values in flat])
    noise = [getattr(errors, name).reshape(-1, 20_000) for name in ("v_noise", "i_noise")]
    rows = np.concatenate([channels, *(part(x) for x in noise for part in (np.real, np.imag))])
    correlation = np.corrcoef(rows) - np.eye(len(rows))
    assert np.abs(correlation).max() < 6.0 / math.sqrt(20_000)  # of 5995 pairs


def test_a_reported_phasor_is_within_the_total_vector_error_or_the_floor() -> None:
    rng = np.random.default_rng(8)
    v, i = random_phasors(rng, 3000)
    only_noise = replace(NOTHING, tve_pct=0.05, current_floor_a=0.05)
    reported = measure(v, i, draw_errors(rng, 2, 3000), only_noise)
    for true, found, floor in ((v, reported.v, 0.0), (i, reported.i, 0.05)):
        bound = np.maximum(0.0005 * np.abs(true), floor)
        gap = np.abs(found - true)
        assert (gap <= bound * (1.0 + 1e-9)).all()
        assert gap.max() > 0.5  # at thousands the percentage speaks, not the floor


def test_bounds_by_hand() -> None:
    true = np.array([200.0 + 0j, 100j, 50.0 + 0j, 0j])
    error = np.array([1.0 + 0j, 1j, -1.0 + 0j, 0.6 + 0.8j])
    # 0.05 % of 200 is 0.1, of 100 just the floor, below it the floor; volts have none
    amperes = [200.1, 100.05j, 49.95, 0.03 + 0.04j]
    volts = [200.1, 100.05j, 49.975, 0.0]
    frames = np.broadcast_to(true, (2, 1, 3, 4))
    errors = replace(
        no_errors(1, 4),
        v_noise=np.broadcast_to(error, (2, 1, 3, 4)),
        i_noise=np.broadcast_to(error, (2, 1, 3, 4)),
    )
    found = measure(frames, frames, errors, CONTRACT)
    np.testing.assert_allclose(found.i, np.broadcast_to(amperes, (2, 1, 3, 4)), rtol=1e-14)
    np.testing.assert_allclose(found.v, np.broadcast_to(volts, (2, 1, 3, 4)), rtol=1e-14)


def test_every_phasor_is_the_one_by_hand() -> None:
    rng = np.random.default_rng(9)
    v, i = random_phasors(rng, 30)
    errors = draw_errors(rng, 2, 30)
    bounds = Bounds(
        tve_pct=1.0, current_floor_a=0.3, ratio_pct=2.0, angle_mrad=30.0, clock_us=80.0,
        frequency_hz=0.02, nominal_hz=50.0, dt_s=1.5,
    )  # fmt: skip
    reported = measure(v, i, errors, bounds)
    for frame, p, k, s in np.ndindex(2, 2, 3, 30):
        for true, found, kind, floor in ((v, reported.v, "v", 0.0), (i, reported.i, "i", 0.3)):
            x = complex(true[frame, p, k, s])
            turn = 2 * math.pi * 50.0 * 80e-6 * float(errors.clock[p, s])
            turn += 0.030 * float(getattr(errors, f"{kind}_angle")[p, k, s])
            if frame:
                turn += 2 * math.pi * 0.02 * 1.5 * float(errors.frequency[s])
            ratio = 1 + 0.02 * float(getattr(errors, f"{kind}_ratio")[p, k, s])
            noise = max(0.01 * abs(x), floor) * getattr(errors, f"{kind}_noise")[frame, p, k, s]
            expected = x * ratio * cmath.exp(1j * turn) + noise
            assert found[frame, p, k, s] == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_perfect_instruments_report_the_truth() -> None:
    rng = np.random.default_rng(1)
    v, i = random_phasors(rng, 100)
    reported = measure(v, i, draw_errors(rng, 2, 100), NOTHING)
    np.testing.assert_array_equal(reported.v, v)
    np.testing.assert_array_equal(reported.i, i)


def test_inputs_stay_as_they_were() -> None:
    rng = np.random.default_rng(2)
    v, i = random_phasors(rng, 50)
    errors = draw_errors(rng, 2, 50)
    names = [field.name for field in fields(Errors)]
    before = [x.copy() for x in (v, i, *(getattr(errors, name) for name in names))]
    reported = measure(v, i, errors, replace(CONTRACT, frequency_hz=0.1))
    miswire(reported, np.zeros(50, np.int64), np.arange(50) % len(Wiring))
    for found, expected in zip(
        (v, i, *(getattr(errors, name) for name in names)), before, strict=True
    ):
        np.testing.assert_array_equal(found, expected)


# --- what lasting errors do to the evidence --------------------------------------------


def a_break(rng: np.random.Generator, size: int) -> tuple[Complex, Complex]:
    """Phasors of two ends before and after something between them, of the positive sequence."""
    v = 7000.0 * (1.0 + 0.03 * disc_noise(rng, (2, 2, 1, size)))
    i = 20.0 * (1.0 + 0.3 * disc_noise(rng, (2, 2, 1, size)))
    return v * POSITIVE, i * POSITIVE


def both_ways() -> tuple[Terminal, Terminal]:
    empty = np.zeros(0, np.bool_)
    one = Terminal(
        local="L", remote="R", local_point=0, remote_point=1, into=1.0, on_path=empty,
        in_section=empty, load_side=False, line_z1_ohm=0j, loop_z1_ohm=None,
        edge_side=np.zeros(0, np.int8),
        node_side=np.zeros(1, np.int8),
    )  # fmt: skip
    other = replace(one, local="R", remote="L", local_point=1, remote_point=0)
    return one, other


def test_a_frequency_offset_moves_the_voltages_and_leaves_eq_5_alone() -> None:
    """0.01 Hz over 1 s: |ΔV1| of an event that moves nothing is 6.3 % (PHYSICS)."""
    rng = np.random.default_rng(31)
    v, i = a_break(rng, 200)
    v[1, 0] = v[0, 0]  # a stiff source
    errors = replace(no_errors(2, 200), frequency=np.ones(200, np.float32))
    offset = replace(NOTHING, frequency_hz=0.01, dt_s=1.0)
    plain, turned = (
        evidence_of(measure(v, i, errors, bounds), both_ways(), 7000.0)
        for bounds in (NOTHING, offset)
    )
    assert plain.dv1_pu[0].max() < 1e-12
    size = np.abs(v[0, 0, 0]) / 7000.0
    np.testing.assert_allclose(turned.dv1_pu[0] / size, 2.0 * math.sin(math.pi * 0.01), rtol=1e-9)
    assert turned.dv1_pu[0].mean() == pytest.approx(0.063, abs=5e-4)
    np.testing.assert_allclose(turned.z_ohm, plain.z_ohm, rtol=1e-9)
    # and it calls for a compensated trigger, which it leaves alone as well
    star = [
        evidence_of(measure(v, i, errors, b), both_ways(), 7000.0, Options(compensated=True))
        for b in (NOTHING, offset)
    ]
    np.testing.assert_allclose(star[1].di_star_a, star[0].di_star_a, rtol=1e-9, atol=1e-9)
    assert np.abs(turned.di1_a - plain.di1_a).max() > 0.5


def test_lasting_errors_only_multiply_a_sequence_pure_impedance() -> None:
    """By the gain of the remote voltage over that of the local current; the local V drops out."""
    rng = np.random.default_rng(32)
    size = 300
    v, i = a_break(rng, size)
    errors = draw_errors(rng, 2, size)
    lasting = replace(CONTRACT, tve_pct=0.0, current_floor_a=0.0, clock_us=50.0, angle_mrad=20.0)
    true, seen = (
        evidence_of(measure(v, i, errors, b), both_ways(), 7000.0, Options(fallback=False))
        for b in (NOTHING, lasting)
    )

    def gain(kind: str) -> Complex:
        """(P, S) of the positive sequence: the mean over the phases."""
        turn = (
            0.02 * getattr(errors, f"{kind}_angle")
            + 2e-6 * math.pi * 60 * 50 * errors.clock[:, None]
        )
        found = (1 + 0.003 * getattr(errors, f"{kind}_ratio")) * np.exp(1j * turn)
        return np.asarray(found.mean(axis=1))

    for t, (local, remote) in enumerate(((0, 1), (1, 0))):
        expected = true.z1_ohm[t] * gain("v")[remote] / gain("i")[local]
        np.testing.assert_allclose(seen.z1_ohm[t], expected, rtol=1e-5)
    # a real error all the same
    assert np.abs(seen.z1_ohm / true.z1_ohm - 1.0).max() > 0.01


def test_a_microsecond_is_four_parts_in_ten_thousand() -> None:
    rng = np.random.default_rng(33)
    v, i = a_break(rng, 10)
    errors = replace(no_errors(2, 10), clock=np.ones((2, 10), np.float32))
    reported = measure(v, i, errors, replace(NOTHING, clock_us=1.0))
    np.testing.assert_allclose(np.abs(reported.v / v - 1.0), 0.000377, rtol=1e-3)


# --- wrong wiring ----------------------------------------------------------------------


def test_wrong_wiring_by_hand() -> None:
    """Phases a, b, c are 1, 2, 3 volts and 10, 20, 30 amperes."""
    reports = {
        Wiring.RIGHT: ([1, 2, 3], [10, 20, 30]),
        Wiring.SWAPPED_AB: ([2, 1, 3], [20, 10, 30]),
        Wiring.SWAPPED_BC: ([1, 3, 2], [10, 30, 20]),
        Wiring.SWAPPED_CA: ([3, 2, 1], [30, 20, 10]),
        Wiring.VOLTAGES_SWAPPED_AB: ([2, 1, 3], [10, 20, 30]),
        Wiring.VOLTAGES_SWAPPED_BC: ([1, 3, 2], [10, 20, 30]),
        Wiring.VOLTAGES_SWAPPED_CA: ([3, 2, 1], [10, 20, 30]),
        Wiring.REVERSED_A: ([1, 2, 3], [-10, 20, 30]),
        Wiring.REVERSED_B: ([1, 2, 3], [10, -20, 30]),
        Wiring.REVERSED_C: ([1, 2, 3], [10, 20, -30]),
        Wiring.REVERSED_ALL: ([1, 2, 3], [-10, -20, -30]),
        Wiring.ROTATED_BCA: ([2, 3, 1], [20, 30, 10]),
        Wiring.ROTATED_CAB: ([3, 1, 2], [30, 10, 20]),
    }
    assert set(reports) == set(Wiring)
    kinds = np.array(list(reports))
    points = np.arange(kinds.size) % 2
    frame = np.array([[1, 2, 3], [4, 5, 6]])[None, :, :, None]  # two points
    v = np.array(np.broadcast_to(frame, (2, 2, 3, kinds.size)), complex)
    found = miswire(Phasors(v=v, i=10 * v), points, kinds)
    for s, (volts, amperes) in enumerate(reports.values()):
        here = points[s]
        for n in (0, 1):
            assert found.v[n, here, :, s].tolist() == [x + 3 * here for x in volts]
            expected = [x + math.copysign(30 * here, x) for x in amperes]
            assert found.i[n, here, :, s].tolist() == expected
            np.testing.assert_array_equal(found.v[n, 1 - here, :, s], v[n, 1 - here, :, s])
            np.testing.assert_array_equal(found.i[n, 1 - here, :, s], 10 * v[n, 1 - here, :, s])
