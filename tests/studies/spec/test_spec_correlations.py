"""What a study correlates: what is refused, and what is drawn."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from openphase.model import InputError
from openphase.studies.spec.correlations import SCALARS, draw_scalars
from openphase.studies.spec.study_file import (
    Study,
    study_from_toml,
)


def study(*lines: str) -> Study:
    return study_from_toml("\n".join(("format = 1", *lines)), "s.toml")


def refused(*lines: str) -> list[str]:
    """Return the message for a text that must be refused, line by line."""
    with pytest.raises(InputError) as caught:
        study(*lines)
    return str(caught.value).splitlines()


def correlated(*pairs: tuple[str, str, float]) -> list[str]:
    """Return lines that correlate the pairs."""
    return [
        line
        for one, other, rank in pairs
        for line in ("[[correlations]]", f'between = ["{one}", "{other}"]', f"rank = {rank}")
    ]


def test_correlations_that_cannot_all_hold_are_named() -> None:
    pairs = [
        ("loads.level", "ders.level", 0.9),
        ("ders.level", "loads.exponent", 0.9),
        ("loads.exponent", "loads.level", -0.9),
        ("ambient.source_pct", "ders.level", 0.1),
    ]
    assert refused(*correlated(*pairs)) == [
        "s.toml:2: correlations must be possible together, unlike loads.level with ders.level"
        " at 0.9, ders.level with loads.exponent at 0.9, loads.exponent with loads.level at -0.9,"
        " and 0 where nothing is said"
    ]
    assert refused(*correlated(*pairs[:2])) == [
        "s.toml:2: correlations must be possible together, unlike loads.level with ders.level"
        " at 0.9, ders.level with loads.exponent at 0.9, and 0 where nothing is said"
    ]
    possible = [*pairs[:2], ("loads.exponent", "loads.level", 0.7)]
    assert len(study(*correlated(*possible)).correlations) == 3


def test_a_pair_is_correlated_once() -> None:
    pairs = [("loads.level", "ders.level", 0.5), ("ders.level", "loads.level", 0.5)]
    assert refused(*correlated(*pairs)) == [
        "s.toml:5: correlations #2 must be the only one between its two quantities"
    ]


def test_scalars_go_together_and_keep_their_distributions() -> None:
    """Of 40,000: ranks within 5/sqrt(40,000), Kolmogorov-Smirnov tests at 1e-4."""
    drawn_from = study(
        "[motors]",
        "share = [0, 0.5]",
        "[loads]",
        "level = { triangular = [0.2, 0.4, 1] }",
        *correlated(("loads.level", "ders.level", -0.6), ("loads.level", "motors.share", 0.5)),
    )
    drawn = draw_scalars(np.random.default_rng(5), drawn_from, 40_000)
    assert set(drawn) == set(SCALARS) - {"motors.y2_y1"}
    for one, other, rank in (
        ("loads.level", "ders.level", -0.6),
        ("loads.level", "motors.share", 0.5),
        ("loads.exponent", "loads.level", 0.0),
        ("ambient.source_pct", "ders.level", 0.0),
    ):
        reached = stats.spearmanr(drawn[one], drawn[other]).statistic
        assert reached == pytest.approx(rank, abs=0.025)
    for name, alone in (
        ("loads.level", stats.triang(0.25, 0.2, 0.8)),
        ("ders.level", stats.uniform(0.0, 1.0)),
        ("motors.share", stats.uniform(0.0, 0.5)),
        ("ambient.source_pct", stats.uniform(-0.3, 0.6)),
    ):
        assert stats.kstest(drawn[name], alone.cdf).pvalue > 1e-4
    assert set(drawn["transformers.yg_d_count"]) == {0.0}


def test_studies_that_differ_in_one_quantity_draw_the_others_alike() -> None:
    plain, other = study(), study("[motors]", "share = 0.3", "[ders]", "level = 1")
    one, two = (draw_scalars(np.random.default_rng(5), s, 100) for s in (plain, other))
    for name in SCALARS:
        if not name.startswith("motors"):
            assert np.array_equal(one[name], two[name]) == (name != "ders.level")
