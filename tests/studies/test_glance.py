"""The first sentences of a report: what a planner wants to know before all else."""

from openphase.studies.show.by_class import at_a_glance


def bare_row(local, remote, detected, **more):
    """A row of a result as far as the first sentences look at it."""
    row = {"local": local, "remote": remote, "setting_group": "normal", "status": "set"}
    row |= {"i_set_a": 1.0, "opens": 110, "unreachable": 10, "detected": detected}
    row |= {"false_trips": 0, "security_trials": 50}
    own = {"name": "load_step", "side": "upstream", "kind": "must_not_trip"}
    row |= {"classes": [own | {"trials": 50, "trips": 0, "upper": 0.06}]}
    return row | more


def test_one_end_that_finds_a_break_is_enough():
    rows = [bare_row("A", "B", 60), bare_row("B", "A", 97), bare_row("B", "C", 99)]
    said = at_a_glance({"sections": rows}, 1e-4)
    assert "B→A 3 of 100, B→C 1 of 100." in said
    assert "A→B" not in said.partition("Missed")[2]


def test_false_trips_are_summed_and_the_worst_is_named():
    bad = {"name": "load_step", "side": "upstream", "kind": "must_not_trip", "upper": 0.3}
    worse = bad | {"name": "earth_fault", "side": "inside", "trials": 10, "trips": 2}
    classes = [bad | {"trials": 50, "trips": 3}, worse]
    rows = [
        bare_row("A", "B", 100),
        bare_row("B", "C", 100, false_trips=5, security_trials=60, classes=classes),
    ]
    said = at_a_glance({"sections": rows}, 1e-4)
    assert "5 of 110 events that must not trip, at 1 of 2 terminals with settings" in said
    assert "Worst: earth faults inside at B→C, 2 of 10 (20.0 %)" in said
