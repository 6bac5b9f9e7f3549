"""What the user chooses about an OpenDSS circuit, and what an import refuses."""

from __future__ import annotations

import shlex
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

from ..errors import Fault, InputError
from ..reading.fields import did_you_mean
from .dss_live import element_names, fed_kw
from .dss_records import RawCapacitor, RawCircuit, RawTransformer
from .findings import Finding, Findings

__all__ = [
    "CapacitorStates",
    "Taps",
    "chosen",
    "fits",
    "raise_refusals",
    "with_states",
    "with_taps",
    "without",
]

Taps = Mapping[str, Mapping[str, float]]
"""Per transformer and winding (counted from "1") its turns over rated turns; others 1."""

CapacitorStates = Mapping[str, Sequence[int]]
"""Per capacitor which of its steps are in."""

_WEIGHED = 60
"""So many refused elements get their own share of load worked out; the rest only together."""


def with_taps(circuit: RawCircuit, taps: Taps) -> RawCircuit:
    """Return the circuit with these taps, every tap not named being 1."""

    def tapped(unit: RawTransformer) -> RawTransformer:
        given = taps.get(unit.name, {})
        windings = tuple(
            replace(winding, tap=float(given.get(str(n), 1.0)))
            for n, winding in enumerate(unit.windings, start=1)
        )
        return replace(unit, windings=windings)

    return replace(circuit, transformers=tuple(tapped(unit) for unit in circuit.transformers))


def with_states(circuit: RawCircuit, states: CapacitorStates) -> RawCircuit:
    """Return the circuit with these steps of its capacitors in."""

    def switched(bank: RawCapacitor) -> RawCapacitor:
        given = states.get(bank.name)
        return bank if given is None else replace(bank, states=tuple(int(s) for s in given))

    return replace(circuit, capacitors=tuple(switched(bank) for bank in circuit.capacitors))


def chosen(
    circuit: RawCircuit, drop: Collection[str], source: str
) -> tuple[tuple[str, ...], list[Fault]]:
    """Return the elements that ``class.name`` patterns mean, and each pattern that fits nothing."""
    known = element_names(circuit)
    found: list[str] = []
    faults = []
    for wanted in drop:
        fitting = sorted(name for name in known if fits(name, wanted))
        if not fitting:
            near = did_you_mean(wanted.lower(), sorted(known))
            rule = f"must be an element of the circuit{near}"
            faults.append(
                Fault(source=source, line=None, where="--drop", wanted=rule, found=repr(wanted))
            )
        found += fitting
    return tuple(dict.fromkeys(found)), faults


def fits(name: str, wanted: str) -> bool:
    """Tell whether a pattern means an element; only ``*`` stands for other letters.

    Examples
    --------
    >>> fits("load.a[1]", "Load.a[1]"), fits("load.a1", "load.*"), fits("load.a1", "load.a?")
    (True, True, False)
    """
    pattern = wanted.lower()
    # brackets are letters in a name
    return name == pattern or fnmatchcase(name, pattern.replace("[", "[[]").replace("?", "[?]"))


def without(circuit: RawCircuit, dropped: Collection[str], findings: Findings) -> RawCircuit:
    """Return the circuit without what is dropped or opened; what hung behind is then not fed."""
    opened = {element for element, whole in circuit.opened if whole}
    if dropped:
        lost = fed_kw(circuit, opened) - fed_kw(circuit, {*opened, *dropped})
        findings.note(f"{lost:.1f} kW of load went with what was dropped")
    for element in dropped:
        kind, _, name = element.partition(".")
        findings.add(kind, name, "dropped")
    for element, whole in circuit.opened:
        kind, _, name = element.partition(".")
        if element in dropped:
            continue
        if whole:
            findings.add(kind, name, "not fed", "opened at a terminal")
        else:
            findings.add(kind, name, "refused", "some of its conductors are open")
    gone = {*opened, *dropped}

    def keep(kind: str, name: str) -> bool:
        return f"{kind}.{name}" not in gone

    return replace(
        circuit,
        sources=tuple(x for x in circuit.sources if keep("vsource", x.name)),
        lines=tuple(x for x in circuit.lines if keep("line", x.name)),
        transformers=tuple(x for x in circuit.transformers if keep("transformer", x.name)),
        loads=tuple(x for x in circuit.loads if keep("load", x.name)),
        capacitors=tuple(x for x in circuit.capacitors if keep("capacitor", x.name)),
        reactors=tuple(x for x in circuit.reactors if keep("reactor", x.name)),
        plants=tuple(x for x in circuit.plants if keep(x.kind, x.name)),
        guards=tuple(x for x in circuit.guards if keep(x.kind, x.name)),
        others=tuple(x for x in circuit.others if keep(x.kind, x.name)),
    )


def raise_refusals(
    circuit: RawCircuit, findings: Findings, source: str, faults: Sequence[Fault] = ()
) -> None:
    """Refuse everything at once: how much load each carries, and what to drop.

    Parameters
    ----------
    faults
        What was found before.

    Raises
    ------
    InputError
        If anything was refused, or found before.
    """
    told = [*faults, *_refusals(circuit, findings, source)]
    if told:
        raise InputError(told)


def _refusals(circuit: RawCircuit, findings: Findings, source: str) -> list[Fault]:
    """Return a fault for each class and reason, and one for all of them."""
    refused = findings.of("refused")
    if not refused:
        return []
    total = fed_kw(circuit)
    groups: defaultdict[tuple[str, str], list[Finding]] = defaultdict(list)
    for row in refused:
        groups[(row.kind, row.how)].append(row)
    weighed = len(refused) <= _WEIGHED
    faults = []
    for (kind, why), rows in groups.items():
        names = ", ".join(repr(row.name) for row in rows[:5])
        more = f" and {len(rows) - 5} more" if len(rows) > 5 else ""
        lost = _share(circuit, [row.element for row in rows], total)
        each = ""
        if weighed and len(rows) > 1:
            shares = (f"{row.name} {_share(circuit, [row.element], total)}" for row in rows)
            each = f" ({', '.join(shares)})"
        drops = " ".join(f"--drop {shlex.quote(row.element)}" for row in rows)
        rule = f"cannot be imported: {why}; without it {lost} of the load goes{each}; {drops}"
        faults.append(Fault(source=source, line=None, where=f"{kind} {names}{more}", wanted=rule))
    if len(groups) > 1:
        lost = _share(circuit, [row.element for row in refused], total)
        rule = f"without all {len(refused)} of them {lost} of the load goes"
        faults.append(Fault(source=source, line=None, where="together:", wanted=rule))
    return faults


def _share(circuit: RawCircuit, elements: Collection[str], total: float) -> str:
    lost = total - fed_kw(circuit, set(elements))
    return f"{lost:.1f} kW, {100.0 * lost / total if total else 0.0:.1f} %"
