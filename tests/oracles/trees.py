"""Random radial feeders of plain three-phase lines, for questions about their graph alone."""

from __future__ import annotations

import numpy as np

from openphase.model.parts import Feeder, Line, Load, Place, Point, Source

__all__ = ["SOURCE", "line", "plain_load", "random_tree"]

SOURCE = Source(
    bus="B0", kv_ll=12.0, emf_pu=1.0, z1_ohm=0.9j, z2_ohm=0.9j, z0_ohm=0.9j, frequency_hz=60.0
)


def line(name: str, start: str, end: str, km: float = 1.0, phases: str = "abc") -> Line:
    return Line(
        name=name,
        from_bus=start,
        to_bus=end,
        length_km=km,
        z1_ohm_per_km=0.3 + 0.4j,
        z0_ohm_per_km=0.9 + 1.2j,
        phases=phases,
    )


def plain_load(name: str, place: Place, kw: float = 100.0, pf: float = 0.9) -> Load:
    return Load(
        name=name,
        transformer=None,
        place=place,
        connection="wye",
        kw=kw,
        power_factor=pf,
        exponent=2.0,
    )


def random_tree(rng: np.random.Generator, count: int, points: int) -> tuple[Feeder, dict[str, str]]:
    """A tree of ``count`` lines, drawn in either direction, with points at some of their ends.

    Beside it the line above every bus.
    """
    lines, above = [], {}
    for n in range(1, count + 1):
        ends = [f"B{rng.integers(n)}", f"B{n}"]
        above[ends[1]] = f"L{n}"
        if rng.random() < 0.5:
            ends.reverse()
        lines.append(line(f"L{n}", *ends, km=float(rng.uniform(0.1, 3.0))))
    places = [(own.name, bus) for own in lines for bus in (own.from_bus, own.to_bus)]
    chosen = rng.choice(len(places), size=min(points, len(places)), replace=False)
    loads = [
        plain_load(
            f"D{n}",
            Place(bus=f"B{n}")
            if rng.random() < 0.5
            else Place(line=f"L{n}", at=float(rng.random())),
            kw=float(rng.uniform(10.0, 200.0)),
            pf=float(rng.choice([0.8, 0.95, 1.0, -0.9])),
        )
        for n in range(1, count + 1)
    ]
    feeder = Feeder(
        name="tree",
        source=SOURCE,
        lines=tuple(lines),
        transformers=(),
        loads=tuple(loads),
        switches=(),
        points=tuple(
            Point(name=f"P{n}", bus=places[k][1], line=places[k][0]) for n, k in enumerate(chosen)
        ),
        sections=(),
    )
    return feeder, above
