"""Whatever is done to a feeder file, it is read or refused, and never anything else."""

from __future__ import annotations

import random
import re
from importlib import resources
from pathlib import Path

import pytest

from openphase import model
from openphase.model import InputError, dump_feeder, feeder_from_toml, read_feeder
from openphase.model.network import compile_network
from openphase.model.reading.feeder_fields import ROWS, TABLES

PAPER = (resources.files(model) / "data" / "paper.toml").read_text(encoding="utf-8")

DOC = (Path(__file__).parents[3] / "docs" / "feeder-file.md").read_text(encoding="utf-8")
LATERAL = (
    DOC.partition("## An unbalanced example\n")[2].partition("```toml\n")[2].partition("```")[0]
)

ODD = (
    "0", "-1", "1e308", "-1e308", "1e-320", "nan", "inf", "true", '""', '" "', "'a'", '"R2"',
    '"SUB"', '"T1"', '"Yg/Y"', '"Yg/D"', '"unknown"', "[]", "[0, 0]", "[1, 2]", "[1, 2, 3]",
    "[-1, 0]", "{}", "{ mag = 1, deg = 9 }", "{ mag = 1, r = 2 }", "[[1]]", "9" * 400, '"isolated"',
    '"a"', '"ca"', '"abcd"', "[[1, 0], [0, 1]]", "[[0]]", "[1, 0, 0, 0, 0, 1]", '"delta"',
    '"single"', '"centre-tap"', '"D/D"', '"next"', '"one on poles"', "[[nan]]",
    "1979-05-27", '"\\u0000"', '"x.p"', '"a:b"', '"resistor"', "3", "0.5", '"wye"', '"generator"',
)  # fmt: skip


def mutated(text: str, rng: random.Random) -> str:
    """Return the text with a few lines lost, doubled, swapped, or given another value or key."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    keys = sorted({field.name for fields in TABLES.values() for field in fields})
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        at = rng.randrange(len(lines))
        key = lines[at].partition("=")[0].strip()
        match rng.randrange(9):
            case 0:
                del lines[at]
            case 1:
                lines.insert(rng.randrange(len(lines)), lines[at])
            case 2:
                lines[at] = f"{key} = {rng.choice(ODD)}"
            case 3:
                lines[at] = re.sub(
                    r"[\w.-]+(?=[^\w]*$)", rng.choice(["0", "SUB", "T1", ""]), lines[at]
                )
            case 4:
                lines.insert(at + 1, f"{rng.choice(keys)} = {rng.choice(ODD)}")
            case 5:
                table = rng.choice([*ROWS, "tables", "source"])
                lines.insert(at, rng.choice([f"[[{table}]]", f"[{table}]"]))
            case 6 | 7:
                lines[at] = re.sub(r"\b\d+\.\d+", f"{rng.uniform(0, 2):.3f}", lines[at])
            case _:
                cut = rng.randrange(len(lines[at]) + 1)
                lines[at] = lines[at][:cut] + rng.choice("[]{}=\"'#,é\\") + lines[at][cut:]
    return "\n".join(lines)


@pytest.mark.parametrize("base", [PAPER, LATERAL], ids=["paper", "lateral"])
def test_no_change_of_a_file_leads_to_anything_but_an_input_error(base: str) -> None:
    rng = random.Random(11)
    accepted, messages = 0, []
    for _ in range(800):
        text = mutated(base, rng)
        try:
            feeder = feeder_from_toml(text, "f.toml")
        except InputError as error:
            messages.append(str(error))
            continue
        accepted += 1
        again = feeder_from_toml(dump_feeder(feeder), "dumped")
        assert again == feeder
        assert again.origins == feeder.origins
    assert all(messages)
    assert accepted > 50
    assert len(messages) > 370


@pytest.mark.parametrize("base", [PAPER, LATERAL], ids=["paper", "lateral"])
def test_a_feeder_that_is_accepted_can_be_compiled(base: str) -> None:
    rng = random.Random(12)
    compiled = 0
    while compiled < 25:
        try:
            feeder = feeder_from_toml(mutated(base, rng), "f.toml")
        except InputError:
            continue
        compile_network(feeder)
        compiled += 1


LOADS = """\
name,transformer,bus,line,at,connection,kw,power_factor,exponent,motor_share,phases,zip.1,zip.2,\
zip.3,zip.4,zip.5,zip.6
L1,T1,,,,,600,1,,0.1,,,,,,,
L2,,R2,,,delta,500,-0.9,1,,ab,,,,,,
L4,,R2,,,wye,50,,,,c,1,0,0,0,0,1
"L, 3",,,R2-R3,0.5,wye,1e2,0.8,0,1,,,,,,,
"""


def test_no_change_of_a_table_does_either(tmp_path: Path) -> None:
    rng = random.Random(13)
    without = re.sub(r"\[\[loads\]\]\n(\w.*\n)*", "", PAPER)
    text = without.replace("[source]", '[tables]\nloads = "loads.csv"\n[source]')
    path = tmp_path / "feeder.toml"
    path.write_text(text, encoding="utf-8")
    accepted, messages = 0, []
    for _ in range(800):
        data = bytearray(LOADS.encode())
        for _ in range(rng.randint(0, 4)):
            at = rng.randrange(len(data))
            data[at : at + rng.randrange(4)] = rng.choice(
                [
                    b"",
                    b",",
                    b'"',
                    b"\n",
                    b"\r",
                    b";",
                    b"\xff",
                    b"\0",
                    b"-",
                    b"9",
                    b".",
                    b"nan",
                    b"e",
                ]
            )
        (tmp_path / "loads.csv").write_bytes(bytes(data))
        try:
            read_feeder(path)
        except InputError as error:
            messages.append(str(error))
        else:
            accepted += 1
    assert all(messages)
    assert accepted > 100
    assert len(messages) > 300
