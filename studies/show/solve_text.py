"""What ``openphase solve`` prints for people, in 100 columns where names are short."""

from __future__ import annotations

from typing import Any

import numpy as np

from .sheet import wrapped

__all__ = ["solve_text"]

FLAGS = {
    "dead": "dead: an opened conductor leads to nothing, or nothing feeds what it leads to",
    "floating": "floating: what lies beyond the break has no path to earth in some phase",
    "unearthed": "unearthed: nothing earths a part behind an ungrounded winding; its common mode "
    "is taken as 0",
}


def solve_text(title: str, answer: dict[str, Any]) -> str:
    """The answer for people, in 100 columns where names are short."""
    wide = max(9, *(len(name) for name in answer["buses"])) + 2
    lines = [
        *wrapped(title),
        "",
        f"{'bus':<{wide}}{'|V| before, %':^27}  {'|V| after, %':^27}  {'|change|, %':^27}",
    ]
    for name, bus in answer["buses"].items():
        change = [
            None if b is None or a is None else [a[0] - b[0], a[1] - b[1]]
            for b, a in zip(bus["before"], bus["after"], strict=True)
        ]
        parts, scale = (bus["before"], bus["after"], change), 100.0 / bus["v_nominal_v"]
        lines.append(f"{name:<{wide}}" + "  ".join(_sizes(part, scale) for part in parts))
    lines.append(
        "in % of nominal there, phases a, b, c; –: not there, connected to nothing, or to no earth"
    )
    lines += [line for flag in answer["flags"] for line in wrapped(FLAGS[flag])]
    if answer["sections"]:
        lines += ["", *_terminal_rows(answer["sections"])]
    return "\n".join(lines) + "\n"


def _terminal_rows(sections: list[dict[str, Any]]) -> list[str]:
    """What each terminal sees: in positive sequence, then in phases."""
    names = [f"{row['local']}→{row['remote']}" for row in sections]
    wide = max(8, *(len(name) for name in names)) + 2
    lines = [
        f"{'terminal':<{wide}}{'|ΔI1| A':>9}{'|ΔI1*| A':>10}{'|ΔV1| %':>9}{'Z1 Ω':>19}  verdict"
    ]
    lines += [
        f"{name:<{wide}}{row['di1_a']:>9.4f}{row['di1_star_a']:>10.4f}"
        f"{row['dv1_pu'] * 100:>9.3f}{_polar(row['z1_ohm']):>19}  {row['reason']}"
        for name, row in zip(names, sections, strict=True)
    ]
    lines += ["", f"{'terminal':<{wide}}{'|ΔI| a, b, c, A':^27}  {'|Z| a, b, c, Ω':^33}"]
    for name, row in zip(names, sections, strict=True):
        currents = "".join(f"{value:>9.4f}" for value in row["di_abc_a"])
        impedances = "".join(
            f"{'undefined':>11}" if z is None else f"{abs(complex(*z)):>11.3f}"
            for z in row["zabc_ohm"]
        )
        lines.append(f"{name:<{wide}}{currents}  {impedances}")
    return lines


def _sizes(values: list[list[float] | None], scale: float) -> str:
    texts = ["–" if v is None else f"{abs(complex(*v)) * scale:.3f}" for v in values]
    return "".join(f"{text:>9}" for text in texts)


def _polar(value: list[float] | None) -> str:
    if value is None:
        return "undefined"
    z = complex(*value)
    return f"{abs(z):.4f}∠{np.degrees(np.angle(z)):.1f}°"
