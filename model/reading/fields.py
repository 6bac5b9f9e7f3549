"""Tables of a user's file, described field by field.

One `Field` is the only place that knows a key's kind, unit, range and default: the
checks (`table_check`), their messages and the tables of the documentation follow from it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal

__all__ = [
    "Field",
    "Kind",
    "as_toml",
    "bounds_of",
    "describe_field",
    "did_you_mean",
    "markdown_table",
]

Kind = Literal[
    "name",
    "text",
    "number",
    "integer",
    "flag",
    "impedance",
    "range",
    "numbers",
    "integers",
    "matrix",
    "phases",
    "table",
    "tables",
    "distribution",
    "whole",
    "choice",
    "names",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """One key of a table.

    Parameters
    ----------
    name
        The key.
    kind
        What its value must be:

        - ``name``: printable text without a colon or space around it;
        - ``text``: any text, or one of `choices`;
        - ``number``: finite, an integer will do; ``integer``; ``flag``: true or false;
        - ``impedance``: ``[r, x]`` or ``{ mag, deg }``, bounds are on the magnitude and
          the resistance is never negative;
        - ``range``: ``[low, high]``; ``numbers``, ``integers``: a list; bounds are on each;
        - ``matrix``: rows of numbers, 1 to 3 of them, symmetric; bounds are on the diagonal;
        - ``phases``: one to three of the letters a, b, c;
        - ``table``, ``tables``: one table, an array of tables; not checked any deeper;
        - ``distribution``, ``whole`` (of whole numbers), ``choice`` (of texts), ``names``:
          what a study file has besides, checked there.
    doc
        One sentence for the documentation.
    unit
        Unit of the number, empty where it has none.
    low, high
        Bounds that the number may reach.
    above
        Lower bound that the number must exceed.
    not_zero
        The number must differ from 0.
    choices
        The only texts allowed, if any.
    respell
        Pairs ``(variant, standard)``, replaced inside a text before it is checked.
    refused
        Pairs ``(pattern, why)`` of texts that have a meaning, but one that the model cannot
        represent: a text that the whole pattern fits is refused with the reason.
    count
        How many numbers a list must hold, if that is fixed.
    required
        The key must be there.
    default
        Value of an absent key; None where absence itself means something.
    same_as
        An absent key takes the value of this other one, which stands before it.
    absent
        What it means that an optional key without default is absent, where that is an
        assumption about the feeder.
    """

    name: str
    kind: Kind
    doc: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    above: float | None = None
    not_zero: bool = False
    choices: tuple[str, ...] = ()
    respell: tuple[tuple[str, str], ...] = ()
    refused: tuple[tuple[str, str], ...] = ()
    count: int | None = None
    required: bool = False
    default: object = None
    same_as: str = ""
    absent: str = ""


def did_you_mean(found: str, known: Iterable[str]) -> str:
    """Return `` (did you mean ...?)`` with the nearest of the known names, or nothing.

    Examples
    --------
    >>> did_you_mean("lenght_km", ["name", "length_km"])
    " (did you mean 'length_km'?)"
    >>> did_you_mean("kW", ["name", "kw"])
    " (did you mean 'kw'?)"
    """
    spelled = {name.lower(): name for name in known}
    near = get_close_matches(found.lower(), list(spelled), n=1)
    return f" (did you mean {spelled[near[0]]!r}?)" if near else ""


_KIND_WORDS: dict[Kind, str] = {
    "name": "a name",
    "text": "text",
    "number": "a finite number",
    "integer": "an integer",
    "flag": "true or false",
    "impedance": "[r, x] or { mag = ..., deg = ... }",
    "range": "[low, high]",
    "numbers": "a list of finite numbers",
    "integers": "a list of integers",
    "matrix": "a symmetric matrix, [[...], ...] of 1 to 3 rows",
    "phases": "one to three of the letters a, b, c",
    "table": "a table",
    "tables": "an array of tables",
    "distribution": "a number, [low, high] or a distribution",
    "whole": "a whole number, [least, most] or a distribution of whole numbers",
    "choice": "a text, a list of texts or { values = [...], weights = [...] }",
    "names": "a list of names",
}


def bounds_of(field: Field) -> str:
    """Return the range a number must lie in, such as ``-1 to 1, not 0``; may be empty."""
    low, high = field.low, field.high
    parts = []
    if low is not None and high is not None:
        parts.append(f"{low:g}" if low == high else f"{low:g} to {high:g}")
    elif low is not None:
        parts.append(f">= {low:g}")
    if field.above is not None:
        parts.append(f"> {field.above:g}")
    if high is not None and low is None:
        parts.append(f"<= {high:g}")
    if field.not_zero:
        parts.append("not 0")
    return ", ".join(parts)


def _choices(field: Field) -> str:
    return " or ".join(repr(choice) for choice in field.choices)


def describe_field(field: Field) -> str:
    """Return what the field takes, such as ``a finite number, km, > 0``."""
    if field.choices:
        return _choices(field)
    words = _KIND_WORDS[field.kind]
    if field.count is not None:
        words = words.replace("a list of", f"a list of {field.count}")
    return ", ".join(filter(None, (words, field.unit, bounds_of(field))))


def as_toml(value: object) -> str:
    """Return a parsed value much as the user wrote it, long ones cut short.

    Examples
    --------
    >>> as_toml({"mag": 0.9, "deg": True})
    '{ mag = 0.9, deg = true }'
    """
    text = _as_toml(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _as_toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (str, int, float)):
        return repr(value)
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_as_toml(item) for item in value)}]"
    if isinstance(value, complex):
        return _as_toml([value.real, value.imag])
    if isinstance(value, Mapping):
        inside = ", ".join(f"{key} = {_as_toml(item)}" for key, item in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    return str(value)


def markdown_table(fields: Sequence[Field]) -> str:
    """Return the fields as the table that the documentation shows."""
    head = ["field", "kind", "unit", "range", "default", "meaning"]
    rows = [head, ["---"] * len(head), *(_markdown_row(field) for field in fields)]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _markdown_row(field: Field) -> list[str]:
    bounds = ", ".join(f"`{choice}`" for choice in field.choices) or bounds_of(field)
    if field.required:
        default = "required"
    elif field.same_as:
        default = f"as `{field.same_as}`"
    else:
        default = (field.absent or "–") if field.default is None else f"`{as_toml(field.default)}`"
    return [f"`{field.name}`", field.kind, field.unit or "–", bounds or "–", default, field.doc]
