"""The detector, one comparison at a time: slow, and easy to believe."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, fields

from openphase.detector.criteria import Reason, Settings
from openphase.detector.evidence import Evidence

__all__ = [
    "Looks",
    "first_failing",
    "looks_at",
    "looks_of",
]


@dataclass(frozen=True, kw_only=True)
class Looks:
    """What one terminal sees in one scenario; lists are of V1 and phases a, b, c."""

    di_a: list[float]
    dv_pu: list[float]
    z_ohm: list[complex]
    undefined: list[bool]
    blocked: bool
    di_star_a: list[float]
    dv_remote_star_v: list[float]
    di2_a: float
    di0_a: float
    unbalance_rise_a: float
    far_di_a: list[float]
    far_z_ohm: list[complex]
    far_undefined: list[bool]
    alarm: int = 0


def looks_of(evidence: Evidence, t: int, s: int) -> Looks:
    """One scenario of one terminal of complete evidence."""
    parts = {}
    for field in fields(Evidence):
        values = getattr(evidence, field.name)
        if values is not None:
            parts[field.name] = values[t, ..., s].tolist()
    return Looks(**parts)


def looks_at(
    v: list[list[list[complex]]],
    i: list[list[list[complex]]],
    into: tuple[float, float],
    v_nominal_v: float,
) -> Looks:
    """The same by hand, from ``v[frame][end][phase]``: end 0 is the local one."""
    turn = cmath.exp(2j * math.pi / 3)

    def sequence(abc: list[complex], way: int) -> complex:
        return sum(x * turn ** (way * k) for k, x in enumerate(abc)) / 3

    def rows(abc: list[complex]) -> list[complex]:
        return [sequence(abc, 1), *abc]

    def impedances(here: int) -> tuple[list[complex], list[bool]]:
        z_ohm, undefined = [], []
        for r in range(4):
            v_l = [rows(v[frame][here])[r] for frame in (0, 1)]
            v_r = [rows(v[frame][1 - here])[r] for frame in (0, 1)]
            i_l = [rows(i[frame][here])[r] * into[here] for frame in (0, 1)]
            below = (i_l[1] - i_l[0]) * v_l[1] - (v_l[1] - v_l[0]) * i_l[1]
            above = (v_l[1] - v_l[0]) * v_r[1] - (v_r[1] - v_r[0]) * v_l[1]
            none = abs(below) <= 1e-10 * max(abs((v_l[1] - v_l[0]) * i_l[1]), abs(v_l[1] * i_l[1]))
            undefined.append(none)
            z_ohm.append(0j if none else above / below)
        return z_ohm, undefined

    def change(x: list[list[list[complex]]], end: int, local_v: bool) -> list[float]:
        """|X' - X|, or |X' - X V'/V| by the local voltage."""
        found = []
        for r in range(4):
            before, now = rows(x[0][end])[r], rows(x[1][end])[r]
            earlier = rows(v[0][0])[r]
            # where the end was dead there is nothing to compensate with
            factor = rows(v[1][0])[r] / earlier if local_v and earlier else 1.0
            found.append(abs(now - before * factor))
        return found

    def unbalance(frame: int) -> float:
        return abs(sequence(i[frame][0], -1)) + abs(sequence(i[frame][0], 0))

    here, there = impedances(0), impedances(1)
    highest = [max(abs(x) for x in v[frame][end]) for frame in (0, 1) for end in (0, 1)]
    return Looks(
        di_a=change(i, 0, False),
        dv_pu=[x / v_nominal_v for x in change(v, 0, False)],
        z_ohm=here[0],
        undefined=here[1],
        blocked=any(x < 0.2 * v_nominal_v for x in highest),
        di_star_a=change(i, 0, True),
        dv_remote_star_v=change(v, 1, True),
        di2_a=abs(sequence(i[1][0], -1) - sequence(i[0][0], -1)),
        di0_a=abs(sequence(i[1][0], 0) - sequence(i[0][0], 0)),
        unbalance_rise_a=unbalance(1) - unbalance(0),
        far_di_a=change(i, 1, False),
        far_z_ohm=there[0],
        far_undefined=there[1],
    )


def first_failing(seen: Looks, settings: Settings) -> Reason:
    """The criteria one after the other, as the paper and the options state them."""
    if seen.alarm:
        return Reason.WIRING
    if seen.blocked:
        return Reason.BLOCKED
    own = _row_fails(seen, settings, 0)
    if own != Reason.CURRENT or not settings.options.fallback:
        return own
    phases = [_row_fails(seen, settings, k) for k in (1, 2, 3)]
    if Reason.TRIP in phases:
        return Reason.TRIP
    return IN_PHASES[max(phases)]


IN_PHASES = {
    Reason.CURRENT: Reason.CURRENT,
    Reason.VOLTAGE: Reason.PHASE_VOLTAGE,
    Reason.IMPEDANCE: Reason.PHASE_IMPEDANCE,
    Reason.SIGN: Reason.PHASE_SIGN,
    Reason.FLOOR: Reason.PHASE_FLOOR,
    Reason.UNBALANCE: Reason.UNBALANCE,
    Reason.DIRECTION: Reason.DIRECTION,
    Reason.FAR_END: Reason.PHASE_FAR_END,
}


def _row_fails(seen: Looks, settings: Settings, k: int) -> Reason:  # noqa: PLR0911
    """The first criterion that fails in the positive sequence (0) or a phase."""
    options = settings.options
    trigger = min(seen.di_a[k], seen.di_star_a[k]) if options.compensated else seen.di_a[k]
    if options.any_sequence and k == 0:
        trigger = max(trigger, seen.di2_a, seen.di0_a)
    if not trigger >= settings.i_set_a:
        return Reason.CURRENT
    if not seen.dv_pu[k] <= settings.v_set_pu:
        return Reason.VOLTAGE
    if seen.undefined[k] or not abs(seen.z_ohm[k]) >= settings.z_set_ohm:
        return Reason.IMPEDANCE
    waived = options.any_sequence and k == 0 and seen.di_star_a[0] < options.waive_sign_below_a
    if options.negative_sign and not waived and not seen.z_ohm[k].real < 0:
        return Reason.SIGN
    if options.any_sequence and not seen.dv_remote_star_v[k] >= options.floor_v:
        return Reason.FLOOR
    if not max(seen.di2_a, seen.di0_a) >= options.unbalance * seen.di_a[0]:
        return Reason.UNBALANCE
    if options.direction and not seen.unbalance_rise_a >= 0:
        return Reason.DIRECTION
    if options.both_ends != "off":
        speaks = seen.far_di_a[k] >= 0.1 and not seen.far_undefined[k]
        small = abs(seen.far_z_ohm[k]) < settings.z_set_ohm
        if options.both_ends == "no_small_z" and speaks and small:
            return Reason.FAR_END
        if options.both_ends == "agree" and not (
            speaks and not small and seen.far_z_ohm[k].real < 0
        ):
            return Reason.FAR_END
    return Reason.TRIP
