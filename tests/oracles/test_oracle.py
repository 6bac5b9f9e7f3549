"""The oracle against hand calculation, conservation laws and the paper's Section V feeder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.dense import FORTESCUE, DenseSolution, Event, solve_dense
from oracles.random_feeders import random_event, random_feeder

from openphase.model.parts import (
    Connection,
    Feeder,
    Line,
    Load,
    LoadConnection,
    Place,
    Source,
    Switch,
    Transformer,
)

Complex = NDArray[np.complex128]
NONE: frozenset[str] = frozenset()
ROTATION = np.exp(-2j * np.pi / 3 * np.arange(3))
"""Positive sequence: phase b lags a by 120 degrees."""


def polar(magnitude: float, degrees: float) -> complex:
    return complex(magnitude * np.exp(1j * np.radians(degrees)))


def sequence(phase: Complex) -> Complex:
    """Zero, positive and negative sequence of one phasor triple."""
    return np.asarray(FORTESCUE.conj().T @ phase / 3, dtype=np.complex128)


def a_line(name: str, a: str, b: str, z1: complex, z0: complex | None = None) -> Line:
    return Line(
        name=name,
        from_bus=a,
        to_bus=b,
        length_km=1.0,
        z1_ohm_per_km=z1,
        z0_ohm_per_km=z1 if z0 is None else z0,
    )


def a_load(
    name: str,
    kw: float,
    *,
    behind: str | None = None,
    bus: str | None = None,
    connection: LoadConnection = "wye",
    pf: float = 1.0,
    exponent: float = 2.0,
) -> Load:
    return Load(
        name=name,
        transformer=behind,
        place=None if bus is None else Place(bus=bus),
        connection=connection,
        kw=kw,
        power_factor=pf,
        exponent=exponent,
    )


def a_unit(
    name: str,
    place: Place,
    connection: Connection,
    *,
    kva: float = 1000.0,
    leakage: complex = 0.06j,
    x0: float | None = None,
) -> Transformer:
    return Transformer(
        name=name,
        place=place,
        connection=connection,
        rating_kva=kva,
        leakage_pu=leakage,
        x0_pu=x0,
    )


def a_feeder(
    lines: tuple[Line, ...],
    loads: tuple[Load, ...],
    units: tuple[Transformer, ...] = (),
    switches: tuple[Switch, ...] = (),
    source_z: tuple[complex, complex, complex] = (0j, 0j, 0j),
) -> Feeder:
    """A 12 kV feeder from bus S; ``source_z`` in the order Z1, Z2, Z0."""
    z1, z2, z0 = source_z
    source = Source(
        bus="S", kv_ll=12.0, emf_pu=1.0, z1_ohm=z1, z2_ohm=z2, z0_ohm=z0, frequency_hz=60.0
    )
    return Feeder(
        name="test",
        source=source,
        lines=lines,
        transformers=units,
        loads=loads,
        switches=switches,
        points=(),
        sections=(),
    )


V = 12000 / np.sqrt(3)
Z_LINE = 1 + 2j
ONE_LINE = (a_line("L", "S", "B", Z_LINE, 3 + 7j),)


def test_one_line_one_load() -> None:
    feeder = a_feeder(ONE_LINE, (a_load("D", 900, bus="B", pf=0.9),))
    got = solve_dense(feeder, NONE)
    s = 900e3 * (1 + 1j * np.tan(np.arccos(0.9)))
    z_load = 12000**2 / np.conj(s)
    current = V / (Z_LINE + z_load) * ROTATION
    np.testing.assert_allclose(got.i_from["L"], current, rtol=1e-12)
    np.testing.assert_allclose(got.i_to["L"], -current, rtol=1e-12)
    np.testing.assert_allclose(got.v["B"], z_load * current, rtol=1e-12)
    assert not got.floating


def test_leading_power_factor_is_capacitive() -> None:
    feeder = a_feeder(ONE_LINE, (a_load("D", 900, bus="B", pf=-0.9),))
    assert solve_dense(feeder, NONE).load_va["D"].imag < 0


def test_balanced_delta_load_is_equivalent_wye() -> None:
    wye, delta = (
        solve_dense(
            a_feeder(ONE_LINE, (a_load("D", 900, bus="B", connection=kind, exponent=0.7),)), NONE
        )
        for kind in ("wye", "delta")
    )
    np.testing.assert_allclose(delta.v["B"], wye.v["B"], rtol=1e-11)
    np.testing.assert_allclose(delta.i_from["L"], wye.i_from["L"], rtol=1e-11)


def test_constant_power_load_solves_the_quadratic() -> None:
    feeder = a_feeder((a_line("L", "S", "B", 4 + 0j),), (a_load("D", 1200, bus="B", exponent=0),))
    got = solve_dense(feeder, NONE)
    v = V / 2 + np.sqrt(V**2 / 4 - 4 * 400e3)
    np.testing.assert_allclose(got.v["B"], v * ROTATION, rtol=1e-12)
    assert got.load_va["D"] == pytest.approx(1200e3, rel=1e-12)


def test_load_below_the_floor_is_constant_impedance() -> None:
    feeder = a_feeder(ONE_LINE, (a_load("D", 900, bus="B", exponent=0.5),))
    got = solve_dense(feeder, NONE, emf_scale=0.3)
    y = 900e3 / 12000**2 * 0.7 ** (0.5 - 2)
    current = 0.3 * V / (Z_LINE + 1 / y) * ROTATION
    np.testing.assert_allclose(got.i_from["L"], current, rtol=1e-12)


@pytest.mark.parametrize("connection", ["Yg/Yg", "D/Yg", "Yg/D"])
def test_positive_sequence_is_the_single_phase_calculation(connection: Connection) -> None:
    leak = 0.01 + 0.05j
    unit = a_unit("T", Place(line="L", at=0.25), connection, kva=1500, leakage=leak, x0=0.8)
    feeder = a_feeder(
        ONE_LINE, (a_load("D", 900, behind="T", pf=0.9),), (unit,), source_z=(1j, 2j, 4j)
    )
    z_t = leak * 12000**2 / 1500e3 + 12000**2 / np.conj(900e3 * (1 + 1j * np.tan(np.arccos(0.9))))
    for step in (1, 2):
        got = solve_dense(feeder, NONE, delta_step=step)
        current = V / (1j + 0.25 * Z_LINE + z_t)
        np.testing.assert_allclose(got.i_from["L"], current * ROTATION, rtol=1e-12)
        np.testing.assert_allclose(got.v["B"], (V - current * (1j + 0.25 * Z_LINE)) * ROTATION)
        assert np.abs(got.i_to["L"]).max() < 1e-9
        nominal = 480 / np.sqrt(3)
        assert np.abs(got.load_pu["D"] - 1).max() < 0.1
        assert np.ptp(np.abs(got.lv["T"])) < 1e-6 * nominal or connection == "Yg/D"


@pytest.mark.parametrize("connection", ["Yg/Yg", "D/Yg", "Yg/D"])
@pytest.mark.parametrize("x0", [None, 0.8])
def test_zero_sequence_admittance_of_each_connection(
    connection: Connection, x0: float | None
) -> None:
    """An EMF behind Z0 alone meets the unit's zero-sequence impedance; only V0/I0 counts."""
    leak, va = 0.01 + 0.05j, 800e3
    unit = a_unit("T", Place(bus="B"), connection, kva=800, leakage=leak, x0=x0)
    feeder = a_feeder(ONE_LINE, (a_load("D", 400, behind="T"),), (unit,))
    event = Event(step_line="L", step_fraction=0.5, step_kw=3000, step_phases=(0,))
    got = solve_dense(feeder, NONE, event)
    v0, i0 = sequence(got.v["B"])[0], sequence(-got.i_to["L"])[0]
    assert abs(v0) > 10
    z_base = 12000**2 / va
    z_load = 12000**2 / 400e3
    if connection == "D/Yg":
        assert abs(i0) < 1e-9
        return
    y = 1 / (leak * z_base)
    if connection == "Yg/Yg":
        half = leak * z_base / 2
        shunt = 0 if x0 is None else 1 / (1j * x0 * z_base)
        y = 1 / (half + 1 / (shunt + 1 / (half + z_load)))
    assert i0 == pytest.approx(y * v0, rel=1e-10)


def test_idle_grounded_wye_delta_restores_the_open_phase() -> None:
    """Without load no current flows, so the D winding rebuilds the third voltage exactly."""
    unit = a_unit("T", Place(bus="B"), "Yg/D")
    feeder = a_feeder(ONE_LINE, (), (unit,), source_z=(1j, 1j, 2j))
    event = Event(open_line="L", open_fraction=0.3, open_phases=(0,))
    got = solve_dense(feeder, NONE, event)
    np.testing.assert_allclose(got.stubs["L.q"], V * ROTATION, rtol=1e-12)
    assert np.abs(got.i_from["L"]).max() < 1e-9
    assert not got.floating
    other = solve_dense(feeder, NONE, event, connections={"T": "Yg/Yg"})
    assert ("B", 0) in other.floating
    assert ("L.q", 0) in other.floating
    assert ("L.p", 0) not in other.floating
    assert ("B", 1) not in other.floating


def test_what_hangs_on_one_delta_winding_floats() -> None:
    """Behind three open phases, a delta load leaves the common mode undetermined."""
    feeder = a_feeder(ONE_LINE, (a_load("D", 900, bus="B", connection="delta"),))
    event = Event(open_line="L", open_fraction=0.5, open_phases=(0, 1, 2))
    got = solve_dense(feeder, NONE, event, start=solve_dense(feeder, NONE))
    assert got.floating == {(node, k) for node in ("B", "L.q") for k in range(3)}
    assert np.abs(got.v["B"]).max() < 1e-9
    wye = solve_dense(replace(feeder, loads=(a_load("D", 900, bus="B", exponent=0),)), NONE, event)
    assert not wye.floating
    assert np.abs(wye.v["B"]).max() < 1e-9


def test_closed_switch_and_zero_impedance_line_are_exact() -> None:
    lines = (*ONE_LINE, a_line("Z", "C", "B2", 0j))
    switch = Switch(name="K", from_bus="C", to_bus="B", closed=False)
    feeder = a_feeder(lines, (a_load("D", 900, bus="B2"),), switches=(switch,))
    whole = solve_dense(a_feeder(ONE_LINE, (a_load("D", 900, bus="B"),)), NONE)
    closed = solve_dense(feeder, frozenset({"K"}))
    np.testing.assert_allclose(closed.v["B2"], whole.v["B"], rtol=1e-12)
    np.testing.assert_allclose(closed.i_switch["K"], whole.i_to["L"], rtol=1e-12)
    opened = solve_dense(feeder, NONE)
    assert np.abs(opened.i_from["L"]).max() < 1e-12
    assert np.abs(opened.v["B2"]).max() < 1e-9


def test_three_phase_step_is_a_grounded_wye_load() -> None:
    loads = (a_load("D", 400, bus="B"), a_load("E", 300, bus="B", exponent=1.2))
    event = Event(step_line="L", step_fraction=1.0, step_kw=300, step_exponent=1.2)
    switched = solve_dense(a_feeder(ONE_LINE, loads[:1]), NONE, event)
    built_in = solve_dense(a_feeder(ONE_LINE, loads), NONE)
    np.testing.assert_allclose(switched.v["B"], built_in.v["B"], rtol=1e-12)
    assert switched.load_va["step"] == pytest.approx(built_in.load_va["E"], rel=1e-11)


def test_event_moves_the_emf() -> None:
    feeder = a_feeder(ONE_LINE, (a_load("D", 400, bus="B"),))
    moved = solve_dense(feeder, NONE, Event(emf_scale=0.975), emf_scale=0.9)
    np.testing.assert_allclose(moved.v["S"], 0.975 * 0.9 * V * ROTATION, rtol=1e-12)


def test_delta_load_after_an_open_phase() -> None:
    """Two branches in series beside the third: 1.5 branch admittances between b and c."""
    feeder = a_feeder(ONE_LINE, (a_load("D", 900, bus="B", connection="delta"),))
    event = Event(open_line="L", open_fraction=0.5, open_phases=(0,))
    got = solve_dense(feeder, NONE, event)
    y = 1.5 * 300e3 / 12000**2
    v_bc = V * (ROTATION[1] - ROTATION[2])
    current = v_bc / (1 / y + 2 * Z_LINE)
    np.testing.assert_allclose(got.i_from["L"][1:], [current, -current], rtol=1e-12)
    assert got.v["B"][0] == pytest.approx((got.v["B"][1] + got.v["B"][2]) / 2, rel=1e-12)


def test_source_with_unequal_sequence_impedances() -> None:
    """A single-phase load sees (Z1 + Z2 + Z0)/3 of source and line."""
    feeder = a_feeder(ONE_LINE, (), source_z=(0.2 + 1j, 0.3 + 1.4j, 0.1 + 3j))
    event = Event(step_line="L", step_fraction=1.0, step_kw=500, step_phases=(0,))
    got = solve_dense(feeder, NONE, event)
    z_thevenin = (2 * Z_LINE + 3 + 7j + 0.6 + 5.4j) / 3
    assert got.i_from["L"][0] == pytest.approx(V / (z_thevenin + V**2 / 500e3), rel=1e-12)
    v012 = sequence(got.v["S"])
    i012 = sequence(got.i_from["L"])
    np.testing.assert_allclose(
        v012, [0, V, 0] - np.array([0.1 + 3j, 0.2 + 1j, 0.3 + 1.4j]) * i012, atol=1e-8
    )


def states(
    seed: int, exponent: float | None = None
) -> list[tuple[Feeder, DenseSolution, Event, DenseSolution]]:
    """A few random feeders, each with an event."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(6):
        tie = k % 2 == 1
        feeder = random_feeder(
            rng,
            int(rng.integers(1, 8)),
            tie,
            closed_switch=k % 3 == 0,
            exponent=exponent,
        )
        closed = frozenset({s.name for s in feeder.switches if s.closed or k == 5})
        event = random_event(rng, feeder)
        before = solve_dense(feeder, closed)
        found.append((feeder, before, event, solve_dense(feeder, closed, event, start=before)))
    return found


SEEDS = range(5)


@pytest.mark.parametrize("seed", SEEDS)
def test_power_balance(seed: int) -> None:
    for _, before, _, after in states(seed):
        for state in (before, after):
            used = sum(state.load_va.values()) + state.loss_va
            assert abs(state.source_va - used) < 1e-10 * (abs(state.source_va) + 1e3)
            assert state.loss_va.real >= 0


@pytest.mark.parametrize("seed", SEEDS)
def test_voltages_before_an_event_are_reasonable(seed: int) -> None:
    for feeder, before, _, _ in states(seed):
        for v in before.v.values():
            pu = np.abs(v) / (feeder.source.v_phase_v * feeder.source.emf_pu)
            assert pu.min() > 0.88
            assert pu.max() < 1.05
        assert not before.floating


@pytest.mark.parametrize("seed", SEEDS)
def test_loads_follow_their_exponent(seed: int) -> None:
    for feeder, before, _, after in states(seed):
        for load in feeder.loads:
            for state in (before, after):
                pu = np.maximum(state.load_pu[load.name], 1e-30)
                factor = np.maximum(pu, 0.7) ** (load.exponent - 2) * pu**2
                assert state.load_va[load.name].real == pytest.approx(
                    load.kw * 1e3 * factor.sum() / 3, rel=1e-9, abs=1e-6
                )


@pytest.mark.parametrize("seed", SEEDS)
def test_kirchhoff_at_buses_without_taps(seed: int) -> None:
    checked = 0
    for feeder, before, event, after in states(seed):
        tapped = {x.place.bus for x in feeder.transformers}
        tapped |= {x.place.bus for x in feeder.loads if x.place is not None}
        for state in (before, after):
            for bus in set(state.v) - tapped - {feeder.source.bus}:
                out = np.zeros(3, dtype=np.complex128)
                for line in feeder.lines:
                    out += state.i_from[line.name] * (line.from_bus == bus)
                    out += state.i_to[line.name] * (line.to_bus == bus)
                for switch in feeder.switches:
                    sign = (switch.from_bus == bus) * 1.0 - (switch.to_bus == bus) * 1.0
                    out += sign * state.i_switch[switch.name]
                assert np.abs(out).max() < 1e-8
                checked += 1
        assert event.open_line is None or set(after.stubs) == {
            f"{event.open_line}.p",
            f"{event.open_line}.q",
        }
    assert checked > 5


def test_an_open_conductor_carries_exactly_nothing() -> None:
    rng = np.random.default_rng(11)
    for _ in range(6):
        feeder = random_feeder(rng, 4)
        bare = replace(
            feeder,
            transformers=tuple(replace(t, place=Place(bus="B1")) for t in feeder.transformers),
            loads=tuple(
                x if x.place is None else replace(x, place=Place(bus="B1")) for x in feeder.loads
            ),
        )
        event = random_event(rng, bare, "open")
        assert event.open_line is not None
        before = solve_dense(bare, NONE)
        got = solve_dense(bare, NONE, event, start=before)
        gone = list(event.open_phases)
        kept = [k for k in range(3) if k not in gone]
        base = np.abs(before.i_from["L0"]).max()
        assert np.abs(got.i_from[event.open_line][gone]).max() < 1e-12 * base
        assert np.abs(got.i_to[event.open_line][gone]).max() < 1e-12 * base
        p, q = got.stubs[f"{event.open_line}.p"], got.stubs[f"{event.open_line}.q"]
        np.testing.assert_allclose(p[kept], q[kept], rtol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_vector_group_does_not_reach_the_feeder(seed: int) -> None:
    rng = np.random.default_rng(seed)
    feeder = random_feeder(rng, 5, n_transformers=4)
    event = random_event(rng, feeder, "open")
    first, second = (solve_dense(feeder, NONE, event, delta_step=step) for step in (1, 2))
    for line in feeder.lines:
        np.testing.assert_allclose(
            first.i_from[line.name], second.i_from[line.name], rtol=1e-9, atol=1e-9
        )


@pytest.mark.parametrize("seed", SEEDS)
def test_linear_feeder_scales_with_its_source(seed: int) -> None:
    for feeder, _, _, _ in states(seed, exponent=2.0):
        closed = frozenset({s.name for s in feeder.switches if s.closed})
        before = solve_dense(feeder, closed)
        half = solve_dense(feeder, closed, emf_scale=0.5)
        for bus, v in before.v.items():
            np.testing.assert_allclose(half.v[bus], v / 2, rtol=1e-10)


def test_overrides_are_as_if_built_in() -> None:
    rng = np.random.default_rng(5)
    feeder = random_feeder(rng, 4, n_transformers=3)
    name = feeder.loads[0].name
    unit = feeder.transformers[0].name
    given = solve_dense(
        feeder, NONE, load_scale={name: 0.5}, exponents={name: 1.3}, connections={unit: "Yg/D"}
    )
    built = replace(
        feeder,
        loads=(
            replace(feeder.loads[0], kw=feeder.loads[0].kw / 2, exponent=1.3),
            *feeder.loads[1:],
        ),
        transformers=(replace(feeder.transformers[0], connection="Yg/D"), *feeder.transformers[1:]),
    )
    np.testing.assert_array_equal(given.i_from["L0"], solve_dense(built, NONE).i_from["L0"])
    with pytest.raises(ValueError, match="no load"):
        solve_dense(feeder, NONE, load_scale={"nobody": 1.0})


# The paper's Section V feeder -------------------------------------------------------------


def paper_feeder(delta: tuple[str, ...] = ("T4",)) -> Feeder:
    """Everything referred to 12 kV; ``delta``: the units that are Yg/D."""
    places = {
        "T1": ("R1-R2", 0.5),
        "T2": ("R2-R3", 0.25),
        "T3": ("R4-R5", 0.5),
        "T4": ("R2-R3", 0.9),
        "T5": ("R3-R4", 0.5),
        "T6": ("R3-R4", 0.9),
    }
    kw = {"T1": 600, "T2": 500, "T3": 800, "T4": 100, "T5": 200, "T6": 200}
    units = []
    for name, (line, at) in places.items():
        kind: Connection = "D/Yg" if name == "T2" else "Yg/D" if name in delta else "Yg/Yg"
        x0 = 1.0 if kind == "Yg/Yg" else None
        units.append(a_unit(name, Place(line=line, at=at), kind, leakage=polar(0.06, 88), x0=x0))
    z = polar(0.9, 85)
    feeder = a_feeder(
        lines=(
            a_line("R1-R2", "R1", "R2", polar(0.39, 70)),
            a_line("R2-R3", "R2", "R3", polar(0.85, 70)),
            a_line("R3-R4", "R3", "R4", polar(0.72, 70)),
            a_line("R4-R5", "R4'", "R1", polar(1.3, 70)),
        ),
        loads=tuple(a_load(f"load {t}", kw[t], behind=t) for t in kw),
        units=tuple(units),
        switches=(Switch(name="tie", from_bus="R4", to_bus="R4'", closed=False),),
        source_z=(z, z, z),
    )
    return replace(feeder, source=replace(feeder.source, bus="R1"))


OPEN_A = Event(open_line="R2-R3", open_fraction=0.6, open_phases=(0,))


def paper_states(
    delta: tuple[str, ...] = ("T4",), closed: frozenset[str] = NONE, event: Event = OPEN_A
) -> tuple[DenseSolution, DenseSolution]:
    feeder = paper_feeder(delta)
    before = solve_dense(feeder, closed)
    return before, solve_dense(feeder, closed, event, start=before)


def connection_impedance(
    before: tuple[complex, complex, complex], after: tuple[complex, complex, complex]
) -> complex:
    """Eq. (5) from (V_local, I_local, V_remote), the local current positive into the section."""
    (v, i, far), (dv, di, dfar) = before, (b - a for a, b in zip(before, after, strict=True))
    return (dv * far - dfar * v) / (di * v - dv * i)


def z_of(
    states: tuple[DenseSolution, DenseSolution],
    local: str,
    remote: str,
    line: str,
    *,
    at_to_end: bool = False,
    phase_a: bool = False,
) -> complex:
    def terminal(state: DenseSolution) -> tuple[complex, complex, complex]:
        current = (state.i_to if at_to_end else state.i_from)[line]
        v, i, far = (
            x[0] if phase_a else sequence(x)[1] for x in (state.v[local], current, state.v[remote])
        )
        return complex(v), complex(i), complex(far)

    return connection_impedance(terminal(states[0]), terminal(states[1]))


def test_paper_changes_of_voltage_and_current() -> None:
    before, after = paper_states()
    dv = after.v["R3"] - before.v["R3"]
    di2 = after.i_from["R2-R3"] - before.i_from["R2-R3"]
    di3 = after.i_from["R3-R4"] - before.i_from["R3-R4"]
    assert 100 * abs(dv[0]) / V == pytest.approx(9.289, abs=5e-4)
    assert 100 * abs(sequence(dv)[1]) / V == pytest.approx(3.323, abs=5e-4)
    assert abs(di2[0]) == pytest.approx(23.936, abs=5e-4)
    assert abs(di3[0]) == pytest.approx(3.0845, abs=5e-5)
    zero, positive, negative = np.abs(sequence(di2))
    assert positive == pytest.approx(0.7979, abs=5e-5)
    assert negative == pytest.approx(0.798, abs=5e-4)
    assert zero == pytest.approx(23.70, abs=5e-3)


def test_paper_positive_sequence_impedances() -> None:
    states = paper_states()
    z = z_of(states, "R2", "R3", "R2-R3")
    assert abs(z) == pytest.approx(288.30, abs=5e-3)
    assert np.degrees(np.angle(z)) == pytest.approx(-179.3, abs=0.05)
    assert abs(z_of(states, "R1", "R2", "R1-R2")) == pytest.approx(0.3901, abs=5e-5)


@pytest.mark.parametrize(
    ("delta", "ohm"),
    [(("T4",), 28.101), (("T4", "T5"), 17.968), (("T4", "T5", "T6"), 14.364)],
)
def test_paper_phase_impedance_by_number_of_grounded_wye_delta_units(
    delta: tuple[str, ...], ohm: float
) -> None:
    z = z_of(paper_states(delta), "R2", "R3", "R2-R3", phase_a=True)
    assert abs(z) == pytest.approx(ohm, abs=5e-4)


def test_paper_closed_loop() -> None:
    states = paper_states(closed=frozenset({"tie"}))
    z2 = z_of(states, "R2", "R3", "R2-R3")
    z3 = z_of(states, "R3", "R2", "R2-R3", at_to_end=True)
    assert abs(z2) == pytest.approx(2.4051, abs=5e-5)
    assert abs(z3) == pytest.approx(2.4107, abs=5e-5)


@pytest.mark.parametrize("fraction", [0.26, 0.4, 0.89])
def test_paper_place_between_the_tees_does_not_matter(fraction: float) -> None:
    event = replace(OPEN_A, open_fraction=fraction)
    z = z_of(paper_states(event=event), "R2", "R3", "R2-R3")
    assert abs(z) == pytest.approx(288.30, abs=5e-3)
