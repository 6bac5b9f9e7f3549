"""The shipped feeder of the paper has the values that its results are computed with."""

from __future__ import annotations

import cmath
import math

import pytest

from openphase.model import Switch, load_feeder


def test_the_papers_lines_have_the_stated_ohms() -> None:
    feeder = load_feeder("paper")
    total = {line.name: line.length_km * line.z1_ohm_per_km for line in feeder.lines}
    stated = {"R1-R2": 0.39, "R2-R3": 0.85, "R3-R4": 0.72, "R4-R5": 1.3}
    assert {name: abs(z) for name, z in total.items()} == pytest.approx(stated, rel=3e-16)
    for line in feeder.lines:
        assert math.degrees(cmath.phase(line.z1_ohm_per_km)) == pytest.approx(70.0, rel=1e-15)
        assert line.z0_ohm_per_km == line.z1_ohm_per_km
    assert [(line.from_bus, line.to_bus) for line in feeder.lines] == [
        ("SUB", "R2"),
        ("R2", "R3"),
        ("R3", "R4"),
        ("R4b", "SUB"),
    ]


def test_the_papers_transformers_and_loads() -> None:
    feeder = load_feeder("paper")
    units = {
        unit.name: (unit.place.line, unit.place.at, unit.connection, unit.x0_pu)
        for unit in feeder.transformers
    }
    assert units == {
        "T1": ("R1-R2", 0.5, "Yg/Yg", 1.0),
        "T2": ("R2-R3", 0.25, "D/Yg", None),
        "T3": ("R4-R5", 0.5, "Yg/Yg", 1.0),
        "T4": ("R2-R3", 0.9, "Yg/D", None),
        "T5": ("R3-R4", 0.5, "Yg/Yg", 1.0),
        "T6": ("R3-R4", 0.9, "Yg/Yg", 1.0),
    }
    leakages_ohm = [144.0 * unit.leakage_pu for unit in feeder.transformers]
    assert leakages_ohm == pytest.approx([cmath.rect(8.64, math.radians(88))] * 6, rel=1e-15)
    assert [(load.transformer, load.kw) for load in feeder.loads] == [
        ("T1", 600.0),
        ("T2", 500.0),
        ("T3", 800.0),
        ("T4", 100.0),
        ("T5", 200.0),
        ("T6", 200.0),
    ]
    assert {(load.power_factor, load.exponent) for load in feeder.loads} == {(1.0, 2.0)}


def test_the_papers_source_points_and_tie() -> None:
    feeder = load_feeder("paper")
    source = feeder.source
    assert (source.bus, source.kv_ll, source.emf_pu) == ("SUB", 12.0, 1.0)
    assert source.z1_ohm == source.z2_ohm == source.z0_ohm
    assert source.z1_ohm == pytest.approx(cmath.rect(0.9, math.radians(85)), rel=1e-15)
    assert feeder.switches == (Switch(name="R4", from_bus="R4", to_bus="R4b", closed=False),)
    assert {point.name: (point.bus, point.line) for point in feeder.points} == {
        "R1": ("SUB", "R1-R2"),
        "R2": ("R2", "R2-R3"),
        "R3": ("R3", "R3-R4"),
        "R4": ("R4", "R3-R4"),
        "R4b": ("R4b", "R4-R5"),
        "R5": ("SUB", "R4-R5"),
    }
    pairs = [(section.local, section.remote) for section in feeder.sections]
    assert pairs == [("R1", "R2"), ("R2", "R3"), ("R3", "R4"), ("R5", "R4b")]
