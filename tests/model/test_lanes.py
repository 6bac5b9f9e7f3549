"""Numbers in lanes: each lane computes what a scalar would, to the last digits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from openphase.model.compiled import compiled
from openphase.model.lanes.functions import load_real, mask_of, of_three, select, store_real
from openphase.model.lanes.kinds import WIDTH
from openphase.model.solver.wide.powers import power
from openphase.model.solver.wide.rows import load_entry, store_entry

Real = NDArray[np.float64]


@compiled
def powers(base: Real, exponent: Real, out: Real) -> None:
    for n in range(base.shape[0]):
        store_real(out, (n, 0), power(load_real(base, (n, 0)), load_real(exponent, (n, 0))))


@compiled
def sums(given: Real, bits: int, out: Real) -> None:
    a, b, c = load_entry(given, 0, 0), load_entry(given, 0, 1), load_entry(given, 0, 2)
    store_entry(out, 0, 0, of_three(a, b, b, c, 2.0 - 1j, a))
    store_entry(out, 0, 1, (a - b) * c + a * (0.5 + 2j) - c * 3.0)
    store_entry(out, 0, 2, select(mask_of(bits), a, -b))


@compiled
def one_of(values: Real, n: int) -> float:
    return float(values[n])


@compiled
def with_constants(values: Real) -> float:
    return one_of(values, 0) + one_of(values, 1) + one_of(values, 2)


def test_powers_are_right_to_the_last_digits() -> None:
    rng = np.random.default_rng(1)
    base = np.exp(rng.uniform(np.log(1e-3), np.log(3.0), (2000, WIDTH)))
    exponent = rng.uniform(-4.0, 4.0, base.shape)
    exponent[::7] = 0.0
    out = np.empty_like(base)
    powers(base, exponent, out)
    expected = base**exponent
    assert np.abs(out / expected - 1.0).max() < 1e-14
    assert np.all(out[::7] == 1.0)


@pytest.mark.parametrize("bits", [0, 0b10110001, 255])
def test_arithmetic_is_that_of_complex_numbers(bits: int) -> None:
    given = np.random.default_rng(2).normal(size=(1, 6, WIDTH))
    out: Any = np.empty_like(given)
    sums(given, bits, out)
    a, b, c = given[0, ::2] + 1j * given[0, 1::2]
    found = out[0, ::2] + 1j * out[0, 1::2]
    np.testing.assert_allclose(found[0], a * b + b * c + (2 - 1j) * a, rtol=1e-13)
    np.testing.assert_allclose(found[1], (a - b) * c + a * (0.5 + 2j) - c * 3.0, rtol=1e-12)
    chosen = np.array([bits >> lane & 1 for lane in range(WIDTH)], np.bool_)
    np.testing.assert_array_equal(found[2], np.where(chosen, a, -b))


def test_constants_as_arguments_make_no_versions_of_their_own() -> None:
    assert with_constants(np.arange(3.0)) == 3.0
    function: Any = one_of
    assert len(function.signatures) == 1
