"""``openphase size`` as a user meets it: small runs on the paper's feeder."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from openphase.model import load_feeder
from openphase.model.distributions import Uniform
from openphase.model.errors import OpenPhaseError
from openphase.model.reading.feeder_file import dump_feeder
from openphase.optimise.certificate import upper_bound
from openphase.studies import cli, sizing
from openphase.studies.run import session
from openphase.studies.run.classes import DrawClass
from openphase.studies.run.digests import population_digest
from openphase.studies.run.ledger import find_attempt, reserve
from openphase.studies.spec.parts import Group, GroupSettings, NetworkState
from openphase.studies.spec.study_file import Study, default_study, dump_study

NOT_COMPARED = {"log.txt", "timing.json"}

RESULT_KEYS = """version seed feeder study_hash confidence attempt scenarios sections compared
    feeder_false_trips numerics"""
SECTION_KEYS = """local remote setting_group status reason i_set_a i_set_pu v_set_pu z_set_ohm
    dt_ms delay_ms trigger negative_sign options line_z1_ohm margin opens unreachable detected
    dependability dependability_low dependability_high least_z_op_ohm security_trials false_trips
    false_trip_upper
    false_trips_per_year_upper classes causes nearest_false_trip fixes"""
COMPARED_KEYS = """local remote setting_group name i_set_a v_set_pu z_set_ohm detected opens
    unreachable dependability_low dependability_high false_trips trials upper reason"""
CLASS_KEYS = "name kind side trials effective_trials trips upper"


@dataclass(frozen=True)
class Said:
    """What a command answered."""

    code: int
    out: str
    err: str

    @property
    def result(self) -> dict[str, Any]:
        return dict(json.loads(self.out))


def run(*words: object) -> Said:
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = cli.main([str(word) for word in words])
    return Said(code, out.getvalue(), err.getvalue())


KEPT = ("open_phase", "load_step", "source_step", "open_three")


def lean_study(**changes: Any) -> Study:
    """The paper's study with four classes of events, where more would only take time."""
    study = default_study("paper")
    without = tuple(own.name.lower() for own in DrawClass if own.name.lower() not in KEPT)
    return replace(study, events=replace(study.events, without=without), **changes)


LEAN: list[Path] = []  # the file of that study


@pytest.fixture(scope="module", autouse=True)
def lean(tmp_path_factory: pytest.TempPathFactory) -> None:
    LEAN[:] = [tmp_path_factory.mktemp("study") / "lean.toml"]
    LEAN[0].write_text(dump_study(lean_study()), encoding="utf-8")


def size(out: Path, *more: object, seed: int = 1, study: Path | None = None) -> Said:
    words = ("size", "paper", "--scenarios", 400, "--seed", seed, "--json", "--out", out)
    return run(*words, "--study", study or LEAN[0], *(more or ("--jobs", 1)))


def files(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in NOT_COMPARED
    }


def ledger(out: Path) -> dict[str, Any]:
    return dict(json.loads((out.parent / "ledger.json").read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one finished run and its ledger; tests must not change it."""
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def first(home: Path) -> Said:
    return size(home / "run")


@pytest.fixture
def copy(home: Path, first: Said, tmp_path: Path) -> Path:
    """The finished run again, ledger and all, to play with."""
    shutil.copytree(home, tmp_path / "copy")
    return tmp_path / "copy" / "run"


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs without report and pictures, where these are not the point: drawing takes longest."""
    monkeypatch.setattr(sizing, "write_report", lambda *_: None)


# --- the answer ------------------------------------------------------------------------


def test_the_keys_are_the_contract_s(first: Said) -> None:
    result = first.result
    assert list(result) == RESULT_KEYS.split()
    assert list(result["feeder_false_trips"]) == ["per_year_upper", "assumptions"]
    numerics = result["numerics"]
    counts = ["dead", "floating", "unearthed", "not_converged"]
    assert list(numerics) == [*counts, "training_not_converged", "by_class"]
    for name in counts:
        assert numerics[name] == sum(own[name] for own in numerics["by_class"])
    for row in result["sections"]:
        assert list(row) == SECTION_KEYS.split()
        for own in row["classes"]:
            more = ["alarms"] if own["name"] == "wiring" else []
            assert list(own) == CLASS_KEYS.split() + more
            assert own["kind"] in ("must_trip", "must_not_trip", "apart")
            assert own["side"] in ("inside", "upstream", "downstream", "other", "network")
        for cause in row["causes"]:
            assert list(cause) == ["criterion", "share"]
        if row["nearest_false_trip"]:
            assert list(row["nearest_false_trip"]) == ["class", "factor", "scenario"]
    for row in result["compared"]:
        assert list(row) == COMPARED_KEYS.split()


def test_every_directed_terminal_has_a_row_and_its_numbers_agree(first: Said) -> None:
    result = first.result
    names = [(row["local"], row["remote"]) for row in result["sections"]]
    pairs = [("R1", "R2"), ("R2", "R3"), ("R3", "R4"), ("R5", "R4b")]
    assert names == [pair for own in pairs for pair in (own, own[::-1])]
    assert (result["seed"], result["attempt"], result["scenarios"]) == (1, 1, 400)
    for row in result["sections"]:
        if row["status"] == "load_side":
            continue
        reachable = row["opens"] - row["unreachable"]
        assert 0 <= row["detected"] <= reachable
        assert row["dependability"] == row["detected"] / reachable
        assert row["dependability_low"] <= row["dependability"] <= row["dependability_high"]
        assert row["margin"] >= 1.25
        assert row["nearest_false_trip"]["factor"] == pytest.approx(row["margin"])
        assert sum(cause["share"] for cause in row["causes"]) == pytest.approx(
            1.0 if row["detected"] < reachable else 0.0
        )
        must_not = [own for own in row["classes"] if own["kind"] == "must_not_trip"]
        assert row["security_trials"] == sum(own["trials"] for own in must_not)
        assert row["false_trips"] == sum(own["trips"] for own in must_not)
        assert row["false_trip_upper"] == max(own["upper"] for own in must_not)
        # every class was drawn until it had what was asked for
        assert all(own["trials"] >= 400 for own in row["classes"] if own["kind"] != "apart")
        chosen = [own for own in result["compared"] if own["name"] == "chosen"]
        mine = next(own for own in chosen if own["local"] == row["local"])
        same = ("i_set_a", "v_set_pu", "z_set_ohm", "detected", "false_trips")
        assert [mine[key] for key in same] == [row[key] for key in same]
        assert (mine["trials"], mine["upper"]) == (row["security_trials"], row["false_trip_upper"])


def test_too_few_scenarios_certify_nothing_and_say_so(first: Said) -> None:
    assert first.code == 3
    statuses = {row["local"]: row for row in first.result["sections"]}
    for name in ("R1", "R3", "R5"):
        assert statuses[name]["status"] == "not_certified"
        assert "too few scenarios" in statuses[name]["reason"]
    away = [row for row in first.result["sections"] if row["status"] == "load_side"]
    assert len(away) == 4
    assert all(row["i_set_a"] is None for row in away)


def test_stdout_is_the_answer_and_nothing_else(home: Path, first: Said) -> None:
    assert first.out == (home / "run" / "result.json").read_text(encoding="utf-8")
    assert first.err.startswith("paper: 8 terminals, 4 to judge")


def test_the_folder_holds_what_it_should(home: Path, first: Said) -> None:
    names = {path.name for path in (home / "run").iterdir()}
    needed = {"study.toml", "manifest.json", "result.json", "settings.csv", "report.html"}
    assert needed | {"blocks"} | NOT_COMPARED <= names
    study = (home / "run" / "study.toml").read_text(encoding="utf-8")
    assert study == dump_study(lean_study())
    with (home / "run" / "settings.csv").open(encoding="utf-8", newline="") as file:
        sheet = list(csv.DictReader(file))
    for row, line in zip(first.result["sections"], sheet, strict=True):
        for key, value in line.items():
            assert value == ("" if row[key] is None else str(row[key]))
    left_out = {"line_z1_ohm", "classes", "causes", "nearest_false_trip", "fixes"}
    assert set(sheet[0]) == set(SECTION_KEYS.split()) - left_out


@pytest.mark.usefixtures("plain")
def test_the_table_fits_a_terminal(tmp_path: Path) -> None:
    """With every class of the study that ships."""
    words = ("size", "paper", "--scenarios", 100, "--jobs", 1, "--out", tmp_path / "run")
    said = run(*words)
    table = said.out.splitlines()[:-1]  # the last line names the folder, however long its path
    assert max(len(line) for line in table) <= 100
    assert "load_side" in said.out


@pytest.mark.usefixtures("plain")
def test_a_lenient_study_is_answered_with_zero(tmp_path: Path) -> None:
    """With a bound of .05 a hundred scenarios do, and every section ends up set or weak."""
    said = size(tmp_path / "run", seed=2, study=lenient(tmp_path))
    statuses = {row["status"] for row in said.result["sections"]}
    assert (said.code, "not_certified" in statuses) in ((0, False), (3, True))
    assert statuses & {"set", "weak"}


def lenient(folder: Path) -> Path:
    path = folder / "lenient.toml"
    text = dump_study(lean_study())
    path.write_text(text.replace("target = 0.0001", "target = 0.05"), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("statuses", "code"),
    [
        (("set", "load_side", "weak", "load_side"), 0),
        (("none", "set", "weak", "none"), 0),
        (("set", "load_side", "none", "load_side"), 3),
        (("load_side", "load_side", "set", "set"), 3),
        (("set", "not_certified", "set", "set"), 3),
    ],
)
def test_exit_code(statuses: tuple[str, ...], code: int) -> None:
    assert session.exit_code({"sections": rows_of("normal", *statuses)}) == code


def test_settings_that_find_nothing_serve_nobody() -> None:
    rows = rows_of("normal", "weak", "load_side", "set", "load_side")
    assert session.exit_code({"sections": rows}) == 0
    rows[0]["detected"] = 0
    assert session.exit_code({"sections": rows}) == 3


def rows_of(group: str, *statuses: str) -> list[dict[str, Any]]:
    ends = [("A", "B"), ("B", "A"), ("B", "C"), ("C", "B")]
    return [
        {"local": a, "remote": b, "setting_group": group, "status": status, "detected": 7}
        for (a, b), status in zip(ends, statuses, strict=True)
    ]


def test_a_section_needs_a_usable_terminal_in_every_group() -> None:
    normal = rows_of("normal", "set", "load_side", "weak", "load_side")
    tied = rows_of("tied", "set", "set", "set", "set")
    assert session.exit_code({"sections": normal + tied}) == 0
    tied = rows_of("tied", "set", "set", "none", "none")
    assert session.exit_code({"sections": normal + tied}) == 3


# --- setting groups ---------------------------------------------------------------------

GROUPS = (
    Group(name="normal", closed=()),
    Group(name="tied", closed=("R4",)),
    Group(name="backwards", closed=("R4",), opened=("R1",)),
)


def grouped(folder: Path, settings: GroupSettings) -> Path:
    """A study of three network states."""
    network = NetworkState(settings=settings)
    path = folder / f"{settings}.toml"
    study = lean_study(groups=GROUPS, network=network)
    path.write_text(dump_study(study), encoding="utf-8")
    return path


def by_terminal(said: Said) -> dict[str, list[dict[str, Any]]]:
    found: dict[str, list[dict[str, Any]]] = {}
    for row in said.result["sections"]:
        found.setdefault(f"{row['local']}→{row['remote']}", []).append(row)
    return found


@pytest.fixture(scope="module")
def groups(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Said]:
    """The same three states, with settings of their own and with one setting for all."""
    folder = tmp_path_factory.mktemp("groups")
    kinds: tuple[GroupSettings, ...] = ("each", "one")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sizing, "write_report", lambda *_: None)
        return {kind: size(folder / kind, study=grouped(folder, kind)) for kind in kinds}


def test_every_group_has_a_row_for_every_terminal(groups: dict[str, Said]) -> None:
    for said in groups.values():
        assert len(said.result["sections"]) == 24
        for rows in by_terminal(said).values():
            assert [row["setting_group"] for row in rows] == ["normal", "tied", "backwards"]


def test_groups_share_alpha(groups: dict[str, Said]) -> None:
    """4 + 8 + 4 terminals are judged in the three states; with one setting for all, 8 in each."""
    for kind, pairs, attempt in (("each", 16, 1), ("one", 24, 2)):
        for row in groups[kind].result["sections"]:
            if row["i_set_a"] is None:
                continue
            alpha = 0.05 / 2**attempt / pairs
            source = next(own for own in row["classes"] if own["name"] == "source_step")
            bound = upper_bound(source["trips"], source["trials"], alpha)
            assert source["upper"] == pytest.approx(bound)


def test_each_group_is_the_study_of_that_state_alone(
    groups: dict[str, Said], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first group draws what a study without groups draws, so it chooses the same."""
    monkeypatch.setattr(sizing, "write_report", lambda *_: None)
    alone = by_terminal(size(tmp_path / "run"))
    same = ("status", "i_set_a", "v_set_pu", "z_set_ohm", "margin", "opens", "detected")
    for name, rows in by_terminal(groups["each"]).items():
        (own,) = alone[name]
        assert [rows[0][key] for key in same] == [own[key] for key in same]


def test_one_setting_for_all_is_the_same_in_every_group(groups: dict[str, Said]) -> None:
    some = 0
    for rows in by_terminal(groups["one"]).values():
        settings = {(row["i_set_a"], row["v_set_pu"], row["z_set_ohm"]) for row in rows}
        assert len(settings) == 1
        some += None not in settings.pop()
    assert some


def test_a_loop_without_room_for_z_set_has_no_setting(groups: dict[str, Said]) -> None:
    """R5→R4b: 1.3 of 3.26 Ω; 2 x 1.3 > 1.96 / 1.25. All others have a window."""
    low, high = 2.0 * 0.85, (3.26 - 0.85) / 1.25
    for name, rows in by_terminal(groups["each"]).items():
        tied = rows[1]
        if "R5" in name:
            assert tied["status"] == "none"
            assert "2 times the section's 1.3 Ω, that is 2.6 Ω" in tied["reason"]
            assert "What may help: a section of at most 0.9 Ω" in tied["reason"]
        elif name in ("R2→R3", "R3→R2") and tied["z_set_ohm"] is not None:
            assert low <= tied["z_set_ohm"] <= high
    missing = [
        row
        for row in groups["each"].result["compared"]
        if (row["local"], row["setting_group"], row["name"]) == ("R5", "tied", "chosen")
    ]
    assert missing[0]["reason"] == "no Z_set keeps the closed loop's margins"


def test_settings_and_counts_are_kept_per_row(groups: dict[str, Said], tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sizing, "write_report", lambda *_: None)
        said = size(folder, study=grouped(tmp_path, "each"))
    assert said.out == groups["each"].out
    with (folder / "settings.csv").open(encoding="utf-8", newline="") as file:
        sheet = list(csv.DictReader(file))
    assert [row["setting_group"] for row in sheet] == [
        row["setting_group"] for row in said.result["sections"]
    ]
    with np.load(folder / "counts.npz") as counts:
        judged = {int(key.split(".")[0]) for key in counts.files if not key.startswith("grid")}
    rows = enumerate(said.result["sections"])
    assert judged == {n for n, row in rows if row["status"] != "load_side"}


# --- the same bytes --------------------------------------------------------------------


def test_two_processes_write_the_same_bytes(home: Path, first: Said, tmp_path: Path) -> None:
    again = size(tmp_path / "elsewhere", "--jobs", 2)
    assert (again.code, again.out) == (first.code, first.out)
    assert files(tmp_path / "elsewhere") == files(home / "run")


def test_an_interrupted_run_resumes_to_the_same_bytes(home: Path, first: Said, copy: Path) -> None:
    for path in sorted((copy / "blocks").glob("*.npz"))[::2]:
        path.unlink()
    for path in copy.iterdir():
        if path.is_file() and path.name not in ("manifest.json", "log.txt"):
            path.unlink()
    again = size(copy)
    assert "resuming" in again.err
    assert again.out == first.out
    assert files(copy) == files(home / "run")


def broken(content: bytes, how: str) -> bytes:
    if how == "truncated":
        return content[: len(content) // 2]
    if how == "empty":
        return b""
    if how == "garbage":
        return b"not a block at all"
    middle = bytearray(content)
    if how == "a number changed":
        at = content.index(b"NUMPY") + 200  # in the first array, behind its header
        middle[at] ^= 0xFF
    else:  # the compression method in the archive's directory
        at = content.rindex(b"PK\x01\x02") + 10
        middle[at] = 99
    return bytes(middle)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    "how", ["truncated", "empty", "garbage", "a number changed", "unknown compression"]
)
def test_a_damaged_block_is_computed_again(home: Path, first: Said, copy: Path, how: str) -> None:
    for path in (copy / "blocks").glob("*-open_phase-00000.npz"):
        path.write_bytes(broken(path.read_bytes(), how))
    again = size(copy)
    assert again.out == first.out
    assert files(copy) == files(home / "run")


# --- attempts --------------------------------------------------------------------------


@pytest.mark.usefixtures("plain")
def test_another_seed_starts_afresh_and_is_another_attempt(
    home: Path, first: Said, copy: Path
) -> None:
    second = size(copy, seed=2)
    assert "starting afresh" in second.err
    assert second.result["attempt"] == 2
    assert second.result["seed"] == 2
    names = {path.name for path in (copy / "blocks").iterdir()}
    assert {name.split("-")[1] for name in names} == {"2"}
    # half of alpha: at the same n the bound is larger
    bounds = [own.result["sections"][0]["false_trip_upper"] for own in (first, second)]
    assert bounds[1] > bounds[0]
    kept = ledger(copy)
    # repeating keeps the number, and so does going back to the first
    assert size(copy, seed=2).out == second.out
    assert size(copy).out == first.out
    left, known = files(copy), files(home / "run")
    assert left == {name: known[name] for name in left}
    assert {name for name in known if name.startswith("blocks")} <= left.keys()
    assert ledger(copy) == kept


def test_the_ledger_counts_by_population_study_seed_and_size(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "ledger.json"
    tries = [
        ("a", "s", 1, 400),
        ("a", "s", 2, 400),
        ("b", "s", 1, 400),
        ("a", "s", 1, 500),
        ("a", "other demands", 1, 400),
        ("a", "s", 2, 400),
    ]
    numbers = []
    for own in tries:
        attempt = find_attempt(path, *own)
        assert find_attempt(path, *own) == attempt  # looking writes nothing
        assert reserve(path, *own) == attempt
        numbers.append(attempt.number)
    assert numbers == [1, 2, 1, 3, 4, 2]


def test_a_size_left_open_grows_with_the_attempt(tmp_path: Path) -> None:
    path = tmp_path / "ledger.json"

    def needed(attempt: int) -> int:
        return 100 * attempt

    for seed, number in ((1, 1), (2, 2), (1, 1), (2, 2)):
        attempt = reserve(path, "a", "s", seed, needed)
        assert (attempt.number, attempt.scenarios) == (number, 100 * number)
    assert find_attempt(path, "a", "s", 2, 200).number == 2


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    "content",
    [
        b"",
        b'{"half": [',
        b"[]",
        b"null",
        b"\xff\xfe",
        b'{"KEY": null}',
        b'{"KEY": {}}',
        b'{"KEY": 3}',
    ],
)
def test_a_damaged_ledger_stops_the_run(copy: Path, content: bytes) -> None:
    (key,) = ledger(copy)
    damaged = content.replace(b"KEY", key.encode())
    (copy.parent / "ledger.json").write_bytes(damaged)
    before = files(copy)
    said = size(copy)
    assert said.code == 1
    assert "ledger.json" in said.err
    assert said.out == ""
    assert (copy.parent / "ledger.json").read_bytes() == damaged
    assert files(copy) == before


@pytest.mark.usefixtures("plain")
def test_to_name_the_default_size_is_no_new_attempt(tmp_path: Path) -> None:
    """The manifest's command, which names it, must find its own run again."""
    words = ("size", "paper", "--study", lenient(tmp_path), "--json", "--jobs", 1)
    out = tmp_path / "run"
    run(*words, "--out", out, "--seed", 1)
    second = run(*words, "--out", out, "--seed", 2)
    assert second.result["attempt"] == 2
    manifest = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    named = ("--scenarios", manifest["scenarios"], "--seed", 2)
    again = run(*words, "--out", out, *named)
    assert again.result["attempt"] == 2
    assert again.out == second.out


# --- what a run may not touch ----------------------------------------------------------


@pytest.mark.usefixtures("plain")
def test_a_foreign_folder_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "photos"
    out.mkdir()
    (out / "cat.png").write_bytes(b"cat")
    said = size(out)
    assert said.code == 1
    assert "photos" in said.err
    assert "--out" in said.err
    assert files(out) == {"cat.png": b"cat"}


@pytest.mark.usefixtures("plain")
def test_a_refused_folder_costs_no_attempt(tmp_path: Path) -> None:
    out = tmp_path / "photos"
    out.mkdir()
    (out / "cat.png").write_bytes(b"cat")
    assert size(out, seed=8).code == 1
    assert size(tmp_path / "run", seed=9).result["attempt"] == 1


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("manifest", [b'{"name": "somebody else\'s app"}', b"\xff\xfe", b"[]"])
def test_a_foreign_folder_with_a_manifest_is_refused(tmp_path: Path, manifest: bytes) -> None:
    out = tmp_path / "app"
    out.mkdir()
    (out / "manifest.json").write_bytes(manifest)
    (out / "package.json").write_bytes(b"{}")
    (out / "feeder.toml").write_bytes(b"format = 1")
    before = files(out)
    said = size(out)
    assert files(out) == before
    assert said.code == 1
    assert "app" in said.err


@pytest.mark.usefixtures("plain")
def test_starting_afresh_leaves_the_user_s_own_files(copy: Path) -> None:
    own = {"feeder.toml": b"mine", "notes.csv": b"mine", "photo.png": b"mine"}
    for name, content in own.items():
        (copy / name).write_bytes(content)
    assert "starting afresh" in size(copy, seed=2).err
    left = files(copy)
    assert {name: left.get(name) for name in own} == own


@pytest.mark.usefixtures("plain")
def test_the_current_folder_may_be_the_run_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    said = size(Path())
    assert said.code == 3, said.err
    assert (here / "result.json").exists()
    assert (tmp_path / "ledger.json").exists()  # beside the run folder, not in it
    assert not (here / "ledger.json").exists()


@pytest.mark.usefixtures("plain")
def test_a_long_run_is_refused_without_yes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "LONG_RUN_S", 0)
    said = size(tmp_path / "run")
    assert said.code == 1
    assert "--yes" in said.err
    assert size(tmp_path / "run", "--jobs", 1, "--yes").code == 3


@pytest.mark.usefixtures("plain")
def test_a_run_that_is_refused_for_its_length_has_changed_nothing(
    copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The earlier results are there still, and no draw was looked at: no attempt is spent."""
    before, kept = files(copy), ledger(copy)
    monkeypatch.setattr(session, "LONG_RUN_S", 0)
    assert size(copy, seed=2).code == 1
    assert files(copy) == before
    assert ledger(copy) == kept


def test_a_feeder_without_sections_is_a_fault_of_the_input(tmp_path: Path) -> None:
    path = tmp_path / "bare.toml"
    bare = replace(load_feeder("paper"), sections=(), name="bare")
    path.write_text(dump_feeder(bare), encoding="utf-8")
    said = run("size", path, "--out", tmp_path / "run")
    assert said.code == 2
    assert "sections" in said.err
    assert not (tmp_path / "run").exists()


def test_an_unwritable_place_is_told_as_such(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    said = size(tmp_path / "file" / "run")
    assert said.code == 1
    assert "file" in said.err
    path = tmp_path / "file" / "ledger.json"
    with pytest.raises(OpenPhaseError):
        reserve(path, "a", "s", 1, 1)


def test_runs_at_the_same_time_get_numbers_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "ledger.json"
    with ThreadPoolExecutor(8) as pool:
        taken = pool.map(lambda seed: reserve(path, "a", "s", seed, 400).number, range(24))
        assert sorted(taken) == list(range(1, 25))


def test_one_population_however_it_is_written() -> None:
    feeder, study = load_feeder("paper"), default_study("paper")
    own = population_digest(feeder, study)
    unnamed = replace(study, network=NetworkState(closed=None))
    assert population_digest(replace(feeder, name="other"), unnamed) == own
    margin = replace(study, certificate=replace(study.certificate, margin=2.0))
    assert population_digest(feeder, margin) == own
    loads = replace(study, loads=replace(study.loads, level=Uniform(low=0.5, high=1.0)))
    assert population_digest(feeder, loads) != own
    tied = replace(study, network=NetworkState(closed=("R4",)))
    assert population_digest(feeder, tied) != own


def test_every_group_is_part_of_the_population() -> None:
    feeder, study = load_feeder("paper"), default_study("paper")

    def grouped(*groups: Group, settings: str = "each") -> str:
        network = replace(study.network, settings=settings)
        return population_digest(feeder, replace(study, groups=groups, network=network))

    normal = Group(name="normal", closed=())
    tied = Group(name="tied", closed=("R4",))
    both = grouped(normal, tied)
    assert len({grouped(normal), both, grouped(tied, normal)}) == 3
    backwards = Group(name="tied", closed=("R4",), opened=("R1",))
    assert grouped(normal, backwards) != both
    # whether the groups share their settings is a demand, and draws nothing else
    assert grouped(normal, tied, settings="one") == both
