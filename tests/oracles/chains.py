"""Chains in random feeders: lines cut into pieces by buses on which nothing varies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from openphase.model.errors import InputError
from openphase.model.network import compile_network
from openphase.model.parts import Capacitor, Feeder, Line, LineCode, Place
from openphase.model.phases import letters

__all__ = ["with_chains"]


def with_chains(rng: np.random.Generator, feeder: Feeder) -> Feeder:
    """Lines cut into several by buses on which nothing varies.

    Their pieces are built differently; some have more phases near the source, and some buses
    have twigs or capacitors.
    """
    above = upper_ends(feeder)
    lines: list[Line] = []
    codes = list(feeder.codes)
    capacitors = list(feeder.capacitors)
    tied = {place for point in feeder.points for place in (point.line,)}
    tied |= {part.place.line for part in (*feeder.capacitors, *feeder.transformers)}
    tied |= {part.place.line for part in (*feeder.loads, *feeder.ders) if part.place is not None}
    for line in feeder.lines:
        pieces = int(rng.integers(1, 6))
        if line.name in tied or pieces == 1:
            lines.append(line)
            continue
        upper, wide = above.get(line.name, (line.from_bus, line.phases))
        lower = line.to_bus if upper == line.from_bus else line.from_bus
        buses = [upper, *(f"{line.name}.{n}" for n in range(1, pieces)), lower]
        like = rng.random() < 0.3
        widened = int(rng.integers(0, pieces)) if rng.random() < 0.5 else 0
        for n, share in enumerate(rng.dirichlet(np.ones(pieces))):
            own = line if like else unlike(rng, line, f"{line.name}/{n}", codes)
            if n < widened:
                own = of_phases(own, wide, codes)
            ends = turned(rng, buses[n], buses[n + 1])
            km = line.length_km * float(share)
            lines.append(replace(own, name=f"{line.name}/{n}", length_km=km, **ends))
            if n + 1 < pieces and rng.random() < 0.3:
                lines += twig(rng, lines[-1], buses[n + 1])
            if n + 1 < pieces and len(own.phases) > 1 and rng.random() < 0.3:
                capacitors.append(
                    Capacitor(
                        name=f"{line.name}.C{n}",
                        place=Place(bus=buses[n + 1]),
                        connection="delta",
                        kvar=1.0,
                        phases=own.phases,
                    )
                )
    return replace(feeder, lines=tuple(lines), codes=tuple(codes), capacitors=tuple(capacitors))


def upper_ends(feeder: Feeder) -> dict[str, tuple[str, str]]:
    """The bus above every line that is in no loop, and the phases there."""
    closed = frozenset(switch.name for switch in feeder.switches)
    try:
        network = compile_network(feeder, closed)
    except InputError:
        return {}
    tree, found = network.tree, {}
    for line in feeder.lines:
        k = network.edges_of(line.name)[0]
        if k < tree.parent.size and not tree.in_loop[k] and len(network.edges_of(line.name)) == 1:
            upper = int(tree.parent[k])
            found[line.name] = (network.nodes[upper], letters(int(tree.node_phases[upper])))
    return found


def turned(rng: np.random.Generator, one: str, other: str) -> dict[str, str]:
    """Ends of a line, which may stand backwards."""
    ends = (one, other) if rng.random() < 0.7 else (other, one)
    return {"from_bus": ends[0], "to_bus": ends[1]}


def unlike(rng: np.random.Generator, line: Line, name: str, codes: list[LineCode]) -> Line:
    """The line built differently, by a code of its own where it has one."""
    size, factor = len(line.phases), float(rng.uniform(0.5, 2.0))
    if line.code is None:
        z1 = line.z1_ohm_per_km
        assert z1 is not None
        return replace(line, z1_ohm_per_km=z1 * factor)
    old = next(code for code in codes if code.name == line.code)
    about = rng.uniform(0.9, 1.1, (3, size, size))
    r, x, c = (
        rows(np.array(matrix) * (part + part.T) / 2.0)
        for matrix, part in zip(
            (old.r_ohm_per_km, old.x_ohm_per_km, old.c_nf_per_km or np.zeros((size, size))),
            about,
            strict=True,
        )
    )
    charging = None if old.c_nf_per_km is None else c
    codes.append(LineCode(name=name, r_ohm_per_km=r, x_ohm_per_km=x, c_nf_per_km=charging))
    return replace(line, code=name)


def rows(matrix: NDArray[np.float64]) -> tuple[tuple[float, ...], ...]:
    """As a code has them."""
    return tuple(tuple(float(value) for value in row) for row in matrix)


def of_phases(line: Line, phases: str, codes: list[LineCode]) -> Line:
    """A transposed line about like this one, in other phases."""
    if line.code is None:
        return replace(line, phases=phases)
    code = next(code for code in codes if code.name == line.code)
    z1 = 0.7 * complex(code.r_ohm_per_km[0][0], code.x_ohm_per_km[0][0])
    nf = 0.0 if code.c_nf_per_km is None else code.c_nf_per_km[0][0]
    own = {"z1_ohm_per_km": z1, "z0_ohm_per_km": 2.5 * z1, "c1_nf_per_km": nf, "c0_nf_per_km": nf}
    return replace(line, phases=phases, code=None, **own)


def twig(rng: np.random.Generator, like: Line, bus: str) -> list[Line]:
    """A dead end with a fork in it, of all the line's phases or of one."""
    name, far = f"{like.name}/twig", f"{like.name}.twig"
    first = replace(like, name=name, from_bus=bus, to_bus=far)
    if rng.random() < 0.4 and like.code is None:
        first = replace(first, phases=like.phases[0])
    return [
        first,
        replace(first, name=f"{name}/2", from_bus=far, to_bus=f"{far}.2"),
        replace(first, name=f"{name}/3", from_bus=f"{far}.3", to_bus=far),
    ]
