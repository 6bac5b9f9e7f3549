"""Measured loads: scaled feeders take what was measured, and studies draw what was seen."""

from dataclasses import replace

import numpy as np
import pytest
from oracles.trees import SOURCE, line, plain_load, random_tree

from openphase.model import load_feeder
from openphase.model.distributions import Quantiles, Uniform
from openphase.model.errors import InputError, Report
from openphase.model.load_regions import load_regions
from openphase.model.parts import Capacitor, Feeder, Place, Point
from openphase.model.reading.feeder_file import dump_feeder
from openphase.studies.own.levels import measured_study_text
from openphase.studies.own.match import match_text
from openphase.studies.own.peaks import with_peaks
from openphase.studies.own.readings import read_readings
from openphase.studies.run.cases import make_case
from openphase.studies.run.classes import DrawClass, Purpose
from openphase.studies.run.draw import BlockId, draw_scenarios
from openphase.studies.run.load_levels import level_bounds
from openphase.studies.spec.checks import check_against_feeder
from openphase.studies.spec.study_file import (
    MeasuredLoad,
    Study,
    check_study,
    default_study,
    dump_study,
    study_beside,
    study_from_toml,
)

V = 12000.0 / 3.0**0.5


def table(tmp_path, text):
    path = tmp_path / "peaks.csv"
    path.write_text(text, encoding="utf-8")
    return path


def kva(load):
    q = load.kw * (1.0 / load.power_factor**2 - 1.0) ** 0.5
    return complex(load.kw, np.copysign(q, load.power_factor) if load.kvar is None else load.kvar)


def amperes(feeder, name, factors):
    """What flows at a place at nominal voltage, each load times its factor."""
    regions = load_regions(feeder, [name])
    s = sum(kva(feeder.loads[k]) * factors[k] for k in regions.loads[0])
    s -= 1j * sum(feeder.capacitors[k].kvar for k in regions.capacitors[0])
    return abs(s) * 1000.0 / (3.0 * V)


def least(feeder, measured):
    """The lowest factor of every load, but for `each`."""
    study = replace(Study(), measured=measured)
    return level_bounds(feeder, study)[:, 0] / study.loads.each.support[0]


def measured_rows(feeder, rng):
    """Maxima and minima that some factors of the loads would show at every point."""
    count = len(feeder.loads)
    high = rng.uniform(0.5, 2.0, count)
    low = high * rng.uniform(0.1, 0.6, count)
    rows = []
    for point in feeder.points:
        seen = [amperes(feeder, point.name, factors) for factors in (high, low)]
        if seen[0] > 0.0:
            rows.append((point.name, *seen))
    return rows


@pytest.mark.parametrize("seed", range(25))
def test_the_scaled_feeder_takes_what_was_measured(tmp_path, seed):
    rng = np.random.default_rng(seed)
    feeder, _ = random_tree(rng, 20, 5)
    bank = Capacitor(name="bank", place=Place(bus="B7"), connection="wye", kvar=60.0)
    # lagging loads alone, so that every region has a solution
    loads = tuple(replace(own, power_factor=abs(own.power_factor)) for own in feeder.loads)
    feeder = replace(feeder, loads=loads, capacitors=(bank,))
    rows = measured_rows(feeder, rng)
    text = "point,max_a,min_a\n" + "".join(f"{n},{a!r},{b!r}\n" for n, a, b in rows)
    scaled, measured, match = with_peaks(
        feeder, read_readings(table(tmp_path, text.replace("np.float64", "")))
    )
    joined = {item.point for item in measured}
    assert set(match.joined) == joined
    assert joined | {name for name, _ in match.not_joined} == {name for name, _, _ in rows}
    assert joined
    tops, lows = np.ones(len(loads)), least(scaled, measured)
    for name, high, low in rows:
        region = load_regions(feeder, [row[0] for row in rows])
        own = region.names.index(name)
        further = {region.names[k] for k in reach(region, own)}
        if not further <= joined:
            continue  # something beyond it could not be scaled, which the match says
        assert amperes(scaled, name, tops) == pytest.approx(high, rel=1e-9)
        assert amperes(scaled, name, lows) == pytest.approx(low, rel=2e-4)
    assert scaled.loads != feeder.loads
    assert [a.power_factor for a in scaled.loads] == [b.power_factor for b in feeder.loads]


def reach(regions, n):
    return {n}.union(*(reach(regions, far) for far in regions.beyond[n]))


def chain(*kw, pf=0.9):
    count = len(kw)
    return Feeder(
        name="chain",
        source=SOURCE,
        lines=tuple(line(f"L{n}", f"B{n}", f"B{n + 1}") for n in range(count)),
        transformers=(),
        loads=tuple(
            plain_load(f"D{n}", Place(bus=f"B{n + 1}"), size, pf) for n, size in enumerate(kw)
        ),
        switches=(),
        points=tuple(Point(name=f"P{n}", bus=f"B{n}", line=f"L{n}") for n in range(count)),
        sections=(),
    )


def test_kw_are_taken_as_they_are_and_kvar_goes_along(tmp_path):
    feeder = chain(100.0, 300.0)
    text = "point,max_kw,min_kw\nP0,1000,150\np1,600,60\n"
    scaled, measured, _ = with_peaks(feeder, read_readings(table(tmp_path, text)))
    assert [load.kw for load in scaled.loads] == pytest.approx([400.0, 600.0])
    assert [item.level for item in measured] == [
        Uniform(low=pytest.approx(90.0 / 400.0), high=1.0),
        Uniform(low=0.1, high=1.0),
    ]


def test_hours_become_quantiles_and_both_forms_agree(tmp_path):
    rng = np.random.default_rng(3)
    hours = 300
    far = rng.uniform(5.0, 20.0, hours)
    near = far + rng.uniform(2.0, 12.0, hours)
    far[7] = near[7] = 0.0
    wide = "time,P0,P1\n" + "".join(
        f"{n},{a:.6f},{b:.6f}\n" for n, (a, b) in enumerate(zip(near, far, strict=True))
    )
    tall = "time,point,a\n" + "".join(
        f"{n},P0,{a:.6f}\n{n},P1,{b:.6f}\n" for n, (a, b) in enumerate(zip(near, far, strict=True))
    )
    feeder = chain(100.0, 300.0)
    scaled, measured, match = with_peaks(feeder, read_readings(table(tmp_path, wide)))
    again, likewise, _ = with_peaks(feeder, read_readings(table(tmp_path, tall)))
    assert (again.loads, likewise) == (scaled.loads, measured)
    there = np.delete(np.arange(hours), 7)
    for item, amps, load in zip(
        measured, ((near - far)[there], far[there]), scaled.loads, strict=True
    ):
        assert isinstance(item.level, Quantiles)
        assert load.kw == pytest.approx(amps.max() * 3.0 * V / 1000.0 * 0.9, rel=1e-6)
        wanted = np.quantile(amps / amps.max(), np.linspace(0.0, 1.0, 51))
        assert np.allclose(item.level.values, wanted, atol=1e-5)
    assert "1 of 300 hours without current" in " ".join(match_text(match))


def test_the_sources_bus_stands_for_all(tmp_path):
    scaled, measured, match = with_peaks(
        chain(100.0, 300.0), read_readings(table(tmp_path, "point,max_kw\nb0,800\n"))
    )
    assert [load.kw for load in scaled.loads] == pytest.approx([200.0, 600.0])
    assert [(m.point, m.level) for m in measured] == [("B0", Uniform(low=0.25, high=1.0))]
    assert "no minimum is given" in " ".join(match.notes)
    assert match.without_row == ("P0", "P1")


def test_what_cannot_be_joined_says_why(tmp_path):
    feeder = chain(100.0, 300.0, 50.0)
    feeder = replace(feeder, loads=(feeder.loads[0], feeder.loads[2]))
    text = "point,max_kw,min_kw\nP0,60,1\nP1,90,\nP2,70,9\nnowhere,5,1\n"
    scaled, measured, match = with_peaks(feeder, read_readings(table(tmp_path, text)))
    why = dict(match.not_joined)
    assert "no measuring point" in why["nowhere"]
    assert "no load lies between" in why["P1"]
    assert "more than the 60 kW" in why["P0"]
    assert [item.point for item in measured] == ["P2"]
    assert scaled.loads[0] == feeder.loads[0]
    assert "1 of 2 loads are seen by no joined row" in " ".join(match.notes)


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("point,max_a,min_a\nP0,5,6\nP0,x,1\n,3,1\n", ["<= max_a", "a number", "a name", "once"]),
        ("point\nP0\n", ["column 'max_a' must be there"]),
        ("time,P0\n1,2\n1,3\n,4\n", ["must be there once", "must not be empty"]),
        ("time,point,a\n1,P0,2\n1,P0,3\n1,,4\n", ["once for P0", "a time and a point"]),
        ("time\n1\n", ["must have a column of amperes"]),
        ("time,P0\n1,-2\n2,nan\n", ["line", "'p0'"]),
    ],
)
def test_faults_of_the_file_are_told(tmp_path, text, faults):
    with pytest.raises(InputError) as raised:
        with_peaks(chain(100.0), read_readings(table(tmp_path, text)))
    for fault in faults[:1] if "nan" in text else faults:
        assert fault.replace("line", "number") in str(raised.value)


# ---- in a study ----

BLOCK = BlockId(seed=1, purpose=Purpose.TRAIN, attempt=1, drawn=DrawClass.LOAD_STEP, block=0)


def test_a_study_draws_each_place_within_what_was_measured(tmp_path):
    paper = load_feeder("paper")
    text = "point,max_kw,min_kw\nR2,900,90\nR5,700,350\n"
    scaled, measured, _ = with_peaks(paper, read_readings(table(tmp_path, text)))
    file = tmp_path / "own.toml"
    file.write_text(dump_feeder(scaled), encoding="utf-8")
    study_beside(file).write_text(measured_study_text(measured, "peaks.csv"), encoding="utf-8")
    study = default_study(str(file))
    assert study.measured == measured
    assert study_from_toml(dump_study(study), "s") == study
    case = make_case(scaled, study)
    plain = make_case(scaled, Study())
    drawn = draw_scenarios(case, BLOCK, 2000).before.load_scale
    common = draw_scenarios(plain, BLOCK, 2000).before.load_scale
    bounds = level_bounds(scaled, study)
    names = [load.name for load in scaled.loads]
    for name, scale, (low, high) in zip(names, drawn, bounds, strict=True):
        assert low <= scale.min()
        assert scale.max() <= high
        # nearly all of it is used
        assert scale.min() < low + 0.1 * (high - low)
        assert scale.max() > high - 0.1 * (high - low), name
    regions = load_regions(scaled, ["R2", "R5"])
    unseen = sorted(set(range(len(names))) - {k for own in regions.loads for k in own})
    assert np.array_equal(drawn[unseen], common[unseen])
    # high together and low together
    one, other = regions.loads[0][0], regions.loads[1][0]
    assert np.corrcoef(drawn[one], drawn[other])[0, 1] > 0.8


def test_without_measurements_nothing_changes():
    paper = load_feeder("paper")
    case = make_case(paper, default_study("paper"))
    assert (case.load_places == -1).all()
    bounds = level_bounds(paper, Study())
    assert np.allclose(bounds, [0.25 * 0.8, 1.2])


@pytest.mark.parametrize(
    ("rows", "fault"),
    [
        ('point = "R9"\nlevel = 1.0', "must be a measuring point of the feeder"),
        ('point = "R2"\nlevel = { quantiles = [1.0, 0.5] }', "none below the one before"),
        ('point = "R2"\nlevel = { quantiles = [1.0] }', "two or more"),
        ('point = "R2"', "level"),
        ('point = "R2"\nlevel = 1\n[[measured]]\npoint = "R2"\nlevel = 2', "must be measured once"),
    ],
)
def test_faults_of_measured_tables_are_told(rows, fault):
    def read():
        study = study_from_toml(f"format = 1\n[[measured]]\n{rows}\n", "s.toml")
        check_study(study, load_feeder("paper"), "s.toml")

    with pytest.raises(InputError) as raised:
        read()
    assert fault in str(raised.value)


def test_a_place_in_a_closed_loop_is_refused():
    ring = replace(
        chain(10.0, 10.0),
        lines=(*chain(10.0, 10.0).lines, line("back", "B2", "B0")),
    )
    study = replace(Study(), measured=(MeasuredLoad(point="P1", level=Uniform(low=0.1, high=1.0)),))
    report = Report(source="s", document={})
    check_against_feeder(study, ring, report)
    assert "closed loop" in str(report.faults[0])
