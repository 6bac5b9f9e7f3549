"""Reclosers from a table become measuring points on the lines where they stand."""

from dataclasses import replace

import numpy as np
import pytest
from oracles.trees import SOURCE, line, random_tree

from openphase.model import load_feeder
from openphase.model.errors import InputError
from openphase.model.parts import Feeder, Point, Switch
from openphase.studies.own.reclosers import read_points, with_points

FEEDER = Feeder(
    name="own",
    source=SOURCE,
    lines=(
        line("L1", "B0", "B1"),
        line("L2", "B2", "B1"),
        line("side", "B1", "C"),
        line("tap", "B2", "T", phases="c"),
        line("last", "R", "E"),
    ),
    transformers=(),
    loads=(),
    switches=(
        Switch(name="rec7", from_bus="B2", to_bus="R", closed=True),
        Switch(name="tie", from_bus="E", to_bus="Far", closed=False),
    ),
    points=(),
    sections=(),
)


def table(tmp_path, text):
    path = tmp_path / "points.csv"
    path.write_text(text, encoding="utf-8")
    return path


def placed(tmp_path, *rows, feeder=FEEDER):
    text = "\n".join(["name,bus,line,voltage_side", *rows])
    return with_points(feeder, read_points(table(tmp_path, text)))


def test_points_stand_on_the_only_way_on_or_where_they_are_told(tmp_path):
    feeder, match = placed(
        tmp_path, "head,b0,,", "mid,B1,LINE.l2,bus", "rec,B2.1.2.3,rec7,", "end,E,,"
    )
    assert feeder.points == (
        Point(name="head", bus="B0", line="L1"),
        Point(name="mid", bus="B1", line="L2", voltage_side="bus"),
        Point(name="rec", bus="R", line="last"),
        Point(name="end", bus="E", line="last"),
    )
    pairs = [(s.local, s.remote) for s in feeder.sections]
    assert pairs == [("head", "mid"), ("mid", "rec"), ("rec", "end")]
    assert match.not_joined == ()
    assert match.joined == ("head", "mid", "rec", "end")


@pytest.mark.parametrize(
    ("row", "why"),
    [
        ("p,B1,,", "several lines leave B1: the column line must name one of L2, side"),
        ("p,B9,,", "no bus is called 'B9'"),
        ("p,B2,tap,", "has phases c only"),
        ("p,B0,side,", "line side does not end at B0"),
        ("p,B0,rec7,", "rec7 does not end at B0"),
        ("p,B1,nothing,", "no line is called 'nothing'"),
        ("p,T,,", "no three-phase line ends at T"),
        ("p,Far,,", "no bus is called 'Far'"),
    ],
)
def test_what_cannot_stand_says_why(tmp_path, row, why):
    feeder, match = placed(tmp_path, row)
    assert feeder.points == ()
    assert match.not_joined[0][0] == "p"
    assert why in match.not_joined[0][1]


@pytest.mark.parametrize("row", ["p,B1,,", "p,B1,L2,", "p,b1,fuse,"])
def test_a_switch_between_bus_and_line_does_not_count(tmp_path, row):
    lines = (line("L1", "B0", "B1"), line("L2", "B1_fuse", "B2"))
    fuse = Switch(name="fuse", from_bus="B1", to_bus="B1_fuse", closed=True)
    feeder = replace(FEEDER, lines=lines, switches=(fuse,))
    told, _ = placed(tmp_path, row, feeder=feeder)
    assert told.points == (Point(name="p", bus="B1_fuse", line="L2"),)


def test_two_points_at_one_place_are_one(tmp_path):
    feeder, match = placed(tmp_path, "one,B0,,", "two,B0,L1,")
    assert [point.name for point in feeder.points] == ["one"]
    assert "one stands at the same place" in match.not_joined[0][1]
    assert any("without a neighbour: one" in note for note in match.notes)


def test_they_take_the_place_of_the_feeders_own(tmp_path):
    paper = load_feeder("paper")
    feeder, match = placed(tmp_path, "A,SUB,R1-R2,", "B,R3,r3-r4,", feeder=paper)
    assert [(s.local, s.remote) for s in feeder.sections] == [("A", "B")]
    assert any("take the place" in note for note in match.notes)


@pytest.mark.parametrize("seed", range(10))
def test_the_points_of_a_feeder_come_back_from_their_table(tmp_path, seed):
    feeder, _ = random_tree(np.random.default_rng(seed), 20, 6)
    rows = [f"{p.name},{p.bus},{p.line},{p.voltage_side}" for p in feeder.points]
    again, match = placed(tmp_path, *rows, feeder=replace(feeder, points=()))
    assert again.points == feeder.points
    assert len(match.joined) == len(feeder.points)


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("name\nA\n", ["column 'bus' must be there"]),
        ("name,bus\nA,\nA,B0\na:b,B0\n", ["'bus'", "must be there once", "without ':'"]),
        ("name,bus,voltage_side\nA,B0,up\n", ["must be line or bus"]),
    ],
)
def test_faults_of_the_file_are_told(tmp_path, text, faults):
    with pytest.raises(InputError) as raised:
        with_points(FEEDER, read_points(table(tmp_path, text)))
    for fault in faults:
        assert fault in str(raised.value)


def test_a_series_reactor_carries_no_point(tmp_path):
    lines = tuple(
        replace(own, name="reactor.choke") if own.name == "L2" else own for own in FEEDER.lines
    )
    feeder = replace(FEEDER, lines=lines, imported_from="own.dss")
    _, match = placed(tmp_path, "on,B1,reactor.choke,", "way,B2,,", feeder=feeder)
    assert dict(match.not_joined) == {
        "on": "reactor.choke is a series reactor; a point stands on a line"
    }
    # the only line that is none leads on behind the recloser
    assert match.joined == ("way",)
    (point,) = placed(tmp_path, "way,B2,,", feeder=feeder)[0].points
    assert (point.bus, point.line) == ("R", "last")
