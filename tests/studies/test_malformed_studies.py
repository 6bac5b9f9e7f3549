"""Malformed study files: a folder each, with the message that its faults must give.

The messages are written by hand or read over by one; a case without its message fails.
Whatever else is done to a study file, it is read or refused, and never anything else.
"""

from __future__ import annotations

import contextlib
import random
import re
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from openphase import model
from openphase.model import Feeder, InputError, load_feeder
from openphase.model.reading.toml_file import read_text
from openphase.model.reading.toml_lines import locator
from openphase.studies.cli import main
from openphase.studies.spec.correlations import draw_scalars
from openphase.studies.spec.fields import CORRELATIONS, DOCUMENT, EVENTS, GROUPS, TABLES
from openphase.studies.spec.study_file import check_study, dump_study, read_study, study_from_toml

CASES = sorted((Path(__file__).parents[1] / "malformed" / "study").iterdir())
PAPER = (resources.files(model) / "data" / "paper.study.toml").read_text(encoding="utf-8")


def said_of(case: Path, text: str) -> str:
    """Return a message with the files of the case named as from its own folder."""
    return text.replace(f"{case}/", "")


@pytest.fixture(scope="module")
def paper() -> Feeder:
    return load_feeder("paper")


def test_there_are_cases() -> None:
    assert len(CASES) >= 8


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_fault_is_named_at_once(case: Path, paper: Feeder) -> None:
    path = case / "study.toml"
    with pytest.raises(InputError) as caught:
        check_study(read_study(path), paper, str(path), locator(read_text(path)))
    expected = (case / "message.txt").read_text(encoding="utf-8")
    assert said_of(case, f"{caught.value}\n") == expected


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_size_ends_with_the_message_alone(
    case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    assert main(["size", "paper", "--study", str(case / "study.toml"), "--out", str(out)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said_of(case, said.err) == (case / "message.txt").read_text(encoding="utf-8")
    assert not out.exists()


# ---- any other change ----

ODD = (
    "0", "-1", "1e308", "-1e308", "1e-320", "nan", "inf", "true", '""', "'a'", '"R4"', '"T4"',
    "[]", "[0, 0]", "[1, 2]", "[2, 1]", "[1, 2, 3]", "[-1, 0.5]", "{}", "[[1]]", "9" * 400,
    "[0, " + "9" * 400 + "]", '["R4"]', '["R4", "R4"]', '["loads.level", "ders.level"]', "[{}]",
    "{ normal = [1, 0.5], within = [0.5, 1] }", "{ normal = [1, 1e-320], within = [0, 1e308] }",
    "{ lognormal = [1, 1], within = [0, 2] }", "{ lognormal = [1e308, 1e308], within = [0, 1] }",
    "{ triangular = [0, 0, 1] }", "{ integers = [0, 1] }", "{ integers = [0, " + "9" * 400 + "] }",
    "{ values = [0, 1] }", "{ values = [], weights = [] }", "{ values = ['D/D'], weights = [1] }",
    "{ values = [1], weights = [0] }", "{ values = [[1]] }", "{ uniform = 1 }", "[{ first = 1 }]",
    "{ first = 1, last = 2, step = 1 }", "{ first = 1, last = 1e308, step = 1e-308 }",
    "[{ closed = ['R4'], opened = ['R1'] }]", "1979-05-27", '"\\u0000"', '"agree"', '"pu"', "0.5",
)  # fmt: skip


def mutated(text: str, rng: random.Random) -> str:
    """Return the text with a few lines lost, doubled, or given another value or key."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    fields = [DOCUMENT, EVENTS, GROUPS, CORRELATIONS, *TABLES.values()]
    keys = sorted({field.name for own in fields for field in own})
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        at = rng.randrange(len(lines))
        key = lines[at].partition("=")[0].strip()
        match rng.randrange(8):
            case 0:
                del lines[at]
            case 1:
                lines.insert(rng.randrange(len(lines)), lines[at])
            case 2 | 3:
                lines[at] = f"{key} = {rng.choice(ODD)}"
            case 4:
                lines.insert(at + 1, f"{rng.choice(keys)} = {rng.choice(ODD)}")
            case 5:
                table = rng.choice([*TABLES, "groups", "correlations", "events.transfer.states"])
                lines.insert(at, rng.choice([f"[[{table}]]", f"[{table}]"]))
            case 6:
                lines[at] = re.sub(r"\b\d+\.\d+", f"{rng.uniform(0, 2):.3f}", lines[at])
            case _:
                cut = rng.randrange(len(lines[at]) + 1)
                lines[at] = lines[at][:cut] + rng.choice("[]{}=\"'#,é\\") + lines[at][cut:]
    return "\n".join(lines)


def test_no_change_of_a_file_leads_to_anything_but_an_input_error(paper: Feeder) -> None:
    """What is accepted can also be drawn from, and is the same once written and read again."""
    rng = random.Random(11)
    accepted, messages = 0, []
    for _ in range(800):
        text = mutated(PAPER, rng)
        try:
            study = study_from_toml(text, "f.toml")
            check_study(study, paper, "f.toml", locator(text))
        except InputError as error:
            messages.append(str(error))
            continue
        accepted += 1
        assert study_from_toml(dump_study(study), "dumped") == study
        for values in draw_scalars(np.random.default_rng(1), study, 3).values():
            assert np.isfinite(values).all()
    assert all(messages)
    assert accepted > 80
    assert len(messages) > 500


@pytest.mark.parametrize("table", TABLES)
def test_no_value_of_any_field_does_either(table: str, paper: Feeder) -> None:
    for field in TABLES[table]:
        for odd in ODD:
            text = f"format = 1\n[{table}]\n{field.name} = {odd}\n"
            with contextlib.suppress(InputError):
                study = study_from_toml(text, "f.toml")
                check_study(study, paper, "f.toml")
                assert study_from_toml(dump_study(study), "dumped") == study
