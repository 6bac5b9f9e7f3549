"""Where events stand, and on which phases, where a feeder has laterals and several voltages.

    S =T69= H - A - B =REG= C - D =TLV= L - L2     points M1 A, M2 B, M3 C, M4 D
                |   |       |
                a   bc     TMV E - E2                  laterals of phase a, of b and c

69 kV before T69, 12.47 kV behind it, 4.16 kV behind TMV, 0.48 kV behind TLV.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from openphase.model.events.phases import count_phases
from openphase.model.events.shunts import spot_on
from openphase.model.network import compile_network
from openphase.model.parts import (
    Capacitor,
    Feeder,
    InlineTransformer,
    Line,
    Load,
    Place,
    Point,
    Regulator,
    Section,
    Source,
)
from openphase.model.sides import Side
from openphase.model.states import BY_LAW, NOT_CONVERGED
from openphase.studies.run.cases import Case, make_case
from openphase.studies.run.classes import DrawClass, Purpose
from openphase.studies.run.draw import BlockId, Scenarios, draw_scenarios
from openphase.studies.run.engine import observe
from openphase.studies.spec.study_file import LoadDraw, Study

SIZE = 400

LINES = {
    "head": ("H", "A", "abc", 1.0),
    "trunk": ("A", "B", "abc", 2.0),
    "beyond": ("C", "D", "abc", 1.0),
    "lateral a": ("A", "AA", "a", 6.0),
    "lateral bc": ("B", "BB", "bc", 5.0),
    "stepped down": ("E", "E2", "abc", 1.0),
    "low": ("L", "L2", "abc", 0.1),
}
LOADS = {"D": "abc", "AA": "a", "BB": "bc", "E2": "abc", "L2": "abc"}


def transformer(name: str, ends: tuple[str, str], kv: tuple[float, float]) -> InlineTransformer:
    return InlineTransformer(
        name=name,
        from_bus=ends[0],
        to_bus=ends[1],
        connection="D/Yg" if name == "T69" else "Yg/Yg",
        rating_kva=5000.0 if name == "T69" else 500.0,
        kv_from=kv[0],
        kv_to=kv[1],
        leakage_pu=0.01 + 0.06j,
    )


def mixed() -> Feeder:
    return Feeder(
        name="mixed",
        source=Source(
            bus="S",
            kv_ll=69.0,
            emf_pu=1.02,
            z1_ohm=0.5 + 5.0j,
            z2_ohm=0.5 + 5.0j,
            z0_ohm=0.5 + 5.0j,
            frequency_hz=60.0,
        ),
        lines=tuple(
            Line(
                name=name,
                from_bus=start,
                to_bus=end,
                phases=phases,
                length_km=km,
                z1_ohm_per_km=0.3 + 0.4j,
                z0_ohm_per_km=0.6 + 1.2j,
            )
            for name, (start, end, phases, km) in LINES.items()
        ),
        transformers=(),
        loads=tuple(
            Load(
                name=f"at {bus}",
                transformer=None,
                place=Place(bus=bus),
                connection="wye",
                phases=phases,
                kw=100.0 * len(phases),
                power_factor=0.95,
                exponent=0.0,
                zip=(0.4, 0.3, 0.3, 0.5, 0.5, 0.0) if bus == "D" else None,
            )
            for bus, phases in LOADS.items()
        ),
        switches=(),
        points=(
            Point(name="M1", bus="A", line="trunk"),
            Point(name="M2", bus="B", line="trunk"),
            Point(name="M3", bus="C", line="beyond"),
            Point(name="M4", bus="D", line="beyond"),
        ),
        sections=(Section(local="M1", remote="M2"), Section(local="M3", remote="M4")),
        capacitors=(Capacitor(name="bank", place=Place(bus="D"), connection="wye", kvar=100.0),),
        regulators=(
            Regulator(
                name="REG",
                from_bus="B",
                to_bus="C",
                taps=(3, 0, -2),
                step_pct=0.625,
                most_taps=16,
                phases="ac",
                reference="b",
            ),
        ),
        inline_transformers=(
            transformer("T69", ("S", "H"), (69.0, 12.47)),
            transformer("TMV", ("C", "E"), (12.47, 4.16)),
            transformer("TLV", ("D", "L"), (12.47, 0.48)),
        ),
    )


@cache
def case_of(exponent: str = "") -> Case:
    loads = LoadDraw(exponent="file") if exponent == "file" else LoadDraw()
    return make_case(mixed(), Study(loads=loads))


@cache
def drawn(own: DrawClass) -> Scenarios:
    case = case_of()
    return draw_scenarios(case, which(own), SIZE)


def which(own: DrawClass) -> BlockId:
    return BlockId(seed=4, purpose=Purpose.TRAIN, attempt=1, drawn=own, block=0)


def lines_of(edges: np.ndarray) -> set[str]:
    pieces = [case_of().network.pieces[int(k)] for k in np.unique(edges[edges >= 0])]
    return {str(piece.line) for piece in pieces if piece is not None}


THREE = {"head", "trunk", "beyond", "stepped down"}
TWO = THREE | {"lateral bc"}
ALL = TWO | {"lateral a"}
NEEDS = {
    DrawClass.OPEN_THREE: THREE,
    DrawClass.CAPACITOR_STEP: THREE,
    DrawClass.MOTOR_START: THREE,
    DrawClass.LINE_FAULT: TWO,
}
ON_LINES = [
    own for own in case_of().drawn if own not in (DrawClass.SOURCE_STEP, DrawClass.REGULATOR_TAP)
]


@pytest.mark.parametrize("own", ON_LINES)
def test_events_stand_on_medium_voltage_lines_that_have_their_phases(own: DrawClass) -> None:
    event = drawn(own).event
    assert lines_of(event.edge) == NEEDS.get(own, ALL)
    network = case_of().network
    far = event.far_node[event.far_node >= 0]
    assert (network.node_v[far] > 2000.0).all()


@pytest.mark.parametrize("own", ON_LINES)
def test_nothing_happens_to_a_phase_that_is_not_there(own: DrawClass) -> None:
    event, network = drawn(own).event, case_of().network
    places = [(network.tree.phases[event.edge], event.edge >= 0, "")]
    if (event.far_node >= 0).any():
        there = network.node_phases[event.far_node]
        places.append((there, event.far_node >= 0, "far_"))
    for there, stands, far in places:
        absent = ~(there >> np.arange(3)[:, None] & 1 > 0) & stands
        torn = absent | np.roll(absent, -1, axis=0)  # pairs with an absent end
        for when in ("before", "after"):
            earth = getattr(event, f"{far}{'' if far else 'earth_'}{when}_s")
            assert not earth[absent].any()
            assert not getattr(event, f"{far}between_{when}_s")[torn].any()
    masks = np.where(event.edge >= 0, network.tree.phases[event.edge], 0)
    assert not (event.open_before & ~masks).any()
    assert not (event.open_after & ~masks).any()


def test_a_part_and_its_laterals_are_drawn_for_breaks_however_short() -> None:
    scenarios = drawn(DrawClass.OPEN_PHASE)
    case = case_of()
    _, counts = np.unique(
        np.stack([t.edge_side[scenarios.event.edge] for t in case.points.terminals[::2]]),
        axis=1,
        return_counts=True,
    )
    assert counts.size == len(case.places[1].alike)
    share = 1.0 / counts.size
    assert (np.abs(counts / SIZE - share) < 5.0 * np.sqrt(share * (1 - share) / SIZE)).all()


def test_energising_closes_all_phases_of_the_line() -> None:
    event = drawn(DrawClass.ENERGISATION).event
    np.testing.assert_array_equal(event.open_before, case_of().network.tree.phases[event.edge])
    assert set(count_phases(event.open_before).tolist()) == {1, 2, 3}


def test_only_phases_with_a_unit_change_their_taps() -> None:
    factor = drawn(DrawClass.REGULATOR_TAP).event.tap_factor
    assert (factor[:, 1] == 1.0).all()
    moved = (factor[0] != 1.0).sum(axis=0)
    assert set(moved.tolist()) == {1, 2}


def test_steps_are_of_the_nominal_voltage_of_their_place() -> None:
    event, case = drawn(DrawClass.CAPACITOR_STEP).event, case_of()
    y = event.earth_before_s + event.earth_after_s
    y += 3.0 * (event.between_before_s + event.between_after_s)
    kvar = y[0].imag * case.network.node_v[event.edge] ** 2 * 3.0 / 1000.0
    sizes = set(case.study.events.capacitor_step.kvar.values)  # type: ignore[attr-defined]
    assert {round(float(own), 6) for own in kvar} == sizes
    assert lines_of(event.edge) == THREE


@pytest.mark.parametrize("own", [*ON_LINES, DrawClass.SOURCE_STEP, DrawClass.REGULATOR_TAP])
def test_every_class_can_be_solved_and_judged(own: DrawClass) -> None:
    case = case_of()
    seen = observe(case, drawn(own), case.study.detector.options())
    assert not (seen.flags & NOT_CONVERGED).any()
    assert np.isfinite(seen.evidence.di_a).all()
    assert np.isfinite(seen.evidence.dv_pu).all()


def test_v_set_is_of_the_voltage_at_the_points_and_not_of_the_source() -> None:
    case = case_of()
    np.testing.assert_allclose(case.points.v_nominal_v, 12470.0 / 3.0**0.5)
    seen = observe(case, drawn(DrawClass.SOURCE_STEP), case.study.detector.options())
    # a step of up to 5 % is one at every point, but for what loads and errors add
    change = np.abs(drawn(DrawClass.SOURCE_STEP).event.emf_factor - 1.0)
    assert np.abs(seen.evidence.dv1_pu - change).max() < 0.02
    assert not seen.evidence.blocked.any()


def test_loads_follow_their_own_law_if_the_study_says_file() -> None:
    case, usual = case_of("file"), case_of()
    own, drawn_ones = (draw_scenarios(c, which(DrawClass.LOAD_STEP), SIZE) for c in (case, usual))
    assert (own.before.exponent == BY_LAW).all()
    # nothing else is drawn differently
    np.testing.assert_array_equal(own.before.load_scale, drawn_ones.before.load_scale)
    np.testing.assert_array_equal(own.event.edge, drawn_ones.event.edge)
    assert not (observe(case, own).flags & NOT_CONVERGED).any()


def test_sides_of_equipment_behind_transformers() -> None:
    case = case_of()
    first, second = case.points.terminals[::2]
    sides = {
        str(piece.line): (Side(first.edge_side[k]), Side(second.edge_side[k]))
        for k, piece in enumerate(case.network.pieces)
        if piece is not None and piece.line is not None
    }
    assert sides["head"] == (Side.UPSTREAM, Side.UPSTREAM)
    assert sides["trunk"] == (Side.PATH, Side.UPSTREAM)
    assert sides["lateral a"] == (Side.UPSTREAM, Side.UPSTREAM)
    assert sides["lateral bc"] == (Side.DOWNSTREAM, Side.UPSTREAM)
    assert sides["beyond"] == (Side.DOWNSTREAM, Side.PATH)
    assert sides["stepped down"] == (Side.DOWNSTREAM, Side.UPSTREAM)
    assert sides["low"] == (Side.DOWNSTREAM, Side.DOWNSTREAM)


def test_behind_a_delta_loads_lie_between_phases() -> None:
    """The feeder of a substation transformer without a neutral on this side."""
    feeder = mixed()
    units = tuple(
        replace(unit, connection="D/D") if unit.name == "T69" else unit
        for unit in feeder.inline_transformers
    )
    loads = tuple(
        replace(own, connection="delta") if own.name == "at D" else own for own in feeder.loads
    )
    delta = replace(feeder, inline_transformers=units, loads=loads, capacitors=())
    network = compile_network(delta)
    lines = {"trunk", "beyond", "lateral a", "lateral bc"}
    neutral = {
        str(piece.line): bool(network.neutral[k])
        for k, piece in enumerate(network.pieces[: len(network.nodes)])
        if piece is not None and piece.line is not None
    }
    assert neutral == {name: name in ("stepped down", "low") for name in LINES}
    edge = np.array([k for k, p in enumerate(network.pieces) if p is not None and p.line in lines])
    spot = spot_on(network, edge)
    np.testing.assert_array_equal(spot.between, count_phases(spot.phases) > 1)
