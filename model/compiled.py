"""The one door to the compiler: machine code for loops that numpy cannot batch."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba

__all__ = ["compiled"]

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` at its first call and keep the machine code on disk.

    Divisions follow numpy (no exception), and a product may be fused with a sum;
    nothing else is reordered, so one CPU type gives one result. Functions are folded
    into their callers: small ones on tuples would otherwise cost more than they compute.
    They make no arrays and count no references to those they are given: counting, at each
    call with a record of thirty arrays, took as long as the arithmetic.
    """
    options: dict[str, Any] = {
        "error_model": "numpy",
        "fastmath": {"contract"},
        "forceinline": True,
        "_nrt": False,
    }
    config: Any = numba.config
    user_s, config.CACHE_DIR = config.CACHE_DIR, _FOLDER
    try:
        jit = numba.njit(cache=bool(_FOLDER), **options)(function)
    finally:
        config.CACHE_DIR = user_s
    return cast("Callable[P, R]", jit)


def _code_folder() -> str:
    """Where machine code of just these sources is kept; empty where nothing can be written.

    The compiler's own check sees a function's file, not the files of the functions folded
    into it: after an upgrade it would run yesterday's physics. So the folder's name is a
    digest of all sources. It stands beside them, or in the user's cache.
    """
    package = Path(__file__).parent.parent
    sources = sorted(p for room in ("model", "detector") for p in (package / room).rglob("*.py"))
    digest = hashlib.sha256(b"\0".join(path.read_bytes() for path in sources)).hexdigest()
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    places = [Path(__file__).parent / "__pycache__", Path(cache) / "openphase"]
    if asked := os.environ.get("NUMBA_CACHE_DIR"):
        places = [Path(asked)]
    for place in places:
        folder = place / f"machine-code-{digest[:16]}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return str(folder)
        except OSError:
            continue
    return ""


_FOLDER = _code_folder()
