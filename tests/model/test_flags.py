"""Dead and floating conductors: defined answers and flags, never NaN."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from oracles.random_feeders import random_feeder
from oracles.scenes import Scene, looks, opened, scene

from openphase.detector.evidence import Phasors, evidence_of
from openphase.model import (
    Feeder,
    Line,
    Load,
    Place,
    Point,
    Section,
    Source,
    Switch,
    Transformer,
    make_feeder,
)
from openphase.model.parts import Connection, LoadConnection
from openphase.model.points import into_line
from openphase.model.solver.breaks import DEAD, FLOATING, UNDEFINED
from openphase.model.states import Answer

ONE, TWO, ALL = (0b001, 0b010, 0b100), (0b011, 0b101, 0b110), 0b111
MASKS = (*ONE, *TWO, ALL)


def chain(
    *behind: Connection | LoadConnection, tie: bool = False, unloaded: Sequence[str] = ()
) -> Feeder:
    """B0 - L0 - B1 - L1 - B2; a wye load at B1, and at B2 whatever is named in ``behind``."""
    lines = [
        Line(
            name=f"L{k}",
            from_bus=f"B{k}",
            to_bus=f"B{k + 1}",
            length_km=2.0,
            z1_ohm_per_km=0.1 + 0.3j,
            z0_ohm_per_km=0.3 + 0.9j,
        )
        for k in range(2)
    ]
    b1, b2 = Place(bus="B1"), Place(bus="B2")
    units, loads = [], [load("here", None, b1, "wye")]
    for name in behind:
        if name in ("wye", "delta"):
            loads.append(load(f"direct {name}", None, b2, name))
            continue
        units.append(
            Transformer(
                name=f"unit {name}",
                place=b2,
                connection=name,
                rating_kva=500.0,
                leakage_pu=0.01 + 0.05j,
                x0_pu=1.0 if name == "Yg/Yg" else None,
            )
        )
        if name not in unloaded:
            loads.append(load(f"behind {name}", f"unit {name}", None, "wye"))
    return make_feeder(
        name="chain",
        source=Source(
            bus="B0",
            kv_ll=12.0,
            emf_pu=1.0,
            z1_ohm=0.1 + 0.9j,
            z2_ohm=0.1 + 0.9j,
            z0_ohm=0.1 + 0.9j,
            frequency_hz=60.0,
        ),
        lines=lines,
        transformers=units,
        loads=loads,
        switches=[Switch(name="TIE", from_bus="B2", to_bus="B0", closed=False)] if tie else [],
        points=[Point(name="P0", bus="B0", line="L0"), Point(name="P1", bus="B2", line="L1")],
        sections=[Section(local="P0", remote="P1")],
    )


def load(name: str, unit: str | None, place: Place | None, connection: LoadConnection) -> Load:
    return Load(
        name=name,
        transformer=unit,
        place=place,
        connection=connection,
        kw=200.0,
        power_factor=0.95,
        exponent=2.0,
    )


def broken(feeder: Feeder, *masks: int, closed: bool = False) -> tuple[Scene, Answer]:
    at = scene(feeder, frozenset({"TIE"}) if closed else None)
    answer = looks(at, opened(at, at.steady, "L1", 0.5, *masks))
    for field in (answer.v, answer.i, answer.stub):
        assert np.isfinite(field).all()
    return at, answer


def kinds(answer: Answer) -> np.ndarray:
    """(S,) the flags without those of single phases."""
    return answer.flags & (UNDEFINED - 1)


def undefined(answer: Answer) -> np.ndarray:
    """(3, S) the phase is flagged to have no voltage of its own beyond the break."""
    return np.array([answer.flags & UNDEFINED << phase for phase in range(3)]) > 0


def below_v(at: Scene, answer: Answer) -> np.ndarray:
    """(3, S) at B2, and the same at the lower stub, where nothing flows between them."""
    return answer.v[at.network.node("B2")]


def is_open(masks: Sequence[int]) -> np.ndarray:
    """(3, S) the phase is open."""
    return np.array([[mask >> phase & 1 for mask in masks] for phase in range(3)], bool)


def test_an_empty_stub_is_dead_and_has_no_voltage_on_the_open_phases() -> None:
    at, answer = broken(chain(), *MASKS)
    assert (kinds(answer) == DEAD).all()
    assert (undefined(answer) == is_open(MASKS)).all()
    wanted = np.where(is_open(MASKS), 0.0, answer.stub[0])
    assert np.abs(answer.stub[1] - wanted).max() == 0.0
    assert np.abs(below_v(at, answer) - wanted).max() < 1e-9
    assert np.abs(answer.stub[0]).min() > 6000.0
    edge = at.network.node("B2")
    assert np.abs(answer.i[2 * edge : 2 * edge + 2]).max() == 0.0


@pytest.mark.parametrize("behind", ["Yg/Yg", "D/Yg", "Yg/D", "wye", "delta"])
def test_a_radial_tail_is_dead_with_three_phases_open(behind: Connection | LoadConnection) -> None:
    at, answer = broken(chain(behind), ALL)
    assert answer.flags[0] & DEAD
    assert np.abs(below_v(at, answer)).max() == 0.0
    assert np.abs(answer.stub[1]).max() == 0.0


@pytest.mark.parametrize("behind", ["D/Yg", "Y/D", "D/D", "delta"])
def test_an_island_between_phases_floats_with_three_phases_open_only(
    behind: Connection | LoadConnection,
) -> None:
    """With two open, the whole phase holds it: all three stand at that phase's voltage."""
    at, answer = broken(chain(behind), *MASKS)
    assert (answer.flags[:6] == 0).all()
    assert kinds(answer)[6] == DEAD | FLOATING
    assert undefined(answer)[:, 6].any()
    for s, mask in enumerate(TWO, start=3):
        whole = next(phase for phase in range(3) if not mask >> phase & 1)
        v = below_v(at, answer)[:, s]
        assert np.abs(v - answer.stub[0, whole, s]).max() < 1e-6
        assert np.abs(answer.i[2 * at.network.node("B2"), :, s]).max() < 1e-9
    for s, mask in enumerate(ONE):
        phase = mask.bit_length() - 1
        others = answer.stub[1, [x for x in range(3) if x != phase], s]
        assert (
            abs(answer.stub[1, phase, s] - others.mean()) < 1.0
        )  # the middle, bar the line's drop


@pytest.mark.parametrize("behind", ["Yg/Yg", "Yg/D", "wye"])
@pytest.mark.parametrize("more", [(), ("D/Yg",)], ids=["alone", "with D/Yg"])
def test_an_island_with_a_way_to_earth_does_not_float(
    behind: Connection | LoadConnection, more: tuple[Connection, ...]
) -> None:
    _, answer = broken(chain(behind, *more), *MASKS)
    assert (answer.flags[:6] == 0).all()
    assert answer.flags[6] & FLOATING == 0
    assert answer.flags[6] & DEAD


def test_an_unloaded_yg_yg_unit_holds_three_phases_by_their_sum_only() -> None:
    """Its zero-sequence branch is all there is: a second open phase has nothing to hold it."""
    _, answer = broken(chain("Yg/Yg", unloaded=["Yg/Yg"]), *MASKS)
    assert (answer.flags[:3] == 0).all()
    assert (kinds(answer)[3:6] == FLOATING).all()
    # only the sum of the two opened phases is held, so neither has a voltage of its own
    assert (undefined(answer)[:, 3:6].sum(axis=0) == 2).all()
    # one open: the three voltages add up to zero, full back-feed
    assert np.abs(answer.stub[1, :, :3].sum(axis=0)).max() < 1e-6 * 6928
    _, answer = broken(chain("Yg/D", unloaded=["Yg/D"]), *MASKS)
    assert (answer.flags[:3] == 0).all()
    assert np.abs(answer.stub[1, :, :3].sum(axis=0)).max() < 30.0
    assert (kinds(answer)[3:6] == FLOATING).all()


@pytest.mark.parametrize("connection", ["D/Yg", "Y/D", "D/D"])
def test_an_unloaded_unit_without_a_neutral_is_an_empty_stub(connection: Connection) -> None:
    """It draws nothing whatever its voltages are, bar the rounding of its leakage."""
    _, answer = broken(chain(connection, unloaded=[connection]), *MASKS)
    assert (kinds(answer) == DEAD).all()
    assert (undefined(answer) == is_open(MASKS)).all()
    assert np.abs(answer.stub[1][is_open(MASKS)]).max() == 0.0


@pytest.mark.parametrize("behind", ["Yg/Yg", "D/Yg", "Yg/D", "wye", "delta"])
def test_a_closed_loop_is_not_dead(behind: Connection | LoadConnection) -> None:
    at, answer = broken(chain(behind, tie=True), *MASKS, closed=True)
    assert (answer.flags == 0).all()
    assert np.abs(below_v(at, answer)).min() > 6000.0
    open_i = answer.i[2 * (len(at.network.pieces) - 1), :, 6]
    assert np.abs(open_i).max() < 1e-9 or at.network.pieces[-1].line != "L1"


def test_nothing_is_ever_nan_and_evidence_says_blocked() -> None:
    """Random feeders, every mask at random places, with voltage-dependent loads."""
    flagged = 0
    for seed in range(40):
        rng = np.random.default_rng([seed, 101])
        at = scene(random_feeder(rng, int(rng.integers(1, 7)), with_tie=seed % 2 == 0))
        before = looks(at, at.states(len(MASKS)))
        line = at.feeder.lines[int(rng.integers(len(at.feeder.lines)))].name
        answer = looks(at, opened(at, at.steady, line, float(rng.uniform(0, 1)), *MASKS))
        for field in (answer.v, answer.i, answer.stub, answer.winding_v_pu):
            assert np.isfinite(field).all()
        flagged += int((answer.flags != 0).sum())
        points = at.points
        rows = 2 * points.edge + points.below
        sign = into_line(points)[:, None, None]
        phasors = Phasors(
            v=np.stack([before.v[points.node], answer.v[points.node]]),
            i=np.stack([sign * before.i[rows], sign * answer.i[rows]]),
        )
        evidence = evidence_of(phasors, points.terminals, at.network.tree.v_nominal_v)
        for values in (evidence.di1_a, evidence.dv1_pu, evidence.z1_ohm):
            assert np.isfinite(values).all()
        for t, terminal in enumerate(points.terminals):
            ends = np.abs(answer.v[points.node[[terminal.local_point, terminal.remote_point]]])
            dead = (ends.max(axis=1) == 0.0).any(axis=0)
            assert evidence.blocked[t][dead].all()
    assert flagged > 40
