"""The event's edge in lanes: two stubs with their shunts, and open phases between them.

As ``..event_node`` and ``..breaks``. Lanes whose event is elsewhere pass the same steps with all of
the impedance above, no shunts and nothing open.
"""

from __future__ import annotations

from ...compiled import compiled
from ...lanes.functions import bits_of, larger, load_real, mask_of, select, splat
from ...lanes.kinds import WIDTH
from ...states import UNEARTHED, Tree
from ..breaks import DEAD, FLOATING, NOTHING_S, SINGULAR, UNDEFINED, squared
from ..matrix3 import (
    IDENTITY,
    ZERO,
    Matrix,
    Vector,
    add,
    load,
    minus,
    outer,
    plus,
    product,
    reciprocal,
    scaled,
    times,
)
from ..series import up
from ..turns import transposed
from .powers import power
from .rows import (
    Stack,
    add_entry,
    chosen,
    chosen_vector,
    in_lanes,
    load_entry,
    load_matrix,
    load_triple,
    no_vector,
    store_entry,
    store_matrix,
    store_triple,
)
from .turns import turn_edge, turned
from .work import Wide

__all__ = [
    "climb_event",
    "descend_event",
    "event_lanes",
    "event_share",
    "free_modes",
    "note",
    "smallest_counted",
]

Modes = tuple[Matrix, Matrix, Vector, Vector]  #: W, P, x, h


@compiled
def event_lanes(wide: Wide, n: int) -> int:
    """The bits of the lanes whose event is on edge n."""
    bits = 0
    for lane in range(WIDTH):
        bits |= int(wide.edge[lane] == n) << lane
    return bits


@compiled
def event_share(wide: Wide, bits: int, elsewhere: float) -> float:
    """Share of the impedance above the event node, in the lanes of ``bits``."""
    return select(mask_of(bits), load_real(wide.share, (0, 0)), splat(elsewhere))


@compiled
def climb_event(
    tree: Tree, wide: Wide, n: int, bits: int, drawn: Vector, floor_pu: float
) -> tuple[Matrix, Vector]:
    """Past edge n, the event of the lanes in ``bits`` on it; returns W and X above it.

    What leads down again stays in ``own_f``, ``own_h`` and, of these lanes, in ``event``. A
    regulator or transformer stands only where no event is.
    """
    own, z, y = mask_of(bits), load(tree.z_ohm, n), load_matrix(wide.y, n)
    share = event_share(wide, bits, 1.0)
    if tree.charged:
        part = event_share(wide, bits, 0.0)
        y = add(y, scaled(load(tree.end_y_s, n), -part))
    p, h = in_lanes(IDENTITY), no_vector()
    if wide.loose[n]:
        y, p, drawn, h = free_modes(tree, wide, n, (y, drawn), bits)
    low = scaled(z, 1.0 - share)
    f, w = up(y, low)
    ahead = minus(times(f, times(low, drawn)))
    drawn = plus(drawn, times(y, ahead))
    store_matrix(wide.event, 1, chosen(own, product(p, f), load_matrix(wide.event, 1)))
    ahead = plus(times(p, ahead), h)
    store_triple(wide.event_j, 1, chosen_vector(own, ahead, load_triple(wide.event_j, 1)))
    upper, lower = event_shunts(tree, wide, n, bits, floor_pu)
    store_matrix(wide.here, 0, add(w, lower))
    store_triple(wide.here_j, 0, drawn)
    open_phases(wide, bits)
    w, drawn = add(load_matrix(wide.here, 0), upper), load_triple(wide.here_j, 0)
    p, h = load_matrix(wide.here, 1), load_triple(wide.here_j, 1)
    store_matrix(wide.event, 0, chosen(own, p, load_matrix(wide.event, 0)))
    store_triple(wide.event_j, 0, chosen_vector(own, h, load_triple(wide.event_j, 0)))
    high = scaled(z, share)
    f, seen = up(w, high)
    ahead = minus(times(f, times(high, drawn)))
    drawn = plus(drawn, times(w, ahead))
    if turned(tree, n):
        f, seen, drawn = turn_edge(tree, wide, n, (f, seen, drawn))
    store_matrix(wide.own_f, n, f)
    store_triple(wide.own_h, n, ahead)
    return seen, drawn


@compiled
def event_shunts(
    tree: Tree, wide: Wide, n: int, bits: int, floor_pu: float
) -> tuple[Matrix, Matrix]:
    """At the upper and the lower stub, in the lanes of ``bits``."""
    own, here, at = mask_of(bits), wide.here, 4 * tree.unit_node.size
    store_matrix(here, 0, in_lanes(ZERO))
    store_matrix(here, 1, in_lanes(ZERO))
    for i in range(3):
        seen = larger(load_real(wide.winding_v_pu, (at + i, 0)), splat(floor_pu))
        factor = power(seen, load_real(wide.step_power, (0, 0)))
        earth = load_entry(wide.step_y, 0, i) * factor
        between = load_entry(wide.between_y, 0, i)
        following = (i + 1) % 3
        add_entry(here, 0, 4 * i, earth + between)
        add_entry(here, 0, 4 * following, between)
        add_entry(here, 0, 3 * i + following, -between)
        add_entry(here, 0, 3 * following + i, -between)
        add_entry(here, 1, 4 * i, load_entry(wide.fallen_y, 0, i))
    upper = chosen(own, load_matrix(here, 0), ZERO)
    lower = chosen(own, load_matrix(here, 1), ZERO)
    if tree.charged:
        half, share = load(tree.end_y_s, n), event_share(wide, bits, 0.0)
        upper = add(upper, scaled(half, share))
        lower = add(lower, scaled(half, select(own, 1.0 - share, 0.0)))
    store_matrix(wide.event_y, 0, chosen(own, upper, load_matrix(wide.event_y, 0)))
    store_matrix(wide.event_y, 1, chosen(own, lower, load_matrix(wide.event_y, 1)))
    return upper, lower


@compiled
def smallest_counted(stack: Stack) -> float:
    """The square of what counts as no admittance beside W, the first matrix of ``stack``."""
    largest = splat(0.0)
    for i in range(9):
        largest = larger(largest, squared(load_entry(stack, 0, i)))
    return larger(SINGULAR**2 * largest, splat(NOTHING_S**2))


@compiled
def open_phases(wide: Wide, bits: int) -> None:
    """Open the phases of the lanes in ``bits``: W, x in ``here`` change, P and h come beside."""
    here, here_j = wide.here, wide.here_j
    store_matrix(here, 1, in_lanes(IDENTITY))
    store_triple(here_j, 1, no_vector())
    opened = (wide.opened[0] & bits, wide.opened[1] & bits, wide.opened[2] & bits)
    if not opened[0] | opened[1] | opened[2]:
        return
    limit = smallest_counted(wide.here)
    empty = bits
    whole = opened[0] & opened[1] & opened[2]
    if whole:
        for i in range(3):
            empty &= bits_of(squared(load_entry(here_j, 0, i)) == 0.0)
        note(wide, whole & empty, DEAD)
    for a in range(3):
        if not opened[a]:
            continue
        largest = squared(load_entry(here, 0, 3 * a))
        largest = larger(largest, squared(load_entry(here, 0, 3 * a + 1)))
        wide.empty[a] = bits_of(larger(largest, squared(load_entry(here, 0, 3 * a + 2))) <= limit)
    for a in range(3):
        if opened[a]:
            zero = opened[a] & bits_of(squared(load_entry(here, 0, 4 * a)) <= limit)
            if zero:
                note(wide, zero, UNDEFINED << a)
                note(wide, zero & wide.empty[a], DEAD)
                note(wide, zero & ~wide.empty[a], FLOATING)
                for i in range(3):  # an opened phase that hangs on this one is as little defined
                    hanging = bits_of(squared(load_entry(here, 1, 3 * i + a)) > SINGULAR**2)
                    if i != a:
                        note(wide, zero & opened[i] & hanging, UNDEFINED << i)
            replace_phase(wide, a, opened[a], zero)


@compiled
def note(wide: Wide, bits: int, flag: int) -> None:
    """Set a flag in lanes that are eliminated anew."""
    for lane in range(WIDTH):
        if bits & wide.demand[0] & (1 << lane):
            wide.flags[lane] |= flag


@compiled
def replace_phase(wide: Wide, a: int, opened: int, zero: int) -> None:
    """Put the voltage of an open phase, or zero, in terms of the others."""
    here, here_j, own = wide.here, wide.here_j, mask_of(opened)
    own_y = select(mask_of(zero), 1 + 0j, load_entry(here, 0, 4 * a))
    scale = select(mask_of(zero), 0j, -reciprocal(own_y))
    own_j = scale * load_entry(here_j, 0, a)
    for i in range(3):
        from_w, from_p = load_entry(here, 0, 3 * i + a), load_entry(here, 1, 3 * i + a)
        for j in range(3):
            if j == a or i == a:
                continue
            more = scale * load_entry(here, 0, 3 * a + j)
            w = load_entry(here, 0, 3 * i + j)
            store_entry(here, 0, 3 * i + j, select(own, w + from_w * more, w))
        for j in range(3):
            if j != a:
                more = scale * load_entry(here, 0, 3 * a + j)
                p = load_entry(here, 1, 3 * i + j)
                store_entry(here, 1, 3 * i + j, select(own, p + from_p * more, p))
        x, h = load_entry(here_j, 0, i), load_entry(here_j, 1, i)
        store_entry(here_j, 0, i, select(own, x + from_w * own_j, x))
        store_entry(here_j, 1, i, select(own, h + from_p * own_j, h))
    for i in range(3):
        for at in (3 * i + a, 3 * a + i):
            store_entry(here, 0, at, select(own, 0j, load_entry(here, 0, at)))
        at = 3 * i + a
        store_entry(here, 1, at, select(own, 0j, load_entry(here, 1, at)))
    store_entry(here_j, 0, a, select(own, 0j, load_entry(here_j, 0, a)))


@compiled
def free_modes(tree: Tree, wide: Wide, n: int, below: tuple[Matrix, Vector], bits: int) -> Modes:
    """Let loose the modes of edge n, as ``breaks.free_modes``; flags in the lanes of ``bits``."""
    w, x = below
    store_matrix(wide.here, 0, w)
    limit = smallest_counted(wide.here)
    p, h = in_lanes(IDENTITY), no_vector()
    for m in range(tree.loose_from[n], tree.loose_from[n + 1]):
        e = (tree.loose[m, 0], tree.loose[m, 1], tree.loose[m, 2])
        down, own, ahead = times(w, e), times(transposed(w), e), times(p, e)
        driving = e[0] * down[0] + e[1] * down[1] + e[2] * down[2]
        free = squared(driving) <= limit
        note(wide, bits_of(free) & bits, UNEARTHED)
        scale = select(free, 0j, -reciprocal(select(free, 1 + 0j, driving)))
        drawn = scale * (e[0] * x[0] + e[1] * x[1] + e[2] * x[2])
        w, p = add(w, outer(down, own, scale)), add(p, outer(ahead, own, scale))
        x = plus(x, (drawn * down[0], drawn * down[1], drawn * down[2]))
        h = plus(h, (drawn * ahead[0], drawn * ahead[1], drawn * ahead[2]))
    return w, p, x, h


@compiled
def descend_event(wide: Wide, n: int, bits: int, above: Vector) -> Vector:
    """The voltage at the lower end of edge n, and of both stubs in the lanes of ``bits``."""
    own = mask_of(bits)
    v = plus(times(load_matrix(wide.own_f, n), above), load_triple(wide.own_h, n))
    if bits == 0:
        return v
    store_triple(wide.stub, 0, chosen_vector(own, v, load_triple(wide.stub, 0)))
    low = plus(times(load_matrix(wide.event, 0), v), load_triple(wide.event_j, 0))
    store_triple(wide.stub, 1, chosen_vector(own, low, load_triple(wide.stub, 1)))
    low = plus(times(load_matrix(wide.event, 1), low), load_triple(wide.event_j, 1))
    return chosen_vector(own, low, v)
