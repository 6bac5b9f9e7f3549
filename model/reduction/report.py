"""A folded feeder in words and as plain data."""

from __future__ import annotations

from collections import Counter
from typing import Any

from .choose import ENDS
from .equivalent import Kind
from .fold import Folded
from .measure import OWN_RANGE, Measured, Spread

__all__ = ["folded_json", "folded_text"]

KINDS: dict[Kind, str] = {
    "bus": "as loads at the root itself",
    "line": "beyond one line each",
    "units": "beyond single-phase units",
    "both": "beyond a line and single-phase units",
}


def folded_text(folded: Folded, measured: Measured | None = None) -> list[str]:
    """Lines that say what was folded, and what it does to the results."""
    roots = folded.roots
    kinds = Counter(root.kind for root in roots)
    said = ", ".join(f"{kinds[kind]} {words}" for kind, words in KINDS.items() if kinds[kind])
    lines = [
        f"folded: {folded.buses_before} buses become {folded.buses_after};"
        f" an approximation, exact at level {folded.level:g} of the loads",
        f"  {sum(r.loads for r in roots)} loads of {sum(r.kw for r in roots):.0f} kW moved to"
        f" {len(roots)} roots: {said or 'nothing to fold'}",
    ]
    if roots:
        worst = max(roots, key=lambda root: root.misfit)
        lines.append(
            f"  admittance of a root at levels {ENDS[0]:g} and {ENDS[1]:g}:"
            f" off by at most {_pct(worst.misfit)} ('{worst.root}')"
        )
    if measured is not None:
        lines += _measured_text(measured)
    return lines


def _measured_text(measured: Measured) -> list[str]:
    low, high = measured.levels
    least, most = OWN_RANGE
    v = measured.voltage_pu
    return [
        f"  measured in {measured.scenarios} scenarios, loads at {low:.3g}..{high:.3g} times"
        f" {least:g}..{most:g} each (median, 95 %, worst):",
        f"    voltage  {v.median:.1e}, {v.most:.1e}, {v.worst:.1e} pu",
        f"    |Z_op|   {_three(measured.z_op)} of {measured.z_op.count} breaks",
        f"    dI1      {_three(measured.di1)}",
        f"    {measured.not_converged} not converged, {measured.undefined} without a defined value",
        f"    solved {measured.speed_ratio:.1f} times as fast"
        f" ({measured.per_s[0]:.0f} and {measured.per_s[1]:.0f} states a second)",
    ]


def _three(spread: Spread) -> str:
    return ", ".join(_pct(x) for x in (spread.median, spread.most, spread.worst))


def _pct(share: float) -> str:
    return f"{100.0 * share:.2g} %"


def folded_json(folded: Folded, measured: Measured | None = None) -> dict[str, Any]:
    """The same as plain data, root by root."""
    found: dict[str, Any] = {
        "buses_before": folded.buses_before,
        "buses_after": folded.buses_after,
        "level": folded.level,
        "roots": [
            {
                "root": root.root,
                "buses": root.buses,
                "loads": root.loads,
                "kw": root.kw,
                "km": root.km,
                "kind": root.kind,
                "misfit": root.misfit,
            }
            for root in folded.roots
        ],
    }
    if measured is not None:
        found["measured"] = {
            "scenarios": measured.scenarios,
            "levels": list(measured.levels),
            "voltage_pu": _spread_json(measured.voltage_pu),
            "z_op": _spread_json(measured.z_op),
            "di1": _spread_json(measured.di1),
            "not_converged": measured.not_converged,
            "undefined": measured.undefined,
            "states_per_s": list(measured.per_s),
        }
    return found


def _spread_json(spread: Spread) -> dict[str, float | int | None]:
    """No number where nothing was measured."""
    known = spread.count > 0
    return {
        "median": spread.median if known else None,
        "p95": spread.most if known else None,
        "worst": spread.worst if known else None,
        "count": spread.count,
    }
