"""What the parts of a feeder must be together, and its graph."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest

from openphase.model import (
    Feeder,
    InputError,
    Line,
    Load,
    Place,
    Point,
    Section,
    Source,
    Switch,
    Transformer,
    load_feeder,
    make_feeder,
)
from openphase.model.feeder import buses
from openphase.model.topology import edges, forest, shortest_path, tree_path

SOURCE = Source(bus="S", kv_ll=12.0, emf_pu=1.0, z1_ohm=0j, z2_ohm=0j, z0_ohm=0j, frequency_hz=50.0)


def line(name: str, from_bus: str, to_bus: str, length_km: float = 1.0) -> Line:
    return Line(
        name=name,
        from_bus=from_bus,
        to_bus=to_bus,
        length_km=length_km,
        z1_ohm_per_km=0.1 + 0.3j,
        z0_ohm_per_km=0.3 + 0.9j,
    )


def switch(name: str, from_bus: str, to_bus: str, *, closed: bool = False) -> Switch:
    return Switch(name=name, from_bus=from_bus, to_bus=to_bus, closed=closed)


TREE = (line("1", "S", "A"), line("2", "A", "B"), line("3", "A", "C"), line("4", "D", "S"))
TIE = switch("tie", "B", "D")
POINTS = (
    Point(name="s1", bus="S", line="1"),
    Point(name="s4", bus="S", line="4"),
    Point(name="a1", bus="A", line="1"),
    Point(name="a2", bus="A", line="2"),
    Point(name="b2", bus="B", line="2"),
    Point(name="d4", bus="D", line="4"),
)


def feeder(
    *,
    name: str = "f",
    source: Source = SOURCE,
    lines: tuple[Line, ...] = TREE,
    transformers: tuple[Transformer, ...] = (),
    loads: tuple[Load, ...] = (),
    switches: tuple[Switch, ...] = (),
    sections: tuple[tuple[str, str], ...] = (),
) -> Feeder:
    return make_feeder(
        name=name,
        source=source,
        lines=lines,
        transformers=transformers,
        loads=loads,
        switches=switches,
        points=POINTS if sections else (),
        sections=[Section(local=local, remote=remote) for local, remote in sections],
    )


def unit(name: str, place: Place) -> Transformer:
    return Transformer(
        name=name, place=place, connection="D/Yg", rating_kva=9.0, leakage_pu=0j, x0_pu=None
    )


def load(name: str, transformer: str | None = None, place: Place | None = None) -> Load:
    return Load(
        name=name,
        transformer=transformer,
        place=place,
        connection="wye",
        kw=1.0,
        power_factor=1.0,
        exponent=2.0,
    )


def message(error: pytest.ExceptionInfo[InputError]) -> list[str]:
    return str(error.value).splitlines()


def test_parts_of_a_program_are_checked_like_those_of_a_file() -> None:
    with pytest.raises(InputError) as caught:
        feeder(source=replace(SOURCE, kv_ll=float("nan")), lines=(line("1", "S", "A", -5.0),))
    assert message(caught) == [
        "f: source: kv_ll must be a finite number, kV, > 0, <= 1000, got nan",
        "f: lines '1': length_km must be > 0, got -5.0",
        "2 faults",
    ]


def test_whole_numbers_become_floats_as_in_a_file() -> None:
    built = feeder(lines=(line("1", "S", "A", 5),))
    assert type(built.lines[0].length_km) is float


def test_buses_come_depth_first_from_the_source() -> None:
    assert buses(feeder(switches=(TIE,))) == ("S", "A", "B", "C", "D")
    assert buses(load_feeder("paper")) == ("SUB", "R2", "R3", "R4", "R4b")


def test_a_long_feeder_needs_no_recursion() -> None:
    names = ["S", *(f"b{i}" for i in range(3000))]
    chain = tuple(line(f"l{end}", start, end) for start, end in pairwise(names))
    assert buses(feeder(lines=chain)) == tuple(names)


def test_paths_in_the_tree() -> None:
    built = feeder(switches=(TIE, switch("link", "C", "E", closed=True)))
    tree = forest(edges(built), ["S"])[0]
    passed, taken = tree_path(tree, "E", "B")
    assert passed == ["E", "C", "A", "B"]
    assert [edge.name for edge in taken] == ["link", "3", "2"]
    assert tree_path(tree, "A", "A") == (["A"], [])
    assert tree_path(tree, "D", "A")[0] == ["D", "S", "A"]


@pytest.mark.parametrize(
    ("extra", "messages"),
    [
        (
            {"lines": (*TREE, line("2", "C", "E"))},
            ["f: lines '2': name must be unique among the lines, got '2'"],
        ),
        (
            {"lines": (*TREE, line("x.p", "C", "E"))},
            [
                "f: lines 'x.p': name must not end in '.p' or '.q',"
                " which mark the stubs of a broken line, got 'x.p'"
            ],
        ),
        (
            {"lines": (*TREE, line("5", "C", "1.q"))},
            [
                "f: lines '5': to must not end in '.p' or '.q',"
                " which mark the stubs of a broken line, got '1.q'"
            ],
        ),
        (
            {"lines": (*TREE, line("a:b", "C", "E"))},
            ["f: lines 'a:b': name must be a name without ':' or control characters, got 'a:b'"],
        ),
        ({"name": ".."}, ["..: name must do as the name of a folder, got '..'"]),
        (
            {"source": replace(SOURCE, bus="SS")},
            ["f: source: bus must be a bus of the feeder (did you mean 'S'?), got 'SS'"],
        ),
        ({"lines": ()}, ["f: source: bus must be a bus of the feeder, got 'S'"]),
        (
            {"lines": (*TREE, line("5", "E", "E"))},
            ["f: lines '5': to must be another bus than from, got 'E'"],
        ),
        (
            {"transformers": (unit("T", Place(line="9", at=0.5)),), "loads": (load("L", "T2"),)},
            [
                "f: transformers 'T': line must be a line of the feeder, got '9'",
                "f: loads 'L': transformer must be a transformer of the feeder"
                " (did you mean 'T'?), got 'T2'",
                "2 faults",
            ],
        ),
        (
            {"transformers": (unit("T", Place(line="1", at=1.5)),)},
            ["f: transformers 'T': at must be 0 to 1, got 1.5"],
        ),
        (
            {"transformers": (unit("T", Place(bus="A", line="1", at=0.5)),)},
            [
                "f: transformers 'T' must say where it hangs, by bus or line and at,"
                " got bus and line and at"
            ],
        ),
        (
            {"loads": (load("L", None, Place(bus="Z")), load("M"))},
            [
                "f: loads 'M' must say where it hangs, by transformer or bus or line and at,"
                " got none",
                "f: loads 'L': bus must be a bus of the feeder, got 'Z'",
                "2 faults",
            ],
        ),
        (
            {"lines": (*TREE, line("5", "E", "F"), line("6", "F", "G"))},
            [
                "f: lines '5': from must be connected with 'S' while ties are open,"
                " got 'E', 'F', 'G'"
            ],
        ),
        (
            {"switches": (switch("tie", "B", "E"),)},
            ["f: switches 'tie': to must be connected with 'S' while ties are open, got 'E'"],
        ),
        (
            {"switches": (switch("1", "B", "D", closed=True), switch("2", "D", "B", closed=True))},
            ["f: switches '2' must not close a loop without impedance, here with '1'"],
        ),
        (
            {"sections": (("s1", "s1"), ("s1", "a2"), ("a2", "s1"))},
            [
                "f: sections #1: remote must be another point than local, got 's1'",
                "f: sections #3 must be there once, in one direction;"
                " both terminals are judged anyway, got 'a2', 's1' again",
                "2 faults",
            ],
        ),
        ({"sections": (("a1", "a2"),)}, ["f: sections #1 must have a line between its points"]),
        (
            {"sections": (("s4", "a1"), ("d4", "b2"))},
            [
                "f: sections #1 must not have the source between its points",
                "f: sections #2 must not have the source between its points",
                "2 faults",
            ],
        ),
    ],
)
def test_faults_between_parts(extra: dict[str, object], messages: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        feeder(**extra)  # type: ignore[arg-type]
    assert message(caught) == messages


def test_a_name_twice_in_different_tables_is_fine() -> None:
    assert feeder(switches=(switch("1", "C", "A2", closed=True),)).switches[0].name == "1"


def test_sections_that_are_fine() -> None:
    pairs = (("s1", "a1"), ("s1", "a2"), ("a2", "b2"), ("d4", "s4"), ("a1", "b2"))
    assert len(feeder(sections=pairs, switches=(TIE,)).sections) == 5


@pytest.mark.parametrize(
    "extra",
    [
        {"lines": (*TREE, line("5", "B", "C"))},
        {"lines": (*TREE, line("5", "S", "A"))},
        {"switches": (replace(TIE, closed=True),)},
        {"switches": (TIE, switch("other", "C", "D"), switch("third", "B", "C", closed=True))},
    ],
)
def test_loops_and_ties_are_as_many_as_there_are(extra: dict[str, object]) -> None:
    assert set(buses(feeder(**extra))) == set("SABCD")  # type: ignore[arg-type]


def test_the_shortest_path_has_the_fewest_edges() -> None:
    built = feeder(lines=(*TREE, line("5", "B", "D"), line("6", "S", "A")), switches=(TIE,))
    graph = edges(built)
    passed, taken = shortest_path(graph, "C", "D")
    assert len(taken) == 3
    assert passed == ["C", "A", *passed[2:3], "D"]
    assert [edge.name for edge in shortest_path(graph, "S", "A")[1]] == ["1"]
    assert [edge.name for edge in shortest_path(graph, "S", "A", {"6"})[1]] == ["6"]
    assert [edge.name for edge in shortest_path(graph, "B", "S", {"6"})[1]] == ["2", "6"]
    assert shortest_path(graph, "A", "A") == (["A"], [])
    assert shortest_path(graph, "A", "nowhere") == ([], [])


def test_in_a_tree_it_is_the_only_one() -> None:
    built = feeder(switches=(TIE, switch("link", "C", "E", closed=True)))
    graph = edges(built)
    tree = forest(graph, ["S"])[0]
    for start in tree:
        for end in tree:
            assert shortest_path(graph, start, end) == tree_path(tree, start, end)


def test_a_point_stays_on_its_side_of_an_open_switch() -> None:
    with pytest.raises(InputError) as caught:
        make_feeder(
            name="f",
            source=SOURCE,
            lines=TREE,
            switches=[TIE],
            points=[Point(name="p", bus="D", line="2")],
        )
    assert message(caught) == ["f: points 'p': bus must be an end of line '2', 'A' or 'B', got 'D'"]


def test_a_faulty_name_is_reported_without_echoes() -> None:
    bad = (line("", "S", "A"), line("2", "A", ""))
    with pytest.raises(InputError) as caught:
        feeder(lines=bad, loads=(load("L", None, Place(bus="B")),))
    rule = "must be a name: text, not empty, without space around it, got ''"
    assert message(caught) == [
        f"f: lines #1: name {rule}",
        f"f: lines '2': to {rule}",
        "2 faults",
    ]
