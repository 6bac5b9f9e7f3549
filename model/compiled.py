"""The one door to the compiler: machine code for loops that numpy cannot batch."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar, cast

import numba

__all__ = ["compiled"]

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` at its first call and keep the machine code on disk.

    Divisions follow numpy (no exception), and a product may be fused with a sum;
    nothing else is reordered, so one CPU type gives one result. Functions are folded
    into their callers: small ones on tuples would otherwise cost more than they compute.
    """
    jit = numba.njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
    return cast("Callable[P, R]", jit(function))


def forget_stale_code(folder: Path) -> None:
    """Drop machine code in ``folder`` that was compiled from other sources than today's.

    The compiler's own check sees a function's file, not the files of the functions
    folded into it: after an upgrade it would run yesterday's physics.
    """
    sources = sorted(folder.glob("*.py"))
    digest = hashlib.sha256(b"\0".join(path.read_bytes() for path in sources)).hexdigest()
    stamp = folder / "__pycache__" / "compiled-from.txt"
    try:
        if stamp.exists() and stamp.read_text(encoding="ascii") == digest:
            return
        for stale in stamp.parent.glob("*.nb[ic]"):
            stale.unlink(missing_ok=True)
        stamp.parent.mkdir(exist_ok=True)
        stamp.write_text(digest, encoding="ascii")
    except OSError:
        return  # a read-only installation keeps no machine code here either


forget_stale_code(Path(__file__).parent)
