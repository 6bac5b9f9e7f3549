"""How things lie to a section, by taking the feeder apart: slow, and easy to believe."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from openphase.model.parts import Feeder, Section
from openphase.model.sides import Side

__all__ = ["in_state", "side_of", "without_source"]

Thing = tuple[str, str]
"""What can be reached: a ("bus", name), or a ("line", name), switch or regulator."""


def side_of(feeder: Feeder, section: Section, own: Thing, path: list[Thing] | None = None) -> Side:
    """The Side of a bus, line, switch or regulator in the feeder's normal state.

    That is a tree, or the section's ``path`` is given.
    """
    points = {point.name: point for point in feeder.points}
    local, remote = (("bus", points[name].bus) for name in (section.local, section.remote))
    lines: list[Thing] = [("line", own.name) for own in feeder.lines]
    if path is None:
        path = [own for own in lines if remote not in _reached(feeder, local, [own])]
    source = ("bus", feeder.source.bus)
    if own in path:
        return Side.PATH
    # parted from its bus wherever a point measures what flows into it
    parted = {("bus", point.bus, point.line) for point in feeder.points}
    if any(own in _reached(feeder, part, [], parted) for part in path):
        return Side.LATERAL
    if own not in _reached(feeder, source, path):
        return Side.DOWNSTREAM
    # without the source bus, and what is joined to it without a line, branches fall apart
    head = _reached(feeder, source, lines)
    if any(own in _reached(feeder, part, head) for part in path):
        return Side.UPSTREAM
    return Side.OTHER


def in_state(feeder: Feeder, closed: Collection[str], opened: Collection[str]) -> Feeder:
    """The feeder with other switches closed, and lines taken off the bus at open reclosers."""
    lines, points = list(feeder.lines), list(feeder.points)
    for n, point in enumerate(points):
        if point.name in opened:
            k = next(k for k, line in enumerate(lines) if line.name == point.line)
            end = f"{point.name}:open"
            at_from = lines[k].from_bus == point.bus
            lines[k] = replace(lines[k], from_bus=end) if at_from else replace(lines[k], to_bus=end)
            points[n] = replace(point, bus=end)
    return replace(
        feeder,
        lines=tuple(lines),
        points=tuple(points),
        switches=tuple(replace(own, closed=own.name in closed) for own in feeder.switches),
    )


def without_source(feeder: Feeder, line: str) -> set[str]:
    """Buses that have no supply where ``line`` is out, in the normal state."""
    source: Thing = ("bus", feeder.source.bus)
    lost = _reached(feeder, source, []) - _reached(feeder, source, [("line", line)])
    return {name for kind, name in lost if kind == "bus"}


def _reached(
    feeder: Feeder,
    start: Thing,
    without: Collection[Thing],
    parted: Collection[tuple[str, str, str]] = (),
) -> set[Thing]:
    """All that is joined to ``start``, where some things are taken out or parted from a bus."""
    joints = [
        (("bus", bus), (kind, part.name))
        for kind, parts in (
            ("line", feeder.lines),
            ("switch", [switch for switch in feeder.switches if switch.closed]),
            ("regulator", feeder.regulators),
            ("transformer", feeder.inline_transformers),
        )
        for part in parts
        for bus in (part.from_bus, part.to_bus)
        if ("bus", bus, part.name) not in parted
    ]
    found: set[Thing] = {start}
    grown = True
    while grown:
        near = {end for joint in joints if found & set(joint) for end in joint} - set(without)
        grown = not near <= found
        found |= near
    return found
