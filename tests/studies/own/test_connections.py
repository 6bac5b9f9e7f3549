"""Connections from a table: every row is joined or told why not."""

from dataclasses import replace

import pytest
from oracles.trees import SOURCE, line, plain_load

from openphase.model.buses import bus_volts
from openphase.model.errors import InputError
from openphase.model.parts import Capacitor, Feeder, InlineTransformer, Place, Transformer
from openphase.studies.own.connections import read_connections, with_transformers
from openphase.studies.own.match import match_json, match_text


def unit(name, to_bus, connection="D/Yg", **more):
    own = {
        "name": name,
        "from_bus": "B1",
        "to_bus": to_bus,
        "connection": connection,
        "rating_kva": 500.0,
        "kv_from": 12.0,
        "kv_to": 0.48,
        "leakage_pu": 0.01 + 0.05j,
        "magnetizing_pu": 0.001 - 0.02j,
    }
    return InlineTransformer(**(own | more))


def delta(name, bus, **more):
    own = plain_load(name, Place(bus=bus))
    return replace(own, connection="delta", **more)


FEEDER = Feeder(
    name="own",
    source=SOURCE,
    lines=(line("L1", "B0", "B1"), line("service", "N", "N2", km=0.05)),
    transformers=(
        Transformer(
            name="hung",
            place=Place(bus="B1"),
            connection="Yg/Yg",
            rating_kva=100.0,
            leakage_pu=0.06j,
            x0_pu=1.0,
        ),
    ),
    loads=(
        plain_load("a", Place(bus="X"), kw=80.0, pf=0.8),
        delta("b", "X", branch_kv=0.48, kw=50.0, kvar=-20.0, exponent=1.0, exponent_q=2.0),
        plain_load("c", Place(bus="N2")),
        replace(plain_load("one", Place(bus="S")), phases="b"),
    ),
    switches=(),
    points=(),
    sections=(),
    capacitors=(Capacitor(name="bank", place=Place(bus="K"), connection="wye", kvar=50.0),),
    inline_transformers=(
        unit("Mill", "X"),
        unit("network", "N"),
        unit("uneven", "S"),
        unit("banked", "K"),
        unit("pole", "P", "single", phases="a", to_phases="a"),
    ),
)


def table(tmp_path, text):
    path = tmp_path / "units.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_names_match_whatever_their_case_and_prefix(tmp_path):
    text = "unit,connection\nMILL,Yg/D\ntransformer.network,Dyn11\nhung,Δ/Yg\nnone such,D/D\n"
    feeder, match = with_transformers(FEEDER, read_connections(table(tmp_path, text)))
    units = {own.name: own for own in feeder.inline_transformers}
    assert units["Mill"].connection == "Yg/D"
    assert (units["network"].connection, units["network"].shift) == ("D/Yg", "lead")
    assert feeder.transformers[0].connection == "D/Yg"
    assert feeder.transformers[0].x0_pu is None
    assert match.joined == ("Mill", "network", "hung")
    assert [row for row, _ in match.not_joined] == ["none such"]
    assert match.without_row == ("uneven", "banked", "pole")
    assert "3 of 4 rows joined" in match_text(match)[0]
    assert match_json(match)["not_joined"][0]["row"] == "none such"


def test_an_unknown_unit_hangs_on_the_feeder_and_its_loads_take_what_they_took(tmp_path):
    feeder, match = with_transformers(
        FEEDER, read_connections(table(tmp_path, "unit,connection\nmill,unknown\n"))
    )
    assert match.joined == ("Mill",)
    hung = feeder.transformers[-1]
    assert (hung.name, hung.connection, hung.place) == ("Mill", "unknown", Place(bus="B1"))
    assert (hung.rating_kva, hung.leakage_pu) == (500.0, 0.01 + 0.05j)
    assert hung.xm_pu == pytest.approx(50.0)
    assert "Mill" not in [own.name for own in feeder.inline_transformers]
    first, second = feeder.loads[:2]
    assert {first.transformer, second.transformer} == {"Mill"}
    assert (first.kw, first.power_factor) == (80.0, pytest.approx(0.8))
    assert second.kw == 50.0
    # leading, as its kvar said
    assert second.power_factor == pytest.approx(-50.0 / (50.0**2 + 20.0**2) ** 0.5)
    assert feeder.loads[2:] == FEEDER.loads[2:]


def test_a_load_rated_at_another_voltage_keeps_its_power_at_the_nominal_one(tmp_path):
    own = delta("b", "X", branch_kv=0.44, kw=50.0, kvar=20.0, exponent=1.0, exponent_q=2.0)
    feeder = replace(FEEDER, loads=(own,))
    v = bus_volts(feeder)["X"] * 3.0**0.5 / 440.0
    hung, _ = with_transformers(
        feeder, read_connections(table(tmp_path, "unit,connection\nmill,unknown\n"))
    )
    load = hung.loads[0]
    assert load.kw == pytest.approx(50.0 * v)
    reactive = load.kw * (1.0 / load.power_factor**2 - 1.0) ** 0.5
    assert reactive == pytest.approx(20.0 * v**2)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("network", "a network lies behind it"),
        ("uneven", "has not three phases"),
        ("banked", "more than loads"),
        ("pole", "single-phase"),
    ],
)
def test_what_cannot_be_unknown_stays_and_says_why(tmp_path, name, why):
    feeder, match = with_transformers(
        FEEDER, read_connections(table(tmp_path, f"unit,connection\n{name},unknown\n"))
    )
    assert feeder == FEEDER
    assert match.joined == ()
    assert why in match.not_joined[0][1]


def test_ratings_are_taken_and_neutral_ohms_go_with_the_neutral(tmp_path):
    earthed = unit("Mill", "X", "Yg/Yg", from_neutral_ohm=5.0 + 0j, to_neutral_ohm=0.1 + 0j)
    feeder = replace(FEEDER, inline_transformers=(earthed,))
    text = "unit,connection,rating_kva,owner\nmill,D/Yg,750,us\n"
    told, match = with_transformers(feeder, read_connections(table(tmp_path, text)))
    own = told.inline_transformers[0]
    assert own.rating_kva == 750.0
    assert (own.from_neutral_ohm, own.to_neutral_ohm) == (0j, 0.1 + 0j)
    assert own.leakage_pu == earthed.leakage_pu
    assert match.notes == ("columns without meaning here: owner",)


def test_a_unit_is_told_once(tmp_path):
    text = "unit,connection\nmill,Yg/D\nMill,D/D\n"
    feeder, match = with_transformers(FEEDER, read_connections(table(tmp_path, text)))
    assert feeder.inline_transformers[0].connection == "Yg/D"
    assert match.not_joined == (("Mill", "an earlier row speaks of that unit"),)


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("", ["must begin with a line that names the columns"]),
        ("unit\nmill\n", ["column 'connection' must be there"]),
        ("unit;connection\nmill;D/D\n", ["separated by commas"]),
        (
            "unit,connection,rating_kva\nmill,Dzn1,x\n,D/D,0\n",
            ["'connection'", "'rating_kva'", "'unit'", "4 faults"],
        ),
        ("unit,connection\nmill\n", ["must have 2 cells"]),
        ("unit,unit\na,b\n", ["must be there once"]),
        ("unit,connection\n", ["must have rows"]),
        ('unit,connection\n"mill,D/D\n', ["is not valid CSV"]),
        ("unit,connection\nmill,Yd7\n", ["must be one of"]),
    ],
)
def test_faults_of_the_file_are_all_told_at_once(tmp_path, text, faults):
    with pytest.raises(InputError) as raised:
        with_transformers(FEEDER, read_connections(table(tmp_path, text)))
    for fault in faults:
        assert fault in str(raised.value)
