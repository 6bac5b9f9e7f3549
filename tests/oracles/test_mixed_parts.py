"""The oracle's parts of real feeders against hand calculation and conservation laws."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.dense import DenseSolution, solve_dense
from oracles.random_mixed import random_mixed_feeder

from openphase.model.parts import (
    Capacitor,
    Feeder,
    InlineTransformer,
    Line,
    LineCode,
    Load,
    Place,
    Regulator,
    Source,
)

Complex = NDArray[np.complex128]
NONE: frozenset[str] = frozenset()
V = 12000 / np.sqrt(3)
ROOT = np.sqrt(3.0)
ABC = np.exp(-2j * np.pi / 3 * np.arange(3))


def a_feeder(**parts: Any) -> Feeder:
    """An ideal source of 12 kV at S, and what is given."""
    source = Source(
        bus="S", kv_ll=12.0, emf_pu=1.0, z1_ohm=0j, z2_ohm=0j, z0_ohm=0j, frequency_hz=50.0
    )
    empty: dict[str, Any] = dict.fromkeys(
        ("lines", "transformers", "loads", "switches", "points", "sections"), ()
    )
    return Feeder(**({"name": "hand", "source": source} | empty | parts))


def a_load(bus: str, kw: float, **more: Any) -> Load:
    given: dict[str, Any] = {"connection": "wye", "power_factor": 1.0, "exponent": 2.0}
    place = Place(bus=bus)
    return Load(
        **({"name": f"D{kw}", "transformer": None, "place": place, "kw": kw} | given | more)
    )


def a_unit(**more: Any) -> InlineTransformer:
    given: dict[str, Any] = {
        "name": "X", "from_bus": "S", "to_bus": "B", "connection": "Yg/Yg", "rating_kva": 500.0,
        "kv_from": 12.0, "kv_to": 0.48, "leakage_pu": 0.01 + 0.05j,
    }  # fmt: skip
    return InlineTransformer(**(given | more))


def solved(**parts: Any) -> DenseSolution:
    return solve_dense(a_feeder(**parts), NONE)


def test_a_code_in_the_order_of_the_line() -> None:
    code = LineCode(
        name="K",
        r_ohm_per_km=((0.5, 0.1), (0.1, 0.7)),
        x_ohm_per_km=((1.0, 0.4), (0.4, 1.2)),
    )
    line = Line(name="L", from_bus="S", to_bus="B", length_km=2.0, phases="cb", code="K")
    loads = (a_load("B", 90, phases="b"), a_load("B", 150, phases="c"))
    got = solved(lines=(line,), codes=(code,), loads=loads)
    z = 2 * np.array([[0.7 + 1.2j, 0.1 + 0.4j], [0.1 + 0.4j, 0.5 + 1.0j]])
    z_load = np.diag([V**2 / 90e3, V**2 / 150e3])
    current = np.linalg.solve(z + z_load, V * ABC[1:])
    np.testing.assert_allclose(got.i_from["L"][1:], current, rtol=1e-12)
    np.testing.assert_allclose(got.v["B"][1:], z_load @ current, rtol=1e-12)
    assert got.v["B"][0] == got.i_from["L"][0] == 0
    assert got.absent == {("B", 0)}
    assert not got.floating


def test_a_lateral_of_a_transposed_line_keeps_its_own_rows() -> None:
    line = Line(
        name="L", from_bus="S", to_bus="B", length_km=3.0,
        z1_ohm_per_km=0.2 + 0.4j, z0_ohm_per_km=0.5 + 1.3j,
        c1_nf_per_km=10.0, c0_nf_per_km=4.0, phases="c",
    )  # fmt: skip
    got = solved(lines=(line,), loads=(a_load("B", 100, phases="c"),))
    z, y = 3 * (0.9 + 2.1j) / 3, 2j * np.pi * 50 * 3 * 8e-9 / 2
    y_end = 1 / (V**2 / 100e3) + y
    v = V * ABC[2] / (1 + z * y_end)
    np.testing.assert_allclose(got.v["B"], [0, 0, v], rtol=1e-12)
    np.testing.assert_allclose(got.i_from["L"][2], y * V * ABC[2] + y_end * v, rtol=1e-12)


SHIFTS = {"D/Yg": 30, "D/Y": 30, "Yg/D": 30, "Y/D": 30}


@pytest.mark.parametrize("shift", ["lag", "lead"])
@pytest.mark.parametrize(
    "connection", ["Yg/Yg", "Y/Yg", "Yg/Y", "Y/Y", "D/Yg", "D/Y", "Yg/D", "Y/D", "D/D"]
)
def test_a_balanced_load_sees_the_leakage_and_the_shift(connection: str, shift: Any) -> None:
    unit = a_unit(connection=connection, shift=shift, from_tap=1.05, to_tap=0.975)
    got = solved(inline_transformers=(unit,), loads=(a_load("B", 400, connection="delta"),))
    angle = SHIFTS.get(connection, 0) * (-1 if shift == "lag" else 1)
    z_load = 480**2 / 400e3
    z = (0.01 + 0.05j) * (480 * 0.975) ** 2 / 500e3
    v_ab = 480 * 0.975 / 1.05 * np.exp(1j * np.radians(30 + angle)) * z_load / (z_load + z)
    v = got.v["B"]
    np.testing.assert_allclose(v - np.roll(v, -1), v_ab * ABC, rtol=1e-9)
    np.testing.assert_allclose(
        np.abs(got.i_into["X"]) * 12000 * ROOT, abs(got.source_va), rtol=1e-9
    )
    held = connection in ("Yg/Yg", "D/Yg")
    assert bool(got.floating) == (not held)
    # common mode, and nothing else
    loose = got.loose["B"]
    assert np.abs(loose - loose[0]).max(initial=0.0) < 1e-9


def test_a_unit_the_other_way_round_is_the_same_unit_turned() -> None:
    """Yg/D lag fed from its delta: its star leads by 30 degrees."""
    unit = a_unit(from_bus="B", to_bus="S", connection="Yg/D", kv_from=0.48, kv_to=12.0)
    got = solved(inline_transformers=(unit,), loads=(a_load("B", 400),))
    z_load = 480**2 / 400e3
    v = 480 / ROOT * np.exp(1j * np.pi / 6) * z_load / (z_load + (0.01 + 0.05j) * 480**2 / 500e3)
    np.testing.assert_allclose(got.v["B"], v * ABC, rtol=1e-9)


def test_magnetizing_current_is_of_the_to_coil_at_its_taps() -> None:
    unit = a_unit(leakage_pu=0j, magnetizing_pu=0.002 - 0.01j, to_tap=1.025)
    got = solved(inline_transformers=(unit,))
    va = 500e3 * (0.002 + 0.01j)
    np.testing.assert_allclose(got.source_va, va, rtol=1e-9)
    np.testing.assert_allclose(got.i_out["X"], 0, atol=1e-9)


@pytest.mark.parametrize("bank", [1, 2])
def test_neutral_ohms_carry_the_neutral_current(bank: int) -> None:
    units = tuple(
        a_unit(name=f"X{n}", connection="D/Yg", to_neutral_ohm=0.05 + 0j) for n in range(bank)
    )
    load = a_load("B", 30, phases="b")
    got = solved(inline_transformers=units, loads=(load,))
    z = (0.01 + 0.05j) * 480**2 / 500e3 + 0.05
    z_load = (480 / ROOT) ** 2 / 30e3
    wanted = 480 / ROOT * ABC[1] * np.exp(-1j * np.pi / 6) * z_load / (z_load + z / bank)
    np.testing.assert_allclose(got.v["B"][1], wanted, rtol=1e-9)
    i = got.i_into["X0"]
    np.testing.assert_allclose(i.sum(), 0, atol=1e-9)
    np.testing.assert_allclose([i[2], i[0]], [0, -i[1]], atol=1e-9)


def test_a_neutral_without_connection_moves() -> None:
    """One phase loaded behind Y/Yg: no current can come back."""
    got = solved(
        inline_transformers=(a_unit(connection="Y/Yg"),), loads=(a_load("B", 9, phases="a"),)
    )
    v = got.v["B"]
    np.testing.assert_allclose(v[0], 0, atol=1e-9)
    np.testing.assert_allclose(np.abs(v[1:]), 480, rtol=1e-9)
    assert not got.floating


def test_a_single_wire_behind_two_phases() -> None:
    unit = a_unit(
        connection="single", phases="bc", to_phases="a", kv_to=12.7, rating_kva=100.0, to_tap=1.05
    )
    got = solved(inline_transformers=(unit,), loads=(a_load("B", 80, phases="a"),))
    z_load = 12.7e3**2 / 80e3
    z = (0.01 + 0.05j) * (12.7e3 * 1.05) ** 2 / 100e3
    v = 12.7e3 * 1.05 * (ABC[1] - ABC[2]) / ROOT * z_load / (z_load + z)
    np.testing.assert_allclose(got.v["B"], [v, 0, 0], rtol=1e-9)
    i = v / z_load * 12.7 * 1.05 / 12
    np.testing.assert_allclose(got.i_into["X"], [0, i, -i], rtol=1e-9, atol=1e-9)


def test_a_centre_tap_turns_its_second_leg_round() -> None:
    unit = a_unit(
        connection="centre-tap", phases="b", to_phases="ca", kv_from=V / 1000, kv_to=0.24,
        rating_kva=25.0, leakage_pu=0.006 + 0.012j, leg_leakage_pu=0.012 + 0.008j, from_tap=1.025,
        magnetizing_pu=0.001 - 0.005j,
    )  # fmt: skip
    loads = (
        a_load("B", 10, phases="ca", connection="delta", branch_kv=0.24),
        a_load("B", 4, phases="c"),
    )
    got = solved(inline_transformers=(unit,), loads=loads)
    n = 120 / V / 1.025
    z_f, z_l = unit.leakage_pu * (V * 1.025) ** 2 / 25e3, (0.012 + 0.008j) * 120**2 / 25e3
    across, leg = 240**2 / 10e3, 120**2 / 4e3
    y_m = unit.magnetizing_pu * 25e3 / 120**2
    z_legs = n**2 * z_f * np.array([[1, -1], [-1, 1]]) + z_l * np.eye(2)
    y = np.array([[1 / across + 1 / leg + y_m, -1 / across], [-1 / across, 1 / across]])
    emf = n * V * ABC[1] * np.array([1, -1])
    v = np.linalg.solve(np.eye(2) + z_legs @ y, emf)
    np.testing.assert_allclose(got.v["B"][[2, 0]], v, rtol=1e-9)
    assert abs(v[0] - v[1]) == pytest.approx(240, rel=0.05)


def test_an_open_delta_of_transformers_makes_three_phases() -> None:
    """Open wye to open delta: the third voltage is what closes the triangle."""
    units = tuple(
        a_unit(
            name=f"X{k}", connection="single", phases=k, to_phases=two, kv_from=V / 1000,
            kv_to=0.24, leakage_pu=0j,
        )
        for k, two in (("a", "ab"), ("b", "bc"))
    )  # fmt: skip
    load = a_load("B", 1, phases="ca", connection="delta")
    got = solved(inline_transformers=units, loads=(load,))
    v = got.v["B"]
    np.testing.assert_allclose([v[0] - v[1], v[1] - v[2]], 240 * ABC[:2], rtol=1e-9)
    assert {phase for _, phase in got.floating} == {0, 1, 2}


def a_regulator(**more: Any) -> Regulator:
    given: dict[str, Any] = {
        "name": "R", "from_bus": "S", "to_bus": "B", "taps": (8, -4, 2), "step_pct": 0.625,
        "most_taps": 16,
    }  # fmt: skip
    return Regulator(**(given | more))


def test_a_regulator_of_one_phase_drops_before_it() -> None:
    got = solved(
        regulators=(a_regulator(phases="a", taps=(8, 0, 0), z_ohm=0.5 + 2j),),
        loads=(a_load("B", 300, phases="a"),),
    )
    z_load = V**2 / 300e3
    v = 1.05 * V * z_load / (z_load + 1.05**2 * (0.5 + 2j))
    np.testing.assert_allclose(got.v["B"], [v, 0, 0], rtol=1e-12)
    np.testing.assert_allclose(got.i_into["R"], [1.05 * v / z_load, 0, 0], rtol=1e-12)


def test_an_open_delta_refers_to_the_phase_that_goes_through() -> None:
    regulator = a_regulator(phases="ac", reference="b", jumper_ohm=0.1 + 0j, taps=(8, 0, 2))
    load = a_load("B", 600, connection="delta")
    got = solved(regulators=(regulator,), loads=(load,))
    v_ab, v_cb = 1.05 * V * (ABC[0] - ABC[1]), 1.0125 * V * (ABC[2] - ABC[1])
    v = got.v["B"]
    np.testing.assert_allclose([v[0] - v[1], v[2] - v[1]], [v_ab, v_cb], rtol=1e-12)
    y = 200e3 / 12000**2
    i_a, i_c = y * (2 * v_ab - v_cb), y * (2 * v_cb - v_ab)
    np.testing.assert_allclose(got.i_out["R"], [i_a, -i_a - i_c, i_c], rtol=1e-9)
    # through the jumper: the phase's own current and what the two units send back and forth
    i_b = -i_a - i_c + i_a + i_c
    np.testing.assert_allclose(v[1], V * ABC[1] - 0.1 * i_b, rtol=1e-9)
    into = [1.05 * i_a, -1.05 * i_a - 1.0125 * i_c, 1.0125 * i_c]
    np.testing.assert_allclose(got.i_into["R"], into, rtol=1e-9)


def test_a_closed_delta_adds_what_is_between_the_phases() -> None:
    """By all taps alike: the voltages between the phases grow by more, and turn."""
    regulator = a_regulator(reference="next", taps=(8, 8, 8), z_ohm=0.2 + 1j)
    got = solved(regulators=(regulator,), loads=(a_load("B", 900),))
    z_load = V**2 / 300e3
    raised = V + 0.05 * V * (1 - ABC[1])
    v = raised * z_load / (z_load + 1.05**2 * (0.2 + 1j))
    np.testing.assert_allclose(got.v["B"], v * ABC, rtol=1e-12)
    into = (v / z_load) * raised.conjugate() / V
    np.testing.assert_allclose(got.i_into["R"], into * ABC, rtol=1e-12)


def test_a_closed_delta_of_one_tap_moves_one_phase() -> None:
    regulator = a_regulator(reference="next", taps=(0, 8, 0))
    got = solved(regulators=(regulator,), loads=(a_load("B", 900, connection="delta"),))
    v_b = V * (ABC[1] + 0.05 * (ABC[1] - ABC[2]))
    np.testing.assert_allclose(got.v["B"], [V, v_b, V * ABC[2]], rtol=1e-12)
    i, out = got.i_into["R"], got.i_out["R"]
    np.testing.assert_allclose(i, [out[0], 1.05 * out[1], out[2] - 0.05 * out[1]], rtol=1e-12)


def at_law(pu: float, **law: Any) -> complex:
    """P + jQ, in shares of 100 kW and 50 kvar, of a load on an ideal source of ``pu``."""
    load = a_load("S", 100, kvar=50.0, phases="b", branch_kv=V / 1000, **law)
    feeder = a_feeder(loads=(load,))
    feeder = replace(feeder, source=replace(feeder.source, emf_pu=pu))
    va = solve_dense(feeder, NONE).load_va["D100"]
    return complex(va.real / 100e3, va.imag / 50e3)


MIX = (0.2, 0.3, 0.5, 0.6, 0.1, 0.3)


@pytest.mark.parametrize(
    ("pu", "law", "wanted"),
    [
        (0.9, {"exponent": 1.2, "exponent_q": 3.0}, 0.9**1.2 + 0.9**3 * 1j),
        (0.9, {"zip": MIX}, 0.2 * 0.81 + 0.27 + 0.5 + (0.6 * 0.81 + 0.09 + 0.3) * 1j),
        (0.9, {"exponent": 0.0, "v_min_pu": 0.95}, (0.9 / 0.95) ** 2 * (1 + 1j)),
        (1.1, {"exponent": 0.0, "v_max_pu": 1.05}, (1.1 / 1.05) ** 2 * (1 + 1j)),
        (1.1, {"exponent": 0.0}, 1 + 1j),
        (0.6, {"exponent": 0.0}, (0.6 / 0.7) ** 2 * (1 + 1j)),
        (0.4, {"exponent": 0.0, "v_min_pu": 0.9, "v_low_pu": 0.5}, 0.4**2 * (1 + 1j)),
        (
            0.7,
            {"exponent": 0.0, "v_min_pu": 0.9, "v_low_pu": 0.5},
            0.7 * (0.5 + 0.5 * (1 / 0.9 - 0.5)) * (1 + 1j),
        ),
        (
            1.1,
            {"exponent": 1.2, "v_max_pu": 1.05, "edge_exponent": 0.0},
            (1.1 / 1.05) ** 2 * (1 + 1j),
        ),
        (0.6, {"exponent": 1.2, "edge_exponent": 0.0}, (0.6 / 0.7) ** 2 * (1 + 1j)),
        (
            0.7,
            {"exponent": 1.2, "v_min_pu": 0.9, "v_low_pu": 0.5, "edge_exponent": 0.0},
            0.7 * (0.5 + 0.5 * (1 / 0.9 - 0.5)) * (1 + 1j),
        ),
        (0.4, {"zip": MIX, "v_min_pu": 0.8, "v_low_pu": 0.5}, 0.4**2 * (1 + 1j)),
    ],
)
def test_laws_of_loads(pu: float, law: dict[str, Any], wanted: complex) -> None:
    assert at_law(pu, **({"exponent": 1.0} | law)) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize(
    ("connection", "phases", "sources"),
    [("wye", "c", 1), ("wye", "ab", 2), ("delta", "ca", 1), ("delta", "abc", 3)],
)
def test_branches_share_the_power_at_their_own_voltage(
    connection: Any, phases: str, sources: int
) -> None:
    kv = 8.0 if connection == "wye" else 13.0
    load = a_load("S", 90, connection=connection, phases=phases, branch_kv=kv)
    bank = Capacitor(
        name="C",
        place=Place(bus="S"),
        connection=connection,
        kvar=60.0,
        phases=phases,
        branch_kv=kv,
    )
    got = solved(loads=(load,), capacitors=(bank,))
    share = ((V if connection == "wye" else V * ROOT) / kv / 1000) ** 2
    assert got.load_va["D90"] == pytest.approx(90e3 * share, rel=1e-12)
    assert got.load_va["C.capacitor"] == pytest.approx(-60e3j * share, rel=1e-12)
    assert len(got.load_pu["D90"]) == sources


def test_power_is_conserved_whatever_there_is() -> None:
    """Over mixed feeders; all kinds of parts are among them."""
    seen: Counter[str] = Counter()
    for seed in range(80):
        rng = np.random.default_rng([seed, 61])
        feeder = random_mixed_feeder(rng, int(rng.integers(4, 14)), int(rng.integers(0, 4)))
        closed = frozenset(s.name for s in feeder.switches if s.closed or rng.random() < 0.7)
        got = solve_dense(feeder, closed)
        taken = sum(got.load_va.values()) + got.loss_va + got.charging_va
        assert abs(taken - got.source_va) < 1e-9 * abs(got.source_va), seed
        seen.update({unit.connection for unit in feeder.inline_transformers})
        seen.update({f"reference {own.reference}" for own in feeder.regulators})
        seen["floating"] += bool(got.floating)
        seen["loops"] += any(name.startswith("TIE") for name in closed)
    assert all(count >= 2 for count in seen.values())
    assert len(seen) >= 11 + 5
