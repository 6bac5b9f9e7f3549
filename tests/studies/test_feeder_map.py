"""The picture of a feeder: what is there is drawn where it is, by coordinates or as a tree."""

from dataclasses import replace

import numpy as np
import pytest
from oracles.trees import SOURCE, line, plain_load, random_tree

from openphase.model import load_feeder
from openphase.model.parts import (
    Capacitor,
    Coordinates,
    Feeder,
    InlineTransformer,
    Place,
    Point,
    Regulator,
    Section,
    Switch,
)
from openphase.model.spread import spread_points
from openphase.model.zones import outwards
from openphase.studies.show import feeder_map, feeder_plot, figures
from openphase.studies.show.feeder_marks import along
from openphase.studies.show.feeder_places import has_coordinates, place_buses


def unit(name, start, end, phases="abc"):
    return InlineTransformer(
        name=name,
        from_bus=start,
        to_bus=end,
        connection="D/Yg" if phases == "abc" else "single",
        rating_kva=100.0,
        kv_from=12.0,
        kv_to=0.4,
        leakage_pu=0.05j,
        phases=phases,
        to_phases=phases,
    )


FEEDER = Feeder(
    name="all of it",
    source=SOURCE,
    lines=(
        line("L1", "B0", "B1"),
        line("L2", "B2", "B1r"),
        line("two", "B1", "C", phases="bc"),
        line("one", "C", "D", phases="b"),
        line("service", "LV", "house", km=0.03),
        line("far", "X", "Y"),
    ),
    transformers=(),
    loads=(plain_load("house", Place(bus="house")),),
    switches=(
        Switch(name="tie", from_bus="B2", to_bus="X", closed=False),
        Switch(name="fuse", from_bus="B2", to_bus="F", closed=True),
    ),
    points=(Point(name="P", bus="B0", line="L1"), Point(name="Q", bus="B2", line="L2")),
    sections=(Section(local="P", remote="Q"),),
    capacitors=(Capacitor(name="bank", place=Place(line="L1", at=0.25), connection="wye", kvar=1),),
    regulators=(
        Regulator(
            name="reg", from_bus="B1", to_bus="B1r", taps=(0, 0, 0), step_pct=0.6, most_taps=16
        ),
    ),
    inline_transformers=(unit("T", "B2", "LV"),),
)
SPOTS = {"B0": (0, 0), "B1": (4, 0), "B1r": (4, 1), "B2": (4, 5), "C": (8, 0), "F": (5, 5)}
MAP = replace(
    FEEDER, coordinates=tuple(Coordinates(bus=b, x=x, y=y) for b, (x, y) in SPOTS.items())
)


def labels(ax):
    return [own.get_text() for own in ax.get_figure().legends[0].get_texts()]


@pytest.mark.parametrize("feeder", [FEEDER, MAP])
def test_the_legend_names_all_that_is_drawn(feeder):
    ax = feeder_plot.plot_feeder(feeder)
    assert set(labels(ax)) == {
        "section P–Q",
        "three phases",
        "two phases",
        "one phase",
        "low voltage",
        "open switch",
        "closed switch",
        "source",
        "in-line transformer",
        "regulator",
        "capacitor",
        "measuring point",
    }
    written = {text.get_text() for text in ax.texts}
    assert {"P", "Q", "tie", "reg", "T", "bank"} <= written
    assert figures.png_of(feeder_plot.plot_feeder, feeder) == figures.png_of(
        feeder_plot.plot_feeder, feeder
    )


def test_buses_stand_at_their_coordinates_and_others_beside_their_neighbours():
    assert has_coordinates(MAP)
    places = place_buses(MAP)
    assert places.is_map
    assert {bus: places.at[bus] for bus in SPOTS} == SPOTS
    assert places.at["D"] == SPOTS["C"]
    assert places.at["house"] == places.at["LV"] == SPOTS["B2"]
    assert places.guessed == len(places.at) - len(SPOTS)
    few = replace(MAP, coordinates=MAP.coordinates[:2])
    assert not has_coordinates(few)
    assert not place_buses(few).is_map
    same = tuple(replace(own, x=1.0, y=1.0) for own in MAP.coordinates)
    assert not has_coordinates(replace(MAP, coordinates=same))


def test_in_a_tree_nothing_lies_on_anything_else():
    for seed in range(15):
        feeder, _ = random_tree(np.random.default_rng(seed), 60, 0)
        places = place_buses(feeder)
        tree = outwards(feeder)
        assert set(places.at) == set(tree)
        taken = {}
        for bus, step in tree.items():
            if step is None:
                continue
            near, edge = step
            x0, x1, y = places.at[near][0], *places.at[bus]
            assert x1 - x0 == pytest.approx(edge.length_km)
            way = places.way(near, bus)
            assert way[0] == places.at[near]
            assert way[-1] == (x1, y)
            assert way == places.way(bus, near)[::-1]
            for a, b in taken.setdefault(y, []):
                assert x1 <= a + 1e-9 or x0 >= b - 1e-9
            taken[y].append((x0, x1))


def test_what_only_an_open_switch_reaches_is_drawn_too():
    places = place_buses(FEEDER)
    assert {"X", "Y"} <= set(places.at)
    assert places.at["X"] != places.at["Y"]


def test_small_plain_feeders_keep_their_schematic():
    assert not feeder_plot.plot_feeder(load_feeder("paper")).get_figure().legends
    wide, _ = random_tree(np.random.default_rng(0), 150, 0)
    assert feeder_plot.plot_feeder(wide).get_figure().legends


def test_a_large_feeder_is_drawn_in_a_page():
    feeder, _ = random_tree(np.random.default_rng(2), 3000, 0)
    ax = feeder_map.plot_feeder_map(spread_points(feeder).feeder)
    assert ax.get_figure().get_size_inches()[1] <= feeder_map.MOST
    assert len(ax.texts) < 50


def test_along_a_way():
    way = [(0.0, 0.0), (0.0, 1.0), (0.0, 1.0), (3.0, 1.0)]
    assert along(way, 0.0) == (0.0, 0.0)
    assert along(way, 1.0) == (3.0, 1.0)
    assert along([(2.0, 2.0), (2.0, 2.0)], 0.5) == (2.0, 2.0)
