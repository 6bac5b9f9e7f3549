"""Laterals and low-voltage networks folded to loads at one bus each, every load with its name."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..buses import bus_volts
from ..parts import Feeder, InlineTransformer, Line, Load
from ..solver.assemble import law_factors
from .choose import ENDS, Choice, SeenRoot, best_equivalent
from .equivalent import Equivalent, Fit, Kind, SeenLoad, gain_through
from .foldable import fold_roots, kept_by_default
from .folded_part import FoldedPart, Seen, folded_part, seen_from_roots
from .rebuild import Stub, WasAt, free_name, moved_load, names_in, stub_of
from .root_volts import root_volts

__all__ = ["LEVEL", "WITHIN", "Folded", "FoldedRoot", "fold"]

Complex = NDArray[np.complex128]

LEVEL = 0.625
"""Level of the loads at which the fold is exact: the mean of what a study draws by default."""
WITHIN = 1e-3
"""A root gets an equivalent bus of its own where loads at the root would miss by more."""


NEW_BUSES: Mapping[Kind, int] = {"bus": 0, "line": 1, "units": 1, "both": 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class FoldedRoot:
    """What was folded at one bus, and what stands for it."""

    root: str
    buses: int  #: that are no more
    loads: int
    kw: float  #: of these loads, as the feeder had them
    km: float  #: of lines at the root's own voltage
    kind: Kind
    misfit: float  #: of the root's admittance with linear loads, at the worse end of ``ENDS``


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Folded:
    """A feeder with fewer buses, and an account of it."""

    feeder: Feeder
    buses_before: int
    buses_after: int
    level: float
    roots: tuple[FoldedRoot, ...]
    kept: frozenset[str]  #: buses of the feeder that are still there


def fold(
    feeder: Feeder,
    *,
    keep: Iterable[str] = (),
    level: float = LEVEL,
    within: float = WITHIN,
    kinds: Sequence[Kind] = ("bus", "line", "units", "both"),
) -> Folded:
    """Fold laterals and low-voltage networks.

    Kept are all three-phase buses of medium voltage, whatever a control or an event may act on
    (``foldable.kept_by_default``), the buses in ``keep``, and all on a way between these. Loads
    keep their names and laws, so that a study draws each one's factor as before; their power
    becomes what the root sees of it, and they stand at the root or at one bus beyond it.

    Parameters
    ----------
    feeder : Feeder
    keep : iterable of str
        Further buses that must stay.
    level : float
        Factor on all loads at which the fold is exact.
    within : float
        Relative error of a root's admittance up to which no bus is spent on it.
    kinds : sequence of str
        Equivalents to choose from, the first that is near enough or else the nearest.
    """
    volts = bus_volts(feeder)
    root_of = _loaded_ones(feeder, fold_roots(feeder, kept_by_default(feeder) | set(keep)))
    if not root_of:
        nothing = dict.fromkeys(("buses_before", "buses_after"), len(volts))
        return Folded(feeder=feeder, **nothing, level=level, roots=(), kept=frozenset(volts))
    part = folded_part(feeder, root_of)
    root_v = root_volts(feeder, part.roots, level)
    own = _rows_of_loads(part)
    state = seen_from_roots(part, root_v, level)
    seen = _seen_roots(part, state, root_v, own)
    km = _km(feeder, root_of, volts)
    how = Choice(kinds=kinds, within=within, level=level)
    chosen = [
        best_equivalent(how, each, km[root]) for each, root in zip(seen, part.roots, strict=True)
    ]
    accounts = _accounts(feeder, root_of, km, chosen)
    taken = names_in(feeder)
    stubs: list[Stub] = []
    moved: dict[str, Load] = {}
    for n, (account, (equivalent, _)) in enumerate(zip(accounts, chosen, strict=True)):
        rating = (max(account.kw, 1.0), volts[account.root])
        ends = (account.root, free_name(account.root, taken))
        hertz = feeder.source.frequency_hz
        stubs.append(stub_of(ends, equivalent, account.km, rating, hertz))
        v = gain_through(equivalent, level, seen[n].loads) @ root_v[n]
        for was, fit, rows in zip(
            _were_at(part, state, own[n], equivalent.fits), equivalent.fits, own[n], strict=True
        ):
            load = part.loads[part.branch_load[rows[0]]]
            moved[load.name] = moved_load(load, stubs[-1].bus, (fit, equivalent.paired), was, v)
    return Folded(
        feeder=_rebuilt(feeder, root_of, stubs, moved),
        buses_before=len(volts),
        buses_after=len(volts) - len(root_of) + sum(NEW_BUSES[each.kind] for each in accounts),
        level=level,
        roots=tuple(accounts),
        kept=frozenset(set(volts) - set(root_of)),
    )


def _loaded_ones(feeder: Feeder, root_of: Mapping[str, str]) -> dict[str, str]:
    """What hangs on a root without any load stays as it is: it is no more than its length."""
    places = (load.place.bus or "" for load in feeder.loads if load.place is not None)
    loaded = {root_of[bus] for bus in places if bus in root_of}
    return {bus: root for bus, root in root_of.items() if root in loaded}


def _seen_roots(
    part: FoldedPart, state: Seen, root_v: Complex, own: list[list[NDArray[np.int64]]]
) -> list[SeenRoot]:
    """What each root sees, at the level of the fold and around it."""
    bare = seen_from_roots(part, root_v, 0.0)
    ends = [seen_from_roots(part, root_v, at, state.branch_y_s).y_s for at in ENDS]
    return [
        SeenRoot(
            whole_s=state.y_s[n],
            bare_s=bare.y_s[n],
            ends_s=[y[n] for y in ends],
            loads=[
                SeenLoad(y_s=state.branch_y_s[k], gain=state.gain[k], bare_gain=bare.gain[k])
                for k in rows
            ],
        )
        for n, rows in enumerate(own)
    ]


def _rows_of_loads(part: FoldedPart) -> list[list[NDArray[np.int64]]]:
    """Of each root its loads, each as rows of the branches."""
    own: list[list[NDArray[np.int64]]] = [[] for _ in part.roots]
    for k in range(len(part.loads)):
        rows = np.flatnonzero(part.branch_load == k)
        own[part.owner[part.branch_from[rows[0]]]].append(rows)
    return own


def _were_at(
    part: FoldedPart, state: Seen, rows: Sequence[NDArray[np.int64]], fits: Sequence[Fit]
) -> list[WasAt]:
    """Where the loads of a root stood.

    Those that will stand alike, with one law, are given one voltage in pu, their mean by power:
    within a law's limits that changes nothing, and the solver looks them up but once.
    """
    size, weighted = defaultdict[object, float](float), defaultdict[object, float](float)
    keys, own = [], []
    for fit, branches in zip(fits, rows, strict=True):
        n = int(part.branch_load[branches[0]])
        v_pu = np.abs(state.branch_v[branches]) / part.branch_v[branches]
        power = float(np.abs(state.branch_y_s[branches] * state.branch_v[branches] ** 2).sum())
        keys.append((fit.phases, fit.connection, part.laws[n].tobytes()))
        own.append((n, v_pu, complex(state.branch_y_s[branches].mean())))
        size[keys[-1]] += power
        weighted[keys[-1]] += power * float(v_pu.mean())
    found = []
    for key, (n, v_pu, y) in zip(keys, own, strict=True):
        common = weighted[key] / size[key] if size[key] else float(v_pu.mean())
        laws = [law_factors(part.laws, n, v) for v in v_pu * (common / v_pu.mean())]
        g, b = np.mean(laws, axis=0)
        found.append(WasAt(y_s=y, factors=(float(g), float(b)), v_pu=common))
    return found


def _km(
    feeder: Feeder, root_of: Mapping[str, str], volts: Mapping[str, float]
) -> Mapping[str, float]:
    """Length of the folded lines at each root's own voltage."""
    km = defaultdict[str, float](float)
    for line in feeder.lines:
        root = root_of.get(line.from_bus) or root_of.get(line.to_bus)
        if root is not None and volts[line.from_bus] == volts[root]:
            km[root] += line.length_km
    return km


def _accounts(
    feeder: Feeder,
    root_of: Mapping[str, str],
    km: Mapping[str, float],
    chosen: Sequence[tuple[Equivalent, float]],
) -> list[FoldedRoot]:
    """What is folded at each root."""
    buses, loads = Counter(root_of.values()), Counter[str]()
    kw = defaultdict[str, float](float)
    for load in feeder.loads:
        root = root_of.get(load.place.bus or "") if load.place is not None else None
        if root is not None:
            loads[root] += 1
            kw[root] += load.kw
    return [
        FoldedRoot(
            root=root,
            buses=buses[root],
            loads=loads[root],
            kw=kw[root],
            km=km[root],
            kind=equivalent.kind,
            misfit=misfit,
        )
        for root, (equivalent, misfit) in zip(dict.fromkeys(root_of.values()), chosen, strict=True)
    ]


def _rebuilt(
    feeder: Feeder,
    root_of: Mapping[str, str],
    stubs: Sequence[Stub],
    moved: Mapping[str, Load],
) -> Feeder:
    """The feeder without what is folded, with what stands for it."""
    lines = [part for part in feeder.lines if not _is_folded(part, root_of)]
    lines += [stub.line for stub in stubs if stub.line is not None]
    units = [part for part in feeder.inline_transformers if not _is_folded(part, root_of)]
    units += [unit for stub in stubs for unit in stub.units]
    codes = [stub.code for stub in stubs if stub.code is not None]
    used = {line.code for line in lines}
    loads = tuple(moved.get(load.name, load) for load in feeder.loads)
    rows = {
        "lines": {line.name for line in lines},
        "inline_transformers": {unit.name for unit in units},
    }
    return replace(
        feeder,
        lines=tuple(lines),
        inline_transformers=tuple(units),
        codes=(*(code for code in feeder.codes if code.name in used), *codes),
        loads=loads,
        coordinates=tuple(at for at in feeder.coordinates if at.bus not in root_of),
        origins={
            key: origin
            for key, origin in feeder.origins.items()
            if key[0] not in rows or key[1] in rows[key[0]]
        },
    )


def _is_folded(part: Line | InlineTransformer, root_of: Mapping[str, str]) -> bool:
    return part.from_bus in root_of or part.to_bus in root_of
