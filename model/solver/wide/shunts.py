"""What hangs on the nodes of eight scenarios: loads, banks, and the event's shunts."""

from __future__ import annotations

from ...compiled import compiled
from ...lanes.functions import bits_of, joined, load_real, mask_of, select, splat, store_real
from ...lanes.kinds import WIDTH
from ...states import State, Tree, Work
from ..assemble import add_machine, hang_bank
from ..bank import D_YG, YG_D, YG_YG
from ..bank_forms import delta_wye, wye_delta, wye_wye
from ..breaks import squared
from ..matrix3 import ZERO, Matrix, load, store, store_vector
from .loads import branch_admittance, load_admittance
from .rows import (
    add_entry,
    add_in_lane,
    add_matrix,
    chosen,
    in_lanes,
    load_entry,
    load_matrix,
    load_triple,
    no_vector,
    put_in_lane,
    store_entry,
    store_matrix,
    store_triple,
)
from .work import ALL, Wide

__all__ = ["find_demand", "set_region_shunts", "set_shunts"]

NEAR = 1.0  #: an admittance farther from the eliminated one than this share needs a new elimination
NEAR_BROKEN = 0.2  #: where loads alone hold the voltage behind an open phase


@compiled
def find_demand(tree: Tree, wide: Wide, floor_pu: float) -> int:
    """Branches at their voltages; returns the bits of the lanes that must be eliminated anew.

    Where admittances have changed little since, what they draw more than then is a current at
    their node, which goes up and down with the matrices that stand there.
    """
    at = 4 * (tree.unit_node.size + 1)
    v_pu, own_y, eliminated = wide.winding_v_pu, wide.branch_own, wide.branch_y
    broken = mask_of(wide.opened[0] | wide.opened[1] | wide.opened[2])
    near = select(broken, NEAR_BROKEN**2, splat(NEAR**2))
    demand = mask_of(0)
    for p in range(tree.branch_node.size):
        own = branch_admittance(tree, wide, p, load_real(v_pu, (at + p, 0)), floor_pu)
        store_entry(own_y, p, 0, own)
        past = load_entry(eliminated, p, 0)
        demand = demand | (squared(own - past) > near * squared(past))
    return bits_of(demand)


@compiled
def set_shunts(
    tree: Tree,
    state: State,
    wide: Wide,
    work: Work,
    how: tuple[int, bool, bool],
    floor_pu: float,
) -> None:
    """Everything on the nodes but what happens in regions.

    ``how``: the lanes to be eliminated anew, whether there are any, and whether there are
    currents that no voltage drives.
    """
    demand, full, fed = how
    y, y_j, v = wide.y, wide.y_j, wide.v
    nothing = splat(0.0)
    for k in range(y.shape[0]):
        a, passed = tree.lone_phase[k], tree.passed[k] >= 0
        if fed and not passed:
            for i in range(3):
                if a < 0 or a == i:
                    store_entry(y_j, k, i, joined(nothing, nothing))
        if not full or passed:
            continue
        if a >= 0:
            store_entry(y, k, 4 * a, nothing + complex(tree.shunt_s[k, a, a]))
            continue
        for i in range(9):
            store_entry(y, k, i, nothing + complex(tree.shunt_s[k, i // 3, i % 3]))
    if full:
        hang_units(tree, state, wide, work, floor_pu)
    renewed = mask_of(demand)
    node, first, other = tree.branch_node, tree.branch_from, tree.branch_to
    for p in range(node.size):
        k, i, j = node[p], first[p], other[p]
        own, taken = load_entry(wide.branch_own, p, 0), load_entry(wide.branch_y, p, 0)
        taken = select(renewed, own, taken)
        if full:
            store_entry(wide.branch_y, p, 0, taken)
            add_entry(y, k, 4 * i, taken)
            if j >= 0:
                add_entry(y, k, 4 * j, taken)
                add_entry(y, k, 3 * i + j, -taken)
                add_entry(y, k, 3 * j + i, -taken)
        if demand != ALL:
            across = load_entry(v, k, i)
            if j >= 0:
                across = across - load_entry(v, k, j)
            current = (own - taken) * across
            add_entry(y_j, k, i, current)
            if j >= 0:
                add_entry(y_j, k, j, -current)


@compiled
def hang_units(tree: Tree, state: State, wide: Wide, work: Work, floor_pu: float) -> None:
    """Every bank with its loads and machines on its node."""
    units = tree.unit_node.size
    if units == 0:
        return
    unit_y, v_pu = wide.unit_y, wide.winding_v_pu
    for unit in range(units):
        for i in range(6):
            store_real(unit_y, (unit, i, 0), splat(0.0))
    for n in range(tree.load_unit.size):
        unit = tree.load_unit[n]
        if unit >= 0:
            for i in range(3):
                seen = load_real(v_pu, (4 * unit + i, 0))
                own = load_admittance(tree, wide, n, seen, floor_pu)
                add_entry(unit_y, unit, i, own)
    apart = 0
    for unit in range(units):
        rare = ALL
        if tree.unit_plain[unit]:
            rare = hang_plain(tree, state, wide, unit)
        apart |= rare
    if apart:
        for lane in range(WIDTH):
            if apart >> lane & 1:
                hang_apart(tree, state, wide, work, lane, floor_pu)


@compiled
def hang_plain(tree: Tree, state: State, wide: Wide, unit: int) -> int:
    """A bank with nothing but loads; returns the lanes that have rarer connections."""
    in_wye = in_delta = low_delta = 0
    for lane in range(WIDTH):
        connection = state.connection[unit, wide.scenario[lane]]
        in_wye |= int(connection == YG_YG) << lane
        in_delta |= int(connection == D_YG) << lane
        low_delta |= int(connection == YG_D) << lane
    zh, zl, y0 = tree.unit_zh_ohm[unit], tree.unit_zl_ohm[unit], tree.unit_y0_s[unit]
    across = load_triple(wide.unit_y, unit)
    if in_wye:
        hang(tree, wide, unit, in_wye, wye_wye(zh, zl, y0, across))
    if in_delta:
        hang(tree, wide, unit, in_delta, delta_wye(zh + zl, across))
    if low_delta:
        hang(tree, wide, unit, low_delta, wye_delta(zh + zl, across))
    return ALL & ~(in_wye | in_delta | low_delta)


@compiled
def hang(tree: Tree, wide: Wide, unit: int, bits: int, found: tuple[Matrix, Matrix]) -> None:
    """Put a bank's shunt and windings in the lanes of ``bits``."""
    mask, node = mask_of(bits), tree.unit_node[unit]
    add_matrix(wide.y, node, chosen(mask, found[0], ZERO))
    store_matrix(wide.g, unit, chosen(mask, found[1], load_matrix(wide.g, unit)))


@compiled
def hang_apart(
    tree: Tree, state: State, wide: Wide, work: Work, lane: int, floor_pu: float
) -> None:
    """The banks of one scenario that have machines, magnetizing branches or rarer windings."""
    s = wide.scenario[lane]
    plain, connections = tree.unit_plain, state.connection
    unit_y, node = work.unit_y, tree.unit_node
    for unit in range(plain.size):
        if plain[unit] and connections[unit, s] <= YG_D:
            continue
        store(unit_y, unit, ZERO)
        store_vector(work.unit_j, unit, (0j, 0j, 0j))
        for i in range(3):
            unit_y[unit, i, i] = complex(
                wide.unit_y[unit, 2 * i, lane], wide.unit_y[unit, 2 * i + 1, lane]
            )
        for i in range(4):
            work.winding_v_pu[4 * unit + i] = wide.winding_v_pu[4 * unit + i, lane]
    for m in range(tree.machine_unit.size):
        add_machine(tree, state, work, m, s, floor_pu)
    for unit in range(plain.size):
        if plain[unit] and connections[unit, s] <= YG_D:
            continue
        store(work.y, node[unit], ZERO)
        store_vector(work.y_j, node[unit], (0j, 0j, 0j))
        hang_bank(tree, work, unit, connections[unit, s])
        for i in range(9):
            row, column = i // 3, i % 3
            add_in_lane(wide.y, node[unit], i, lane, work.y[node[unit], row, column])
            put_in_lane(wide.g, unit, i, lane, work.g[unit, row, column])
        for i in range(3):
            add_in_lane(wide.y_j, node[unit], i, lane, work.y_j[node[unit], i])
            put_in_lane(wide.g_j, unit, i, lane, work.g_j[unit, i])


@compiled
def set_region_shunts(tree: Tree, state: State, wide: Wide, full: bool) -> None:
    """A second step's shunts, and all on the nodes that busy leaps pass by."""
    for lane in range(WIDTH):
        empty_leap(tree, wide, wide.edge[lane])
        empty_leap(tree, wide, wide.far[lane])
    for lane in range(WIDTH):
        far, s = wide.far[lane], wide.scenario[lane]
        if far >= 0 and (full or tree.passed[far] >= 0):
            for i in range(3):
                if not tree.node_phases[far] >> i & 1:
                    continue
                following = (i + 1) % 3
                earth, between = state.far_y_s[i, s], state.far_between_y_s[i, s]
                add_in_lane(wide.y, far, 4 * i, lane, earth + between)
                add_in_lane(wide.y, far, 4 * following, lane, between)
                add_in_lane(wide.y, far, 3 * i + following, lane, -between)
                add_in_lane(wide.y, far, 3 * following + i, lane, -between)


@compiled
def empty_leap(tree: Tree, wide: Wide, node: int) -> None:
    """The fixed shunts on the nodes of the leap that ``node`` is part of."""
    q = -1 if node < 0 else max(tree.passed[node], tree.leap[node])
    if q < 0:
        return
    for n in range(tree.region_from[q], tree.region_from[q + 1]):
        k = tree.region_node[n]
        if tree.passed[k] >= 0:
            store_matrix(wide.y, k, in_lanes(load(tree.shunt_s, k)))
            store_triple(wide.y_j, k, no_vector())
