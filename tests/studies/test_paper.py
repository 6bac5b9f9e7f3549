"""``openphase paper``: every figure to its printed digits, and the verb around it."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from openphase.model import load_feeder
from openphase.studies.cli import main
from openphase.studies.paper.cases import ideal_banks, open_phase_a, unit_at
from openphase.studies.paper.command import paper_groups, paper_result, paper_table
from openphase.studies.paper.courses import WINDOW_S, paper_panels
from openphase.studies.paper.printed import PRINTED, Group, Row
from openphase.studies.show.figures import save_png
from openphase.studies.show.paper_figures import paper_pictures, plot_panel


@pytest.fixture(scope="module")
def groups() -> tuple[Group, ...]:
    return paper_groups(load_feeder("paper"))


@pytest.fixture(scope="module")
def rows(groups: tuple[Group, ...]) -> dict[str, Row]:
    return {row.name: row for group in groups for row in group.rows}


#: the model's values to the digits at which two other programs have them
VALUES = {
    "dv_a_r3_pct": "9.289",
    "dv1_r3_pct": "3.323",
    "di_a_r3_a": "3.0845",
    "di_a_r2_a": "23.936",
    "z1_r1_external_ohm": "0.3901",
    "z1_r2_external_ohm": "0.3901",
    "z1_r2_ohm": "288.30",
    "di1_r2_a": "0.7979",
    "di2_r2_a": "0.7979",
    "di0_r2_a": "23.70",
    "z_a_1_ohm": "28.101",
    "z_a_2_ohm": "17.968",
    "z_a_3_ohm": "14.364",
    "eq_13_2_ohm": "15.7",
    "eq_13_3_ohm": "11.3",
    "t4_at_0.5": "27.46",
    "t4_at_0.75": "27.86",
    "t4_at_0.9": "28.10",
    "t4_at_1": "28.26",
    "ideal_banks": "30.75",
    "z0_3z1_1": "32.965",
    "z0_3z1_2": "23.494",
    "z0_3z1_3": "20.459",
    "loop_r2_ohm": "2.4051",
    "loop_r3_ohm": "2.4107",
    "loop_r2_052_ohm": "2.2054",
    "loop_r3_052_ohm": "2.2103",
    "z_pv_90_ohm": "12.93",
    "z_pv_0_ohm": "21.97",
    "pv_constant_current_ohm": "288.6",
    "pv_constant_current_di1_a": "0.32",
    "pv_constant_power_ohm": "703",
    "pv_constant_power_di1_a": "0.13",
}


@pytest.mark.parametrize("name", VALUES)
def test_the_model_s_value(name: str, rows: dict[str, Row]) -> None:
    row, wanted = rows[name], VALUES[name]
    assert not isinstance(row.model, str)
    assert f"{abs(row.model):.{row.digits}f}" == wanted


@pytest.mark.parametrize(
    ("name", "degrees"),
    [
        ("z1_r2_ohm", -179.3),
        ("loop_r2_ohm", -110.3),
        ("pv_constant_current_ohm", -178.9),
        ("pv_constant_power_ohm", -13.5),
    ],
)
def test_the_sign_of_the_impedance(name: str, degrees: float, rows: dict[str, Row]) -> None:
    z = rows[name].model
    assert isinstance(z, complex)
    assert math.degrees(math.atan2(z.imag, z.real)) == pytest.approx(degrees, abs=0.05)


def test_what_the_paper_s_settings_say(rows: dict[str, Row]) -> None:
    said = {name: row.model for name, row in rows.items() if name.startswith("verdict")}
    assert said == {
        "verdict_r2": "no: current",
        "verdict_r2_phases": "trip",
        "verdict_loop": "no: impedance",
        "verdict_loop_phases": "no: impedance",
        "verdict_pv_emf_90": "trip",
        "verdict_pv_emf_90_phases": "trip",
        "verdict_pv_emf_0": "trip",
        "verdict_pv_emf_0_phases": "trip",
        "verdict_pv_constant_current": "no: current",
        "verdict_pv_constant_current_phases": "trip",
        "verdict_pv_constant_power": "no: current",
        "verdict_pv_constant_power_phases": "trip",
    }


def test_every_figure_of_the_paper_stands_beside_ours(rows: dict[str, Row]) -> None:
    beside = {id(row.paper) for row in rows.values() if row.paper is not None}
    assert beside == {id(printed) for printed in PRINTED.values()}


def test_a_row_that_is_no_fit_moves_little_with_what_was_fitted(rows: dict[str, Row]) -> None:
    """T4 elsewhere and cores without X0: what claims not to rest on them keeps to 0.5 %."""
    feeder = unit_at(ideal_banks(load_feeder("paper")), "T4", 0.5)
    other = {
        "z1_r1_external_ohm": open_phase_a(feeder, at=0.4).z_ohm("R1", "R2"),
        "z1_r2_ohm": open_phase_a(feeder, at=0.4).z_ohm("R2", "R3"),
        "loop_r2_ohm": open_phase_a(feeder, at=0.4, tie_closed=True).z_ohm("R2", "R3"),
    }
    moved = {
        "z_a_1_ohm": open_phase_a(feeder, at=0.4).z_ohm("R2", "R3", "a"),
        "di1_r2_a": open_phase_a(feeder, at=0.4).di_a("R2", "1"),
        "dv_a_r3_pct": open_phase_a(feeder, at=0.4).dv_pct("R3", "a"),
    }
    for name, value in (other | moved).items():
        model = rows[name].model
        assert not isinstance(model, str)
        gap = abs(abs(value) / abs(model) - 1.0)
        assert (gap < 0.005) == (name in other) == (rows[name].basis == "circuit"), name


def test_the_reasons_speak_of_the_feeder_at_hand() -> None:
    """Another feeder gives other reasons: no figure of ours is written into them."""
    feeder = load_feeder("paper")
    loads = tuple(replace(load, kw=0.8 * load.kw) for load in feeder.loads)
    there = {
        row.name: row for group in paper_groups(replace(feeder, loads=loads)) for row in group.rows
    }
    here = {row.name: row for group in paper_groups(feeder) for row in group.rows}
    for name in ("dv_a_r3_pct", "dv1_r3_pct"):
        assert there[name].why != here[name].why


# ---- the verb ----


def answer(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str]:
    code = main(["paper", *words])
    return code, capsys.readouterr().out


def test_the_table_fits_100_columns_and_names_every_row(
    capsys: pytest.CaptureFixture[str], groups: tuple[Group, ...]
) -> None:
    code, said = answer(capsys)
    assert code == 0
    assert said == paper_table(groups)
    assert max(len(line) for line in said.splitlines()) <= 100
    for group in groups:
        assert f"{group.name}: {group.title}\n" in said
        for row in group.rows:
            assert row.quantity in said
            assert row.basis in ("circuit", "fit", "variant", "formula")
    assert "≈ 10               9.289        -0.7 (-7.1 %)  fit\n" in said


def test_json_is_one_object_with_every_row(
    capsys: pytest.CaptureFixture[str], groups: tuple[Group, ...]
) -> None:
    code, said = answer(capsys, "--json")
    assert code == 0
    found: dict[str, Any] = json.loads(said)
    assert found == paper_result(groups)
    assert [figure["name"] for figure in found["figures"]] == [group.name for group in groups]
    row = found["figures"][2]["rows"][0]
    assert row["name"] == "z1_r2_ohm"
    assert row["paper"] == 289.1
    assert row["difference"] == pytest.approx(row["model"] - 289.1)
    assert row["difference_pct"] == pytest.approx(100 * row["difference"] / 289.1)
    assert row["model_deg"] == pytest.approx(-179.3, abs=0.05)


def test_out_leaves_answer_table_and_pictures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], groups: tuple[Group, ...]
) -> None:
    code, said = answer(capsys, "--json", "--out", str(tmp_path / "proof"))
    assert code == 0
    folder = tmp_path / "proof"
    pictures = {f"fig{n}.png" for n in range(10, 16)}
    assert {path.name for path in folder.iterdir()} == pictures | {"result.json", "paper.txt"}
    assert (folder / "result.json").read_text(encoding="utf-8") == said
    assert (folder / "paper.txt").read_text(encoding="utf-8") == paper_table(groups)


def test_a_folder_that_cannot_be_written_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    assert main(["paper", "--out", str(tmp_path / "file")]) == 1
    assert "cannot be written" in capsys.readouterr().err


# ---- the pictures ----


def test_courses_have_a_value_for_just_the_window() -> None:
    panels = paper_panels(load_feeder("paper"))
    assert list(panels) == [f"fig{n}" for n in range(10, 16)]
    for name in ("fig11", "fig12", "fig13", "fig14"):
        for trace in panels[name][0].traces:
            known = trace.x[np.isfinite(trace.y)]
            assert known[0] == pytest.approx(1.0, abs=2e-3)
            assert known[-1] == pytest.approx(1.0 + WINDOW_S, abs=2e-3)
    assert np.nanmax(panels["fig12"][0].traces[0].y) == pytest.approx(288.30, abs=0.005)
    known = panels["fig15"][0].traces[0].x[np.isfinite(panels["fig15"][0].traces[0].y)]
    assert known[0] == pytest.approx(2.0, abs=2e-3)  # the paper opens phase A later there


def test_waves_have_the_phasors_amplitudes_and_step_at_the_event() -> None:
    feeder = load_feeder("paper")
    case = open_phase_a(feeder)
    currents = paper_panels(feeder)["fig10"][1]
    for trace, phase in zip(currents.traces, "abc", strict=True):
        before, after = np.abs(case.i("R3", phase)) * math.sqrt(2.0)  # type: ignore[arg-type]
        assert trace.y[trace.x < 1.0].max() == pytest.approx(before, rel=1e-3)
        assert trace.y[trace.x >= 1.0].max() == pytest.approx(after, rel=1e-3)


def test_a_legend_says_of_a_curve_what_the_table_says_of_its_value(rows: dict[str, Row]) -> None:
    panels = paper_panels(load_feeder("paper"))
    named = [row for row in rows.values() if row.unit == "Ω" and row.basis in ("fit", "variant")]
    compared = 0
    for name in ("fig13", "fig14", "fig15"):
        for trace in panels[name][0].traces:
            value = np.nanmax(trace.y)
            same = {row.basis for row in named if abs(row.model) == pytest.approx(value, rel=1e-6)}
            assert not same or trace.basis in same
            compared += bool(same)
    assert {trace.basis for trace in panels["fig14"][0].traces} == {"", "variant"}
    assert compared >= 5


def test_pictures_are_the_same_bytes_each_time() -> None:
    panels = {"fig12": paper_panels(load_feeder("paper"))["fig12"]}
    assert dict(paper_pictures(panels)) == dict(paper_pictures(panels))


def test_a_panel_is_drawn_with_its_values(tmp_path: Path) -> None:
    panel = paper_panels(load_feeder("paper"))["fig13"][0]
    ax = plot_panel(panel)
    legend = ax.get_legend()
    assert legend is not None
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts == [
        "1 Yg/Δ: 28.1 (fit)",
        "2 Yg/Δ: 17.97 (fit)",
        "3 Yg/Δ: 14.36 (fit)",
        "paper: 28.1 / 18.3 / 14.5",
    ]
    save_png(ax.get_figure(), tmp_path / "panel.png")
