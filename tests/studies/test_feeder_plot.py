"""The schematic: everything stands where the feeder has it, and the legend names it."""

import pytest

from openphase.model.reading.feeder_file import feeder_from_toml, load_feeder
from openphase.studies.show import feeder_plot, figures
from openphase.studies.show.feeder_layout import lay_out

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


DER_AND_BANK = """
[[ders]]
name = "roofs"
line = "C-D"
at = 0.5
kw = 40
model = "constant_current"
[[capacitors]]
name = "bank"
bus = "D"
kvar = 300
connection = "wye"
"""


@pytest.mark.parametrize(
    ("more", "wanted"), [("", "load"), (DER_AND_BANK, "load, DER or capacitor")]
)
def test_the_legend_names_what_stands_there_and_nothing_else(more, wanted):
    feeder = feeder_from_toml(FORKED + more, "forked.toml")
    texts = [own.get_text() for own in feeder_plot.plot_feeder(feeder).get_legend().get_texts()]
    assert texts == ["section P–Q", "section P–R", "measuring point", wanted, "closed switch"]


def test_the_papers_legend_has_its_tie():
    ax = feeder_plot.plot_feeder(load_feeder("paper"))
    texts = [own.get_text() for own in ax.get_legend().get_texts()]
    assert texts[-3:] == ["measuring point", "transformer", "open switch"]


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


def test_a_crowded_schematic_keeps_its_legend_clear_of_the_axis():
    text = FORKED
    for n in range(30):
        text += f'[[loads]]\nname = "unit{n}"\nline = "C-D"\nat = {0.03 * (n + 1):.2f}\nkw = 1.0\n'
    ax = feeder_plot.plot_feeder(feeder_from_toml(text, "crowded.toml"))
    figure = ax.get_figure()
    with figures.house_style():
        figure.draw_without_rendering()
        legend, label = (own.get_window_extent() for own in (ax.get_legend(), ax.xaxis.label))
    assert not legend.overlaps(label)
