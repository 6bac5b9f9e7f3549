"""Verdict bytes, and runs that are paired by them."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from openphase.detector.criteria import Reason, Settings, verdict
from openphase.model import load_feeder
from openphase.model.errors import InputError
from openphase.optimise.certificate import paired_difference
from openphase.studies import assessing, cli
from openphase.studies.comparing import compare_runs
from openphase.studies.run.cases import Case, make_cases
from openphase.studies.run.classes import REPORTED, DrawClass, Purpose, Side
from openphase.studies.run.draw import BlockId, draw_scenarios
from openphase.studies.run.engine import observe
from openphase.studies.run.pairing import BLOCK_NAME
from openphase.studies.run.session import Demand
from openphase.studies.run.verdicts import REASONS, SIDES, pack_verdicts, unpack_verdicts
from openphase.studies.settings_file import read_sheet
from openphase.studies.spec.study_file import Group, Study, default_study

N = 60


# --- one byte a verdict -----------------------------------------------------------------


def test_a_byte_gives_back_reason_side_and_whether_a_break_can_be_seen() -> None:
    reason, side, connected = (
        own.reshape(1, -1).astype(np.int8)
        for own in np.meshgrid(np.arange(REASONS), np.arange(SIDES), [0, 1])
    )
    seen = connected[0].astype(np.bool_)
    again = unpack_verdicts(pack_verdicts(reason, side, seen))
    np.testing.assert_array_equal(again[0], reason)
    np.testing.assert_array_equal(again[1], side)
    np.testing.assert_array_equal(again[2], (side == Side.PATH) & seen)


def test_every_reason_and_side_has_room() -> None:
    assert max(Reason) < REASONS
    assert max(Side) < SIDES


@pytest.mark.parametrize(("reason", "side"), [(REASONS, 0), (-1, 0), (0, SIDES)])
def test_what_has_no_room_is_refused(reason: int, side: int) -> None:
    codes = [np.array([[code]], np.int8) for code in (reason, side)]
    with pytest.raises(ValueError, match="must lie in"):
        pack_verdicts(codes[0], codes[1], np.array([True]))


# --- two runs of the paper's feeder, tie open and closed ---------------------------------

SHEETS = {
    "a": "R1,R2,1,0.05,5\nR2,R3,1,0.05,5\nR5,R4b,1,0.05,5\n",
    "b": "R1,R2,0.4,0.01,30\nR2,R3,0.3,0.005,60\nR3,R4,0.3,0.02,90\n",
}


def small_study() -> Study:
    """Few classes, two groups, one of them a closed loop."""
    study = default_study("paper")
    kept = ("open_phase", "load_step", "source_step", "open_three")
    without = tuple(own.name.lower() for own in DrawClass if own.name.lower() not in kept)
    return replace(
        study,
        events=replace(study.events, without=without),
        groups=(Group(name="normal", closed=()), Group(name="tied", closed=("R4",))),
    )


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two assessments on the same draws; tests must not change them."""
    folder = tmp_path_factory.mktemp("home")
    feeder, study = load_feeder("paper"), small_study()
    patch = pytest.MonkeyPatch()
    patch.setattr(assessing, "write_report", lambda *_: None)
    for name, rows in SHEETS.items():
        path = folder / f"{name}.csv"
        path.write_text(f"local,remote,i_set_a,v_set_pu,z_set_ohm\n{rows}", encoding="utf-8")
        sheet = read_sheet(path, feeder)
        demand = Demand(scenarios=N, jobs=1)
        assessing.assess_feeder(feeder, study, sheet, demand, folder / name)
    patch.undo()
    return folder


@pytest.fixture(scope="module")
def compared(home: Path) -> dict[str, Any]:
    return compare_runs([home / "a", home / "b"])


def second_way(
    cases: tuple[Case, ...], home: Path, t: int, group: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Every validation scenario drawn and judged again: its class, and whether A and B trip."""
    case = cases[group]
    own = case.points.terminals[t]
    settings: list[Settings | None] = [
        next(iter(read_sheet(home / f"{name}.csv", case.feeder).groups.values())).get(
            (own.local, own.remote)
        )
        for name in SHEETS
    ]
    classes: list[str] = []
    trips: list[list[bool]] = [[], []]
    seen: list[bool] = []
    for path in sorted((home / "a" / "blocks").glob("*.npz")):
        match = BLOCK_NAME.fullmatch(path.stem)
        assert match is not None
        if int(match["group"] or 0) != group:
            continue
        which = BlockId(
            seed=1,
            purpose=Purpose.VALIDATE,
            attempt=1,
            group=group,
            drawn=DrawClass[match["drawn"].upper()],
            block=int(path.stem.rpartition("-")[2]),
        )
        asked = [one.options for one in settings if one is not None]
        found = observe(case, draw_scenarios(case, which, 2000), *asked)
        for n, one in enumerate(settings):
            trip = np.zeros(2000, np.bool_)
            if one is not None:
                trip = verdict(found.evidence, one)[t] == Reason.TRIP
            trips[n] += trip.tolist()
        classes += [
            next(f"{r.name} {r.side}" for r in REPORTED if r.drawn == which.drawn and s in r.where)
            for s in found.side[t]
        ]
        seen += ((found.side[t] == Side.PATH) & found.connected).tolist()
    return np.array(classes), np.array(trips), np.array(seen)


@pytest.mark.parametrize(("t", "group"), [(0, 0), (2, 0), (4, 0), (3, 1), (6, 1)])
def test_counts_are_those_of_judging_every_scenario_again(
    home: Path, compared: dict[str, Any], t: int, group: int
) -> None:
    cases = make_cases(load_feeder("paper"), small_study())
    classes, (a, b), seen = second_way(cases, home, t, group)
    row = compared["comparisons"][0]["sections"][group * len(cases[0].points.terminals) + t]
    assert row["setting_group"] == cases[group].group.name
    for own in row["classes"]:
        here = classes == f"{own['name']} {own['side']}"
        assert own["trials"] == here.sum()
        assert own["both"] == (a & b & here).sum()
        assert own["only_a"] == (a & ~b & here).sum()
        assert own["only_b"] == (b & ~a & here).sum()
    seen &= classes == "open_inside inside"
    assert row["reachable"] == seen.sum() > 0
    counts = [row[key] for key in ("both", "only_a", "only_b", "neither")]
    assert counts == [int((x & seen).sum()) for x in (a & b, a & ~b, b & ~a, ~a & ~b)]


def test_rows_agree_with_the_runs_own_results(home: Path, compared: dict[str, Any]) -> None:
    for letter, only in (("a", "only_a"), ("b", "only_b")):
        result = json.loads((home / letter / "result.json").read_text(encoding="utf-8"))
        pairs = zip(result["sections"], compared["comparisons"][0]["sections"], strict=True)
        for own, row in pairs:
            if own["detected"] is None:
                assert row["both"] == row[only] == 0
                continue
            assert row["both"] + row[only] == own["detected"]
            assert row["reachable"] == own["opens"] - own["unreachable"]
            assert row["false_trips"]["both"] + row["false_trips"][only] == own["false_trips"]
            assert row[letter]["i_set_a"] == own["i_set_a"]


def test_differences_have_intervals_and_causes(compared: dict[str, Any]) -> None:
    # R1→R2, R2→R3, R3→R4 and R5→R4b have a setting in one run at least, in each group
    intervals = 8
    for row in compared["comparisons"][0]["sections"]:
        n, alpha = row["reachable"], 0.05 / intervals
        assert row["difference"] == (row["only_b"] - row["only_a"]) / n
        own = row["difference_low"], row["difference_high"]
        if row["a"]["i_set_a"] or row["b"]["i_set_a"]:
            assert own == pytest.approx(paired_difference(row["only_b"], row["only_a"], n, alpha))
        else:
            assert own == (None, None)
            assert row["difference"] == 0.0
        assert sum(cause["breaks"] for cause in row["gained"]) == row["only_b"]
        assert sum(cause["breaks"] for cause in row["lost"]) == row["only_a"]
    by_name = {
        (row["local"], row["setting_group"]): row for row in compared["comparisons"][0]["sections"]
    }
    # A has nothing at R3 and B nothing at R5
    assert [c["criterion"] for c in by_name["R3", "normal"]["gained"]] == ["no_setting"]
    assert [c["criterion"] for c in by_name["R5", "normal"]["lost"]] == ["no_setting"]


def test_all_intervals_of_all_comparisons_share_the_error_probability(home: Path) -> None:
    """Load-side rows with a setting too: 8 rows, in each of two comparisons."""
    result = compare_runs([home / "a", home / "b", home / "b"])
    given = [
        row
        for own in result["comparisons"]
        for row in own["sections"]
        if row["difference_low"] is not None
    ]
    assert len(given) == 16
    for row in given:
        expected = paired_difference(row["only_b"], row["only_a"], row["reachable"], 0.05 / 16)
        assert (row["difference_low"], row["difference_high"]) == pytest.approx(expected)


def test_a_load_side_row_with_a_setting_has_its_share(home: Path, tmp_path: Path) -> None:
    """The row counts whichever run has the setting, and in whatever order they come."""
    feeder, path = load_feeder("paper"), tmp_path / "c.csv"
    path.write_text("local,remote,i_set_a,v_set_pu,z_set_ohm\nR3,R2,1,0.05,5\n", encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assessing, "write_report", lambda *_: None)
        demand = Demand(scenarios=N, jobs=1)
        sheet = read_sheet(path, feeder)
        # beside the others, so that the ledger is the same
        assessing.assess_feeder(feeder, small_study(), sheet, demand, home / "c")
    here = {}
    for order in (("a", "c"), ("c", "a")):
        result = compare_runs([home / name for name in order])
        for row in result["comparisons"][0]["sections"]:
            if row["difference_low"] is None:
                continue
            expected = paired_difference(row["only_b"], row["only_a"], row["reachable"], 0.05 / 8)
            assert (row["difference_low"], row["difference_high"]) == pytest.approx(expected)
            key = row["local"], row["remote"], row["setting_group"]
            here.setdefault(key, []).append(row["difference_high"] - row["difference_low"])
    assert here.keys() >= {("R3", "R2", "normal"), ("R3", "R2", "tied")}
    assert len(here) == 8
    assert all(widths[0] == pytest.approx(widths[1]) for widths in here.values())


def test_options_that_decide_are_told(compared: dict[str, Any]) -> None:
    for row in compared["comparisons"][0]["sections"]:
        for own in (row["a"], row["b"]):
            assert (own["options"], own["negative_sign"], own["dt_ms"]) == ("", True, 800.0)


def test_exchanged_runs_give_exchanged_answers(home: Path, compared: dict[str, Any]) -> None:
    other = compare_runs([home / "b", home / "a"])
    pairs = zip(
        compared["comparisons"][0]["sections"], other["comparisons"][0]["sections"], strict=True
    )
    for row, mirrored in pairs:
        assert (row["only_a"], row["only_b"]) == (mirrored["only_b"], mirrored["only_a"])
        assert row["difference"] == -mirrored["difference"]
        assert row["gained"] == mirrored["lost"]
        if row["difference_low"] is None:
            assert mirrored["difference_high"] is None
        else:
            assert row["difference_low"] == pytest.approx(-mirrored["difference_high"])


def test_a_run_beside_itself_differs_in_nothing(home: Path) -> None:
    for row in compare_runs([home / "a", home / "a"])["comparisons"][0]["sections"]:
        assert row["only_a"] == row["only_b"] == 0
        assert row["difference"] == 0.0
        assert row["gained"] == row["lost"] == []


# --- the verb ----------------------------------------------------------------------------


def test_the_verb_prints_a_table_or_one_object(
    home: Path, compared: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["compare", str(home / "a"), str(home / "b")]
    assert cli.main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == compared
    assert cli.main(words) == 0
    said = capsys.readouterr().out.splitlines()
    # the lines that name the folders are as long as these
    assert max(len(line) for line in said if str(home) not in line) <= 100
    assert any(line.startswith("R1→R2 tied") for line in said)


def refusal(*paths: Path) -> list[str]:
    with pytest.raises(InputError) as caught:
        compare_runs(paths)
    return str(caught.value).splitlines()


@pytest.fixture
def other(home: Path, tmp_path: Path) -> Path:
    """A copy of run B, to play with."""
    shutil.copytree(home / "b", tmp_path / "other")
    return tmp_path / "other"


def test_everything_that_makes_runs_incomparable_is_said(home: Path, other: Path) -> None:
    path = other / "manifest.json"
    manifest = json.loads(path.read_text(encoding="utf-8"))
    manifest |= {"seed": 7, "scenarios": 90, "population_sha256": "f" * 64}
    manifest["feeder_sha256"] = "e" * 64
    path.write_text(json.dumps(manifest), encoding="utf-8")
    said = refusal(home / "a", other)
    assert said[-1] == "3 faults"
    what = f"{other}: feeder must be as in {home / 'a'}, "
    assert said[0].startswith(what)
    assert said[0].endswith("got ffffffffffff…")
    assert said[1] == f"{other}: seed must be as in {home / 'a'}, 1, got 7"
    assert said[2] == f"{other}: scenarios must be as in {home / 'a'}, {N}, got 90"


def test_a_missing_or_damaged_block_is_named(home: Path, other: Path) -> None:
    name = "validate-1-load_step-00000.npz"
    content = (other / "blocks" / name).read_bytes()
    (other / "blocks" / name).write_bytes(content[: len(content) // 2])
    assert refusal(home / "a", other)[0].startswith(f"{other}: blocks/{name} must be whole")
    (other / "blocks" / name).unlink()
    assert refusal(home / "a", other)[0].startswith(f"{other}: blocks/{name} must be there in both")


def test_blocks_of_other_events_are_noticed(home: Path, other: Path) -> None:
    """Whatever the manifest says: sides are kept with the verdicts."""
    names = [f"validate-1-{drawn}-00000.npz" for drawn in ("load_step", "open_phase")]
    content = (other / "blocks" / names[1]).read_bytes()
    (other / "blocks" / names[0]).write_bytes(content)
    assert refusal(home / "a", other)[0].endswith("must hold the same events")


def test_a_folder_without_a_run_is_a_fault_of_the_input(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["compare", str(home / "a"), str(tmp_path)]) == cli.BAD_INPUT
    assert "must be the folder of a finished run" in capsys.readouterr().err
    assert cli.main(["compare", str(home / "a")]) == cli.BAD_INPUT
    assert "must be two folders at least" in capsys.readouterr().err


def test_runs_that_drew_other_classes_are_incomparable(home: Path, other: Path) -> None:
    """Leaving a class out changes no draw of the others, so the population is the same."""
    for path in (other / "blocks").glob("*load_step*"):
        path.unlink()
    (said,) = refusal(home / "a", other)
    assert said.startswith(f"{other}: classes drawn must be as in {home / 'a'}, load_step, open_")
    assert said.endswith("got open_phase, open_three, source_step")
