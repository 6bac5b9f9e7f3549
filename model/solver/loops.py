"""The part of the ladder that closed loops add: chords, and the fill along their chains."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled_apart
from ..states import State, Tree, Work
from .event_node import ABOVE, AT, cross
from .matrix3 import (
    ZERO,
    Matrix,
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
from .series import carry
from .turns import transposed, turn_of

__all__ = ["carry_fill", "climb_chord", "descend_chord_event", "hand_up"]

Flags = NDArray[np.bool_]
Blocks = tuple[Matrix, Matrix, Matrix, Matrix]


@compiled_apart
def climb_chord(tree: Tree, state: State, work: Work, c: int, s: int) -> int:
    """Add chord c to its tail's Y and start the fill; returns flags.

    An event on it is climbed over from the farther end, so that what is inverted is never
    the small part of the impedance.
    """
    last = tree.parent.size
    happening, share, mask = state.edge[s] == last + c, state.share[s], state.open_mask[s]
    w = load(tree.chord_y_s, c)
    flags = 0
    for d in range(tree.tail.size):
        store(work.u[c], d, ZERO)
        store(work.u[d], c, ZERO)
    store_vector(work.u_j, c, (0j, 0j, 0j))
    if not happening:
        x = xt = scaled(w, -1.0)
        u = w
        if tree.regulator[last + c] >= 0 or tree.transformer[last + c] >= 0:
            t = turn_of(tree, state, work, last + c, s)
            back = transposed(t)
            w, x, xt = product(back, product(u, t)), product(back, x), product(xt, t)
        keep_chord(tree, work, c, (w, x, xt, u))
        return flags
    z = load(tree.z_ohm, last + c)
    far = 1.0 - share if share <= 0.5 else share
    w = scaled(w, 1.0 / far)
    away = scaled(w, -1.0)
    store(work.here, 0, w)
    store(work.here_x, c, away)
    store(work.xt, c, away)
    store(work.u[c], c, w)
    store_vector(work.here_j, 0, (0j, 0j, 0j))
    flags = cross(work, scaled(z, 1.0 - far), mask, 1 if share <= 0.5 else 0, tree.alone[c])
    # seen from the tail: I = W V + X V_fork, and from the fork: I' = X' V + U V_fork
    w, x, xt, u = load(work.here, 0), load(work.here_x, c), load(work.xt, c), load(work.u[c], c)
    if share > 0.5:
        w, x, xt, u = u, xt, x, w
    keep_chord(tree, work, c, (w, x, xt, u))
    return flags


@compiled_apart
def keep_chord(tree: Tree, work: Work, c: int, blocks: Blocks) -> None:
    """Begin the fill of loop c at its tail, with W, X, X' and U of its chord."""
    tail = tree.tail[c]
    w, x, xt, u = blocks
    store(work.chord[0], c, w)
    store(work.chord[1], c, x)
    store(work.chord[2], c, xt)
    store(work.chord[3], c, u)
    store(work.x[tail], c, x)
    store(work.xt, c, xt)
    store(work.u[c], c, u)
    store(work.y, tail, add(load(work.y, tail), w))


@compiled_apart
def carry_fill(work: Work, k: int, y: Matrix, z: Matrix, f: Matrix, carried: Flags) -> None:
    """The loops' part of eliminating a plain edge."""
    h, x = work.h[k], work.x[k]
    for c in range(carried.size):
        if carried[c]:
            store(h, c, load(x, c))
    carry(y, z, f, h, work, carried)
    for c in range(carried.size):
        if carried[c]:
            store(x, c, add(load(x, c), product(y, load(h, c))))


@compiled_apart
def hand_up(tree: Tree, work: Work, k: int, parent: int) -> None:
    """Hand the loops' fill to the node above edge k, or add it there where that is a fork."""
    carried, fork, xt, u, y = tree.carried[k], tree.fork, work.xt, work.u, work.y
    x, x_above, u_j = work.x[k], work.x[parent], work.u_j
    chords = carried.size
    for d in range(chords):
        if carried[d] and fork[d] != parent:
            store(x_above, d, load(x, d))
    for c in range(chords):
        if not carried[c] or fork[c] != parent:
            continue
        store(y, parent, add(load(y, parent), add(load(x, c), load(xt, c))))
        store_vector(work.y_j, parent, plus(load_vector(work.y_j, parent), load_vector(u_j, c)))
        for d in range(chords):
            if not carried[d]:
                continue
            if fork[d] == parent:
                store(y, parent, add(load(y, parent), load(u[c], d)))
            else:
                store(x_above, d, add(load(x_above, d), load(u[c], d)))
                store(xt, d, add(load(xt, d), load(u[d], c)))


@compiled_apart
def descend_chord_event(tree: Tree, work: Work, c: int, share: float, mask: int) -> None:
    """The stubs of an event on a chord, which was climbed from its nearer end's other side."""
    tail, fork = tree.tail[c], tree.fork[c]
    near, far, side = (tail, fork, 0) if share <= 0.5 else (fork, tail, 1)
    v_far = load_vector(work.v, far)
    v = plus(
        times(load(work.event, ABOVE), load_vector(work.v, near)), load_vector(work.event_j, ABOVE)
    )
    v = plus(v, times(load(work.event_h[ABOVE], c), v_far))
    store_vector(work.stub, side, v)
    if mask:
        v = plus(times(load(work.event, AT), v), load_vector(work.event_j, AT))
        v = plus(v, times(load(work.event_h[AT], c), v_far))
    store_vector(work.stub, 1 - side, v)
