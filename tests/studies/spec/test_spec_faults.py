"""What is wrong with a study file, or with a study and its feeder: every message."""

from __future__ import annotations

import dataclasses

import pytest

from openphase.model import Feeder, InputError, load_feeder
from openphase.model.distributions import (
    Choices,
    Fixed,
)
from openphase.model.parts import Der, Place
from openphase.studies.spec.parts import UNKNOWN_CONNECTION
from openphase.studies.spec.study_file import (
    DerDraw,
    Device,
    Events,
    Group,
    NetworkState,
    OpenPhaseDraw,
    Study,
    SwitchingDraw,
    SwitchState,
    TransformerDraw,
    check_study,
    default_study,
    study_from_toml,
)


def study(*lines: str) -> Study:
    return study_from_toml("\n".join(("format = 1", *lines)), "s.toml")


def refused(*lines: str) -> list[str]:
    """Return the message for a text that must be refused, line by line."""
    with pytest.raises(InputError) as caught:
        study(*lines)
    return str(caught.value).splitlines()


def mismatch(checked: Study, feeder: Feeder) -> list[str]:
    """Return the message for a study that must not be used with the feeder."""
    with pytest.raises(InputError) as caught:
        check_study(checked, feeder, "s.toml")
    return str(caught.value).splitlines()


@pytest.fixture(scope="module")
def paper() -> Feeder:
    return load_feeder("paper")


# ---- malformed studies ----


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (("[loads",), "2: is not valid TOML: Expected ']' at the end of a table declaration"),
        (
            ("[loads]", "level = [1.0, 0.25]"),
            "3: loads: level must be [low, high], low <= high, got [1.0, 0.25]",
        ),
        (
            ("[load]",),
            "2: load is not a known key (did you mean 'loads'?)",
        ),
        (("loads = 3",), "2: loads must be a table, written [loads], got 3"),
        (
            ("[events.loadstep]",),
            "2: events: loadstep is not a known key (did you mean 'load_step'?)",
        ),
        (
            ("[events]", "load_step = 3"),
            "3: events: load_step must be a table, written [events.load_step], got 3",
        ),
        (
            ("[events.load_step]", "kw = [0, 500]"),
            "3: events: load_step: kw must hold numbers > 0, <= 100000, got [0, 500]",
        ),
        (
            ("[events.open_phase]", "two_phase_share = 20"),
            "3: events: open_phase: two_phase_share must be 0 to 1, got 20",
        ),
        (
            ("[transformers]", 'yg_d = "T4"'),
            "3: transformers: yg_d must be a list of names, got 'T4'",
        ),
        (
            ("[transformers]", "yg_d = [", '"T4",', '"T4"]'),
            "5: transformers: yg_d #2 must be there once, got 'T4'",
        ),
        (
            ("[transformers]", 'yg_d = ["T4"]', "yg_d_count = [0, 2]"),
            "4: transformers: yg_d_count must not exceed the 1 units named by yg_d, got [0, 2]",
        ),
        (
            ("[transformers]", 'yg_d = ["T4"]', "yg_d_count = [0, 1.5]"),
            "4: transformers: yg_d_count must give whole numbers, got [0, 1.5]",
        ),
        (
            ("[transformers]", 'yg_d = ["T4"]', "yg_d_count = { integers = [0, 0.5] }"),
            "4: transformers: yg_d_count: integers must be a list of integers,"
            " -100000 to 100000, got [0, 0.5]",
        ),
        (
            ("[loads]", 'level = "high"'),
            "3: loads: level must be a number, [low, high] or a distribution, 0 to 100, got 'high'",
        ),
        (("[loads]", "level = -1"), "3: loads: level must be 0 to 100, got -1"),
        (
            ("[loads]", "level = { norml = [1, 1] }"),
            "3: loads: level must have just one of the keys uniform, normal, lognormal,"
            " triangular, integers, quantiles, values, got { norml = [1, 1] }",
        ),
        (
            ("[loads]", "level = { normal = [1, 1] }"),
            "3: loads: level: within is missing (a list of finite numbers)",
        ),
        (
            ("[loads]", "level = { uniform = [0, 1], normal = [1, 1] }"),
            "3: loads: level must have just one of the keys uniform, normal, lognormal,"
            " triangular, integers, quantiles, values, got { uniform = [0, 1], normal = [1, 1] }",
        ),
        (
            ("[loads]", "level = { normal = [1], within = [0, 1] }"),
            "3: loads: level: normal must be [mean, sd], got [1]",
        ),
        (
            ("[loads]", "level = { normal = [1, 0.2], within = [-1, 2] }"),
            "3: loads: level must give numbers 0 to 100,"
            " got { normal = [1, 0.2], within = [-1, 2] }",
        ),
        (
            ("[loads]", "level = { values = [2, 1] }"),
            "3: loads: level must be values = [...], rising, got { values = [2, 1] }",
        ),
        (
            ("[ders]", 'model = "thevenim"'),
            "3: ders: model must be 'thevenin' or 'generator' or 'constant_current' or"
            " 'constant_power' (did you mean 'thevenin'?), got 'thevenim'",
        ),
        (
            ("[ders]", 'model = { values = ["thevenin"], weights = [1, 2] }'),
            "3: ders: model must have a weight for each of the 1 values,"
            " got { values = ['thevenin'], weights = [1, 2] }",
        ),
        (
            ("[ders]", "model = 3"),
            "3: ders: model must be a text, a list of texts or"
            " { values = [...], weights = [...] }, got 3",
        ),
        (
            ("[events.energisation]",),
            "2: events: energisation takes no table: there is nothing to choose",
        ),
        (
            ("[events]", 'without = ["open_phase"]'),
            "3: events: without #1 cannot be left out: it is what must trip, got 'open_phase'",
        ),
        (
            ("[events]", 'without = ["motor"]'),
            "3: events: without #1 is not known (did you mean 'motor_start'?), got 'motor'",
        ),
        (
            ("[events.transfer]", 'states = [{ closed = ["R4"], open = ["R1"] }]'),
            "3: events: transfer: states #1: open is not a known key (did you mean 'opened'?)",
        ),
        (
            ("[events.transfer]", 'states = ["R4"]'),
            "3: events: transfer: states must be a list of { closed = [...], opened = [...] },"
            " got ['R4']",
        ),
        (("[[groups]]", "closed = []"), "2: groups #1: name is missing (a name)"),
        (
            ("[[groups]]", 'name = "a"', "[[groups]]", 'name = "a"'),
            "5: groups 'a': name must be the only group of that name, got 'a'",
        ),
        (
            ("[network]", "closed = []", "[[groups]]", 'name = "a"'),
            "3: network: closed must be left out where there are groups:"
            " each says what is closed in it, got []",
        ),
        (
            ("[[correlations]]", 'between = ["loads.level"]', "rank = 1"),
            "3: correlations #1: between must name two quantities, got ['loads.level']",
        ),
        (
            ("[[correlations]]", 'between = ["loads.level", "motors.share"]', "rank = 1"),
            "3: correlations #1: between #2 must be a quantity that varies in this study,"
            " got 'motors.share'",
        ),
        (
            ("[certificate]", "loop_margins = [2]"),
            "3: certificate: loop_margins must be two factors, got [2]",
        ),
        (
            ("[device]", 'unit = "pu"', "ct_primary_a = 0"),
            "4: device: ct_primary_a must be > 0, <= 100000, got 0",
        ),
        (
            ("[instruments]", "tve_pct = -0.05"),
            "3: instruments: tve_pct must be 0 to 100, got -0.05",
        ),
        (
            ("[device]", "i_set = 1.0"),
            "3: device: i_set must be { first = ..., last = ..., step = ... }, got 1.0",
        ),
        (
            ("[device]", "i_set = { first = 0.1, last = 1.0 }"),
            "3: device: i_set: step is missing (a finite number, > 0)",
        ),
        (
            ("[device]", "i_set = { first = 0.1, last = 1.0, step = 0.2 }"),
            "3: device: i_set must reach last from first in whole steps,"
            " got { first = 0.1, last = 1.0, step = 0.2 }",
        ),
        (
            ("[device]", "i_set = { first = 2, last = 1, step = 1 }"),
            "3: device: i_set must have a step > 0 and last >= first,"
            " got { first = 2, last = 1, step = 1 }",
        ),
        (
            ("[device]", "i_set = { first = 1, last = 1e6, step = 1e-3 }"),
            "3: device: i_set must hold at most 10000 numbers,"
            " got { first = 1, last = 1000000.0, step = 0.001 }",
        ),
        (
            ("[device]", "z_set_ohm = { first = 1, last = 2, step = 1 }"),
            "3: device: z_set_ohm must be a list of { first = ..., last = ..., step = ... },"
            " got { first = 1, last = 2, step = 1 }",
        ),
        (
            ("[[device.z_set_ohm]]", "first = 1", "last = 5", "setp = 1"),
            "2: device: z_set_ohm #1: step is missing (a finite number, > 0)",
        ),
        (
            ("[device]", "i_set = { first = 1, last = 2, step = 1, sept = 1 }"),
            "3: device: i_set: sept is not a known key (did you mean 'step'?)",
        ),
        (
            ("[device]", "z_set_ohm = []"),
            "3: device: z_set_ohm must hold at least one number, got []",
        ),
        (
            ("[device]", "v_set_pct = [1, 2, 2]"),
            "3: device: v_set_pct must hold numbers that rise, got [1.0, 2.0, 2.0]",
        ),
        (
            ("[reference]", "v_set_pct = 0"),
            "3: reference: v_set_pct must be > 0, <= 100, got 0",
        ),
        (("[certificate]", "confidence = 1"), "3: certificate: confidence must be < 1, got 1.0"),
        (("[certificate]", "target = 0"), "3: certificate: target must be > 0, <= 0.5, got 0"),
        (("[certificate]", "margin = 0.9"), "3: certificate: margin must be >= 1, got 0.9"),
    ],
)
def test_a_fault(lines: tuple[str, ...], message: str) -> None:
    assert refused(*lines)[0] == f"s.toml:{message}"


def test_ladders_that_overlap() -> None:
    ladder = "[{ first = 1, last = 5, step = 1 }, { first = 5, last = 9, step = 2 }]"
    (message,) = refused("[device]", f"z_set_ohm = {ladder}")
    assert message.startswith("s.toml:3: device: z_set_ohm must hold numbers that rise, got [{")


def test_many_faults_are_reported_at_once_in_the_order_of_the_file() -> None:
    assert refused(
        "[certificate]",
        "confidence = 0.3",
        "[device]",
        "v_set_pct = [2, 1]",
        "ct_primary_a = nan",
        "[[device.z_set_ohm]]",
        "first = 1",
        "last = 2",
        "step = 0.3",
        "[loads]",
        "evry = [1, 1]",
        "[network]",
        "closed = [1]",
    ) == [
        "s.toml:3: certificate: confidence must be 0.5 to 1, got 0.3",
        "s.toml:5: device: v_set_pct must hold numbers that rise, got [2.0, 1.0]",
        "s.toml:6: device: ct_primary_a must be a finite number, A, > 0, <= 100000, got nan",
        "s.toml:7: device: z_set_ohm #1 must reach last from first in whole steps,"
        " got { first = 1, last = 2, step = 0.3 }",
        "s.toml:12: loads: evry is not a known key",
        "s.toml:14: network: closed must be a list of names, got [1]",
        "6 faults",
    ]


def test_a_file_without_format() -> None:
    with pytest.raises(InputError) as caught:
        study_from_toml("", "s.toml")
    assert str(caught.value) == "s.toml: format is missing (an integer, 1)"


# ---- a study and its feeder ----


def test_names_that_the_feeder_does_not_have(paper: Feeder) -> None:
    wrong = Study(
        transformers=TransformerDraw(yg_d=("T4", "T44", "mill"), yg_d_count=Fixed(value=3.0)),
        network=NetworkState(closed=("R44",)),
    )
    assert mismatch(wrong, paper) == [
        "s.toml: transformers: yg_d #2 must be a transformer of the feeder"
        " (did you mean 'T4'?), got 'T44'",
        "s.toml: transformers: yg_d #3 must be a transformer of the feeder, got 'mill'",
        "s.toml: network: closed #1 must be a switch of the feeder (did you mean 'R4'?), got 'R44'",
        "3 faults",
    ]


def test_a_unit_without_leakage_cannot_be_yg_d(paper: Feeder) -> None:
    units = tuple(
        dataclasses.replace(unit, leakage_pu=0j) if unit.name == "T5" else unit
        for unit in paper.transformers
    )
    assert mismatch(default_study("paper"), dataclasses.replace(paper, transformers=units)) == [
        "s.toml: transformers: yg_d #2 must have leakage, or as Yg/D it would short"
        " the zero sequence to earth, got 'T5'"
    ]


def test_a_study_made_in_a_program_is_checked_like_one_that_was_read(paper: Feeder) -> None:
    wrong = Study(
        transformers=TransformerDraw(yg_d=("T4", "T4"), yg_d_count=Fixed(value=3.0)),
        events=Events(open_phase=OpenPhaseDraw(two_phase_share=1.5)),
        device=Device(v_set_pct=(5.0, 1.0)),
    )
    assert sorted(mismatch(wrong, paper)) == [
        "3 faults",
        "s.toml: device: v_set_pct must hold numbers that rise, got [5.0, 1.0]",
        "s.toml: events: open_phase: two_phase_share must be 0 to 1, got 1.5",
        "s.toml: transformers: yg_d #2 must be there once, got 'T4'",
    ]


def test_any_state_of_the_tie_is_fine(paper: Feeder) -> None:
    for closed in (None, (), ("R4",)):
        check_study(Study(network=NetworkState(closed=closed)), paper, "s.toml")


def test_groups_and_states_name_what_the_feeder_has(paper: Feeder) -> None:
    wrong = Study(
        groups=(Group(name="a", closed=("R4",), opened=("R1", "R9")), Group(name="b")),
        events=Events(transfer=SwitchingDraw(states=(SwitchState(closed=("R44",)),))),
    )
    assert mismatch(wrong, paper) == [
        "s.toml: groups 'a': opened #2 must be a measuring point of the feeder, got 'R9'",
        "s.toml: events: transfer: states #1: closed #1 must be a switch of the feeder"
        " (did you mean 'R4'?), got 'R44'",
        "2 faults",
    ]


def test_three_wires_have_no_neutral(paper: Feeder) -> None:
    three = dataclasses.replace(paper, source=dataclasses.replace(paper.source, wires=3))
    wrong = Study(
        transformers=TransformerDraw(
            yg_d=("T4",), unknown=Choices(values=("D/Yg", "Yg/D", "Yg/Yg"))
        )
    )
    assert mismatch(wrong, three) == [
        "s.toml: transformers: yg_d must be empty: with three wires there is no neutral"
        " for a Yg winding, got ['T4']",
        "s.toml: transformers: unknown must not be one with a Yg winding, for which three wires"
        " have no neutral, got 'Yg/Yg' and 'Yg/D'",
        "2 faults",
    ]
    check_study(Study(transformers=TransformerDraw(unknown=UNKNOWN_CONNECTION[3])), three, "s")
    check_study(wrong, paper, "s.toml")


def der(name: str, z1_ohm: complex | None, z2_ohm: complex | None) -> Der:
    return Der(
        name=name,
        transformer=None,
        place=Place(bus="R3"),
        kw=100.0,
        power_factor=1.0,
        model="constant_current",
        z1_ohm=z1_ohm,
        z2_ohm=z2_ohm,
        z0_ohm=None,
    )


def test_a_der_needs_the_impedances_of_what_it_may_be(paper: Feeder) -> None:
    feeder = dataclasses.replace(paper, ders=(der("A", 1j, None), der("B", None, None)))
    drawn = Study(ders=DerDraw(model=Choices(values=("generator", "constant_power"))))
    assert mismatch(drawn, feeder) == [
        "s.toml: ders: model may be 'generator' only if every DER has z1_ohm,"
        " which is missing from 'B'",
        "s.toml: ders: model may be 'generator' only if every DER has z2_ohm,"
        " which is missing from 'A', 'B'",
        "2 faults",
    ]
    check_study(drawn, dataclasses.replace(paper, ders=(der("A", 1j, 2j),)), "s.toml")
