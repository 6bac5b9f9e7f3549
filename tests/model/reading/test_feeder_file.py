"""Feeder files: what they say, what is wrong with them, and where they come from."""

from __future__ import annotations

import cmath
import math
import subprocess
import sys
from pathlib import Path

import pytest

from openphase.model import (
    Feeder,
    InputError,
    Line,
    Load,
    Place,
    Point,
    Section,
    Source,
    Switch,
    Transformer,
    dump_feeder,
    feeder_from_toml,
    load_feeder,
    read_feeder,
    shipped_feeders,
)
from openphase.model.reading.feeder_fields import DOCUMENT, TABLES
from openphase.model.reading.fields import markdown_table

DOC = Path(__file__).parents[3] / "docs" / "feeder-file.md"

GOOD = """\
format = 1
name = "small"

[source]
bus = "SUB"
kv_ll = 12
z1_ohm = { mag = 0.9, deg = 85 }

[[lines]]
name = "A"
from = "SUB"
to = "B1"
length_km = 3.0
z1_ohm_per_km = [0.1, 0.3]
z0_ohm_per_km = [0.3, 0.9]

[[lines]]
name = "B"
from = "B1"
to = "B2"
length_km = 5.0
z1_ohm_per_km = [0.1, 0.3]
z0_ohm_per_km = [0.3, 0.9]

[[transformers]]
name = "T1"
line = "B"
at = 0.5
connection = "Yg/Δ"
rating_kva = 1000
leakage_pu = [0.0, 0.06]

[[loads]]
name = "L1"
transformer = "T1"
kw = 100

[[loads]]
name = "L2"
bus = "B2"
connection = "delta"
kw = 50
power_factor = -0.9
exponent = 1

[[switches]]
name = "tie"
from = "B2"
to = "SUB"

[[points]]
name = "P1"
bus = "SUB"
line = "A"

[[points]]
name = "P2"
bus = "B1"
line = "B"

[[sections]]
local = "P1"
remote = "P2"
"""

SMALL = Feeder(
    name="small",
    source=Source(
        bus="SUB",
        kv_ll=12.0,
        emf_pu=1.0,
        z1_ohm=cmath.rect(0.9, math.radians(85)),
        z2_ohm=cmath.rect(0.9, math.radians(85)),
        z0_ohm=cmath.rect(0.9, math.radians(85)),
        frequency_hz=60.0,
    ),
    lines=tuple(
        Line(
            name=name,
            from_bus=from_bus,
            to_bus=to_bus,
            length_km=length_km,
            z1_ohm_per_km=0.1 + 0.3j,
            z0_ohm_per_km=0.3 + 0.9j,
        )
        for name, from_bus, to_bus, length_km in (("A", "SUB", "B1", 3.0), ("B", "B1", "B2", 5.0))
    ),
    transformers=(
        Transformer(
            name="T1",
            place=Place(line="B", at=0.5),
            connection="Yg/D",
            rating_kva=1000.0,
            leakage_pu=0.06j,
            x0_pu=None,
        ),
    ),
    loads=(
        Load(
            name="L1",
            transformer="T1",
            place=None,
            connection="wye",
            kw=100.0,
            power_factor=1.0,
            exponent=2.0,
        ),
        Load(
            name="L2",
            transformer=None,
            place=Place(bus="B2"),
            connection="delta",
            kw=50.0,
            power_factor=-0.9,
            exponent=1.0,
        ),
    ),
    switches=(Switch(name="tie", from_bus="B2", to_bus="SUB", closed=False),),
    points=(Point(name="P1", bus="SUB", line="A"), Point(name="P2", bus="B1", line="B")),
    sections=(Section(local="P1", remote="P2"),),
)


def faults_of(text: str) -> list[str]:
    """Return the message for a text that must be refused, line by line."""
    with pytest.raises(InputError) as caught:
        feeder_from_toml(text, "f.toml")
    return str(caught.value).splitlines()


def changed(old: str, new: str) -> str:
    """Return the good file with the first ``old`` made ``new``."""
    assert old in GOOD
    return GOOD.replace(old, new, 1)


def test_a_good_file() -> None:
    assert feeder_from_toml(GOOD, "f.toml") == SMALL


def test_reading_a_file_with_a_byte_order_mark_and_dos_line_ends(tmp_path: Path) -> None:
    path = tmp_path / "dos.toml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert read_feeder(path) == SMALL
    assert load_feeder(str(path)) == SMALL


# ---- shipped feeders and paths ----


def test_shipped_feeders_leave_out_studies() -> None:
    assert "paper" in shipped_feeders()
    assert not [name for name in shipped_feeders() if "." in name]


@pytest.mark.parametrize("name", shipped_feeders())
def test_every_shipped_feeder_is_valid(name: str) -> None:
    feeder = load_feeder(name)
    assert feeder.name == name
    assert feeder_from_toml(dump_feeder(feeder), "dumped") == feeder


def test_an_unknown_feeder_lists_what_ships() -> None:
    with pytest.raises(InputError) as caught:
        load_feeder("papr")
    shipped = ", ".join(shipped_feeders())
    assert str(caught.value) == (
        f"feeder must be a file or one of the shipped feeders, {shipped}"
        " (did you mean 'paper'?), got 'papr'"
    )


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    missing = tmp_path / "none.toml"
    with pytest.raises(InputError) as caught:
        read_feeder(missing)
    assert str(caught.value) == f"{missing}: must be a file to read, got No such file or directory"
    (tmp_path / "latin.toml").write_bytes(b"name = '\xe9'")
    with pytest.raises(InputError, match=r"latin\.toml: must be UTF-8 text$"):
        load_feeder(str(tmp_path / "latin.toml"))
    with pytest.raises(InputError, match="must be a file to read"):
        load_feeder(str(tmp_path))


def test_the_model_needs_no_numpy() -> None:
    code = "import sys, openphase.model; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# ---- malformed files ----


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "length_km = 5.0",
            "length_km = -5.0",
            "f.toml:21: lines 'B': length_km must be > 0, got -5.0",
        ),
        (
            "length_km = 5.0\n",
            "",
            "f.toml:17: lines 'B': length_km is missing (a finite number, km, > 0)",
        ),
        (
            "[source]",
            "[source",
            "f.toml:4: is not valid TOML: Expected ']' at the end of a table declaration",
        ),
        ("format = 1", "format = 2", "f.toml:1: format must be 1, got 2"),
        (
            'name = "small"',
            'name = "a/b"',
            "f.toml:2: name must do as the name of a folder, got 'a/b'",
        ),
        (
            "kv_ll = 12",
            "kv_ll = nan",
            "f.toml:6: source: kv_ll must be a finite number, kV, > 0, <= 1000, got nan",
        ),
        (
            "z1_ohm = { mag = 0.9, deg = 85 }",
            "z1_ohm = { mag = 0.9, deg = 95 }",
            "f.toml:7: source: z1_ohm must have a resistance >= 0, got { mag = 0.9, deg = 95 }",
        ),
        (
            "z0_ohm_per_km = [0.3, 0.9]",
            "z0_ohm_per_km = [0, 0]",
            "f.toml:15: lines 'A': z0_ohm_per_km must have a magnitude > 0, got [0, 0]",
        ),
        (
            "rating_kva",
            "x0_pu = 1.0\nrating_kva",
            "f.toml:30: transformers 'T1': x0_pu must be left out for Yg/D:"
            " it belongs to Yg/Yg, got 1.0",
        ),
        (
            "[0.0, 0.06]",
            "[0, 0]",
            "f.toml:31: transformers 'T1': leakage_pu must not be 0 for Yg/D,"
            " which would short the zero sequence to earth",
        ),
        (
            "at = 0.5\n",
            "",
            "f.toml:25: transformers 'T1' must say where it hangs, by bus or line and at, got line",
        ),
        (
            'transformer = "T1"\n',
            "",
            "f.toml:33: loads 'L1' must say where it hangs,"
            " by transformer or bus or line and at, got none",
        ),
        (
            'transformer = "T1"\n',
            'transformer = "T1"\nconnection = "wye"\n',
            "f.toml:36: loads 'L1': connection must be left out behind a transformer,"
            " whose winding decides",
        ),
        (
            'connection = "delta"',
            'connection = "delat"',
            "f.toml:41: loads 'L2': connection must be 'wye' or 'delta' (did you mean 'delta'?),"
            " got 'delat'",
        ),
        (
            '[[switches]]\nname = "tie"\nfrom = "B2"\nto = "SUB"\n',
            "[switches]\n",
            "f.toml:46: switches must be an array of tables, each written [[switches]], got {}",
        ),
    ],
)
def test_one_fault(old: str, new: str, message: str) -> None:
    assert faults_of(changed(old, new)) == [message]


BETWEEN = " stands between two buses, in [[inline_transformers]]"


@pytest.mark.parametrize(
    ("found", "what"),
    [
        ("YNyn0", "a vector group, written Yg/Yg whatever its clock"),
        ("Dyn11", "a vector group, written D/Yg whatever its clock"),
        ("YNd1", "a vector group, written Yg/D whatever its clock"),
        ("Yd5", "a vector group, written Y/D whatever its clock"),
        ("dd0", "a vector group, written D/D whatever its clock"),
        ("Yg/Y", "a low-voltage wye winding without a grounded neutral, which" + BETWEEN),
        ("Δ/Y", "a low-voltage wye winding without a grounded neutral, which" + BETWEEN),
        ("Yy0", "a low-voltage wye winding without a grounded neutral, which" + BETWEEN),
        ("Y/Yg", "an ungrounded wye winding above a grounded one, which" + BETWEEN),
        ("Zy", "a zigzag winding, which has no model"),
        (
            "V/V",
            "an open bank of two units, which stand between two buses, in [[inline_transformers]]",
        ),
        (
            "open-delta",
            "an open bank of two units, which stand between two buses, in [[inline_transformers]]",
        ),
        ("single-phase", "a single-phase unit, which" + BETWEEN),
        ("SWER", "a single-phase unit, which" + BETWEEN),
        ("Yg/Yg/D", "a three-winding unit, which has no model"),
    ],
)
def test_a_bank_without_model_is_refused_by_what_it_is(found: str, what: str) -> None:
    (said,) = faults_of(changed('"Yg/Δ"', f'"{found}"'))
    assert said == (
        "f.toml:29: transformers 'T1': connection must be 'Yg/Yg' or 'D/Yg' or 'Yg/D' or 'Y/D'"
        f" or 'D/D' or 'unknown', got {found!r}: {what}"
    )


@pytest.mark.parametrize("found", ["Yg/Q", "Yg-D", "yg/d", "delta/wye", "", "?"])
def test_a_mistyped_bank_is_none_of_them(found: str) -> None:
    (said,) = faults_of(changed('"Yg/Δ"', f'"{found}"'))
    assert said.endswith(f", got {found!r}")


def test_a_name_twice_is_reported_with_what_it_leaves_dangling() -> None:
    assert faults_of(changed('name = "P2"', 'name = "P1"')) == [
        "f.toml:57: points 'P1': name must be unique among the points, got 'P1'",
        "f.toml:63: sections #1: remote must be a point of the feeder, got 'P2'",
        "2 faults",
    ]


def test_many_faults_are_reported_at_once_in_the_order_of_the_file() -> None:
    text = GOOD
    for old, new in (
        ("length_km = 3.0", "lenght_km = 3.0"),
        ('line = "B"\nat', 'line = "BB"\nat'),
        ("kw = 100", "kw = true"),
        ("power_factor = -0.9", "power_factor = 0"),
        ('to = "SUB"', 'to = "FAR"'),
        ('bus = "B1"\nline = "B"', 'bus = "SUB"\nline = "B"'),
        ('remote = "P2"', 'remote = "P3"'),
    ):
        assert old in text
        text = text.replace(old, new, 1)
    assert faults_of(text) == [
        "f.toml:9: lines 'A': length_km is missing (a finite number, km, > 0)",
        "f.toml:13: lines 'A': lenght_km is not a known key (did you mean 'length_km'?)",
        "f.toml:27: transformers 'T1': line must be a line of the feeder (did you mean 'B'?),"
        " got 'BB'",
        "f.toml:36: loads 'L1': kw must be a finite number, kW, >= 0, got true",
        "f.toml:43: loads 'L2': power_factor must be -1 to 1, not 0, got 0",
        "f.toml:49: switches 'tie': to must be connected with 'SUB' while ties are open, got 'FAR'",
        "f.toml:58: points 'P2': bus must be an end of line 'B', 'B1' or 'B2', got 'SUB'",
        "f.toml:63: sections #1: remote must be a point of the feeder, got 'P3'",
        "8 faults",
    ]


def test_an_empty_file_and_an_absurd_one() -> None:
    assert faults_of("") == [
        "f.toml: format is missing (an integer, 1)",
        "f.toml: name is missing (a name)",
        "f.toml: source is missing (a table)",
        "f.toml: lines is missing (an array of tables)",
        "4 faults",
    ]
    assert "is not valid TOML" in faults_of("a = " + "[" * 100_000)[0]


def test_what_a_dump_looks_like() -> None:
    text = dump_feeder(SMALL)
    assert text.startswith('format = 1\nname = "small"\n\n[source]\nbus = "SUB"\nkv_ll = 12.0\n')
    assert '[[transformers]]\nname = "T1"\nline = "B"\nat = 0.5\nconnection = "Yg/D"\n' in text


# ---- the documentation ----


@pytest.mark.parametrize("table", [*TABLES, "top level"])
def test_the_documented_fields_are_the_ones_checked(table: str) -> None:
    fields = DOCUMENT if table == "top level" else TABLES[table]
    text = DOC.read_text(encoding="utf-8")
    headings = {"top level": "### Top level"}
    headings |= {name: f"### `[{name}]`" for name in ("source", "tables")}
    heading = headings.get(table, f"### `[[{table}]]`")
    _, _, after = text.partition(f"{heading}\n")
    assert markdown_table(fields) in after.partition("\n#")[0]


def test_the_documented_example_and_its_faults() -> None:
    text = DOC.read_text(encoding="utf-8")
    example = text.partition("```toml\n")[2].partition("```")[0]
    feeder_from_toml(example, "example.toml")
    for old, new in (
        ("length_km = 4.2", "lenght_km = 4.2"),
        ("kw = 320", "kw = -320"),
        ("power_factor = 0.95", 'power_factor = "0.95"'),
        ('bus = "SUB"\nline = "trunk"', 'bus = "SUB"\nline = "trunck"'),
    ):
        assert old in example
        example = example.replace(old, new, 1)
    with pytest.raises(InputError) as caught:
        feeder_from_toml(example, "example.toml")
    assert text.partition("```text\n")[2].partition("\n```")[0] == str(caught.value)
