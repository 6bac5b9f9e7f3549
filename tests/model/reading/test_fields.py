"""Every kind of field accepts what it should, and says what it wants of the rest."""

from __future__ import annotations

from math import cos, inf, nan, radians, sin

import pytest

from openphase.model.errors import Report
from openphase.model.reading.fields import Field, Kind, as_toml, markdown_table
from openphase.model.reading.table_check import check_table


def check(raw: dict[str, object], *fields: Field) -> tuple[dict[str, object], list[str]]:
    """Return the values and the faults as text."""
    report = Report(source="f", document={"t": raw})
    values = check_table(raw, fields, ("t",), report)
    return values, [str(fault) for fault in report.faults]


def x(
    kind: Kind,
    *,
    low: float | None = None,
    above: float | None = None,
    high: float | None = None,
    unit: str = "",
) -> Field:
    return Field(name="x", kind=kind, doc="", low=low, above=above, high=high, unit=unit)


@pytest.mark.parametrize(
    ("field", "raw", "value"),
    [
        (x("name"), "a b", "a b"),
        (x("text"), " : ", " : "),
        (x("number"), 3, 3.0),
        (x("number", low=0.0, high=1.0), 1.0, 1.0),
        (x("integer"), 3, 3),
        (x("flag"), True, True),
        (x("impedance"), [1, 2.5], 1 + 2.5j),
        (x("impedance"), {"mag": 2.0, "deg": 90.0}, 2j),
        (x("impedance"), {"mag": 2, "deg": -90}, -2j),
        (x("impedance"), {"deg": 0.0, "mag": 2.0}, 2 + 0j),
        (
            x("impedance"),
            {"mag": 0.13, "deg": 70.0},
            complex(0.13 * cos(radians(70)), 0.13 * sin(radians(70))),
        ),
        (x("range"), [1, 2], (1.0, 2.0)),
        (x("numbers"), [], ()),
        (x("numbers", low=0.0), [0, 5.5], (0.0, 5.5)),
        (x("table"), {"a": 1}, {"a": 1}),
        (x("tables"), [{"a": 1}], ({"a": 1},)),
    ],
)
def test_good_values(field: Field, raw: object, value: object) -> None:
    values, faults = check({"x": raw}, field)
    assert faults == []
    assert values == {"x": value}
    assert type(values["x"]) is type(value)


MAGNITUDE = "0, or 1e-12 to 1e+12 of either sign"
NUMBER = "must be a finite number"
IMPEDANCE = "must be [r, x] or { mag = ..., deg = ... }"


@pytest.mark.parametrize(
    ("field", "raw", "rule"),
    [
        (x("name"), "", "must be a name: text, not empty, without space around it, got ''"),
        (x("name"), " a", "must be a name: text, not empty, without space around it, got ' a'"),
        (x("name"), "a:b", "must be a name without ':' or control characters, got 'a:b'"),
        (x("name"), "a\tb", "must be a name without ':' or control characters, got 'a\\tb'"),
        (x("text"), 5, "must be text, got 5"),
        (x("number", unit="km", above=0.0), "5", f"{NUMBER}, km, > 0, got '5'"),
        (x("number", above=0.0), 0, "must be > 0, got 0"),
        (x("number", low=0.0), -1.5, "must be >= 0, got -1.5"),
        (x("number", high=9.0), 10, "must be <= 9, got 10"),
        (x("number"), True, f"{NUMBER}, got true"),
        (x("number"), nan, f"{NUMBER}, got nan"),
        (x("number"), -inf, f"{NUMBER}, got -inf"),
        (x("number"), 10**400, f"{NUMBER}, got 1{'0' * 56}..."),
        (x("integer", low=1.0, high=1.0), 2, "must be 1, got 2"),
        (x("integer"), 2.0, "must be an integer, got 2.0"),
        (x("integer"), False, "must be an integer, got false"),
        (x("flag"), 1, "must be true or false, got 1"),
        (x("impedance", unit="ohm"), 5.0, f"{IMPEDANCE}, ohm, got 5.0"),
        (x("impedance"), [1.0], f"{IMPEDANCE}, got [1.0]"),
        (x("impedance"), [1.0, nan], f"{IMPEDANCE}, got [1.0, nan]"),
        (x("impedance"), [True, 1.0], f"{IMPEDANCE}, got [true, 1.0]"),
        (x("impedance"), {"mag": 1.0}, f"{IMPEDANCE}, got {{ mag = 1.0 }}"),
        (x("impedance"), {"mag": -1, "deg": 0}, f"{IMPEDANCE}, got {{ mag = -1, deg = 0 }}"),
        (x("impedance"), {}, f"{IMPEDANCE}, got {{}}"),
        (x("impedance", above=0.0), [0, 0], "must have a magnitude > 0, got [0, 0]"),
        (x("number"), -1e-13, f"must be {MAGNITUDE}, got -1e-13"),
        (x("number", above=0.0), 1e13, f"must be {MAGNITUDE}, got 10000000000000.0"),
        (
            x("impedance"),
            [0, 1e13],
            f"must have a magnitude {MAGNITUDE}, got [0, 10000000000000.0]",
        ),
        (x("numbers"), [1, 1e-320], f"must hold numbers {MAGNITUDE}, got [1, 1e-320]"),
        (x("impedance"), [-1e-9, 1], "must have a resistance >= 0, got [-1e-09, 1]"),
        (x("range"), [2, 1], "must be [low, high], low <= high, got [2, 1]"),
        (x("range"), [1, 2, 3], "must be [low, high], low <= high, got [1, 2, 3]"),
        (x("range", low=0.0), [-1, 2], "must hold numbers >= 0, got [-1, 2]"),
        (x("numbers"), [1, "2"], "must be a list of finite numbers, got [1, '2']"),
        (x("numbers"), 7, "must be a list of finite numbers, got 7"),
        (x("table"), [], "must be a table, written [x], got []"),
        (x("tables"), {}, "must be an array of tables, each written [[x]], got {}"),
        (x("tables"), [1], "must be an array of tables, each written [[x]], got [1]"),
    ],
)
def test_bad_values(field: Field, raw: object, rule: str) -> None:
    values, faults = check({"x": raw}, field)
    assert faults == [f"f: t: x {rule}"]
    assert values.keys() == {"x"}


def test_choices_are_respelled_then_compared() -> None:
    field = Field(name="x", kind="text", doc="", choices=("D/Yg", "Yg/D"), respell=(("Δ", "D"),))
    assert check({"x": "Δ/Yg"}, field) == ({"x": "D/Yg"}, [])
    _, faults = check({"x": "D/Y"}, field)
    assert faults == ["f: t: x must be 'D/Yg' or 'Yg/D' (did you mean 'D/Yg'?), got 'D/Y'"]


def test_absent_fields_take_their_default_or_that_of_another() -> None:
    fields = (
        Field(name="a", kind="number", doc="", required=True, unit="m"),
        Field(name="b", kind="number", doc="", same_as="a"),
        Field(name="c", kind="number", doc="", default=4.0),
        Field(name="d", kind="number", doc=""),
    )
    assert check({"a": 2}, *fields) == ({"a": 2.0, "b": 2.0, "c": 4.0, "d": None}, [])
    _, faults = check({"e": 1}, *fields)
    assert faults == ["f: t: e is not a known key", "f: t: a is missing (a finite number, m)"]


def test_a_missing_table_is_not_reported_twice() -> None:
    report = Report(source="f", document={})
    field = Field(name="a", kind="flag", doc="", required=True)
    assert check_table(None, [field], ("t",), report) == {"a": False}
    assert report.faults == []


def test_long_values_are_cut_short() -> None:
    assert as_toml("x" * 80) == "'" + "x" * 56 + "..."


def test_the_documentations_table() -> None:
    fields = (
        Field(name="a", kind="number", unit="m", above=0.0, high=2.0, required=True, doc="A."),
        Field(name="b", kind="text", choices=("u", "v"), default="u", doc="B."),
        Field(name="c", kind="number", same_as="a", doc="C."),
    )
    assert markdown_table(fields).splitlines()[2:] == [
        "| `a` | number | m | > 0, <= 2 | required | A. |",
        "| `b` | text | – | `u`, `v` | `'u'` | B. |",
        "| `c` | number | – | – | as `a` | C. |",
    ]
