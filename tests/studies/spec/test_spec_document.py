"""The document of the study file says what the code does."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from openphase.model import InputError
from openphase.model.distributions import (
    Fixed,
    Integers,
    Lognormal,
    Normal,
    Quantiles,
    Triangular,
    Uniform,
    Values,
)
from openphase.model.reading.fields import Field, markdown_table
from openphase.studies.spec.correlations import SCALARS
from openphase.studies.spec.events import (
    CLASSES,
    WIRING_KINDS,
)
from openphase.studies.spec.fields import (
    CORRELATIONS,
    DOCUMENT,
    EVENTS,
    GROUPS,
    MEASURED,
    STATES,
    STEPS,
    TABLES,
    part_of,
)
from openphase.studies.spec.parts import UNKNOWN_CONNECTION
from openphase.studies.spec.study_file import (
    Correlation,
    Events,
    Group,
    Study,
    SwitchState,
    study_from_toml,
)

DOC = Path(__file__).parents[3] / "docs" / "study-file.md"


def study(*lines: str) -> Study:
    return study_from_toml("\n".join(("format = 1", *lines)), "s.toml")


@pytest.mark.parametrize(
    ("heading", "fields"),
    [
        ("Top level", DOCUMENT),
        ("`[events]`", EVENTS),
        ("`[[groups]]`", GROUPS),
        ("`[[measured]]`", MEASURED),
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
    assert kinds == {Fixed, Uniform, Normal, Lognormal, Triangular, Integers, Quantiles, Values}
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
