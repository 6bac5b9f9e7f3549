"""CSV tables of a feeder file: they say the same as its own tables would, and stay beside it.

What is wrong with one, and how that is said, stands in ``tests/malformed/feeder``.
"""

from __future__ import annotations

import csv
import io
import tomllib
from pathlib import Path

import pytest

from openphase.model import Feeder, InputError, dump_feeder, feeder_from_toml, read_feeder
from openphase.model.reading.csv_table import parse_csv, ways_of
from openphase.model.reading.feeder_fields import CSV_TABLES, ROWS
from openphase.model.reading.toml_file import toml_rows

DOC = Path(__file__).parents[3] / "docs" / "feeder-file.md"

FEEDER = """\
format = 1
name = "f"

[source]
bus = "SUB"
kv_ll = 12.47
z1_ohm = [0.1, 0.9]

[[lines]]
name = "A"
from = "SUB"
to = "B"
length_km = 2
z1_ohm_per_km = { mag = 0.4, deg = 60.0 }
z0_ohm_per_km = { mag = 1.0, deg = 70.0 }
c1_nf_per_km = 9.5

[[lines]]
name = "twig"
from = "B"
to = "E"
length_km = 1
z1_ohm_per_km = { mag = 0.4, deg = 60.0 }
z0_ohm_per_km = { mag = 1.0, deg = 70.0 }
phases = "ca"

[[inline_transformers]]
name = "pole"
from = "E"
to = "yard"
connection = "single"
rating_kva = 25
kv_from = 12.47
kv_to = 0.24
leakage_pu = { mag = 0.02, deg = 60.0 }
phases = "ac"
to_phases = "a"

[[transformers]]
name = "T1"
line = "A"
at = 0.25
connection = "Yg/Δ"
rating_kva = 500
leakage_pu = { mag = 0.05, deg = 80 }

[[transformers]]
name = "T, \\"2\\""
bus = "B"
connection = "unknown"
rating_kva = 1e3
leakage_pu = { mag = 6e-2, deg = 90 }
x0_pu = 1.5

[[loads]]
name = "007"
transformer = "T1"
kw = 320
power_factor = 0.95

[[loads]]
name = "inn"
line = "A"
at = 1
connection = "delta"
kw = 12.5
motor_share = 0.5

[[loads]]
name = "hut"
bus = "yard"
kw = 3
kvar = -1.5
phases = "a"
zip = [0.5, 0.25, 0.25, 1.5, -0.5, 0]

[[ders]]
name = "pv"
transformer = "T1"
kw = 50
model = "thevenin"
z1_ohm = { mag = 20.0, deg = 10 }

[[capacitors]]
name = "bank"
bus = "B"
kvar = 300

[[switches]]
name = "link"
from = "B"
to = "C"
closed = true

[[points]]
name = "P1"
bus = "SUB"
line = "A"

[[points]]
name = "P2"
bus = "B"
line = "A"
voltage_side = "bus"

[[sections]]
local = "P1"
remote = "P2"

[[coordinates]]
bus = "SUB"
x = -3
y = 0.5
"""


def as_csv(rows: list[dict[str, object]], table: str) -> str:
    """Return a table of the TOML file as CSV, all columns, cells as people write them."""
    out = io.StringIO()
    columns = [column for own in ROWS[table] for column in ways_of(own)[0]]
    writer = csv.DictWriter(out, columns, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        cells: dict[str, object] = {}
        for key, value in row.items():
            if isinstance(value, dict):
                cells |= {f"{key}.{part}": number for part, number in value.items()}
            elif isinstance(value, list):
                cells |= {f"{key}.{n}": number for n, number in enumerate(value, start=1)}
            else:
                cells[key] = str(value).upper() if isinstance(value, bool) else value
        writer.writerow(cells)
    return out.getvalue()


def write_split(folder: Path, tables: tuple[str, ...]) -> Path:
    """Write the feeder with these tables in CSV files."""
    document = tomllib.loads(FEEDER)
    blocks = [toml_rows({key: document.pop(key) for key in ("format", "name")})]
    blocks.append("[tables]\n" + "".join(f'{table} = "csv/{table}.csv"\n' for table in tables))
    (folder / "csv").mkdir()
    for table, value in document.items():
        if table in tables:
            (folder / "csv" / f"{table}.csv").write_text(as_csv(value, table), encoding="utf-8")
        elif isinstance(value, list):
            blocks += [f"[[{table}]]\n{toml_rows(row)}" for row in value]
        else:
            blocks.append(f"[{table}]\n{toml_rows(value)}")
    path = folder / "feeder.toml"
    path.write_text("\n".join(blocks), encoding="utf-8")
    return path


@pytest.fixture
def whole() -> Feeder:
    return feeder_from_toml(FEEDER, "whole")


@pytest.mark.parametrize("tables", [*((table,) for table in CSV_TABLES), CSV_TABLES])
def test_a_table_says_the_same_in_either_form(
    tables: tuple[str, ...], whole: Feeder, tmp_path: Path
) -> None:
    read = read_feeder(write_split(tmp_path, tables))
    assert read == whole
    assert read.origins == whole.origins
    assert dump_feeder(read) == dump_feeder(whole)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: b"\xef\xbb\xbf" + text.encode(),
        lambda text: text.replace("\n", "\r\n").encode(),
        lambda text: text.replace("\n", ",,\n").encode(),
        lambda text: (text + ",,,\n\n,,\n").encode(),
        lambda text: text.replace(",", " , ").replace("\n", "  \n").encode(),
        lambda text: text.rstrip("\n").encode(),
    ],
    ids=["byte order mark", "dos", "empty columns", "empty rows", "spaces", "no last line end"],
)
def test_what_spreadsheets_add_does_no_harm(spoil: object, whole: Feeder, tmp_path: Path) -> None:
    path = write_split(tmp_path, ("loads",))
    file = tmp_path / "csv" / "loads.csv"
    file.write_bytes(spoil(file.read_text(encoding="utf-8")))  # type: ignore[operator]
    assert read_feeder(path) == whole


def test_lines_are_counted_over_cells_with_line_ends() -> None:
    text = 'name,kw\n"two\nlines",1\nlast,x\n'
    assert parse_csv(text, "loads", ROWS["loads"]).lines["loads", 1] == 4


@pytest.mark.parametrize("leads", ["folder", "file", "loop"])
def test_a_link_does_not_lead_out_of_the_folder(leads: str, tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    path = write_split(home, ("loads",))
    (home / "csv").rename(tmp_path / "csv")
    if leads == "folder":
        (home / "csv").symlink_to(tmp_path / "csv")
    else:
        (home / "csv").mkdir()
        target = tmp_path / "csv" / "loads.csv" if leads == "file" else home / "csv" / "loads.csv"
        (home / "csv" / "loads.csv").symlink_to(target)
    with pytest.raises(InputError) as caught:
        read_feeder(path)
    assert str(caught.value) == (
        f"{path}:5: tables: loads must stay in the feeder file's folder, which a link leaves,"
        " got 'csv/loads.csv'"
    )


def test_a_link_within_the_folder_is_followed(whole: Feeder, tmp_path: Path) -> None:
    path = write_split(tmp_path, ("loads",))
    (tmp_path / "csv" / "loads.csv").rename(tmp_path / "other.csv")
    (tmp_path / "csv" / "loads.csv").symlink_to(tmp_path / "other.csv")
    assert read_feeder(path) == whole


def test_a_text_that_is_no_file_names_no_tables() -> None:
    text = FEEDER.replace(
        "[source]", '[tables]\nregulators = "r.csv"\nswitches = "s.csv"\n[source]'
    )
    with pytest.raises(InputError) as caught:
        feeder_from_toml(text.replace("[[switches]]", "[[regulators]]").replace("closed", "#"), "f")
    assert str(caught.value).splitlines() == [
        "f:5: tables: regulators is not a known key: this table stands in the feeder file itself",
        "f:6: tables: switches must be left out of a feeder that is not read from a file,"
        " got 's.csv'",
        "2 faults",
    ]


def test_the_documented_tables_are_read(tmp_path: Path) -> None:
    text = DOC.read_text(encoding="utf-8")
    section = text.partition("## CSV tables\n")[2]
    tables = section.partition("```toml\n")[2].partition("```")[0]
    rows = section.partition("```csv\n")[2].partition("```")[0]
    found = parse_csv(rows, "loads", ROWS["loads"])
    assert found.faults == []
    assert [row["kw"] for row in found.rows] == [320, 60]
    assert set(tomllib.loads(tables)["tables"]) <= set(CSV_TABLES)
