"""The report's page: complete, reproducible, and the worst first."""

import copy
import re
import subprocess
import sys
from html import escape

import pytest

from openphase.studies.run.store import RunFolder
from openphase.studies.show import views
from openphase.studies.show.by_class import worst_first
from openphase.studies.show.report import STATUS, report_html, write_report
from openphase.studies.show.sheet import class_words
from openphase.studies.spec.study_file import dump_study


@pytest.fixture(scope="module")
def files(sizing, tmp_path_factory):
    """The report of the sizing, written once more: the files' bytes."""
    return write(sizing, tmp_path_factory.mktemp("again") / "run")


@pytest.fixture(scope="module")
def page(files):
    return files["report.html"].decode()


@pytest.fixture(params=["sizing", "grouped", "assessed"])
def finished(request):
    """Each of the shared runs."""
    return request.getfixturevalue(request.param)


def judged(sizing):
    return [t for t, row in enumerate(sizing.result["sections"]) if row["classes"]]


def write(run, path, result=None):
    """Write the report of a run, or of another result of it; return the files' bytes."""
    path.mkdir()
    result = run.result if result is None else result
    trainings = getattr(run, "trainings", None)
    fronts = [own.front for own in trainings] if trainings else None
    write_report(result, run.cases, fronts, run.validations, RunFolder(path))
    return {file.name: file.read_bytes() for file in path.iterdir()}


class Blank(dict):
    """Pictures without content, by any name."""

    def __missing__(self, name):
        return b""


def page_of(run, result=None):
    """The page alone, its pictures left blank."""
    return report_html(run.result if result is None else result, run.cases[0].study, Blank())


# ---- the page ----


def test_equal_sizings_give_equal_bytes_whatever_the_users_matplotlibrc(sizing, files, tmp_path):
    import matplotlib as mpl

    with mpl.rc_context({"font.size": 17.0, "lines.linewidth": 6.0, "savefig.dpi": 40}):
        assert write(sizing, tmp_path / "again") == files


def test_every_judged_terminal_has_its_pictures_as_files_and_in_the_page(sizing, files, page):
    wanted = {"report.html", "feeder.png", "overview.png"}
    for t in judged(sizing):
        row = sizing.result["sections"][t]
        stem = f"{t + 1:02d}-{row['local']}-{row['remote']}"
        wanted |= {f"{stem}-evidence.png", f"{stem}-along-line.png"}
        assert f"Terminal {row['local']}→{row['remote']}" in page
    assert set(files) == wanted
    assert page.count("data:image/png;base64,") == len(wanted) - 1


def test_the_page_stands_alone(page):
    assert "<script" not in page
    sources = re.findall(r"(?:src|href)\s*=\s*\"([^\"]{0,20})", page)
    assert {source.partition(";")[0] for source in sources} == {"data:image/png"}
    assert "url(" not in page
    assert "@import" not in page


def test_every_count_stands_in_the_page_as_k_of_n(finished):
    page = page_of(finished)
    for t in judged(finished):
        row = finished.result["sections"][t]
        if row["i_set_a"] is None:
            continue
        assert f"{row['false_trips']:,} of {row['security_trials']:,}" in page
        assert f"{row['unreachable']:,} of {row['opens']:,}" in page
        assert f"{row['false_trip_upper']:.1e}" in page
        for own in row["classes"]:
            assert f"{own['trips']:,} of {own['trials']:,}" in page
    for row in finished.result["compared"]:
        if row["i_set_a"] is not None:
            assert f"{row['false_trips']:,} of {row['trials']:,}" in page
            assert f"{row['detected']:,} of {row['opens'] - row['unreachable']:,}" in page
    assert "None" not in page
    assert "nan" not in page


def test_settings_are_printed_as_the_device_holds_them(sizing):
    result = copy.deepcopy(sizing.result)
    fine = {"i_set_a": 0.15, "i_set_pu": 0.0015, "v_set_pu": 0.0025, "z_set_ohm": 100.25}
    rows = [result["sections"][t] for t in judged(sizing)] + result["compared"]
    for row in rows:
        row |= fine
    page = page_of(sizing, result)
    cells = '<td class="n">0.15</td><td class="n">0.25</td><td class="n">100.25</td>'
    assert page.count(cells) == len(rows)
    assert "I_set 0.15 A (0.0015 pu), V_set 0.25 %, Z_set 100.25 Ω" in page


def test_the_overview_shows_shares_of_the_reachable_breaks(sizing):
    view = views.overview_view(sizing.result)
    rows = {f"{r['local']}→{r['remote']}": r for r in sizing.result["sections"] if r["classes"]}
    assert set(view.terminals) == set(rows)
    assert any(row["unreachable"] for row in rows.values())
    for name, bars in zip(view.terminals, view.bars, strict=True):
        assert bars[0].share == rows[name]["dependability"]


@pytest.mark.parametrize("status", STATUS)
def test_every_status_is_printed_and_explained(sizing, status):
    result = copy.deepcopy(sizing.result)
    result["sections"] = result["sections"][:1]
    result["sections"][0] |= {"status": status, "reason": f"because of {status}", "classes": []}
    result["sections"][0]["i_set_a"] = None
    page = page_of(sizing, result)
    assert f'<td class="w">{status}</td>' in page
    assert f"because of {status}" in page
    assert len(re.findall(rf"<dt>{status}</dt><dd>.*\(here: 1\)", page)) == 1


def test_a_terminal_without_a_setting_is_still_drawn(sizing, tmp_path):
    result = copy.deepcopy(sizing.result)
    t = judged(sizing)[0]
    row = result["sections"][t]
    settings = ("i_set_a", "i_set_pu", "v_set_pu", "z_set_ohm", "margin", "nearest_false_trip")
    found = [key for key in row if key.startswith(("detected", "dependability", "false_trip"))]
    row |= dict.fromkeys([*settings, *found]) | {"status": "none", "causes": []}
    row["classes"] = [own | {"trips": None, "upper": None} for own in row["classes"]]
    empty = ("detected", "dependability_low", "dependability_high", "false_trips", "upper")
    result["compared"][0] |= dict.fromkeys([*empty, "i_set_a", "v_set_pu", "z_set_ohm"])
    result["compared"][0]["reason"] = "the device has no V_set of <5 %"
    written = write(sizing, tmp_path / "run", result)
    page = written["report.html"].decode()
    profiles = [name for name in written if name.endswith("along-line.png")]
    assert len(profiles) == len(judged(sizing)) - 1  # where nothing is set, nothing is found
    assert "No setting. Line between" in page
    assert '<td colspan="7">the device has no V_set of &lt;5 %</td>' in page
    assert "None" not in page


def test_names_are_escaped_and_are_no_formulas(sizing, tmp_path):
    result = copy.deepcopy(sizing.result)
    result["feeder"] = "<b>R&D</b>"
    for row in [*result["sections"], *result["compared"]]:
        row["local"] = f"$\\x_{row['local']}/../<i>"
    files = write(sizing, tmp_path / "run", result)
    page = files["report.html"].decode()
    assert "&lt;b&gt;R&amp;D&lt;/b&gt;" in page
    assert "<b>R&D" not in page
    assert "<i>" not in page
    assert all(re.fullmatch(r"[\w.-]+", name) for name in files)


def test_an_interval_is_rounded_outwards(sizing):
    result = copy.deepcopy(sizing.result)
    row = result["compared"][0]
    row |= {"dependability_low": 0.99996, "dependability_high": 0.999999}
    result["sections"] = []
    page = page_of(sizing, result)
    assert "99.9 .. 100.0 %" in page


def test_matplotlib_waits_until_a_report_is_written():
    code = "import sys, openphase.studies.sizing; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# ---- setting groups, closed loops, assessments ----


def test_every_group_has_its_part_of_the_sheet_and_its_terminals(grouped):
    page = page_of(grouped)
    sheet = page[page.index("Settings sheet") : page.index("What the status words mean")]
    places = [sheet.index(f"Setting group {case.group.name}") for case in grouped.cases]
    assert places == sorted(places)
    for t in judged(grouped):
        row = grouped.result["sections"][t]
        name = f"{row['local']}→{row['remote']} {row['setting_group']}"
        assert page.count(f"<h2>Terminal {name}: {row['status']}</h2>") == 1


def test_pictures_of_different_groups_have_different_names(grouped, tmp_path):
    names = [name for name in write(grouped, tmp_path / "run") if name.endswith("evidence.png")]
    assert len(names) == len(judged(grouped))
    assert {name.rpartition("-evidence")[0].partition("R4b-")[2] for name in names} >= {
        "normal",
        "tie-closed",
        "fed-backwards",
    }


def test_a_closed_loop_without_settings_says_why_and_is_named_above(grouped):
    rows = [row for row in grouped.result["sections"] if row["setting_group"] == "tie closed"]
    refused = [row for row in rows if {row["local"], row["remote"]} == {"R5", "R4b"}]
    assert [row["status"] for row in refused] == ["none", "none"]
    page = page_of(grouped)
    for row in refused:
        assert "closed loop" in row["reason"]
        assert escape(row["reason"]) in page
    above = page[: page.index("Settings sheet")]
    without = re.search(r"Sections without settings at either end: ([^<]*)\.<", above)
    assert without is not None
    assert "R5→R4b tie closed" in without[1].split(", ")


def test_an_assessment_has_no_margin_and_no_training(assessed):
    page = page_of(assessed)
    assert "Assessment of open-phase settings" in page
    assert "margin" not in page[page.index("<body>") : page.index("<h2>Assumptions")]
    assert "in training" not in page
    assert "Settings side by side" not in page


# ---- the worst first ----


def false_trip_rates(result):
    """Per class and side in words, the highest rate of false trips at any terminal."""
    found = {}
    for row in result["sections"]:
        for own in row["classes"]:
            if own["kind"] == "must_not_trip" and own["trips"]:
                words = class_words(own)
                found[words] = max(found.get(words, 0.0), own["trips"] / own["trials"])
    return found


def test_classes_with_false_trips_stand_in_a_table_the_worst_first(assessed):
    page = page_of(assessed)
    part = page[page.index("By class of events") : page.index("Missed breaks</b>, of those")]
    rates = false_trip_rates(assessed.result)
    words = re.findall(r'<th class="c">([^<]*)</th>', part)
    assert set(words) == set(rates)
    assert len(words) > 5
    assert [rates[own] for own in words] == sorted(rates.values(), reverse=True)
    clean = {
        class_words(own)
        for row in assessed.result["sections"]
        for own in row["classes"]
        if own["kind"] == "must_not_trip"
    } - set(rates)
    assert f"The other {len(clean)} classes and sides have none." in part


def test_no_false_trip_takes_a_line_and_not_a_table(sizing):
    page = page_of(sizing)
    assert not false_trip_rates(sizing.result)
    assert re.search(r"<b>False trips:</b> none, in any of \d+ classes and sides", page)


def test_a_terminal_shows_what_trips_and_folds_the_rest(finished):
    for row, part in terminal_parts(finished):
        shown, _, folded = part.partition("<details>")
        names = re.findall(r"<tr><td>([^<]*)</td>", shown)
        bad = [own for own in row["classes"] if own["kind"] == "must_not_trip" and own["trips"]]
        clean = [
            own for own in row["classes"] if own["kind"] == "must_not_trip" and not own["trips"]
        ]
        wanted = ["breaks inside", *(class_words(own) for own in worst_first(bad))]
        every = "the other" if bad else "all"
        assert names == [*wanted, f"{every} {len(clean)} classes and sides together"]
        assert f"{sum(own['trials'] for own in clean):,}</td>" in shown
        every_class = folded[: folded.index("</details>")]
        for own in row["classes"]:
            assert f"<td>{class_words(own)}" in every_class


def terminal_parts(run):
    """The judged rows of a result, each with its part of the page."""
    parts = page_of(run).split('<section class="terminal">')[1:]
    return zip((run.result["sections"][t] for t in judged(run)), parts, strict=True)


def test_classes_are_ordered_by_rate_then_by_bound_the_told_apart_last(assessed):
    for t in judged(assessed):
        ordered = worst_first(assessed.result["sections"][t]["classes"])
        kinds = [own["kind"] for own in ordered]
        assert kinds == sorted(kinds, key=("must_trip", "must_not_trip", "apart").index)
        own = [x for x in ordered if x["kind"] == "must_not_trip"]
        keys = [(x["trips"] / x["trials"], x["upper"]) for x in own]
        assert keys == sorted(keys, reverse=True)


# ---- what it rests on ----


def test_every_value_of_the_study_stands_in_full(grouped):
    study = grouped.cases[0].study
    page = page_of(grouped)
    lines = escape(dump_study(study)).splitlines()
    left_out = [f"[events.{name}]" for name in study.events.without]
    table = ""
    for line in filter(None, lines[1:]):
        table = line if line.startswith("[") else table
        if table not in left_out and line != table:
            assert line in page
            assert table in page
