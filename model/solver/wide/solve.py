"""Eight scenarios at a time, from loads to phasors."""

from __future__ import annotations

import numpy as np

from ...compiled import compiled, compiled_door
from ...lanes import WIDTH, load_real, mask_of, select, splat, store_real
from ...states import NOT_CONVERGED, Answer, Probes, State, Tree, Work
from ..ladder import edge_current, is_sourced
from ..matrix3 import plus, store_vector, times
from ..settle import is_linear, positive
from .climb import climb, mark_regions
from .descend import descend, lift_neutrals, probe_current
from .rows import load_matrix, load_triple, store_triple
from .settle import see_magnitudes, update_magnitudes
from .shunts import find_demand, set_region_shunts, set_shunts
from .work import ALL, Wide, lane_of

__all__ = ["solve_wide"]

CORRECTED_PASSES = 12  #: what has not settled by then is eliminated in every pass


@compiled_door
def solve_wide(
    tree: Tree,
    state: State,
    probes: Probes,
    wide: Wide,
    lanes: Work,
    answer: Answer,
    tolerance_pu: float,
    most_passes: int,
    floor_pu: float,
) -> None:
    """As ``ladder.solve_block``, without loops; S must be a multiple of ``WIDTH``.

    No lane's result depends on what stands in the others.
    """
    sourced = is_sourced(tree)
    windings = wide.winding_v_pu.shape[0]
    for s in range(0, state.emf_pu.size, WIDTH):
        linear, anew = begin(tree, state, wide, lanes, answer, s)
        mark_regions(tree, state, wide, s)
        settled = passes = 0
        while settled != ALL and passes < most_passes:
            passes += 1
            demand = ALL
            if tree.branch_node.size:
                demand = find_demand(tree, state, wide, s, floor_pu)
            if passes == 1 or passes > CORRECTED_PASSES:
                demand = ALL
            demand = (demand | anew) & ~settled
            full, fed = demand != 0, sourced or demand != ALL
            for lane in range(WIDTH):
                if demand >> lane & 1:
                    wide.flags[lane] = 0
            set_shunts(tree, state, wide, lanes, s, (demand, full, fed), floor_pu)
            set_region_shunts(tree, state, wide, lanes, s, full, floor_pu)
            climb(tree, state, wide, lanes, s, (demand, full, fed))
            set_emf(tree, state, wide, s)
            if tree.lifted:
                lift_neutrals(tree, wide, lanes, fed)
            descend(tree, state, wide, lanes, s, fed)
            found = linear & ~settled
            if found:
                see_magnitudes(tree, state, wide, lanes, s, found)
            if (settled | found) != ALL:
                more = update_magnitudes(tree, state, wide, lanes, s, passes, tolerance_pu)
                found |= more & ~settled
            if passes == most_passes:
                for lane in range(WIDTH):
                    if not (settled | found) >> lane & 1:
                        wide.flags[lane] |= NOT_CONVERGED
                found = ALL & ~settled
            if found:
                own = mask_of(found)
                for n in range(windings):
                    past = load_real(answer.winding_v_pu, (n, s))
                    value = select(own, load_real(wide.winding_v_pu, (n, 0)), past)
                    store_real(answer.winding_v_pu, (n, s), value)
                write(tree, state, probes, wide, lanes, answer, s, (found, passes, fed))
            settled |= found


@compiled
def begin(
    tree: Tree, state: State, wide: Wide, lanes: Work, answer: Answer, s: int
) -> tuple[int, int]:
    """Start eight scenarios; returns the bits of the linear ones, and of those that are
    eliminated in every pass.

    Steps that follow the voltage are, and all where banks or machines stand on the nodes.
    """
    linear = anew = 0
    for lane in range(WIDTH):
        linear |= int(is_linear(tree, state, s + lane)) << lane
        steady = state.edge[s + lane] < 0 or state.step_exponent[s + lane] == 2.0
        anew |= int(not steady or tree.unit_node.size > 0) << lane
        store_vector(lanes.stub[lane], 0, (0j, 0j, 0j))
        store_vector(lanes.stub[lane], 1, (0j, 0j, 0j))
    for n in range(wide.winding_v_pu.shape[0]):
        store_real(wide.winding_v_pu, (n, 0), load_real(answer.winding_v_pu, (n, s)))
        store_real(wide.history, (0, n, 0), splat(0.0))
        store_real(wide.history, (1, n, 0), splat(0.0))
    return linear, anew


@compiled
def set_emf(tree: Tree, state: State, wide: Wide, s: int) -> None:
    """The last row of V."""
    emf = load_real(state.emf_pu, (s,)) * (tree.v_nominal_v * tree.emf_turn)
    turn = np.exp(-2j * np.pi / 3)
    store_triple(wide.v, wide.y.shape[0], (emf, emf * turn, emf * turn.conjugate()))


@compiled
def write(
    tree: Tree,
    state: State,
    probes: Probes,
    wide: Wide,
    lanes: Work,
    answer: Answer,
    s: int,
    which: tuple[int, int, bool],
) -> None:
    """Put the phasors of some lanes into the answer.

    ``which``: their bits, the number of passes, and whether currents were fed in.
    """
    bits, passes, fed = which
    v_node, i_edge, i_below = probes.v_node, probes.i_edge, probes.i_below
    v, current = wide.v, wide.current
    for n in range(i_edge.size):
        store_triple(current, 0, probe_current(tree, wide, i_edge[n], i_below[n], fed))
        for lane in range(WIDTH):
            if bits >> lane & 1:
                for i in range(3):
                    answer.i[n, i, s + lane] = complex(
                        current[0, 2 * i, lane], current[0, 2 * i + 1, lane]
                    )
                if state.edge[s + lane] == i_edge[n]:
                    work = lane_of(lanes, lane)
                    own = edge_current(tree, state, work, s + lane, (i_edge[n], i_below[n], True))
                    for i in range(3):
                        answer.i[n, i, s + lane] = own[i]
    for m in range(tree.machine_unit.size):
        unit = tree.machine_unit[m]
        windings = times(load_matrix(wide.g, unit), load_triple(v, tree.unit_node[unit]))
        v1 = positive(plus(windings, load_triple(wide.g_j, unit)))
        store_triple(current, 0, (v1, v1, v1))
        for lane in range(WIDTH):
            if bits >> lane & 1:
                answer.machine_v1_v[m, s + lane] = complex(current[0, 0, lane], current[0, 1, lane])
    for lane in range(WIDTH):
        if bits >> lane & 1:
            answer.flags[s + lane] = wide.flags[lane]
            answer.passes[s + lane] = passes
            for i in range(3):
                answer.stub[0, i, s + lane] = lanes.stub[lane, 0, i]
                answer.stub[1, i, s + lane] = lanes.stub[lane, 1, i]
                for n in range(v_node.size):
                    k = v_node[n]
                    answer.v[n, i, s + lane] = complex(v[k, 2 * i, lane], v[k, 2 * i + 1, lane])
