"""What motors and DER are in a state of the network: before any event, and carried over one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .machines import DER_MODELS
from .network import Network
from .states import Answer, State

__all__ = ["FLOOR_PU", "carried_over", "machine_state"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Int = NDArray[np.int64]

FLOOR_PU = 0.7  #: below it a load is constant impedance, at its admittance there


def machine_state(
    network: Network,
    load_scale: Real,
    exponent: Real,
    *,
    share: Real | None = None,
    y2_y1: Real | None = None,
    der_level: Real | None = None,
) -> dict[str, Any]:
    """The fields of a `State` that depend on motors and DER, before any event.

    Parameters
    ----------
    network : Network
    load_scale, exponent : (L, S) arrays
        Factor on every load, motors included, and voltage exponent.
    share, y2_y1 : (motors, S) arrays, optional
        Motor share and ratio of the motors' admittances; by default the file's.
    der_level : (D, S) array, optional
        Factor on what the DER deliver; by default 1. At 0 they are disconnected.
    """
    own = network.machines
    v = network.tree.unit_v[own.unit][:, None]
    size = load_scale.shape[1]
    motors, load = own.motor_load.size, own.motor_load
    share = np.tile(own.motor_share[:, None], size) if share is None else share
    y2_y1 = np.tile(own.motor_y2_y1[:, None], size) if y2_y1 is None else y2_y1
    level = np.ones((len(own.ders), size)) if der_level is None else der_level
    va = np.zeros((own.count, size), np.complex128)
    va[:motors] = own.load_va[load, None] * load_scale[load] * share
    va[motors:] = -own.der_va[:, None] * level
    follows = np.zeros((own.count, size))
    follows[:motors] = np.where(exponent[load] < 0.0, own.motor_exponent[:, None], exponent[load])
    y = np.zeros((own.count, 3, size), np.complex128)
    y[:motors, 2] = y2_y1 * va[:motors].conj() / (3.0 * v[:motors] ** 2)
    connected = va[motors:] != 0.0
    y[motors:, 0] = np.where(connected, own.der_y_s[:, 0, None], 0.0)
    y[motors:, 2] = np.where(connected, own.der_y_s[:, 2, None], 0.0)
    return {
        "load_scale": _without_motors(load_scale, load, share),
        "exponent": exponent,
        "machine_va": va,
        "machine_exponent": follows,
        "machine_y_s": y,
        "machine_j_a": np.zeros((own.count, size), np.complex128),
    }


def _without_motors(load_scale: Real, load: Int, share: Real) -> Real:
    """(L, S) factors on what is no motor of every load; those given where there are none."""
    if not load.size:
        return load_scale
    static = load_scale.copy()
    static[load] *= 1.0 - share
    return static


def carried_over(
    network: Network,
    before: State,
    answer: Answer,
    after: State,
    factor: Real,
    model: Int | None = None,
) -> State:
    """``after`` with what the DER keep from before the event.

    Parameters
    ----------
    before, answer : State, Answer
        The state before the event, and its solution.
    after : State
        The state after it.
    factor : (D, S) array
        On what the DER deliver; 0 for one that has tripped, which leaves nothing.
    model : (D, S) array of int, optional
        Indices into ``DER_MODELS``; by default the file's.
    """
    own, tree = network.machines, network.tree
    if not own.ders:
        return after
    ders = slice(own.motor_load.size, None)
    kind = np.tile(own.der_model[:, None], factor.shape[1]) if model is None else model
    v1, nominal = answer.machine_v1_v[ders], tree.unit_v[own.unit[ders]][:, None]
    factor = np.where(before.machine_va[ders] == 0.0, 0.0, factor)  # not even connected
    asked = before.machine_va[ders].conj() / (3.0 * nominal**2)
    current = -asked * np.maximum(np.abs(v1) / nominal, FLOOR_PU) ** -2.0 * v1 * factor
    behind = np.isin(kind, (0, 1))
    y1 = np.where(behind, own.der_y_s[:, 1, None], 0.0)
    kept = kind != DER_MODELS.index("constant_power")
    y = after.machine_y_s.copy()
    y[ders, 1] = y1
    y[ders] = np.where((factor != 0.0)[:, None], y[ders], 0.0)
    va, j = after.machine_va.copy(), after.machine_j_a.copy()
    va[ders] = np.where(kept, 0.0, before.machine_va[ders] * factor)
    j[ders] = np.where(kept & (factor != 0.0), current + y1 * v1, 0.0)
    return after._replace(machine_va=va, machine_y_s=y, machine_j_a=j)
