"""Every value knows where it comes from, and keeps knowing it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from openphase.model import dump_feeder, feeder_from_toml, load_feeder, shipped_feeders
from openphase.model.reading.feeder_file import feeder_content
from openphase.model.reading.provenance import assumptions, count_origins

TEXT = """\
format = 1
name = "f"

[source]
bus = "SUB"
kv_ll = 12.47
z1_ohm = [0.1, 0.9]
z0_ohm = [0.1, 0.9]

[[lines]]
name = "A"
from = "SUB"
to = "B"
length_km = 2
z1_ohm_per_km = [0.2, 0.4]
z0_ohm_per_km = [0.5, 1.2]

[[transformers]]
name = "T1"
bus = "B"
connection = "unknown"
rating_kva = 500
leakage_pu = [0, 0.05]

[[transformers]]
name = "T2"
bus = "B"
connection = "D/Yg"
rating_kva = 500
leakage_pu = [0, 0.05]

[[loads]]
name = "unknown"
transformer = "T1"
kw = 320

[[loads]]
name = "inn"
bus = "B"
kw = 12
exponent = 2
"""


def test_each_value_is_given_or_a_default_or_unknown() -> None:
    origins = feeder_from_toml(TEXT, "f").origins
    assert origins["source", 0, "kv_ll"] == "given"
    assert origins["source", 0, "z0_ohm"] == "given"
    assert origins["source", 0, "z2_ohm"] == "default"
    assert origins["source", 0, "neutral"] == "default"
    assert origins["transformers", "T1", "connection"] == "unknown"
    assert origins["transformers", "T2", "connection"] == "given"
    assert origins["loads", "inn", "exponent"] == "given"
    assert origins["loads", "unknown", "exponent"] == "default"
    assert origins["loads", "unknown", "name"] == "given"


def test_what_says_nothing_about_a_part_has_no_origin() -> None:
    origins = feeder_from_toml(TEXT, "f").origins
    assert ("transformers", "T1", "x0_pu") in origins
    assert ("transformers", "T2", "x0_pu") not in origins
    assert ("loads", "inn", "connection") in origins
    assert ("loads", "unknown", "connection") not in origins
    assert ("loads", "inn", "transformer") not in origins
    assert ("source", 0, "neutral_ohm") not in origins


MORE = """\
[[codes]]
name = "one"
r_ohm_per_km = [[0.3]]
x_ohm_per_km = [[0.8]]

[[lines]]
name = "twig"
from = "B"
to = "C"
length_km = 1
code = "one"
phases = "b"

[[inline_transformers]]
name = "X"
from = "B"
to = "V"
connection = "D/Y"
rating_kva = 100
kv_from = 12.47
kv_to = 0.4
leakage_pu = [0.01, 0.05]

[[loads]]
name = "hut"
bus = "C"
phases = "b"
kw = 3
kvar = 1
zip = [1, 0, 0, 0, 0, 1]
"""


def test_what_another_field_takes_the_place_of_has_none_either() -> None:
    origins = feeder_from_toml(TEXT + MORE, "f").origins
    assert ("lines", "A", "c1_nf_per_km") in origins
    assert ("lines", "twig", "c1_nf_per_km") not in origins
    assert origins["lines", "A", "phases"] == "default"
    assert origins["lines", "twig", "phases"] == "given"
    assert origins["codes", "one", "c_nf_per_km"] == "default"
    assert origins["loads", "inn", "power_factor"] == "default"
    assert ("loads", "hut", "power_factor") not in origins
    assert ("loads", "hut", "exponent") not in origins
    assert ("loads", "unknown", "phases") not in origins
    assert origins["inline_transformers", "X", "shift"] == "default"
    assert ("inline_transformers", "X", "to_neutral_ohm") not in origins
    assert ("inline_transformers", "X", "phases") not in origins
    assert ("source", 0, "angle_deg") not in origins


def test_an_imported_file_gives_nothing() -> None:
    given = feeder_from_toml(TEXT, "f")
    imported = feeder_from_toml(f'imported_from = "f.dss"\n{TEXT}', "f")
    assert imported == given
    assert imported.imported_from == "f.dss"
    counts = count_origins(imported)
    assert counts["given"] == 0
    assert {**counts, "imported": 0, "given": counts["imported"]} == count_origins(given)
    assert imported.origins["transformers", "T1", "connection"] == "unknown"


def test_counts_add_up() -> None:
    feeder = feeder_from_toml(TEXT, "f")
    assert sum(count_origins(feeder).values()) == len(feeder.origins)
    assert count_origins(feeder)["unknown"] == 1


def test_what_was_assumed_is_listed_by_field() -> None:
    said = assumptions(feeder_from_toml(TEXT, "f"))
    assert "source: z2_ohm as z1_ohm" in said
    assert "source: frequency_hz 60.0" in said
    assert "transformers: connection unknown (T1)" in said
    assert "transformers: x0_pu none (T1)" in said
    assert "transformers: xm_pu infinite (all)" in said
    assert "loads: exponent 2.0 (unknown)" in said
    assert not [line for line in said if line.startswith("source: z0_ohm")]


def test_many_rows_are_counted_instead_of_named() -> None:
    lines = "".join(
        f'[[loads]]\nname = "L{n}"\nbus = "B"\nkw = 1\n' + ("exponent = 1\n" if n == 0 else "")
        for n in range(9)
    )
    said = assumptions(feeder_from_toml(TEXT + lines, "f"))
    assert "loads: exponent 2.0 (9 of 11)" in said


def test_a_default_that_is_written_out_is_given_and_stays_so() -> None:
    feeder = feeder_from_toml(TEXT, "f")
    again = feeder_from_toml(dump_feeder(feeder), "f")
    assert again.origins == feeder.origins
    assert dump_feeder(feeder).count("exponent = 2.0") == 1
    assert "power_factor" not in dump_feeder(feeder)


def test_a_changed_value_is_no_default_any_more() -> None:
    feeder = load_feeder("paper")
    loads = tuple(replace(load, exponent=1.0) for load in feeder.loads)
    changed = replace(feeder, loads=loads, source=replace(feeder.source, z1_ohm=1j))
    again = feeder_from_toml(dump_feeder(changed), "f")
    assert again == changed
    assert again.origins["loads", "L1", "exponent"] == "given"
    assert again.origins["source", 0, "z2_ohm"] == "given"


def test_content_is_the_same_wherever_values_come_from() -> None:
    feeder = feeder_from_toml(TEXT, "f")
    written_out = TEXT.replace("kw = 320", "kw = 320.0\nexponent = 2.0\npower_factor = 1")
    other = feeder_from_toml(f'imported_from = "x"\n{written_out}', "g")
    assert dump_feeder(other) != dump_feeder(feeder)
    assert feeder_content(other) == feeder_content(feeder)
    assert feeder_content(replace(feeder, name="g")) != feeder_content(feeder)


@pytest.mark.parametrize("name", shipped_feeders())
def test_content_reads_back(name: str) -> None:
    assert feeder_from_toml(feeder_content(load_feeder(name)), name) == load_feeder(name)
