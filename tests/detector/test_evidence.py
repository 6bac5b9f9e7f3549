"""Phasors of measuring points to the numbers that a terminal decides by."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from openphase.detector.evidence import DEAD_PU, Phasors, evidence_of
from openphase.model.points import Terminal

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
    assert not evidence.undefined[0, 0]


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


def test_when_nothing_moves_there_is_no_impedance_and_no_nan() -> None:
    v, i = 7000.0 * POSITIVE, 0.0 * POSITIVE
    evidence = evidence_of(phasors([[v, v]] * 2, [[i, i]] * 2), (terminal(0, 1),), V_NOMINAL)
    assert evidence.undefined.all()
    for number in (evidence.di1_a, evidence.dv1_pu, evidence.z1_ohm):
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
