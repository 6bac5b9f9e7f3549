"""The printed sheet: settings as they are, heads above values, and never wider than the page."""

from __future__ import annotations

from typing import Any

import pytest

from openphase.model import load_feeder
from openphase.model.network import compile_network
from openphase.model.points import find_points
from openphase.studies.run.certify import COMPARED
from openphase.studies.run.spec import Device, Steps
from openphase.studies.show.sheet import (
    setting_text,
    sheet_table,
    table_lines,
    terminal_name,
    wrapped,
)

WEAK = "no false trip, but finds only 0.381 for sure, 0.5 wanted"
HOLLOW = (
    "few of the load steps outside, source steps and breaks elsewhere come near the thresholds: "
    "their zero is weak evidence"
)
SPENT = (
    "2 false trips of 57708 in load steps outside; worst scenario "
    "validate-2-load_step-00012:5; this sample is spent: run again with a new --seed"
)
FAR = "with the section cut, nothing behind this terminal feeds it"


def section(status: str, reason: str, remote: str = "R2", **more: Any) -> dict[str, Any]:
    row = {
        **{"local": "R1", "remote": remote, "status": status, "reason": reason},
        **{"i_set_a": 0.15, "v_set_pu": 0.0025, "z_set_ohm": 100.25, "margin": 1.3},
        **{"opens": 60000, "unreachable": 2000, "detected": 29000},
        **{"false_trips": 0, "security_trials": 230832, "false_trip_upper": 0.0001},
    }
    if status in ("none", "load_side"):
        row |= dict.fromkeys(("i_set_a", "v_set_pu", "z_set_ohm", "margin"))
    return {**row, **more}


def compared(name: str, **more: Any) -> dict[str, Any]:
    row = {
        **{"local": "R1", "remote": "R2", "name": name, "reason": None},
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
        compared(COMPARED[0]),
        compared(COMPARED[1], reason="the device has no V_set of 5 %", **none),
        compared(COMPARED[2]),
    ]
    for row in [*sections, *pairs]:
        row["local"] = local
        row["remote"] = remote if row["remote"] == "R2" else row["remote"]
    return {
        **{"feeder": feeder, "seed": 1, "attempt": 2, "confidence": 0.95},
        **{"sections": sections, "compared": pairs},
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
    values = [line for line in lines if " 100.25 " in line]
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
