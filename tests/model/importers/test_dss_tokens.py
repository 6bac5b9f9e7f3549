"""Lines of OpenDSS's language taken apart: the words are the engine's, and so are the tokens."""

from __future__ import annotations

from random import Random
from typing import Any

import pytest

from openphase.model.importers.dss_tokens import parameters, quoted
from openphase.model.importers.dss_words import COMMANDS, OPTIONS, PROPERTIES, find_word

PIECES = ["a", "b.1.2", "kv", "12.5", "=", "=", " ", "  ", "\t", ",", '"', "'", "(", ")", "[", "]"]
PIECES += ["{", "}", "/", "%", "|", "~", "-3e5"]


def engine() -> Any:
    """Return a fresh engine, or skip."""
    dss = pytest.importorskip("dss", reason="needs the extra [opendss]").dss.NewContext()
    dss.AllowForms = False
    return dss


def random_line(rng: Random) -> str:
    """Return a line of pieces that mean something to the parser."""
    return "".join(rng.choice(PIECES) for _ in range(rng.randrange(1, 14)))


def test_tokens_are_those_of_the_engines_own_parser() -> None:
    parser = engine().Parser
    rng = Random(1)
    for _ in range(4_000):
        line = random_line(rng)
        parser.CmdString = line
        wanted = []
        for _ in range(30):
            name, value = parser.NextParam, parser.StrValue
            if not value:
                break
            wanted.append((name, value))
        assert [(p.name, p.value) for p in parameters(line)] == wanted, repr(line)


def test_comments_end_a_line_unless_they_are_quoted() -> None:
    assert [p.value for p in parameters("a b!c d")] == ["a", "b"]
    assert [p.value for p in parameters("a b//c d")] == ["a", "b"]
    assert [p.value for p in parameters('a "b!c//" d')] == ["a", "b!c//", "d"]
    assert list(parameters("// a")) == []


def test_what_is_quoted_is_read_back() -> None:
    rng = Random(2)
    refused = 0
    for _ in range(4_000):
        value = random_line(rng).replace("@", "")
        for opening in ("", "(", '"', "["):
            text = quoted(value, opening)
            if text is None:
                refused += 1
                continue
            again = list(parameters(f"x {text} y"))
            assert [p.value for p in again] == ["x", value, "y"], repr(value)
    assert refused < 2_000


def test_the_words_are_the_engines() -> None:
    dss = engine()
    known = dss.Executive
    assert tuple(known.Command(n + 1) for n in range(known.NumCommands)) == COMMANDS
    assert tuple(known.Option(n + 1) for n in range(known.NumOptions)) == OPTIONS


NEEDED = {
    "RegControl": "transformer=t winding=2",
    "CapControl": "capacitor=c element=line.l",
    **dict.fromkeys(["Relay", "Recloser", "Fuse"], "monitoredobj=line.l"),
    "SwtControl": "switchedobj=line.l",
}


@pytest.mark.parametrize("kind", PROPERTIES)
def test_the_properties_are_the_engines_in_its_order(kind: str) -> None:
    dss = engine()
    for text in ("New Circuit.c", "New Line.l", "New Transformer.t", "New Capacitor.c"):
        dss.Text.Command = text
    if kind not in ("Line", "Transformer", "Capacitor"):
        dss.Text.Command = f"New {kind}.x {NEEDED.get(kind, '')}"
    name = {"Line": "l", "Transformer": "t", "Capacitor": "c"}.get(kind, "x")
    dss.Text.Command = f"Select {kind}.{name}"
    assert tuple(dss.ActiveCircuit.ActiveDSSElement.AllPropertyNames) == PROPERTIES[kind]


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("redir", "Redirect"),
        ("COMP", "Compile"),
        ("sol", "Solve"),
        ("exp", "Export"),
        ("m", "M"),
        ("calcv", "Calcvoltagebases"),
        ("latlong", "LatLongCoords"),
    ],
)
def test_shortened_words_are_found(text: str, word: str) -> None:
    assert find_word(text, COMMANDS) == word


@pytest.mark.parametrize("text", ["solvent", "redirect2", "", "ｒedirect", "reſet", "new."])
def test_other_words_are_none(text: str) -> None:
    assert find_word(text, COMMANDS) is None
