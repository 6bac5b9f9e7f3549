"""The ladder against the dense reference, over random feeders as real ones are made."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import fields

import numpy as np
import pytest
from oracles.comparison import TOLERANCE, Case, Outcome, compare, outcomes
from oracles.random_happenings import Happening, random_happening
from oracles.random_mixed import random_mixed_feeder

from openphase.model.errors import InputError
from openphase.model.events.base import no_event
from openphase.model.feeder import make_feeder
from openphase.model.network import compile_network
from openphase.model.parts import Feeder
from openphase.model.solve import solve, steady_state

FEEDERS = 250
NONE: frozenset[str] = frozenset()

Sample = dict[int, tuple[Case, list[Outcome]]]


def a_case(seed: int, *, linear: bool = False) -> Case | None:
    """A feeder of up to twenty buses, with up to three loops closed; None: it is refused."""
    rng = np.random.default_rng([seed, 62])
    loops = int(rng.choice([0, 1, 2, 3], p=[0.5, 0.2, 0.15, 0.15]))
    feeder = random_mixed_feeder(rng, int(rng.integers(3, 17)), loops, linear=linear)
    ties = [s.name for s in feeder.switches if not s.closed and rng.random() < 0.75]
    always = [s.name for s in feeder.switches if s.closed]
    opened = _opened(rng, feeder) if loops else NONE
    states = [(count, own) for count in range(len(ties), -1, -1) for own in (opened, NONE)]
    for count, own in states:
        # what the ladder refuses, a loop or a bus without supply, does not come about
        closed = frozenset(always + ties[:count])
        try:
            network = compile_network(feeder, closed, own)
        except InputError:
            continue
        happening = random_happening(rng, feeder, network)
        return Case(feeder=feeder, closed=closed, opened=own, network=network, happening=happening)
    return None


def _opened(rng: np.random.Generator, feeder: Feeder) -> frozenset[str]:
    """Sometimes a point stands open."""
    names = [point.name for point in feeder.points]
    if not names or rng.random() < 0.7:
        return NONE
    return frozenset({names[int(rng.integers(len(names)))]})


def cases(seeds: range) -> Iterator[tuple[int, Case]]:
    for seed in seeds:
        case = a_case(seed)
        if case is not None:
            yield seed, case


@pytest.fixture(scope="module")
def sample() -> Sample:
    """All feeders that are not refused, by seed."""
    return {seed: (case, outcomes(case)) for seed, case in cases(range(FEEDERS))}


def seeds_that(sample: Sample, *how: str) -> list[int]:
    return [seed for seed, (_, found) in sample.items() if any(x.how in how for x in found)]


def test_no_state_differs(sample: Sample) -> None:
    assert not seeds_that(sample, "differ")
    gaps = [x.gap for _, found in sample.values() for x in found if x.how == "agree"]
    assert len(gaps) >= 1.9 * len(sample)
    assert max(gaps) <= TOLERANCE


def test_hardly_any_feeder_is_refused(sample: Sample) -> None:
    assert len(sample) >= 0.95 * FEEDERS


def test_the_feeders_are_such_as_a_file_may_hold(sample: Sample) -> None:
    bare = {"imported_from", "origins"}
    for case, _ in sample.values():
        given = {f.name: getattr(case.feeder, f.name) for f in fields(case.feeder)}
        assert make_feeder(**{k: v for k, v in given.items() if k not in bare}) == case.feeder


def test_the_ladder_settles(sample: Sample) -> None:
    assert not seeds_that(sample, "unsettled")
    assert len(seeds_that(sample, "elsewhere")) <= FEEDERS // 50
    assert len(seeds_that(sample, "reference unsettled")) <= FEEDERS // 50


def test_what_is_undetermined_is_flagged(sample: Sample) -> None:
    states = [x for _, found in sample.values() for x in found]
    floating = [x for x in states if x.floating]
    assert all(x.flagged for x in floating)
    assert len(floating) > FEEDERS // 20


def test_every_part_is_in_the_sample(sample: Sample) -> None:
    seen: Counter[str] = Counter()
    for case, found in sample.values():
        if len(found) == 2:
            seen.update(parts_of(case) | case.happening.what)
    rare = {name: seen[name] for name in WANTED if seen[name] < 4}
    assert not rare


WANTED = {
    *("Yg/Yg", "Y/Yg", "Yg/Y", "Y/Y", "D/Yg", "D/Y", "Yg/D", "Y/D", "D/D", "lag", "lead"),
    *("single", "centre-tap", "parallel", "neutral", "fed from its to-side", "taps", "magnetizing"),
    *("reference earth", "reference next", "reference a", "reference b", "reference c", "some"),
    *("phases 1", "phases 2", "code", "branch_kv", "kvar", "zip", "exponent_q", "v_max", "v_low"),
    *("load wye 1", "load wye 2", "load delta 2", "load delta 3", "capacitor 1", "hung", "motors"),
    *("ders", "wires 3", "isolated", "loops 1", "loops 2", "open 1", "open 2", "step", "far"),
    *("earth fault", "line fault", "fallen", "tap", "loads", "opened"),
}


def parts_of(case: Case) -> set[str]:
    """What the feeder is made of."""
    feeder = case.feeder
    found = {f"wires {feeder.source.wires}", feeder.source.neutral, f"loops {loops_of(case)}"}
    found |= {f"phases {len(line.phases)}" for line in feeder.lines}
    found |= {"code" for line in feeder.lines if line.code}
    banks = Counter((own.from_bus, own.to_bus) for own in feeder.inline_transformers)
    found |= {"parallel" for count in banks.values() if count > 1}
    for own in feeder.inline_transformers:
        found |= {own.connection, own.shift} if own.connection in SHIFTED else {own.connection}
        found |= {"taps"} if own.from_tap != own.to_tap else set()
        found |= {"magnetizing"} if own.magnetizing_pu else set()
        found |= {"neutral"} if own.from_neutral_ohm or own.to_neutral_ohm else set()
        found |= {"fed from its to-side"} if own.to_bus in above(case, own.from_bus) else set()
    for regulator in feeder.regulators:
        fewer = len(regulator.phases) < 3 and regulator.reference == "earth"
        found |= {f"reference {regulator.reference}", *(("some",) if fewer else ())}
    for load in feeder.loads:
        found |= {f"load {load.connection} {len(load.phases)}"} if load.place else {"hung"}
        found |= {"branch_kv"} if load.branch_kv else set()
        found |= {"motors"} if load.motor_share else set()
        values = {"kvar": load.kvar, "zip": load.zip, "exponent_q": load.exponent_q}
        values |= {"v_max": load.v_max_pu, "v_low": load.v_low_pu}
        found |= {name for name, value in values.items() if value is not None}
    found |= {f"capacitor {len(bank.phases)}" for bank in feeder.capacitors}
    return found | ({"ders"} if feeder.ders else set()) | ({"opened"} if case.opened else set())


SHIFTED = ("D/Yg", "D/Y", "Yg/D", "Y/D")


def loops_of(case: Case) -> int:
    """Ways round: edges beyond those of a tree, transformers between two buses being one."""
    feeder = case.feeder
    banks = {(own.from_bus, own.to_bus) for own in feeder.inline_transformers}
    edges = len(feeder.lines) + len(case.closed) + len(feeder.regulators) + len(banks)
    buses = {end for own in feeder.lines for end in (own.from_bus, own.to_bus)}
    for part in (*feeder.switches, *feeder.regulators, *feeder.inline_transformers):
        buses |= {part.from_bus, part.to_bus}
    return edges - len(buses) + 1 - len(case.opened)


def above(case: Case, bus: str) -> set[str]:
    """Buses that grew before this one."""
    return {f"B{n}" for n in range(int(bus[1:]))}


@pytest.mark.parametrize("seed", range(30))
def test_nothing_happens_on_a_quiet_feeder(seed: int) -> None:
    """Linear loads, no event: one pass, and the same again."""
    case = a_case(seed + 1000, linear=True)
    if case is None:
        pytest.skip("the network is refused")
    nothing = Happening(event=no_event(case.network, 1), what=frozenset())
    quiet = Case(
        feeder=case.feeder,
        closed=case.closed,
        opened=case.opened,
        network=case.network,
        happening=nothing,
    )
    answer = solve(case.network, steady_state(case.network))
    outcome, _ = compare(quiet, answer, quiet.event(after=False), None, opened=case.opened)
    assert outcome.how == "agree"
