"""What loads, capacitors, DER and hanging transformers must be in themselves."""

from __future__ import annotations

from ..errors import KeyPath
from ..parts import Capacitor, Der, Feeder, Load, Transformer
from .fields import as_toml
from .own_checks import OwnChecks, ohm

__all__ = ["check_shunts"]


def check_shunts(feeder: Feeder, own: OwnChecks) -> None:
    """Check what hangs on the feeder."""
    for index, unit in enumerate(feeder.transformers):
        _check_transformer(unit, index, own)
    for index, load in enumerate(feeder.loads):
        _check_branches(load, ("loads", index), own)
        _check_power(load, index, own)
        _check_law(load, index, own)
    for index, der in enumerate(feeder.ders):
        _check_der(der, index, own)
    for index, bank in enumerate(feeder.capacitors):
        _check_branches(bank, ("capacitors", index), own)


def _check_transformer(unit: Transformer, index: int, own: OwnChecks) -> None:
    """Leakage and zero-sequence data fit the connection."""
    beside = ("connection",)
    if unit.x0_pu is not None and unit.connection not in ("Yg/Yg", "unknown"):
        rule = f"must be left out for {unit.connection}: it belongs to Yg/Yg"
        own.add(("transformers", index, "x0_pu"), beside, rule, f"{unit.x0_pu!r}")
    if unit.leakage_pu == 0.0 and unit.connection in _SHORT:
        rule = f"must not be 0 for {unit.connection}, {_SHORT[unit.connection]}"
        own.add(("transformers", index, "leakage_pu"), beside, rule, None)


_SHORT = {
    "Yg/D": "which would short the zero sequence to earth",
    "Y/D": "whose closed winding it limits",
    "D/D": "whose closed windings it limits",
    "unknown": "which may be Yg/D and would short the zero sequence to earth",
}
"""Why a connection needs leakage."""


def _check_branches(part: Load | Capacitor, path: KeyPath, own: OwnChecks) -> None:
    """A delta has two phases at least, and a motor three."""
    if part.connection == "delta" and len(part.phases) == 1:
        rule = "must be two or three for a delta, whose branches stand between phases"
        own.add((*path, "phases"), ("connection",), rule, repr(part.phases))
    if isinstance(part, Load) and part.motor_share > 0.0 and len(part.phases) < 3:
        rule = "must be left out where not all three phases are: motors have three"
        own.add((*path, "motor_share"), ("phases",), rule, f"{part.motor_share!r}")


def _check_power(load: Load, index: int, own: OwnChecks) -> None:
    """Reactive power is said in one way."""
    if load.kvar is not None and load.power_factor != 1.0:
        rule = "must be left out beside kvar"
        own.add(("loads", index, "power_factor"), ("kvar",), rule, f"{load.power_factor!r}")


def _check_law(load: Load, index: int, own: OwnChecks) -> None:
    """How power goes with voltage is said in one way, over a range that is one."""

    def add(key: str, others: tuple[str, ...], rule: str, found: str) -> None:
        own.add(("loads", index, key), others, rule, found)

    if load.zip is not None:
        if load.exponent != 2.0:
            add("exponent", ("zip",), "must be left out beside zip", f"{load.exponent!r}")
        if load.exponent_q is not None:
            add("exponent_q", ("zip",), "must be left out beside zip", f"{load.exponent_q!r}")
        sums = (sum(load.zip[:3]), sum(load.zip[3:]))
        if any(abs(share - 1.0) > _SHARES for share in sums):
            rule = "must have shares that add up to 1, those of P and those of Q"
            add("zip", (), rule, as_toml(load.zip))
    if load.v_max_pu is not None and load.v_max_pu <= load.v_min_pu:
        rule = f"must be > v_min_pu ({load.v_min_pu:g})"
        add("v_max_pu", ("v_min_pu",), rule, f"{load.v_max_pu!r}")
    if load.v_low_pu is not None and load.v_low_pu >= load.v_min_pu:
        rule = f"must be < v_min_pu ({load.v_min_pu:g})"
        add("v_low_pu", ("v_min_pu",), rule, f"{load.v_low_pu!r}")


_SHARES = 1e-6
"""How far the shares of a ZIP load may miss 1."""


def _check_der(der: Der, index: int, own: OwnChecks) -> None:
    """A model has the impedances that it stands on, and no others."""
    keeps_emf = der.model in ("thevenin", "generator")
    path: KeyPath = ("ders", index, "z1_ohm")
    if keeps_emf and der.z1_ohm is None:
        own.add(path, ("model",), f"is missing: model = '{der.model}' keeps an EMF behind it", None)
    elif not keeps_emf and der.z1_ohm is not None:
        kept = der.model.removeprefix("constant_")
        rule = f"must be left out for a constant {kept}, which stays whatever the voltage"
        own.add(path, ("model",), rule, ohm(der.z1_ohm))
    if der.model == "generator" and der.z2_ohm is None:
        rule = "is missing: a generator has a path for the negative sequence"
        own.add(("ders", index, "z2_ohm"), ("model",), rule, None)
