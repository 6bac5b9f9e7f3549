"""Malformed feeder files: a folder each, with the message that its faults must give.

The messages are written by hand or read over by one; a case without its message fails.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from openphase.model import InputError, read_feeder
from openphase.studies.cli import main

CASES = sorted((Path(__file__).parents[1] / "malformed" / "feeder").iterdir())


def said_of(case: Path, text: str) -> str:
    """Return a message with the files of the case named as from its own folder."""
    return text.replace(f"{case}/", "")


def test_there_are_cases() -> None:
    assert len(CASES) >= 20


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_fault_is_named_at_once(case: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_feeder(case / "feeder.toml")
    expected = (case / "message.txt").read_text(encoding="utf-8")
    assert said_of(case, f"{caught.value}\n") == expected


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_check_ends_with_the_message_alone(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(case / "feeder.toml")]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said_of(case, said.err) == (case / "message.txt").read_text(encoding="utf-8")
