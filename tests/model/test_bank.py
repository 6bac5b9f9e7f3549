"""Banks: the closed forms beside the general one, and what the compiled door relies on."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.random_elements import random_full_feeder

from openphase.model.compiled import compiled
from openphase.model.network import Network, compile_network
from openphase.model.solve import solve, steady_state
from openphase.model.solver.assemble import add_circulant
from openphase.model.solver.bank import D_YG, YG_D, YG_YG, bank, plain_bank
from openphase.model.symmetrical import phase_matrix

Complex = NDArray[np.complex128]

NO_CURRENT = (0j, 0j, 0j)


def square(matrix: Any) -> Complex:
    return np.array(matrix, np.complex128).reshape(3, 3)


def diagonal(y: Complex) -> Any:
    return tuple(np.diag(y).astype(complex).ravel().tolist())


def some(rng: np.random.Generator, size: int) -> Complex:
    """Admittances over six decades, loads as well as generation, some of them nothing."""
    y = 10.0 ** rng.uniform(-6, 0, size) * np.exp(1j * rng.uniform(-np.pi, np.pi, size))
    return np.asarray(np.where(rng.random(size) < 0.2, 0.0, y), np.complex128)


@pytest.mark.parametrize("connection", [YG_YG, D_YG, YG_D])
@pytest.mark.parametrize("seed", range(50))
def test_a_plain_bank_is_a_bank_with_nothing_but_its_loads(connection: int, seed: int) -> None:
    rng = np.random.default_rng([seed, connection])
    y = some(rng, 3)
    zh, zl = rng.uniform(0.1, 8.0, 2) * np.exp(1j * rng.uniform(0.8, 1.55, 2))
    if connection != YG_D and rng.random() < 0.2:
        zh = zl = 0j
    y0 = complex(some(rng, 1)[0]) if connection == YG_YG else 0j
    plain = plain_bank(connection, zh, zl, y0, tuple(y.tolist()))
    shunt, drawn, winding, fed = bank(connection, zh, zl, y0, 0j, diagonal(y), NO_CURRENT)
    for found, wanted in zip(plain, (shunt, winding), strict=True):
        scale = max(np.abs(square(wanted)).max(), 1e-12)
        np.testing.assert_allclose(square(found), square(wanted), rtol=0, atol=1e-9 * scale)
    assert drawn == NO_CURRENT
    assert fed == NO_CURRENT


@pytest.mark.parametrize("seed", range(20))
def test_a_circulant_is_the_phase_matrix_of_its_sequences(seed: int) -> None:
    """As ``set_loads`` makes the entries of a machine's matrix from y0, y1 and y2."""
    rng = np.random.default_rng(seed)
    y0, y1, y2 = (complex(y) for y in some(rng, 3))
    turn = np.exp(2j * np.pi / 3)
    stack = rng.normal(size=(2, 3, 3)) + 1j * rng.normal(size=(2, 3, 3))
    before = stack.copy()
    add_circulant(
        stack,
        1,
        (y0 + y1 + y2) / 3.0,
        (y0 + turn * y1 + turn**2 * y2) / 3.0,
        (y0 + turn**2 * y1 + turn * y2) / 3.0,
    )
    np.testing.assert_array_equal(stack[0], before[0])
    np.testing.assert_allclose(stack[1] - before[1], phase_matrix(y0, y1, y2), atol=1e-15)


def by_the_general_bank(network: Network) -> Network:
    tree = network.tree
    return replace(network, tree=tree._replace(unit_plain=np.zeros_like(tree.unit_plain)))


@pytest.mark.parametrize("seed", range(40))
def test_a_feeder_solved_by_general_banks_alone_is_the_same(seed: int) -> None:
    rng = np.random.default_rng([seed, 5])
    network = compile_network(random_full_feeder(rng, 6))
    state = steady_state(network)
    one, other = solve(network, state), solve(by_the_general_bank(network), state)
    v = network.tree.v_nominal_v
    assert one.flags.tolist() == other.flags.tolist()
    np.testing.assert_allclose(one.v / v, other.v / v, atol=1e-10)
    np.testing.assert_allclose(one.winding_v_pu[:-1], other.winding_v_pu[:-1], atol=1e-10)


def test_the_sample_has_plain_banks_of_every_form() -> None:
    seen = set()
    for seed in range(40):
        network = compile_network(random_full_feeder(np.random.default_rng([seed, 5]), 6))
        pairs = zip(network.tree.unit_plain.tolist(), network.connection.tolist(), strict=True)
        seen |= set(pairs)
    assert seen >= set(itertools.product([True], [YG_YG, D_YG, YG_D]))


def test_compiled_code_counts_no_references() -> None:
    """By a private option of numba's, which is heeded: it forbids to make an array."""

    def careless(size: int) -> Complex:
        return np.zeros(size, np.complex128)

    counting: Any = numba.njit
    assert counting(careless)(3).size == 3
    with pytest.raises(numba.core.errors.TypingError, match="implementation of function"):
        compiled(careless)(3)
