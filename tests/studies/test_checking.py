"""``check``: a summary per section, or every fault."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from openphase.model import Feeder, dump_feeder, feeder_from_toml, load_feeder, read_feeder
from openphase.studies.checking import summary
from openphase.studies.cli import main
from openphase.studies.show.check_text import check_text
from openphase.studies.show.feeder_layout import lay_out
from openphase.studies.spec.study_file import default_study


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
    "yg_d_unknown": ["a bank nobody knows"],
    "units": [f"transformer {n}" for n in range(40)],
    "ders": ["Solarpark"],
    "capacitors": [],
    "inline_transformers": [],
    "shifted_by": ["Umspanner"],
    "laterals_km_by_phases": [1.5, 0.25, 0.0],
    "regulators": [f"Längsregler {n}" for n in range(9)],
    "switches": ["Schalter C"],
}


@pytest.mark.parametrize("local", ["A", "Schalter A", "Umspannwerk Süd", "x" * 90])
def test_long_names_and_lists_fit_the_page(local: str) -> None:
    found = summary(load_feeder("paper"), default_study("paper"))
    found["feeder"] = "a feeder with a long name " * 6
    found["loop"] = [f"tie {n}" for n in range(40)]
    found["sections"] = [{**LONG, "local": local}] * 2
    lines = check_text(found).splitlines()
    assert max(map(len, lines)) <= 100
    said = " ".join(" ".join(lines).split())
    for word in ("transformer", "Schalter C", "12.345", "400.011", "1000 .. 12000", "tie 39"):
        assert word in said
    for word in ("Solarpark", "Längsregler 8", "nobody", "knows?"):
        assert word in said
    assert all(said.count(word) for word in local.split())


@pytest.mark.parametrize("local", ["R1", "Umspannwerk Süd"])
def test_heads_stand_above_their_values(local: str) -> None:
    found = summary(load_feeder("paper"), default_study("paper"))
    for row in found["sections"]:
        row["local"] = local
    lines = check_text(found).splitlines()
    n = next(n for n, line in enumerate(lines) if "downstream kW" in line)
    head, row = lines[n : n + 2]
    for title, value in (("km", "3"), ("|Z1| Ω", "0.390"), ("downstream kW", "200 .. 1920")):
        assert head.index(title) + len(title) == row.index(f" {value} ") + 1 + len(value)
    assert head.index("inside") == row.index("T1")


EVERYTHING = """\
format = 1
name = "everything"
imported_from = "everything.dss"

[source]
bus = "SUB"
kv_ll = 12.47
z1_ohm = [0.1, 0.9]
neutral = "petersen"
neutral_ohm = [2, 300]
"""


def line(name: str, start: str, end: str) -> str:
    return (
        f'[[lines]]\nname = "{name}"\nfrom = "{start}"\nto = "{end}"\nlength_km = 2\n'
        "z1_ohm_per_km = [0.2, 0.4]\nz0_ohm_per_km = [0.5, 1.2]\n"
    )


def rows(table: str, *texts: str) -> str:
    return "".join(f"[[{table}]]\n{text}\n" for text in texts)


UNIT = "rating_kva = 500\nleakage_pu = [0.01, 0.05]"
KINDS = ("units", "loads", "ders", "capacitors", "regulators", "switches")

EVERYTHING += (
    # the trunk: SUB -A- B1 -booster- B2 -B- B3 -link- B4 -C- B5; laterals from B2 and B3
    line("A", "SUB", "B1")
    + line("B", "B2", "B3")
    + line("C", "B4", "B5")
    + line("watched", "B2", "W")
    + line("lateral", "B3", "L")
    + rows("regulators", 'name = "booster"\nfrom = "B1"\nto = "B2"\ntaps = [2, 0, -1]')
    + rows("switches", 'name = "link"\nfrom = "B3"\nto = "B4"\nclosed = true')
    + rows(
        "transformers",
        f'name = "at SUB"\nbus = "SUB"\nconnection = "Yg/D"\n{UNIT}',
        f'name = "at end"\nline = "B"\nat = 1\nconnection = "unknown"\n{UNIT}',
        f'name = "tee"\nline = "lateral"\nat = 0.5\nconnection = "Yg/D"\n{UNIT}',
        f'name = "beyond"\nbus = "B5"\nconnection = "D/D"\n{UNIT}',
        f'name = "other"\nbus = "W"\nconnection = "D/Yg"\n{UNIT}',
    )
    + rows(
        "loads",
        'name = "mill"\ntransformer = "tee"\nkw = 300',
        'name = "farm"\ntransformer = "beyond"\nkw = 60',
        'name = "inn"\nbus = "L"\nkw = 40\nmotor_share = 0.5',
    )
    + rows(
        "ders",
        'name = "roof"\ntransformer = "at end"\nkw = 50\nmodel = "constant_current"',
        'name = "hydro"\nbus = "B5"\nkw = 90\nmodel = "generator"\n'
        "z1_ohm = [1, 20]\nz2_ohm = [1, 25]",
    )
    + rows("capacitors", 'name = "bank"\nline = "C"\nat = 0\nkvar = 300')
    + rows(
        "points",
        'name = "R1"\nbus = "SUB"\nline = "A"',
        'name = "R2"\nbus = "B4"\nline = "C"',
        'name = "R3"\nbus = "B5"\nline = "C"',
        'name = "R4"\nbus = "W"\nline = "watched"',
    )
    + rows("sections", 'local = "R1"\nremote = "R2"', 'local = "R2"\nremote = "R3"')
)


def test_everything_is_counted_where_it_stands() -> None:
    found = summary(feeder_from_toml(EVERYTHING, "f"), default_study("none"))
    first, second = found["sections"]
    assert {kind: first[kind] for kind in KINDS} == {
        "units": ["at end", "tee"],
        "loads": ["mill", "inn"],
        "ders": ["roof"],
        "capacitors": ["bank"],
        "regulators": ["booster"],
        "switches": ["link"],
    }
    assert (first["yg_d"], first["yg_d_unknown"]) == (["tee"], ["at end"])
    assert first["length_km"] == pytest.approx(4.0)
    assert first["downstream_kw_nominal"] == [400.0, 400.0]
    # both points stand inwards of their buses, whatever hangs there is outside
    assert {kind: second[kind] for kind in KINDS} == {kind: [] for kind in KINDS}
    assert second["downstream_kw_nominal"] == [60.0, 60.0]


def test_everything_is_listed_with_what_was_assumed() -> None:
    feeder = feeder_from_toml(EVERYTHING, "f")
    found = summary(feeder, default_study("none"))
    text = check_text(found)
    assert max(map(len, text.splitlines())) <= 100
    assert sum(found["values"].values()) == len(feeder.origins)
    for said in (
        "12.47 kV, 4 wires, neutral petersen",
        "\n?: the connection is unknown\n",
        "DER: roof (50 kW, constant_current), hydro (90 kW, generator)",
        "capacitors: bank (300 kvar, wye)",
        "regulators: booster (taps +2, 0, -1)",
        "note: inside R1–R2 the taps of booster may change, which looks like an open phase",
        f"values: {found['values']['imported']} imported, ",
        " 1 unknown (from everything.dss)",
        "- transformers of unknown connection are drawn by a study; until then they count as Yg/Yg",
        "- transformers: connection unknown (at end)",
        "- source: frequency_hz 60.0",
        "- loads: motor_share 0.0 (mill, farm)",
    ):
        assert said in text


def test_the_schematic_names_everything(tmp_path: Path) -> None:
    path = tmp_path / "everything.toml"
    path.write_text(EVERYTHING, encoding="utf-8")
    said = "\n".join(mark.text for mark in lay_out(read_feeder(path)).units).splitlines()
    for name in ("at SUB", "tee", "300 kW", "inn", "hydro", "bank", "300 kvar", "booster"):
        assert said.count(name) == 1
    assert said[said.index("at end") + 3] == "50 kW DER"
    picture = tmp_path / "feeder.png"
    assert main(["check", str(path), "--plot", str(picture)]) == 0
    assert picture.stat().st_size > 10_000


def test_a_feeder_without_sections_says_so() -> None:
    feeder = replace(load_feeder("paper"), sections=())
    text = check_text(summary(feeder, default_study("paper")))
    assert "\nno sections: nothing to size\n" in text
    assert "downstream kW " not in text
    assert "(given so)" in text


def test_a_picture_without_a_name_has_the_feeders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["check", "paper", "--plot"]) == 0
    assert [file.name for file in tmp_path.iterdir()] == ["paper.png"]


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


def test_the_neutral_is_that_of_the_points() -> None:
    ieee37, ieee13 = (
        summary(load_feeder(name), default_study(name)) for name in ("ieee37", "ieee13")
    )
    assert (ieee37["wires"], ieee37["neutral"]) == (4, "solid")
    assert (ieee37["points_wires"], ieee37["points_neutral"]) == ([3], ["isolated"])
    said = " ".join(check_text(ieee37).split())
    assert "4 wires, neutral solid at the source (3 wires, neutral isolated at the points)," in said
    assert "4 wires, neutral solid, " in " ".join(check_text(ieee13).split())


TRANSPOSED = "lines without a code are transposed"
BALANCED = "what hangs behind transformers is balanced"
DER = "DER are balanced"


def test_only_what_the_feeder_has_is_assumed_of_it() -> None:
    def assumed(feeder: Feeder) -> set[str]:
        said = summary(feeder, default_study("none"))["assumed"]
        return {TRANSPOSED, BALANCED, DER} & set(said)

    everything = feeder_from_toml(EVERYTHING, "f")
    passive = replace(everything, ders=())
    bare = replace(
        passive,
        transformers=(),
        loads=tuple(load for load in everything.loads if load.transformer is None),
    )
    assert assumed(everything) == {TRANSPOSED, BALANCED, DER}
    assert assumed(passive) == {TRANSPOSED, BALANCED}
    assert assumed(bare) == {TRANSPOSED}
    assert assumed(load_feeder("ieee13")) == set()
