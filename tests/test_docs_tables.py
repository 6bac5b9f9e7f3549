"""The tables of the documents say what the code has: keys, classes, options, reasons, windows."""

from __future__ import annotations

import contextlib
import io
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import pytest

from openphase.detector.criteria import Options, Reason
from openphase.detector.instruments import Wiring
from openphase.model import load_feeder
from openphase.studies import assessing, cli, sizing
from openphase.studies.run.cases import make_case, make_cases
from openphase.studies.run.classes import REPORTED
from openphase.studies.run.status import window_of
from openphase.studies.spec.events import WIRING_KINDS
from openphase.studies.spec.study_file import study_from_toml

ROOT = Path(__file__).parents[1]
RESULTS, DETECTOR = (ROOT / "docs" / name for name in ("results.md", "detector.md"))

#: few classes, some of them missed and some of them false: small runs that still have every key
STUDY = """\
format = 1
[events]
without = [
    "open_three", "capacitor_step", "motor_start", "earth_fault", "line_fault", "energisation",
    "reclosing", "single_pole", "fallen_source_side", "open_with_load_step",
    "load_swap", "step_with_tap",
]
[detector]
fallback = false
"""

WORDS = {"must": "must_trip", "not": "must_not_trip", "apart": "apart"}


def section(page: Path, heading: str) -> str:
    """The text between a heading and the next of any level."""
    text = page.read_text(encoding="utf-8")
    begin = re.search(rf"^#+ {re.escape(heading)}\n", text, flags=re.MULTILINE)
    assert begin, f"{page.name} has no heading {heading!r}"
    return re.split(r"^#+ ", text[begin.end() :], maxsplit=1, flags=re.MULTILINE)[0]


def rows(page: Path, heading: str) -> list[list[str]]:
    """The cells of the first table below a heading, without its head."""
    lines = section(page, heading).splitlines()
    begin = next(n for n, line in enumerate(lines) if line.startswith("|"))
    table = []
    for line in lines[begin + 2 :]:
        if not line.startswith("|"):
            break
        table.append([cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]])
    return table


def names(page: Path, heading: str) -> list[str]:
    """What stands in backquotes in the first column."""
    return [row[0].strip("`") for row in rows(page, heading)]


def test_a_table_is_read_cell_by_cell(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# A\n\n| x | y |\n|---|---|\n| `a` | \\|b\\| |\n\n## B\n", encoding="utf-8")
    assert rows(page, "A") == [["`a`", "\\|b\\|"]]
    assert names(page, "A") == ["a"]


# ---- keys ----


@dataclass(frozen=True)
class Answers:
    """What the verbs print, and the folder that ``size`` left."""

    said: dict[str, Any]
    folder: Path


def ask(*words: object) -> Any:
    """The JSON that a command answers."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        assert cli.main([*map(str, words), "--json"]) in (0, 3)
    return json.loads(out.getvalue())


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Answers:
    home = tmp_path_factory.mktemp("home")
    (home / "study.toml").write_text(STUDY, encoding="utf-8")
    drawn = ("--study", home / "study.toml", "--scenarios", 50, "--jobs", 1, "--out")
    with pytest.MonkeyPatch.context() as patch:
        for verb in (sizing, assessing):
            patch.setattr(verb, "write_report", lambda *_: None)
        said = {
            "size": ask("size", "paper", *drawn, home / "a"),
            "reference": ask("assess", "paper", "--settings", "reference", *drawn, home / "b"),
            "assess": ask(
                "assess", "paper", "--settings", home / "a/settings.csv", *drawn, home / "c"
            ),
        }
        said["compare"] = ask("compare", home / "a", home / "b")
        said["other way"] = ask("compare", home / "b", home / "a")
    said["solve"] = ask("solve", "paper", "--open", "R2-R3:0.6:a")
    said["check"] = ask("check", "paper")
    said["paper"] = ask("paper")
    return Answers(said=said, folder=home / "a")


def objects(value: Any, path: str) -> Iterator[dict[str, Any]]:
    """Every object at a path of keys, through the lists on the way; ``*`` is any key."""
    if isinstance(value, list):
        for item in value:
            yield from objects(item, path)
    elif isinstance(value, dict):
        key, _, rest = path.partition(".")
        if not path:
            yield value
        for own in value.values() if key == "*" else [value.get(key)]:
            if path:
                yield from objects(own, rest)


RUNS, COMPARED = ("size", "reference", "assess"), ("compare", "other way")

#: heading, the verbs whose answers it is about, and the path to the objects in them
DOCUMENTED = [
    ("`size` and `assess`", RUNS, ""),
    ("`assessed`", RUNS, "assessed"),
    ("`assessed.run_beside`", RUNS, "assessed.run_beside"),
    ("`sections`", RUNS, "sections"),
    ("`sections.classes`", RUNS, "sections.classes"),
    ("`sections.classes.by_ohm`", RUNS, "sections.classes.by_ohm"),
    ("`sections.causes`", RUNS, "sections.causes"),
    ("`sections.nearest_false_trip`", RUNS, "sections.nearest_false_trip"),
    ("`compared`", RUNS, "compared"),
    ("`feeder_false_trips`", RUNS, "feeder_false_trips"),
    ("`numerics`", RUNS, "numerics"),
    ("`numerics.by_class`", RUNS, "numerics.by_class"),
    ("`compare`", COMPARED, ""),
    ("`runs`", COMPARED, "runs"),
    ("`comparisons`", COMPARED, "comparisons"),
    ("`comparisons.sections`", COMPARED, "comparisons.sections"),
    ("`comparisons.sections.a`", COMPARED, "comparisons.sections.a"),
    ("`comparisons.sections.a`", COMPARED, "comparisons.sections.b"),
    ("`comparisons.sections.false_trips`", COMPARED, "comparisons.sections.false_trips"),
    ("`comparisons.sections.classes`", COMPARED, "comparisons.sections.classes"),
    ("`comparisons.sections.gained`", COMPARED, "comparisons.sections.gained"),
    ("`comparisons.sections.gained`", COMPARED, "comparisons.sections.lost"),
    ("`solve`", ("solve",), ""),
    ("`solve`: a bus", ("solve",), "buses.*"),
    ("`solve`: a line", ("solve",), "lines.*"),
    ("`solve`: `sections`", ("solve",), "sections"),
    ("`check`", ("check",), ""),
    ("`check`: `sections`", ("check",), "sections"),
    ("`check`: `values`", ("check",), "values"),
    ("`paper`", ("paper",), ""),
    ("`paper`: `figures`", ("paper",), "figures"),
    ("`paper`: `rows`", ("paper",), "figures.rows"),
]


@pytest.mark.parametrize(("heading", "verbs", "path"), DOCUMENTED)
def test_every_key_of_the_answers_is_documented(
    answers: Answers, heading: str, verbs: tuple[str, ...], path: str
) -> None:
    found = [own for verb in verbs for own in objects(answers.said[verb], path)]
    assert found, "no answer has such an object: the sample no longer shows it"
    assert sorted({key for own in found for key in own}) == sorted(names(RESULTS, heading))
    never_null = [row[0].strip("`") for row in rows(RESULTS, heading) if row[1] == "–"]
    assert [key for key in never_null if any(own.get(key, 0) is None for own in found)] == []


def test_no_object_of_an_answer_is_left_out(answers: Answers) -> None:
    def paths(value: Any, path: str) -> Iterator[str]:
        if isinstance(value, list):
            for item in value:
                yield from paths(item, path)
        elif isinstance(value, dict):
            yield path
            for key, item in value.items():
                yield from paths(item, f"{path}.{key}".strip("."))

    for verbs in (RUNS, COMPARED, ("check",)):
        known = {path for _, own, path in DOCUMENTED if own == verbs}
        for verb in verbs:
            assert set(paths(answers.said[verb], "")) <= known


def test_every_file_of_a_run_folder_is_documented(answers: Answers) -> None:
    listed = set(
        re.findall(r"`([\w./*]+)`", " ".join(r[0] for r in rows(RESULTS, "The run folder")))
    )
    there = {f"{p.name}/" if p.is_dir() else p.name for p in answers.folder.iterdir()}
    assert there <= listed
    assert listed - there == {"report.html", "*.png"}, "the run was made without its report"


# ---- classes, options, reasons ----


def test_the_table_of_classes_is_the_code_s() -> None:
    sides = ("inside", "upstream", "downstream", "other", "network")
    written = {
        (name.strip("`"), side): WORDS[cell]
        for name, *cells in rows(RESULTS, "Classes and sides")
        for side, cell in zip(sides, cells, strict=True)
        if cell
    }
    assert written == {(own.name, own.side): own.kind for own in REPORTED}


def test_every_option_of_the_detector_has_a_row() -> None:
    assert names(DETECTOR, "Options") == [field.name for field in fields(Options)]


def test_every_reason_has_a_row_in_the_order_of_its_code() -> None:
    assert set(names(DETECTOR, "Reasons")) == {reason.name.lower() for reason in Reason}


def test_every_wiring_fault_has_a_row() -> None:
    first = " ".join(row[0] for row in rows(DETECTOR, "Supervision of the wiring"))
    assert set(re.findall(r"`(\w+)`", first)) == set(WIRING_KINDS)
    assert len(Wiring) == 1 + sum(len(kinds) for kinds in WIRING_KINDS.values())


def test_the_exit_codes_are_those_of_help(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        cli.main(["--help"])
    helped = re.findall(r"^  (\d)  ", capsys.readouterr().out, flags=re.MULTILINE)
    assert [row[0] for row in rows(RESULTS, "Exit codes")] == helped


def test_the_terminals_of_each_group_of_the_example_are_the_code_s() -> None:
    example = section(RESULTS, "Setting groups").partition("```toml\n")[2].partition("```")[0]
    cases = make_cases(load_feeder("paper"), study_from_toml(example, "study.toml"))
    found = [
        [case.group.name, ", ".join(t.name for t in case.points.terminals if not t.load_side)]
        for case in cases
    ]
    assert rows(RESULTS, "Setting groups") == found


def test_the_windows_of_the_paper_s_loop_are_the_code_s() -> None:
    study = study_from_toml('format = 1\n[network]\nclosed = ["R4"]\n', "study.toml")
    case = make_case(load_feeder("paper"), study)
    found = []
    for t, terminal in enumerate(case.points.terminals[::2]):
        window = window_of(case, 2 * t)
        assert window is not None
        span = f"{window.low_ohm:.2f} .. {window.high_ohm:.2f}"
        length = f"{abs(terminal.line_z1_ohm):.2f}"
        empty = "empty: `none`" if window.empty else ""
        found.append([f"{terminal.local}–{terminal.remote}", length, span, empty])
    assert rows(RESULTS, "Closed loops") == found
