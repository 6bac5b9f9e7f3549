"""The one door to the compiler: machine code for loops that numpy cannot batch."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba

__all__ = ["compiled", "compiled_apart", "compiled_door"]

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
    return _compile(function, forceinline=True, door=not _takes_record(function))


def compiled_apart(function: Callable[P, R]) -> Callable[P, R]:
    """``compiled``, and called rather than folded in: for large parts that run seldom."""
    return _compile(function, forceinline=False, door=not _takes_record(function))


def compiled_door(function: Callable[P, R]) -> Callable[P, R]:
    """``compiled``, for what takes whole records and is called from Python.

    All others that do have no face for Python: unpacking forty arrays takes longer to compile
    than what they do with them.
    """
    return _compile(function, forceinline=False, door=True)


def _takes_record(function: Callable[P, R]) -> bool:
    return not _RECORDS.isdisjoint(str(kind) for kind in function.__annotations__.values())


_RECORDS = frozenset({"Tree", "State", "Work", "Wide", "Probes", "Answer"})


def _compile(function: Callable[P, R], *, forceinline: bool, door: bool) -> Callable[P, R]:
    options: dict[str, Any] = {
        "error_model": "numpy",
        "fastmath": {"contract"},
        "forceinline": forceinline,
        "_nrt": False,
        "no_cpython_wrapper": not door,
        "no_cfunc_wrapper": not door,
    }
    config: Any = numba.config
    user_s, config.CACHE_DIR = config.CACHE_DIR, _FOLDER
    try:
        jit: Any = numba.njit(cache=bool(_FOLDER), **options)(function)
    finally:
        config.CACHE_DIR = user_s
    template = jit.get_call_template
    jit.get_call_template = lambda args, names: template(_any_value(args), names)
    return cast("Callable[P, R]", jit)


def _any_value(args: Any) -> Any:
    """Kinds of arguments without the values that constants have: else every value is compiled."""
    types: Any = numba.types
    return tuple(types.unliteral(kind) for kind in args)


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
