"""The detector's options as a sheet writes them: what differs from the defaults."""

from __future__ import annotations

from dataclasses import fields
from typing import get_args

from ...detector.criteria import BothEnds, Options

__all__ = ["options_text", "parse_options", "trigger_text"]

APART = ("negative_sign",)  #: options that have a column of their own

KNOWN = {field.name: field.default for field in fields(Options) if field.name not in APART}


def options_text(options: Options) -> str:
    """The options that are not at their defaults.

    Examples
    --------
    >>> options_text(Options(compensated=True, unbalance=0.1))
    'compensated=true; unbalance=0.1'
    >>> options_text(Options(negative_sign=False))
    ''
    """
    own = {name: getattr(options, name) for name in KNOWN}
    return "; ".join(f"{name}={_text(own[name])}" for name in KNOWN if own[name] != KNOWN[name])


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else f"{value}"


def parse_options(text: str, negative_sign: bool = True) -> Options:
    """Read what `options_text` writes.

    Raises
    ------
    ValueError
        Saying what is wrong, such as ``must be one of compensated, ..., got 'x'``.

    Examples
    --------
    >>> parse_options("compensated=true; unbalance=0.1").unbalance
    0.1
    """
    values: dict[str, bool | float | str] = {}
    for part in filter(None, (part.strip() for part in text.split(";"))):
        name, _, value = (piece.strip() for piece in part.partition("="))
        if name not in KNOWN:
            raise ValueError(f"must name options of {', '.join(KNOWN)}, got {name!r}")
        if name in values:
            raise ValueError(f"must name an option once, got {name} again")
        values[name] = _value(name, value)
    return Options(negative_sign=negative_sign, **values)  # type: ignore[arg-type]


def _value(name: str, text: str) -> bool | float | str:
    """An option's value, of the kind that its default is."""
    default = KNOWN[name]
    if isinstance(default, bool):
        if text not in ("true", "false"):
            raise ValueError(f"must give {name} as true or false, got {text!r}")
        return text == "true"
    if isinstance(default, str):
        if text not in get_args(BothEnds):
            raise ValueError(f"must give {name} as {', '.join(get_args(BothEnds))}, got {text!r}")
        return text
    try:
        number = float(text)
    except ValueError:
        number = -1.0
    if not 0.0 <= number < float("inf"):
        raise ValueError(f"must give {name} as a number >= 0, got {text!r}")
    return number


def trigger_text(options: Options) -> str:
    """What criterion (22) compares with I_set.

    Examples
    --------
    >>> trigger_text(Options()), trigger_text(Options(compensated=True, any_sequence=True))
    ('|dI1|', 'max(min(|dI1|, |dI1*|), |dI2|, |dI0|)')
    """
    first = "min(|dI1|, |dI1*|)" if options.compensated else "|dI1|"
    return f"max({first}, |dI2|, |dI0|)" if options.any_sequence else first
