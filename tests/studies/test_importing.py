"""The verb ``import``: what it writes, what it says, and where OpenDSS files may stand."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from dss_circuits import CIRCUITS, REGULATORS, script

from openphase.model.reading.feeder_file import read_feeder
from openphase.studies.cli import main

CIRCUIT = script(
    (
        *REGULATORS["three"],
        *CIRCUITS["transposed phases"][1:2],
        "new line.on bus1=c bus2=d linecode=oh length=2 units=mi",
        "new load.end bus1=d phases=3 kv=12.47 kw=400 pf=0.95",
    )
)


@pytest.fixture
def circuit(tmp_path: Path) -> Path:
    pytest.importorskip("dss", reason="needs the extra: pip install 'openphase[opendss]'")
    path = tmp_path / "town.dss"
    path.write_text(CIRCUIT, encoding="utf-8")
    return path


def run(*words: object) -> int:
    return main([str(word) for word in words])


def test_it_writes_the_feeder_with_points_and_nothing_else(
    circuit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = circuit.parent / "town.toml"
    assert run("import", circuit, "-o", out) == 0
    assert {path.name for path in circuit.parent.iterdir()} == {"town.dss", "town.toml"}
    feeder = read_feeder(out)
    assert feeder.imported_from == "town.dss"
    assert feeder.points
    assert feeder.sections
    answer = capsys.readouterr().out
    assert "regulator r at taps 8, -2, 1" in answer
    assert feeder.points[0].name in answer
    assert all(len(line) <= 100 for line in answer.splitlines())


def test_json_is_one_object_and_the_report_files_hold_it(
    circuit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page, data = circuit.parent / "town.md", circuit.parent / "report.json"
    assert run("import", circuit, "--report", page) == 0
    capsys.readouterr()
    assert run("import", circuit, "--report", data, "--json") == 0
    told = json.loads(capsys.readouterr().out)
    kept = json.loads(data.read_text(encoding="utf-8"))
    assert kept == told
    assert {row["mode"] for row in told["opendss"]} == {"snap", "direct"}
    assert max(row["largest_pu"] for row in told["opendss"]) < 1e-6
    assert page.read_text(encoding="utf-8").startswith("# Import of town.dss")
    assert "told" not in {path.stem for path in circuit.parent.iterdir()}


def test_points_may_be_given(circuit: Path, capsys: pytest.CaptureFixture[str]) -> None:
    points, out = circuit.parent / "points.csv", circuit.parent / "town.toml"
    points.write_text("name,bus,line\nHEAD,s,trunk\nEND,c,on\n", encoding="utf-8")
    assert run("import", circuit, "-o", out, "--points", points) == 0
    assert [point.name for point in read_feeder(out).points] == ["HEAD", "END"]
    assert "points.csv" in capsys.readouterr().out


def test_a_reactor_at_the_head_has_no_measuring_point(circuit: Path) -> None:
    text = CIRCUIT.replace(" bus1=s bus2=m ", " bus1=h bus2=m ")
    circuit.write_text(text + "new reactor.head bus1=s bus2=h r=0.01 x=0.3\n", encoding="utf-8")
    out = circuit.parent / "town.toml"
    assert run("import", circuit, "-o", out) == 0
    feeder = read_feeder(out)
    assert "reactor.head" in {line.name for line in feeder.lines}
    assert (feeder.points[0].bus, feeder.points[0].line) == ("h", "trunk")


def test_a_reduced_feeder_says_its_error(circuit: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = circuit.parent / "town.toml"
    assert run("import", circuit, "-o", out, "--reduce", "--json") == 0
    assert "reduction" in json.loads(capsys.readouterr().out)
    assert read_feeder(out).loads
    assert run("check", out) == 0
    assert "(from town.dss, laterals and low voltage folded)" in capsys.readouterr().out


@pytest.mark.parametrize("words", [(), ("-o", "town.dss"), ("--report", "town.txt")])
def test_outputs_are_asked_for_before_anything_is_read(
    words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("import", "nowhere.dss", *words) == 2
    assert "must be" in capsys.readouterr().err


def test_other_verbs_take_the_file_itself(
    circuit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("check", circuit, "--json") == 0
    assert json.loads(capsys.readouterr().out)["imported_from"] == "town.dss"


def test_taps_may_be_those_at_which_the_controls_settle(
    circuit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = circuit.parent / "file.toml", circuit.parent / "settled.toml"
    assert run("import", circuit, "-o", files[0]) == 0
    assert run("import", circuit, "-o", files[1], "--solve-controls") == 0
    assert "controls settle" in capsys.readouterr().out
    (kept,), (settled,) = (read_feeder(file).regulators for file in files)
    assert kept.taps == (8, -2, 1)
    assert settled.taps != kept.taps


def test_what_cannot_be_imported_ends_with_code_2(
    circuit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    more = "new isource.x bus1=m phases=3 amps=1\n"
    circuit.write_text(CIRCUIT + more, encoding="utf-8")
    out = circuit.parent / "town.toml"
    assert run("import", circuit, "-o", out) == 2
    assert "--drop isource.x" in capsys.readouterr().err
    assert not out.exists()
    assert run("import", circuit, "-o", out, "--drop", "isource.x") == 0


def test_folding_is_measured_down_to_the_least_load_that_was_measured(
    circuit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    peaks, out = circuit.parent / "peaks.csv", circuit.parent / "town.toml"
    peaks.write_text("point,max_kw,min_kw\ns,300,30\n", encoding="utf-8")
    assert run("import", circuit, "-o", out, "--peaks", peaks, "--reduce", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["reduction"]["measured"]["levels"] == pytest.approx([0.1, 1.0], rel=0.05)


def test_faults_of_the_circuit_and_of_the_tables_come_in_one_round(
    circuit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    more = ("new isource.x bus1=m phases=3 amps=1", "edit vsource.source sequence=neg")
    circuit.write_text("\n".join((CIRCUIT, *more, "")), encoding="utf-8")
    tables = {
        "transformers": "unit,connection\nmill,Dzn1\n",
        "points": "name\nA\n",
        "peaks": "point,max_a\nM1,-3\n",
    }
    words: list[object] = ["--drop", "line.trunc"]
    for name, text in tables.items():
        path = circuit.parent / f"{name}.csv"
        path.write_text(text, encoding="utf-8")
        words += [f"--{name}", path]
    assert run("import", circuit, "-o", circuit.parent / "town.toml", *words) == 2
    said = capsys.readouterr().err
    for fault in (
        "transformers.csv:2: column 'connection' must be one of",
        "points.csv:1: column 'bus' must be there",
        "peaks.csv:2: column 'max_a' must be a number >= 0",
        "--drop must be an element of the circuit",
        "sequence must be pos",
        "--drop isource.x",
        "6 faults",
    ):
        assert fault in said


def test_lines_and_classes_that_are_refused_come_in_one_round(
    circuit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    more = (
        "cd elsewhere",
        "new isource.x bus1=m phases=3 amps=1",
        "new isource.y bus1=m phases=3 amps=1",
        "new autotrans.z phases=3 buses=(m n)",
    )
    circuit.write_text("\n".join((CIRCUIT, *more, "")), encoding="utf-8")
    words = ("-o", circuit.parent / "town.toml", "--points", circuit.parent / "none.csv")
    assert run("import", circuit, *words, "--drop", "ISource.*") == 2
    said = capsys.readouterr().err
    assert "leaves the circuit's files" in said
    assert "autotrans 'z' cannot be imported: a class that has no model; --drop autotrans.z" in said
    assert "none.csv" in said
    assert "isource" not in said
