"""What the documents promise: examples that run together, links that lead somewhere, targets."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from openphase.model import read_feeder
from openphase.studies.cli import VERBS, build_parser, main
from openphase.studies.spec.study_file import check_study, read_study

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
FRONT = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
PAGES = [*FRONT, *sorted(DOCS.glob("*.md")), *sorted((DOCS / "decisions").glob("*.md"))]


def prose(text: str) -> str:
    """Return a page without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)


def broken_links(page: Path) -> list[str]:
    """Return the relative links of a page that lead to nothing."""
    links = re.findall(r"\]\(([^)\s]+)\)", prose(page.read_text(encoding="utf-8")))
    files = [link.partition("#")[0] for link in links if not re.match(r"[a-z]+:", link)]
    return [file for file in files if file and not (page.parent / file).exists()]


def anchors(page: Path) -> set[str]:
    """What a link may name behind ``#``: the headings, as GitHub writes them."""
    heads = re.findall(r"^#+ (.+)$", prose(page.read_text(encoding="utf-8")), flags=re.MULTILINE)
    return {re.sub(r"[^\w -]", "", head.lower()).replace(" ", "-") for head in heads}


def broken_anchors(page: Path) -> list[str]:
    """Return the links of a page to headings that are not there."""
    links = re.findall(r"\]\(([^)\s#:]*)#([^)\s]+)\)", prose(page.read_text(encoding="utf-8")))
    return [
        f"{file}#{name}"
        for file, name in links
        if name not in anchors(page.parent / file if file else page)
    ]


def named_targets(text: str) -> set[str]:
    """Return the targets in the page's ``make TARGET`` commands, in backquotes or indented."""
    inline = re.findall(r"`([^`\n]+)`", text)
    indented = re.findall(r"^ {4}(\S.*)$", text, flags=re.MULTILINE)
    commands = [command for line in inline + indented for command in line.split("&&")]
    found = [re.match(r"\s*make ([\w./-]+)", command) for command in commands]
    return {match[1] for match in found if match}


def made_targets() -> set[str]:
    """Return what the Makefile can make, written out."""
    text = (ROOT / "Makefile").read_text(encoding="utf-8").replace("$(VENV)", ".venv")
    return set(re.findall(r"^([\w./-]+):(?!=)", text, flags=re.MULTILINE))


def test_the_examples_of_feeder_and_study_go_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = {"example.toml": "feeder-file.md", "study.toml": "study-file.md"}
    for name, page in files.items():
        text = (DOCS / page).read_text(encoding="utf-8")
        assert f"`{name}`" in text
        example = text.partition("```toml\n")[2].partition("```")[0]
        (tmp_path / name).write_text(example, encoding="utf-8")
    feeder, study = read_feeder(tmp_path / "example.toml"), read_study(tmp_path / "study.toml")
    check_study(study, feeder, "study.toml")
    assert study.transformers.yg_d
    assert study.network.closed
    assert main(["check", str(tmp_path / "example.toml")]) == 0
    printed = capsys.readouterr().out
    for section in feeder.sections:
        assert section.local in printed
        assert section.remote in printed


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_relative_links_lead_to_files(page: Path) -> None:
    assert broken_links(page) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_into_pages_lead_to_headings(page: Path) -> None:
    assert broken_anchors(page) == []


def test_a_link_to_no_heading_is_seen(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# `[[a]]` b\n[x](#a-b) [y](page.md#a-b) [z](#c)\n", encoding="utf-8")
    assert broken_anchors(page) == ["#c"]


def test_a_link_to_nothing_is_seen(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "[a](page.md#top) [b](#top) [c](https://host/x) [d](gone.md)\n```toml\n[x](y)\n```\n",
        encoding="utf-8",
    )
    assert broken_links(page) == ["gone.md"]


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda page: page.name)
def test_the_readme_links_every_document(page: Path) -> None:
    assert f"(docs/{page.name})" in (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md"])
def test_the_makefile_has_every_target_that_is_named(page: str) -> None:
    named = named_targets((ROOT / page).read_text(encoding="utf-8"))
    assert "demo" in named
    assert named - made_targets() == set()


def test_targets_are_seen_where_they_are_named() -> None:
    text = "    make a   # so\n\n`make b && x`, `make .venv/c` and `x && make d`; make sure\n"
    assert named_targets(text) == {"a", "b", ".venv/c", "d"}
    assert {"demo", ".venv/installed"} <= made_targets()
    assert "VENV" not in made_targets()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_files_named_in_backquotes_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    named = re.findall(
        r"`((?:docs|tests|model|detector|optimise|studies|benchmarks)/[\w./-]+)`", text
    )
    assert [name for name in named if "NNNN" not in name and not (ROOT / name).exists()] == []


# ---- commands ----

#: what stands for something in a command, and something that it may stand for
PLACEHOLDERS = {"N": "1", "S": "1", "J": "1"}


def named_commands(text: str) -> list[str]:
    """The ``openphase VERB …`` of a page, in backquotes or on indented or fenced lines."""
    inline = re.findall(r"`(?:\.venv/bin/)?(openphase [a-z][^`]*)`", text)
    lines = re.findall(r"^ *(?:\.venv/bin/)?(openphase [a-z].*)$", text, flags=re.MULTILINE)
    indented = [line for line in lines if "`" not in line]
    return [" ".join(command.partition("#")[0].split()) for command in inline + indented]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_command_can_be_typed(page: Path) -> None:
    parser = build_parser()
    for command in named_commands(page.read_text(encoding="utf-8")):
        words = [PLACEHOLDERS.get(word, word) for word in command.split()[1:]]
        if len(words) > 1:  # a verb alone is spoken of, not typed
            assert parser.parse_args(words).verb == words[0], command


def test_commands_are_seen_where_they_stand() -> None:
    text = (
        "`openphase size x` and `.venv/bin/openphase check y`\n\n    openphase paper --json # so\n"
    )
    assert named_commands(text) == [
        "openphase size x",
        "openphase check y",
        "openphase paper --json",
    ]
    assert named_commands((DOCS / "results.md").read_text(encoding="utf-8"))


def test_the_readme_has_a_row_for_every_verb() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    told = re.findall(r"^\| `([a-z]+)[^|]*\|", text, flags=re.MULTILINE)
    assert told == [verb for group in VERBS.values() for verb in group]


def test_no_verb_that_exists_is_called_planned() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (planned,) = re.findall(r"^Planned, not there yet: (.*)$", text, flags=re.MULTILINE)
    there = {verb for group in VERBS.values() for verb in group}
    assert there.isdisjoint(re.findall(r"`(\w+)`", planned))


def test_decisions_are_numbered_without_gaps() -> None:
    pages = sorted((DOCS / "decisions").glob("*.md"))
    assert [page.name[:4] for page in pages] == [f"{n:04}" for n in range(1, len(pages) + 1)]
    for page in pages:
        assert page.read_text(encoding="utf-8").startswith(f"# {page.name[:4]}: ")
