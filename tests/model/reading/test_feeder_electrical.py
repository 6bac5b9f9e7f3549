"""What parts must be together: refused exactly where the solver would have no answer.

The messages stand in ``tests/malformed/feeder``.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from openphase.model import (
    Capacitor,
    Der,
    Feeder,
    InputError,
    Line,
    Load,
    Place,
    Regulator,
    Source,
    Transformer,
    make_feeder,
)
from openphase.model.network import compile_network
from openphase.model.parts import Connection
from openphase.model.solve import solve, steady_state

SOURCE = Source(bus="S", kv_ll=12.0, emf_pu=1.0, z1_ohm=1j, z2_ohm=1j, z0_ohm=1j, frequency_hz=50.0)
LINE = Line(
    name="A",
    from_bus="S",
    to_bus="B",
    length_km=2.0,
    z1_ohm_per_km=0.2 + 0.4j,
    z0_ohm_per_km=0.5 + 1.2j,
)
END = Place(bus="B")


def unit(connection: Connection, **more: Any) -> Transformer:
    values: dict[str, Any] = {
        "name": "T",
        "place": END,
        "connection": connection,
        "rating_kva": 500.0,
        "leakage_pu": 0.01 + 0.05j,
        "x0_pu": None,
    }
    return Transformer(**values | more)


def load(**more: Any) -> Load:
    values: dict[str, Any] = {
        "name": "L",
        "transformer": None,
        "place": END,
        "connection": "delta",
        "kw": 200.0,
        "power_factor": 1.0,
        "exponent": 2.0,
    }
    return Load(**values | more)


def der(**more: Any) -> Der:
    values: dict[str, Any] = {
        "name": "PV",
        "transformer": None,
        "place": END,
        "kw": 100.0,
        "power_factor": 1.0,
        "model": "constant_power",
        "z1_ohm": None,
        "z2_ohm": None,
        "z0_ohm": None,
    }
    return Der(**values | more)


BEHIND = load(transformer="T", place=None, connection="wye")
BANK = Capacitor(name="C", place=END, connection="wye", kvar=300.0)
REGULATOR = Regulator(
    name="V", from_bus="B", to_bus="C", taps=(2, 2, 2), step_pct=0.625, most_taps=16
)
CHARGED = replace(LINE, c1_nf_per_km=10.0, c0_nf_per_km=5.0)

EARTHED: dict[str, dict[str, Any]] = {
    "charging": {"lines": [CHARGED]},
    "wye load": {"loads": [load(connection="wye")]},
    "wye bank": {"capacitors": [BANK]},
    "DER with z0": {"ders": [der(z0_ohm=30j)]},
    "Yg/D": {"transformers": [unit("Yg/D")]},
    "Yg/Yg with load": {"transformers": [unit("Yg/Yg")], "loads": [BEHIND]},
    "Yg/Yg with core": {"transformers": [unit("Yg/Yg", x0_pu=1.0)]},
    "Yg/Yg with magnetizing": {"transformers": [unit("Yg/Yg", xm_pu=50.0)]},
}
FLOATING: dict[str, dict[str, Any]] = {
    "nothing": {},
    "charging between phases": {"lines": [replace(LINE, c1_nf_per_km=10.0)]},
    "delta load": {"loads": [load()]},
    "load of no power": {"loads": [load(connection="wye", kw=0.0)]},
    "motor": {"loads": [load(connection="wye", motor_share=1.0)]},
    "delta bank": {"capacitors": [replace(BANK, connection="delta")]},
    "DER without z0": {"ders": [der(z2_ohm=30j)]},
    "Yg/Yg without load": {"transformers": [unit("Yg/Yg")]},
    "D/Yg": {"transformers": [unit("D/Yg", xm_pu=50.0)], "loads": [BEHIND]},
    "Y/D": {"transformers": [unit("Y/D", xm_pu=50.0)], "loads": [BEHIND]},
    "D/D": {"transformers": [unit("D/D")], "loads": [BEHIND]},
    "regulator": {"regulators": [REGULATOR]},
}


def parts(more: dict[str, Any], source: Source = SOURCE) -> dict[str, Any]:
    return {"name": "f", "source": source, "lines": [LINE], **more}


def unchecked(more: dict[str, Any], source: Source) -> Feeder:
    """Return the feeder as no door would let it in."""
    kept = {"transformers": (), "loads": (), "switches": (), "points": (), "sections": ()} | {
        key: tuple(value) if isinstance(value, list) else value
        for key, value in parts(more, source).items()
    }
    return Feeder(**kept)


def is_defined(feeder: Feeder) -> bool:
    network = compile_network(feeder)
    return not solve(network, steady_state(network)).flags.any()


@pytest.mark.parametrize("name", EARTHED)
def test_an_isolated_feeder_that_is_tied_to_earth(name: str) -> None:
    isolated = replace(SOURCE, neutral="isolated")
    assert make_feeder(**parts(EARTHED[name], isolated)).source.neutral == "isolated"
    assert is_defined(unchecked(EARTHED[name], isolated))


@pytest.mark.parametrize("name", FLOATING)
def test_an_isolated_feeder_whose_voltage_to_earth_is_undefined(name: str) -> None:
    isolated = replace(SOURCE, neutral="isolated")
    with pytest.raises(InputError, match="source: neutral must not be isolated where nothing"):
        make_feeder(**parts(FLOATING[name], isolated))
    assert not is_defined(unchecked(FLOATING[name], isolated))
    make_feeder(**parts(FLOATING[name]))


def test_an_unknown_connection_is_no_tie_to_earth() -> None:
    isolated = replace(SOURCE, neutral="isolated")
    with pytest.raises(InputError, match="must not be isolated"):
        make_feeder(**parts({"transformers": [unit("unknown", x0_pu=1.0)]}, isolated))


THREE_WIRES: dict[str, dict[str, Any]] = {
    **{f"{c} unit": {"transformers": [unit(c)]} for c in ("D/Yg", "Y/D", "D/D", "unknown")},
    "wye load behind a unit": {"transformers": [unit("D/Yg")], "loads": [BEHIND]},
    "z0 behind a unit": {
        "transformers": [unit("D/Yg")],
        "ders": [der(transformer="T", place=None, z0_ohm=30j)],
    },
    "delta load and bank": {
        "loads": [load()],
        "capacitors": [replace(BANK, connection="delta")],
    },
    "charging": {"lines": [CHARGED]},
}
FOUR_WIRES = {
    **{name: more for name, more in EARTHED.items() if name != "charging"},
    "regulator": {"regulators": [REGULATOR]},
}


@pytest.mark.parametrize("name", THREE_WIRES)
def test_what_needs_no_neutral_may_stand_on_three_wires(name: str) -> None:
    make_feeder(**parts(THREE_WIRES[name], replace(SOURCE, wires=3)))


@pytest.mark.parametrize("name", FOUR_WIRES)
def test_what_needs_a_neutral_may_not(name: str) -> None:
    make_feeder(**parts(FOUR_WIRES[name]))
    with pytest.raises(InputError, match=r"on a feeder of three wires \(source: wires = 3\)"):
        make_feeder(**parts(FOUR_WIRES[name], replace(SOURCE, wires=3)))


@pytest.mark.parametrize(
    ("part", "accepted"),
    [
        (unit("Yg/Yg", leakage_pu=0j), True),
        (unit("D/Yg", leakage_pu=0j), True),
        (unit("Yg/D", leakage_pu=0j), False),
        (unit("Y/D", leakage_pu=0j), False),
        (unit("D/D", leakage_pu=0j), False),
        (unit("unknown", leakage_pu=0j), False),
        (unit("unknown", x0_pu=1.0), True),
        (unit("D/D", x0_pu=1.0), False),
    ],
)
def test_units(part: Transformer, accepted: bool) -> None:
    if accepted:
        make_feeder(**parts({"transformers": [part]}))
    else:
        with pytest.raises(InputError, match=r"must (not be 0|be left out) for"):
            make_feeder(**parts({"transformers": [part]}))


@pytest.mark.parametrize("tap", [-16, 0, 16])
def test_taps_reach_as_far_as_they_go(tap: int) -> None:
    regulator = replace(REGULATOR, taps=(tap, 0, 0))
    assert make_feeder(**parts({"regulators": [regulator]})).regulators == (regulator,)
    with pytest.raises(InputError, match="taps must be -5 to 5"):
        make_feeder(**parts({"regulators": [replace(regulator, taps=(6, tap, 0), most_taps=5)]}))


def test_a_faulty_value_says_nothing_beside_others() -> None:
    source = replace(SOURCE, neutral="earthed", neutral_ohm=3 + 0j)  # type: ignore[arg-type]
    with pytest.raises(InputError) as caught:
        make_feeder(**parts({}, source))
    assert len(caught.value.faults) == 1
    assert "got 'earthed': a grounded neutral, written solid" in str(caught.value)
