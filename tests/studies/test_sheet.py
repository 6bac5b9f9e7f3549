"""The printed sheet: settings as they are, heads above values, and never wider than the page."""

from __future__ import annotations

from typing import Any

import pytest

from openphase.model import load_feeder
from openphase.model.network import compile_network
from openphase.model.points import find_points
from openphase.studies.run.classes import REPORTED
from openphase.studies.show.sheet import (
    setting_text,
    sheet_table,
    table_lines,
    terminal_name,
    wrapped,
)
from openphase.studies.spec.study_file import Device, Steps

WEAK = "no false trip, but finds only 0.381 for sure, 0.5 wanted"
HOLLOW = (
    "few of the load steps upstream, source steps and 7 other classes come near the thresholds: "
    "their zero is weak evidence"
)
SPENT = (
    "2 false trips of 57708 in load steps upstream; worst scenario "
    "validate-2-load_step-00012:5; this sample is spent: run again with a new --seed"
)
FAR = "with the section cut, nothing behind this terminal feeds it"


def classes(**trips: int) -> list[dict[str, Any]]:
    """Every class on every side with 1000 trials; so many trips by the name of the class."""
    rows: list[dict[str, Any]] = []
    for own in REPORTED:
        row = {
            **{"name": own.name, "kind": own.kind, "side": own.side, "trials": 1000},
            **{"trips": trips.get(own.name, 0), "upper": (1 + trips.get(own.name, 0)) / 1000},
        }
        rows.append(row | ({"alarms": 900} if own.name == "wiring" else {}))
    return rows


def section(status: str, reason: str, remote: str = "R2", **more: Any) -> dict[str, Any]:
    row = {
        **{"local": "R1", "remote": remote, "setting_group": "normal"},
        **{"status": status, "reason": reason},
        **{"i_set_a": 0.15, "v_set_pu": 0.0025, "z_set_ohm": 100.25, "margin": 1.3},
        **{"opens": 60000, "unreachable": 2000, "detected": 29000},
        **{"false_trips": 0, "security_trials": 230832, "false_trip_upper": 0.0001},
        **{"line_z1_ohm": [0.3, 0.4], "least_z_op_ohm": 123.4},
        "classes": classes(),
    }
    if status in ("none", "load_side"):
        row |= dict.fromkeys(("i_set_a", "v_set_pu", "z_set_ohm", "margin"))
        row["classes"] = []
    return {**row, **more}


def compared(name: str, **more: Any) -> dict[str, Any]:
    row = {
        **{"local": "R1", "remote": "R2", "setting_group": "normal"},
        **{"name": name, "reason": None},
        **{"i_set_a": 0.15, "v_set_pu": 0.0025, "z_set_ohm": 100.25},
        **{"detected": 29000, "opens": 60000, "unreachable": 2000},
        **{"dependability_low": 0.49691, "dependability_high": 0.50309},
        **{"false_trips": 1234, "trials": 230832, "upper": 0.01},
    }
    return {**row, **more}


def answer(local: str = "R1", remote: str = "R2", feeder: str = "made up") -> dict[str, Any]:
    sections = [
        section("set", f"no false trip, finds at least 0.496; {HOLLOW}"),
        section("set", "no false trip, finds at least 0.496", "R3"),
        section("weak", WEAK, "R4"),
        section("not_certified", SPENT, "R5"),
        section("none", "no setting of the device keeps the margin 1.25 in training", "R6"),
        section("load_side", FAR, "R7", unreachable=None, opens=None),
    ]
    none = dict.fromkeys(("i_set_a", "v_set_pu", "z_set_ohm"))
    pairs = [
        compared("chosen"),
        compared("best at reference V_set", reason="the device has no V_set of 5 %", **none),
        compared("reference"),
    ]
    for row in [*sections, *pairs]:
        row["local"] = local
        row["remote"] = remote if row["remote"] == "R2" else row["remote"]
    return {
        **{"feeder": feeder, "seed": 1, "attempt": 2, "confidence": 0.95},
        **{"sections": sections, "compared": pairs, "numerics": NUMERICS},
    }


NUMERICS = {
    **{"dead": 9, "floating": 0, "unearthed": 0, "not_converged": 0, "training_not_converged": 0},
    "by_class": [
        {"name": name, "scenarios": 4000, "dead": 0, "not_converged": 0}
        for name in ("open_phase", "load_step")
    ],
}


@pytest.mark.parametrize("step", [0.05, 0.25, 0.125, 0.001])
def test_every_setting_of_a_fine_device_is_printed_as_it_is(step: float) -> None:
    steps = Steps(first=step, last=40 * step, step=step)
    device = Device(i_set=steps, z_set_ohm=(steps,), v_set_pct=steps.values())
    for exact, value in zip(device.i_grid(), device.v_grid_pu(), strict=True):
        assert float(setting_text(exact)) == exact
        assert setting_text(value * 100.0) == setting_text(exact)
        assert len(setting_text(exact)) <= 5


def test_settings_are_not_rounded_in_the_table() -> None:
    lines = [line for line in sheet_table(answer()).splitlines() if " 0.15 " in line]
    assert len(lines) == 4 + 2
    assert all(line.split("0.15")[1].split()[:2] == ["0.25", "100.25"] for line in lines)


LONG = [
    ("Schalter A", "Schalter B"),
    ("Umspannwerk 14", "Umspannwerk 15"),
    ("x" * 60, "y" * 70),
]


@pytest.mark.parametrize(("local", "remote"), [("A", "B"), *LONG])
def test_whatever_the_names_the_sheet_fits_the_page(local: str, remote: str) -> None:
    text = sheet_table(answer(local, remote, "a feeder of a long name " * 8))
    assert max(map(len, text.splitlines())) <= 100
    said = " ".join(text.split())
    # nothing is cut
    for reason in (HOLLOW, WEAK, SPENT, FAR, "the device has no V_set of 5 %"):
        assert reason in said
    if len(local) < 60:
        assert f"{local}→{remote}" in said


@pytest.mark.parametrize(("local", "remote"), [("R1", "R2"), *LONG])
def test_heads_stand_above_their_values(local: str, remote: str) -> None:
    lines = sheet_table(answer(local, remote)).splitlines()
    ends = {"I_set A": "0.15", "V_set %": "0.25", "Z_set Ω": "100.25", "false trips": "230832"}
    heads = [line for line in lines if "I_set A" in line]
    values = [line for line in lines if " 0.15 " in line]
    assert (len(heads), len(values)) == (2, 6)
    for head, own in ((heads[0], values[:4]), (heads[1], values[4:])):
        for title, value in ends.items():
            for line in own:
                assert head.index(title) + len(title) == line.index(f" {value}") + 1 + len(value)


def test_reasons_below_are_those_that_the_table_leaves_out() -> None:
    lines = sheet_table(answer()).splitlines()
    begin = lines.index("reasons")
    block = lines[begin + 1 : lines.index("", begin)]
    entries = [line[2:].partition(":")[0] for line in block if line[2] != " "]
    assert entries == ["R1→R2", "R1→R4", "R1→R5"]
    assert " ".join(" ".join(block).split()).startswith(f"R1→R2: {HOLLOW}")


def test_no_block_of_reasons_and_no_comparison_where_there_is_nothing_to_say() -> None:
    result = answer()
    result["sections"] = [row for row in result["sections"] if row["status"] == "load_side"]
    result["compared"] = []
    text = sheet_table(result)
    assert "reasons" not in text
    assert "compared" not in text
    assert f"load_side  {FAR}" in text


def test_a_text_runs_on_below_itself() -> None:
    lines = table_lines(("key",), ("number",), [(("a",), "word " * 40), (("b",), ("1",))])
    assert lines[:2] == ["key  number", "a    " + " ".join(["word"] * 19)]
    assert lines[2].startswith("     word word")
    assert lines[-1] == "b         1"


def test_shares_are_of_the_reachable_breaks_and_intervals_round_outwards() -> None:
    text = sheet_table(answer())
    assert text.count("0.500 of 58000") == 4
    assert "0.496..0.504" in text
    assert "R1→R2 2000 of 60000" in text


def test_a_paragraph_keeps_its_indent() -> None:
    lines = wrapped("  " + "word " * 40)
    assert [len(line) - len(line.lstrip()) for line in lines] == [2, 4, 4]


def test_a_row_s_terminal_is_named_as_the_terminal_itself() -> None:
    feeder = load_feeder("paper")
    for terminal in find_points(feeder, compile_network(feeder)).terminals:
        row = {"local": terminal.local, "remote": terminal.remote}
        assert terminal_name(row) == terminal.name


# --- classes, groups, assessments -------------------------------------------------------


def test_classes_with_false_trips_are_listed_by_their_rate() -> None:
    result = answer()
    result["sections"][1]["classes"] = classes(source_step=7, earth_fault=2, open_three=500)
    lines = sheet_table(result).splitlines()
    at = lines.index("false trips by class")
    said = " ".join(" ".join(lines[at + 1 : lines.index("", at)]).split())
    assert said.startswith("R1→R3: 7 of 1000 source steps, 2 of 1000 earth faults inside, 2 of")
    assert "three-phase" not in said


def test_many_classes_are_cut_short_and_counted() -> None:
    result = answer()
    names = {own.name for own in REPORTED if own.kind == "must_not_trip"}
    result["sections"][0]["classes"] = classes(**dict.fromkeys(names, 3))
    count = sum(own.kind == "must_not_trip" for own in REPORTED)
    assert f"and {count - 6} more classes" in " ".join(sheet_table(result).split())


def test_the_worst_class_is_named() -> None:
    result = answer()
    result["sections"][1]["classes"] = classes(source_step=7)
    said = " ".join(sheet_table(result).split())
    count = sum(own.kind == "must_not_trip" for own in REPORTED)
    assert f"the worst of {count} classes and sides that must not trip" in said
    assert "Here the worst is source steps at R1→R3." in said


def test_what_is_told_apart_is_listed_by_terminal() -> None:
    result = answer()
    for row in result["sections"][:2]:
        row["classes"] = classes(open_three=999)
    said = " ".join(sheet_table(result).split())
    assert "told apart, in neither count: the share that trips" in said
    assert "R1→R2: breaks on laterals inside 0 % of" in said
    assert "three-phase breaks inside 99 % of 1000" in said
    assert "wiring faults of its own points 90 % of 1000" in said


def two_groups() -> dict[str, Any]:
    result = answer()
    for key in ("sections", "compared"):
        again = [row | {"setting_group": "tie closed"} for row in result[key]]
        result[key] = result[key] + again
    return result


def test_every_group_has_its_table() -> None:
    lines = sheet_table(two_groups()).splitlines()
    heads = [n for n, line in enumerate(lines) if line.startswith("setting group ")]
    assert [lines[n] for n in heads] == ["setting group normal", "setting group tie closed"] * 2
    assert all(lines[n + 1].startswith("terminal  status") for n in heads[:2])
    assert all(lines[n + 1].startswith("compared  setting") for n in heads[2:])
    assert max(map(len, lines)) <= 100
    # elsewhere a terminal is told from itself in the other group
    assert any(line.startswith("  R1→R4 tie closed: no false trip") for line in lines)
    assert "setting group" not in sheet_table(answer())


def test_an_assessment_says_so_and_has_no_margin() -> None:
    result = answer() | {"assessed": {"settings": "mine.csv", "note": "seen before"}}
    lines = sheet_table(result).splitlines()
    assert lines[0].startswith("made up: assessment of mine.csv, seed 1, attempt 2;")
    assert "note: seen before" in lines
    (head,) = [line for line in lines if line.startswith("terminal")]
    assert "margin" not in head
    assert head.split()[-4:] == ["found", "false", "trips", "bound"]
    # nothing beside what is assessed: no comparison
    result["compared"] = [compared("assessed")]
    assert "compared" not in sheet_table(result)


def test_what_did_not_converge_is_counted_by_class_and_only_where_there_is_any() -> None:
    own = answer()
    assert "did not converge" not in sheet_table(own)
    rows = [row | {"not_converged": 3} for row in own["numerics"]["by_class"][1:]]
    own["numerics"] = own["numerics"] | {"by_class": rows, "training_not_converged": 17}
    said = " ".join(sheet_table(own).split())
    assert "did not converge: 3 of 4,000 load steps, 17 scenarios of training." in said


def test_z_set_stands_between_the_line_and_the_breaks() -> None:
    own = answer()
    own["sections"][1]["least_z_op_ohm"] = None
    said = " ".join(sheet_table(own).split())
    assert "R1→R2 0.5 / 100.25 / 123" in said
    assert "R1→R3 0.5 / 100.25 / no break" in said
    assert "R1→R6 0.5" not in said  # which has no setting
