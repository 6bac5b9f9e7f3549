"""Between which nodes each coil of a transformer lies, and its voltage."""

from __future__ import annotations

from .dss_records import RawTransformer, Winding

__all__ = ["Coil", "coil_kv", "coils_of"]

Coil = tuple[int, int]
"""Nodes at its polarity mark and at its other end; 0 is earth."""


def coils_of(unit: RawTransformer) -> list[tuple[Coil, ...]]:
    """Return for each limb the coil of every winding."""
    step = _delta_step(unit)
    return [
        tuple(_coil(winding, limb, unit.phases, step) for winding in unit.windings)
        for limb in range(unit.phases)
    ]


def coil_kv(winding: Winding, phases: int) -> float:
    """Rated voltage of one coil; a wye's ``kv`` is line to line where it has two or three."""
    return float(winding.kv / 3.0**0.5) if phases > 1 and not winding.delta else winding.kv


def _coil(winding: Winding, limb: int, phases: int, step: int) -> Coil:
    nodes = winding.end.nodes
    if not winding.delta or phases == 1:
        return nodes[limb], nodes[phases if not winding.delta else 1]
    if phases == 2:
        # an open delta has a third conductor
        return nodes[limb], nodes[(limb + step) % 3]
    return nodes[limb], nodes[(limb + step) % phases]


def _delta_step(unit: RawTransformer) -> int:
    """Towards which conductor a delta's coils go: the high voltage leads, or (euro) lags."""
    first, second = unit.windings[0], unit.windings[1]
    if first.delta == second.delta:
        return 1
    high = first if first.kv >= second.kv else second
    return (1 if unit.euro else -1) if high.delta else (-1 if unit.euro else 1)
