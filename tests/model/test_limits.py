"""What limits dependability on the paper's feeder, at the figures found before.

Every figure was found by two programs that share nothing with this one; here they are facts
to meet. Where one of them could not be met, decision record 0008 says so and derives what
holds instead. No noise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from oracles.happenings import (
    ALL,
    ANY_SEQUENCE,
    ONE,
    PAPER,
    TWO,
    Seen,
    happen,
    scene_of,
    seen,
    three_phase_s,
    with_pv,
)
from oracles.scenes import connected, constants
from scipy.optimize import brentq

from openphase.detector.criteria import Reason, Settings
from openphase.model import Feeder, Place, load_feeder
from openphase.model.network import locate
from openphase.model.parts import Load
from openphase.model.symmetrical import to_sequences

BEYOND = ("L4", "L5", "L6")  #: loads beyond the break at 0.6 of R2-R3: 500 kW


def beyond(feeder: Feeder, kw: float, *, motors: bool = False) -> Feeder:
    """The loads beyond the break in proportion, ``kw`` in all; motors take Y2 = 6 Y1."""
    loads = tuple(
        replace(load, kw=load.kw * kw / 500.0, motor_share=float(motors))
        if load.name in BEYOND
        else load
        for load in feeder.loads
    )
    return replace(feeder, loads=loads)


def broken(feeder: Feeder, mask: np.ndarray = ONE, **event: object) -> Seen:
    """Phases open at the paper's place, as R2 sees it."""
    at = scene_of(feeder)
    return seen(at, happen(at, "R2-R3", 0.6, open_after=mask, **event))


# ---- the load beyond the break ----


def three_wire(feeder: Feeder) -> Feeder:
    return connected(feeder, "D/Yg", "T1", "T2", "T3", "T4", "T5", "T6")


def ideal(feeder: Feeder) -> Feeder:
    units = tuple(replace(unit, x0_pu=None) for unit in feeder.transformers)
    return connected(replace(feeder, transformers=units), "Yg/Yg", "T2", "T4")


def three_limb(feeder: Feeder) -> Feeder:
    units = tuple(
        replace(unit, connection="Yg/Yg", x0_pu=1.0) if unit.name == "T4" else unit
        for unit in feeder.transformers
    )
    return replace(feeder, transformers=units)


def three_yg_d(feeder: Feeder) -> Feeder:
    return connected(feeder, "Yg/D", "T5", "T6")


def small_t4(feeder: Feeder) -> Feeder:
    units = tuple(
        replace(unit, rating_kva=100.0) if unit.name == "T4" else unit
        for unit in feeder.transformers
    )
    return replace(feeder, transformers=units)


def as_it_is(feeder: Feeder) -> Feeder:
    return feeder


LEAST_KW: dict[str, tuple[Callable[[Feeder], Feeder], np.ndarray, bool, tuple[float, ...]]] = {
    "three-wire, one open": (three_wire, ONE, False, (21, 42, 83, 209)),
    "two open with a Yg/D": (as_it_is, TWO, False, (21, 42, 83, 209)),
    "four-wire, ideal banks, two open": (ideal, TWO, False, (16, 31, 63, 157)),
    "three-wire, two open": (three_wire, TWO, False, (10, 21, 42, 104)),
    "four-wire, ideal banks": (ideal, ONE, False, (31, 63, 125, 313)),
    "no Yg/D, three-limb Yg/Yg": (three_limb, ONE, False, (172, 246, 353, 588)),
    "three-wire, motors": (three_wire, ONE, True, (73, 146, 290, 714)),
    "one Yg/D of 1 MVA": (as_it_is, ONE, False, (395, 560, 797, 1279)),
    "three Yg/D of 1 MVA": (three_yg_d, ONE, False, (546, 775, 1102, 1762)),
    "one Yg/D of 100 kVA": (small_t4, ONE, False, (191, 272, 390, 642)),
}


@pytest.mark.parametrize("system", LEAST_KW)
def test_the_least_load_beyond_the_break(system: str) -> None:
    """kW at which |ΔI1| reaches 0.5, 1, 2 and 5 A; figures are whole kW."""
    variant, mask, motors, figures = LEAST_KW[system]
    feeder = variant(load_feeder("paper"))

    def excess(kw: float, i_set_a: float) -> float:
        return broken(beyond(feeder, kw, motors=motors), mask).di1_a - i_set_a

    for i_set_a, figure in zip((0.5, 1.0, 2.0, 5.0), figures, strict=True):
        found = brentq(excess, 0.5 * figure, 1.5 * figure, args=(i_set_a,), xtol=1e-4)
        assert round(found) == figure, i_set_a


# ---- cases that the paper's settings miss ----


@pytest.mark.parametrize(("kw", "di1_a"), [(500.0, 0.80), (250.0, 0.20), (0.0, 0.0)])
def test_too_little_load_is_missed(kw: float, di1_a: float) -> None:
    found = broken(beyond(load_feeder("paper"), kw))
    assert found.di1_a == pytest.approx(di1_a, abs=0.005)
    assert found.reason == Reason.CURRENT


@pytest.mark.parametrize(("kw", "di1_a"), [(250.0, 0.21), (500.0, 0.03), (700.0, 0.13)])
def test_generation_at_constant_power_hides_the_load(kw: float, di1_a: float) -> None:
    found = broken(with_pv("constant_power", kw))
    assert found.di1_a == pytest.approx(di1_a, abs=0.005)
    assert found.reason == Reason.CURRENT


def test_what_phases_find_where_the_positive_sequence_is_idle() -> None:
    """Down to 50 kW beyond the break; nothing where load and generation cancel."""
    feeder = load_feeder("paper")
    for kw in (500.0, 250.0, 125.0, 50.0):
        assert broken(beyond(feeder, kw)).with_phases == Reason.TRIP
    for kw in (20.0, 0.0):
        assert broken(beyond(feeder, kw)).with_phases == Reason.CURRENT
    for kw, reason in ((250.0, Reason.TRIP), (500.0, Reason.CURRENT), (700.0, Reason.TRIP)):
        assert broken(with_pv("constant_power", kw)).with_phases == reason


def test_the_settings_and_the_floor_by_load_beyond_the_break() -> None:
    """Share found, here 0 or 1: 1 A and 5 Ω none; 0.5 A and 50 Ω one; any sequence, all."""
    stiff = replace(PAPER, i_set_a=0.5, z_set_ohm=50.0)
    found = [broken(beyond(load_feeder("paper"), kw)) for kw in (500.0, 250.0, 125.0, 75.0)]

    def trips(settings: Settings) -> list[bool]:
        return [own.says(settings) == Reason.TRIP for own in found]

    assert trips(PAPER) == [False, False, False, False]
    assert trips(stiff) == [True, False, False, False]
    assert trips(ANY_SEQUENCE) == [True, True, True, True]


def test_generation_that_trips_in_the_same_window() -> None:
    found = broken(with_pv("constant_power"), der_factor=np.zeros((1, 1)))
    assert found.z == pytest.approx((7.73, 79.45), abs=0.005)
    assert found.di1_a == pytest.approx(33.4, abs=0.05)
    assert found.reason == Reason.SIGN


@pytest.mark.parametrize(
    ("node", "z"),
    [("R3", (35.1, 87.7)), ("R4", (35.1, 87.8)), ("R2-R3:0.25", (24.6, 84.8))],
    ids=["downstream, R3", "downstream, R4", "inside, before the break"],
)
def test_load_switched_on_in_the_same_window(node: str, z: tuple[float, float]) -> None:
    """+200 kW: 35∠88° beyond the break, 25∠85° before it."""
    at = scene_of(load_feeder("paper"))
    found = broken(
        load_feeder("paper"),
        far_node=np.array([at.network.node(node)]),
        far_after_s=three_phase_s(at, 200.0),
    )
    assert found.z == pytest.approx(z, abs=0.06)
    assert found.reason == Reason.SIGN


def fallen(ohm: float, side: str) -> Seen:
    """Phase A open, its conductor on the ground on one side of the break."""
    to_earth = np.zeros((3, 1), complex)
    to_earth[0] = 1.0 / ohm
    name = {"source": "earth_after_s", "load": "fallen_after_s"}[side]
    return broken(load_feeder("paper"), **{name: to_earth})


@pytest.mark.parametrize(
    ("side", "ohm", "z", "reason"),
    [
        ("source", 40.0, (2.79, 83.9), Reason.IMPEDANCE),
        ("source", 200.0, (18.97, 84.1), Reason.SIGN),
        ("source", 1000.0, (99.39, 99.7), Reason.TRIP),
        ("load", 40.0, (32.09, 92.8), Reason.TRIP),
        ("load", 200.0, (48.20, 95.7), Reason.TRIP),
    ],
)
def test_a_conductor_that_has_fallen(
    side: str, ohm: float, z: tuple[float, float], reason: Reason
) -> None:
    """2.8∠84°, 19∠84°, 99∠100° on the source side; 32∠93°, 48∠96° on the load side."""
    found = fallen(ohm, side)
    assert found.z == pytest.approx(z, abs=0.06)
    assert found.reason == reason


def test_on_the_source_side_only_a_high_resistance_turns_the_sign() -> None:
    """Between 200 and 1000 Ω, and for good; on the load side already at 40 Ω."""
    real = [fallen(ohm, "source").z_ohm.real for ohm in (40, 200, 400, 600, 800, 1000, 4000)]
    assert real[0] > 0
    assert real[1] > 0
    assert real[-2] < 0
    assert np.all(np.diff(np.sign(real)) <= 0)
    assert all(fallen(ohm, "load").z_ohm.real < 0 for ohm in (40.0, 200.0, 1000.0))


def with_lateral(kw: float) -> Feeder:
    """A lateral of 2 km with a load at its end, half-way between R2 and R3."""
    feeder = load_feeder("paper")
    trunk = next(line for line in feeder.lines if line.name == "R2-R3")
    units = tuple(unit for unit in feeder.transformers if unit.place.line != "R2-R3")
    names = {unit.name for unit in units}
    loads = tuple(load for load in feeder.loads if load.transformer in names)
    half = trunk.length_km / 2.0
    lines = tuple(line for line in feeder.lines if line.name != "R2-R3")
    lines += (
        replace(trunk, name="upper", to_bus="M", length_km=half),
        replace(trunk, name="lower", from_bus="M", length_km=half),
        replace(trunk, name="lateral", from_bus="M", to_bus="end", length_km=2.0),
    )
    load = Load(
        name="far",
        transformer=None,
        place=Place(bus="end"),
        connection="wye",
        kw=kw,
        power_factor=1.0,
        exponent=2.0,
    )
    line_of = {"R2": "upper"}
    points = tuple(replace(p, line=line_of.get(p.name, p.line)) for p in feeder.points)
    return replace(feeder, lines=lines, transformers=units, loads=(*loads, load), points=points)


@pytest.mark.parametrize("mask", [ONE, TWO, ALL], ids=["one", "two", "three"])
def test_a_break_in_a_lateral_between_the_points_looks_like_line(mask: np.ndarray) -> None:
    """The load that is lost hangs on the section: |Z| is what lies above the lateral's tee."""
    at = scene_of(with_lateral(400.0))
    found = seen(at, happen(at, "lateral", 0.5, open_after=mask))
    assert found.di1_a > 3.0  # enough to be seen, were it for the current
    assert abs(found.z_ohm) == pytest.approx(0.85 / 2.0, rel=0.02)
    assert abs(found.z_ohm) < abs(at.terminal("R2", "R3").line_z1_ohm)
    assert found.reason == Reason.IMPEDANCE


# ---- a source beyond the break ----


def behind(kind: str) -> Feeder:
    """The paper's PV system as an EMF, with different paths for the other sequences."""
    z1 = 12.926j
    others = {"no path": (None, None), "z2 = z1": (z1, None), "z2, z0": (3.0 + 4.0j, 2.0 + 9.0j)}
    z2, z0 = others[kind]
    feeder = with_pv("generator" if kind == "z2, z0" else "thevenin", z1_ohm=z1)
    return replace(feeder, ders=(replace(feeder.ders[0], z2_ohm=z2, z0_ohm=z0),))


@pytest.mark.parametrize("kind", ["no path", "z2 = z1", "z2, z0"])
def test_with_a_source_beyond_the_break_the_source_impedance_belongs_into_17(kind: str) -> None:
    """Z_op1 = -A Z_n - (A Z_u - B) E_n / E_s, whatever is open and whatever Z2 and Z0 are.

    V_p = E_s - Z_u I and V_n = E_n + Z_n I hold before and after, with the current I through
    the break, as long as the EMF stay. With V_m = A V_p + B I the numerator of eq. (5) is
    A (V_p' V_n - V_n' V_p) + B (I' V_n - V_n' I) = (-A (Z_u E_n + Z_n E_s) + B E_n) (I' - I),
    the denominator I' V_p - V_p' I = E_s (I' - I). A Z_u - B is about the impedance up to m.
    Without a source beyond, E_n = 0, and it is not in it.
    """
    feeder = behind(kind)
    at = scene_of(feeder)
    whole, parted = happen(at, "R2-R3", 0.6, open_after=ALL)
    edge, _ = locate(at.network, "R2-R3", 0.6)
    n = at.network.node("R3")
    v_n, e_n = (to_sequences(frame.v[n])[1, 0] for frame in (whole, parted))
    v_p, e_s = (to_sequences(frame.stub[0])[1, 0] for frame in (whole, parted))
    i = to_sequences(whole.i[2 * edge])[1, 0]
    z_n, z_u = (v_n - e_n) / i, (e_s - v_p) / i
    (a, b), _ = constants(load_feeder("paper"), "R2", "R2-R3.p", Place(line="R2-R3", at=0.6))
    exact = -a * z_n - (a * z_u - b) * e_n / e_s
    for mask in (ONE, np.array([0b010]), TWO, ALL):
        found = seen(at, happen(at, "R2-R3", 0.6, open_after=mask))
        assert found.z_ohm == pytest.approx(exact, rel=1e-9)
    assert abs(exact) == pytest.approx(23.4, abs=0.005)
    assert abs(a * z_n) < 22.2  # the source's term is no trifle here
