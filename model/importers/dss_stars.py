"""Loads from phases to a neutral that nothing earths: a star, which a feeder says as its mesh."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from ..parts import Load, Place
from .dss_live import Node
from .dss_names import Names, letters
from .dss_neutrals import Neutrals
from .dss_records import RawLoad
from .findings import Fate, Findings

__all__ = ["Ray", "Star", "add_stars", "floating_neutral"]

_EXACT = "a star about a neutral that nothing earths, as its mesh"
_NEAR = f"{_EXACT}: exact for constant impedances"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ray:
    """A branch of a star, from a phase to the neutral, and what it takes at ``kv``."""

    phase: int
    kva: complex
    kv: float

    @property
    def y_s(self) -> complex:
        """Its admittance at nominal voltage, in siemens."""
        return 1e-3 * self.kva.conjugate() / self.kv**2


@dataclass(frozen=True, slots=True, kw_only=True)
class Star:
    """A load's branches to a floating neutral; ``law`` is a load that has nothing but its law."""

    load: RawLoad
    law: Load
    rays: tuple[Ray, ...]
    hows: tuple[str, ...]  #: what is approximated in it so far
    kw: float


def floating_neutral(load: RawLoad, nodes: Collection[int], neutrals: Neutrals) -> Node | None:
    """Return the neutral of a load's branches that nothing but loads joins, None if held.

    Parameters
    ----------
    nodes
        Of all its branches.
    """
    own = {(load.end.bus, node) for node in nodes if node > 3}
    if len(own) != 1 or load.neutral_earthed or own & neutrals.held:
        return None
    return own.pop()


def add_stars(
    stars: Mapping[Node, Sequence[Star]], buses: Names, names: Names, findings: Findings
) -> list[Load]:
    """Return the loads that stars are, by their neutrals: one from phase to phase for each two."""
    return [row for star in stars.values() for row in _mesh(star, buses, names, findings)]


def _mesh(stars: Sequence[Star], buses: Names, names: Names, findings: Findings) -> list[Load]:
    """Return the mesh of all branches that meet at one neutral.

    Branches of admittance y_i about a free node are y_i y_j / (y_1 + y_2 + y_3) between each two
    phases: exact for constant impedances. Of two equal branches each has half the voltage, so
    that any law is exact.
    """
    by_phase: defaultdict[int, list[Ray]] = defaultdict(list)
    for star in stars:
        for ray in star.rays:
            by_phase[ray.phase].append(ray)
    y_s = {phase: sum(ray.y_s for ray in by_phase[phase]) for phase in sorted(by_phase)}
    kv = max(ray.kv for rays in by_phase.values() for ray in rays)
    if len(y_s) == 1:
        _tell(stars, "not fed", "nothing flows to its neutral, which nothing earths", findings)
        return []
    law = stars[0].law
    alike = all(star.law == law for star in stars)
    law = law if alike else replace(law, exponent=2.0, exponent_q=None, zip=None)
    total = sum(y_s.values())
    across = kv * (2.0 if len(y_s) == 2 else 3.0**0.5)
    pairs = {
        (p, q): 1e3 * across**2 * (y_s[p] * y_s[q] / total).conjugate()
        for p, q in combinations(y_s, 2)
    }
    if any(kva.real < 0.0 for kva in pairs.values()):
        why = "the mesh of the star about its neutral, which nothing earths, would generate"
        _tell(stars, "refused", why, findings)
        return []
    same = max(abs(y - total / len(y_s)) for y in y_s.values()) <= 1e-9 * abs(total)
    exact = alike and ((same and len(y_s) == 2) or _is_impedance(law))
    _tell(stars, "as it is" if exact else "approximated", _EXACT if exact else _NEAR, findings)
    first = stars[0].load
    row = replace(law, place=Place(bus=buses.of(first.end.bus)), connection="delta")
    if same and len(y_s) == 3:
        whole = sum(pairs.values(), start=0j)
        name = names.of(first.name)
        return [
            replace(row, name=name, phases="abc", kw=whole.real, kvar=whole.imag, branch_kv=across)
        ]
    return [
        replace(
            row,
            name=names.of(first.name if n == 0 else f"{first.name}_{n + 1}"),
            phases=letters(pair),
            kw=kva.real,
            kvar=kva.imag,
            branch_kv=across,
        )
        for n, (pair, kva) in enumerate(pairs.items())
    ]


def _is_impedance(law: Load) -> bool:
    """Whether it is a constant impedance at every voltage."""
    return law.exponent == 2.0 and law.exponent_q is None and law.zip is None


def _tell(stars: Sequence[Star], fate: Fate, how: str, findings: Findings) -> None:
    for star in stars:
        own: Fate = "approximated" if star.hows and fate == "as it is" else fate
        findings.add("load", star.load.name, own, "; ".join((*star.hows, how)), kw=star.kw)
