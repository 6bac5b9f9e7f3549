"""The parser, and what becomes of what a verb raises."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from openphase import __version__
from openphase.model.errors import InputError, OpenPhaseError
from openphase.studies import cli

ROOT = Path(__file__).parents[2]
ALL_VERBS = [verb for group in cli.VERBS.values() for verb in group]


def parse(command):
    return cli.build_parser().parse_args(command.split())


def refuse(command, capsys):
    """Run a wrong command line; return what it says."""
    with pytest.raises(SystemExit) as stopped:
        cli.main(command.split())
    assert stopped.value.code == 2
    said = capsys.readouterr()
    assert said.out == ""
    return said.err


def raising(error):
    def verb(args):
        raise error

    return verb


def test_check_takes_a_feeder_and_a_picture():
    args = parse("check paper --plot feeder.svg --json")
    assert (args.feeder, args.plot, args.json) == ("paper", Path("feeder.svg"), True)
    assert parse("check paper").plot is None
    assert parse("check paper --plot").plot == Path()


def test_solve_closes_as_many_switches_as_asked():
    args = parse("solve paper --open R2-R3:0.6:a --close R4 --close R9 --settings sheet.csv")
    assert args.open == "R2-R3:0.6:a"
    assert args.close == ["R4", "R9"]
    assert args.settings == Path("sheet.csv")


def test_switches_do_not_leak_into_the_next_command():
    parse("solve paper --open R2-R3:0.6:a --close R4")
    assert parse("solve paper --open R2-R3:0.6:a").close == []


def test_size_takes_all_its_options():
    args = parse("size f.toml --study s.toml --scenarios 900 --seed 0 --jobs 4 --out o --yes")
    assert (args.feeder, args.study, args.out) == ("f.toml", Path("s.toml"), Path("o"))
    assert (args.scenarios, args.seed, args.jobs) == (900, 0, 4)
    assert args.yes


def test_size_leaves_to_the_study_what_was_not_said():
    args = parse("size paper")
    assert (args.study, args.scenarios, args.seed, args.out) == (None, None, None, None)
    assert args.jobs == 2
    assert not args.yes
    assert not args.json


@pytest.mark.parametrize(
    ("command", "complaint"),
    [
        ("", "VERB"),
        ("weigh paper", "invalid choice: 'weigh'"),
        ("check", "FEEDER"),
        ("solve paper", "--open"),
        ("size paper --scenarios 0", "must be a whole number >= 1, got '0'"),
        ("size paper --jobs -1", "must be a whole number >= 1, got '-1'"),
        ("size paper --seed 1.5", "must be a whole number >= 0, got '1.5'"),
        ("size paper --scen 5", "unrecognized arguments: --scen"),
    ],
)
def test_a_wrong_command_line_exits_with_2_and_says_why(command, complaint, capsys):
    assert complaint in refuse(command, capsys)


@pytest.mark.parametrize("verb", ALL_VERBS)
def test_every_verb_explains_itself_and_stands_in_the_readme(verb, capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main([verb, "--help"])
    assert stopped.value.code == 0
    assert capsys.readouterr().out.startswith(f"usage: openphase {verb} ")
    assert f"`{verb} " in (ROOT / "README.md").read_text(encoding="utf-8")


def test_version(capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main(["--version"])
    assert stopped.value.code == 0
    assert capsys.readouterr().out == f"openphase {__version__}\n"


@pytest.mark.parametrize("code", [0, 3])
def test_a_verb_s_code_is_the_exit_code(code, monkeypatch):
    monkeypatch.setattr(cli, "_check", lambda args: code)
    assert cli.main(["check", "paper"]) == code


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (
            InputError.single("feeder.toml", "lines 'R2-R3': length_km", "-5.0", "must be > 0"),
            2,
        ),
        (OpenPhaseError("runs/paper: the disk is full"), 1),
    ],
)
def test_an_error_is_a_message_and_a_code(error, code, monkeypatch, capsys):
    monkeypatch.setattr(cli, "_check", raising(error))
    assert cli.main(["check", "feeder.toml"]) == code
    assert capsys.readouterr() == ("", f"{error}\n")


def test_a_bug_is_not_dressed_up_as_an_answer(monkeypatch):
    monkeypatch.setattr(cli, "_check", raising(ZeroDivisionError("bug")))
    with pytest.raises(ZeroDivisionError, match="bug"):
        cli.main(["check", "feeder.toml"])


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("size paper", "interrupted; the same command resumes\n"),
        ("check paper", "interrupted\n"),
    ],
)
def test_an_interruption_says_whether_the_command_resumes(command, message, monkeypatch, capsys):
    monkeypatch.setattr(cli, f"_{command.split()[0]}", raising(KeyboardInterrupt()))
    assert cli.main(command.split()) == 130
    assert capsys.readouterr() == ("", message)


def test_blas_gets_one_thread_unless_the_user_says_otherwise(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    for library in ("OPENBLAS", "MKL"):
        monkeypatch.setenv(f"{library}_NUM_THREADS", "")  # so that monkeypatch restores it
        monkeypatch.delenv(f"{library}_NUM_THREADS")
    monkeypatch.setattr(cli, "_check", lambda args: 0)
    cli.main(["check", "paper"])
    threads = [os.environ[f"{name}_NUM_THREADS"] for name in ("OMP", "OPENBLAS", "MKL")]
    assert threads == ["7", "1", "1"]


def test_nothing_heavy_is_loaded_before_a_verb_is_chosen():
    script = "import sys, openphase.studies.cli as c; c.build_parser(); print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    ).stdout.split()
    assert "openphase.studies.cli" in loaded
    assert not {"numpy", "numba", "pandas", "openphase.model"} & set(loaded)


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_reader_that_leaves_is_met_with_silence(unbuffered):
    """The pipe's reading end is closed before anything is written."""
    reading, writing = os.pipe()
    os.close(reading)
    script = (
        "import sys; from openphase.studies import cli; cli._check = lambda args: print(args) or 0;"
        "sys.exit(cli.main(['check', 'paper']))"
    )
    environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    ended = subprocess.run(
        [sys.executable, "-c", script],
        stdout=writing,
        stderr=subprocess.PIPE,
        env=environment,
        check=False,
    )
    os.close(writing)
    assert (ended.returncode, ended.stderr) == (cli.FAILED, b"")
