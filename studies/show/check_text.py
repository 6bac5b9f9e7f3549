"""What ``openphase check`` prints for people, in 100 columns."""

from __future__ import annotations

import textwrap
from itertools import zip_longest
from typing import Any

from .sheet import PAGE, wrapped

__all__ = ["check_text"]

LONG_LIST = 16  #: columns in which a list of names may run on below itself
FEW = 8  #: in-line transformers that are named
MOST_NAMES = 60  #: names of a list; past them, how many more there are
INSIDE = ("units", "ders", "capacitors", "inline_transformers", "regulators", "switches")
"""What is listed as inside a section."""


def check_text(found: dict[str, Any]) -> str:
    """The summary for people, in 100 columns."""
    lines = [
        *wrapped(
            f"{found['feeder']}: no faults; {_volts(found)}, {_neutral(found)}, "
            f"{found['line_km']:.5g} km of line"
            f"{_shares(found['line_km_by_phases'])}, "
            f"{found['load_kw']:g} kW, {len(found['points'])} measuring points"
        ),
        *(line for text in found["points_by_default"] for line in wrapped(f"by default: {text}")),
        "",
        *(_sections(found["sections"]) or ["no sections: nothing to size"]),
        *(["?: the connection is unknown"] if _any_unknown(found["sections"]) else []),
        "",
        *_elements(found),
        *wrapped(_values(found)),
        "assumed:",
    ]
    for text in found["assumed"]:
        lines += wrapped(f"- {text}")
    return "\n".join(lines) + "\n"


def _volts(found: dict[str, Any]) -> str:
    at_points = [kv for kv in found["points_kv_ll"] if kv != found["kv_ll"]]
    source = f"{found['kv_ll']:g} kV"
    return f"{source} at the source, {_kv(at_points)} at the points" if at_points else source


def _neutral(found: dict[str, Any]) -> str:
    """Wires and neutral of the source, and at the points where those are others.

    Examples
    --------
    >>> source = {"wires": 3, "neutral": "isolated"}
    >>> _neutral({**source, "points_wires": [3], "points_neutral": ["isolated"]})
    '3 wires, neutral isolated'
    >>> _neutral({**source, "points_wires": [4], "points_neutral": ["solid"]})
    '3 wires, neutral isolated at the source (4 wires, neutral solid at the points)'
    """
    source = f"{found['wires']} wires, neutral {found['neutral']}"
    wires, neutrals = found["points_wires"], found["points_neutral"]
    if not neutrals or (wires == [found["wires"]] and neutrals == [found["neutral"]]):
        return source
    points = f"{' and '.join(map(str, wires))} wires, neutral {' and '.join(neutrals)}"
    return f"{source} at the source ({points} at the points)"


def _kv(values: list[float]) -> str:
    return f"{' and '.join(f'{kv:g}' for kv in values)} kV"


def _any_unknown(sections: list[dict[str, Any]]) -> bool:
    return any(row["yg_d_unknown"] for row in sections)


def _elements(found: dict[str, Any]) -> list[str]:
    """What stands on the feeder beside lines, loads and transformers, and in which section."""
    parts = {
        "ties, normally open": found["loop"],
        "DER": [f"{d['name']} ({d['kw']:g} kW, {d['model']})" for d in found["ders"]],
        "capacitors": [
            f"{c['name']} ({c['kvar']:g} kvar, {c['connection']})" for c in found["capacitors"]
        ],
        "regulators": [
            f"{r['name']} (taps {', '.join(f'{tap:+d}' if tap else '0' for tap in r['taps'])})"
            for r in found["regulators"]
        ],
    }
    if found["inline_transformers"]:
        parts["in-line transformers"] = _inline(found["inline_transformers"])
    lines = []
    for what, names in parts.items():
        lines += wrapped(f"{what}: {_listed(names) or 'none'}")
    for row in found["sections"]:
        name, laterals = f"{row['local']}–{row['remote']}", row["laterals_km_by_phases"]
        if sum(laterals):
            lines += wrapped(f"laterals inside {name}: {sum(laterals):.4g} km{_shares(laterals)}")
        if row["shifted_by"]:
            lines += wrapped(
                f"note: {', '.join(row['shifted_by'])} inside {name} turns all phasors by 30 "
                "degrees between its two ends, and so the impedance that is judged"
            )
        if row["regulators"]:
            lines += wrapped(
                f"note: inside {row['local']}–{row['remote']} the taps of "
                f"{', '.join(row['regulators'])} may change, which looks like an open phase"
            )
    return lines


def _inline(rows: list[dict[str, Any]]) -> list[str]:
    """In-line transformers, of a kind together: connection and voltages."""
    kinds: dict[str, list[str]] = {}
    for row in rows:
        kind = f"{row['connection']}, {row['kv'][0]:g}/{row['kv'][1]:g} kV"
        kinds.setdefault(kind, []).append(row["name"])
    return [
        f"{names[0] if len(names) == 1 else len(names)} ({kind})" for kind, names in kinds.items()
    ]


def _inside(row: dict[str, Any]) -> str:
    """What stands inside a section; of very many in-line transformers only how many."""
    few = [
        name
        for kind in INSIDE
        if kind != "inline_transformers" or len(row[kind]) <= FEW
        for name in row[kind]
    ]
    count = len(row["inline_transformers"])
    return _listed([*few, *([f"{count} in-line transformers"] if count > FEW else [])])


def _shares(km: list[float]) -> str:
    """Length by one, two and three phases in words; nothing where all have three.

    Examples
    --------
    >>> _shares([3.0, 1.0, 6.0]), _shares([0.0, 0.0, 6.0])
    (' (60 % with three phases, 10 % with two, 30 % with one)', '')
    """
    one, two, three = (100.0 * own / (sum(km) or 1.0) for own in km)
    if three == 100.0 or not sum(km):
        return ""
    return f" ({three:.0f} % with three phases, {two:.0f} % with two, {one:.0f} % with one)"


def _listed(names: list[str]) -> str:
    """Names, cut where they are many; the JSON has them all.

    Examples
    --------
    >>> _listed([str(n) for n in range(70)])[-22:]
    '57, 58, 59 and 10 more'
    """
    more = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def _values(found: dict[str, Any]) -> str:
    """How many values come from where."""
    counts = ", ".join(f"{count} {origin}" for origin, count in found["values"].items() if count)
    source = found["imported_from"]
    return f"values: {counts}{f' (from {source})' if source else ''}"


def _sections(rows: list[dict[str, Any]]) -> list[str]:
    """The table of the sections; none where there is no section."""
    if not rows:
        return []
    cells = [["section", "km", "|Z1| Ω", "downstream kW", "Yg/D known", "Yg/D possible", "inside"]]
    for row in rows:
        low, high = row["downstream_kw"]
        cells.append(
            [
                f"{row['local']}–{row['remote']}",
                f"{row['length_km']:g}",
                f"{abs(complex(*row['line_z1_ohm'])):.3f}",
                f"{low:.0f} .. {high:.0f}",
                _listed(row["yg_d"]) or "-",
                _listed([*row["yg_d_sampled"], *(f"{n}?" for n in row["yg_d_unknown"])]) or "-",
                _inside(row) or "-",
            ]
        )
    wide = [max(len(line[n]) for line in cells) for n in range(7)]
    # long names stand above their row, long lists run on below themselves
    wide[4:6] = [min(w, LONG_LIST) for w in wide[4:6]]
    beside = sum(wide[:6]) + 2 * 6 + min(wide[6], LONG_LIST) <= PAGE
    if not beside:
        wide[0] = 0
    wide[6] = min(wide[6], PAGE - sum(wide[:6]) - 2 * 6)
    lines = []
    for name, *rest in cells:
        if not beside:
            lines += wrapped(name)
        parts = [[name if beside else ""], *([text] for text in rest[:3])]
        parts += [textwrap.wrap(text, w) for text, w in zip(rest[3:], wide[4:], strict=True)]
        for own in zip_longest(*parts, fillvalue=""):
            padded = (
                f"{text:>{w}}" if n in (1, 2, 3) else f"{text:<{w}}"
                for n, (text, w) in enumerate(zip(own, wide, strict=True))
            )
            lines.append("  ".join(padded).rstrip())
    return lines
