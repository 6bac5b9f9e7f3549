"""Study files: what they say, what is wrong with them, and the grids of settings in them."""

from __future__ import annotations

import dataclasses
import pickle
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

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
    Quantiles,
    Triangular,
    Uniform,
    Values,
)
from openphase.studies.spec.events import (
    WIRING_KINDS,
    CapacitorStepDraw,
    DerRampDraw,
    DerTripDraw,
    EarthFaultDraw,
    FallenDraw,
    LineFaultDraw,
    LoadSwapDraw,
    MotorStartDraw,
    OpenWithLoadStepDraw,
    ReclosingDraw,
    RegulatorTapDraw,
    SinglePoleDraw,
    StepWithTapDraw,
    WiringDraw,
)
from openphase.studies.spec.fields import (
    TABLES,
    part_of,
)
from openphase.studies.spec.parts import UNKNOWN_CONNECTION
from openphase.studies.spec.study_file import (
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
    MeasuredLoad,
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
from openphase.studies.spec.values import distribution_text

FULL = Study(
    loads=LoadDraw(
        level=Normal(mean=0.6, sd=0.2, low=0.2, high=1.1),
        each=Fixed(value=1.0),
        exponent=Triangular(low=0.5, mode=1.0, high=1.5),
        exponent_spread=0.0,
    ),
    measured=(
        MeasuredLoad(point="R2", level=Quantiles(values=(0.1, 0.1, 0.7, 1.0))),
        MeasuredLoad(point="R5", level=Uniform(low=0.2, high=1.0)),
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
        open_with_der_trip=DerTripDraw(share=Fixed(value=1.0)),
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
    assert FULL.measured
    assert FULL.correlations


@pytest.mark.parametrize("written", [Study(), FULL, ONE_STATE, default_study("paper")])
def test_what_is_written_reads_back_the_same(written: Study) -> None:
    text = dump_study(written)
    assert study_from_toml(text, "dumped") == written
    assert dump_study(study_from_toml(text, "dumped")) == text


def test_a_study_goes_to_another_process_unchanged() -> None:
    twin = pickle.loads(pickle.dumps(FULL))
    assert twin == FULL
    assert hash(twin) == hash(FULL)


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
    assert not shipped.events.without
    assert not shipped.correlations
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


@pytest.mark.parametrize(
    ("drawn", "text"),
    [
        (Fixed(value=0.5), "0.5"),
        (Uniform(low=0.25, high=1.0), "0.25 to 1"),
        (Uniform(low=1.0, high=1.0), "1"),
        (Integers(least=1, most=3), "1 to 3"),
        (
            Normal(mean=0.6, sd=0.2, low=0.2, high=1.1),
            "normal, 0.6 ± 0.2, from 0.2 to 1.1",
        ),
        (
            Lognormal(median=10.0, sigma=1.5, low=0.1, high=100.0),
            "lognormal, median 10, σ 1.5, from 0.1 to 100",
        ),
        (Triangular(low=0.0, mode=0.2, high=0.6), "0 to 0.6, likeliest 0.2"),
        (Values(values=(150.0, 300.0)), "150 or 300"),
        (Values(values=(1.0, 2.0, 3.0), weights=(1.0, 0.0, 3.0)), "1 (25 %) or 3 (75 %)"),
        (Choices(values=("thevenin",)), "thevenin"),
    ],
)
def test_a_distribution_in_words(drawn: Distribution | Choices, text: str) -> None:
    assert distribution_text(drawn) == text


# ---- setting groups ----


def test_without_groups_there_is_a_normal_one() -> None:
    assert study("[network]", 'closed = ["R4"]').setting_groups() == (
        Group(name="normal", closed=("R4",)),
    )
    named = study("[[groups]]", 'name = "tie"', 'closed = ["R4"]', 'opened = ["R1"]')
    assert named.setting_groups() == named.groups
    assert named.groups == (Group(name="tie", closed=("R4",), opened=("R1",)),)


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
