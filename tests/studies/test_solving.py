"""``solve`` on the paper's feeder, to the printed digits of the published and derived values."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from oracles.drawn import perfect

from openphase.detector.evidence import Evidence
from openphase.model import InputError, load_feeder
from openphase.model.events.base import apply_event, no_event
from openphase.model.machines import DER_MODELS
from openphase.model.network import locate
from openphase.model.parts import DerModel, Feeder
from openphase.model.solve import steady_state
from openphase.studies.cli import main
from openphase.studies.paper.cases import open_phase_a, with_pv
from openphase.studies.run import engine
from openphase.studies.run.classes import DrawClass, Purpose
from openphase.studies.run.draw import BlockId, draw_scenarios, make_case
from openphase.studies.settings_file import read_settings
from openphase.studies.solving import Break, parse_break, solve_break
from openphase.studies.spec.study_file import default_study

V_NOMINAL = 12_000 / 3**0.5


@pytest.fixture(scope="module")
def radial() -> dict[str, Any]:
    feeder = load_feeder("paper")
    return solve_break(feeder, parse_break("R2-R3:0.6:a", feeder), frozenset())


def terminal(answer: dict[str, Any], local: str, remote: str) -> dict[str, Any]:
    rows = answer["sections"]
    return next(row for row in rows if (row["local"], row["remote"]) == (local, remote))


def change(pair: dict[str, Any], phase: int) -> float:
    before, after = pair["before"][phase], pair["after"][phase]
    return abs(complex(*after) - complex(*before))


def line_change(answer: dict[str, Any], line: str, end: str, phase: int) -> float:
    both = answer["lines"][line]
    return change({"before": both["before"][end], "after": both["after"][end]}, phase)


def test_impedances_of_the_internal_and_the_external_terminal(radial: dict[str, Any]) -> None:
    z_r2 = complex(*terminal(radial, "R2", "R3")["z1_ohm"])
    assert f"{abs(z_r2):.2f}" == "288.30"
    assert f"{np.degrees(np.angle(z_r2)):.1f}" == "-179.3"
    assert f"{abs(complex(*terminal(radial, 'R1', 'R2')['z1_ohm'])):.4f}" == "0.3901"


def test_voltage_and_current_changes(radial: dict[str, Any]) -> None:
    assert f"{change(radial['buses']['R3'], 0) / V_NOMINAL:.5f}" == "0.09289"
    assert f"{terminal(radial, 'R3', 'R4')['dv1_pu']:.5f}" == "0.03323"
    assert f"{line_change(radial, 'R3-R4', 'from_end', 0):.4f}" == "3.0845"
    assert f"{line_change(radial, 'R2-R3', 'from_end', 0):.3f}" == "23.936"
    assert f"{terminal(radial, 'R2', 'R3')['di1_a']:.4f}" == "0.7979"


def test_phase_impedance(radial: dict[str, Any]) -> None:
    z_a = complex(*terminal(radial, "R2", "R3")["zabc_ohm"][0])
    assert f"{abs(z_a):.3f}" == "28.101"


def test_closed_loop() -> None:
    feeder = load_feeder("paper")
    answer = solve_break(feeder, parse_break("R2-R3:0.6:a", feeder), frozenset({"R4"}))
    ours = [complex(*terminal(answer, *pair)["z1_ohm"]) for pair in (("R2", "R3"), ("R3", "R2"))]
    assert [f"{abs(z):.4f}" for z in ours] == ["2.4051", "2.4107"]
    assert all(z.real < 0 for z in ours)


# --- generation: one way of keeping what it keeps, in solve, the paper's table and the engine ---


def pv_of(model: DerModel) -> Feeder:
    z1_ohm = 12.93j if model in ("thevenin", "generator") else None
    return with_pv(load_feeder("paper"), model, z1_ohm)


def engine_sees(feeder: Feeder) -> Evidence:
    """What the engine makes of phase a open at 0.6 of R2-R3, loads and source at the file's."""
    case = make_case(feeder, default_study("paper"))
    which = BlockId(seed=1, purpose=Purpose.TRAIN, attempt=1, drawn=DrawClass.OPEN_PHASE, block=0)
    edge, share = locate(case.network, "R2-R3", 0.6)
    event = replace(
        no_event(case.network, 1),
        edge=np.array([edge]), share=np.array([share]), open_after=np.array([1]),
    )  # fmt: skip
    steady = steady_state(case.network)
    before, after = apply_event(case.network, steady, steady, event)
    drawn = draw_scenarios(case, which, 1)
    scenario = replace(
        drawn,
        before=before,
        after=after,
        event=event,
        der_model=case.network.machines.der_model[:, None],
        errors=perfect(drawn.errors),
    )
    return engine.observe(case, scenario).evidence


@pytest.mark.parametrize("model", DER_MODELS)
def test_generation_keeps_the_same_in_solve_in_the_paper_table_and_in_the_engine(
    model: DerModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "TOLERANCE_PU", 1e-12)
    feeder = pv_of(model)
    answer = solve_break(feeder, parse_break("R2-R3:0.6:a", feeder), frozenset())
    case, seen = open_phase_a(feeder), engine_sees(feeder)
    for t, row in enumerate(answer["sections"]):
        assert row["di1_a"] == pytest.approx(case.di_a(row["local"], "1"), rel=1e-6, abs=1e-8)
        assert row["di1_a"] == pytest.approx(float(seen.di1_a[t, 0]), rel=1e-6, abs=1e-6)
        if row["z1_ohm"] is not None and row["di1_star_a"] > 0.01:
            z = complex(*row["z1_ohm"])
            assert z == pytest.approx(case.z_ohm(row["local"], row["remote"]), rel=1e-5)
            assert z == pytest.approx(complex(seen.z_ohm[t, 0, 0]), rel=1e-5)


def test_an_emf_that_stays_shows_the_paper_s_23_ohm() -> None:
    feeder = pv_of("thevenin")
    answer = solve_break(feeder, parse_break("R2-R3:0.6:a", feeder), frozenset())
    row = terminal(answer, "R2", "R3")
    z = complex(*row["z1_ohm"])
    assert (f"{abs(z):.1f}", f"{np.degrees(np.angle(z)):.1f}") == ("23.4", "-94.7")
    assert f"{row['di1_a']:.2f}" == "2.78"


def test_the_models_of_generation_tell_different_things() -> None:
    """Otherwise the tests above would compare nothing."""
    shown = []
    for model in ("thevenin", "constant_current", "constant_power"):
        feeder = pv_of(model)
        answer = solve_break(feeder, parse_break("R2-R3:0.6:a", feeder), frozenset())
        shown.append(complex(*terminal(answer, "R2", "R3")["z1_ohm"]))
    assert min(abs(x / y - 1) for x in shown for y in shown if x != y) > 0.1
    assert len(set(shown)) == 3


def test_load_side_impedance_is_undefined(radial: dict[str, Any]) -> None:
    row = terminal(radial, "R3", "R2")
    assert row["z1_ohm"] is None
    assert row["di1_star_a"] == pytest.approx(0.0, abs=1e-9)


def test_currents_enter_a_line_at_both_ends(radial: dict[str, Any]) -> None:
    ends = radial["lines"]["R2-R3"]["after"]
    assert ends["from_end"][0][0] > 0 > ends["to_end"][1][0] * ends["from_end"][1][0]
    for line in radial["lines"].values():
        for state in line.values():
            assert all(value is not None for end in state.values() for value in end)


def test_the_broken_phase_carries_nothing_at_the_stubs(radial: dict[str, Any]) -> None:
    assert set(radial["buses"]) == {"SUB", "R2", "R3", "R4", "R4b", "R2-R3.p", "R2-R3.q"}
    p, q = radial["buses"]["R2-R3.p"], radial["buses"]["R2-R3.q"]
    assert p["before"] == q["before"]
    assert abs(complex(*p["after"][0]) - complex(*q["after"][0])) > 100
    assert p["after"][1] == pytest.approx(q["after"][1])


def test_upstream_stub_is_p_on_a_line_that_points_to_the_source() -> None:
    feeder = load_feeder("paper")
    buses = solve_break(feeder, parse_break("R4-R5:0.7:abc", feeder), frozenset())["buses"]
    assert abs(complex(*buses["R4-R5.p"]["after"][0])) > 6000  # towards SUB: alive
    assert complex(*buses["R4-R5.q"]["after"][0]) == 0


def test_a_conductor_connected_to_nothing_has_no_voltage() -> None:
    feeder = load_feeder("paper")
    answer = solve_break(feeder, parse_break("R3-R4:0.95:ab", feeder), frozenset())
    for name in ("R4", "R3-R4.q"):
        assert answer["buses"][name]["after"][:2] == [None, None]
        assert answer["buses"][name]["after"][2] is not None


def test_json_is_one_object_on_stdout(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", "paper", "--open", "R2-R3:0.6:a", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert list(answer) == ["buses", "lines", "flags", "sections"]
    assert list(answer["sections"][0]) == [
        "local", "remote", "di1_a", "di1_star_a", "dv1_pu", "z1_ohm", "zabc_ohm", "di_abc_a",
        "trip", "reason",
    ]  # fmt: skip


def test_a_trip_by_a_phase_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without a sheet 0.798 A stays below the paper's 1 A, and phase a stands in with 28.1 ohm."""
    assert main(["solve", "paper", "--open", "R2-R3:0.6:a", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    row = terminal(rows, "R2", "R3")
    assert (row["trip"], row["reason"]) == (True, "trip: a phase, |ΔI1| being below I_set")
    sheet = tmp_path / "settings.csv"
    sheet.write_text("local,remote,i_set_a,v_set_pu,z_set_ohm\nR2,R3,0.7,0.05,5\n")
    assert (
        main(["solve", "paper", "--open", "R2-R3:0.6:a", "--settings", str(sheet), "--json"]) == 0
    )
    row = terminal(json.loads(capsys.readouterr().out), "R2", "R3")
    assert (row["trip"], row["reason"]) == (True, "trip")


def test_a_sheet_decides_who_trips(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sheet = tmp_path / "settings.csv"
    sheet.write_text("local,remote,i_set_a,v_set_pu,z_set_ohm\nR2,R3,0.7,0.05,5\nR3,R2,,,\n")
    assert (
        main(["solve", "paper", "--open", "R2-R3:0.6:a", "--settings", str(sheet), "--json"]) == 0
    )
    rows = json.loads(capsys.readouterr().out)["sections"]
    assert [(row["local"], row["remote"]) for row in rows if row["trip"]] == [("R2", "R3")]
    assert terminal({"sections": rows}, "R3", "R2")["reason"] == "no setting in the sheet"


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("R2-R3", ["--open: must read LINE:FRACTION:PHASES, got R2-R3"]),
        (
            "R2-R9:1.5:ax",
            [
                "--open: line must be a line of 'paper': R1-R2, R2-R3, R3-R4, R4-R5 "
                "(did you mean 'R2-R3'?), got R2-R9",
                "--open: fraction must be a number in 0..1, got 1.5",
                "--open: phases must be one, two or three of a, b, c, got ax",
            ],
        ),
        ("R2-R3:nan:aa", None),
    ],
)
def test_a_wrong_break_is_answered_with_all_its_faults(
    text: str, faults: list[str] | None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["solve", "paper", "--open", text]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "Traceback" not in captured.err
    if faults is not None:
        assert captured.err.splitlines()[: len(faults)] == faults


def test_an_unknown_switch_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", "paper", "--open", "R2-R3:0.6:a", "--close", "R5"]) == 2
    assert "must be a switch of 'paper'" in capsys.readouterr().err


def test_all_faults_of_a_sheet_are_reported(tmp_path: Path) -> None:
    sheet = tmp_path / "bad.csv"
    sheet.write_text(
        "local,remote,i_set_a,v_set_pu,z_set_ohm\n"
        "R1,R2,1,.05,5\nR1,R2,1,.05,5\nR1,R9,x,,5\nR2,R3,0.5,inf,-5\n"
    )
    with pytest.raises(InputError) as caught:
        read_settings(sheet, load_feeder("paper"))
    said = str(caught.value).splitlines()
    assert [line.split(":")[1] for line in said[:-1]] == ["3", "4", "4", "4", "5", "5"]
    assert said[-1] == "6 faults"


def test_missing_columns_and_files(tmp_path: Path) -> None:
    sheet = tmp_path / "bad.csv"
    sheet.write_text("local,remote,i_set_a\n")
    with pytest.raises(InputError, match="column v_set_pu must be in the sheet"):
        read_settings(sheet, load_feeder("paper"))
    with pytest.raises(InputError, match="must be a CSV file to read"):
        read_settings(tmp_path / "none.csv", load_feeder("paper"))


def test_a_sheet_in_percent_is_refused(tmp_path: Path) -> None:
    sheet = tmp_path / "percent.csv"
    sheet.write_text("local,remote,i_set_a,v_set_pu,z_set_ohm\nR1,R2,1,5,5\n")
    with pytest.raises(InputError, match="per unit and not percent"):
        read_settings(sheet, load_feeder("paper"))
    sheet.write_text("local;remote;i_set_a;v_set_pu;z_set_ohm\nR1;R2;1;0,05;5\n")
    with pytest.raises(InputError, match="must be separated by commas"):
        read_settings(sheet, load_feeder("paper"))


def test_faults_of_break_switch_and_sheet_come_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sheet = str(tmp_path / "none.csv")
    words = ["solve", "paper", "--open", "R9:7:zz", "--close", "QQ", "--settings", sheet]
    assert main(words) == 2
    said = capsys.readouterr().err.splitlines()
    assert [line.split(":")[0] for line in said[:3]] == ["--open"] * 3
    assert said[3].startswith("--close: name must be a switch of 'paper': R4, got QQ")
    assert said[4].startswith(sheet)


def test_stubs_keep_their_names_in_a_closed_loop() -> None:
    """Upstream is what it is with the tie open, whichever way the solver goes round."""
    feeder = load_feeder("paper")
    broken = parse_break("R4-R5:0.2:abc", feeder)
    buses = solve_break(feeder, broken, frozenset({"R4"}))["buses"]
    q, p, end = (
        [complex(*value) for value in buses[name]["after"]]
        for name in ("R4-R5.q", "R4-R5.p", "R4b")
    )
    assert q == pytest.approx(end)  # nothing flows between R4b and the break
    assert abs(p[0] - end[0]) > 1.0


def test_a_break_at_a_tee_leaves_the_tee_beyond_it() -> None:
    feeder = load_feeder("paper")

    def z1(fraction: float) -> complex:
        broken = parse_break(f"R2-R3:{fraction}:a", feeder)
        row = terminal(solve_break(feeder, broken, frozenset()), "R2", "R3")
        return complex(*row["z1_ohm"])

    at, before, behind = z1(0.25), z1(0.2499999), z1(0.2500001)
    assert at == pytest.approx(before, rel=1e-5)
    assert abs(at - behind) > 50  # T2 carries half of the load beyond R2


def test_phases_that_are_not_there_are_null_and_volts_are_of_their_own_bus() -> None:
    feeder = load_feeder("ieee34")
    found = solve_break(feeder, Break(line="l7", fraction=0.5, phases=(0,)), closed_of(feeder))
    assert found["buses"]["810"]["before"][0] is None
    assert found["buses"]["810"]["before"][1] is not None
    assert found["buses"]["890"]["v_nominal_v"] == pytest.approx(4160.0 / 3.0**0.5)
    assert found["buses"]["l7.p"]["v_nominal_v"] == pytest.approx(24900.0 / 3.0**0.5)
    for bus in found["buses"].values():
        for value in filter(None, bus["before"]):
            assert 0.9 < abs(complex(*value)) / bus["v_nominal_v"] < 1.1
    lateral = next(line for line in feeder.lines if len(line.phases) == 1)
    currents = found["lines"][lateral.name]["before"]["from_end"]
    assert [value is not None for value in currents] == [a in lateral.phases for a in "abc"]


def test_a_break_of_a_phase_that_the_line_does_not_have_is_refused() -> None:
    feeder = load_feeder("ieee34")
    lateral = next(line for line in feeder.lines if line.phases == "b")
    with pytest.raises(InputError, match="must be of those that the line has: b, got"):
        parse_break(f"{lateral.name}:0.5:a", feeder)
    assert parse_break(f"{lateral.name}:0.5:b", feeder).phases == (1,)


def closed_of(feeder: Feeder) -> frozenset[str]:
    return frozenset(switch.name for switch in feeder.switches if switch.closed)
