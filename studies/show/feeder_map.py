"""A feeder drawn as it lies: phases by colour, sections, and what stands in the lines."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable
from itertools import pairwise

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...model.buses import bus_volts
from ...model.parts import Feeder, InlineTransformer, Place, Regulator
from ...model.zones import section_paths
from .feeder_marks import ABOVE, BELOW, BUS, PART, Mark, along, draw_mark, write
from .feeder_places import LOW_V, Places, Spot, place_buses
from .figures import (
    BLUE,
    BROWN,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    YELLOW,
    axes_or_new,
    house_style,
)

__all__ = ["plot_feeder_map"]

SECTION_COLOURS = (BLUE, ORANGE, GREEN, RED, PURPLE, SKY)
BLEND = 0.55  #: of a section's colour in white
PHASES = {
    3: ("#222222", 1.5, "three phases"),
    2: (BROWN, 1.1, "two phases"),
    1: ("#9aa0a6", 0.9, "one phase"),
}
FEW = 30  #: marks of a kind, up to which each has its name
SMALL = 70  #: buses, up to which they have their names
CROWDED = 400  #: lines, from which they are drawn thinner
WIDTH, LEAST, MOST = 11.5, 4.5, 14.0  #: inches

_Named = tuple[str, Spot | None]


@house_style()
def plot_feeder_map(feeder: Feeder, ax: Axes | None = None) -> Axes:
    """Draw a feeder by its buses' coordinates, or as a tree, km from the source."""
    places = place_buses(feeder)
    ax = axes_or_new(ax, WIDTH, _height(places))
    handles = [
        *_draw_sections(ax, feeder, places),
        *_draw_lines(ax, feeder, places),
        *_draw_switches(ax, feeder, places),
        *_draw_parts(ax, feeder, places),
        *_draw_points(ax, feeder, places),
    ]
    if len(places.at) <= SMALL:
        for bus, spot in places.at.items():
            write(ax, spot, bus, BUS)
    ax.set_title(_title(feeder, places))
    if places.is_map:
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_axis_off()
    else:
        ax.set_yticks([])
        ax.spines["left"].set_visible(False)
        ax.set_xlabel(
            "distance from the source along the line [km]; "
            "transformers, regulators and switches are drawn longer than they are"
        )
    ax.margins(0.04)
    ax.autoscale_view()
    figure = ax.get_figure()
    if isinstance(figure, Figure):
        figure.legend(handles=handles, loc="outside lower center", ncols=5)
    return ax


def _title(feeder: Feeder, places: Places) -> str:
    km = sum(line.length_km for line in feeder.lines)
    text = (
        f"{feeder.name}: {len(places.at)} buses, {km:.4g} km of line, "
        f"{len(feeder.points)} measuring points"
    )
    if places.guessed:
        text += f"; {places.guessed} buses without coordinates stand at their neighbours"
    return text


def _height(places: Places) -> float:
    """Inches: as the coordinates lie, or by the rows."""
    wide, high = places.span()
    if places.is_map:
        wanted = WIDTH * high / wide if wide else MOST
    else:
        wanted = 2.0 + 0.22 * (high + 1.0)
    return min(max(wanted, LEAST), MOST)


# ---- lines ----


def _draw_lines(ax: Axes, feeder: Feeder, places: Places) -> list[Line2D]:
    """Lines by how many phases they have; low voltage is thin and pale."""
    volts = bus_volts(feeder)
    ways: defaultdict[tuple[int, bool], list[list[Spot]]] = defaultdict(list)
    for line in feeder.lines:
        if places.has(line.from_bus, line.to_bus):
            low = volts.get(line.from_bus, feeder.source.v_phase_v) < LOW_V
            ways[len(line.phases), low].append(places.way(line.from_bus, line.to_bus))
    handles: list[Line2D] = []
    mixed = len({low for _, low in ways}) > 1
    for (phases, low), own in sorted(ways.items(), reverse=True):
        colour, width, name = PHASES[phases]
        width *= (0.55 if low else 1.0) * (1.0 if len(feeder.lines) < CROWDED else 0.7)
        pale = 0.6 if low else 1.0
        level = 2.0 + 0.1 * phases + (0.0 if low else 1.0)
        ax.add_collection(
            LineCollection(own, colors=colour, linewidths=width, alpha=pale, zorder=level)
        )
        if not (low and (phases, False) in ways):
            handles.append(Line2D([], [], color=colour, lw=width, label=name))
    if mixed:
        handles.append(Line2D([], [], color="#222222", lw=0.5, alpha=0.6, label="low voltage"))
    return handles


def _draw_sections(ax: Axes, feeder: Feeder, places: Places) -> list[Line2D]:
    """A broad coloured band under each section's path."""
    ends = {line.name: (line.from_bus, line.to_bus) for line in feeder.lines}
    handles = []
    drawn: defaultdict[str, int] = defaultdict(int)
    for n, (section, path) in enumerate(zip(feeder.sections, section_paths(feeder), strict=True)):
        colour = _pale(SECTION_COLOURS[n % len(SECTION_COLOURS)])
        ways: defaultdict[float, list[list[Spot]]] = defaultdict(list)
        for name in path:
            if places.has(*ends[name]):
                # sections that share a line lie on top of each other, the later the thinner
                ways[9.0 / (1 + drawn[name])].append(places.way(*ends[name]))
                drawn[name] += 1
        for width, own in ways.items():
            level = 1.0 + 0.1 / width
            ax.add_collection(
                LineCollection(
                    own, colors=[colour], linewidths=width, capstyle="round", zorder=level
                )
            )
        label = f"section {section.local}–{section.remote}"
        handles.append(Line2D([], [], color=colour, lw=6, label=label))
    return handles


def _pale(colour: str) -> tuple[float, float, float]:
    """A section's colour mixed with white: bands that meet must not darken each other."""
    r, g, b = (BLEND * part + 1.0 - BLEND for part in to_rgb(colour))
    return r, g, b


def _draw_switches(ax: Axes, feeder: Feeder, places: Places) -> list[Line2D]:
    """Closed switches as short lines with a square, open ones dashed."""
    handles: dict[str, Line2D] = {}
    few = len(feeder.switches) <= FEW
    for switch in feeder.switches:
        if not places.has(switch.from_bus, switch.to_bus):
            continue
        way = places.way(switch.from_bus, switch.to_bus)
        style = "-" if switch.closed else "--"
        ax.add_collection(
            LineCollection([way], colors="black", linewidths=0.9, linestyles=style, zorder=4.5)
        )
        middle = along(way, 0.5)
        face = "black" if switch.closed else "white"
        draw_mark(ax, [middle], Mark(shape="s", size=4.5 if few else 2.5, face=face))
        if few and not switch.closed:
            write(ax, middle, switch.name, PART)
        name = "closed switch" if switch.closed else "open switch"
        handles[name] = Line2D(
            [], [], ls=style, lw=0.9, marker="s", ms=5, color="black", mfc=face, label=name
        )
    return list(handles.values())


# ---- what stands somewhere ----


def _draw_parts(ax: Axes, feeder: Feeder, places: Places) -> list[Line2D]:
    """The source, transformers, regulators, capacitors and DER."""
    source = Mark(shape="s", size=10.0, face="black", name="source")
    handles = [draw_mark(ax, [places.at[feeder.source.bus]], source)]
    inline = _banks(feeder)
    few = len(inline) <= FEW
    joints: list[InlineTransformer | Regulator] = [*inline, *feeder.regulators]
    for part in joints:
        if places.has(part.from_bus, part.to_bus):
            way = places.way(part.from_bus, part.to_bus)
            ax.add_collection(LineCollection([way], colors="#222222", linewidths=0.7, zorder=2.5))
    for mark, found in _marks(feeder, places, inline, few):
        spots = [(text, spot) for text, spot in found if spot is not None]
        if not spots:
            continue
        named = len(spots) <= FEW and (few or mark.shape not in "8h")
        size = mark.size if len(spots) <= FEW else min(mark.size, 4.5)
        own = Mark(shape=mark.shape, size=size, face=mark.face, name=mark.name)
        handles.append(draw_mark(ax, [spot for _, spot in spots], own))
        for text, spot in spots if named else []:
            write(ax, spot, text, PART)
    return handles


def _banks(feeder: Feeder) -> list[InlineTransformer]:
    """One unit for each pair of buses: several rows between the same two are one bank."""
    seen: dict[tuple[str, str], InlineTransformer] = {}
    for unit in feeder.inline_transformers:
        key = (unit.from_bus, unit.to_bus)
        if key not in seen or len(unit.phases) > len(seen[key].phases):
            seen[key] = unit
    return list(seen.values())


def _marks(
    feeder: Feeder, places: Places, inline: list[InlineTransformer], few: bool
) -> list[tuple[Mark, list[_Named]]]:
    """How each kind of part is drawn, its names, and where."""
    ends = {line.name: (line.from_bus, line.to_bus) for line in feeder.lines}

    def stands(place: Place | None) -> Spot | None:
        if place is None:
            return None
        if place.bus is not None:
            return places.at.get(place.bus)
        assert place.line is not None
        a, b = ends[place.line]
        return along(places.way(a, b), place.at or 0.0) if places.has(a, b) else None

    def between(parts: Iterable[InlineTransformer | Regulator]) -> list[_Named]:
        return [
            (own.name, along(places.way(own.from_bus, own.to_bus), 0.5))
            for own in parts
            if places.has(own.from_bus, own.to_bus)
        ]

    whole = [unit for unit in inline if len(unit.phases) == 3 or few]
    single = [unit for unit in inline if len(unit.phases) < 3 and not few]
    name = "in-line transformer" if few else "three-phase transformer"
    return [
        (Mark(shape="8", size=3.0, face="white", name="single-phase unit"), between(single)),
        (Mark(shape="h", size=8.5, face="#d0d0d0", name=name), between(whole)),
        (
            Mark(shape="^", size=5.0, face="#555555", name="transformer"),
            [(unit.name, stands(unit.place)) for unit in feeder.transformers],
        ),
        (Mark(shape="D", size=8.0, face=YELLOW, name="regulator"), between(feeder.regulators)),
        (
            Mark(shape="P", size=7.5, face=SKY, name="capacitor"),
            [(bank.name, stands(bank.place)) for bank in feeder.capacitors],
        ),
        (
            Mark(shape="*", size=10.0, face=YELLOW, name="DER"),
            [(der.name, stands(der.place)) for der in feeder.ders],
        ),
    ]


def _draw_points(ax: Axes, feeder: Feeder, places: Places) -> list[Line2D]:
    """A ring a little into its line, with the point's name."""
    ends = {line.name: (line.from_bus, line.to_bus) for line in feeder.lines}
    mark = Mark(shape="o", size=8.5, face="white", name="measuring point", width=1.6)
    gap = 0.014 * max(places.span())
    handles = []
    for n, point in enumerate(feeder.points):
        if not places.has(*ends[point.line]):
            continue
        way = places.way(*ends[point.line])
        if ends[point.line][0] != point.bus:
            way = way[::-1]
        length = sum(math.dist(a, b) for a, b in pairwise(way))
        spot = along(way, min(0.3, gap / length) if length else 0.0)
        handles = [draw_mark(ax, [spot], mark)]
        write(ax, spot, point.name, BELOW if n % 2 else ABOVE)
    return handles
