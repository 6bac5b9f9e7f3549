"""What limits security on the paper's feeder, at the figures found before.

As in ``test_limits``: facts to meet, or to correct in decision record 0008. No noise, unless
a test says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from oracles.happenings import (
    ALL,
    ONE,
    TWO,
    Seen,
    happen,
    scene_of,
    seen,
    three_phase_s,
    with_pv,
)
from oracles.scenes import Pair, change, looks

from openphase.detector.criteria import Reason
from openphase.detector.impedance import connection_impedance
from openphase.detector.instruments import disc_noise
from openphase.model import Feeder, load_feeder
from openphase.model.closed_form import (
    false_trip_probability,
    least_operating_voltage,
    z_opposite_steps,
)
from openphase.model.parts import DerModel, Regulator

# ---- security: what imitates an open phase ----


def swap(far: str) -> tuple[Seen, Seen]:
    """+500 kW at 0.2 of R2-R3 and -450 kW beyond, as R2 and as R3 see it."""
    at = scene_of(load_feeder("paper"))
    frames = happen(
        at,
        "R2-R3",
        0.2,
        earth_after_s=three_phase_s(at, 500.0),
        far_node=np.array([at.network.node(far)]),
        far_before_s=three_phase_s(at, 450.0),
    )
    return seen(at, frames), seen(at, frames, "R3", "R2")


def test_an_opposite_swap_trips_without_any_noise() -> None:
    """5.75∠-115° at 2.5 A: between what the step gives at R3 and at the tee 2.5 km on."""
    near, farther = (swap(far)[0] for far in ("R3", "R3-R4:0.5"))
    assert farther.z[0] < 5.75 < near.z[0]
    assert farther.z[1] < -115.0 < near.z[1]
    for found in (near, farther):
        assert found.z == pytest.approx((5.75, -115.0), abs=1.4)
        assert found.di1_a == pytest.approx(2.5, abs=0.06)
        assert found.reason == Reason.TRIP


def test_when_a_swap_trips() -> None:
    """Where |1 + r| < |f + r| Z_line / Z_set; (1 - f) Z_line / Z_set is the first order of it."""
    z_line, f, z_set = 0.85, 0.2, 5.0
    first_order = (1.0 - f) * z_line / z_set
    # the border on either side of r = -1, where the far step is the smaller one and the larger
    smaller = (1.0 - f) * z_line / (z_set + z_line)
    larger = (1.0 - f) * z_line / (z_set - z_line)
    assert smaller < first_order < larger

    def size(r: float) -> float:
        return float(np.abs(z_opposite_steps(np.array(z_line + 0j), np.array(f), np.array(r + 0j))))

    assert size(-1.0 + 0.999 * smaller) > z_set > size(-1.0 + 1.001 * smaller)
    assert size(-1.0 - 0.999 * larger) > z_set > size(-1.0 - 1.001 * larger)


def test_the_far_end_of_a_swap_sees_no_more_than_line() -> None:
    """Both-end agreement: what R3 reports of it is passive line, below any setting."""
    for far in ("R3-R4:0.5", "R3-R4:0.9", "R4"):
        _, there = swap(far)
        assert abs(there.z_ohm) <= 0.851
        assert there.di1_a > 20.0


def test_closing_three_phases_inside_looks_like_opening() -> None:
    """288∠-179° at 23.9 A."""
    at = scene_of(load_feeder("paper"))
    found = seen(at, happen(at, "R2-R3", 0.6, open_before=ALL))
    assert found.z == pytest.approx((288.30, -179.3), abs=0.05)
    assert found.di1_a == pytest.approx(23.9, abs=0.05)
    assert found.reason == Reason.BLOCKED  # R3 was dead: the only rule that tells it apart


@pytest.mark.parametrize("mask", [ONE, TWO], ids=["one", "two"])
def test_closing_one_or_two_phases_is_the_opening_itself(mask: np.ndarray) -> None:
    at = scene_of(load_feeder("paper"))
    opening = seen(at, happen(at, "R2-R3", 0.6, open_after=mask))
    closing = seen(at, happen(at, "R2-R3", 0.6, open_before=mask))
    assert closing.z_ohm == pytest.approx(opening.z_ohm, rel=1e-9)
    assert closing.di1_a == pytest.approx(opening.di1_a, rel=1e-9)
    assert closing.reason == opening.reason


def source_step(feeder: Feeder, pct: float, exponent: float) -> Seen:
    """The source rises, as R1 sees it, with loads of this exponent."""
    loads = tuple(replace(load, exponent=exponent) for load in feeder.loads)
    at = scene_of(replace(feeder, loads=loads))
    return seen(at, happen(at, emf_factor=np.array([1.0 + pct / 100.0])), "R1", "R2")


def test_an_upstream_step_explains_itself_away() -> None:
    """-2.5 % and constant impedance: 1.9 A at the head, none of it unexplained."""
    feeder = load_feeder("paper")
    found = source_step(feeder, -2.5, 2.0)
    assert found.di1_a == pytest.approx(1.9, abs=0.05)
    assert 0.02 < found.dv1_pu < 0.03  # V_set does not block it
    assert np.abs(found.pair.compensated()[1]).max() < 1e-9
    assert found.pair.eq_5(1)[1].all()  # 0/0


def test_a_frequency_offset_blocks_what_compensation_would_not_even_see() -> None:
    """0.01 Hz over 1 s turns every phasor alike: |ΔV1| is 6.3 %, ΔI* is nothing."""
    at = scene_of(load_feeder("paper"))
    steady = looks(at, at.steady)
    turn = np.exp(2j * np.pi * 0.01)
    found = seen(at, (steady, steady._replace(v=steady.v * turn, i=steady.i * turn)), "R1", "R2")
    assert found.dv1_pu == pytest.approx(0.063, abs=5e-4)
    assert found.di1_a > 1.0
    assert found.reason == Reason.VOLTAGE
    assert np.abs(found.pair.compensated()[1]).max() < 1e-9


def test_with_constant_power_the_same_step_shows_the_line() -> None:
    """So noise does not decide, and the loads' exponents must be sampled."""
    for pct in (-5.0, -2.5, 2.5):
        found = source_step(load_feeder("paper"), pct, 0.0)
        assert np.abs(found.pair.compensated()[1]).max() > 1.0
        assert abs(found.z_ohm) <= 0.39 * 1.01
        assert found.z_ohm == pytest.approx(0.39 * np.exp(1j * np.radians(70)), rel=0.25)


@pytest.mark.parametrize(("kappa", "at_5", "at_50"), [(0.0, 0.85, 0.80), (2.6, 0.62, 0.28)])
def test_noise_makes_an_open_phase_of_a_step_that_explains_itself(
    kappa: float, at_5: float, at_50: float
) -> None:
    """62..85 % of draws at 5 Ω, and still 28..80 % at 50 Ω.

    With all changes explained, errors e of the voltages and i of the current are all that is
    left of eq. (5): Z = -Z_load (e_n - e_m) / (i / I - e_m). Its real part is negative with
    probability (1 + 1/sqrt(2 (1 + k²))) / 2, k the relative error of the current over that
    of the voltage.
    """
    rng = np.random.default_rng(2026)
    first = source_step(load_feeder("paper"), -2.5, 2.0).pair
    size, sigma = 200_000, 5e-5

    def noisy(phasor: np.ndarray, relative: float) -> np.ndarray:
        error = rng.standard_normal((2, size, 2)) @ np.array([1.0, 1.0j]) / np.sqrt(2.0)
        return phasor[:, 1] * (1.0 + relative * error)

    m, n, i = noisy(first.v_m, sigma), noisy(first.v_n, sigma), noisy(first.i_m, kappa * sigma)
    z, _ = connection_impedance(m[1], n[1], i[1], m[1] - m[0], n[1] - n[0], i[1] - i[0])
    negative = 0.5 * (1.0 + 1.0 / np.sqrt(2.0 * (1.0 + kappa**2)))
    assert np.mean(z.real < 0) == pytest.approx(negative, abs=0.01)
    for z_set, share in ((5.0, at_5), (50.0, at_50)):
        assert np.mean((z.real < 0) & (np.abs(z) >= z_set)) == pytest.approx(share, abs=0.01)


@pytest.mark.parametrize(
    ("sigma", "law", "drawn"), [(5e-4, 0.0255, 0.0233), (5e-4 * np.sqrt(2.0), 0.113, 0.102)]
)
def test_noise_trips_a_small_external_step(sigma: float, law: float, drawn: float) -> None:
    """50 kW beyond, 5 Ω: the law, and a tenth less by the line that it leaves out."""
    at = scene_of(load_feeder("paper"))
    step = seen(at, happen(at, "R3-R4", 0.5, earth_after_s=three_phase_s(at, 50.0)))
    assert step.reason == Reason.IMPEDANCE
    v, size = at.network.tree.v_nominal_v, 400_000
    wanted = (np.array(x) for x in (5.0, step.di1_a, sigma, v))
    assert false_trip_probability(*wanted) == pytest.approx(law, rel=0.02)
    error = np.random.default_rng(50).standard_normal((4, size, 2)) @ np.array([1.0, 1.0j])
    m, n, i = (x[:, 1] for x in (step.pair.v_m, step.pair.v_n, step.pair.i_m))
    m0, m1, n0, n1 = np.concatenate([m, n]) * (1.0 + sigma / np.sqrt(2.0) * error)
    i0, i1 = np.broadcast_to(i, (2, size))
    z, _ = connection_impedance(m1, n1, i1, m1 - m0, n1 - n0, i1 - i0)
    found = np.mean((np.abs(z) >= 5.0) & (z.real < 0))
    # four standard deviations of a share; the figures are of another draw and 2 % of place
    assert found == pytest.approx(drawn, abs=4.0 * np.sqrt(drawn / size) + 0.02 * drawn)


def with_regulator(taps: int) -> Feeder:
    """A regulator half-way between R2 and R3, whose own loads are gone."""
    feeder = load_feeder("paper")
    trunk = next(line for line in feeder.lines if line.name == "R2-R3")
    units = tuple(unit for unit in feeder.transformers if unit.place.line != "R2-R3")
    names = {unit.name for unit in units}
    half = trunk.length_km / 2.0
    return replace(
        feeder,
        lines=(
            *(line for line in feeder.lines if line.name != "R2-R3"),
            replace(trunk, name="upper", to_bus="M", length_km=half),
            replace(trunk, name="lower", from_bus="N", length_km=half),
        ),
        transformers=units,
        loads=tuple(load for load in feeder.loads if load.transformer in names),
        points=tuple(replace(p, line="upper") if p.name == "R2" else p for p in feeder.points),
        regulators=(
            Regulator(
                name="VR",
                from_bus="M",
                to_bus="N",
                taps=(taps, taps, taps),
                step_pct=0.625,
                most_taps=16,
            ),
        ),
    )


@pytest.mark.parametrize(("first", "then"), [(0, 1), (4, 2), (-3, 5)])
def test_a_tap_change_inside_imitates_an_open_phase(first: int, then: int) -> None:
    """-Z_load / (r + r'), about -Z_load / 2: V_n = r V_m and I_m = r² V_m / Z_load in eq. (5)."""
    at = scene_of(with_regulator(first))
    ratio, other = 1.0 + 0.00625 * first, 1.0 + 0.00625 * then
    found = seen(at, happen(at, tap_factor=np.full((1, 3, 1), other / ratio)))
    quiet = looks(at, at.steady)
    end = change(at, at.terminal("R3", "R2"), quiet, quiet)
    z_load = complex(-end.v_m[0, 1, 0] / end.i_m[0, 1, 0])
    assert abs(z_load) > 300.0
    assert found.z_ohm == pytest.approx(-z_load / (ratio + other), rel=0.01)
    assert found.z_ohm.real < 0


# ---- the closed loop ----


def test_an_internal_load_of_a_loop_is_reversed_at_the_end_it_is_near_to() -> None:
    """1.37∠-110° at R3 for a load just before it; opposite signs at the two ends."""
    at = scene_of(load_feeder("paper"), tie_closed=True)
    frames = happen(at, "R2-R3", 0.98, earth_after_s=three_phase_s(at, 90.0))
    there, here = seen(at, frames, "R3", "R2"), seen(at, frames, "R2", "R3")
    assert there.z[0] == pytest.approx(1.37, abs=0.005)
    assert there.z[1] == pytest.approx(-110.0, abs=0.5)
    assert here.z_ohm.real > 0 > there.z_ohm.real


def test_in_the_head_section_a_load_is_inseparable_from_an_open_phase() -> None:
    """2.88∠-110° at R2 for either."""
    at = scene_of(load_feeder("paper"), tie_closed=True)
    frames = happen(at, "R1-R2", 0.3, earth_after_s=three_phase_s(at, 90.0))
    load = seen(at, frames, "R2", "R1")
    opening = seen(at, happen(at, "R1-R2", 0.3, open_after=ONE), "R2", "R1")
    assert load.z[0] == pytest.approx(2.88, abs=0.005)
    assert load.z[1] == pytest.approx(-110.0, abs=0.5)
    assert load.z_ohm == pytest.approx(opening.z_ohm, rel=1e-9)


def test_the_two_ends_of_a_loop_agree_on_an_open_phase_only() -> None:
    at = scene_of(load_feeder("paper"), tie_closed=True)
    for fraction in (0.1, 0.6, 0.95):
        frames = happen(at, "R2-R3", fraction, open_after=ONE)
        here, there = seen(at, frames), seen(at, frames, "R3", "R2")
        assert here.z_ohm == pytest.approx(there.z_ohm, rel=0.02)  # but for T2's and T4's load
        assert here.z_ohm.real < 0
        frames = happen(at, "R2-R3", fraction, earth_after_s=three_phase_s(at, 200.0))
        here, there = seen(at, frames), seen(at, frames, "R3", "R2")
        assert here.z_ohm.real * there.z_ohm.real < 0


# ---- what is safe, one at a time ----


def safe_events(feeder: Feeder) -> dict[str, Callable[[str, float], Seen]]:
    """Steps, starts, faults and banks, each at a place on a line."""
    at = scene_of(feeder)
    v2 = at.network.tree.v_nominal_v**2
    one = np.array([[1.0], [0.0], [0.0]])

    def here(**event: object) -> Callable[[str, float], Seen]:
        return lambda line, fraction: seen(at, happen(at, line, fraction, **event))

    start = 6.0 * 200e3 / 3.0 / v2 * np.exp(-1j * np.arccos(0.2)) / 3.0
    return {
        "load on": here(earth_after_s=three_phase_s(at, 300.0)),
        "load off": here(earth_before_s=three_phase_s(at, 300.0)),
        "single-phase load": here(earth_after_s=one * three_phase_s(at, 300.0)),
        "motor start": here(between_after_s=np.full((3, 1), start)),
        "capacitor": here(earth_after_s=three_phase_s(at, 600.0) * 1j),
        "earth fault of 40 ohm": here(earth_after_s=one / 40.0 + 0j),
        "line-line fault": here(between_after_s=one / 20.0 + 0j),
    }


@pytest.mark.parametrize("name", list(safe_events(load_feeder("paper"))))
@pytest.mark.parametrize(
    ("line", "fraction", "inside"),
    [("R2-R3", 0.05, True), ("R2-R3", 0.6, True), ("R2-R3", 0.95, True), ("R3-R4", 0.4, False)],
)
def test_single_events_stay_at_the_line_s_impedance_or_below(
    name: str, line: str, fraction: float, inside: bool
) -> None:
    found = safe_events(load_feeder("paper"))[name](line, fraction)
    assert found.di1_a > 2.0
    assert abs(found.z_ohm) <= 0.8505
    if inside:  # up to where it happens
        assert abs(found.z_ohm) == pytest.approx(0.85 * fraction, abs=0.03)
    assert found.reason in (Reason.IMPEDANCE, Reason.VOLTAGE)


@pytest.mark.parametrize("model", ["constant_current", "constant_power"])
def test_generation_that_trips_alone_shows_the_line(model: DerModel) -> None:
    at = scene_of(with_pv(model))
    found = seen(at, happen(at, der_factor=np.zeros((1, 1))))
    assert found.di1_a == pytest.approx(33.6, abs=0.05)
    assert abs(found.z_ohm) == pytest.approx(0.85, abs=0.001)


@pytest.mark.parametrize("closing", [True, False])
def test_switching_the_tie_shows_the_line_where_nothing_changes_inside(closing: bool) -> None:
    """The same R2-R3 in the open and in the closed network."""
    ends = []
    for tie_closed in (False, True):
        at = scene_of(load_feeder("paper"), tie_closed=tie_closed)
        answer = looks(at, at.steady)
        ends.append(change(at, at.terminal("R2", "R3"), answer, answer))
    first, then = ends if closing else ends[::-1]

    def both(field: str) -> np.ndarray:
        return np.stack([getattr(first, field)[0], getattr(then, field)[1]])

    pair = Pair(both("v_m"), both("v_n"), both("i_m"))
    assert abs(pair.i_m[1, 1] - pair.i_m[0, 1])[0] > 1.0
    assert abs(pair.z()[0]) == pytest.approx(0.85, abs=0.001)


# ---- Z_set from above ----


def test_the_smallest_values_of_an_open_phase() -> None:
    """90 Ω in the open loop, 1.9..2.9 Ω in the closed one, where 5 Ω never trips."""
    feeder = load_feeder("paper")
    terminals = (("R1", "R2"), ("R2", "R3"), ("R3", "R4"), ("R5", "R4b"))
    lines = {"R1": "R1-R2", "R2": "R2-R3", "R3": "R3-R4", "R5": "R4-R5"}

    def smallest(tie_closed: bool) -> list[float]:
        at = scene_of(feeder, tie_closed=tie_closed)
        found = []
        for local, remote in terminals:
            for fraction in (0.05, 0.3, 0.6, 0.95):
                own = seen(at, happen(at, lines[local], fraction, open_after=ONE), local, remote)
                if own.di1_a > 1e-6:
                    found.append(abs(own.z_ohm))
                    if tie_closed:
                        assert own.reason != Reason.TRIP
        return found

    assert min(smallest(False)) == pytest.approx(90.0, abs=0.5)
    loop = smallest(True)
    assert min(loop) == pytest.approx(1.9, abs=0.1)
    assert max(loop) == pytest.approx(2.9, abs=0.05)


def test_the_size_of_the_default_voltage_error() -> None:
    """0.05 % TVE truncated: 0.0133 % of V1; 6.7 V for 1e-6, 13.9 V for certain; 1 µs: 0.038 %."""
    error = 5e-4 * disc_noise(np.random.default_rng(7), (3, 200_000))
    sigma = float(np.sqrt(np.mean(np.abs(error) ** 2) / 3.0))
    assert sigma == pytest.approx(1.33e-4, abs=1e-6)
    v = load_feeder("paper").source.v_phase_v
    floor = least_operating_voltage(np.array(1e-6), np.array(sigma), np.array(v))
    assert floor == pytest.approx(6.7, abs=0.05)
    assert 4 * 5e-4 * v == pytest.approx(13.9, abs=0.05)  # four voltages, each at its bound
    assert 2 * np.pi * 60.0 * 1e-6 == pytest.approx(3.8e-4, abs=1e-5)
