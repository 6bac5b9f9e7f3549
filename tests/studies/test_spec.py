"""Study files: what they say, what is wrong with them, and the grids of settings in them."""

from __future__ import annotations

import dataclasses
import re
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from openphase.detector.instruments import Wiring
from openphase.detector.options import Options
from openphase.model import Feeder, InputError, load_feeder, shipped_feeders
from openphase.model.distributions import (
    Choices,
    Distribution,
    Fixed,
    Integers,
    Lognormal,
    Normal,
    Triangular,
    Uniform,
    Values,
)
from openphase.model.fields import Field, markdown_table
from openphase.model.parts import Der, Place
from openphase.studies.run.spec import (
    Ambient,
    CertificateDemand,
    Correlation,
    DerDraw,
    DetectorOptions,
    Device,
    Events,
    Group,
    Instruments,
    LoadDraw,
    LoadStepDraw,
    MotorDraw,
    NetworkState,
    OpenPhaseDraw,
    ReferenceSettings,
    SourceStepDraw,
    Steps,
    Study,
    SwitchingDraw,
    SwitchState,
    TransformerDraw,
    check_study,
    default_study,
    dump_population,
    dump_study,
    read_study,
    resolved,
    study_from_toml,
)
from openphase.studies.run.spec_correlations import SCALARS, draw_scalars
from openphase.studies.run.spec_events import (
    CLASSES,
    WIRING_KINDS,
    CapacitorStepDraw,
    DerRampDraw,
    DerTripDraw,
    EarthFaultDraw,
    FallenDraw,
    LineFaultDraw,
    LoadSwapDraw,
    MotorStartDraw,
    OpenWithDerTripDraw,
    OpenWithLoadStepDraw,
    ReclosingDraw,
    RegulatorTapDraw,
    SinglePoleDraw,
    StepWithTapDraw,
    WiringDraw,
)
from openphase.studies.run.spec_fields import (
    CORRELATIONS,
    DOCUMENT,
    EVENTS,
    GROUPS,
    STATES,
    STEPS,
    TABLES,
    part_of,
)
from openphase.studies.run.spec_parts import UNKNOWN_CONNECTION

DOC = Path(__file__).parents[2] / "docs" / "study-file.md"

FULL = Study(
    loads=LoadDraw(
        level=Normal(mean=0.6, sd=0.2, low=0.2, high=1.1),
        each=Fixed(value=1.0),
        exponent=Triangular(low=0.5, mode=1.0, high=1.5),
        exponent_spread=0.0,
    ),
    motors=MotorDraw(share=Uniform(low=0.1, high=0.5), y2_y1=Fixed(value=6.0)),
    transformers=TransformerDraw(
        yg_d=("T4", 'the "old" Δ'),
        yg_d_count=Integers(least=1, most=2),
        unknown=Choices(values=("Yg/Yg", "D/D"), weights=(0.25, 0.75)),
    ),
    ders=DerDraw(
        level=Lognormal(median=0.5, sigma=0.5, low=0.0, high=2.0),
        model=Choices(values=("constant_power",)),
    ),
    ambient=Ambient(source_pct=0.1, load_pct=2.0),
    correlations=(
        Correlation(between=("loads.level", "ders.level"), rank=-0.6),
        Correlation(between=("motors.share", "loads.exponent"), rank=-0.5),
    ),
    network=NetworkState(closed=None, settings="one"),
    groups=(
        Group(name="normal"),
        Group(name="tie closed", closed=("R4",)),
        Group(name="backwards", closed=("R4",), opened=("R1",)),
    ),
    events=Events(
        without=("motor_start", "wiring"),
        open_phase=OpenPhaseDraw(two_phase_share=1.0),
        load_step=LoadStepDraw(
            kw=Values(values=(5.0, 50.0), weights=(1.0, 3.0)),
            single_phase_share=0.0,
            exponent=Fixed(value=1.0),
        ),
        source_step=SourceStepDraw(pct=Uniform(low=0.0, high=3.0)),
        capacitor_step=CapacitorStepDraw(kvar=Fixed(value=300.0), delta_share=0.0),
        motor_start=MotorStartDraw(
            kva=Fixed(value=100.0), times=Fixed(value=6.0), power_factor=Fixed(value=0.3)
        ),
        regulator_tap=RegulatorTapDraw(taps=Integers(least=1, most=3), single_phase_share=1.0),
        earth_fault=EarthFaultDraw(ohm=Uniform(low=1.0, high=40.0)),
        line_fault=LineFaultDraw(ohm=Fixed(value=1.0), earth_share=0.0),
        tie_switching=SwitchingDraw(states=(SwitchState(closed=("R4",)),)),
        transfer=SwitchingDraw(states=(SwitchState(closed=None, opened=("R1", "R2")),)),
        der_trip=DerTripDraw(share=Fixed(value=1.0)),
        der_ramp=DerRampDraw(factor=Uniform(low=0.5, high=0.9)),
        reclosing=ReclosingDraw(cold_load=Fixed(value=2.0)),
        single_pole=SinglePoleDraw(two_phase_share=0.0),
        fallen_source_side=FallenDraw(ohm=Uniform(low=40.0, high=1000.0)),
        fallen_load_side=FallenDraw(ohm=Fixed(value=40.0)),
        open_with_load_step=OpenWithLoadStepDraw(kw=Fixed(value=200.0)),
        open_with_der_trip=OpenWithDerTripDraw(share=Fixed(value=1.0)),
        load_swap=LoadSwapDraw(kw=Fixed(value=500.0), ratio=Fixed(value=-0.9)),
        step_with_tap=StepWithTapDraw(kw=Fixed(value=50.0), pct=Uniform(low=-1.0, high=1.0)),
        wiring=WiringDraw(kinds=Choices(values=("ct_reversed", "labels_swapped"))),
    ),
    instruments=Instruments(
        tve_pct=1.0,
        current_floor_a=0.0,
        ratio_pct=0.5,
        angle_mrad=1.0,
        clock_us=10.0,
        frequency_hz=0.01,
    ),
    device=Device(
        unit="pu",
        i_set=Steps(first=0.001, last=0.02, step=0.0005),
        z_set_ohm=(Steps(first=1.0, last=9.0, step=1.0),),
        v_set_pct=(1.0, 2.5),
        ct_primary_a=600.0,
    ),
    detector=DetectorOptions(
        dt_ms=1000.0,
        delay_ms=0.0,
        negative_sign=False,
        fallback=False,
        compensated=True,
        any_sequence=True,
        floor_v=10.0,
        waive_sign_below_a=0.0,
        unbalance=0.1,
        direction=True,
        both_ends="agree",
    ),
    reference=ReferenceSettings(i_set_a=2.0, v_set_pct=4.0, z_set_ohm=3.0),
    certificate=CertificateDemand(
        confidence=0.9, target=1e-05, find_at_least=0.0, margin=1.0, loop_margins=(1.5, 2.0)
    ),
)
"""Differs from the defaults in every field but those of the network's one state."""


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


# ---- reading and writing ----


ONE_STATE = dataclasses.replace(FULL, groups=(), network=NetworkState(closed=("R4",)))
"""Without groups, the network's one state is said where the groups are otherwise."""


def test_the_full_study_leaves_no_field_at_its_default() -> None:
    for table in TABLES:
        for field in dataclasses.fields(part_of(Study(), table)):
            if (table, field.name) != ("network", "closed"):
                values = [getattr(part_of(s, table), field.name) for s in (FULL, Study())]
                assert values[0] != values[1], (table, field.name)
    assert FULL.groups
    assert FULL.correlations


@pytest.mark.parametrize("written", [Study(), FULL, ONE_STATE, default_study("paper")])
def test_what_is_written_reads_back_the_same(written: Study) -> None:
    text = dump_study(written)
    assert study_from_toml(text, "dumped") == written
    assert dump_study(study_from_toml(text, "dumped")) == text


def test_a_dump_writes_every_default_out() -> None:
    text = dump_study(Study())
    for table, fields in TABLES.items():
        _, _, after = text.partition(f"[{table}]\n")
        keys = [line.split(" = ")[0] for line in after.partition("\n[")[0].splitlines() if line]
        left_out = {"closed", "share", "y2_y1", "unknown", "model"} if "." not in table else set()
        assert keys == [field.name for field in fields if field.name not in left_out]


def test_what_is_left_out_has_its_default() -> None:
    assert study() == Study()
    assert study("[device]", "ct_primary_a = 600", "[events]").device == Device(ct_primary_a=600.0)
    assert study("[network]").network.closed is None
    assert study("[network]", "closed = []").network.closed == ()


def test_steps_may_be_an_array_of_tables() -> None:
    ladder = ("[[device.z_set_ohm]]", "first = 1", "last = 3", "step = 1")
    assert study(*ladder).device.z_grid() == (1.0, 2.0, 3.0)


def test_reading_a_file(tmp_path: Path) -> None:
    path = tmp_path / "s.study.toml"
    path.write_bytes(b"\xef\xbb\xbf" + dump_study(FULL).replace("\n", "\r\n").encode())
    assert read_study(path) == FULL
    path.write_bytes(b"a = '\xe9'")
    with pytest.raises(InputError, match=r"s\.study\.toml: must be UTF-8 text$"):
        read_study(path)
    with pytest.raises(InputError, match="must be a file to read, got No such file"):
        read_study(tmp_path / "none.toml")


# ---- studies that ship ----


def test_the_paper_s_study(paper: Feeder) -> None:
    shipped = default_study("paper")
    check_study(shipped, paper, "paper.study.toml")
    assert shipped.loads == LoadDraw(
        level=Uniform(low=0.25, high=1.0),
        each=Uniform(low=0.8, high=1.2),
        exponent=Uniform(low=0.0, high=2.0),
        exponent_spread=0.3,
    )
    assert shipped.transformers == TransformerDraw(
        yg_d=("T4", "T5", "T6"), yg_d_count=Integers(least=1, most=3)
    )
    assert shipped.ambient == Ambient(source_pct=0.3, load_pct=1.0)
    assert shipped.network == NetworkState(closed=())
    assert shipped.setting_groups() == (Group(name="normal", closed=()),)
    assert shipped.events.without == shipped.correlations == ()
    assert shipped.events.open_phase == OpenPhaseDraw(two_phase_share=0.2)
    assert shipped.events.load_step == LoadStepDraw(
        kw=Uniform(low=10.0, high=500.0),
        single_phase_share=0.5,
        exponent=Uniform(low=0.0, high=2.0),
    )
    assert shipped.events.source_step == SourceStepDraw(pct=Uniform(low=-5.0, high=5.0))
    assert shipped.events.tie_switching.states == (SwitchState(closed=("R4",)),)
    assert shipped.events.transfer.states == (SwitchState(closed=("R4",), opened=("R1",)),)
    assert shipped.instruments == Instruments(
        tve_pct=0.05, current_floor_a=0.05, ratio_pct=0.3, angle_mrad=5.0, clock_us=1.0
    )
    assert shipped.device == Device(
        unit="A",
        i_set=Steps(first=0.1, last=10.0, step=0.1),
        z_set_ohm=(
            Steps(first=0.1, last=50.0, step=0.1),
            Steps(first=51.0, last=300.0, step=1.0),
        ),
        v_set_pct=(0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0),
        ct_primary_a=100.0,
    )
    assert shipped.detector == DetectorOptions(dt_ms=800.0, delay_ms=300.0, negative_sign=True)
    assert shipped.reference == ReferenceSettings(i_set_a=1.0, v_set_pct=5.0, z_set_ohm=5.0)
    assert shipped.certificate == CertificateDemand(
        confidence=0.95, target=1e-4, find_at_least=0.5, margin=1.25, loop_margins=(2.0, 1.25)
    )


def test_the_paper_s_study_differs_from_the_defaults_by_what_names_its_parts() -> None:
    shipped = default_study("paper")
    named = Events(tie_switching=shipped.events.tie_switching, transfer=shipped.events.transfer)
    assert shipped == Study(
        transformers=shipped.transformers, network=shipped.network, events=named
    )


@pytest.mark.parametrize("name", shipped_feeders())
def test_the_study_of_every_shipped_feeder_fits_it(name: str) -> None:
    check_study(default_study(name), load_feeder(name), name)


def test_other_feeders_have_the_defaults() -> None:
    assert default_study("papers") == default_study("../data/paper") == Study()


# ---- distributions ----


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("1", Fixed(value=1.0)),
        ("[1, 1]", Uniform(low=1.0, high=1.0)),
        ("[0.5, 1]", Uniform(low=0.5, high=1.0)),
        ("{ uniform = [0.5, 1] }", Uniform(low=0.5, high=1.0)),
        ("{ normal = [1, 2], within = [0, 4] }", Normal(mean=1.0, sd=2.0, low=0.0, high=4.0)),
        (
            "{ within = [0, 4], lognormal = [1, 2] }",
            Lognormal(median=1.0, sigma=2.0, low=0.0, high=4.0),
        ),
        ("{ triangular = [0, 1, 2] }", Triangular(low=0.0, mode=1.0, high=2.0)),
        ("{ integers = [0, 3] }", Integers(least=0, most=3)),
        ("{ values = [1, 2] }", Values(values=(1.0, 2.0))),
        ("{ values = [1, 2], weights = [1, 0] }", Values(values=(1.0, 2.0), weights=(1.0, 0.0))),
    ],
)
def test_how_a_distribution_is_written(written: str, meant: Distribution) -> None:
    read = study("[loads]", f"level = {written}")
    assert read.loads.level == meant
    assert study_from_toml(dump_study(read), "dumped") == read


def test_two_whole_numbers_are_the_ends_of_integers() -> None:
    names = 'yg_d = ["A", "B", "C"]'
    for written, meant in (
        ("[1, 3]", Integers(least=1, most=3)),
        ("2", Fixed(value=2.0)),
        ("{ values = [0, 3] }", Values(values=(0.0, 3.0))),
    ):
        read = study("[transformers]", names, f"yg_d_count = {written}")
        assert read.transformers.yg_d_count == meant
    assert study("[events.regulator_tap]", "taps = [-1, 1]").events.regulator_tap.taps == Integers(
        least=-1, most=1
    )


def test_how_a_choice_is_written() -> None:
    for written, meant in (
        ('"D/Yg"', Choices(values=("D/Yg",))),
        ('["D/Yg", "Δ/Δ"]', Choices(values=("D/Yg", "D/D"))),
        ('{ values = ["Y/∆"], weights = [2] }', Choices(values=("Y/D",), weights=(2.0,))),
    ):
        assert study("[transformers]", f"unknown = {written}").transformers.unknown == meant


# ---- setting groups ----


def test_without_groups_there_is_a_normal_one() -> None:
    assert study("[network]", 'closed = ["R4"]').setting_groups() == (
        Group(name="normal", closed=("R4",)),
    )
    named = study("[[groups]]", 'name = "tie"', 'closed = ["R4"]', 'opened = ["R1"]')
    assert named.setting_groups() == named.groups
    assert named.groups == (Group(name="tie", closed=("R4",), opened=("R1",)),)


# ---- correlations ----


def correlated(*pairs: tuple[str, str, float]) -> list[str]:
    """Return lines that correlate the pairs."""
    return [
        line
        for one, other, rank in pairs
        for line in ("[[correlations]]", f'between = ["{one}", "{other}"]', f"rank = {rank}")
    ]


def test_correlations_that_cannot_all_hold_are_named() -> None:
    pairs = [
        ("loads.level", "ders.level", 0.9),
        ("ders.level", "loads.exponent", 0.9),
        ("loads.exponent", "loads.level", -0.9),
        ("ambient.source_pct", "ders.level", 0.1),
    ]
    assert refused(*correlated(*pairs)) == [
        "s.toml:2: correlations must be possible together, unlike loads.level with ders.level"
        " at 0.9, ders.level with loads.exponent at 0.9, loads.exponent with loads.level at -0.9,"
        " and 0 where nothing is said"
    ]
    assert refused(*correlated(*pairs[:2])) == [
        "s.toml:2: correlations must be possible together, unlike loads.level with ders.level"
        " at 0.9, ders.level with loads.exponent at 0.9, and 0 where nothing is said"
    ]
    possible = [*pairs[:2], ("loads.exponent", "loads.level", 0.7)]
    assert len(study(*correlated(*possible)).correlations) == 3


def test_a_pair_is_correlated_once() -> None:
    pairs = [("loads.level", "ders.level", 0.5), ("ders.level", "loads.level", 0.5)]
    assert refused(*correlated(*pairs)) == [
        "s.toml:5: correlations #2 must be the only one between its two quantities"
    ]


def test_scalars_go_together_and_keep_their_distributions() -> None:
    """Of 40,000: ranks within 5/sqrt(40,000), Kolmogorov-Smirnov tests at 1e-4."""
    drawn_from = study(
        "[motors]",
        "share = [0, 0.5]",
        "[loads]",
        "level = { triangular = [0.2, 0.4, 1] }",
        *correlated(("loads.level", "ders.level", -0.6), ("loads.level", "motors.share", 0.5)),
    )
    drawn = draw_scalars(np.random.default_rng(5), drawn_from, 40_000)
    assert set(drawn) == set(SCALARS) - {"motors.y2_y1"}
    for one, other, rank in (
        ("loads.level", "ders.level", -0.6),
        ("loads.level", "motors.share", 0.5),
        ("loads.exponent", "loads.level", 0.0),
        ("ambient.source_pct", "ders.level", 0.0),
    ):
        reached = stats.spearmanr(drawn[one], drawn[other]).statistic
        assert reached == pytest.approx(rank, abs=0.025)
    for name, alone in (
        ("loads.level", stats.triang(0.25, 0.2, 0.8)),
        ("ders.level", stats.uniform(0.0, 1.0)),
        ("motors.share", stats.uniform(0.0, 0.5)),
        ("ambient.source_pct", stats.uniform(-0.3, 0.6)),
    ):
        assert stats.kstest(drawn[name], alone.cdf).pvalue > 1e-4
    assert set(drawn["transformers.yg_d_count"]) == {0.0}


def test_studies_that_differ_in_one_quantity_draw_the_others_alike() -> None:
    plain, other = study(), study("[motors]", "share = 0.3", "[ders]", "level = 1")
    one, two = (draw_scalars(np.random.default_rng(5), s, 100) for s in (plain, other))
    for name in SCALARS:
        if not name.startswith("motors"):
            assert np.array_equal(one[name], two[name]) == (name != "ders.level")


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
            " triangular, integers, values, got { norml = [1, 1] }",
        ),
        (
            ("[loads]", "level = { normal = [1, 1] }"),
            "3: loads: level: within is missing (a list of finite numbers)",
        ),
        (
            ("[loads]", "level = { uniform = [0, 1], normal = [1, 1] }"),
            "3: loads: level must have just one of the keys uniform, normal, lognormal,"
            " triangular, integers, values, got { uniform = [0, 1], normal = [1, 1] }",
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
            ("[device]", "i_set = { first = 1, last = 1e9, step = 1e-9 }"),
            "3: device: i_set must hold at most 10000 numbers,"
            " got { first = 1, last = 1000000000.0, step = 1e-09 }",
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


# ---- what the detector is told ----


def test_the_criteria_get_every_option() -> None:
    assert DetectorOptions().options() == Options()
    told = FULL.detector.options()
    for option in dataclasses.fields(Options):
        assert getattr(told, option.name) == getattr(FULL.detector, option.name)
        assert getattr(told, option.name) != getattr(Options(), option.name)
    names = {field.name for field in dataclasses.fields(DetectorOptions)}
    assert names == {"dt_ms", "delay_ms"} | {field.name for field in dataclasses.fields(Options)}


def test_every_wiring_fault_has_a_name() -> None:
    kinds = [kind for kinds in WIRING_KINDS.values() for kind in kinds]
    assert sorted(kinds) == [kind for kind in Wiring if kind != Wiring.RIGHT]


# ---- what decides the draws ----


def test_what_the_feeder_decides_is_written_out(paper: Feeder) -> None:
    assert resolved(Study(), paper).network.closed == ()
    closed = dataclasses.replace(
        paper, switches=tuple(dataclasses.replace(s, closed=True) for s in paper.switches)
    )
    assert resolved(Study(), closed).network.closed == ("R4",)
    named = Study(groups=(Group(name="a"), Group(name="b", closed=(), opened=("R2", "R1"))))
    assert resolved(named, closed).groups == (
        Group(name="a", closed=("R4",)),
        Group(name="b", closed=(), opened=("R1", "R2")),
    )
    assert resolved(named, closed).network.closed is None
    assert resolved(Study(), paper).transformers.unknown is None
    unknown = tuple(dataclasses.replace(u, connection="unknown") for u in paper.transformers)
    feeder = dataclasses.replace(paper, transformers=unknown)
    assert resolved(Study(), feeder).transformers.unknown == UNKNOWN_CONNECTION[4]
    check_study(resolved(FULL_OF_PAPER, paper), paper, "s.toml")
    assert resolved(resolved(FULL_OF_PAPER, paper), paper) == resolved(FULL_OF_PAPER, paper)


FULL_OF_PAPER = dataclasses.replace(
    FULL, transformers=dataclasses.replace(FULL.transformers, yg_d=("T4", "T5"))
)


def test_the_population_is_all_that_decides_the_draws() -> None:
    """A demand changes no draw, and must not make a new population of the old sample."""
    demands = {"device", "detector", "reference", "certificate"}
    for table in TABLES:
        for field in dataclasses.fields(part_of(Study(), table)):
            if f"{table}.{field.name}" in TABLES:
                continue
            changed = with_value(Study(), (*table.split("."), field.name), FULL)
            is_demand = table in demands or (table, field.name) in {
                ("network", "settings"),
                ("events", "without"),
            }
            if changed != Study():
                same = dump_population(changed) == dump_population(Study())
                assert same == is_demand, (table, field.name)
    for part in ("groups", "correlations"):
        changed = with_value(Study(), (part,), FULL)
        assert dump_population(changed) != dump_population(Study())


def with_value(old: Any, keys: tuple[str, ...], source: Any) -> Any:
    """Return the part with the value at the keys taken from another."""
    value = getattr(source, keys[0])
    if len(keys) > 1:
        value = with_value(getattr(old, keys[0]), keys[1:], value)
    return dataclasses.replace(old, **{keys[0]: value})


# ---- the grids ----


def test_the_default_grids_hold_the_decimals_themselves() -> None:
    i, z, v = Device().i_grid(), Device().z_grid(), Device().v_grid_pu()
    assert i == tuple(float(f"{k // 10}.{k % 10}") for k in range(1, 101))
    assert len(z) == 750
    assert (z[499], z[500], z[-1]) == (50.0, 51.0, 300.0)
    assert z[:500] == tuple(float(f"{k // 10}.{k % 10}") for k in range(1, 501))
    assert v == (0.002, 0.005, 0.01, 0.02, 0.03, 0.04, 0.05)
    assert i[2] == z[2] == 0.3 != 3 * 0.1
    for grid in (i, z, v):
        assert all(before < after for before, after in pairwise(grid))


@pytest.mark.parametrize(
    ("first", "last", "step"),
    [(0.025, 2.5, 0.025), (1e-05, 1e-03, 1e-05), (0.7, 7.0, 0.7), (5.0, 5.0, 0.1), (1, 7, 2)],
)
def test_steps_are_what_the_decimals_add_up_to(first: float, last: float, step: float) -> None:
    wanted = [Decimal(str(first))]
    while wanted[-1] < Decimal(str(last)):
        wanted.append(wanted[-1] + Decimal(str(step)))
    values = Steps(first=first, last=last, step=step).values()
    assert values == tuple(float(number) for number in wanted)


def test_the_grid_of_current_is_in_primary_amperes_whatever_the_unit() -> None:
    """Each the float nearest to the product of the decimals."""
    per_unit = Device(unit="pu", i_set=Steps(first=0.001, last=0.1, step=0.001))
    assert per_unit.i_grid() == Device().i_grid()
    odd = Device(unit="pu", i_set=Steps(first=0.05, last=0.2, step=0.05), ct_primary_a=0.7)
    assert odd.i_grid() == (0.035, 0.07, 0.105, 0.14)
    assert Device(ct_primary_a=600.0).i_grid() == Device().i_grid()


def test_a_grid_that_does_not_rise_is_not_given_out() -> None:
    steps = Steps(first=1.0, last=2.0, step=0.5)
    with pytest.raises(InputError, match="must hold numbers that rise"):
        Device(z_set_ohm=(steps, steps)).z_grid()
    with pytest.raises(InputError, match="must have a step > 0"):
        Steps(first=1.0, last=2.0, step=0.0).values()


# ---- the documentation ----


@pytest.mark.parametrize(
    ("heading", "fields"),
    [
        ("Top level", DOCUMENT),
        ("`[events]`", EVENTS),
        ("`[[groups]]`", GROUPS),
        ("`[[correlations]]`", CORRELATIONS),
        ("Steps", STEPS),
        ("States", STATES),
        *((f"`[{table}]`", fields) for table, fields in TABLES.items() if table != "events"),
    ],
)
def test_the_documented_fields_are_the_ones_checked(
    heading: str, fields: tuple[Field, ...]
) -> None:
    _, _, after = DOC.read_text(encoding="utf-8").partition(f"### {heading}\n")
    assert markdown_table(fields) in after.partition("\n#")[0]


@pytest.mark.parametrize("table", [table for table in TABLES if table != "events"])
def test_every_value_of_a_study_has_its_field(table: str) -> None:
    names = [field.name for field in dataclasses.fields(part_of(Study(), table))]
    assert [field.name for field in TABLES[table]] == names


def test_every_class_of_events_is_in_the_document() -> None:
    names = [field.name for field in dataclasses.fields(Events)]
    assert [field.name for field in EVENTS] == names
    assert set(names) - {"without"} == set(CLASSES) - {"open_three", "energisation"}
    assert [table for table in TABLES if table.startswith("events.")] == [
        f"events.{name}" for name in names[1:]
    ]
    text = DOC.read_text(encoding="utf-8").partition("## Classes of events\n")[2]
    rows = [
        line.split(" | ")[0] for line in text.partition("\n\nA class is left out")[0].split("\n")
    ]
    assert set(re.findall(r"`(\w+)`", " ".join(rows))) == set(CLASSES)


def test_rows_of_the_document_describe_what_is_in_them() -> None:
    for fields, part in ((GROUPS, Group), (STATES, SwitchState), (CORRELATIONS, Correlation)):
        assert [field.name for field in fields] == [f.name for f in dataclasses.fields(part)]


def test_what_the_document_says_of_unknown_connections() -> None:
    text = " ".join(DOC.read_text(encoding="utf-8").split())
    said = {
        wires: ", ".join(
            f"{name.replace('D', 'Δ')} {f'{weight:g}'[1:]}"
            for name, weight in zip(choices.values, choices.weights, strict=True)
        )
        for wires, choices in UNKNOWN_CONNECTION.items()
    }
    assert f"with four, {said[4]}; with three, {said[3]}." in text


def test_what_the_document_says_of_distributions_and_quantities() -> None:
    text = DOC.read_text(encoding="utf-8")
    said = re.findall(r"^  \| (`.*`) \|", text, re.MULTILINE)
    written = [piece for cell in said for piece in re.findall(r"`([^`]*)`", cell)]
    kinds = {type(study("[loads]", f"level = {piece}").loads.level) for piece in written}
    assert kinds == {Fixed, Uniform, Normal, Lognormal, Triangular, Integers, Values}
    for name in (*SCALARS, *WIRING_KINDS):
        assert f"`{name}`" in text


def test_the_documented_example_and_its_faults() -> None:
    text = DOC.read_text(encoding="utf-8")
    example = text.partition("```toml\n")[2].partition("```")[0]
    study_from_toml(example, "study.toml")
    for old, new in (
        ("level = [0.4, 1.1]", "level = [1.1, 0.4]"),
        ("within = [0.5, 2]", "within = [5, 20]"),
        ("yg_d_count = [1, 2]", "yg_d_count = [1, 3]"),
        ('"motors.share"', '"motor.share"'),
        ("kw = [5, 200]", "kv = [5, 200]"),
        ("last = 20, step = 0.5", "last = 20, step = 0.4"),
    ):
        assert old in example
        example = example.replace(old, new, 1)
    with pytest.raises(InputError) as caught:
        study_from_toml(example, "study.toml")
    assert text.partition("```text\n")[2].partition("\n```")[0] == str(caught.value)
