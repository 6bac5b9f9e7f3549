"""Compiled code counts no references: an option of numba's that is not documented."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from openphase.model.compiled import compiled

Real = NDArray[np.float64]


def larger(a: Real, b: Real) -> float:
    """An array that was picked is one owner more, which is counted unless nobody counts."""
    picked = a if a.size > b[0] else b
    return float(picked[1])


def counts_references(function: Any) -> bool:
    """Whether the machine code of a function that takes two arrays counts references."""
    function(np.ones(3), np.zeros(3))
    return any("NRT_incref" in text for text in function.inspect_llvm().values())


@pytest.fixture(autouse=True)
def no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    """Machine code from the disk cannot be looked into."""
    monkeypatch.setattr("openphase.model.compiled._FOLDER", "")


def test_compiled_code_counts_no_references() -> None:
    assert counts_references(numba.njit(larger)), "numba counts otherwise: the test sees nothing"
    assert not counts_references(compiled(larger))


def test_a_function_that_makes_an_array_is_refused() -> None:
    def makes(n: int) -> float:
        return float(np.zeros(n).sum())

    with pytest.raises(numba.core.errors.TypingError, match="zeros"):
        compiled(makes)(3)
