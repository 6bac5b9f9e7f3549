"""The report and its pictures: complete, reproducible, and true to what they are given."""

import copy
import dataclasses
import re
import subprocess
import sys

import numpy as np
import pytest

from openphase.model.reading.feeder_file import feeder_from_toml, load_feeder
from openphase.optimise.staircase import border, front_of
from openphase.studies.run.session import Demand
from openphase.studies.run.store import RunFolder
from openphase.studies.show import feeder_plot, figures, plots, views
from openphase.studies.show.feeder_layout import lay_out
from openphase.studies.show.report import STATUS, report_html, write_report
from openphase.studies.sizing import size_feeder
from openphase.studies.spec.study_file import default_study

FORKED = """
format = 1
name = "forked"
[source]
bus = "A"
kv_ll = 12.0
z1_ohm = { mag = 0.9, deg = 85.0 }
[[lines]]
name = "A-B"
from = "B" # drawn against its direction
to = "A"
length_km = 2.0
z1_ohm_per_km = { mag = 0.13, deg = 70.0 }
z0_ohm_per_km = { mag = 0.39, deg = 75.0 }
[[lines]]
name = "B-short"
from = "B"
to = "S"
length_km = 1.0
z1_ohm_per_km = { mag = 0.13, deg = 70.0 }
z0_ohm_per_km = { mag = 0.39, deg = 75.0 }
[[lines]]
name = "C-D"
from = "C"
to = "D"
length_km = 4.0
z1_ohm_per_km = { mag = 0.13, deg = 70.0 }
z0_ohm_per_km = { mag = 0.39, deg = 75.0 }
[[switches]]
name = "B-C"
from = "B"
to = "C"
closed = true
[[loads]]
name = "direct"
line = "A-B"
at = 0.25
connection = "wye"
kw = 50.0
[[points]]
name = "P"
bus = "A"
line = "A-B"
[[points]]
name = "Q"
bus = "C"
line = "C-D"
[[points]]
name = "R"
bus = "S"
line = "B-short"
[[sections]]
local = "P"
remote = "Q"
[[sections]]
local = "P"
remote = "R"
"""


@pytest.fixture(scope="module")
def sizing(tmp_path_factory):
    demand = Demand(scenarios=300, jobs=1)
    out = tmp_path_factory.mktemp("runs") / "paper"
    return size_feeder(load_feeder("paper"), default_study("paper"), demand, out)


@pytest.fixture(scope="module")
def files(sizing, tmp_path_factory):
    """The report of the sizing, written once more: the files' bytes."""
    return write(sizing, tmp_path_factory.mktemp("again") / "run")


@pytest.fixture(scope="module")
def page(files):
    return files["report.html"].decode()


def judged(sizing):
    return [t for t, row in enumerate(sizing.result["sections"]) if row["classes"]]


def write(sizing, path, result=None):
    """Write the report of a sizing, or of another result of it; return the files' bytes."""
    path.mkdir()
    result = sizing.result if result is None else result
    fronts = [own.front for own in sizing.trainings]
    write_report(result, sizing.cases, fronts, sizing.validations, RunFolder(path))
    return {file.name: file.read_bytes() for file in path.iterdir()}


def all_views(sizing):
    """Each plot with its data, for everything that is drawn."""
    case, validation = sizing.cases[0], sizing.validations[0]
    for t in judged(sizing):
        row, front = sizing.result["sections"][t], sizing.trainings[0].front[t]
        yield plots.plot_evidence, views.evidence_view(case, t, row, front, validation)
        yield plots.plot_profile, views.profile_view(case, t, validation)
    yield plots.plot_overview, views.overview_view(sizing.result)
    yield feeder_plot.plot_feeder, case.feeder


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


def test_every_count_stands_in_the_page_as_k_of_n(sizing, page):
    for t in judged(sizing):
        row = sizing.result["sections"][t]
        assert f"{row['false_trips']:,} of {row['security_trials']:,}" in page
        assert f"{row['unreachable']:,} of {row['opens']:,}" in page
        assert f"{row['false_trip_upper']:.1e}" in page
        for own in row["classes"]:
            assert f"{own['trips']:,} of {own['trials']:,}" in page
    for row in sizing.result["compared"]:
        assert f"{row['false_trips']:,} of {row['trials']:,}" in page
        assert f"{row['detected']:,} of {row['opens'] - row['unreachable']:,}" in page


def test_settings_are_printed_as_the_device_holds_them(sizing):
    result = copy.deepcopy(sizing.result)
    fine = {"i_set_a": 0.15, "i_set_pu": 0.0015, "v_set_pu": 0.0025, "z_set_ohm": 100.25}
    rows = [result["sections"][t] for t in judged(sizing)] + result["compared"]
    for row in rows:
        row |= fine
    names = ["feeder.png", "overview.png"]
    for t in judged(sizing):
        stem = f"{t + 1:02d}-{result['sections'][t]['local']}-{result['sections'][t]['remote']}"
        names += [f"{stem}-evidence.png", f"{stem}-along-line.png"]
    page = report_html(result, sizing.cases[0].study, dict.fromkeys(names, b""))
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
    pictures = {"feeder.png": b"", "overview.png": b""}
    page = report_html(result, sizing.cases[0].study, pictures)
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
    page = write(sizing, tmp_path / "run", result)["report.html"].decode()
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
    page = report_html(result, sizing.cases[0].study, {"feeder.png": b"", "overview.png": b""})
    assert "99.9 .. 100.0 %" in page


def test_matplotlib_waits_until_a_report_is_written():
    code = "import sys, openphase.studies.sizing; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# ---- the pictures ----


def freeze(value):
    """Make every array of some data read-only, so that writing into it raises."""
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    elif isinstance(value, tuple):
        for item in value:
            freeze(item)
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            freeze(getattr(value, field.name))


def test_plots_do_not_write_into_what_they_draw(sizing):
    before = copy.deepcopy(sizing)
    freeze((sizing.trainings[0].front, sizing.validations))
    for plot, view in all_views(sizing):
        freeze(view)
        plot(view)
    assert sizing.result == before.result


def test_a_plot_draws_into_the_axes_it_is_given(sizing):
    from matplotlib.figure import Figure

    for plot, view in all_views(sizing):
        ax = Figure().add_subplot()
        assert plot(view, ax) is ax
        assert ax.get_title(loc="left")


def test_no_texts_lie_on_each_other(sizing):
    for plot, view in all_views(sizing):
        ax = plot(view)
        figure = ax.get_figure()
        figure.set_dpi(figures.DPI)
        with figures.house_style():
            figure.draw_without_rendering()
            legend = ax.get_legend()
            texts = [*ax.texts, ax.xaxis.label, ax.yaxis.label, ax._left_title]
            texts += [*ax.get_xticklabels(), *ax.get_yticklabels(), *legend.get_texts()]
            boxes = [(t.get_text(), t.get_window_extent()) for t in texts if t.get_text()]
        for n, (one, box) in enumerate(boxes):
            for other, another in boxes[:n]:
                assert not box.overlaps(another), (plot.__name__, one, other)


def test_the_drawn_staircase_is_the_border(sizing):
    t = judged(sizing)[0]
    view = next(v for plot, v in all_views(sizing) if plot is plots.plot_evidence)
    ax = plots.plot_evidence(view)
    drawn = [np.asarray(line.get_xydata()) for line in ax.lines]
    floor = np.array([view.limits_a[0], view.limits_ohm[0]])
    for own in (view.border, view.margin_border):
        wanted = np.maximum(np.column_stack(own), floor)
        assert any(np.array_equal(line, wanted) for line in drawn)
    assert np.array_equal(view.border[0], border(sizing.trainings[0].front[t], view.v_set_pu)[0])


@pytest.mark.parametrize("margin", [1.0, 1.25])
def test_the_border_parts_what_trips_from_what_does_not(margin):
    rng = np.random.default_rng(3)
    events = rng.integers(1, 9, (3, 40)).astype(float)
    events[2, ::7] = 0.0  # some trip at no setting
    i, v, z = events
    front = front_of(i, v, z, np.zeros((40, 3), np.int64))
    for v_set in (0.5, 1.0, 3.0, 8.0, 10.0):
        x, y = border(front, v_set, margin)
        assert (np.diff(x) >= 0).all()
        assert (np.diff(y) <= 0).all()
        for i_set in np.arange(0.5, 12.0, 0.5):
            for z_set in np.arange(0.5, 12.0, 0.5):
                trips = (
                    (i * margin >= i_set) & (v / margin <= v_set) & (z * margin >= z_set) & (z > 0)
                )
                assert ((i_set <= x) & (z_set <= y)).any() == trips.any()


def test_blind_ends_and_tees_stand_where_the_feeder_has_them(sizing):
    names = [terminal.name for terminal in sizing.cases[0].points.terminals]

    def profile(name):
        return views.profile_view(sizing.cases[0], names.index(name), sizing.validations[0])

    third, back = profile("R3→R4"), profile("R4b→R5")
    assert third.tees == ((2.5, "T5"), (4.5, "T6"))
    assert third.blind_km == ((4.5, 5.0),)
    assert back.tees == ((5.0, "T3"),)
    assert back.blind_km == ((0.0, 5.0),)
    assert profile("R2→R3").tees == ((1.25, "T2"), (4.5, "T4"))
    assert profile("R2→R3").blind_km == ()


def test_a_profile_adds_up_to_the_result(sizing):
    for t in judged(sizing):
        view = views.profile_view(sizing.cases[0], t, sizing.validations[0])
        row = sizing.result["sections"][t]
        assert view.breaks == row["opens"]
        assert row["detected"] <= view.found
        drawn = np.isfinite(view.share)
        assert (view.low <= view.share)[drawn].all()
        assert (view.share <= view.high)[drawn].all()


# ---- the feeder ----


def test_the_papers_feeder_is_laid_out_in_two_rows():
    layout = lay_out(load_feeder("paper"))
    assert (layout.rows, layout.reach_km) == (2, 13.0)
    assert {(p.text, p.row) for p in layout.points if p.text in ("R4", "R4b")} == {
        ("R4", 0),
        ("R4b", 1),
    }
    assert [tie.at_row_ends for tie in layout.ties] == [True]
    assert ("T4\nYg/D\n100 kW", 7.5, 0) in {(u.text, u.km, u.row) for u in layout.units}


def test_a_fork_gives_the_longest_way_the_row_and_sections_share_a_line():
    feeder = feeder_from_toml(FORKED, "forked.toml")
    layout = lay_out(feeder)
    wires = {wire.name: wire for wire in layout.wires}
    assert wires["A-B"].sections == (0, 1)
    assert wires["B-short"].sections == (1,)
    assert [wires[name].row for name in ("A-B", "B-C", "C-D", "B-short")] == [0, 0, 0, 1]
    assert (wires["B-C"].start_km, wires["B-C"].stop_km) == (2.0, 2.0)
    # at a quarter from B, which is the far end
    assert [(u.km, u.row) for u in layout.units] == [(1.5, 0)]
    assert figures.png_of(feeder_plot.plot_feeder, feeder) == figures.png_of(
        feeder_plot.plot_feeder, feeder
    )


def test_a_figure_is_saved_as_its_name_says(tmp_path):
    figure = feeder_plot.plot_feeder(load_feeder("paper")).get_figure()
    figures.save_figure(figure, tmp_path / "a.svg")
    figures.save_figure(
        feeder_plot.plot_feeder(load_feeder("paper")).get_figure(), tmp_path / "b.svg"
    )
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    figures.save_figure(figure, tmp_path / "a.PNG")
    assert (tmp_path / "a.PNG").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(ValueError, match=r"must end in .png or .svg, got '.pdf'"):
        figures.save_figure(figure, tmp_path / "a.pdf")
