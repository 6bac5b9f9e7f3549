"""Settings sheets as input: what is read, and one message for everything that is wrong."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest

from openphase.detector.criteria import Options, Settings
from openphase.model import load_feeder
from openphase.model.errors import InputError
from openphase.model.parts import Feeder
from openphase.studies import cli
from openphase.studies.run.options import options_text, parse_options
from openphase.studies.settings_file import read_settings, read_sheet

MALFORMED = Path(__file__).parents[1] / "malformed" / "settings"
CASES = sorted(path for path in MALFORMED.iterdir() if path.is_dir())
HEAD = "local,remote,i_set_a,v_set_pu,z_set_ohm"


@pytest.fixture(scope="module")
def feeder() -> Feeder:
    return load_feeder("paper")


def sheet(folder: Path, text: str) -> Path:
    path = folder / "sheet.csv"
    path.write_text(text, encoding="utf-8")
    return path


# --- malformed sheets: a folder each, with the exact message -----------------------------


def refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Run a command that must say what is wrong with its input, and nothing else."""
    assert cli.main(words) == cli.BAD_INPUT
    said = capsys.readouterr()
    assert said.out == ""
    return said.err


def test_there_are_malformed_sheets() -> None:
    assert len(CASES) >= 6


@pytest.mark.parametrize("folder", CASES, ids=lambda path: path.name)
def test_a_malformed_sheet_is_refused_with_its_message(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(folder)
    words = ["assess", "paper", "--settings", "settings.csv", "--out", str(tmp_path / "run")]
    message = (folder / "message.txt").read_text(encoding="utf-8")
    assert refused(words, capsys) == message
    assert not (tmp_path / "run").exists()
    solve = ["solve", "paper", "--open", "R2-R3:0.6:a", "--settings", "settings.csv"]
    own = folder / "message-solve.txt"
    expected = own.read_text(encoding="utf-8") if own.exists() else message
    assert refused(solve, capsys) == expected


@pytest.mark.parametrize("seed", range(60))
def test_a_mangled_sheet_is_read_or_refused_and_never_stumbled_over(
    feeder: Feeder, tmp_path: Path, seed: int
) -> None:
    """Bytes of a good sheet are changed, dropped and doubled at random."""
    rng = np.random.default_rng(seed)
    good = f"{HEAD},setting_group,negative_sign,options\nR1,R2,1,0.05,5,normal,True,\n" * 2
    content = bytearray(good.encode())
    for _ in range(int(rng.integers(1, 6))):
        at = int(rng.integers(len(content)))
        how = int(rng.integers(3))
        if how == 0:
            content[at] = int(rng.integers(256))
        elif how == 1:
            del content[at]
        else:
            content[at:at] = content[at : at + int(rng.integers(1, 20))]
    path = tmp_path / "sheet.csv"
    path.write_bytes(bytes(content))
    with contextlib.suppress(InputError):
        (*groups,) = read_sheet(path, feeder).groups.values()
        assert any(own for group in groups for own in group.values())


def test_faults_of_sheet_and_study_come_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = tmp_path / "study.toml"
    study.write_text("format = 1\n[loads]\nlevel = -1.0\n", encoding="utf-8")
    path = sheet(tmp_path, f"{HEAD}\nR1,R2,x,0.05,5\n")
    words = ["assess", "paper", "--study", str(study), "--settings", str(path)]
    said = refused([*words, "--out", str(tmp_path / "run")], capsys).splitlines()
    assert said[0].startswith(f"{study}:3: ")
    assert said[1].startswith(f"{path}:2: R1→R2: i_set_a")
    assert said[2] == "2 faults"


# --- what is read ------------------------------------------------------------------------


def test_a_sheet_without_columns_for_them_takes_the_options_it_is_given(
    feeder: Feeder, tmp_path: Path
) -> None:
    path = sheet(tmp_path, f"{HEAD}\nR1,R2,1,0.05,5\nR2,R1,,,\n")
    default = Options(negative_sign=False, compensated=True)
    (rows,) = read_sheet(path, feeder, default).groups.values()
    own = Settings(i_set_a=1.0, v_set_pu=0.05, z_set_ohm=5.0, options=default)
    assert rows == {("R1", "R2"): own, ("R2", "R1"): None}
    (plain,) = read_sheet(path, feeder).groups.values()
    assert plain["R1", "R2"] == Settings(i_set_a=1.0, v_set_pu=0.05, z_set_ohm=5.0)


def test_a_sheet_s_own_options_win(feeder: Feeder, tmp_path: Path) -> None:
    text = f"{HEAD},negative_sign,options\nR1,R2,1,0.05,5,False,any_sequence=true; floor_v=10\n"
    path = sheet(tmp_path, text + "R2,R3,1,0.05,5,,\n")
    default = Options(compensated=True)
    (rows,) = read_sheet(path, feeder, default).groups.values()
    own, other = rows["R1", "R2"], rows["R2", "R3"]
    assert own is not None
    assert other is not None
    assert own.options == Options(negative_sign=False, any_sequence=True, floor_v=10.0)
    assert other.options == Options()  # an empty cell says: all at their defaults


@pytest.mark.parametrize(
    "options",
    [
        Options(),
        Options(fallback=False, both_ends="agree"),
        Options(compensated=True, any_sequence=True, floor_v=12.5, waive_sign_below_a=0.0),
        Options(unbalance=0.05, direction=True, both_ends="no_small_z"),
    ],
)
def test_options_are_read_back_as_written(options: Options) -> None:
    assert parse_options(options_text(options), options.negative_sign) == options


def test_empty_lines_and_a_byte_order_mark_are_no_fault(feeder: Feeder, tmp_path: Path) -> None:
    path = tmp_path / "excel.csv"
    path.write_bytes(b"\xef\xbb\xbf" + f"{HEAD}\r\n\r\nR1 , R2,1,0.05,5\r\n,,,,\r\n".encode())
    assert list(read_settings(path, feeder)) == [("R1", "R2")]


# --- groups ------------------------------------------------------------------------------

GROUPED = (
    "local,remote,setting_group,i_set_a,v_set_pu,z_set_ohm\n"
    "R1,R2,normal,1,0.05,5\nR1,R2,tied,2,0.05,5\nR2,R1,tied,3,0.05,5\n"
)


def test_every_group_of_the_study_has_its_own(feeder: Feeder, tmp_path: Path) -> None:
    found = read_sheet(sheet(tmp_path, GROUPED), feeder)
    tied, normal = found.for_groups(["tied", "normal"])
    assert {pair: own.i_set_a for pair, own in tied.items() if own} == {
        ("R1", "R2"): 2.0,
        ("R2", "R1"): 3.0,
    }
    assert {pair: own.i_set_a for pair, own in normal.items() if own} == {("R1", "R2"): 1.0}


@pytest.mark.parametrize("head", [HEAD, f"{HEAD},setting_group"])
def test_a_sheet_of_one_group_serves_all(feeder: Feeder, tmp_path: Path, head: str) -> None:
    row = "R1,R2,1,0.05,5,summer" if "group" in head else "R1,R2,1,0.05,5"
    found = read_sheet(sheet(tmp_path, f"{head}\n{row}\n"), feeder)
    one, other = found.for_groups(["normal", "tied"])
    assert one == other
    assert one["R1", "R2"] is not None


def test_groups_that_do_not_fit_are_all_named(feeder: Feeder, tmp_path: Path) -> None:
    found = read_sheet(sheet(tmp_path, GROUPED), feeder)
    with pytest.raises(InputError) as caught:
        found.for_groups(["normal", "tie closed"])
    said = str(caught.value).splitlines()
    assert "sheet.csv:3: setting_group must be a group of the study" in said[0]
    assert said[0].endswith("got 'tied'")
    assert said[1].endswith(
        "must hold the study's setting group 'tie closed', or one group for all"
    )
