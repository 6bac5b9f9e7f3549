"""Eight scenarios at a time, from loads to phasors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, compiled_door
from ...lanes import WIDTH, bits_of, load_real, splat, store_real
from ...states import NOT_CONVERGED, Answer, Probes, State, Tree, Work
from ..ladder import edge_current, is_sourced
from ..matrix3 import plus, store_vector, times
from ..settle import is_steady, positive
from .climb import climb, mark_regions
from .descend import descend, lift_neutrals, probe_current
from .rows import load_matrix, load_triple, store_triple
from .settle import see_magnitudes, update_magnitudes
from .shunts import find_demand, set_region_shunts, set_shunts
from .work import ALL, Wide, lane_of

Int = NDArray[np.int64]

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
        linear, anew = begin(tree, state, wide, lanes, answer, order[at : at + WIDTH])
        mark_regions(tree, state, wide)
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
            for lane in range(WIDTH):
                if demand >> lane & 1:
                    wide.flags[lane] = 0
            set_shunts(tree, state, wide, lanes, (demand, full, fed), floor_pu)
            set_region_shunts(tree, state, wide, lanes, full, floor_pu)
            climb(tree, state, wide, lanes, (demand, full, fed))
            set_emf(tree, wide)
            if tree.lifted:
                lift_neutrals(tree, wide, lanes, fed)
            descend(tree, state, wide, lanes, fed)
            found = linear & ~settled
            if found:
                see_magnitudes(tree, state, wide, lanes, found)
            if (settled | found) != ALL:
                more = update_magnitudes(tree, state, wide, lanes, passes, tolerance_pu)
                found |= more & ~settled
            if passes == most_passes:
                for lane in range(WIDTH):
                    if not (settled | found) >> lane & 1:
                        wide.flags[lane] |= NOT_CONVERGED
                found = ALL & ~settled
            if found:
                write(tree, state, probes, wide, lanes, answer, (found, passes, fed))
            settled |= found


@compiled
def begin(
    tree: Tree, state: State, wide: Wide, lanes: Work, answer: Answer, chosen: Int
) -> tuple[int, int]:
    """Put eight scenarios in lanes; returns the bits of those in which nothing follows a voltage.

    And of those that are eliminated in every pass: steps that follow the voltage are, and all
    where banks or machines stand on the nodes.
    """
    scenario, last = wide.scenario, chosen.size - 1
    for lane in range(WIDTH):
        scenario[lane] = chosen[min(lane, last)]
    for n in range(tree.load_unit.size):
        for lane in range(WIDTH):
            wide.load_scale[n, lane] = state.load_scale[n, scenario[lane]]
            wide.exponent[n, lane] = state.exponent[n, scenario[lane]]
    for n in range(wide.winding_v_pu.shape[0]):
        for lane in range(WIDTH):
            wide.winding_v_pu[n, lane] = answer.winding_v_pu[n, scenario[lane]]
        store_real(wide.history, (0, n, 0), splat(0.0))
        store_real(wide.history, (1, n, 0), splat(0.0))
    store_real(wide.follows, (0, 0), splat(0.0))
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
        store_vector(lanes.stub[lane], 0, (0j, 0j, 0j))
        store_vector(lanes.stub[lane], 1, (0j, 0j, 0j))
    return linear, anew


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
def write(
    tree: Tree,
    state: State,
    probes: Probes,
    wide: Wide,
    lanes: Work,
    answer: Answer,
    which: tuple[int, int, bool],
) -> None:
    """Put the phasors of some lanes into the answer.

    ``which``: their bits, the number of passes, and whether currents were fed in.
    """
    bits, passes, fed = which
    v_node, i_edge, i_below = probes.v_node, probes.i_edge, probes.i_below
    v, current = wide.v, wide.current
    for n in range(wide.winding_v_pu.shape[0]):
        for lane in range(WIDTH):
            if bits >> lane & 1:
                answer.winding_v_pu[n, wide.scenario[lane]] = wide.winding_v_pu[n, lane]
    for n in range(i_edge.size):
        store_triple(current, 0, probe_current(tree, wide, i_edge[n], i_below[n], fed))
        for lane in range(WIDTH):
            if bits >> lane & 1:
                s = wide.scenario[lane]
                for i in range(3):
                    answer.i[n, i, s] = complex(
                        current[0, 2 * i, lane], current[0, 2 * i + 1, lane]
                    )
                if state.edge[s] == i_edge[n]:
                    work = lane_of(lanes, lane)
                    own = edge_current(tree, state, work, s, (i_edge[n], i_below[n], True))
                    for i in range(3):
                        answer.i[n, i, s] = own[i]
    for m in range(tree.machine_unit.size):
        unit = tree.machine_unit[m]
        windings = times(load_matrix(wide.g, unit), load_triple(v, tree.unit_node[unit]))
        v1 = positive(plus(windings, load_triple(wide.g_j, unit)))
        store_triple(current, 0, (v1, v1, v1))
        for lane in range(WIDTH):
            if bits >> lane & 1:
                s = wide.scenario[lane]
                answer.machine_v1_v[m, s] = complex(current[0, 0, lane], current[0, 1, lane])
    for lane in range(WIDTH):
        if bits >> lane & 1:
            s = wide.scenario[lane]
            answer.flags[s] = wide.flags[lane]
            answer.passes[s] = passes
            for i in range(3):
                answer.stub[0, i, s] = lanes.stub[lane, 0, i]
                answer.stub[1, i, s] = lanes.stub[lane, 1, i]
                for n in range(v_node.size):
                    k = v_node[n]
                    answer.v[n, i, s] = complex(v[k, 2 * i, lane], v[k, 2 * i + 1, lane])
