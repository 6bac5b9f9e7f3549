"""Exact statements about feeders with the parts of real ones; each holds without a reference."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.random_mixed import random_mixed_feeder

from openphase.model.errors import InputError
from openphase.model.network import Network, compile_network, locate
from openphase.model.parts import (
    Feeder,
    InlineTransformer,
    Line,
    LineCode,
    Load,
    Place,
    Regulator,
    Source,
    Switch,
)
from openphase.model.solve import solve, steady_state
from openphase.model.states import Answer

Complex = NDArray[np.complex128]
V = 12000 / np.sqrt(3)
ALL = 0b111


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """Answers of several states of one network."""

    network: Network
    answer: Answer

    def v(self, bus: str) -> Complex:
        """(3, S)."""
        return np.asarray(self.answer.v[self.network.node(bus)])

    def into(self, line: str) -> Complex:
        """(3, S) current into the line at its from-end."""
        edge = self.network.edges_of(line)[0]
        upward = self.network.upward[edge]
        i = self.answer.i[2 * edge + (not upward)]
        return np.asarray(i if upward else -i)


def solved(feeder: Feeder, states: int = 1, **fields: Any) -> Solved:
    """``states`` scenarios of the steady state, with other values in some fields."""
    network = compile_network(feeder)
    state = steady_state(network, states)._replace(**fields)
    return Solved(network, solve(network, state))


def opened(feeder: Feeder, line: str, at: float, *masks: int) -> Solved:
    network = compile_network(feeder)
    edge, share = locate(network, line, at)
    count = len(masks)
    state = steady_state(network, count)._replace(
        edge=np.full(count, edge), share=np.full(count, share), open_mask=np.array(masks)
    )
    return Solved(network, solve(network, state))


def stepped(feeder: Feeder) -> Solved:
    """Loads before the section, at S, and beyond it, in the middle of NE, phase by phase."""
    network = compile_network(feeder)
    edge, share = locate(network, "NE", 0.4)
    upper, lower = np.zeros((2, 3, 7), np.complex128)
    upper[range(3), range(3)] = 2e-3 - 1e-2j
    lower[range(3), range(3, 6)] = 2e-3 - 4e-3j
    state = steady_state(network, 7)._replace(
        edge=np.full(7, edge),
        share=np.full(7, share),
        step_y_s=lower,
        far_node=np.full(7, network.node("S")),
        far_y_s=upper,
    )
    return Solved(network, solve(network, state))


SOURCE = Source(
    bus="S",
    kv_ll=12.0,
    emf_pu=1.02,
    z1_ohm=0.2 + 1j,
    z2_ohm=0.2 + 1j,
    z0_ohm=0.3 + 1.5j,
    frequency_hz=60.0,
)
UNTRANSPOSED = LineCode(
    name="K",
    r_ohm_per_km=((0.29, 0.1, 0.1), (0.1, 0.28, 0.09), (0.1, 0.09, 0.3)),
    x_ohm_per_km=((0.66, 0.31, 0.26), (0.31, 0.7, 0.24), (0.26, 0.24, 0.63)),
    c_nf_per_km=((9.5, -2.9, -1.2), (-2.9, 9.8, -0.7), (-1.2, -0.7, 8.7)),
)
ONE = LineCode(name="K1", r_ohm_per_km=((0.8,),), x_ohm_per_km=((0.9,),), c_nf_per_km=((7.0,),))


def a_line(name: str, start: str, end: str, km: float = 2.0, **more: Any) -> Line:
    return Line(name=name, from_bus=start, to_bus=end, length_km=km, **({"code": "K"} | more))


def a_load(name: str, place: Place | str, kw: float, **more: Any) -> Load:
    given: dict[str, Any] = {"connection": "wye", "power_factor": 0.95, "exponent": 2.0}
    place = Place(bus=place) if isinstance(place, str) else place
    return Load(name=name, transformer=None, place=place, kw=kw, **(given | more))


def a_feeder(**parts: Any) -> Feeder:
    """S - M ======= N - E, with an unbalanced load at E and a lateral at M, phase b."""
    given: dict[str, Any] = {
        "lines": (
            a_line("SM", "S", "M"),
            a_line("MN", "M", "N", 5.0),
            a_line("NE", "N", "E"),
            a_line("MX", "M", "X", 3.0, code="K1", phases="b"),
        ),
        "loads": (
            a_load("D1", "E", 500),
            a_load("D2", "E", 200, phases="ca", connection="delta"),
            a_load("D3", "X", 90, phases="b"),
        ),
        "codes": (UNTRANSPOSED, ONE),
    }
    empty: dict[str, Any] = dict.fromkeys(("transformers", "switches", "points", "sections"), ())
    return Feeder(**({"name": "stated", "source": SOURCE} | empty | given | parts))


# Eq. (5) of a section that is not transposed ---------------------------------------------------


def test_a_section_without_a_tap_shows_its_b_parameter_in_all_phases() -> None:
    """``V_n = A V_m - B I_m`` with matrices: states enough on either side tell all of them."""
    z, half = _section(5.0)
    got = stepped(a_feeder())
    b = _b_parameter(got)
    np.testing.assert_allclose(b, z, atol=1e-6 * np.abs(z).max())
    a = np.eye(3) + z @ half
    v_m, i_m, v_n = got.v("M"), got.into("MN"), got.v("N")
    np.testing.assert_allclose(v_n, a @ v_m - z @ i_m, atol=1e-9 * V)


def test_a_tap_within_the_section_adds_its_share() -> None:
    tap = a_load("D4", Place(line="MN", at=0.4), 300, connection="delta", phases="bc")
    feeder = a_feeder()
    feeder = replace(feeder, loads=(*feeder.loads, tap))
    b = _b_parameter(stepped(feeder))
    (z_1, half_1), (z_2, half_2) = _section(2.0), _section(3.0)
    y = np.conj(300e3 * (1 + 1j * np.tan(np.arccos(0.95)))) / 12000**2
    tapped = y * np.array([[0, 0, 0], [0, 1, -1], [0, -1, 1]]) + half_1 + half_2
    wanted = z_1 + z_2 + z_2 @ tapped @ z_1
    np.testing.assert_allclose(b, wanted, atol=1e-6 * np.abs(wanted).max())


def test_the_positive_sequence_of_an_untransposed_section_is_not_its_impedance() -> None:
    """An open phase beyond it: what eq. (5) finds misses by the coupling of the sequences."""
    got = opened(a_feeder(), "NE", 0.4, 0, 1)
    forward = np.array([1, np.exp(2j * np.pi / 3), np.exp(-2j * np.pi / 3)]) / 3
    (v, n, i) = (forward @ x for x in (got.v("M"), got.v("N"), got.into("MN")))
    factor = v[1] / v[0]
    seen = -(n[1] - factor * n[0]) / (i[1] - factor * i[0])
    z, _ = _section(5.0)
    z1 = (np.trace(z) - (z.sum() - np.trace(z)) / 2) / 3
    assert 0.01 < abs(seen - z1) / abs(z1) < 0.5


def _section(km: float) -> tuple[Complex, Complex]:
    """Series impedance and the charging at either end."""
    z = (np.array(UNTRANSPOSED.r_ohm_per_km) + 1j * np.array(UNTRANSPOSED.x_ohm_per_km)) * km
    half = 1j * np.pi * 60e-9 * np.array(UNTRANSPOSED.c_nf_per_km) * km
    return z, half


def _b_parameter(got: Solved) -> Complex:
    seen = np.vstack([got.v("M") / 1000, got.into("MN")])
    found, _, rank, _ = np.linalg.lstsq(seen.T, got.v("N").T, rcond=1e-13)
    assert rank == 6
    return np.asarray(-found[3:].T)


# What a lateral is to the trunk ----------------------------------------------------------------


@pytest.mark.parametrize("exponent", [2.0, 0.0])
def test_a_break_at_the_head_of_a_lateral_takes_its_loads_away(exponent: float) -> None:
    feeder = a_feeder()
    loads = tuple(replace(load, exponent=exponent) for load in feeder.loads)
    feeder = replace(feeder, loads=loads)
    broken = opened(feeder, "MX", 0.0, 0b010)
    without = solved(replace(feeder, lines=feeder.lines[:3], loads=loads[:2]))
    for bus in ("S", "M", "N", "E"):
        np.testing.assert_allclose(broken.v(bus), without.v(bus), atol=1e-9 * V)
    np.testing.assert_allclose(broken.v("X"), 0, atol=1e-9)


def test_a_lateral_is_the_admittance_that_one_sees_at_its_head() -> None:
    feeder = a_feeder()
    z, half = 3 * (0.8 + 0.9j), 1j * np.pi * 60e-9 * 7.0 * 3
    y_end = np.conj(90e3 * (1 + 1j * np.tan(np.arccos(0.95)))) / V**2 + half
    va = np.conj(half + 1 / (z + 1 / y_end)) * V**2
    folded = a_load("D3", "M", va.real / 1000, kvar=va.imag / 1000, phases="b", power_factor=1.0)
    alone = replace(feeder, lines=feeder.lines[:3], loads=(*feeder.loads[:2], folded))
    one, other = solved(feeder), solved(alone)
    for bus in ("S", "M", "N", "E"):
        np.testing.assert_allclose(one.v(bus), other.v(bus), atol=1e-10 * V)


# Equal circuits ---------------------------------------------------------------------------------

UNIT: dict[str, Any] = {
    "from_bus": "M",
    "to_bus": "N",
    "rating_kva": 3000.0,
    "kv_from": 12.0,
    "kv_to": 12.0,
    "leakage_pu": 0.01 + 0.06j,
}


def between(*units: InlineTransformer | Regulator | Line) -> Solved:
    """The feeder with something else between M and N."""
    feeder = a_feeder()
    lines = [line for line in feeder.lines if line.name != "MN"]
    return solved(
        replace(
            feeder,
            lines=(*lines, *(own for own in units if isinstance(own, Line))),
            inline_transformers=tuple(own for own in units if isinstance(own, InlineTransformer)),
            regulators=tuple(own for own in units if isinstance(own, Regulator)),
        )
    )


def same(one: Solved, other: Solved) -> None:
    for bus in ("S", "M", "X", "N", "E"):
        np.testing.assert_allclose(one.v(bus), other.v(bus), atol=1e-9 * V)


def test_a_star_to_star_of_one_turn_is_a_line() -> None:
    z = UNIT["leakage_pu"] * 12000**2 / 3e6
    plain = {"code": None, "z1_ohm_per_km": z, "z0_ohm_per_km": z}
    line = a_line("MN", "M", "N", 1.0, **plain)
    unit = InlineTransformer(name="X", connection="Yg/Yg", **UNIT)
    same(between(line), between(unit))
    regulator = Regulator(
        name="R", from_bus="M", to_bus="N", taps=(0, 0, 0), step_pct=0.625, most_taps=16, z_ohm=z
    )
    same(between(line), between(regulator))


@pytest.mark.parametrize(
    ("connection", "pairs"),
    [
        ("Yg/Yg", ("a a", "b b", "c c")),
        ("D/D", ("ab ab", "bc bc", "ca ca")),
        ("D/Yg", ("ac a", "ba b", "cb c")),
        ("Yg/D", ("a ab", "b bc", "c ca")),
    ],
)
def test_a_bank_of_single_units_is_the_three_phase_one(
    connection: Any, pairs: tuple[str, ...]
) -> None:
    more: dict[str, Any] = {"magnetizing_pu": 0.002 - 0.01j, "from_tap": 1.05, "to_tap": 0.975}
    whole = InlineTransformer(name="X", connection=connection, **(UNIT | more))
    kv = {1: 12.0 / np.sqrt(3.0), 2: 12.0}
    singles = []
    for pair in pairs:
        near, far = pair.split()
        own = {"kv_from": kv[len(near)], "kv_to": kv[len(far)], "rating_kva": 1000.0}
        letters = {"phases": near, "to_phases": far}
        singles.append(
            InlineTransformer(name=f"X{near}", connection="single", **(UNIT | more | own | letters))
        )
    same(between(whole), between(*singles))


def test_two_in_parallel_are_one_of_twice_the_rating() -> None:
    twin = [InlineTransformer(name=f"X{n}", connection="D/Yg", **UNIT) for n in range(2)]
    one = InlineTransformer(name="X", connection="D/Yg", **(UNIT | {"rating_kva": 6000.0}))
    same(between(*twin), between(one))


@pytest.mark.parametrize("reference", ["S", "E"])
def test_a_loop_that_a_switch_closes_is_one_without_the_switch(reference: str) -> None:
    """At the bus where it forks, and at one further down."""
    feeder = a_feeder()
    back = a_line("EX", "E", "B", 3.0)
    tie = Switch(name="TIE", from_bus="B", to_bus="S", closed=True)
    if reference == "E":
        back = a_line("SX", "S", "B", 3.0)
        tie = replace(tie, to_bus="E")
    joined = replace(back, to_bus=reference)
    one = solved(replace(feeder, lines=(*feeder.lines, back), switches=(tie,)))
    same(one, solved(replace(feeder, lines=(*feeder.lines, joined))))
    np.testing.assert_allclose(one.v("B"), one.v(reference), atol=1e-9 * V)


# Symmetries ---------------------------------------------------------------------------------------

TURNED = str.maketrans("abc", "bca")


def turned(feeder: Feeder) -> Feeder:
    """What was in phase a is in b, b in c, c in a."""
    letters = (*("lines", "loads", "switches", "capacitors", "regulators", "inline_transformers"),)
    parts: dict[str, Any] = {}
    for table in letters:
        rows = []
        for part in getattr(feeder, table):
            own = {"phases": part.phases.translate(TURNED)}
            if isinstance(part, InlineTransformer):
                own["to_phases"] = part.to_phases.translate(TURNED)
            if isinstance(part, Regulator):
                a, b, c = part.taps
                own |= {"taps": (c, a, b)}  # type: ignore[dict-item]
                if part.reference in ("a", "b", "c"):
                    own["reference"] = part.reference.translate(TURNED)
            rows.append(replace(part, **own))
        parts[table] = tuple(rows)
    source = replace(feeder.source, angle_deg=feeder.source.angle_deg + 120.0)
    return replace(feeder, source=source, **parts)


@pytest.mark.parametrize("seed", range(40))
def test_no_phase_is_better_than_another(seed: int) -> None:
    """All that is in one phase moved to the next, and the source turned with it."""
    rng = np.random.default_rng([seed, 63])
    feeder = random_mixed_feeder(rng, int(rng.integers(4, 14)), int(rng.integers(0, 3)))
    closed = frozenset(s.name for s in feeder.switches)
    try:
        networks = [compile_network(one, closed) for one in (feeder, turned(feeder))]
    except InputError:
        pytest.skip("the network is refused")
    here, there = (solve(network, steady_state(network)) for network in networks)
    # what nothing but a load holds to earth stands at 0 V
    size = np.maximum(np.abs(here.v).max(axis=(1, 2), keepdims=True), 50.0)
    np.testing.assert_allclose(there.v / size, np.roll(here.v, 1, axis=1) / size, atol=1e-9)


@pytest.mark.parametrize("seed", range(40))
def test_what_one_node_does_to_another_is_mutual(seed: int) -> None:
    """Linear and without motors: the transfer impedance is the same both ways."""
    rng = np.random.default_rng([seed, 64])
    feeder = random_mixed_feeder(
        rng, int(rng.integers(4, 12)), int(rng.integers(0, 3)), linear=True, machines=False
    )
    feeder = replace(feeder, source=replace(feeder.source, z2_ohm=feeder.source.z1_ohm))
    try:
        network = compile_network(feeder, frozenset(s.name for s in feeder.switches))
    except InputError:
        pytest.skip("the network is refused")
    still = solve(network, steady_state(network)).v[:, :, 0]
    nodes, phases = np.nonzero(np.abs(still) > 0.3 * network.node_v[:, None])
    first, second = rng.integers(len(nodes), size=2)
    ends = [(int(nodes[k]), int(phases[k])) for k in (first, second)]
    y = np.zeros((3, 2), np.complex128)
    for s, (node, phase) in enumerate(ends):
        y[phase, s] = 1e-3 * (1 - 0.5j) * (7e3 / abs(still[node, phase])) ** 2
    state = steady_state(network, 2)._replace(
        far_node=np.array([node for node, _ in ends]), far_y_s=y
    )
    moved = solve(network, state).v
    if any(
        abs(moved[node, k, s]) < 0.01 * network.node_v[node] for s, (node, k) in enumerate(ends)
    ):
        pytest.skip("nothing else is earthed there, so that no current flows")
    z = []
    for s in range(2):
        (node, phase), (other, at) = ends[s], ends[1 - s]
        current = y[phase, s] * moved[node, phase, s]
        z.append((moved[other, at, s] - still[other, at]) / current)
    assert abs(z[0] - z[1]) < 1e-6 * max(abs(z[0]), 1e-3)
