"""DER after an event: what they keep, and that they do not live through any voltage."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from openphase.model import load_feeder
from openphase.model.after import OVERVOLTAGE_PU, solve_after
from openphase.model.machine_state import carried_over, machine_state
from openphase.model.network import Network, compile_network, locate
from openphase.model.parts import Der, DerModel
from openphase.model.solve import quiet_state, solve
from openphase.model.states import NOT_CONVERGED, Answer, State, unit_voltages

MODELS: list[DerModel] = ["thevenin", "generator", "constant_current", "constant_power"]


def network_with(model: DerModel, kw: float) -> Network:
    """The paper's feeder with one DER behind T6."""
    behind = 15j if model in ("thevenin", "generator") else None
    der = Der(
        name="PV",
        transformer="T6",
        place=None,
        kw=kw,
        power_factor=1.0,
        model=model,
        z1_ohm=behind,
        z2_ohm=behind,
        z0_ohm=None,
    )
    return compile_network(replace(load_feeder("paper"), ders=(der,)))


def states(network: Network, masks: list[int], level: float = 1.0) -> tuple[State, Answer, State]:
    """The quiet state with its solution, and the same with phases open between R2 and R3."""
    scale = np.full((len(network.loads), len(masks)), level)
    exponent = np.full_like(scale, 2.0)
    before = quiet_state(network, scale, exponent)
    edge, share = locate(network, "R2-R3", 0.6)
    after = before._replace(
        edge=np.full(len(masks), edge), share=np.full(len(masks), share), open_mask=np.array(masks)
    )
    return before, solve(network, before), after


@pytest.mark.parametrize("model", MODELS)
def test_what_stays_within_its_voltage_is_carried_over(model: DerModel) -> None:
    network = network_with(model, 200.0)
    before, known, after = states(network, [1, 2, 4])
    factor = np.ones((1, 3))
    answer = solve_after(network, (before, known), after, (factor, None))
    plain = solve(network, carried_over(network, before, known, after, factor))
    assert unit_voltages(plain, len(network.units))[:-1, :3].max() < OVERVOLTAGE_PU
    np.testing.assert_allclose(answer.v, plain.v, atol=1e-6)


def test_der_trip_on_overvoltage_in_those_scenarios_alone() -> None:
    """At a quarter of the load two open phases cannot take the current that the DER keeps."""
    network = network_with("constant_current", 700.0)
    before, known, after = states(network, [0, 3, 6], level=0.25)
    factor = np.ones((1, 3))
    plain = solve(network, carried_over(network, before, known, after, factor))
    high = (
        unit_voltages(plain, len(network.units))[network.machines.unit, :3].max(axis=(0, 1))
        > OVERVOLTAGE_PU
    ) | (plain.flags & NOT_CONVERGED != 0)
    assert high.tolist() == [False, True, True]
    answer = solve_after(network, (before, known), after, (factor, None))
    without = solve(network, carried_over(network, before, known, after, np.zeros((1, 3))))
    np.testing.assert_allclose(answer.v[..., 1:], without.v[..., 1:], rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(answer.v[..., 0], plain.v[..., 0], rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("model", MODELS)
def test_der_at_level_0_are_not_there(model: DerModel) -> None:
    network, bare = network_with(model, 700.0), compile_network(load_feeder("paper"))
    before, _, after = states(network, [1, 3])
    scale, exponent = np.ones((len(network.loads), 2)), np.full((len(network.loads), 2), 2.0)
    idle = machine_state(network, scale, exponent, der_level=np.zeros((1, 2)))
    before, after = before._replace(**idle), after._replace(**idle)
    known = solve(network, before)
    answer = solve_after(network, (before, known), after, (np.ones((1, 2)), None))
    bare_before, bare_known, bare_after = states(bare, [1, 3])
    wanted = solve_after(bare, (bare_before, bare_known), bare_after, (np.ones((0, 2)), None))
    np.testing.assert_allclose(answer.v, wanted.v, rtol=1e-12, atol=1e-9)
