"""Where a neutral goes with the lines."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import pytest

from openphase.model import load_feeder
from openphase.model.network import CONNECTIONS, compile_network
from openphase.model.neutrals import bus_earthings, bus_neutrals, wires_at_unknown
from openphase.model.parts import InlineConnection, InlineTransformer, Place

EARTHED = {"Yg/Yg", "Y/Yg", "D/Yg"}


def unit(connection: InlineConnection, phases: str = "abc", to: str = "abc") -> InlineTransformer:
    return InlineTransformer(
        name="T",
        from_bus="SUB",
        to_bus="beyond",
        connection=connection,
        rating_kva=500.0,
        kv_from=12.0,
        kv_to=4.16,
        leakage_pu=0.01 + 0.05j,
        phases=phases,
        to_phases=to,
    )


@pytest.mark.parametrize("connection", [c for c in get_args(InlineConnection) if "/" in c])
@pytest.mark.parametrize("wires", [3, 4])
def test_a_winding_makes_the_neutral_behind_it(connection: InlineConnection, wires: int) -> None:
    paper = load_feeder("paper")
    source = replace(paper.source, wires=wires)
    own = replace(unit(connection), from_bus=source.bus)
    found = bus_neutrals(replace(paper, source=source, inline_transformers=(own,)))
    assert found.pop("beyond") == (connection in EARTHED)
    assert set(found.values()) == {wires == 4}


@pytest.mark.parametrize(
    ("connection", "to", "neutral"),
    [("single", "a", True), ("single", "ab", False), ("centre-tap", "ab", True)],
)
def test_a_single_winding_has_one_where_it_lies_to_earth(
    connection: InlineConnection, to: str, neutral: bool
) -> None:
    paper = load_feeder("paper")
    own = replace(unit(connection, "a", to), from_bus=paper.source.bus)
    assert bus_neutrals(replace(paper, inline_transformers=(own,)))["beyond"] == neutral


@pytest.mark.parametrize(("connection", "wires"), [("D/D", 3), ("Yg/Yg", 4)])
def test_a_unit_behind_a_delta_is_never_taken_as_a_grounded_wye(
    connection: InlineConnection, wires: int
) -> None:
    paper = load_feeder("paper")
    own = replace(unit(connection), from_bus=paper.source.bus)
    hung = replace(paper.transformers[0], place=Place(bus="beyond"), connection="unknown")
    feeder = replace(
        paper, inline_transformers=(own,), transformers=(hung, *paper.transformers[1:])
    )
    assert wires_at_unknown(paper) == paper.source.wires == 4
    assert wires_at_unknown(feeder) == wires
    network = compile_network(feeder)
    assumed = {3: "D/Yg", 4: "Yg/Yg"}[wires]
    assert network.connection[network.units.index(hung.name)] == CONNECTIONS[assumed]


@pytest.mark.parametrize("ohm", [0j, 2 + 0j])
@pytest.mark.parametrize("connection", [c for c in get_args(InlineConnection) if "/" in c])
def test_what_feeds_a_bus_says_how_it_is_earthed(
    connection: InlineConnection, ohm: complex
) -> None:
    paper = load_feeder("paper")
    source = replace(paper.source, neutral="petersen", neutral_ohm=40j)
    own = replace(unit(connection), from_bus=source.bus, to_neutral_ohm=ohm)
    found = bus_earthings(replace(paper, source=source, inline_transformers=(own,)))
    earthed = "impedance" if ohm else "solid"
    assert found.pop("beyond") == (earthed if connection in EARTHED else "isolated")
    assert set(found.values()) == {"petersen"}
