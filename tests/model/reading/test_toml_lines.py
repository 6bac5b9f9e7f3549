"""The line scanner agrees with the TOML parser on every key, and never raises."""

from __future__ import annotations

import random
import tomllib
from collections.abc import Iterator

import pytest

from openphase.model.errors import KeyPath
from openphase.model.reading.toml_lines import line_numbers, locator, syntax_error_line

TRICKY = '''\
# [not.a.table]
top = "a # no comment ] }"   # but this is
"quoted key".'other' = 'C:\\path'
text = """
[lines]
fake = 1 \\"""
four quotes: """"
literal = \'\'\'
fake = 2
\'\'\'
[ source ]
z = { mag = 0.9, deg = 85 }
a.b.c = 1979-05-27 07:32:00
[[lines]]
name = "A"
parts = [
  1, # first, with ] in a comment
  [2, 3],
  { name = "x", at = 1 },
]
  [lines.inner]
  deep = true
[[lines]]
name = "B"
[[lines.rows]]
n = 1
[[lines.rows]]
n = 2
empty = []
none = {}
'''


def paths(value: object, path: KeyPath = ()) -> Iterator[KeyPath]:
    """Yield the path of every value inside a parsed document."""
    children: Iterator[tuple[str | int, object]] = iter(())
    if isinstance(value, dict):
        children = iter(value.items())
    elif isinstance(value, list):
        children = iter(enumerate(value))
    for key, child in children:
        yield (*path, key)
        yield from paths(child, (*path, key))


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_every_key_of_a_tricky_text_is_found_where_it_stands(end: str) -> None:
    text = TRICKY.replace("\n", end)
    found = line_numbers(text)
    assert set(paths(tomllib.loads(text))) == set(found)
    lines = text.split("\n")
    for path, number in found.items():
        key = str(path[-1])
        if not key.isdigit():
            assert key in lines[number - 1], path
    numbers = {"lines": 14, "lines 1": 23, "n": 28, "at": 19, "literal": 8}
    assert numbers == {
        "lines": found["lines",],
        "lines 1": found["lines", 1],
        "n": found["lines", 1, "rows", 1, "n"],
        "at": found["lines", 0, "parts", 2, "at"],
        "literal": found["literal",],
    }


def test_what_is_missing_is_located_at_its_table() -> None:
    locate = locator("a = 1\n[[rows]]\nx = 1\n[[rows]]\ny = 2\n")
    assert locate(("rows", 1, "x")) == 4
    assert locate(("rows", 7, "x")) == 2
    assert locate(("other", "x")) is None
    assert locate(()) is None


def test_no_text_makes_the_scanner_raise() -> None:
    rng = random.Random(5)
    for _ in range(2000):
        cut = rng.randrange(len(TRICKY))
        noise = "".join(rng.choices("[]{}=\"'.,#\\ \n\0aé1", k=rng.randrange(6)))
        line_numbers(TRICKY[:cut] + noise + TRICKY[rng.randrange(len(TRICKY)) :])
    line_numbers("a = " + "[" * 100_000)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a = 1\nb 2\n", 2),
        ("a = 1\na = 2\n", 2),
        ('a = 1\nb = """x\n\n', 2),
        ("a = [1,\n2", 2),
    ],
)
def test_the_line_of_a_syntax_error(text: str, expected: int) -> None:
    with pytest.raises(tomllib.TOMLDecodeError) as caught:
        tomllib.loads(text)
    message, line = syntax_error_line(str(caught.value), text)
    assert line == expected
    assert "(at" not in message


def test_a_message_without_place_has_no_line() -> None:
    assert syntax_error_line("too deep", "") == ("too deep", None)
