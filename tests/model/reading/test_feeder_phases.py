"""Phases and nominal voltages: refused exactly where a part would find nothing to stand on.

The messages stand in ``tests/malformed/feeder``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import pytest

from openphase.model import (
    Capacitor,
    Der,
    Feeder,
    InlineTransformer,
    InputError,
    Line,
    LineCode,
    Load,
    Place,
    Point,
    Regulator,
    Source,
    Switch,
    Transformer,
    make_feeder,
)
from openphase.model.buses import bus_phases, bus_volts, fed_backwards
from openphase.model.errors import Fault
from openphase.model.phases import conductors, letters, phase_mask

SOURCE = Source(bus="S", kv_ll=12.0, emf_pu=1.0, z1_ohm=1j, z2_ohm=1j, z0_ohm=1j, frequency_hz=50.0)
TRUNK = Line(
    name="trunk",
    from_bus="S",
    to_bus="T",
    length_km=2.0,
    z1_ohm_per_km=0.2 + 0.4j,
    z0_ohm_per_km=0.5 + 1.2j,
)
EVERY = [*"abc", "ab", "bc", "ca", "abc"]


def lateral(phases: str, to: str = "L", start: str = "T", name: str = "lateral") -> Line:
    return replace(TRUNK, name=name, from_bus=start, to_bus=to, phases=phases)


def load(phases: str = "abc", bus: str = "L", **more: Any) -> Load:
    values: dict[str, Any] = {
        "name": "load",
        "transformer": None,
        "place": Place(bus=bus),
        "connection": "wye",
        "kw": 10.0,
        "power_factor": 1.0,
        "exponent": 2.0,
        "phases": phases,
    }
    return Load(**values | more)


def inline(**more: Any) -> InlineTransformer:
    values: dict[str, Any] = {
        "name": "x",
        "from_bus": "T",
        "to_bus": "V",
        "connection": "D/Yg",
        "rating_kva": 100.0,
        "kv_from": 12.0,
        "kv_to": 0.4,
        "leakage_pu": 0.01 + 0.05j,
    }
    return InlineTransformer(**values | more)


def built(*parts: Line, **more: Sequence[Any]) -> Feeder:
    return make_feeder(name="f", source=SOURCE, lines=[TRUNK, *parts], **more)  # type: ignore[arg-type]


def accepted(*parts: Line, **more: Sequence[Any]) -> bool:
    """Whether the parts are let in; those that are not have one fault, and no echo of it."""
    faults: tuple[Fault, ...] = ()
    try:
        built(*parts, **more)
    except InputError as error:
        faults = error.faults
    assert len(faults) <= 1
    return not faults


@pytest.mark.parametrize("there", EVERY)
@pytest.mark.parametrize("wanted", EVERY)
def test_a_part_finds_its_phases_or_is_refused(there: str, wanted: str) -> None:
    fits = set(wanted) <= set(there)
    one = lateral(there)
    bank = Capacitor(
        name="c", place=Place(line="lateral", at=0.5), connection="wye", kvar=9.0, phases=wanted
    )
    switch = Switch(name="s", from_bus="L", to_bus="M", closed=True, phases=wanted)
    regulator = Regulator(
        name="r",
        from_bus="L",
        to_bus="M",
        taps=(0, 0, 0),
        step_pct=1.0,
        most_taps=9,
        phases=wanted,
    )
    assert accepted(one, loads=[load(wanted)]) == fits
    assert accepted(one, capacitors=[bank]) == fits
    assert accepted(one, switches=[switch]) == fits
    assert accepted(one, regulators=[regulator]) == fits
    assert accepted(one, lateral(wanted, "M", "L", "next")) == fits
    for at in (0.0, 0.5, 1.0):
        stands = fits if at > 0.0 else True
        assert accepted(one, loads=[load(wanted, place=Place(line="lateral", at=at))]) == stands


@pytest.mark.parametrize("there", EVERY)
def test_what_needs_three_phases(there: str) -> None:
    fits, one, place = len(there) == 3, lateral(there), Place(bus="L")
    unit = Transformer(
        name="t", place=place, connection="D/Yg", rating_kva=9.0, leakage_pu=0j, x0_pu=None
    )
    der = Der(
        name="d",
        transformer=None,
        place=place,
        kw=1.0,
        power_factor=1.0,
        model="constant_current",
        z1_ohm=None,
        z2_ohm=None,
        z0_ohm=None,
    )
    assert accepted(one, transformers=[unit]) == fits
    assert accepted(one, ders=[der]) == fits
    assert accepted(one, points=[Point(name="p", bus="L", line="lateral")]) == fits
    assert accepted(one, loads=[load(there, motor_share=0.5)]) == fits


def test_laterals_that_meet_bring_what_they_have() -> None:
    ways = [lateral(phase, "L", name=phase) for phase in "ab"]
    feeder = built(*ways, loads=[load("ab")])
    assert letters(bus_phases(feeder)["L"]) == "ab"
    assert not accepted(*ways, loads=[load("abc")])
    assert accepted(lateral("a"), loads=[load("ab")], switches=[
        Switch(name="tie", from_bus="L", to_bus="T", closed=False)
    ])  # fmt: skip


def test_behind_a_transformer_are_the_phases_of_its_windings() -> None:
    unit = inline(connection="single", kv_from=6.9, kv_to=0.24, phases="c", to_phases="a")
    assert accepted(inline_transformers=[unit], loads=[load("a", "V")])
    assert not accepted(inline_transformers=[unit], loads=[load("c", "V")])
    far = replace(unit, from_bus="L")
    assert accepted(lateral("bc"), inline_transformers=[far], loads=[load("a", "V")])
    assert not accepted(lateral("ab"), inline_transformers=[far])
    two = [unit, replace(unit, name="y", phases="b", to_phases="b")]
    assert accepted(inline_transformers=two, loads=[load("ab", "V")])


def test_the_phase_that_an_open_delta_refers_to_goes_through() -> None:
    regulator = Regulator(
        name="r",
        from_bus="T",
        to_bus="M",
        taps=(3, 0, -2),
        step_pct=1.0,
        most_taps=9,
        phases="ac",
        reference="b",
    )
    assert conductors(regulator) == "acb"
    assert accepted(regulators=[regulator], loads=[load("abc", "M")])
    assert not accepted(lateral("ac"), regulators=[replace(regulator, from_bus="L")])
    earthed = replace(regulator, reference="earth")
    assert not accepted(regulators=[earthed], loads=[load("abc", "M")])


def test_masks_and_letters_are_one() -> None:
    for count in range(4):
        for some in combinations("abc", count):
            assert letters(phase_mask("".join(some))) == "".join(some)


# ---- nominal voltages ----


def test_volts_behind_transformers() -> None:
    units = [
        inline(),
        inline(
            name="y", to_bus="W", connection="single", kv_from=12.0, kv_to=0.24, phases="ab",
            to_phases="a",
        ),
        inline(
            name="z", to_bus="U", connection="centre-tap", kv_from=6.9, kv_to=0.24, phases="a",
            to_phases="ab", leg_leakage_pu=0.01j,
        ),
    ]  # fmt: skip
    volts = bus_volts(built(inline_transformers=units))
    root = 3.0**0.5
    assert [volts[bus] for bus in "STVWU"] == pytest.approx(
        [12000 / root, 12000 / root, 400 / root, 240, 120]
    )


@pytest.mark.parametrize(("kv", "fits"), [(0.4, True), (0.42, True), (0.48, False), (12.0, False)])
def test_two_ways_to_a_bus_bring_one_voltage(kv: float, fits: bool) -> None:
    second = inline(name="y", kv_to=kv, to_bus="W")
    tie = Switch(name="tie", from_bus="V", to_bus="W", closed=False)
    # 0.4 and 0.48 kV are just 20 % apart, which is too much
    assert accepted(inline_transformers=[inline(), second], switches=[tie]) == (fits or kv == 0.48)
    assert accepted(inline_transformers=[inline(), replace(second, to_bus="V")]) == (
        fits or kv == 0.48
    )


def test_a_transformer_fed_from_its_to_side_gives_the_other_its_volts() -> None:
    unit = inline(from_bus="V", to_bus="T", connection="Yg/D", kv_from=0.4, kv_to=12.47)
    feeder = built(inline_transformers=[unit], loads=[load("abc", "V")])
    assert bus_volts(feeder)["V"] == pytest.approx(400 / 3.0**0.5)
    assert fed_backwards(feeder) == {"x"}


# ---- codes, in-line transformers, loads and regulators in themselves ----

ONE = LineCode(name="one", r_ohm_per_km=((0.3,),), x_ohm_per_km=((0.8,),))
TWO = LineCode(
    name="two",
    r_ohm_per_km=((0.3, 0.1), (0.1, 0.3)),
    x_ohm_per_km=((0.8, 0.3), (0.3, 0.8)),
    c_nf_per_km=((9.0, -2.0), (-2.0, 9.0)),
)
OF_CODE = {"z1_ohm_per_km": None, "z0_ohm_per_km": None}


@pytest.mark.parametrize("code", [ONE, TWO])
@pytest.mark.parametrize("phases", EVERY)
def test_a_code_has_as_many_rows_as_the_line_has_phases(code: LineCode, phases: str) -> None:
    line = replace(lateral(phases), code=code.name, **OF_CODE)  # type: ignore[arg-type]
    assert accepted(line, codes=[ONE, TWO]) == (len(phases) == len(code.r_ohm_per_km))


@pytest.mark.parametrize(
    "change",
    [
        {"x_ohm_per_km": ((0.8, 0.3), (0.31, 0.8))},
        {"x_ohm_per_km": ((0.8, 0.3), (0.3, -0.1))},
        {"x_ohm_per_km": ((0.8, 0.0), (0.0, 0.0)), "r_ohm_per_km": ((0.3, 0.0), (0.0, 0.0))},
        {"r_ohm_per_km": ((0.3, 0.1), (0.1, -0.3))},
        {"r_ohm_per_km": ((0.3,),)},
        {"c_nf_per_km": ((9.0,),)},
        {"c_nf_per_km": ((9.0, float("nan")), (float("nan"), 9.0))},
        {"r_ohm_per_km": ((0.0, 0.0), (0.0, 0.0)), "x_ohm_per_km": ((0.8, 0.8), (0.8, 0.8))},
    ],
)
def test_matrices_that_are_none(change: dict[str, Any]) -> None:
    assert accepted(codes=[TWO, replace(ONE, x_ohm_per_km=((0.0,),))])
    assert not accepted(codes=[replace(TWO, **change)])


@pytest.mark.parametrize(
    ("change", "fits"),
    [
        ({}, True),
        ({"connection": "Y/Y"}, True),
        ({"shift": "lead"}, True),
        ({"to_neutral_ohm": 5 + 0j}, True),
        ({"from_neutral_ohm": 5 + 0j}, False),
        ({"connection": "Yg/Yg", "shift": "lead"}, False),
        ({"connection": "D/D", "shift": "lead"}, False),
        ({"connection": "D/Y", "to_neutral_ohm": 5 + 0j}, False),
        ({"phases": "ab"}, False),
        ({"to_phases": "a"}, False),
        ({"phases": "bca"}, True),
        ({"leakage_pu": 0j}, False),
        ({"leg_leakage_pu": 0.01j}, False),
        ({"magnetizing_pu": 0.01 - 0.1j}, True),
        ({"magnetizing_pu": 0.01 + 0.1j}, False),
        ({"connection": "single", "phases": "a", "to_phases": "b"}, True),
        ({"connection": "single", "phases": "ab", "to_phases": "ca"}, True),
        ({"connection": "single", "phases": "a"}, False),
        ({"connection": "centre-tap", "phases": "a", "to_phases": "ab"}, False),
        (
            {
                "connection": "centre-tap",
                "phases": "a",
                "to_phases": "ab",
                "leg_leakage_pu": 0.01j,
                "leakage_pu": 0j,
            },
            True,
        ),
        (
            {
                "connection": "centre-tap",
                "phases": "a",
                "to_phases": "a",
                "leg_leakage_pu": 0.01j,
            },
            False,
        ),
    ],
)
def test_inline_transformers(change: dict[str, Any], fits: bool) -> None:
    assert accepted(inline_transformers=[inline(**change)]) == fits


SHARES = (0.5, 0.2, 0.3, 1.5, -0.5, 0.0)


@pytest.mark.parametrize(
    ("change", "fits"),
    [
        ({"connection": "delta"}, True),
        ({"connection": "delta", "phases": "ab"}, True),
        ({"connection": "delta", "phases": "b"}, False),
        ({"kvar": -5.0}, True),
        ({"kvar": -5.0, "power_factor": 0.9}, False),
        ({"zip": SHARES}, True),
        ({"zip": (*SHARES[:5], 2e-6)}, False),
        ({"zip": (*SHARES[:5], 2e-7)}, True),
        ({"zip": SHARES, "exponent": 1.0}, False),
        ({"zip": SHARES, "exponent_q": 1.0}, False),
        ({"exponent": 0.4, "exponent_q": 3.2}, True),
        ({"v_max_pu": 0.7}, False),
        ({"v_max_pu": 1.05, "v_min_pu": 0.95, "v_low_pu": 0.5}, True),
        ({"v_low_pu": 0.7}, False),
    ],
)
def test_loads(change: dict[str, Any], fits: bool) -> None:
    assert accepted(loads=[load(**{"bus": "T", **change})]) == fits


UNITS = Regulator(
    name="r", from_bus="T", to_bus="M", taps=(2, 0, 2), step_pct=1.0, most_taps=9, phases="ac"
)


@pytest.mark.parametrize(
    ("change", "fits"),
    [
        ({}, True),
        ({"taps": (2, 1, 2)}, False),
        ({"reference": "b"}, True),
        ({"reference": "a"}, False),
        ({"reference": "next"}, False),
        ({"reference": "next", "phases": "abc"}, True),
        ({"reference": "b", "jumper_ohm": 0.1j}, True),
        ({"jumper_ohm": 0.1j}, False),
        ({"gang": True}, True),
        ({"gang": True, "taps": (2, 0, 1)}, False),
        ({"gang": True, "phases": "abc"}, False),
        ({"z_ohm": 0.1 + 0.2j}, True),
    ],
)
def test_regulators(change: dict[str, Any], fits: bool) -> None:
    assert accepted(regulators=[replace(UNITS, **change)]) == fits


def test_loops_without_impedance_are_seen_phase_by_phase() -> None:
    def fuse(phase: str) -> Switch:
        return Switch(name=phase, from_bus="T", to_bus="M", closed=True, phases=phase)

    assert accepted(switches=[fuse("a"), fuse("b"), fuse("c")])
    assert not accepted(switches=[fuse("a"), fuse("ab")])
    assert accepted(switches=[fuse("a"), replace(fuse("ab"), closed=False)])
    assert accepted(switches=[fuse("b")], regulators=[UNITS])
    assert not accepted(switches=[fuse("a")], regulators=[UNITS])
    assert accepted(switches=[fuse("a")], regulators=[replace(UNITS, z_ohm=0.01j)])
    assert not accepted(switches=[fuse("b")], regulators=[replace(UNITS, reference="b")])


def test_three_wires_end_at_a_transformer() -> None:
    source = replace(SOURCE, wires=3)
    more: dict[str, Any] = {"name": "f", "source": source, "lines": [TRUNK]}
    make_feeder(**more, inline_transformers=[inline()], loads=[load("a", "V")])
    for faulty in (
        {"loads": [load("a", "T")]},
        {"inline_transformers": [inline(connection="Yg/D")]},
        {"inline_transformers": [inline(connection="single", phases="a", to_phases="a")]},
        {"regulators": [UNITS]},
    ):
        with pytest.raises(InputError, match="on a feeder of three wires"):
            make_feeder(**more, **faulty)
    make_feeder(**more, regulators=[replace(UNITS, reference="b")])


def test_an_isolated_feeder_is_tied_to_earth_on_its_own_side() -> None:
    source = replace(SOURCE, neutral="isolated")
    more: dict[str, Any] = {"name": "f", "source": source, "lines": [TRUNK]}
    make_feeder(**more, inline_transformers=[inline(connection="Yg/D")])
    with pytest.raises(InputError, match="must not be isolated"):
        make_feeder(**more, inline_transformers=[inline()], loads=[load("a", "V")])
    coded = replace(lateral("ab"), code="two", **OF_CODE)  # type: ignore[arg-type]
    make_feeder(**{**more, "lines": [TRUNK, coded]}, codes=[TWO])
