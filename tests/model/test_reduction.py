"""Folded feeders against the whole ones, both solved by the dense oracle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracles.dense import solve_dense

from openphase.model.parts import (
    Feeder,
    InlineTransformer,
    Line,
    LineCode,
    Load,
    Place,
    Source,
)
from openphase.model.reduction.fold import LEVEL, fold

SOURCE = Source(
    bus="s",
    kv_ll=4.16,
    emf_pu=1.02,
    z1_ohm=0.1 + 0.5j,
    z2_ohm=0.1 + 0.5j,
    z0_ohm=0.2 + 0.7j,
    frequency_hz=60.0,
)
CODES = (
    LineCode(
        name="three",
        r_ohm_per_km=((0.3, 0.1, 0.1), (0.1, 0.3, 0.1), (0.1, 0.1, 0.3)),
        x_ohm_per_km=((0.8, 0.35, 0.3), (0.35, 0.8, 0.33), (0.3, 0.33, 0.8)),
        c_nf_per_km=((10.0, -2.0, -1.0), (-2.0, 10.0, -1.5), (-1.0, -1.5, 10.0)),
    ),
    LineCode(
        name="two",
        r_ohm_per_km=((0.8, 0.1), (0.1, 0.8)),
        x_ohm_per_km=((0.8, 0.3), (0.3, 0.8)),
        c_nf_per_km=((8.0, -1.0), (-1.0, 8.0)),
    ),
    LineCode(name="one", r_ohm_per_km=((0.8,),), x_ohm_per_km=((0.8,),), c_nf_per_km=((8.0,),)),
)
TRUNK = ("s", "t1", "t2")


def line(start: str, end: str, phases: str, km: float) -> Line:
    code = {1: "one", 2: "two", 3: "three"}[len(phases)]
    name = f"{start}-{end}"
    return Line(name=name, from_bus=start, to_bus=end, length_km=km, phases=phases, code=code)


def service(bus: str, phase: str) -> InlineTransformer:
    return InlineTransformer(
        name=f"T{bus}",
        from_bus=bus,
        to_bus=f"{bus}.lv",
        connection="centre-tap",
        rating_kva=50.0,
        kv_from=2.4,
        kv_to=0.24,
        leakage_pu=0.006 + 0.01j,
        leg_leakage_pu=0.012 + 0.01j,
        magnetizing_pu=0.002 - 0.005j,
        phases=phase,
        to_phases="ab",
    )


def load(bus: str, kw: float, exponent: float, **values: object) -> Load:
    base = Load(
        name=f"load {bus}",
        transformer=None,
        place=Place(bus=bus),
        connection="wye",
        kw=kw,
        power_factor=0.9,
        exponent=exponent,
    )
    return replace(base, **values)


def example(seed: int, *, linear: bool) -> Feeder:
    """A trunk of three buses with laterals of one phase, of two, and service transformers."""
    rng = np.random.default_rng(seed)

    def law() -> float:
        return 2.0 if linear else float(rng.choice([0.0, 0.8, 1.0, 2.0]))

    lines = [line("s", "t1", "abc", 1.0), line("t1", "t2", "abc", 1.0)]
    loads = [load("t2", 300.0, law())]
    units = []
    for phase in "abc":
        before = "t1"
        for step in range(3):
            bus = f"{phase}{step}"
            lines.append(line(before, bus, phase, float(rng.uniform(0.1, 0.5))))
            loads.append(load(bus, float(rng.uniform(10, 40)), law(), phases=phase))
            units.append(service(bus, phase))
            lv = {"phases": "ab", "connection": "delta", "branch_kv": 0.24, "kvar": 5.0}
            loads.append(load(f"{bus}.lv", float(rng.uniform(5, 20)), law(), **lv))
            before = bus
    before = "t2"
    for step in range(3):
        bus = f"ac{step}"
        lines.append(line(before, bus, "ac", float(rng.uniform(0.1, 0.5))))
        how = "wye" if rng.random() < 0.5 else "delta"
        loads.append(load(bus, float(rng.uniform(10, 60)), law(), phases="ac", connection=how))
        before = bus
    return Feeder(
        name="example",
        source=SOURCE,
        lines=tuple(lines),
        transformers=(),
        loads=tuple(loads),
        switches=(),
        points=(),
        sections=(),
        codes=CODES,
        inline_transformers=tuple(units),
    )


def scaled(feeder: Feeder, factor: dict[str, float]) -> Feeder:
    return replace(
        feeder,
        loads=tuple(
            replace(
                each,
                kw=each.kw * factor[each.name],
                kvar=None if each.kvar is None else each.kvar * factor[each.name],
            )
            for each in feeder.loads
        ),
    )


def largest_gap_pu(whole: Feeder, folded: Feeder, factor: dict[str, float]) -> float:
    """Largest difference of a voltage on the trunk."""
    a, b = (solve_dense(scaled(each, factor), frozenset()) for each in (whole, folded))
    gaps = [np.abs(np.asarray(a.v[bus]) - np.asarray(b.v[bus])).max() for bus in TRUNK]
    return max(gaps) / SOURCE.v_phase_v


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("linear", [True, False])
def test_at_its_level_a_fold_is_exact(seed, linear):
    feeder = example(seed, linear=linear)
    factor = dict.fromkeys((each.name for each in feeder.loads), LEVEL)
    # the trunk's own voltages are nominal in the fold; laws bend that a little
    assert largest_gap_pu(feeder, fold(feeder).feeder, factor) < (1e-7 if linear else 3e-6)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("linear", [True, False])
def test_over_the_load_range_it_stays_near(seed, linear):
    feeder = example(seed, linear=linear)
    folded = fold(feeder).feeder
    rng = np.random.default_rng(seed)
    for _ in range(5):
        level = rng.uniform(0.25, 1.0)
        factor = {each.name: level * rng.uniform(0.8, 1.2) for each in feeder.loads}
        assert largest_gap_pu(feeder, folded, factor) < 1e-4


def test_the_lateral_is_there_only_as_far_as_its_loads():
    feeder = example(1, linear=True)
    nothing = dict.fromkeys((each.name for each in feeder.loads), 0.0)
    assert largest_gap_pu(feeder, fold(feeder).feeder, nothing) < 1e-6


def test_loads_at_the_root_itself_miss_more_than_beyond_an_equivalent():
    feeder = example(2, linear=True)
    rng = np.random.default_rng(0)
    factor = {each.name: rng.uniform(0.25, 0.3) for each in feeder.loads}
    rough = largest_gap_pu(feeder, fold(feeder, kinds=("bus",)).feeder, factor)
    fine = largest_gap_pu(feeder, fold(feeder).feeder, factor)
    assert rough > 10.0 * fine


def test_every_load_keeps_its_name_its_order_and_its_law():
    feeder = example(3, linear=False)
    folded = fold(feeder).feeder
    same = ("name", "exponent", "exponent_q", "zip", "v_min_pu", "v_max_pu", "v_low_pu")
    for was, now in zip(feeder.loads, folded.loads, strict=True):
        assert [getattr(was, key) for key in same] == [getattr(now, key) for key in same]


def test_the_account_counts_what_is_gone():
    feeder = example(0, linear=True)
    folded = fold(feeder)
    buses = {bus for each in folded.feeder.lines for bus in (each.from_bus, each.to_bus)}
    buses |= {unit.to_bus for unit in folded.feeder.inline_transformers}
    km = sum(each.length_km for each in feeder.lines)
    assert folded.buses_before == 3 + 3 * 3 * 2 + 3
    assert folded.buses_after == len(buses)
    assert folded.kept == set(TRUNK)
    assert {root.root: root.buses for root in folded.roots} == {"t1": 18, "t2": 3}
    assert sum(root.loads for root in folded.roots) == len(feeder.loads) - 1
    assert sum(each.length_km for each in folded.feeder.lines) == pytest.approx(km)


def test_what_must_be_kept_is():
    feeder = example(0, linear=True)
    folded = fold(feeder, keep=("a1",))
    assert {"a0", "a1"} <= folded.kept
    assert "b1" not in folded.kept


def test_folding_twice_takes_no_further_bus():
    once = fold(example(0, linear=True))
    twice = fold(once.feeder)
    assert twice.buses_after == once.buses_after
    factor = dict.fromkeys((each.name for each in once.feeder.loads), 0.4)
    assert largest_gap_pu(once.feeder, twice.feeder, factor) < 1e-6


def test_a_feeder_of_nothing_but_trunk_is_left_alone():
    feeder = example(0, linear=True)
    trunk = replace(feeder, lines=feeder.lines[:2], loads=feeder.loads[:1], inline_transformers=())
    assert fold(trunk).feeder is trunk


def test_a_reactive_load_alone_is_folded_too():
    feeder = example(0, linear=True)
    alone = tuple(
        replace(each, kw=0.0, kvar=8.0) if each.name == "load a2" else each for each in feeder.loads
    )
    whole = replace(feeder, loads=alone)
    factor = dict.fromkeys((each.name for each in whole.loads), LEVEL)
    assert largest_gap_pu(whole, fold(whole).feeder, factor) < 1e-5
