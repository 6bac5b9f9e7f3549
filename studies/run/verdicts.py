"""What a terminal said of every scenario of a block, in one byte each, so that runs can be paired.

Two runs that drew the same scenarios differ in their settings alone. With these bytes kept
in the blocks, they are compared scenario by scenario without solving anything again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .classes import Side

__all__ = ["REASONS", "SIDES", "pack_verdicts", "unpack_verdicts"]

REASONS = 32  #: codes of a Reason that a byte has room for
SIDES = 7  #: codes of a Side; the eighth is the path with nothing connected beyond

NOTHING_BEYOND = 7


def pack_verdicts(
    reason: NDArray[np.int8], side: NDArray[np.int8], connected: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """One byte per terminal and scenario.

    Parameters
    ----------
    reason, side : (T, S) arrays
        What the terminal said, and where the event stood, seen from its section.
    connected : (S,) array
        Whether a break in this place has something connected beyond it.

    Returns
    -------
    (T, S) array
        Bits 0 to 4 the reason; 5 to 7 the side, or 7 on the path with nothing connected beyond.

    Examples
    --------
    >>> import numpy as np
    >>> pack_verdicts(
    ...     np.array([[5, 0]], np.int8), np.array([[1, 0]], np.int8), np.array([True] * 2)
    ... )
    array([[37,  0]], dtype=uint8)
    """
    for name, codes, room in (("reasons", reason, REASONS), ("sides", side, SIDES)):
        if codes.size and not (codes.min() >= 0 and codes.max() < room):
            raise ValueError(f"{name} must lie in 0..{room - 1}")
    where = np.where((side == Side.PATH) & ~connected, NOTHING_BEYOND, side)
    return np.asarray(where.astype(np.uint8) << 5 | reason.astype(np.uint8), np.uint8)


def unpack_verdicts(
    byte: NDArray[np.uint8],
) -> tuple[NDArray[np.int8], NDArray[np.int8], NDArray[np.bool_]]:
    """Reason, side, and whether the event stood on the path with something beyond it."""
    reason, where = (byte & REASONS - 1).astype(np.int8), (byte >> 5).astype(np.int8)
    blind = where == NOTHING_BEYOND
    return reason, np.where(blind, np.int8(Side.PATH), where), (where == Side.PATH) & ~blind
