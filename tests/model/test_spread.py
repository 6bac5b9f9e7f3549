"""Default measuring points: evenly by |Z1|, beside regulators, the same every time."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from oracles.trees import SOURCE, line, plain_load, random_tree

from openphase.model import load_feeder
from openphase.model.line_matrices import z1_ohm
from openphase.model.network import compile_network
from openphase.model.parts import Feeder, InlineTransformer, Place, Regulator, Switch
from openphase.model.points import find_points
from openphase.model.spread import spread_points
from openphase.model.trunk import find_trunk


def chain(km, regulators=(), single=()):
    """Lines one behind the other, regulators before some, a three-phase load at the end."""
    lines, banks, near = [], [], "B0"
    for n, length in enumerate(km):
        if n in regulators:
            bank = Regulator(
                name=f"reg{n}",
                from_bus=near,
                to_bus=f"{near}r",
                taps=(0, 0, 0),
                step_pct=0.625,
                most_taps=16,
            )
            banks.append(bank)
            near = f"{near}r"
        ends = (near, f"B{n + 1}") if n % 2 else (f"B{n + 1}", near)
        lines.append(line(f"L{n}", *ends, km=length, phases="b" if n in single else "abc"))
        near = f"B{n + 1}"
    return Feeder(
        name="chain",
        source=SOURCE,
        lines=tuple(lines),
        transformers=(),
        loads=(plain_load("last", Place(bus=near)),),
        switches=(),
        points=(),
        sections=(),
        regulators=tuple(banks),
    )


def ohms(spread):
    """|Z1| from the head to every point, along lines named in their order."""
    feeder = spread.feeder
    along = {own.name: abs(z1_ohm(feeder, own)) for own in feeder.lines}
    total = dict(zip(along, np.cumsum(list(along.values())), strict=True))
    far = {own.name: (own.from_bus, own.to_bus)[n % 2] for n, own in enumerate(feeder.lines)}
    return [total[p.line] - (0.0 if p.bus == far[p.line] else along[p.line]) for p in feeder.points]


@pytest.mark.parametrize("count", [2, 3, 4, 6])
def test_places_are_even_to_within_a_line(count):
    spread = spread_points(chain([0.5] * 30), count)
    found = ohms(spread)
    assert np.allclose(found, np.linspace(0.0, 30 * 0.25, count), atol=0.25 / 2 + 1e-12)
    names = [point.name for point in spread.feeder.points]
    assert names == [f"M{n}" for n in range(1, count + 1)]
    assert [(s.local, s.remote) for s in spread.feeder.sections] == list(pairwise(names))
    assert spread.inside == ()


def test_every_section_beside_a_second_way_is_one_that_points_can_have():
    radial = chain([1.0] * 4)
    beside = line("beside", "B3", "B4", km=1.0, phases="abc")
    spread = spread_points(replace(radial, lines=(*radial.lines, beside)))
    terminals = find_points(spread.feeder, compile_network(spread.feeder)).terminals
    assert len(terminals) == 2 * len(spread.feeder.sections) > 0
    assert any("neither of them" in text for text in spread.said)


def test_a_regulator_lies_between_two_points_and_in_no_section():
    spread = spread_points(chain([1.0] * 10, regulators=[3]))
    places = [(p.bus, p.line) for p in spread.feeder.points]
    assert {("B3", "L2"), ("B3r", "L3")} <= set(places)
    names = [point.name for point in spread.feeder.points]
    around = names[places.index(("B3", "L2"))], names[places.index(("B3r", "L3"))]
    assert around not in [(s.local, s.remote) for s in spread.feeder.sections]
    assert spread.inside == ()
    # the place that is left goes where most line is
    assert [round(x / 0.5) for x in ohms(spread)] == [0, 3, 3, 6, 10] or [
        round(x / 0.5) for x in ohms(spread)
    ] == [0, 3, 3, 7, 10]


def test_too_many_regulators_are_flagged_and_the_crowded_one_is_left_inside():
    spread = spread_points(chain([1.0] * 12, regulators=[4, 8, 9]))
    assert spread.inside == ("reg9",) or spread.inside == ("reg8",)
    assert any(spread.inside[0] in text and "inside" in text for text in spread.said)
    for name in {"reg4", "reg8", "reg9"} - set(spread.inside):
        assert any("outside" in text and name in text for text in spread.said)


def test_a_regulator_at_the_head_belongs_to_the_substation():
    spread = spread_points(chain([0.01, 1.0, 1.0, 1.0, 1.0], regulators=[0, 1]))
    assert spread.feeder.points[0].line == "L1"
    assert spread.feeder.points[0].bus == "B1r"
    assert spread.inside == ()


@pytest.mark.parametrize("imported", [None, "town.dss"])
@pytest.mark.parametrize("at", [(0,), (5,), (9,), (0, 3, 4, 9)])
def test_no_point_stands_on_a_series_reactor(at, imported):
    plain = chain([1.0] * 10)
    lines = tuple(
        replace(own, name=f"reactor.{own.name}", length_km=0.001) if n in at else own
        for n, own in enumerate(plain.lines)
    )
    spread = spread_points(replace(plain, lines=lines, imported_from=imported))
    chosen = [point.line for point in spread.feeder.points]
    assert len(chosen) == 4
    assert len(spread.feeder.sections) == 3
    if imported:
        assert not any(name.startswith("reactor.") for name in chosen)
    elif {0, 9} & set(at):
        assert any(name.startswith("reactor.") for name in chosen)


def test_few_lines_have_few_points_and_say_so():
    spread = spread_points(chain([1.0]))
    assert [(p.bus, p.line) for p in spread.feeder.points] == [("B0", "L0"), ("B1", "L0")]
    assert "2 places instead of 4" in " ".join(spread.said)


def test_the_trunk_keeps_to_three_phases():
    feeder = chain([1.0] * 6, single=[4])
    trunk = find_trunk(feeder)
    assert trunk is not None
    assert trunk.end == "B4"
    assert "no three-phase load" in trunk.ends_at
    only = chain([1.0, 1.0], single=[0, 1])
    assert find_trunk(only) is None
    assert spread_points(only).feeder is only


def inline(name, start, end, kv_from, kv_to):
    return InlineTransformer(
        name=name,
        from_bus=start,
        to_bus=end,
        connection="D/Yg",
        rating_kva=5000.0,
        kv_from=kv_from,
        kv_to=kv_to,
        leakage_pu=0.05j,
    )


def test_the_trunk_is_of_the_medium_voltage_network_and_ends_where_a_unit_leaves_it():
    feeder = replace(
        chain([1.0] * 4),
        source=replace(SOURCE, bus="HV", kv_ll=115.0),
        inline_transformers=(
            inline("sub", "HV", "B0", 115.0, 12.0),
            inline("mill", "B3", "LV", 12.0, 0.48),
        ),
        loads=(plain_load("machine", Place(bus="LV")),),
    )
    trunk = find_trunk(feeder)
    assert trunk is not None
    assert (trunk.head, trunk.end, round(trunk.kv_ll, 6)) == ("B0", "B3", 12.0)
    assert "on all phases" in trunk.ends_at
    far_lv = replace(feeder, lines=(*feeder.lines, line("cable", "LV", "LV2", km=0.5)))
    assert find_trunk(far_lv) == trunk


@pytest.mark.parametrize("seed", range(30))
def test_random_trees_get_points_that_make_sections(seed):
    rng = np.random.default_rng(seed)
    feeder, above = random_tree(rng, int(rng.integers(1, 60)), 0)
    spread = spread_points(feeder)
    assert spread == spread_points(feeder)
    points, lines = spread.feeder.points, {own.name: own for own in feeder.lines}
    assert all(p.bus in (lines[p.line].from_bus, lines[p.line].to_bus) for p in points)
    assert [(s.local, s.remote) for s in spread.feeder.sections] == [
        (a.name, b.name) for a, b in pairwise(points)
    ]
    assert len(points) <= 4
    # the end is as far from the source as any bus that still feeds a hundredth of the load
    ohm, up = {"B0": 0.0}, {}
    for bus, name in above.items():
        own = lines[name]
        up[bus] = own.from_bus if own.to_bus == bus else own.to_bus
        ohm[bus] = ohm[up[bus]] + abs(z1_ohm(feeder, own))
    kw = {"B0": 0.0} | {f"B{load.name[1:]}": load.kw for load in feeder.loads}
    for bus in reversed(list(above)):
        kw[up[bus]] += kw[bus]
    worth = [ohm[bus] for bus in ohm if kw[bus] >= 0.01 * kw["B0"]]
    assert ohm[points[-1].bus] == pytest.approx(max(worth))


def test_a_feeder_with_points_keeps_them():
    paper = load_feeder("paper")
    assert spread_points(paper).feeder is paper
    assert spread_points(paper).said == ()


def test_open_switches_end_the_trunk_and_one_place_is_refused():
    feeder = chain([1.0] * 3)
    tie = Switch(name="tie", from_bus="B3", to_bus="X", closed=False)
    beyond = replace(feeder, switches=(tie,), lines=(*feeder.lines, line("far", "X", "Y", km=9.0)))
    assert spread_points(beyond).feeder.points[-1].bus == "B3"
    with pytest.raises(ValueError, match="at least two places, got 1"):
        spread_points(feeder, 1)


def test_three_single_phase_loads_are_a_three_phase_load_and_idle_units_are_none():
    feeder = chain([1.0] * 6)
    ones = tuple(
        replace(plain_load(f"one{p}", Place(bus="B4")), phases=p, connection="wye") for p in "abc"
    )
    pair = replace(plain_load("pair", Place(bus="B6")), phases="ab")
    idle = inline("idle", "B5", "LV", 12.0, 0.48)
    trunk = find_trunk(replace(feeder, loads=(*ones, pair), inline_transformers=(idle,)))
    assert trunk is not None
    assert trunk.end == "B4"


def test_a_trifle_at_the_far_end_is_not_worth_the_way():
    feeder = chain([1.0] * 6)
    main = plain_load("main", Place(bus="B4"), kw=1000.0)
    trifle = plain_load("trifle", Place(bus="B6"), kw=9.0)
    for kw, end in ((9.0, "B4"), (11.0, "B6")):
        loads = (main, replace(trifle, kw=kw))
        trunk = find_trunk(replace(feeder, loads=loads))
        assert trunk is not None
        assert trunk.end == end
