"""How the report writes things: tables, pictures, counts and numbers."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable
from html import escape
from typing import Any

from .sheet import setting_text

__all__ = [
    "bound_text",
    "bullets",
    "class_trips_cell",
    "dependability_text",
    "ends",
    "false_trips_cell",
    "folded",
    "interval_text",
    "k_of_n",
    "margin_text",
    "percent",
    "picture",
    "right_cell",
    "setting_cell",
    "table",
]


def table(head: Iterable[str], rows: Iterable[str], kind: str = "") -> str:
    """A table; a heading that begins with # stands over numbers."""
    cells = "".join(
        f'<th class="n">{escape(text[1:])}</th>' if text[0] == "#" else f"<th>{escape(text)}</th>"
        for text in head
    )
    body = "\n".join(f"<tr>{row}</tr>" for row in rows)
    return (
        f'<div class="wide"><table class="{kind}">\n<thead><tr>{cells}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody>\n</table></div>\n"
    )


def bullets(items: Iterable[str]) -> str:
    """A list of plain texts."""
    return "<ul>\n" + "\n".join(f"<li>{escape(item)}</li>" for item in items) + "\n</ul>"


def folded(summary: str, body: str) -> str:
    """Something that opens when its summary is clicked; paper shows it open."""
    return f"<details><summary>{escape(summary)}</summary>\n{body}</details>\n"


def picture(name: str, alt: str, caption: str, pictures: dict[str, bytes]) -> str:
    """An embedded picture with its caption; ``pictures`` holds the PNGs by name."""
    data = base64.b64encode(pictures[name]).decode("ascii")
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f'<figure><img alt="{escape(alt)}" src="data:image/png;base64,{data}">{below}</figure>\n'


def right_cell(text: str) -> str:
    """A cell of numbers."""
    return f'<td class="n">{escape(text)}</td>'


def setting_cell(value: float | None, factor: float = 1.0) -> str:
    """A cell with the setting ``value`` times ``factor``; a dash for None."""
    return right_cell("–" if value is None else setting_text(value * factor))


def false_trips_cell(k: int | None, n: int | None) -> str:
    """A cell with k of n, marked where there was a trip."""
    bad = " bad" if k else ""
    return f'<td class="n{bad}">{escape(k_of_n(k, n))}</td>'


def class_trips_cell(own: dict[str, Any]) -> str:
    """A cell with the trips of one class, marked where they are false."""
    if own["kind"] == "must_not_trip":
        return false_trips_cell(own["trips"], own["trials"])
    return right_cell(k_of_n(own["trips"], own["trials"]))


def k_of_n(k: int | None, n: int | None) -> str:
    """A count, never without what it is a count of."""
    return "–" if k is None or n is None else f"{k:,} of {n:,}"


def percent(share: float, digits: int = 1) -> str:
    """A share in percent."""
    return f"{share * 100:.{digits}f} %"


def bound_text(value: float | None) -> str:
    """An upper bound of a probability."""
    return "–" if value is None else f"{value:.1e}"


def margin_text(row: dict[str, Any]) -> str:
    """A row's margin; infinite where no event could ever trip."""
    if row["i_set_a"] is None:
        return "–"
    return "∞" if row["margin"] is None else f"{row['margin']:.2f}"


def dependability_text(row: dict[str, Any]) -> str:
    """A row's dependability with its interval."""
    if row["dependability"] is None:
        return "–"
    interval = interval_text(row["dependability_low"], row["dependability_high"])
    return f"{percent(row['dependability'])} ({interval})"


def interval_text(low: float, high: float) -> str:
    """Both ends in percent, rounded outwards."""
    return f"{math.floor(low * 1000.0) / 10.0:.1f} .. {math.ceil(high * 1000.0) / 10.0:.1f} %"


def ends(grid: tuple[float, ...]) -> tuple[float, float]:
    """First and last of a grid of settings."""
    return grid[0], grid[-1]
