"""``check``: a summary per section, or every fault."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from openphase.model import dump_feeder, load_feeder
from openphase.studies.cli import main


def test_summary_of_the_paper_s_feeder(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "paper", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    rows = {(row["local"], row["remote"]): row for row in found["sections"]}
    assert rows["R2", "R3"]["downstream_kw_nominal"] == [400.0, 1000.0]
    assert rows["R2", "R3"]["downstream_kw"] == pytest.approx([400 * 0.2, 1000 * 1.2])
    assert rows["R3", "R4"]["downstream_kw_nominal"] == [0.0, 400.0]
    assert rows["R5", "R4b"]["downstream_kw_nominal"] == [0.0, 800.0]
    assert rows["R2", "R3"]["yg_d"] == ["T4"]
    assert rows["R3", "R4"]["yg_d_sampled"] == ["T5", "T6"]
    assert abs(complex(*rows["R5", "R4b"]["line_z1_ohm"])) == pytest.approx(1.3)
    assert found["loop"] == ["R4"]


def test_table_fits_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "paper"]) == 0
    out = capsys.readouterr().out
    assert max(len(line) for line in out.splitlines()) <= 100
    assert "no faults" in out


def test_plot_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "feeder.png"
    assert main(["check", "paper", "--plot", str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["check", "paper", "--plot", str(tmp_path / "none" / "x.png")]) == 1
    assert "cannot be written" in capsys.readouterr().err


def test_a_faulty_file_ends_with_all_its_faults(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bad.toml"
    text = dump_feeder(load_feeder("paper"))
    path.write_text(text.replace("length_km = 5.0", "length_km = -5.0"), encoding="utf-8")
    assert main(["check", str(path)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("length_km must be > 0, got -5.0") == 2
    assert "Traceback" not in said.err
