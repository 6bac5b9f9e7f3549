"""The event node on an edge: two stubs with their shunts, and open phases between them."""

from __future__ import annotations

from ..compiled import compiled
from ..states import Work
from .breaks import DEAD, open_phases
from .matrix3 import (
    ZERO,
    Matrix,
    Vector,
    add,
    load,
    load_vector,
    plus,
    scaled,
    store,
    store_vector,
)
from .series import both, carry, carry_current, up

__all__ = ["climb_event", "cross", "descend_event"]


@compiled
def climb_event(
    work: Work, k: int, y: Matrix, z: Matrix, share: float, mask: int, looped: bool, x_j: Vector
) -> int:
    """Eliminate edge k with the event node on it; returns flags."""
    here, here_j = work.here, work.here_j
    z_low = scaled(z, 1.0 - share)
    f, w = up(y, z_low)
    h = x = xt = u = ZERO
    u_j = (0j, 0j, 0j)
    if looped:
        xt, u, u_j = load(work.fill, 0), load(work.fill, 1), load_vector(work.fill_j, 0)
    h_j, x_j, u_j = carry_current(y, z_low, f, x_j, xt, u_j)
    if looped:
        h, x, xt, u = carry(y, z_low, f, load(work.x, k), xt, u)
    store(work.event, 4, f)
    store(work.event, 5, h)
    store_vector(work.event_j, 2, h_j)
    store(here, 0, w)
    store(here, 1, x)
    store(here, 2, xt)
    store(here, 3, u)
    store_vector(here_j, 0, x_j)
    store_vector(here_j, 1, u_j)
    fed = x_j[0] != 0.0 or x_j[1] != 0.0 or x_j[2] != 0.0
    flags = cross(work, scaled(z, share), mask, 1)
    if mask == 7 and not looped and not fed:
        flags |= DEAD
    store(work.w, k, load(here, 0))
    store_vector(work.x_j, k, load_vector(here_j, 0))
    if looped:
        store(work.x, k, load(here, 1))
        store(work.fill, 0, load(here, 2))
        store(work.fill, 1, load(here, 3))
        store_vector(work.fill_j, 0, load_vector(here_j, 1))
    return flags


@compiled
def cross(work: Work, z: Matrix, mask: int, below: int) -> int:
    """Climb over the event node and the series impedance ``z`` above it; returns flags.

    What is below stands in ``work.here``, and what is seen from above ``z`` replaces it.
    ``below`` is the side that is met first: 1 for q, 0 for p.
    """
    here, here_j, event, event_j = work.here, work.here_j, work.event, work.event_j
    store(here, 0, add(load(here, 0), load(work.event_y, below)))
    flags = 0
    if mask:
        flags = open_phases(mask, here, here_j)
        store(event, 2, load(here, 4))
        store(event, 3, load(here, 5))
        store_vector(event_j, 1, load_vector(here_j, 2))
    y = add(load(here, 0), load(work.event_y, 1 - below))
    f, w = up(y, z)
    xt = load(here, 2)
    h_j, x_j, u_j = carry_current(y, z, f, load_vector(here_j, 0), xt, load_vector(here_j, 1))
    h, x, xt, u = carry(y, z, f, load(here, 1), xt, load(here, 3))
    store(event, 0, f)
    store(event, 1, h)
    store_vector(event_j, 0, h_j)
    store(here, 0, w)
    store(here, 1, x)
    store(here, 2, xt)
    store(here, 3, u)
    store_vector(here_j, 0, x_j)
    store_vector(here_j, 1, u_j)
    return flags


@compiled
def descend_event(work: Work, near: int, above: Vector, v_fork: Vector, mask: int) -> Vector:
    """Voltages of both stubs, ``near`` (0 for p) first; returns that of the other."""
    event, event_j = work.event, work.event_j
    v = plus(both(load(event, 0), above, load(event, 1), v_fork), load_vector(event_j, 0))
    store_vector(work.stub, near, v)
    if mask:
        v = plus(both(load(event, 2), v, load(event, 3), v_fork), load_vector(event_j, 1))
    store_vector(work.stub, 1 - near, v)
    return v
