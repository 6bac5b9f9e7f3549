"""``check``: a summary per section, or every fault."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from openphase.model import dump_feeder, load_feeder
from openphase.studies.checking import _text, summary
from openphase.studies.cli import main
from openphase.studies.run.spec import default_study


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


LONG = {
    "local": "Schalter A",
    "remote": "Umspannwerk Nord",
    "length_km": 12.345,
    "line_z1_ohm": [3.0, 400.0],
    "downstream_kw": [1000.0, 12000.0],
    "yg_d": [f"transformer {n}" for n in range(9)],
    "yg_d_sampled": [],
    "units": [f"transformer {n}" for n in range(40)],
    "switches": ["Schalter C"],
}


@pytest.mark.parametrize("local", ["A", "Schalter A", "Umspannwerk Süd", "x" * 90])
def test_long_names_and_lists_fit_the_page(local: str) -> None:
    found = summary(load_feeder("paper"), default_study("paper"))
    found["feeder"] = "a feeder with a long name " * 6
    found["loop"] = [f"tie {n}" for n in range(40)]
    found["sections"] = [{**LONG, "local": local}] * 2
    lines = _text(found).splitlines()
    assert max(map(len, lines)) <= 100
    said = " ".join(" ".join(lines).split())
    for word in ("transformer", "Schalter C", "12.345", "400.011", "1000 .. 12000", "tie 39"):
        assert word in said
    assert all(said.count(word) for word in local.split())


@pytest.mark.parametrize("local", ["R1", "Umspannwerk Süd"])
def test_heads_stand_above_their_values(local: str) -> None:
    found = summary(load_feeder("paper"), default_study("paper"))
    for row in found["sections"]:
        row["local"] = local
    lines = _text(found).splitlines()
    n = next(n for n, line in enumerate(lines) if "downstream kW" in line)
    head, row = lines[n : n + 2]
    for title, value in (("km", "3"), ("|Z1| Ω", "0.390"), ("downstream kW", "200 .. 1920")):
        assert head.index(title) + len(title) == row.index(f" {value} ") + 1 + len(value)
    assert head.index("inside") == row.index("T1")


def test_a_feeder_without_sections_says_so() -> None:
    feeder = replace(load_feeder("paper"), sections=())
    text = _text(summary(feeder, default_study("paper")))
    assert "\nno sections: nothing to size\n" in text
    assert "downstream kW " not in text
    assert "(given so)" in text


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
