"""The one door to the compiler: machine code for loops that numpy cannot batch."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

__all__ = ["compiled"]

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` at its first call and keep the machine code on disk.

    Divisions follow numpy (no exception), and a product may be fused with a sum;
    nothing else is reordered, so one CPU type gives one result.
    """
    jit = numba.njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
    return cast("Callable[P, R]", jit(function))
