"""The printed comparison: true to the runs it compares, and no wider than the page."""

import re

from openphase.studies.comparing import compare_runs
from openphase.studies.show.comparison import comparison_text


def test_a_comparison_says_by_class_what_the_sized_settings_spare(runs, sizing, assessed):
    result = compare_runs([runs / "reference", runs / "paper"])
    text = comparison_text(result)
    assert max(map(len, text.splitlines())) <= 100
    (compared,) = result["comparisons"]
    spared = 0
    for own, a, b in zip(
        compared["sections"], assessed.result["sections"], sizing.result["sections"], strict=True
    ):
        trips = own["false_trips"]
        assert trips["both"] + trips["only_a"] == (a["false_trips"] or 0)
        assert trips["both"] + trips["only_b"] == (b["false_trips"] or 0)
        assert own["both"] + own["only_b"] == (b["detected"] or 0)
        spared += trips["only_a"]
        if trips["only_a"]:
            (line,) = re.findall(
                rf"^  {own['local']}→{own['remote']}: (\d+) only A of", text, re.MULTILINE
            )
            worst = max(
                (x for x in own["classes"] if x["kind"] == "must_not_trip"),
                key=lambda x: x["only_a"] / x["trials"],
            )
            assert int(line) == worst["only_a"]
    assert spared > 100
