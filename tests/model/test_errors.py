"""Faults read well, come all at once, and survive the way between processes."""

from __future__ import annotations

import pickle

import pytest

from openphase.model import InputError, OpenPhaseError
from openphase.model.errors import Fault, Report, describe_path


def fault(
    line: int | None = 3, source: str = "a.toml", where: str = "name", found: str | None = "7"
) -> Fault:
    return Fault(source=source, line=line, where=where, wanted="must be text", found=found)


@pytest.mark.parametrize(
    ("one", "text"),
    [
        (fault(), "a.toml:3: name must be text, got 7"),
        (fault(line=None), "a.toml: name must be text, got 7"),
        (fault(found=None), "a.toml:3: name must be text"),
        (fault(where=""), "a.toml:3: must be text, got 7"),
        (fault(source="", line=None), "name must be text, got 7"),
    ],
)
def test_a_fault_says_where_what_and_what_else(one: Fault, text: str) -> None:
    assert str(one) == text


def test_one_fault_stands_alone_and_several_are_counted() -> None:
    assert str(InputError([fault()])) == "a.toml:3: name must be text, got 7"
    assert str(InputError([fault(1), fault(2)])) == (
        "a.toml:1: name must be text, got 7\na.toml:2: name must be text, got 7\n2 faults"
    )


def test_single_has_no_line() -> None:
    error = InputError.single("sheet.csv", "R1", "two rows", "must have one row")
    assert str(error) == "sheet.csv: R1 must have one row, got two rows"


def test_the_exit_codes_are_the_contracts() -> None:
    assert issubclass(InputError, OpenPhaseError)
    assert (OpenPhaseError.exit_code, InputError.exit_code) == (1, 2)


def test_input_errors_can_be_pickled() -> None:
    error = InputError([fault(), fault(None)])
    copy = pickle.loads(pickle.dumps(error))
    assert copy.faults == error.faults
    assert str(copy) == str(error)


def test_a_report_raises_in_the_order_of_the_lines() -> None:
    lines = {"b": 2, "a": 9}
    report = Report(source="f", document={}, locate=lambda path: lines.get(str(path[0])))
    report.raise_if_any()
    for key in ("a", "nowhere", "b"):
        report.add((key,), "is odd")
    with pytest.raises(InputError) as caught:
        report.raise_if_any()
    assert str(caught.value) == "f:2: b is odd\nf:9: a is odd\nf: nowhere is odd\n3 faults"


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ((), ""),
        (("name",), "name"),
        (("lines",), "lines"),
        (("lines", 0), "lines 'A'"),
        (("lines", 1, "at"), "lines #2: at"),
        (("lines", 5, "at"), "lines #6: at"),
        (("noise", "tve"), "noise: tve"),
    ],
)
def test_paths_are_described_by_the_names_of_their_rows(
    path: tuple[str | int, ...], text: str
) -> None:
    assert describe_path(path, {"lines": [{"name": "A"}, {"name": 3}], "name": "x"}) == text
