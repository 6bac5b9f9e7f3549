"""Eight scenarios at a time, from loads to phasors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, compiled_door
from ...lanes.functions import bits_of, load_real, mask_of, select, splat, store_real
from ...lanes.kinds import WIDTH
from ...states import NOT_CONVERGED, Answer, Probes, State, Tree, Work
from ..ladder import is_sourced
from ..matrix3 import Vector, plus, times
from ..settle import LEAST_SHARE, is_steady, positive
from .climb import climb, mark_regions
from .descend import descend, lift_neutrals, probe_current
from .rows import (
    Stack,
    chosen_vector,
    load_entry,
    load_matrix,
    load_triple,
    no_vector,
    put_in_lane,
    store_entry,
    store_triple,
)
from .settle import see_magnitudes, update_magnitudes
from .shunts import find_demand, set_region_shunts, set_shunts
from .work import ALL, Wide

Int = NDArray[np.int64]
Complex = NDArray[np.complex128]
Real = NDArray[np.float64]

__all__ = ["solve_wide"]

CORRECTED_PASSES = 12  #: what has not settled by then is eliminated in every pass


@compiled_door
def solve_wide(
    tree: Tree,
    state: State,
    probes: Probes,
    wide: Wide,
    work: Work,
    answer: Answer,
    order: Int,
    tolerance_pu: float,
    most_passes: int,
    floor_pu: float,
) -> None:
    """As ``ladder.solve_block``, without loops, for the scenarios in ``order``.

    Those that stand together there share lanes: best ones with their event at the same place. No
    result depends on it.
    """
    sourced = is_sourced(tree)
    for at in range(0, order.size, WIDTH):
        linear, anew = begin(tree, state, wide, answer, order[at : at + WIDTH])
        mark_regions(tree, wide)
        settled = passes = 0
        while settled != ALL and passes < most_passes:
            passes += 1
            demand = ALL
            if tree.branch_node.size:
                demand = find_demand(tree, wide, floor_pu)
            if passes == 1 or passes > CORRECTED_PASSES:
                demand = ALL
            demand = (demand | anew) & ~settled
            full, fed = demand != 0, sourced or demand != ALL
            wide.demand[0] = demand
            for lane in range(WIDTH):
                if demand >> lane & 1:
                    wide.flags[lane] = 0
            set_shunts(tree, state, wide, work, (demand, full, fed), floor_pu)
            set_region_shunts(tree, state, wide, full)
            climb(tree, wide, full, fed, floor_pu)
            set_emf(tree, wide)
            if tree.lifted:
                lift_neutrals(tree, wide, fed)
            descend(tree, wide, fed)
            found = linear & ~settled
            if found:
                see_magnitudes(tree, wide, found)
            if (settled | found) != ALL:
                more = update_magnitudes(tree, wide, settled | found, passes, tolerance_pu)
                found |= more & ~settled
            if passes == most_passes:
                for lane in range(WIDTH):
                    if not (settled | found) >> lane & 1:
                        wide.flags[lane] |= NOT_CONVERGED
                found = ALL & ~settled
            if found:
                keep(tree, probes, wide, (found, passes, fed))
            settled |= found
        write(wide, answer)


@compiled
def begin(tree: Tree, state: State, wide: Wide, answer: Answer, chosen: Int) -> tuple[int, int]:
    """Put eight scenarios in lanes; returns the bits of those in which nothing follows a voltage.

    And of those that are eliminated in every pass: steps that follow the voltage are, and all
    where banks or machines stand on the nodes.
    """
    scenario, last = wide.scenario, chosen.size - 1
    for lane in range(WIDTH):
        scenario[lane] = chosen[min(lane, last)]
    gather(state.load_scale, scenario, wide.load_scale)
    gather(state.exponent, scenario, wide.exponent)
    gather(answer.winding_v_pu, scenario, wide.winding_v_pu)
    for n in range(wide.winding_v_pu.shape[0]):
        store_real(wide.history, (0, n, 0), splat(0.0))
        store_real(wide.history, (1, n, 0), splat(0.0))
    store_real(wide.follows, (0, 0), splat(LEAST_SHARE))
    linear = linear_loads(tree, wide)
    anew = ALL if tree.unit_node.size else 0
    for lane in range(WIDTH):
        s = scenario[lane]
        wide.emf_pu[0, lane] = state.emf_pu[s]
        for n in range(tree.reference.shape[0]):
            for i in range(3):
                wide.ratio[n, i, lane] = state.ratio[n, i, s]
        linear &= ~(int(not is_steady(state, s)) << lane)
        if state.edge[s] >= 0 and state.step_exponent[s] != 2.0:
            anew |= 1 << lane
        place_event(state, wide, lane, s)
    for side in range(2):
        store_triple(wide.stub, side, no_vector())
    return linear, anew


@compiled
def side_by_side(scenario: Int) -> bool:
    """Whether the lanes have scenarios that follow one another."""
    following = True
    for lane in range(1, WIDTH):
        following &= scenario[lane] == scenario[lane - 1] + 1
    return following


@compiled
def gather(given: Real, scenario: Int, out: Real) -> None:
    """Some columns of (N, S) into lanes (N, WIDTH)."""
    if side_by_side(scenario):
        for n in range(out.shape[0]):
            store_real(out, (n, 0), load_real(given, (n, scenario[0])))
    else:
        for n in range(out.shape[0]):
            for lane in range(WIDTH):
                out[n, lane] = given[n, scenario[lane]]


@compiled
def place_event(state: State, wide: Wide, lane: int, s: int) -> None:
    """What happens in scenario s, into a lane."""
    edge = state.edge[s]
    wide.edge[lane], wide.far[lane] = edge, state.far_node[s]
    wide.share[0, lane] = state.share[s]
    wide.step_power[0, lane] = state.step_exponent[s] - 2.0
    for i in range(3):
        wide.opened[i] &= ~(1 << lane)
        if edge >= 0:
            wide.opened[i] |= (state.open_mask[s] >> i & 1) << lane
            put_in_lane(wide.step_y, 0, i, lane, state.step_y_s[i, s])
            put_in_lane(wide.between_y, 0, i, lane, state.between_y_s[i, s])
            put_in_lane(wide.fallen_y, 0, i, lane, state.fallen_y_s[i, s])


@compiled
def linear_loads(tree: Tree, wide: Wide) -> int:
    """The bits of the lanes whose loads are all constant impedance."""
    linear = ALL
    for n in range(tree.load_unit.size):
        exponent = load_real(wide.exponent, (n, 0))
        plain = exponent == 2.0
        if tree.law_linear[n]:
            plain = plain | (exponent < 0.0)
        linear &= bits_of(plain)
    return linear


@compiled
def set_emf(tree: Tree, wide: Wide) -> None:
    """The last row of V."""
    emf = load_real(wide.emf_pu, (0, 0)) * (tree.v_nominal_v * tree.emf_turn)
    turn = np.exp(-2j * np.pi / 3)
    store_triple(wide.v, wide.y.shape[0], (emf, emf * turn, emf * turn.conjugate()))


@compiled
def keep(tree: Tree, probes: Probes, wide: Wide, which: tuple[int, int, bool]) -> None:
    """Keep what is looked at of some lanes.

    ``which``: their bits, the number of passes, and whether currents were fed in.
    """
    bits, passes, fed = which
    own, v_pu = mask_of(bits), wide.winding_v_pu
    for lane in range(WIDTH):
        if bits >> lane & 1:
            wide.passes[lane] = passes
    for n in range(v_pu.shape[0]):
        value = select(own, load_real(v_pu, (n, 0)), load_real(wide.seen_windings, (n, 0)))
        store_real(wide.seen_windings, (n, 0), value)
    for n in range(probes.v_node.size):
        keep_phasors(wide.seen_v, n, bits, load_triple(wide.v, probes.v_node[n]))
    for n in range(probes.i_edge.size):
        current = probe_current(tree, wide, probes.i_edge[n], probes.i_below[n], fed)
        keep_phasors(wide.seen_i, n, bits, current)
    for side in range(2):
        keep_phasors(wide.seen_stub, side, bits, load_triple(wide.stub, side))
    for m in range(tree.machine_unit.size):
        unit = tree.machine_unit[m]
        windings = times(load_matrix(wide.g, unit), load_triple(wide.v, tree.unit_node[unit]))
        v1 = positive(plus(windings, load_triple(wide.g_j, unit)))
        past = load_entry(wide.seen_machine, m, 0)
        store_entry(wide.seen_machine, m, 0, select(own, v1, past))


@compiled
def keep_phasors(stack: Stack, n: int, bits: int, found: Vector) -> None:
    """Three phases of some lanes into row n."""
    store_triple(stack, n, chosen_vector(mask_of(bits), found, load_triple(stack, n)))


@compiled
def write(wide: Wide, answer: Answer) -> None:
    """Put all lanes into the answer."""
    scenario, v_pu = wide.scenario, wide.seen_windings
    if side_by_side(scenario):
        for n in range(v_pu.shape[0]):
            store_real(answer.winding_v_pu, (n, scenario[0]), load_real(v_pu, (n, 0)))
    else:
        for n in range(v_pu.shape[0]):
            for lane in range(WIDTH):
                answer.winding_v_pu[n, scenario[lane]] = v_pu[n, lane]
    write_phasors(wide.seen_v, scenario, answer.v)
    write_phasors(wide.seen_i, scenario, answer.i)
    write_phasors(wide.seen_stub, scenario, answer.stub)
    seen = wide.seen_machine
    for lane in range(WIDTH):
        s = scenario[lane]
        answer.flags[s], answer.passes[s] = wide.flags[lane], wide.passes[lane]
        for m in range(seen.shape[0]):
            answer.machine_v1_v[m, s] = complex(seen[m, 0, lane] + 0.0, seen[m, 1, lane] + 0.0)


@compiled
def write_phasors(stack: Stack, scenario: Int, out: Complex) -> None:
    """Three phases of all lanes into (m, 3, S).

    Zeros without a sign: it would tell whether neighbours had currents fed in.
    """
    for n in range(out.shape[0]):
        for i in range(3):
            for lane in range(WIDTH):
                value = complex(stack[n, 2 * i, lane] + 0.0, stack[n, 2 * i + 1, lane] + 0.0)
                out[n, i, scenario[lane]] = value
