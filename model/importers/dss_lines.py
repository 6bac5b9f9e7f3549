"""Lines, their codes and the switches in them, out of an OpenDSS circuit's spans."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

from ..parts import Line, LineCode, Switch
from .dss_names import Names, clean, letters
from .dss_records import Matrix, RawGuard
from .dss_spans import Span, merged, rows_per_km
from .findings import Findings

__all__ = ["LineParts", "line_parts"]

_Build = tuple[Matrix, Matrix, Matrix]


@dataclass(slots=True, kw_only=True)
class LineParts:
    """What lines become, and the names given out on the way."""

    lines: list[Line] = field(default_factory=list)
    codes: dict[_Build, LineCode] = field(default_factory=dict)
    switches: list[Switch] = field(default_factory=list)
    names: Names = field(default_factory=Names)
    code_names: Names = field(default_factory=Names)
    switch_names: Names = field(default_factory=Names)


def line_parts(
    spans: Sequence[Span], guards: Sequence[RawGuard], buses: Names, findings: Findings
) -> LineParts:
    """Return the lines that spans become; fuses and the like stand in them as switches."""
    in_line: defaultdict[str, list[RawGuard]] = defaultdict(list)
    for guard in guards:
        in_line[guard.element.removeprefix("line.")].append(guard)
    parts = LineParts()
    known = {span.name for span in spans}
    for span in merged(spans, in_line.keys(), findings):
        ends = [buses.of(bus) for bus in span.buses]
        _put_guards(span, ends, in_line.get(span.name, ()), buses, parts, findings)
        parts.lines.append(
            Line(
                name=parts.names.of(span.name),
                from_bus=ends[0],
                to_bus=ends[1],
                length_km=span.length_km,
                phases=letters(span.nodes),
                code=_code(span, parts).name,
            )
        )
    for guard in guards:
        if guard.element.removeprefix("line.") not in known:
            why = f"it stands in {guard.element}, which is no line that is fed"
            findings.add(guard.kind, guard.name, "state kept", why)
    return parts


def _put_guards(
    span: Span,
    ends: list[str],
    guards: Sequence[RawGuard],
    buses: Names,
    parts: LineParts,
    findings: Findings,
) -> None:
    """Put a switch where a line is open, and where a fuse, recloser or relay stands in it."""
    whole = {end for end in (0, 1) if len(span.opened[end]) == len(span.nodes)}
    used = set(whole)
    for guard in guards:
        terminal = guard.terminal - 1
        if terminal in used or terminal not in (0, 1):
            findings.add(
                guard.kind, guard.name, "state kept", "it stands where a switch is already"
            )
            continue
        used.add(terminal)
        _put_switch(span, ends, terminal, guard.name, buses, parts)
        opened = letters(sorted(span.opened[terminal]))
        how = f"a switch, open in {', '.join(opened)}" if opened else "a switch, closed"
        findings.add(guard.kind, guard.name, "as it is", how)
    for terminal in (0, 1):
        if terminal in whole:
            note = f"line {span.name} is open: a switch of that name, normally open, at its end"
        elif span.opened[terminal] and terminal not in used:
            opened = letters(sorted(span.opened[terminal]))
            note = (
                f"line {span.name} is open in {', '.join(opened)}: two switches at its end, "
                f"normally open the one of that phase"
            )
        else:
            continue
        _put_switch(span, ends, terminal, span.name, buses, parts)
        findings.note(note)


def _put_switch(
    span: Span, ends: list[str], terminal: int, name: str, buses: Names, parts: LineParts
) -> None:
    """Put a switch between a bus and the line's end there, on a bus of its own.

    Where only some conductors are open there it is two switches, called after their phases too:
    what hangs behind the open conductor stays, and is fed through loads and windings alone.
    """
    inner = buses.new(f"{ends[terminal]}_{clean(name)}")
    start, end = (ends[terminal], inner) if terminal == 0 else (inner, ends[terminal])
    ends[terminal] = inner
    opened = [node for node in span.nodes if node in span.opened[terminal]]
    closed = [node for node in span.nodes if node not in opened]
    for nodes, shut in ((closed, True), (opened, False)):
        if nodes:
            phases = letters(sorted(nodes))
            wanted = f"{name}_{phases}" if opened and closed else name
            label = parts.switch_names.new(clean(wanted))
            parts.switches.append(
                Switch(name=label, from_bus=start, to_bus=end, closed=shut, phases=phases)
            )


def _code(span: Span, parts: LineParts) -> LineCode:
    """Return the code with the line's matrices per km, a new one where none is equal."""
    r, x, c = (
        rows_per_km(matrix, span.length_km) for matrix in (span.r_ohm, span.x_ohm, span.c_nf)
    )
    if (r, x, c) not in parts.codes:
        charged = any(value != 0.0 for row in c for value in row)
        parts.codes[(r, x, c)] = LineCode(
            name=parts.code_names.new(clean(span.build or span.name)),
            r_ohm_per_km=r,
            x_ohm_per_km=x,
            c_nf_per_km=c if charged else None,
        )
    return parts.codes[(r, x, c)]
