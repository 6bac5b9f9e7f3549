"""``openphase assess`` as a user meets it: existing settings on the draws of ``size``."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from openphase.model.distributions import Uniform
from openphase.studies import assessing, cli, sizing
from openphase.studies.run.classes import DrawClass
from openphase.studies.spec.events import LoadSwapDraw
from openphase.studies.spec.parts import Group
from openphase.studies.spec.study_file import Study, default_study, dump_study

N = 60
KEPT = ("open_phase", "load_step", "source_step", "open_three")


@dataclass(frozen=True)
class Said:
    """What a command answered."""

    code: int
    out: str
    err: str

    @property
    def result(self) -> dict[str, Any]:
        return dict(json.loads(self.out))

    def row(self, terminal: str, group: str = "normal") -> dict[str, Any]:
        (found,) = [
            row
            for row in self.result["sections"]
            if (f"{row['local']}→{row['remote']}", row["setting_group"]) == (terminal, group)
        ]
        return dict(found)


def run(*words: object) -> Said:
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = cli.main([str(word) for word in words])
    return Said(code, out.getvalue(), err.getvalue())


def study_of(**changes: Any) -> Study:
    """The paper's study with four classes of events, for speed."""
    study = default_study("paper")
    without = tuple(own.name.lower() for own in DrawClass if own.name.lower() not in KEPT)
    return replace(study, events=replace(study.events, without=without), **changes)


def write_study(path: Path, study: Study) -> Path:
    path.write_text(dump_study(study), encoding="utf-8")
    return path


def size(home: Path, out: str = "sized", seed: int = 1) -> Said:
    return run(
        *("size", "paper", "--study", home / "study.toml", "--scenarios", N, "--seed", seed),
        *("--jobs", 1, "--json", "--out", home / out),
    )


def assess(home: Path, settings: object, out: str = "assessed", seed: int = 1) -> Said:
    return run(
        *("assess", "paper", "--settings", settings, "--study", home / "study.toml"),
        *("--scenarios", N, "--seed", seed, "--jobs", 1, "--json", "--out", home / out),
    )


def files(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in ("log.txt", "timing.json")
    }


@pytest.fixture(scope="module", autouse=True)
def plain() -> Iterator[None]:
    """No report but where it is the point: drawing takes longest."""
    patch = pytest.MonkeyPatch()
    for module in (assessing, sizing):
        patch.setattr(module, "write_report", lambda *_: None)
    yield
    patch.undo()


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a finished sizing, its sheet assessed, and the reference assessed."""
    folder = tmp_path_factory.mktemp("home")
    write_study(folder / "study.toml", study_of())
    return folder


@pytest.fixture(scope="module")
def sized(home: Path) -> Said:
    return size(home)


@pytest.fixture(scope="module")
def own(home: Path, sized: Said) -> Said:
    """The sizing's own sheet, assessed."""
    return assess(home, home / "sized" / "settings.csv")


@pytest.fixture(scope="module")
def reference(home: Path, sized: Said) -> Said:
    return assess(home, "reference", "reference")


@pytest.fixture
def copy(home: Path, sized: Said, tmp_path: Path) -> Path:
    """The sizing again, ledger and all, to play with."""
    shutil.copytree(home, tmp_path / "copy")
    return tmp_path / "copy"


# --- the same evidence -------------------------------------------------------------------

TRAINED = ("margin", "nearest_false_trip")  # what only training knows


def test_a_sized_sheet_gets_the_very_counts_that_size_gave_it(sized: Said, own: Said) -> None:
    for chosen, judged in zip(sized.result["sections"], own.result["sections"], strict=True):
        assert list(chosen) == list(judged)
        assert all(judged[key] is None for key in TRAINED)
        assert {k: v for k, v in chosen.items() if k not in TRAINED} == {
            k: v for k, v in judged.items() if k not in TRAINED
        }


def test_the_reference_beside_it_is_that_of_size(sized: Said, own: Said, reference: Said) -> None:
    def of(said: Said, name: str) -> list[dict[str, Any]]:
        return [
            {key: value for key, value in row.items() if key != "name"}
            for row in said.result["compared"]
            if row["name"] == name
        ]

    assert of(own, "reference") == of(sized, "reference")
    assert [row["name"] for row in own.result["compared"][:2]] == ["assessed", "reference"]
    # at every terminal, the load side too
    everywhere = of(reference, "assessed")
    assert len(everywhere) == 8
    judged = [row for row in of(sized, "reference") if row in everywhere]
    assert judged == of(sized, "reference")
    assert {row["name"] for row in reference.result["compared"]} == {"assessed"}


def test_the_reference_stands_at_every_terminal(reference: Said) -> None:
    for row in reference.result["sections"]:
        assert (row["i_set_a"], row["v_set_pu"], row["z_set_ohm"]) == (1.0, 0.05, 5.0)
        assert row["false_trips"] is not None
    # the paper's defaults trip falsely at the head: the reason says so, and spends no sample
    head = reference.row("R1→R2")
    assert head["status"] == "not_certified"
    assert head["false_trips"] > 0
    assert "false trips of" in head["reason"]
    assert "spent" not in head["reason"]
    assert reference.code == 3


def test_validation_blocks_are_those_of_size_but_for_what_the_settings_say(
    home: Path, own: Said
) -> None:
    """Nothing is trained, and what was drawn for validation is the same."""
    ours, theirs = (
        {path.name for path in (home / name / "blocks").iterdir()} for name in ("assessed", "sized")
    )
    assert ours == {name for name in theirs if name.startswith("validate-")}
    for name in ours:
        with (
            np.load(home / "assessed" / "blocks" / name) as a,
            np.load(home / "sized" / "blocks" / name) as b,
        ):
            for key in ("trials", "sample", "sample_side", "flags", "verdicts"):
                np.testing.assert_array_equal(a[key], b[key])


# --- attempts ----------------------------------------------------------------------------


def test_it_spends_no_attempt_and_has_the_number_size_has(copy: Path) -> None:
    book = copy / "ledger.json"
    before = book.read_bytes()
    assert assess(copy, "reference", "one").result["attempt"] == 1
    assert book.read_bytes() == before
    # of another seed: the number that size would get, and gets; it is taken from others
    assert assess(copy, "reference", "two", seed=2).result["attempt"] == 2
    assert assess(copy, "reference", "three", seed=3).result["attempt"] == 3
    assert size(copy, "two-sized", seed=2).result["attempt"] == 2


def test_only_the_ledger_is_written_beside_the_run_folder(tmp_path: Path) -> None:
    write_study(tmp_path / "study.toml", study_of())
    assert assess(tmp_path, "reference").code == 3
    assert {path.name for path in tmp_path.iterdir()} == {"study.toml", "assessed", "ledger.json"}


def test_another_study_of_the_feeder_gets_fresh_draws(copy: Path) -> None:
    """Whatever it changes: whoever has looked at a sample cannot have it again."""
    study = study_of()
    eased = replace(study.events, load_swap=LoadSwapDraw(ratio=Uniform(low=-0.9, high=-0.8)))
    write_study(copy / "study.toml", replace(study, events=eased))
    assert assess(copy, "reference", "eased").result["attempt"] == 2


def test_the_second_sheet_on_the_same_draws_is_certified_by_nothing(
    copy: Path, tmp_path: Path
) -> None:
    sheets = []
    for n, i_set_a in enumerate((5.0, 6.0)):
        path = tmp_path / f"sheet{n}.csv"
        path.write_text(
            f"local,remote,i_set_a,v_set_pu,z_set_ohm\nR2,R3,{i_set_a},0.05,20\n", encoding="utf-8"
        )
        sheets.append(str(path))
    first, second = (assess(copy, sheet, f"sheet{n}", seed=2) for n, sheet in enumerate(sheets))
    assert first.result["assessed"]["sheets_before"] == 0
    assert second.result["assessed"]["sheets_before"] == 1
    assert "other sheet" in second.result["assessed"]["note"]
    assert not {row["status"] for row in second.result["sections"]} & {"set", "weak"}
    again = assess(copy, sheets[0], "again", seed=2)
    assert again.result["assessed"]["sheets_before"] == 0
    # the draws that size judged its own sheet by have judged one
    assert assess(copy, sheets[0], "after-size").result["assessed"]["sheets_before"] == 1


# --- where a sheet comes from ------------------------------------------------------------


def test_a_sheet_chosen_on_these_draws_is_called_so(own: Said, reference: Said) -> None:
    assessed = own.result["assessed"]
    assert assessed["settings"] == "settings.csv"
    assert assessed["run_beside"] == {
        **{"verb": "size", "seed": 1, "attempt": 1},
        **{"same_draws": True, "edited": False},
    }
    assert "not further evidence" in assessed["note"]
    assert reference.result["assessed"]["run_beside"] is None
    assert reference.result["assessed"]["note"] is None


def edited(path: Path) -> None:
    """Lower one I_set of a sheet."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    rows[0]["i_set_a"] = "0.1"
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def test_a_sheet_changed_after_its_run_is_warned_of(copy: Path) -> None:
    edited(copy / "sized" / "settings.csv")
    said = assess(copy, copy / "sized" / "settings.csv")
    assert said.result["assessed"]["run_beside"]["edited"] is True
    assert "its bounds do not hold" in said.result["assessed"]["note"]
    # on fresh draws there is nothing to warn of
    fresh = assess(copy, copy / "sized" / "settings.csv", seed=5)
    assert fresh.result["assessed"]["run_beside"]["same_draws"] is False
    assert fresh.result["assessed"]["note"] is None


def test_a_sheet_elsewhere_has_no_run(copy: Path, tmp_path: Path) -> None:
    shutil.copy(copy / "sized" / "settings.csv", tmp_path / "mine.csv")
    (tmp_path / "manifest.json").write_text("[]", encoding="utf-8")
    said = assess(copy, tmp_path / "mine.csv")
    assert said.result["assessed"]["run_beside"] is None
    assert said.result["assessed"]["settings"] == "mine.csv"


# --- what a sheet may say ----------------------------------------------------------------


def test_terminals_that_the_sheet_leaves_out(home: Path, tmp_path: Path) -> None:
    path = tmp_path / "sheet.csv"
    rows = "R1,R2,0.5,0.01,30\nR2,R1,0.5,0.01,30\n"
    path.write_text(f"local,remote,i_set_a,v_set_pu,z_set_ohm\n{rows}", encoding="utf-8")
    said = assess(home, path, "partial")
    assert said.row("R1→R2")["status"] == "not_certified"  # 60 scenarios are too few
    missing = said.row("R3→R2")
    assert (missing["status"], missing["i_set_a"]) == ("load_side", None)
    away, ahead = said.row("R2→R1"), said.row("R2→R3")
    assert (away["status"], away["i_set_a"]) == ("load_side", 0.5)
    assert "all the same" in away["reason"]
    assert (ahead["status"], ahead["reason"]) == (
        "none",
        "the sheet leaves this terminal without a setting",
    )


def test_groups_and_a_closed_loop(home: Path, tmp_path: Path) -> None:
    """A Z_set that a closed loop does not allow is judged, and its reason says so."""
    groups = (Group(name="normal", closed=()), Group(name="tied", closed=("R4",)))
    network = replace(default_study("paper").network, closed=None)
    write_study(tmp_path / "study.toml", study_of(groups=groups, network=network))
    said = assess(tmp_path, "reference")
    result = said.result
    assert [row["setting_group"] for row in result["sections"]] == ["normal"] * 8 + ["tied"] * 8
    normal, tied = said.row("R1→R2"), said.row("R1→R2", "tied")
    assert "closed loop" not in normal["reason"]
    # m1 x .39 = .78 <= Z_set <= (3.26 - .39) / 1.25 = 2.3; 5 Ω finds nothing
    assert "Z_set 5 Ω does not keep the closed loop's margins" in tied["reason"]
    assert "0.78 to 2.3 Ω wanted" in tied["reason"]
    assert tied["detected"] < 0.1 * normal["detected"]
    names = {path.name for path in (tmp_path / "assessed" / "blocks").iterdir()}
    assert {name.startswith("validate-1-g1-") for name in names} == {True, False}


# --- folders -----------------------------------------------------------------------------


def test_the_folder_holds_its_own_sheet_and_repeats_to_the_same_bytes(
    home: Path, own: Said, tmp_path: Path
) -> None:
    folder = home / "assessed"
    names = {path.name for path in folder.iterdir()}
    assert {"study.toml", "manifest.json", "result.json", "settings.csv", "blocks"} <= names
    assert "counts.npz" not in names  # nothing was trained
    assert own.out == (folder / "result.json").read_text(encoding="utf-8")
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["command"][:4] == ["assess", "paper", "--settings", "settings.csv"]
    before = files(folder)
    again = assess(home, home / "sized" / "settings.csv")
    assert "resuming" in again.err
    assert again.out == own.out
    assert files(folder) == before


def test_another_sheet_in_the_same_folder_starts_afresh(copy: Path) -> None:
    assess(copy, "reference")
    said = assess(copy, copy / "sized" / "settings.csv")
    assert "starting afresh" in said.err
    assert said.row("R1→R2")["i_set_a"] != 1.0


def test_the_folder_of_the_sheet_is_not_written_over(copy: Path) -> None:
    before = files(copy)
    said = assess(copy, copy / "sized" / "settings.csv", "sized")
    assert said.code == cli.BAD_INPUT
    assert "must not be the folder that the sheet is in" in said.err
    assert files(copy) == before


def test_the_default_folder_is_named_after_the_sheet(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ("assess", "paper", "--study", home / "study.toml", "--scenarios", N, "--jobs", 1)
    said = run(*words, "--settings", "reference")
    assert (tmp_path / "runs" / "paper-reference" / "result.json").exists()
    assert max(len(line) for line in said.out.splitlines()) <= 100
    assert said.out.startswith("paper: assessment of reference, seed 1, attempt 1;")


def test_the_report_of_an_assessment(home: Path, tmp_path: Path) -> None:
    from openphase.studies.show.report import write_report

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assessing, "write_report", write_report)
        shutil.copy(home / "study.toml", tmp_path / "study.toml")
        said = assess(tmp_path, "reference")
    page = (tmp_path / "assessed" / "report.html").read_text(encoding="utf-8")
    assert "Assessment of open-phase settings for feeder paper" in page
    assert "training" not in page
    for row in said.result["sections"]:
        assert f"{row['false_trips']:,} of {row['security_trials']:,}" in page
    pictures = {path.name for path in (tmp_path / "assessed").glob("*.png")}
    assert {"feeder.png", "01-R1-R2-evidence.png"} <= pictures


def test_a_sheet_without_groups_is_that_of_the_only_group(copy: Path) -> None:
    """To take a column away that says nothing is no change of the settings."""
    path = copy / "sized" / "settings.csv"
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    keys = [key for key in rows[0] if key != "setting_group"]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, keys, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)
    assert assess(copy, path).result["assessed"]["run_beside"]["edited"] is False
