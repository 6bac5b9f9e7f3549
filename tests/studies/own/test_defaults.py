"""What a study takes where nothing is said: default points, and the study beside the feeder."""

import argparse
import json
from dataclasses import replace

import numpy as np
import pytest
from oracles.trees import line, random_tree

from openphase.model import load_feeder
from openphase.model.distributions import Uniform
from openphase.model.errors import InputError
from openphase.model.reading.feeder_file import dump_feeder
from openphase.studies.cli import main
from openphase.studies.own.levels import measured_study_text
from openphase.studies.run.session import read_feeder, read_own_study
from openphase.studies.spec.study_file import MeasuredLoad, Study, default_study, study_beside


@pytest.fixture
def bare(tmp_path):
    """The paper's feeder without points, in a file."""
    paper = load_feeder("paper")
    file = tmp_path / "bare.toml"
    file.write_text(dump_feeder(replace(paper, points=(), sections=())), encoding="utf-8")
    return file


def test_a_feeder_without_points_gets_the_default_ones_and_says_so(bare, capsys):
    feeder = read_feeder(str(bare))
    assert feeder.sections
    said = capsys.readouterr().err
    assert "no measuring points are given" in said
    assert all(f"{point.name} at {point.bus} on {point.line}" in said for point in feeder.points)
    assert read_feeder("paper") == load_feeder("paper")
    assert capsys.readouterr().err == ""


def test_the_study_beside_a_feeder_file_is_its_own(bare, capsys):
    args = argparse.Namespace(study=None, feeder=str(bare))
    feeder = read_feeder(str(bare))
    assert read_own_study(args, feeder) == Study() == default_study(str(bare))
    level = MeasuredLoad(point="M2", level=Uniform(low=0.1, high=1.0))
    beside = study_beside(bare)
    beside.write_text(measured_study_text([level], "peaks.csv"), encoding="utf-8")
    assert read_own_study(args, feeder).measured == (level,)
    assert str(beside) in capsys.readouterr().err
    other = bare.with_name("other.toml")
    other.write_text("format = 1\n", encoding="utf-8")
    assert read_own_study(argparse.Namespace(study=other, feeder=str(bare)), feeder) == Study()


def test_a_study_beside_that_does_not_fit_is_refused_by_its_name(bare):
    beside = study_beside(bare)
    beside.write_text('format = 1\n[[measured]]\npoint = "X"\nlevel = 1\n', encoding="utf-8")
    feeder = read_feeder(str(bare))
    with pytest.raises(InputError, match=r"bare\.study\.toml:3: measured #1: point must be a"):
        read_own_study(argparse.Namespace(study=None, feeder=str(bare)), feeder)


def test_a_feeder_without_three_phase_line_has_nothing_to_judge(tmp_path):
    feeder, _ = random_tree(np.random.default_rng(0), 1, 0)
    thin = replace(feeder, lines=(line("L1", "B0", "B1", phases="a"),), loads=())
    file = tmp_path / "thin.toml"
    file.write_text(dump_feeder(thin), encoding="utf-8")
    with pytest.raises(InputError, match="must name at least one section"):
        read_feeder(str(file))


def test_check_shows_the_load_that_was_measured(bare, capsys):
    def downstream(section):
        assert main(["check", str(bare), "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        row = next(own for own in found["sections"] if own["remote"] == section)
        return row["downstream_kw"], row["downstream_kw_nominal"]

    plain, nominal = downstream("M4")
    assert plain[1] == pytest.approx(nominal[1] * 1.2)
    text = '[[measured]]\npoint = "M3"\nlevel = [0.1, 0.5]\n'
    study_beside(bare).write_text(f"format = 1\n{text}", encoding="utf-8")
    measured, same = downstream("M4")
    assert same == nominal
    # all load beyond the section's near end lies beyond M3
    assert measured[1] == pytest.approx(nominal[1] * 0.5 * 1.2)
    assert main(["check", str(bare)]) == 0
    assert "by what was measured at M3 0.1 to 0.5" in capsys.readouterr().out
