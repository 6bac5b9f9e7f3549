"""The shipped feeders against OpenDSS's phasors, transcribed: one folder for each feeder."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from opendss.compare import compare, limits_of
from opendss.reference import read_compact

from openphase.model.reading.feeder_file import load_feeder

CASES = sorted(path.parent for path in Path(__file__).parent.glob("*/case.toml"))


@pytest.fixture(params=CASES, ids=lambda path: path.name)
def case(request: pytest.FixtureRequest) -> Path:
    folder: Path = request.param
    return folder


@pytest.mark.parametrize("mode", ["direct", "snap"])
def test_voltages_and_eq5_agree(case: Path, mode: str) -> None:
    told: dict[str, Any] = tomllib.loads((case / "case.toml").read_text(encoding="utf-8"))
    limits = limits_of(mode)
    assert told["limits"][mode] == {
        "v_pu": limits.v_pu,
        "z_share": limits.z_share,
        "z_ohm": limits.z_ohm,
    }
    known = {(miss["state"], miss.get("pair")) for miss in told.get("misses", ())}
    reference = read_compact(case / "states.jsonl")
    states, pairs = compare(load_feeder(told["feeder"]), reference, mode)
    seen = {(row.state, None) for row in states if row.worst_pu > limits.v_pu}
    seen |= {(row.state, row.pair) for row in pairs if row.verdict == "misses"}
    assert seen == {miss for miss in known if mode in miss[0].split(":")}
    assert all(row.converged for row in states)
    # the tests compare something: nearly all of what was measured, and most pairs
    assert sum(row.left_out for row in states) < 0.02 * sum(row.compared for row in states)
    assert sum(row.verdict == "agrees" for row in pairs) > 0.8 * len(pairs)
