"""Phasors of measuring points to the numbers that a terminal decides by."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.scalar_detector import Looks, first_failing, looks_at

from openphase.detector.criteria import Options, Reason, Settings, verdict
from openphase.detector.evidence import (
    DEAD_PU,
    Evidence,
    Phasors,
    evidence_of,
    only,
    reversed_terminals,
)
from openphase.model.points import Terminal

SIZE = 60
ALL = Options(compensated=True, any_sequence=True, direction=True, both_ends="agree")

V_NOMINAL = 7000.0
A = np.exp(2j * np.pi / 3)
POSITIVE = np.array([1.0, A**2, A])
NEGATIVE = POSITIVE.conj()
ZERO = np.ones(3)

Complex = NDArray[np.complex128]


def terminal(local: int, remote: int, into: float = 1.0) -> Terminal:
    return Terminal(
        local=f"P{local}",
        remote=f"P{remote}",
        local_point=local,
        remote_point=remote,
        into=into,
        on_path=np.zeros(0, np.bool_),
        in_section=np.zeros(0, np.bool_),
        load_side=False,
        line_z1_ohm=0j,
        loop_z1_ohm=None,
        edge_side=np.zeros(0, np.int8),
        node_side=np.zeros(1, np.int8),
    )


def phasors(v: object, i: object) -> Phasors:
    """Of (2 frames, P points, 3 phases) each, in one scenario."""
    return Phasors(
        v=np.asarray(v, np.complex128)[..., None], i=np.asarray(i, np.complex128)[..., None]
    )


def random_complex(rng: np.random.Generator, shape: tuple[int, ...]) -> Complex:
    return rng.standard_normal((*shape, 2)).view(np.complex128)[..., 0]


def test_changes_are_of_the_positive_sequence() -> None:
    v0 = 7000.0 * POSITIVE
    v1 = (7000.0 - 140j) * POSITIVE + 300.0 * NEGATIVE + 200.0 * ZERO
    i0 = 50.0 * POSITIVE
    i1 = (50.0 + 3.0 - 4.0j) * POSITIVE + 9.0 * NEGATIVE - 8.0 * ZERO
    seen = phasors([[v0, v0], [v1, v0]], [[i0, i0], [i1, i0]])
    evidence = evidence_of(seen, (terminal(0, 1), terminal(1, 0)), V_NOMINAL)
    np.testing.assert_allclose(evidence.di1_a, [[5.0], [0.0]], atol=1e-12)
    np.testing.assert_allclose(evidence.dv1_pu, [[0.02], [0.0]], atol=1e-14)
    # (dV_L V_R - 0) / (dI V_L - dV_L I), the phasors those of now
    v, dv, di = 7000.0 - 140j, -140j, 3.0 - 4.0j
    expected = dv * 7000.0 / (di * v - dv * (50.0 + di))
    assert evidence.z1_ohm[0, 0] == pytest.approx(expected)
    assert not evidence.undefined[0, 0, 0]


def test_a_sound_line_shows_its_impedance_from_both_ends() -> None:
    """Current flows in at one end and out at the other; the remote point looks away (into -1)."""
    rng = np.random.default_rng(6)
    size, z = 400, 0.3 + 0.8j
    v_m = 7000.0 * (1.0 + 0.05 * random_complex(rng, (2, size)))
    i = 80.0 * random_complex(rng, (2, size))
    v = np.stack([v_m, v_m - z * i], axis=1)  # frame, point, scenario
    both = np.stack([i, i], axis=1)
    seen = Phasors(
        v=v[:, :, None] * POSITIVE[:, None] + 30.0 * NEGATIVE[:, None],
        i=both[:, :, None] * POSITIVE[:, None] + 2.0 * ZERO[:, None],
    )
    evidence = evidence_of(seen, (terminal(0, 1, 1.0), terminal(1, 0, -1.0)), V_NOMINAL)
    np.testing.assert_allclose(evidence.z1_ohm, np.full((2, size), z), rtol=1e-9)
    np.testing.assert_allclose(evidence.di1_a[0], evidence.di1_a[1])


def test_a_sound_line_without_coupling_shows_its_impedance_in_every_phase() -> None:
    rng = np.random.default_rng(6)
    z = np.array([0.3 + 0.8j, 0.2 + 0.5j, 0.4 + 1.1j])[:, None]
    v_m = 7000.0 * (POSITIVE[:, None] + 0.05 * random_complex(rng, (2, 3, SIZE)))
    i = 80.0 * random_complex(rng, (2, 3, SIZE))
    seen = Phasors(v=np.stack([v_m, v_m - z * i], axis=1), i=np.stack([i, i], axis=1))
    evidence = evidence_of(seen, (terminal(0, 1, 1.0), terminal(1, 0, -1.0)), V_NOMINAL)
    for found in evidence.z_ohm[:, 1:]:
        np.testing.assert_allclose(found, np.broadcast_to(z, found.shape), rtol=1e-9)


def test_when_nothing_moves_there_is_no_impedance_and_no_nan() -> None:
    v, i = 7000.0 * POSITIVE, 0.0 * POSITIVE
    evidence = evidence_of(phasors([[v, v]] * 2, [[i, i]] * 2), (terminal(0, 1),), V_NOMINAL)
    assert evidence.undefined.all()
    for number in (evidence.di_a, evidence.dv_pu, evidence.z_ohm):
        assert number.shape == (1, 4, 1)
        assert (number == 0.0).all()


@pytest.mark.parametrize("frame", [0, 1])
@pytest.mark.parametrize("point", [0, 1])
@pytest.mark.parametrize(
    ("pu", "blocked"),
    [
        ((0.0, 0.0, 0.0), True),
        ((0.19, 0.19, 0.19), True),
        ((0.0, 0.0, 0.21), False),  # one living phase is enough: the highest counts
        ((0.21, 0.1, 0.1), False),
        ((0.0, 1.0, 1.0), False),
        ((1.7, 1.7, 0.0), False),  # an isolated earth fault blocks nothing
    ],
)
def test_a_dead_end_blocks_now_and_dt_ago(
    frame: int, point: int, pu: tuple[float, float, float], blocked: bool
) -> None:
    v = np.ones((2, 3, 1)) * POSITIVE * V_NOMINAL
    v = np.broadcast_to(v, (2, 3, 3)).copy()
    v[frame, point] = np.array(pu) * POSITIVE * V_NOMINAL
    terminals = (terminal(0, 1), terminal(1, 0), terminal(2, 1), terminal(0, 2), terminal(2, 0))
    evidence = evidence_of(phasors(v, np.ones((2, 3, 3))), terminals, V_NOMINAL)
    touched = [blocked and point in (t.local_point, t.remote_point) for t in terminals]
    assert evidence.blocked[:, 0].tolist() == touched


def test_balanced_sag_in_each_phase_but_a_full_positive_sequence_is_no_excuse() -> None:
    """Blocking looks at the highest phase, not at |V1|: two open phases must still trip."""
    v = np.broadcast_to(V_NOMINAL * POSITIVE, (2, 2, 3)).copy()
    v[1, 1] = [0.5 * V_NOMINAL, 0.0, 0.0]  # |V1| is 0.17 pu, one phase is at 0.5
    evidence = evidence_of(phasors(v, np.ones((2, 2, 3))), (terminal(0, 1),), V_NOMINAL)
    assert not evidence.blocked.any()


def test_the_threshold_itself_is_alive() -> None:
    v = np.full((2, 2, 3), DEAD_PU * 1000.0)
    assert not evidence_of(phasors(v, v), (terminal(0, 1),), 1000.0).blocked.any()


def test_inputs_stay_as_they_were() -> None:
    rng = np.random.default_rng(7)
    seen = Phasors(v=random_complex(rng, (2, 2, 3, 9)), i=random_complex(rng, (2, 2, 3, 9)))
    v, i = seen.v.copy(), seen.i.copy()
    evidence_of(seen, (terminal(0, 1), terminal(1, 0, -1.0)), 1.0)
    np.testing.assert_array_equal(seen.v, v)
    np.testing.assert_array_equal(seen.i, i)


POINTS = [(0, 1, 1.0), (1, 0, -1.0), (2, 1, -1.0), (1, 2, 1.0)]
"""Local, remote, into: point 1 stands at two sections, and looks into one of them."""


def random_phasors(rng: np.random.Generator) -> Phasors:
    """Changes of every kind; a few ends dead, a few scenarios in which nothing moves."""
    v = V_NOMINAL * (POSITIVE[:, None] + 0.1 * random_complex(rng, (2, 3, 3, SIZE)))
    i = 20.0 * (POSITIVE[:, None] + 0.2 * random_complex(rng, (2, 3, 3, SIZE)))
    v[1, :, :, ::3] = v[0, :, :, ::3] * 0.99 + 3.0 * random_complex(rng, (3, 3, SIZE // 3))
    v[:, 2, :, 7] *= 0.05
    v[1, :, :, 8], i[1, :, :, 8] = v[0, :, :, 8], i[0, :, :, 8]
    return Phasors(v=v, i=i)


def looks(seen: Phasors) -> list[list[Looks]]:
    """Of each of POINTS and each scenario, by hand."""
    back = {(m, n): into for m, n, into in POINTS}
    found = []
    for m, n, into in POINTS:
        pairs = [(x[:, [m, n]].transpose(3, 0, 1, 2)).tolist() for x in (seen.v, seen.i)]
        ends = into, back[n, m]
        found.append([looks_at(v, i, ends, V_NOMINAL) for v, i in zip(*pairs, strict=True)])
    return found


def test_every_quantity_is_the_one_by_hand() -> None:
    seen = random_phasors(np.random.default_rng(21))
    terminals = tuple(terminal(*ends) for ends in POINTS)
    evidence = evidence_of(seen, terminals, V_NOMINAL, ALL)
    for t, row in enumerate(looks(seen)):
        for s, by_hand in enumerate(row):
            for field in fields(Evidence):
                if field.name == "alarm":
                    continue
                found = getattr(evidence, field.name)[t, ..., s]
                expected = np.array(getattr(by_hand, field.name))
                np.testing.assert_allclose(
                    found, expected, rtol=1e-9, atol=1e-9, err_msg=f"{field.name} {t} {s}"
                )


def test_from_phasors_to_verdict_as_by_hand() -> None:
    rng = np.random.default_rng(22)
    seen = random_phasors(rng)
    terminals = tuple(terminal(*ends) for ends in POINTS)
    evidence = evidence_of(seen, terminals, V_NOMINAL, ALL)
    by_hand = looks(seen)
    reasons = set()
    for both_ends in ("off", "no_small_z", "agree"):
        for flags in rng.random((30, 5)) < 0.5:
            options = Options(
                fallback=bool(flags[0]),
                compensated=bool(flags[1]),
                any_sequence=bool(flags[2]),
                direction=bool(flags[3]),
                negative_sign=bool(flags[4]),
                unbalance=float(rng.choice([0.0, 1.0])),
                floor_v=200.0,
                both_ends=both_ends,  # type: ignore[arg-type]
            )
            settings = Settings(
                i_set_a=rng.uniform(1.0, 15.0),
                v_set_pu=rng.uniform(0.02, 0.3),
                z_set_ohm=rng.uniform(1.0, 60.0),
                options=options,
            )
            expected = [[first_failing(one, settings) for one in row] for row in by_hand]
            np.testing.assert_array_equal(verdict(evidence, settings), expected, str(settings))
            reasons |= {reason for row in expected for reason in row}
    assert reasons == set(Reason) - {Reason.WIRING}


@pytest.mark.parametrize(
    ("options", "rows", "known"),
    [
        ((), 4, set()),
        ((Options(fallback=False),), 1, set()),
        ((Options(fallback=False), Options()), 4, set()),
        ((Options(unbalance=0.1),), 4, {"di2_a", "di0_a", "unbalance_rise_a"}),
        ((Options(compensated=True),), 4, {"di_star_a", "dv_remote_star_v"}),
        (
            (Options(fallback=False, both_ends="agree"),),
            1,
            {"far_di_a", "far_z_ohm", "far_undefined"},
        ),
    ],
)
def test_only_what_is_asked_for_is_computed(
    options: tuple[Options, ...], rows: int, known: set[str]
) -> None:
    seen = random_phasors(np.random.default_rng(23))
    terminals = terminal(0, 1), terminal(1, 0)
    evidence = evidence_of(seen, terminals, V_NOMINAL, *options)
    assert evidence.z_ohm.shape == (2, rows, SIZE)
    always = {"di_a", "dv_pu", "z_ohm", "undefined", "blocked"}
    given = {f.name for f in fields(evidence) if getattr(evidence, f.name) is not None}
    assert given == always | known
    # and what is computed does not depend on what else is
    everything = evidence_of(seen, terminals, V_NOMINAL, ALL)
    for name in given:
        own, other = getattr(evidence, name), getattr(everything, name)
        np.testing.assert_array_equal(own, other[:, : own.shape[1]] if own.ndim == 3 else other)


def test_the_identity_of_eq_5_with_the_compensated_changes() -> None:
    """|Z| |ΔI*| is |ΔV_R*|, in the positive sequence and in every phase."""
    seen = random_phasors(np.random.default_rng(24))
    evidence = evidence_of(seen, (terminal(0, 1), terminal(1, 0)), V_NOMINAL, ALL)
    stars: Any = evidence.di_star_a
    np.testing.assert_allclose(
        np.abs(evidence.z_ohm) * np.where(evidence.undefined, 0.0, stars),
        np.where(evidence.undefined, 0.0, evidence.dv_remote_star_v),
        rtol=1e-9,
    )


def test_the_far_end_must_be_asked() -> None:
    seen = random_phasors(np.random.default_rng(25))
    terminals = terminal(0, 1), terminal(1, 0), terminal(1, 2)
    with pytest.raises(ValueError, match="not asked: P1→P2"):
        evidence_of(seen, terminals, V_NOMINAL, Options(both_ends="agree"))
    assert reversed_terminals(terminals).tolist() == [1, 0, -1]


def test_one_terminal_of_the_evidence() -> None:
    seen = random_phasors(np.random.default_rng(26))
    terminals = tuple(terminal(*ends) for ends in POINTS)
    evidence = evidence_of(seen, terminals, V_NOMINAL, ALL)
    for t in range(len(POINTS)):
        one = only(evidence, t)
        assert one.alarm is None
        for field in fields(one):
            if field.name != "alarm":
                expected = getattr(evidence, field.name)[t : t + 1]
                np.testing.assert_array_equal(getattr(one, field.name), expected)
