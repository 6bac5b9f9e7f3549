"""A feeder without measuring points is given the default ones, and it is said."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from openphase.model import load_feeder, write_feeder
from openphase.studies.cli import main
from openphase.studies.loading import load_with_points
from openphase.studies.run.session import read_feeder


@pytest.fixture
def bare(tmp_path: Path) -> Path:
    """The paper's feeder without its points."""
    feeder = replace(load_feeder("paper"), points=(), sections=())
    path = tmp_path / "bare.toml"
    write_feeder(feeder, path)
    return path


def test_points_of_the_file_are_kept_and_nothing_is_said() -> None:
    feeder, said = load_with_points("paper")
    assert feeder == load_feeder("paper")
    assert said == ()


def test_check_prints_the_points_that_it_chose(
    bare: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(bare)]) == 0
    out = capsys.readouterr().out
    assert "by default: points: M1 at" in out
    assert max(map(len, out.splitlines())) <= 100
    assert main(["check", str(bare), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["points"][0] == "M1"
    assert found["points_by_default"]
    assert found["sections"]


def test_a_study_says_on_stderr_which_points_it_chose(
    bare: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    feeder = read_feeder(str(bare))
    assert feeder.sections
    assert "points: M1 at" in capsys.readouterr().err
