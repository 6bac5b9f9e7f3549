"""What runs apart: its results and refusals come back, its death does not hurt."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path

import pytest

from openphase.model.errors import InputError
from openphase.model.importers.dss_child import run_apart
from openphase.model.importers.dss_script import read_script


def test_results_and_refusals_come_back(tmp_path: Path) -> None:
    assert run_apart(math.sqrt, 4.0, source="a.dss") == 2.0
    with pytest.raises(InputError, match="is not a file"):
        run_apart(read_script, tmp_path / "none.dss", source="a.dss")


def test_other_errors_are_ours_and_come_back_whole() -> None:
    with pytest.raises(RuntimeError, match="math domain error"):
        run_apart(math.sqrt, -1.0, source="a.dss")


def test_its_death_is_the_inputs_fault() -> None:
    with pytest.raises(InputError, match=r"a\.dss: the circuit ends the engine's process \(status"):
        run_apart(os._exit, 3, source="a.dss")
    with pytest.raises(InputError, match=r"for more than 0\.5 s"):
        run_apart(time.sleep, 60, source="a.dss", seconds=0.5)


def test_it_cannot_write_and_stands_in_an_empty_folder(tmp_path: Path) -> None:
    assert run_apart(os.listdir, ".", source="a.dss") == []
    target = tmp_path / "written.txt"
    with pytest.raises(RuntimeError, match="File too large"):
        run_apart(target.write_text, "x", source="a.dss")
    assert not target.exists() or target.read_text() == ""
