"""The printed comparison: true to the runs it compares, and no wider than the page."""

import copy
import re

from openphase.studies.comparing import compare_runs
from openphase.studies.show.comparison import MOST_ROWS, comparison_text
from openphase.studies.show.sheet import class_words, terminal_name

TRIPS = ("both", "only_a", "only_b")


def printed_classes(text):
    """The rows of the table of false trips by class: class and terminal, and four counts."""
    (table,) = [part for part in text.split("\n\n") if part.startswith("false trips by class")]
    lines = [line for line in table.splitlines()[1:] if not line.startswith("and ")]
    found = [re.fullmatch(r"(.*\S) +(\S+→\S+) +(\d+) +(\d+) +(\d+) +(\d+)", own) for own in lines]
    return [(own[1], own[2], *map(int, own.groups()[2:])) for own in found]


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
    assert spared > 100


def test_false_trips_are_listed_by_class_and_terminal_the_worst_rate_first(runs):
    result = compare_runs([runs / "reference", runs / "paper"])
    expected = [
        (class_words(own), terminal_name(row), *(own[key] for key in (*TRIPS, "trials")))
        for row in result["comparisons"][0]["sections"]
        for own in row["classes"]
        if own["kind"] == "must_not_trip" and any(own[key] for key in TRIPS)
    ]
    text = comparison_text(result)
    listed = printed_classes(text)
    assert len(listed) == min(len(expected), MOST_ROWS) > 3
    assert set(listed) <= set(expected)
    rates = [sum(row[2:5]) / row[5] for row in listed]
    assert rates == sorted(rates, reverse=True)
    left = set(expected) - set(listed)
    assert all(sum(row[2:5]) / row[5] <= rates[-1] for row in left)
    assert (f"and {len(left)} more rows" in text) == bool(left)


def test_runs_that_differ_in_options_alone_do_not_look_alike(runs):
    result = compare_runs([runs / "reference", runs / "reference"])
    alike = comparison_text(result)
    assert "options" not in alike
    other = copy.deepcopy(result)
    for row in other["comparisons"][0]["sections"]:
        row["b"] |= {"options": "compensated=true", "negative_sign": False, "dt_ms": 500.0}
    text = comparison_text(other)
    assert max(map(len, text.splitlines())) <= 100
    assert "options (1): compensated=true; negative_sign=false; dt_ms=500" in text
    marks = re.findall(r"→\S+ +([AB]) .* (default|\(\d\))$", text, flags=re.MULTILINE)
    assert set(marks) == {("A", "default"), ("B", "(1)")}
    assert len(marks) == 2 * len(result["comparisons"][0]["sections"])


def test_open_phases_gained_and_lost_are_listed_by_class_and_terminal(runs):
    result = compare_runs([runs / "reference", runs / "paper"])
    lines = comparison_text(result).splitlines()
    start = next(n for n, line in enumerate(lines) if line.startswith("open phases inside"))
    printed = lines[start + 1 : lines.index("", start)]
    expected = [
        (class_words(own), terminal_name(row), *(own[key] for key in (*TRIPS, "trials")))
        for row in result["comparisons"][0]["sections"]
        for own in row["classes"]
        if own["kind"] != "must_not_trip"
        and own["side"] == "inside"
        and own["name"] != "wiring"
        and own["only_a"] + own["only_b"]
    ]
    assert expected
    assert [" ".join(line.split()) for line in printed] == [
        " ".join(map(str, row)) for row in expected
    ]
