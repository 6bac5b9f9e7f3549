"""Buses that nothing but capacitance holds to earth, seen in the feeder's parts alone."""

from __future__ import annotations

from dataclasses import replace

from openphase.model.importers.dss_names import Names, clean
from openphase.model.importers.unearthed import unearthed_buses
from openphase.model.parts import Feeder, InlineTransformer, Line, Load, Place, Source

SOURCE = Source(
    bus="S", kv_ll=12.47, emf_pu=1.0, z1_ohm=1j, z2_ohm=1j, z0_ohm=1j, frequency_hz=60.0
)
UNIT = InlineTransformer(
    name="T",
    from_bus="S",
    to_bus="B",
    connection="D/D",
    rating_kva=500.0,
    kv_from=12.47,
    kv_to=4.16,
    leakage_pu=0.05j,
)
LINE = Line(name="L", from_bus="B", to_bus="C", length_km=1.0, z1_ohm_per_km=1j, z0_ohm_per_km=3j)
LOAD = Load(
    name="W",
    transformer=None,
    place=Place(bus="C"),
    connection="wye",
    kw=1.0,
    power_factor=1.0,
    exponent=2.0,
)
FEEDER = Feeder(
    name="small",
    source=SOURCE,
    lines=(LINE,),
    transformers=(),
    loads=(),
    switches=(),
    points=(),
    sections=(),
    inline_transformers=(UNIT,),
)


def test_what_lies_behind_a_delta_floats() -> None:
    assert unearthed_buses(FEEDER) == {"B", "C"}


def test_an_earthed_star_or_a_load_to_earth_holds_it() -> None:
    for connection, floats in (("D/Yg", False), ("D/Y", True), ("Yg/D", True)):
        unit = replace(UNIT, connection=connection)
        found = unearthed_buses(replace(FEEDER, inline_transformers=(unit,)))
        assert bool(found) == floats, connection
    assert not unearthed_buses(replace(FEEDER, loads=(LOAD,)))
    assert unearthed_buses(replace(FEEDER, loads=(replace(LOAD, connection="delta"),)))


def test_a_source_without_a_neutral_holds_nothing() -> None:
    source = replace(SOURCE, neutral="isolated")
    assert unearthed_buses(replace(FEEDER, source=source)) == {"S", "B", "C"}


def test_names_are_given_once_and_hold_what_a_feeder_can() -> None:
    names = Names()
    assert [names.of("a:b"), names.of("a_b"), names.of("a:b")] == ["a_b", "a_b-2", "a_b"]
    assert clean("x.p") == "x_p"
    assert clean("  ") == "_"
    assert names.changed == {"a:b": "a_b", "a_b": "a_b-2"}
