"""The event node on an edge: two stubs with their shunts, and open phases between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, compiled_apart
from ..states import Tree, Work
from .breaks import DEAD, free_modes, open_phases
from .matrix3 import (
    Matrix,
    Vector,
    add,
    load,
    load_vector,
    plus,
    product,
    scaled,
    store,
    store_vector,
    times,
)
from .series import carry, carry_current, per_fork, up

__all__ = ["ABOVE", "AT", "BELOW", "climb_event", "climb_loose", "cross", "descend_event"]

Flags = NDArray[np.bool_]

ABOVE, AT, BELOW, LOOSE = 0, 1, 2, 3  #: slots of `Work.event`


@compiled
def climb_series(work: Work, slot: int, z: Matrix, carried: Flags) -> None:
    """Climb over ``z``: ``here`` has what is below it and receives what is seen from above.

    F and H go to that slot of ``event``.
    """
    here, here_j, here_x, event_h = work.here, work.here_j, work.here_x, work.event_h[slot]
    y = load(here, 0)
    f, w = up(y, z)
    h_j, x_j = carry_current(y, z, f, load_vector(here_j, 0), work, carried)
    for c in range(carried.size):
        if carried[c]:
            store(event_h, c, load(here_x, c))
    carry(y, z, f, event_h, work, carried)
    for c in range(carried.size):
        if carried[c]:
            store(here_x, c, add(load(here_x, c), product(y, load(event_h, c))))
    store(work.event, slot, f)
    store_vector(work.event_j, slot, h_j)
    store(here, 0, w)
    store_vector(here_j, 0, x_j)


@compiled
def start_at(work: Work, k: int, y: Matrix, x_j: Vector, carried: Flags) -> None:
    """Begin at the lower end of edge k."""
    store(work.here, 0, y)
    store_vector(work.here_j, 0, x_j)
    for c in range(carried.size):
        if carried[c]:
            store(work.here_x, c, load(work.x[k], c))


@compiled
def end_at(work: Work, k: int, carried: Flags) -> None:
    """What is seen from the upper end of edge k."""
    store(work.w, k, load(work.here, 0))
    store_vector(work.x_j, k, load_vector(work.here_j, 0))
    for c in range(carried.size):
        if carried[c]:
            store(work.x[k], c, load(work.here_x, c))


@compiled
def climb_low(
    tree: Tree, work: Work, k: int, slot: int, z: Matrix, carried: Flags, x_j: Vector
) -> int:
    """Begin at the lower end of edge k and climb over ``z``; returns flags.

    F and H of that slot of ``event`` lead to the node's voltage, loose modes of the edge included.
    """
    start_at(work, k, load(work.y, k), x_j, carried)
    if tree.loose_from[k + 1] == tree.loose_from[k]:
        climb_series(work, slot, z, carried)
        return 0
    flags = free_modes(tree, k, work, carried)
    climb_series(work, slot, z, carried)
    p, event_h = load(work.here, 1), work.event_h[slot]
    store(work.event, slot, product(p, load(work.event, slot)))
    ahead = times(p, load_vector(work.event_j, slot))
    store_vector(work.event_j, slot, plus(ahead, load_vector(work.here_j, 1)))
    for c in range(carried.size):
        if carried[c]:
            store(event_h, c, add(product(p, load(event_h, c)), load(work.here_h, c)))
    return flags


@compiled
def climb_event(
    tree: Tree, work: Work, k: int, z: Matrix, share: float, mask: int, carried: Flags, x_j: Vector
) -> int:
    """Eliminate edge k with the event node on it; returns flags."""
    flags = climb_low(tree, work, k, BELOW, scaled(z, 1.0 - share), carried, x_j)
    x_j = load_vector(work.here_j, 0)
    fed = x_j[0] != 0.0 or x_j[1] != 0.0 or x_j[2] != 0.0
    for c in range(carried.size):
        fed |= carried[c]
    flags |= cross(work, scaled(z, share), mask, 1, carried)
    if mask == 7 and not fed:
        flags |= DEAD
    end_at(work, k, carried)
    return flags


@compiled
def cross(work: Work, z: Matrix, mask: int, below: int, carried: Flags) -> int:
    """Climb over the event node and the series impedance ``z`` above it; returns flags.

    What is below stands in ``work.here``, and what is seen from above ``z`` replaces it.
    ``below`` is the side that is met first: 1 for q, 0 for p.
    """
    here = work.here
    store(here, 0, add(load(here, 0), load(work.event_y, below)))
    flags = 0
    if mask:
        flags = open_phases(mask, work, carried)
        store(work.event, AT, load(here, 1))
        store_vector(work.event_j, AT, load_vector(work.here_j, 1))
        for c in range(carried.size):
            if carried[c]:
                store(work.event_h[AT], c, load(work.here_h, c))
    store(here, 0, add(load(here, 0), load(work.event_y, 1 - below)))
    climb_series(work, ABOVE, z, carried)
    return flags


@compiled
def descend_event(
    tree: Tree, work: Work, near: int, above: Vector, mask: int, carried: Flags
) -> Vector:
    """Voltages of both stubs, ``near`` (0 for p) first; returns that of the other."""
    event, event_h, event_j, fork, v_all = (
        work.event,
        work.event_h,
        work.event_j,
        tree.fork,
        work.v,
    )
    v = plus(times(load(event, ABOVE), above), load_vector(event_j, ABOVE))
    v = per_fork(event_h[ABOVE], carried, fork, v_all, v)
    store_vector(work.stub, near, v)
    if mask:
        v = plus(times(load(event, AT), v), load_vector(event_j, AT))
        v = per_fork(event_h[AT], carried, fork, v_all, v)
    store_vector(work.stub, 1 - near, v)
    return v


@compiled_apart
def climb_loose(tree: Tree, work: Work, k: int, z: Matrix, carried: Flags, x_j: Vector) -> int:
    """Eliminate edge k, at whose lower end modes are loose; returns flags."""
    flags = climb_low(tree, work, k, LOOSE, z, carried, x_j)
    end_at(work, k, carried)
    store(work.f, k, load(work.event, LOOSE))
    store_vector(work.h_j, k, load_vector(work.event_j, LOOSE))
    for c in range(carried.size):
        if carried[c]:
            store(work.h[k], c, load(work.event_h[LOOSE], c))
    return flags
