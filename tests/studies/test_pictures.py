"""The pictures: true to what they are given, legible, and drawn without writing into it."""

import copy
import dataclasses

import numpy as np
import pytest

from openphase.detector.criteria import Reason
from openphase.optimise.staircase import border, front_of
from openphase.studies.run.classes import REPORTED, reported_row
from openphase.studies.show import feeder_plot, figures, plots, views


def judged(sizing):
    return [t for t, row in enumerate(sizing.result["sections"]) if row["classes"]]


def evidence_views(run):
    """The view of every judged terminal in every group, with its row and its place."""
    terminals = len(run.cases[0].points.terminals)
    for n in judged(run):
        group, t = divmod(n, terminals)
        row = run.result["sections"][n]
        trainings = getattr(run, "trainings", None)
        front = trainings[group].front[t] if trainings else None
        case, validation = run.cases[group], run.validations[group]
        yield (group, t), row, views.evidence_view(case, t, row, front, validation)


def all_views(run):
    """Each plot with its data, for everything that is drawn."""
    for (group, t), row, view in evidence_views(run):
        yield plots.plot_evidence, view
        if row["i_set_a"] is not None:
            case, validation = run.cases[group], run.validations[group]
            yield plots.plot_profile, views.profile_view(case, t, validation)
    yield plots.plot_overview, views.overview_view(run.result)
    yield feeder_plot.plot_feeder, run.cases[0].feeder


@pytest.fixture(params=["sizing", "grouped", "assessed"])
def finished(request):
    """Each of the shared runs."""
    return request.getfixturevalue(request.param)


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
    before = copy.deepcopy(sizing.result)
    freeze((sizing.trainings[0].front, sizing.validations))
    for plot, view in all_views(sizing):
        freeze(view)
        plot(view)
    assert sizing.result == before


def test_a_plot_draws_into_the_axes_it_is_given(finished):
    from matplotlib.figure import Figure

    for plot, view in all_views(finished):
        ax = Figure().add_subplot()
        assert plot(view, ax) is ax
        assert ax.get_title(loc="left")


def test_no_texts_lie_on_each_other(finished):
    for plot, view in all_views(finished):
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
    (_, t), _, view = next(evidence_views(sizing))
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


# ---- what the marks of the evidence picture say ----


def kept(run, group, t, kind):
    """The kept sample of a terminal, (5, n), of the classes of one kind."""
    parts = []
    for which, sample, side in run.validations[group].samples:
        rows = reported_row(which.drawn)[side[t]]
        wanted = [r >= 0 and REPORTED[r].kind == kind for r in rows]
        parts.append(sample[t][:, wanted])
    return np.concatenate(parts, axis=1)


def rings(ax, text):
    """Places of the rings whose legend entry begins with ``text``."""
    (colour,) = [plots.RINGS[own] for own in plots.RINGS if own.startswith(text)]
    lines = [own for own in ax.lines if own.get_markeredgecolor() == colour]
    found = [own.get_xydata() for own in lines if own.get_markerfacecolor() == "none"]
    return np.concatenate([np.empty((0, 2)), *found])


def test_every_class_that_may_trip_falsely_has_a_colour():
    wanted = {own.drawn for own in REPORTED if own.kind == "must_not_trip"}
    assert wanted <= set(views.FAMILY)
    assert set(plots.FAMILIES) == set(views.Family)
    assert len(set(plots.FAMILIES.values())) == len(views.Family)


def test_what_lies_full_in_the_settings_corner_is_what_trips_there(finished):
    corner = 0
    for _, row, view in evidence_views(finished):
        if row["i_set_a"] is None:
            continue
        for cloud in view.clouds:
            here = (cloud.di1_a >= row["i_set_a"]) & (cloud.z1_ohm >= row["z_set_ohm"])
            triggered = cloud.di1_a >= row["i_set_a"]
            assert np.array_equal(here & cloud.able, triggered & cloud.trips)
            corner += int((here & cloud.able).sum())
    assert corner > 3


def test_rings_mark_what_the_phases_find_and_what_trips_falsely(finished):
    marked = {"found": 0, "false": 0}
    for (group, t), row, view in evidence_views(finished):
        if row["i_set_a"] is None:
            continue
        ax = plots.plot_evidence(view)
        inside, other = (kept(finished, group, t, kind) for kind in ("must_trip", "must_not_trip"))
        by_phase = (inside[4] == Reason.TRIP) & (inside[0] < row["i_set_a"])
        wanted = {"found": by_phase.sum(), "false": (other[4] == Reason.TRIP).sum()}
        for text, count in wanted.items():
            assert len(rings(ax, text)) == count
            marked[text] += int(count)
        assert wanted["false"] <= row["false_trips"]
    assert marked["found"] > 0
    assert (marked["false"] > 0) == ("assessed" in finished.result)


def test_what_is_blocked_is_faint_however_large_its_impedance(sizing):
    blocked = 0
    for (group, t), row, view in evidence_views(sizing):
        sample = kept(sizing, group, t, "must_not_trip")
        tall = (sample[0] >= row["i_set_a"]) & (sample[2] >= row["z_set_ohm"])
        blocked += int((tall & (sample[4] == Reason.BLOCKED)).sum())
        clouds = [cloud for cloud in view.clouds if cloud.family != views.Family.INSIDE]
        able = sum(int(cloud.able.sum()) for cloud in clouds)
        assert able == ((sample[3] > 0) & (sample[1] <= row["v_set_pu"])).sum()
        assert not row["false_trips"]
    assert blocked > 0


def test_a_closed_loop_shows_its_window_unless_it_is_empty(grouped):
    shown = {}
    for (group, t), _, view in evidence_views(grouped):
        case = grouped.cases[group]
        terminal, (m1, m2) = case.points.terminals[t], case.study.certificate.loop_margins
        shown[terminal.name, case.group.name] = view.window_ohm
        if view.window_ohm is not None:
            rest = terminal.loop_z1_ohm - terminal.line_z1_ohm
            assert view.window_ohm == pytest.approx(
                (m1 * abs(terminal.line_z1_ohm), abs(rest) / m2)
            )
            texts = [own.get_text() for own in plots.plot_evidence(view).get_legend().get_texts()]
            assert "window of Z_set in the closed loop" in texts
    assert {group for (_, group), own in shown.items() if own} == {"tie closed"}
    assert shown["R1→R2", "tie closed"] is not None
    assert shown["R5→R4b", "tie closed"] is None


def test_titles_name_the_group_where_there_are_several(grouped, sizing):
    for (group, _), row, view in evidence_views(grouped):
        assert view.terminal == f"{row['local']}→{row['remote']}, {grouped.cases[group].group.name}"
    assert {view.terminal for *_, view in evidence_views(sizing)} == {
        f"{row['local']}→{row['remote']}" for row in sizing.result["sections"] if row["classes"]
    }


def test_settings_that_were_not_chosen_are_not_called_so(assessed):
    for *_, view in evidence_views(assessed):
        texts = [own.get_text() for own in plots.plot_evidence(view).get_legend().get_texts()]
        assert any(own.startswith("assessed: 1 A, 5 %, 5 Ω") for own in texts)
        assert not any(own.startswith("chosen") or "training" in own for own in texts)
