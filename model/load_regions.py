"""Which loads a measured place sees: those beyond it that no further measured place covers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .parts import Capacitor, Der, Feeder, Load
from .zones import nodes_of, zones_of

__all__ = ["LoadRegions", "load_regions", "measurable"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadRegions:
    """Regions of loads, in the order of the places that see them; indices count the feeder's.

    Parameters
    ----------
    names
        The measured places.
    loads, capacitors, ders
        What lies in each region.
    beyond
        The regions that each region feeds, farther ones not among them.
    in_loop
        Measured places in a closed loop, which no region belongs to alone.
    """

    names: tuple[str, ...]
    loads: tuple[tuple[int, ...], ...]
    capacitors: tuple[tuple[int, ...], ...]
    ders: tuple[tuple[int, ...], ...]
    beyond: tuple[tuple[int, ...], ...]
    in_loop: tuple[str, ...]

    def outwards_in(self) -> tuple[int, ...]:
        """Return the regions so that each stands behind all that it feeds."""
        order: list[int] = []
        fed = {n for own in self.beyond for n in own}
        waiting = [n for n in range(len(self.names)) if n not in fed]
        while waiting:
            order.append(waiting.pop())
            waiting += self.beyond[order[-1]]
        return tuple(reversed(order))


def measurable(feeder: Feeder) -> tuple[str, ...]:
    """Names that a measurement may have: the measuring points, and the source's bus for all."""
    names = tuple(point.name for point in feeder.points)
    return names if feeder.source.bus in names else (*names, feeder.source.bus)


def load_regions(feeder: Feeder, measured: Sequence[str]) -> LoadRegions:
    """Cut the feeder at the measured points, and see what lies behind each.

    ``measured`` are some of `measurable`.
    """
    points = [point for point in feeder.points if point.name in measured]
    zones = zones_of(feeder, points)
    names = [point.name for point in points]
    zone_of: dict[str, int] = {}
    in_loop: list[str] = []
    for name in measured:
        if name not in names:
            zone_of[name] = 0
            continue
        own = [n for n, e in enumerate(zones.entries) if e == (names.index(name),)]
        if own:
            zone_of[name] = own[0]
        else:
            in_loop.append(name)
    kept = tuple(zone_of)
    region_of = {zone: n for n, zone in enumerate(zone_of.values())}
    fed_by = {points[own[0]].name: zone for zone, own in enumerate(zones.entries) if len(own) == 1}

    def behind(parts: Sequence[Load | Der | Capacitor]) -> tuple[tuple[int, ...], ...]:
        found: list[list[int]] = [[] for _ in kept]
        for n, node in enumerate(nodes_of(feeder, parts)):
            region = region_of.get(zones.of_node[node])
            if region is not None:
                found[region].append(n)
        return tuple(tuple(own) for own in found)

    return LoadRegions(
        names=kept,
        loads=behind(feeder.loads),
        capacitors=behind(feeder.capacitors),
        ders=behind(feeder.ders),
        beyond=tuple(
            tuple(
                region_of[fed_by[points[n].name]]
                for n in zones.exits[zone]
                if fed_by.get(points[n].name) in region_of
            )
            for zone in zone_of.values()
        ),
        in_loop=tuple(in_loop),
    )
