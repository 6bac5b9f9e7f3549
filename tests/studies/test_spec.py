"""Study files: what they say, what is wrong with them, and the grids of settings in them."""

from __future__ import annotations

import dataclasses
from decimal import Decimal
from itertools import pairwise
from pathlib import Path

import pytest

from openphase.model import Feeder, InputError, load_feeder, shipped_feeders
from openphase.model.fields import Field, markdown_table
from openphase.studies.run.spec import (
    Ambient,
    CertificateDemand,
    DetectorOptions,
    Device,
    Instruments,
    LoadDraw,
    LoadStepDraw,
    NetworkState,
    OpenPhaseDraw,
    ReferenceSettings,
    SourceStepDraw,
    Steps,
    Study,
    TransformerDraw,
    check_study,
    default_study,
    dump_study,
    read_study,
    study_from_toml,
)
from openphase.studies.run.spec_fields import DOCUMENT, EVENTS, STEPS, TABLES

DOC = Path(__file__).parents[2] / "docs" / "study-file.md"

FULL = Study(
    loads=LoadDraw(level=(0.5, 0.9), each=(1.0, 1.0), exponent=(0.5, 1.5), exponent_spread=0.0),
    transformers=TransformerDraw(yg_d=("T4", 'the "old" Δ'), yg_d_count=(1, 2)),
    ambient=Ambient(source_pct=0.0, load_pct=2.0),
    network=NetworkState(closed=("R4",)),
    open_phase=OpenPhaseDraw(two_phase_share=1.0),
    load_step=LoadStepDraw(kw=(1.0, 2.0), single_phase_share=0.0, exponent=(1.0, 1.0)),
    source_step=SourceStepDraw(pct=(0.0, 3.0)),
    instruments=Instruments(tve_pct=1.0, current_floor_a=0.0),
    device=Device(
        i_set_a=Steps(first=0.5, last=20.0, step=0.5),
        z_set_ohm=(Steps(first=1.0, last=9.0, step=1.0),),
        v_set_pct=(1.0, 2.5),
        ct_primary_a=600.0,
    ),
    detector=DetectorOptions(dt_ms=1000.0, delay_ms=0.0, negative_sign=False),
    reference=ReferenceSettings(i_set_a=2.0, v_set_pct=4.0, z_set_ohm=3.0),
    certificate=CertificateDemand(confidence=0.9, target=1e-05, find_at_least=0.0, margin=1.0),
)
"""Differs from the defaults in every field."""


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


def test_the_full_study_leaves_no_field_at_its_default() -> None:
    for part in dataclasses.fields(Study):
        for field in dataclasses.fields(getattr(FULL, part.name)):
            values = [getattr(getattr(s, part.name), field.name) for s in (FULL, Study())]
            assert values[0] != values[1], (part.name, field.name)


@pytest.mark.parametrize("written", [Study(), FULL, default_study("paper")])
def test_what_is_written_reads_back_the_same(written: Study) -> None:
    text = dump_study(written)
    assert study_from_toml(text, "dumped") == written
    assert dump_study(study_from_toml(text, "dumped")) == text


def test_a_dump_writes_every_default_out() -> None:
    text = dump_study(Study())
    for table, fields in TABLES.items():
        _, _, after = text.partition(f"[{table}]\n")
        keys = [line.split(" = ")[0] for line in after.partition("\n[")[0].splitlines() if line]
        assert keys == [field.name for field in fields if field.name != "closed"]


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
    assert shipped == Study(
        loads=LoadDraw(
            level=(0.25, 1.0), each=(0.8, 1.2), exponent=(0.0, 2.0), exponent_spread=0.3
        ),
        transformers=TransformerDraw(yg_d=("T4", "T5", "T6"), yg_d_count=(1, 3)),
        ambient=Ambient(source_pct=0.3, load_pct=1.0),
        network=NetworkState(closed=()),
        open_phase=OpenPhaseDraw(two_phase_share=0.2),
        load_step=LoadStepDraw(kw=(10.0, 500.0), single_phase_share=0.5, exponent=(0.0, 2.0)),
        source_step=SourceStepDraw(pct=(-5.0, 5.0)),
        instruments=Instruments(tve_pct=0.05, current_floor_a=0.05),
        device=Device(
            i_set_a=Steps(first=0.1, last=10.0, step=0.1),
            z_set_ohm=(
                Steps(first=0.1, last=50.0, step=0.1),
                Steps(first=51.0, last=300.0, step=1.0),
            ),
            v_set_pct=(0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0),
            ct_primary_a=100.0,
        ),
        detector=DetectorOptions(dt_ms=800.0, delay_ms=300.0, negative_sign=True),
        reference=ReferenceSettings(i_set_a=1.0, v_set_pct=5.0, z_set_ohm=5.0),
        certificate=CertificateDemand(confidence=0.95, target=1e-4, find_at_least=0.5, margin=1.25),
    )


def test_the_paper_s_study_differs_from_the_defaults_by_what_names_its_parts() -> None:
    shipped = default_study("paper")
    assert shipped == Study(transformers=shipped.transformers, network=shipped.network)


@pytest.mark.parametrize("name", shipped_feeders())
def test_the_study_of_every_shipped_feeder_fits_it(name: str) -> None:
    check_study(default_study(name), load_feeder(name), name)


def test_other_feeders_have_the_defaults() -> None:
    assert default_study("papers") == default_study("../data/paper") == Study()


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
            "3: events: load_step: kw must hold numbers > 0, got [0, 500]",
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
            ("[transformers]", 'yg_d = ["T4"]', "yg_d_count = [0, 1.0]"),
            "4: transformers: yg_d_count must be [least, most], whole numbers >= 0,"
            " least <= most, got [0, 1.0]",
        ),
        (
            ("[instruments]", "tve_pct = -0.05"),
            "3: instruments: tve_pct must be 0 to 100, got -0.05",
        ),
        (
            ("[device]", "i_set_a = 1.0"),
            "3: device: i_set_a must be { first = ..., last = ..., step = ... }, got 1.0",
        ),
        (
            ("[device]", "i_set_a = { first = 0.1, last = 1.0 }"),
            "3: device: i_set_a: step is missing (a finite number, > 0)",
        ),
        (
            ("[device]", "i_set_a = { first = 0.1, last = 1.0, step = 0.2 }"),
            "3: device: i_set_a must reach last from first in whole steps,"
            " got { first = 0.1, last = 1.0, step = 0.2 }",
        ),
        (
            ("[device]", "i_set_a = { first = 2, last = 1, step = 1 }"),
            "3: device: i_set_a must have a step > 0 and last >= first,"
            " got { first = 2, last = 1, step = 1 }",
        ),
        (
            ("[device]", "i_set_a = { first = 1, last = 1e300, step = 1e-300 }"),
            "3: device: i_set_a must hold at most 10000 numbers,"
            " got { first = 1, last = 1e+300, step = 1e-300 }",
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
            ("[device]", "i_set_a = { first = 1, last = 2, step = 1, sept = 1 }"),
            "3: device: i_set_a: sept is not a known key (did you mean 'step'?)",
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
        "s.toml:6: device: ct_primary_a must be a finite number, A, > 0, got nan",
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
        transformers=TransformerDraw(yg_d=("T4", "T44", "mill"), yg_d_count=(0, 3)),
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
        transformers=TransformerDraw(yg_d=("T4", "T4"), yg_d_count=(0, 3)),
        open_phase=OpenPhaseDraw(two_phase_share=1.5),
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
        ("Steps", STEPS),
        *((f"`[{table}]`", fields) for table, fields in TABLES.items()),
    ],
)
def test_the_documented_fields_are_the_ones_checked(
    heading: str, fields: tuple[Field, ...]
) -> None:
    _, _, after = DOC.read_text(encoding="utf-8").partition(f"### {heading}\n")
    assert markdown_table(fields) in after.partition("\n#")[0]


@pytest.mark.parametrize("table", TABLES)
def test_every_value_of_a_study_has_its_field(table: str) -> None:
    part = getattr(Study(), table.rpartition(".")[2])
    assert [field.name for field in TABLES[table]] == [f.name for f in dataclasses.fields(part)]


def test_the_documented_example_and_its_faults() -> None:
    text = DOC.read_text(encoding="utf-8")
    example = text.partition("```toml\n")[2].partition("```")[0]
    study_from_toml(example, "study.toml")
    for old, new in (
        ("level = [0.4, 1.1]", "level = [1.1, 0.4]"),
        ("yg_d_count = [1, 2]", "yg_d_count = [1, 3]"),
        ("kw = [5, 200]", "kv = [5, 200]"),
        ("last = 20, step = 0.5", "last = 20, step = 0.4"),
    ):
        assert old in example
        example = example.replace(old, new, 1)
    with pytest.raises(InputError) as caught:
        study_from_toml(example, "study.toml")
    assert text.partition("```text\n")[2].partition("\n```")[0] == str(caught.value)
