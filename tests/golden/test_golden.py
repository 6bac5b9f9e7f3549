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


def test_every_case_is_found() -> None:
    assert [case.name for case in CASES] == ["ieee123", "ieee13", "ieee34", "ieee37"]


@pytest.mark.parametrize("mode", ["direct", "snap"])
@pytest.mark.parametrize("case", CASES, ids=lambda path: path.name)
def test_voltages_and_eq5_agree(case: Path, mode: str) -> None:
    told: dict[str, Any] = tomllib.loads((case / "case.toml").read_text(encoding="utf-8"))
    limits = limits_of(mode)
    assert told["limits"][mode] == {
        "v_pu": limits.v_pu,
        "z_share": limits.z_share,
        "z_ohm": limits.z_ohm,
    }
    missed = {miss["mode"]: miss for miss in told.get("misses", ())}.get(mode)
    states, pairs = compare(load_feeder(told["feeder"]), read_compact(case / "states.jsonl"), mode)

    assert all(row.converged for row in states)
    worst = max(row.worst_pu for row in states)
    if missed is None:
        assert worst <= limits.v_pu
    else:  # known to miss: not by more than is told, and by the common mode alone
        assert limits.v_pu < worst <= missed["v_pu"]
        assert max(row.worst_between_pu for row in states) <= limits.v_pu
    assert [row for row in pairs if row.verdict == "misses"] == []

    # and they compare something: nearly all that was measured, and nearly all pairs
    assert sum(row.left_out for row in states) <= 0.02 * sum(row.compared for row in states)
    assert sum(row.verdict == "agrees" for row in pairs) >= 0.95 * len(pairs) > 0
