"""Run what touches the engine apart from us: in a process that may die and cannot write.

The engine is trusted with nothing. Nonsense among a file's values can end its process, so it
has one of its own: with a limit on time and memory, in an empty folder that is thrown away,
and with no right to put a byte into any file.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import resource
import signal
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from ..errors import InputError, OpenPhaseError

__all__ = ["run_apart", "serve"]

MAX_MEMORY_BYTES = 8 * 2**30

_A = TypeVar("_A")
_R = TypeVar("_R")

_CODE = "import sys; from {module} import serve; serve()"


def run_apart(
    function: Callable[[_A], _R], argument: _A, *, source: str, seconds: float = 300.0
) -> _R:
    """Return ``function(argument)``, worked out in a process of its own.

    Parameters
    ----------
    function
        A function of a module, not one within another.
    argument
        Its argument; like the result it must be data that can be pickled.
    source
        The file's name, for messages.
    seconds
        Time limit.

    Raises
    ------
    InputError
        If the process dies or takes too long.
    OpenPhaseError
        If the function raises it.
    """
    environment = {k: v for k, v in os.environ.items() if not k.startswith("DSS_")}
    environment["PYTHONPATH"] = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
    with tempfile.TemporaryDirectory(prefix="openphase-") as folder:
        try:
            child = subprocess.run(
                [sys.executable, "-c", _CODE.format(module=__name__)],
                input=pickle.dumps((function, argument)),
                capture_output=True,
                cwd=folder,
                env=environment,
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            wanted = f"keeps the engine busy for more than {seconds:g} s"
            raise InputError.single(source, "the circuit", None, wanted) from None
    if child.returncode != 0:
        how = _ending(child.returncode)
        raise InputError.single(source, "the circuit", None, f"ends the engine's process ({how})")
    outcome, result = pickle.loads(child.stdout)
    if outcome == "refused":
        raise result
    if outcome == "failed":
        raise RuntimeError(result)
    return result  # type: ignore[no-any-return]


def serve() -> None:
    """Work out one function whose pickle stands on standard input: the child's side."""
    function, argument = pickle.loads(sys.stdin.buffer.read())
    # Whatever the engine prints must not mix with the answer.
    answer = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    _limit(resource.RLIMIT_AS, MAX_MEMORY_BYTES)
    _limit(resource.RLIMIT_FSIZE, 0)
    _limit(resource.RLIMIT_CORE, 0)
    with os.fdopen(answer, "wb") as stream:
        stream.write(pickle.dumps(_outcome(function, argument)))
        stream.flush()
        # The engine's own clearing up may fail; nothing of it is needed.
        os._exit(0)


def _outcome(function: Callable[[Any], Any], argument: Any) -> tuple[str, Any]:
    """Return what came of the function, errors told apart."""
    try:
        return "done", function(argument)
    except OpenPhaseError as error:
        return "refused", error
    except MemoryError:
        return "refused", InputError.single("", "the circuit", None, "needs too much memory")
    except Exception:  # noqa: BLE001 - reported whole on the other side
        return "failed", traceback.format_exc()


def _limit(what: int, amount: int) -> None:
    """Set a limit of this process where the system has it."""
    with contextlib.suppress(ValueError, OSError):
        hard = resource.getrlimit(what)[1]
        if hard != resource.RLIM_INFINITY:
            amount = min(amount, hard)
        resource.setrlimit(what, (amount, amount))


def _ending(code: int) -> str:
    """Return in words how a process ended."""
    if code >= 0:
        return f"status {code}"
    try:
        return signal.Signals(-code).name
    except ValueError:
        return f"signal {-code}"
