"""Blocks on several processes: the same blocks, in the same order, whoever computes them."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import TypeVar

from joblib import Parallel, delayed
from tqdm import tqdm

from .draw import BlockId
from .store import RunFolder

__all__ = ["block_name", "run_blocks"]

T = TypeVar("T")


def block_name(which: BlockId) -> str:
    """A block's name in the run folder."""
    purpose, drawn = which.purpose.name.lower(), which.drawn.name.lower()
    group = f"g{which.group}-" if which.group else ""
    return f"{purpose}-{which.attempt}-{group}{drawn}-{which.block:05d}"


def run_blocks(
    compute: Callable[[BlockId], T],
    kind: type[T],
    wanted: Sequence[BlockId],
    folder: RunFolder,
    jobs: int,
    title: str,
) -> Iterator[tuple[BlockId, T]]:
    """Yield every wanted block in order: from the folder where it is there, else computed.

    Computed blocks are stored as they come, so that an interrupted run resumes.
    """
    stored = {path.stem for path in folder.blocks.glob("*.npz")}
    missing = [which for which in wanted if block_name(which) not in stored]
    with tqdm(total=len(wanted), desc=title, unit="block", file=sys.stderr, mininterval=0.5) as bar:
        bar.update(len(wanted) - len(missing))
        computed = _compute(compute, missing, jobs)
        for which in wanted:
            result = None
            if block_name(which) in stored:
                result = folder.block(block_name(which), kind)
                if result is None:  # a damaged file: computed again here
                    result = compute(which)
                    folder.keep_block(block_name(which), result)
            else:
                result = next(computed)
                folder.keep_block(block_name(which), result)
                bar.update(1)
            yield which, result


def _compute(compute: Callable[[BlockId], T], missing: Sequence[BlockId], jobs: int) -> Iterator[T]:
    if jobs == 1:
        _keep_memory()
        yield from (compute(which) for which in missing)
        return
    parallel = Parallel(
        n_jobs=jobs,
        return_as="generator",
        pre_dispatch="4 * n_jobs",
        initializer=_follow_the_parent,
        initargs=(os.getpid(),),
    )
    results = parallel(delayed(compute)(which) for which in missing)
    try:
        yield from results
    except BaseException:
        # the run is over; the pool's own thread may still stumble over what is cancelled here
        threading.excepthook = lambda _: None
        raise
    finally:
        with warnings.catch_warnings():  # an interrupted run need not be told what it left undone
            warnings.simplefilter("ignore")
            results.close()


def _follow_the_parent(parent: int) -> None:
    """A worker leaves interrupts to its parent, and ends when the parent has been killed."""
    _keep_memory()
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _keep_memory() -> None:
    """Let freed memory stay with the process, where the C library is one that can be told to.

    Block follows block with arrays of the same sizes; given back and fetched anew each time,
    they cost as much as filling them.
    """
    with suppress(OSError, AttributeError, TypeError):
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(_MMAP_THRESHOLD, 32 << 20)
        mallopt(_TRIM_THRESHOLD, 1 << 30)


_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # names of the GNU C library's malloc.h
