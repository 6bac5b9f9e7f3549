"""Default measuring points: spread along the trunk of a feeder that has none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

from .parts import Feeder, Point
from .points import fed_by_its_points
from .trunk import Step, Trunk, find_trunk
from .zones import adjacent_sections, zones_of

__all__ = ["Spread", "spread_points"]

LEAST_SHARE = 0.01  #: of the trunk's |Z1|, that any two places must be apart


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """A feeder with its default points, and what to tell about them.

    Parameters
    ----------
    feeder
        With points and sections.
    said
        Sentences: what was chosen, and why. None where the feeder had points already.
    inside
        Regulators that lie inside a section, where a tap change may look like an open phase.
    """

    feeder: Feeder
    said: tuple[str, ...]
    inside: tuple[str, ...]


def spread_points(feeder: Feeder, count: int = 4) -> Spread:
    """Give a feeder without measuring points the default ones, and the sections between them.

    ``count`` places lie evenly by |Z1| along the trunk (`trunk.find_trunk`), the first at its
    head, the last at its end, those between at the nearest end of a line. Regulators of the
    trunk take the place of as many of those between: one has a point on either side,
    so that it lies outside every section. The points are called M1, M2, ... from the head on.

    Raises
    ------
    ValueError
        For fewer than two places.
    """
    if count < 2:
        raise ValueError(f"there must be at least two places, got {count}")
    if feeder.points:
        return Spread(feeder=feeder, said=(), inside=_inside(feeder))
    trunk = find_trunk(feeder)
    if trunk is None:
        none = "no measuring points are given, and no three-phase line could have any"
        return Spread(feeder=feeder, said=(none,), inside=())
    between = _places(trunk.steps, count - 2)
    points = _points(trunk.steps, between)
    sections, left_out = adjacent_sections(feeder, points)
    spread = replace(feeder, points=points, sections=sections)
    sections, not_fed = fed_by_its_points(spread)
    spread = replace(spread, sections=sections)
    inside = _inside(spread)
    said = (
        *_said(trunk, points, count, 2 + len(between)),
        *left_out,
        *not_fed,
        *_said_of_regulators(inside),
    )
    return Spread(feeder=spread, said=said, inside=inside)


def _places(steps: Sequence[Step], count: int) -> list[int]:
    """Steps before which a place lies, rising: at regulators, then evenly in what is left."""
    ohm = [0.0, *accumulate(step.ohm for step in steps)]
    taken = [n for n, step in enumerate(steps) if n and step.regulators]
    while len(taken) > count:
        taken.remove(_most_crowded(taken, ohm))
    ends = [0, *taken, len(steps)]
    gaps = list(pairwise(ends))
    shares = [1] * len(gaps)  # into how many parts each gap is cut
    for _ in range(count - len(taken)):
        parts = [(ohm[b] - ohm[a]) / n for (a, b), n in zip(gaps, shares, strict=True)]
        shares[parts.index(max(parts))] += 1
    for (a, b), parts_of_gap in zip(gaps, shares, strict=True):
        for n in range(1, parts_of_gap):
            wanted = ohm[a] + (ohm[b] - ohm[a]) * n / parts_of_gap
            nearest = _nearest(wanted, range(a + 1, b), [*taken, 0, len(steps)], ohm)
            if nearest is not None:
                taken.append(nearest)
    return sorted(taken)


def _most_crowded(taken: Sequence[int], ohm: Sequence[float]) -> int:
    """The place that is nearest to another, or to an end."""
    ends = [0, *taken, len(ohm) - 1]
    room = [
        min(ohm[b] - ohm[a], ohm[c] - ohm[b])
        for a, b, c in zip(ends, ends[1:], ends[2:], strict=False)
    ]
    return taken[room.index(min(room))]


def _nearest(
    wanted: float, free: Sequence[int], taken: Sequence[int], ohm: Sequence[float]
) -> int | None:
    """The free place nearest to ``wanted`` that keeps its distance from all taken ones."""
    least = LEAST_SHARE * ohm[-1]
    fit = [n for n in free if all(abs(ohm[n] - ohm[m]) > least for m in taken)]
    return min(fit, key=lambda n: abs(ohm[n] - wanted), default=None)


def _points(steps: Sequence[Step], between: Sequence[int]) -> tuple[Point, ...]:
    """A point at either end, one at each place between, two at a regulator."""
    ends: list[tuple[str, Step]] = [(steps[0].near, steps[0])]
    for n in between:
        if steps[n].regulators:
            ends.append((steps[n - 1].far, steps[n - 1]))
        ends.append((steps[n].near, steps[n]))
    ends.append((steps[-1].far, steps[-1]))
    return tuple(
        Point(name=f"M{n}", bus=bus, line=step.line.name) for n, (bus, step) in enumerate(ends, 1)
    )


def _inside(feeder: Feeder) -> tuple[str, ...]:
    """Regulators in a zone that has a section: on its path, or on a lateral of it."""
    if not feeder.regulators:
        return ()
    zones = zones_of(feeder, feeder.points)
    names = [point.name for point in feeder.points]
    ends = [{names.index(s.local), names.index(s.remote)} for s in feeder.sections]
    own = [{*zones.entries[n], *zones.exits[n]} for n in range(len(zones.entries))]
    return tuple(
        part.name
        for part in feeder.regulators
        if any(pair <= own[zones.of_node["bus", part.from_bus]] for pair in ends)
    )


def _said(trunk: Trunk, points: Sequence[Point], count: int, found: int) -> list[str]:
    total = sum(step.ohm for step in trunk.steps)
    km = sum(step.line.length_km for step in trunk.steps)
    so_far = dict(
        zip(
            [step.near for step in trunk.steps] + [trunk.end],
            [0.0, *accumulate(step.ohm for step in trunk.steps)],
            strict=True,
        )
    )
    so_far |= {
        step.far: so_far[after.near] for step, after in pairwise(trunk.steps) if after.regulators
    }
    said = [
        f"no measuring points are given: {found} places are spread evenly by |Z1| along the "
        f"three-phase path of {trunk.kv_ll:.4g} kV from {trunk.head} to {trunk.end} "
        f"({km:.3g} km, {total:.3g} Ω): {trunk.ends_at}",
        "points: "
        + ", ".join(f"{p.name} at {p.bus} on {p.line} ({so_far[p.bus]:.3g} Ω)" for p in points),
    ]
    if found < count:
        said.append(f"{found} places instead of {count}: the path has no more line ends for them")
    bridged = [
        name
        for step in trunk.steps
        if step.regulators and {step.near} & {p.bus for p in points if p.line == step.line.name}
        for name in step.regulators
    ]
    if bridged:
        said.append(f"regulators between two points, outside every section: {', '.join(bridged)}")
    return said


def _said_of_regulators(inside: Sequence[str]) -> list[str]:
    if not inside:
        return []
    return [
        f"regulators inside a section: {', '.join(inside)}; "
        "a change of their taps may look like an open phase"
    ]
