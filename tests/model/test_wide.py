"""Eight scenarios at a time: each by itself, whatever stands beside it or stood there before."""

from __future__ import annotations

from collections.abc import Iterator
from threading import Thread

import numpy as np
from numpy.typing import NDArray
from oracles.many_scenarios import Scenes, chosen_scenarios, few_probes, scenes_of

from openphase.model.leaps import with_leaps
from openphase.model.machine_state import carried_over
from openphase.model.network import Network
from openphase.model.solve import all_probes, solve
from openphase.model.states import Answer, Probes, State

FEEDERS = 100
RARE = 1178  #: a feeder that shows it where currents drawn at one phase are left behind at another
SCENARIOS = 40

Int = NDArray[np.int64]
Real = NDArray[np.float64]
Problem = tuple[Network, State, Probes, Real | None]


def problems(scenes: Scenes) -> Iterator[Problem]:
    """The states before and after, on the network as it is and with leaps."""
    probes = few_probes(scenes.rng, scenes.network)
    leaping = with_leaps(scenes.network, probes)
    for network, looked_at in ((scenes.network, all_probes(scenes.network)), (leaping, probes)):
        first = solve(network, scenes.before, looked_at)
        after = carried_over(network, scenes.before, first, scenes.after, scenes.der_factor)
        yield network, scenes.before, looked_at, None
        yield network, after, looked_at, first.winding_v_pu


def companies(rng: np.random.Generator) -> list[Int]:
    """Scenarios alone, in sevens, eights and nines, and all of them in another order."""
    alone = list(np.arange(SCENARIOS)[:, None])
    few = [rng.choice(SCENARIOS, size, replace=False) for size in (7, 8, 8, 9)]
    return [*alone, *few, np.arange(3, 11), rng.permutation(SCENARIOS)]


def solved(problem: Problem, chosen: Int) -> Answer:
    """Some scenarios by themselves."""
    network, state, probes, start = problem
    start = None if start is None else np.ascontiguousarray(start[:, chosen])
    return solve(network, chosen_scenarios(state, chosen), probes, start=start)


def unlike(whole: Answer, chosen: Int, found: Answer) -> list[str]:
    """Fields that are not the same to the last bit, of some scenarios and of them alone."""
    return [
        name
        for name, own in whole._asdict().items()
        if own[..., chosen].tobytes() != getattr(found, name).tobytes()
    ]


def test_no_bit_depends_on_the_scenarios_beside():
    everyone = np.arange(SCENARIOS)
    wrong: list[tuple[int, list[str], list[int]]] = []
    seen, leapt, far, linear, machines = 0, 0, 0, 0, 0
    for seed in (*range(FEEDERS), RARE):
        scenes = scenes_of(seed, SCENARIOS)
        if scenes is None:
            continue
        for problem in problems(scenes):
            tree, state = problem[0].tree, problem[1]
            whole = solved(problem, everyone)
            for chosen in [*companies(scenes.rng), everyone]:
                names = unlike(whole, chosen, solved(problem, chosen))
                wrong += [(seed, names, chosen.tolist())] if names else []
            seen += 1
            edges, nodes = (where[where >= 0] for where in (state.edge, state.far_node))
            leapt += int((np.maximum(tree.passed, tree.leap)[edges] >= 0).sum())
            far += int((tree.passed[nodes] >= 0).sum())
            linear += int((whole.passes == 1).sum())
            machines += tree.machine_unit.size > 0
    assert not wrong
    assert seen > 3 * FEEDERS
    assert min(leapt, far, linear) > 5 * FEEDERS
    assert machines > 10


def test_scratch_keeps_nothing():
    """A state has the same answer in a thread that has solved much and in one that has not."""
    for seed in range(FEEDERS):
        scenes = scenes_of(seed, SCENARIOS)
        if scenes is None:
            continue
        for problem in problems(scenes):
            everyone = np.arange(SCENARIOS)
            late, early = everyone[SCENARIOS // 2 :], everyone[: SCENARIOS // 2]
            solved(problem, early)
            again = solved(problem, late)
            fresh: list[Answer] = []
            thread = Thread(target=lambda: fresh.append(solved(problem, late)))  # noqa: B023
            thread.start()
            thread.join()
            assert not unlike(again, np.arange(late.size), fresh[0])
