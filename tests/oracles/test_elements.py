"""Every element of the dense reference by itself, against hand calculation and limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.dense import FORTESCUE, DenseSolution, Event, NotConvergedError, Shunt, solve_dense
from oracles.random_elements import random_full_feeder
from oracles.random_feeders import random_event

from openphase.model.parts import (
    Capacitor,
    CapacitorConnection,
    Connection,
    Der,
    DerModel,
    Feeder,
    Line,
    Load,
    LoadConnection,
    Neutral,
    Place,
    Point,
    Regulator,
    Source,
    Transformer,
)

Complex = NDArray[np.complex128]
NONE: frozenset[str] = frozenset()
V = 12000 / np.sqrt(3)
ROTATION = np.exp(-2j * np.pi / 3 * np.arange(3))
OMEGA = 120 * np.pi
Z1, Z0 = 1 + 2j, 3 + 7j
ALL_KINDS: tuple[Connection, ...] = ("Yg/Yg", "D/Yg", "Yg/D", "Y/D", "D/D")
AT_B = Place(bus="B")


def sequence(phase: Complex) -> Complex:
    """Zero, positive and negative sequence of one phasor triple."""
    return np.asarray(FORTESCUE.conj().T @ phase / 3, dtype=np.complex128)


def a_source(neutral: Neutral = "solid", ohm: complex = 0j, z: complex = 0j) -> Source:
    return Source(
        bus="S",
        kv_ll=12.0,
        emf_pu=1.0,
        z1_ohm=z,
        z2_ohm=z,
        z0_ohm=z,
        frequency_hz=60.0,
        neutral=neutral,
        neutral_ohm=ohm,
    )


def a_line(
    name: str = "L", a: str = "S", b: str = "B", *, km: float = 1.0, c: tuple[float, float] = (0, 0)
) -> Line:
    """Z1 and Z0 per km, and nF per km of positive and zero sequence."""
    return Line(
        name=name,
        from_bus=a,
        to_bus=b,
        length_km=km,
        z1_ohm_per_km=Z1,
        z0_ohm_per_km=Z0,
        c1_nf_per_km=c[0],
        c0_nf_per_km=c[1],
    )


def a_feeder(*lines: Line, source: Source | None = None) -> Feeder:
    """Lines alone; ``replace`` puts something on them."""
    return Feeder(
        name="test",
        source=source or a_source(),
        lines=lines or (a_line(),),
        transformers=(),
        loads=(),
        switches=(),
        points=(),
        sections=(),
    )


def a_load(
    kw: float = 900,
    *,
    behind: str | None = None,
    connection: LoadConnection = "wye",
    exponent: float = 2.0,
    motor: tuple[float, float] = (0.0, 6.0),
) -> Load:
    return Load(
        name="D",
        transformer=behind,
        place=None if behind else AT_B,
        connection=connection,
        kw=kw,
        power_factor=0.9,
        exponent=exponent,
        motor_share=motor[0],
        motor_y2_y1=motor[1],
    )


def a_unit(
    kind: Connection, *, xm: float | None = None, x0: float | None = None, place: Place = AT_B
) -> Transformer:
    return Transformer(
        name="T",
        place=place,
        connection=kind,
        rating_kva=1000.0,
        leakage_pu=0.01 + 0.06j,
        x0_pu=x0,
        xm_pu=xm,
    )


Z_BASE = 144.0
LEAKAGE = (0.01 + 0.06j) * Z_BASE


def a_der(
    model: DerModel,
    *,
    behind: str | None = None,
    z1: complex | None = None,
    z2: complex | None = None,
    z0: complex | None = None,
) -> Der:
    return Der(
        name="G",
        transformer=behind,
        place=None if behind else AT_B,
        kw=600.0,
        power_factor=-0.95,
        model=model,
        z1_ohm=z1,
        z2_ohm=z2,
        z0_ohm=z0,
    )


DER_VA = 600e3 * (1 - 1j * np.tan(np.arccos(0.95)))


def earthed(line: str, phase: int, ohm: complex, at: float = 1.0) -> Event:
    """A fault from one phase to earth."""
    shunt = Shunt(where="p", phase=phase, siemens=1 / ohm)
    return Event(open_line=line, open_fraction=at, shunts=(shunt,))


def assert_equal(one: DenseSolution, two: DenseSolution, rtol: float = 1e-11) -> None:
    """All that both name is the same."""
    for field in ("v", "i_from", "i_to"):
        ours, theirs = getattr(one, field), getattr(two, field)
        assert ours.keys() & theirs.keys()
        for name in ours.keys() & theirs.keys():
            np.testing.assert_allclose(ours[name], theirs[name], rtol=rtol, atol=1e-7)


# Charging ---------------------------------------------------------------------------------


def test_an_unloaded_line_is_a_nominal_pi() -> None:
    feeder = a_feeder(a_line(km=30.0, c=(250.0, 120.0)), source=a_source(z=1j))
    got = solve_dense(feeder, NONE)
    half = 0.5j * OMEGA * 250e-9 * 30
    into = half + half / (1 + half * 30 * Z1)
    v = V / (1 + 1j * into)
    np.testing.assert_allclose(got.i_from["L"], into * v * ROTATION, rtol=1e-12)
    np.testing.assert_allclose(got.v["B"], v / (1 + half * 30 * Z1) * ROTATION, rtol=1e-12)
    assert np.abs(got.i_to["L"]).max() < 1e-10


def test_charging_of_the_zero_sequence() -> None:
    """A cable behind a resistor: V0/I0 of its pi where one phase is loaded at its end."""
    feeder = a_feeder(a_line(km=10.0, c=(250.0, 120.0)), source=a_source(z=2j))
    got = solve_dense(feeder, NONE, earthed("L", 0, 50.0))
    half = 0.5j * OMEGA * np.array([120e-9, 250e-9, 250e-9]) * 10
    i, v, far = (sequence(x) for x in (got.i_from["L"], got.v["S"], got.v["B"]))
    through = (v - far) / (10 * np.array([Z0, Z1, Z1]))
    np.testing.assert_allclose(i, through + half * v, rtol=1e-10)


@pytest.mark.parametrize("fraction", [0.0, 0.3, 1.0])
def test_a_cut_line_is_two_lines(fraction: float) -> None:
    whole = a_feeder(a_line(km=8.0, c=(250.0, 120.0)), source=a_source(z=2j))
    whole = replace(whole, loads=(a_load(exponent=0.5),))
    parts = (
        a_line("L1", "S", "M", km=8 * fraction, c=(250.0, 120.0)),
        a_line("L2", "M", "B", km=8 * (1 - fraction), c=(250.0, 120.0)),
    )
    cut = solve_dense(whole, NONE, Event(open_line="L", open_fraction=fraction))
    two = solve_dense(replace(whole, lines=parts), NONE)
    np.testing.assert_allclose(cut.v["B"], two.v["B"], rtol=1e-12)
    np.testing.assert_allclose(cut.stubs["L.p"], two.v["M"], rtol=1e-12)
    np.testing.assert_allclose(cut.i_from["L"], two.i_from["L1"], rtol=1e-10)
    np.testing.assert_allclose(cut.i_to["L"], two.i_to["L2"], rtol=1e-10)


def test_both_stubs_of_a_broken_line_keep_their_charging() -> None:
    """Nothing else is there: the opened phase of each part carries what charges that part."""
    feeder = a_feeder(a_line(km=20.0, c=(250.0, 250.0)))
    got = solve_dense(feeder, NONE, Event(open_line="L", open_fraction=0.25, open_phases=(1,)))
    own = 1j * OMEGA * 250e-9 * 20 * 0.25
    alone = solve_dense(a_feeder(a_line(km=5.0, c=(250.0, 250.0))), NONE)
    assert got.i_from["L"][1] == pytest.approx(own * got.v["S"][1], rel=0.02)
    assert got.i_from["L"][1] == pytest.approx(alone.i_from["L"][1], rel=0.02)
    assert not got.floating


# Neutrals ---------------------------------------------------------------------------------


@pytest.mark.parametrize("neutral", ["resistor", "petersen"])
def test_earth_fault_behind_a_neutral_impedance(neutral: Neutral) -> None:
    ohm = 30 + 0j if neutral == "resistor" else 2 + 40j
    feeder = a_feeder(source=a_source(neutral, ohm, 1j))
    got = solve_dense(feeder, NONE, earthed("L", 0, 10.0))
    z = 2 * (1j + Z1) + 1j + Z0 + 3 * ohm + 30
    assert got.i_from["L"][0] == pytest.approx(3 * V / z, rel=1e-12)
    assert abs(got.v["S"].sum() / 3 + (1j / 3 + ohm) * got.i_from["L"][0]) < 1e-8


def test_earth_fault_of_an_isolated_network_is_its_charging() -> None:
    lines = (a_line(c=(200.0, 100.0)), a_line("M", "S", "C", km=9.0, c=(200.0, 100.0)))
    stiff = tuple(replace(x, z1_ohm_per_km=0j, z0_ohm_per_km=0j) for x in lines)
    got = solve_dense(a_feeder(*stiff, source=a_source("isolated")), NONE, earthed("L", 0, 50.0))
    z = 50 + 1 / (3j * OMEGA * 100e-9 * 10)
    through = got.stubs["L.p"][0] / 50
    assert through == pytest.approx(V / z, rel=1e-12)
    assert abs(got.i_source.sum()) < 1e-10
    assert not got.floating


def test_a_tuned_coil_takes_the_fault_current_away() -> None:
    lines = (a_line(km=30.0, c=(10.0, 6.0)),)
    stiff = tuple(replace(x, z1_ohm_per_km=0j, z0_ohm_per_km=0j) for x in lines)
    coil = 1j / (3 * OMEGA * 6e-9 * 30)
    tuned, isolated = (
        solve_dense(a_feeder(*stiff, source=source), NONE, earthed("L", 0, 50.0))
        for source in (a_source("petersen", coil), a_source("isolated"))
    )
    assert abs(tuned.stubs["L.p"][0]) < 1e-9 * abs(isolated.stubs["L.p"][0])


@pytest.mark.parametrize("seed", range(4))
def test_isolated_is_the_limit_of_a_large_resistor(seed: int) -> None:
    feeder = random_full_feeder(np.random.default_rng([seed, 5]), 4)
    lines = tuple(replace(x, c1_nf_per_km=30.0, c0_nf_per_km=15.0) for x in feeder.lines)
    feeder = replace(feeder, lines=lines)
    source = replace(feeder.source, neutral="isolated", neutral_ohm=0j)
    none = replace(feeder, source=source)
    huge = replace(feeder, source=replace(source, neutral="resistor", neutral_ohm=1e13 + 0j))
    event = Event(open_line="L1", open_fraction=0.4, open_phases=(2,))
    assert_equal(solve_dense(none, NONE, event), solve_dense(huge, NONE, event), rtol=1e-7)


def test_without_charging_an_isolated_network_floats_as_a_whole() -> None:
    feeder = replace(a_feeder(source=a_source("isolated")), loads=(a_load(connection="delta"),))
    got = solve_dense(feeder, NONE)
    assert got.floating == {(bus, k) for bus in ("S", "B") for k in range(3)}
    np.testing.assert_allclose(got.v["S"] - got.v["S"].mean(), V * ROTATION, rtol=1e-12)


# Transformers -----------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ALL_KINDS)
def test_positive_sequence_of_every_connection(kind: Connection) -> None:
    feeder = replace(
        a_feeder(source=a_source(z=1j)),
        transformers=(a_unit(kind, xm=20.0),),
        loads=(a_load(behind="T"),),
    )
    got = solve_dense(feeder, NONE)
    z_load = 12000**2 / np.conj(900e3 * (1 + 1j * np.tan(np.arccos(0.9))))
    middle = 1 / (1 / (LEAKAGE / 2 + z_load) + 1 / (20j * Z_BASE))
    current = V / (1j + Z1 + LEAKAGE / 2 + middle)
    np.testing.assert_allclose(got.i_from["L"], current * ROTATION, rtol=1e-11)
    assert not got.floating


@pytest.mark.parametrize("kind", ["Y/D", "D/D"])
@pytest.mark.parametrize("xm", [None, 20.0])
def test_no_zero_sequence_passes_an_ungrounded_winding(kind: Connection, xm: float | None) -> None:
    feeder = replace(a_feeder(), transformers=(a_unit(kind, xm=xm),), loads=(a_load(behind="T"),))
    got = solve_dense(feeder, NONE, earthed("L", 0, 40.0, at=0.5))
    assert abs(sequence(got.v["B"])[0]) > 10
    assert abs(got.i_to["L"].sum()) < 1e-9


def test_loaded_wye_delta_on_two_phases() -> None:
    """Equal and opposite currents in two HV windings: nothing is left for the third."""
    feeder = replace(a_feeder(), transformers=(a_unit("Y/D"),), loads=(a_load(behind="T"),))
    event = Event(open_line="L", open_fraction=0.5, open_phases=(0,))
    got = solve_dense(feeder, NONE, event)
    z_load = 12000**2 / np.conj(900e3 * (1 + 1j * np.tan(np.arccos(0.9))))
    current = V * (ROTATION[1] - ROTATION[2]) / (2 * (Z1 + LEAKAGE + z_load))
    np.testing.assert_allclose(got.i_from["L"][1:], [current, -current], rtol=1e-11)
    assert got.load_pu["D"].min() < 1e-9


@pytest.mark.parametrize("phases", [(), (0,), (1, 2)])
def test_delta_delta_is_a_delta_load_behind_its_leakage(phases: tuple[int, ...]) -> None:
    feeder = replace(a_feeder(), transformers=(a_unit("D/D"),), loads=(a_load(behind="T"),))
    event = Event(open_line="L", open_fraction=0.5, open_phases=phases)
    z_load = 12000**2 / np.conj(900e3 * (1 + 1j * np.tan(np.arccos(0.9))))
    s = 12000**2 / np.conj(z_load + LEAKAGE)
    load = replace(
        a_load(float(s.real) / 1e3, connection="delta"),
        power_factor=float(s.real / abs(s)),
    )
    alone = replace(a_feeder(), loads=(load,))
    assert_equal(solve_dense(feeder, NONE, event), solve_dense(alone, NONE, event))


@pytest.mark.parametrize("kind", ALL_KINDS)
def test_a_large_magnetizing_reactance_is_none(kind: Connection) -> None:
    event = Event(open_line="L", open_fraction=0.5, open_phases=(0,))
    x0 = 0.8 if kind == "Yg/Yg" else None
    large, none = (
        solve_dense(
            replace(
                a_feeder(), transformers=(a_unit(kind, xm=xm, x0=x0),), loads=(a_load(behind="T"),)
            ),
            NONE,
            event,
        )
        for xm in (1e8, None)
    )
    assert_equal(large, none, rtol=1e-6)


# Motors -----------------------------------------------------------------------------------


@pytest.mark.parametrize("phases", [(), (0,), (1, 2)])
def test_a_motor_of_equal_sequences_is_a_delta_load(phases: tuple[int, ...]) -> None:
    event = Event(open_line="L", open_fraction=0.5, open_phases=phases)
    motor, delta = (
        solve_dense(replace(a_feeder(), loads=(load,)), NONE, event)
        for load in (a_load(motor=(1.0, 1.0)), a_load(connection="delta"))
    )
    assert_equal(motor, delta)


@pytest.mark.parametrize("kind", ALL_KINDS)
def test_one_phase_open_before_a_motor(kind: Connection) -> None:
    """Its sequences in series, without a way for the zero sequence: the text-book circuit."""
    source = a_source("isolated", z=1j)
    load = a_load(behind="T", motor=(1.0, 6.0))
    feeder = replace(a_feeder(source=source), transformers=(a_unit(kind),), loads=(load,))
    event = Event(open_line="L", open_fraction=0.5, open_phases=(0,))
    got = solve_dense(feeder, NONE, event)
    y1 = np.conj(900e3 * (1 + 1j * np.tan(np.arccos(0.9)))) / 12000**2
    z1, z2 = (1j + Z1 + LEAKAGE + 1 / (y1 * ratio) for ratio in (1, 6))
    zero, positive, negative = sequence(got.i_from["L"])
    assert positive == pytest.approx(V / (z1 + z2), rel=1e-10)
    assert negative == pytest.approx(-V / (z1 + z2), rel=1e-10)
    assert abs(zero) < 1e-9


def test_a_motor_share_follows_the_positive_sequence_and_the_rest_each_winding() -> None:
    load = a_load(exponent=0.8, motor=(0.4, 5.0))
    got = solve_dense(replace(a_feeder(), loads=(load,)), NONE, earthed("L", 0, 5.0))
    s = 900e3 * (1 + 1j * np.tan(np.arccos(0.9)))
    pu = np.maximum(got.load_pu["D"], 1e-30)
    rest = 0.6 * s / 3 * np.sum(np.maximum(pu, 0.7) ** (0.8 - 2) * pu**2)
    assert got.load_va["D"] == pytest.approx(rest, rel=1e-10)
    _, v1, v2 = np.abs(sequence(got.v["B"])) / V
    motor = 0.4 * s * (max(v1, 0.7) ** (0.8 - 2) * v1**2 + 5.0 * v2**2)
    assert v2 > 0.05
    assert got.load_va["D.motor"] == pytest.approx(motor, rel=1e-10)


# DER --------------------------------------------------------------------------------------

MODELS: tuple[DerModel, ...] = ("thevenin", "constant_current", "constant_power", "generator")
DER_Z1, DER_Z2, DER_Z0 = 5 + 60j, 4 + 40j, 1 + 20j


def with_der(model: DerModel, kind: Connection | None) -> Feeder:
    behind = None if kind is None else "T"
    der = a_der(model, behind=behind, z1=DER_Z1, z2=DER_Z2, z0=DER_Z0)
    units = () if kind is None else (a_unit(kind, place=AT_B),)
    return replace(a_feeder(source=a_source(z=2j)), transformers=units, ders=(der,))


@pytest.mark.parametrize("kind", [None, *ALL_KINDS])
@pytest.mark.parametrize("model", MODELS)
def test_der_delivers_its_power_and_then_keeps_what_its_model_says(
    model: DerModel, kind: Connection | None
) -> None:
    feeder = with_der(model, kind)
    before = solve_dense(feeder, NONE)
    assert before.load_va["G.der"] == pytest.approx(-DER_VA, rel=1e-11)
    event = replace(earthed("L", 0, 30.0), emf_scale=0.95)
    after = solve_dense(feeder, NONE, event, start=before, before=before)
    one, two = before.kept["G"], after.kept["G"]
    assert abs(two.v1_v - one.v1_v) > 0.01 * abs(one.v1_v)
    if model == "constant_current":
        assert two.i1_a == pytest.approx(one.i1_a, rel=1e-11)
    elif model == "constant_power":
        assert 3 * two.v1_v * np.conj(two.i1_a) == pytest.approx(DER_VA, rel=1e-11)
    else:
        # in winding quantities: by its nominal voltage over the feeder's
        ratio = 1.0 if kind is None else 480 / 12000 / (1 if kind.endswith("D") else np.sqrt(3))
        z1 = DER_Z1 * ratio**2 * (3 if kind is not None else 1)
        emf = one.v1_v + z1 * one.i1_a
        assert two.v1_v + z1 * two.i1_a == pytest.approx(emf, rel=1e-10)


@pytest.mark.parametrize("model", MODELS)
def test_der_shows_the_other_sequences_its_impedances(model: DerModel) -> None:
    feeder = with_der(model, None)
    before = solve_dense(feeder, NONE)
    after = solve_dense(feeder, NONE, earthed("L", 0, 30.0, at=0.5), before=before)
    v, i = sequence(after.v["B"]), sequence(-after.i_to["L"])
    assert i[0] == pytest.approx(v[0] / DER_Z0, rel=1e-10)
    assert i[2] == pytest.approx(v[2] / DER_Z2, rel=1e-10)


@pytest.mark.parametrize("model", MODELS)
def test_der_factors(model: DerModel) -> None:
    """What is delivered follows the factor at the voltage before; at 0 nothing is left."""
    feeder = with_der(model, "D/Yg")
    before = solve_dense(feeder, NONE)
    tripped = solve_dense(feeder, NONE, Event(ders={"G": 0.0}), before=before)
    assert np.abs(tripped.i_from["L"]).max() < 1e-9
    same = solve_dense(feeder, NONE, Event(ders={"G": 1.0}), before=before)
    assert_equal(same, before)
    half = solve_dense(feeder, NONE, Event(ders={"G": 0.5}), before=before)
    delivered = -half.load_va["G.der"] / DER_VA
    assert 0.4 < delivered.real < 0.6


# Capacitors and regulators ----------------------------------------------------------------


@pytest.mark.parametrize("kind", ["wye", "delta"])
def test_capacitor_raises_the_voltage(kind: CapacitorConnection) -> None:
    bank = Capacitor(name="C", place=AT_B, connection=kind, kvar=1200.0)
    got = solve_dense(replace(a_feeder(source=a_source(z=2j)), capacitors=(bank,)), NONE)
    v = V / (1 + (2j + Z1) * 1.2e6j / 12000**2)
    np.testing.assert_allclose(got.v["B"], v * ROTATION, rtol=1e-12)
    assert got.load_va["C.capacitor"] == pytest.approx(-1.2e6j * abs(v / V) ** 2, rel=1e-11)


@pytest.mark.parametrize("backwards", [False, True])
def test_regulator_is_ideal_and_phase_by_phase(backwards: bool) -> None:
    regulator = Regulator(
        name="R",
        from_bus="M" if backwards else "S",
        to_bus="S" if backwards else "M",
        taps=(4, -6, 10),
        step_pct=0.625,
        most_taps=16,
    )
    feeder = replace(
        a_feeder(a_line("L", "M", "B"), source=a_source(z=2j)),
        regulators=(regulator,),
        loads=(a_load(exponent=0.7),),
    )
    got = solve_dense(feeder, NONE, Event(taps={"R": (1.01, 1.0, 0.98)}))
    ratio = (1 + np.array([4, -6, 10]) * 0.00625) * np.array([1.01, 1.0, 0.98])
    ratio = 1 / ratio if backwards else ratio
    np.testing.assert_allclose(got.v["M"], ratio * got.v["S"], rtol=1e-12)
    np.testing.assert_allclose(got.i_source, ratio * got.i_from["L"], rtol=1e-12)


# States -----------------------------------------------------------------------------------


def test_a_detached_line_end_is_three_open_phases() -> None:
    feeder = replace(
        a_feeder(a_line("L", "S", "M"), a_line("K", "M", "B", km=5.0, c=(250.0, 120.0))),
        loads=(a_load(),),
        points=(Point(name="P", bus="M", line="K"),),
    )
    got = solve_dense(feeder, NONE, opened=frozenset({"P"}))
    broken = solve_dense(
        feeder, NONE, Event(open_line="K", open_fraction=0.0, open_phases=(0, 1, 2))
    )
    assert_equal(got, broken)
    np.testing.assert_allclose(got.v["K@M"], broken.stubs["K.q"], atol=1e-9)


def test_held_voltages_tell_an_operating_point_from_another_state() -> None:
    feeder = replace(a_feeder(), loads=(a_load(exponent=0.3, motor=(0.5, 6.0)),))
    event = Event(open_line="L", open_fraction=0.5, open_phases=(0,))
    before = solve_dense(feeder, NONE)
    after = solve_dense(feeder, NONE, event)
    for start, same in ((before, False), (after, True)):
        held = solve_dense(feeder, NONE, event, start=start, hold=True)
        moved = max(np.abs(held.load_pu[name] - start.load_pu[name]).max() for name in held.load_pu)
        assert (moved < 1e-11) == same


def test_shunts_between_phases_and_on_both_sides_of_a_break() -> None:
    shunts = (
        Shunt(where="p", phase=1, other=2, siemens=0.02),
        Shunt(where="q", phase=0, siemens=0.03),
        Shunt(where="far", phase=2, siemens=0.04),
    )
    event = Event(
        open_line="L",
        open_fraction=0.5,
        open_phases=(0,),
        shunts=shunts,
        far=Place(line="L", at=0.8),
    )
    got = solve_dense(replace(a_feeder(), loads=(a_load(),)), NONE, event)
    p, q = got.stubs["L.p"], got.stubs["L.q"]
    between = 0.02 * (p[1] - p[2]) * np.array([0, 1, -1])
    fallen = 0.03 * q * np.array([1, 0, 0])
    drawn = got.i_from["L"] + got.i_to["L"] - between - fallen
    # what is left over flows to earth at the far place, from phase c alone
    assert np.abs(drawn[:2]).max() < 1e-9
    far = got.v["B"] - 0.2 * line_drop(got.i_to["L"])
    assert drawn[2] == pytest.approx(0.04 * far[2], rel=1e-9)
    assert abs(got.i_from["L"][0]) < 1e-10


def line_drop(into: Complex) -> Complex:
    """Voltage along one km of line, for the current into its end."""
    return np.asarray(Z1 * into + (Z0 - Z1) / 3 * into.sum())


def test_power_is_conserved_whatever_there_is() -> None:
    unsolved = 0
    for seed in range(60):
        rng = np.random.default_rng([seed, 6])
        feeder = random_full_feeder(rng, int(rng.integers(1, 7)), with_tie=seed % 2 == 0)
        closed = frozenset(s.name for s in feeder.switches if s.closed or seed % 4 == 0)
        before = solve_dense(feeder, closed)
        event = random_event(rng, feeder)
        try:
            after = solve_dense(feeder, closed, event, start=before, before=before)
        except NotConvergedError:  # a current source on an island has nowhere to go
            unsolved += 1
            continue
        for state in (before, after):
            used = sum(state.load_va.values()) + state.loss_va + state.charging_va
            assert abs(state.source_va - used) < 1e-9 * (abs(state.source_va) + 1e3)
            assert state.loss_va.real >= 0
            if feeder.source.neutral == "isolated":
                assert abs(state.i_source.sum()) < 1e-9 * np.abs(state.i_source).max()
    assert unsolved < 4
