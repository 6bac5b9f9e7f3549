"""Values that only a study file has: distributions and lists of names, read and written.

Every reader reports what is wrong, and returns a harmless value then.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from ...model.distributions import (
    Choices,
    Distribution,
    Fixed,
    Integers,
    Lognormal,
    Normal,
    Quantiles,
    Triangular,
    Uniform,
    Values,
)
from ...model.errors import KeyPath, Report
from ...model.reading.fields import Field, Kind, as_toml, bounds_of, describe_field, did_you_mean
from ...model.reading.table_check import check_table

__all__ = ["READERS", "Reader", "as_table", "distribution_text"]

Reader = Callable[[object, Field, KeyPath, Report], object]

_STAND_IN = Fixed(value=1.0)

_MOST_INTEGER = 1e5
"""Far more than any count or tap, and small enough for a float to hold it exactly."""

_SHAPES: dict[str, tuple[Callable[..., Distribution], dict[str, tuple[str, ...]]]] = {
    "uniform": (Uniform, {"uniform": ("low", "high")}),
    "normal": (Normal, {"normal": ("mean", "sd"), "within": ("low", "high")}),
    "lognormal": (Lognormal, {"lognormal": ("median", "sigma"), "within": ("low", "high")}),
    "triangular": (Triangular, {"triangular": ("low", "mode", "high")}),
    "integers": (Integers, {"integers": ("least", "most")}),
}
"""The distributions that a table of a few numbers describes: by the key that tells which it
is, the class, and what the numbers under each key of the table are."""


# ---- reading distributions ----


def _read_distribution(value: object, field: Field, path: KeyPath, report: Report) -> Distribution:
    """Return the distribution that is written as a number, ``[low, high]`` or a table."""
    faults = len(report.faults)
    found = _read_any(value, field, path, report)
    if len(report.faults) == faults:
        rule = found.fault() or _misfit(found, field)
        if rule is None:
            return found
        report.add(path, rule, as_toml(value))
    return _STAND_IN


def _read_any(value: object, field: Field, path: KeyPath, report: Report) -> Distribution:
    if isinstance(value, Mapping):
        return _read_shape(value, path, report)
    if isinstance(value, list):
        low, high = _plain_value(value, replace(field, kind="range"), path, report)
        if field.kind == "whole" and low.is_integer() and high.is_integer():
            return Integers(least=int(low), most=int(high))
        return Uniform(low=low, high=high)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return Fixed(value=_plain_value(value, replace(field, kind="number"), path, report))
    report.add(path, f"must be {describe_field(field)}", as_toml(value))
    return _STAND_IN


def _plain_value(value: object, field: Field, path: KeyPath, report: Report) -> Any:
    """Return a value whose kind is one of those that any file has."""
    return check_table({field.name: value}, [field], path[:-1], report)[field.name]


def _read_shape(value: Mapping[str, object], path: KeyPath, report: Report) -> Distribution:
    """Return the distribution of a table such as ``{ normal = [..], within = [..] }``."""
    known = (*_SHAPES, "quantiles", "values")
    shapes = [key for key in known if key in value]
    if len(shapes) != 1:
        report.add(path, f"must have just one of the keys {', '.join(known)}", as_toml(value))
        return _STAND_IN
    (shape,) = shapes
    if shape == "values":
        return Values(**check_table(value, _VALUES, path, report))
    if shape == "quantiles":
        return _read_quantiles(value, path, report)
    kind, keys = _SHAPES[shape]
    faults = len(report.faults)
    number: Kind = "integers" if shape == "integers" else "numbers"
    most = _MOST_INTEGER if shape == "integers" else None
    wanted = [
        Field(name=key, kind=number, low=most and -most, high=most, required=True, doc="")
        for key in keys
    ]
    given = check_table(value, wanted, path, report)
    named: dict[str, float] = {}
    for key, names in keys.items():
        if len(report.faults) == faults and len(given[key]) != len(names):
            report.add((*path, key), f"must be [{', '.join(names)}]", as_toml(value[key]))
        named |= zip(names, given[key], strict=False)
    return kind(**named) if len(report.faults) == faults else _STAND_IN


def _read_quantiles(value: Mapping[str, object], path: KeyPath, report: Report) -> Distribution:
    faults = len(report.faults)
    found = Quantiles(values=check_table(value, _QUANTILES, path, report)["quantiles"])
    return found if len(report.faults) == faults and found.values else _STAND_IN


_QUANTILES = (Field(name="quantiles", kind="numbers", required=True, doc=""),)

_VALUES = (
    Field(name="values", kind="numbers", required=True, doc=""),
    Field(name="weights", kind="numbers", default=(), doc=""),
)


def _misfit(found: Distribution, field: Field) -> str | None:
    """Return the rule of the field that the distribution breaks, or None."""
    low, high = found.support
    fits = (
        (field.low is None or low >= field.low)
        and (field.high is None or high <= field.high)
        and (field.above is None or low > field.above)
    )
    if not fits:
        return f"must give numbers {bounds_of(field)}"
    return "must give whole numbers" if field.kind == "whole" and not found.whole else None


# ---- reading texts ----


def _read_choice(value: object, field: Field, path: KeyPath, report: Report) -> Choices:
    """Return the choice that is written as a text, a list of texts, or with weights."""
    weights: tuple[float, ...] = ()
    found = [value] if isinstance(value, str) else value
    if isinstance(value, Mapping):
        faults = len(report.faults)
        rest = {key: item for key, item in value.items() if key != "values"}
        weights = check_table(rest, _VALUES[1:], path, report)["weights"]
        found = value.get("values")
        if len(report.faults) > faults:
            return Choices(values=field.choices)
    texts = [text for text in found if isinstance(text, str)] if isinstance(found, list) else []
    if texts != found:
        written = "a text, a list of texts or { values = [...], weights = [...] }"
        report.add(path, f"must be {written}", as_toml(value))
        return Choices(values=field.choices)
    for variant, standard in field.respell:
        texts = [text.replace(variant, standard) for text in texts]
    choices = Choices(values=tuple(texts), weights=weights)
    strange = [text for text in texts if text not in field.choices]
    for text in strange:
        rule = f"must be {describe_field(field)}{did_you_mean(text, field.choices)}"
        report.add(path, rule, repr(text))
    fault = choices.fault()
    if fault is not None and not strange:
        report.add(path, fault, as_toml(value))
    return choices


def _read_names(value: object, field: Field, path: KeyPath, report: Report) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        report.add(path, "must be a list of names", as_toml(value))
        return ()
    for index, name in enumerate(value):
        if name in value[:index]:
            report.add((*path, index), "must be there once", repr(name))
        elif field.choices and name not in field.choices:
            report.add(
                (*path, index), f"is not known{did_you_mean(name, field.choices)}", repr(name)
            )
    return tuple(value)


READERS: dict[Kind, Reader] = {
    "distribution": _read_distribution,
    "whole": _read_distribution,
    "choice": _read_choice,
    "names": _read_names,
}
"""The readers of those kinds that `check_table` does not know."""


# ---- writing ----


def as_table(part: object) -> dict[str, object]:
    """Return a part of a study as TOML parses it; what is None is left out.

    Examples
    --------
    >>> from openphase.studies.spec.events import LineFaultDraw
    >>> as_table(LineFaultDraw())
    {'ohm': [0.1, 10.0], 'earth_share': 0.5}
    """
    assert is_dataclass(part)
    row = {field.name: getattr(part, field.name) for field in fields(part)}
    return {key: _plain(value) for key, value in row.items() if value is not None}


def _plain(value: object) -> object:
    if isinstance(value, (Distribution, Choices)):
        return _plain_distribution(value)
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return as_table(value) if is_dataclass(value) else value


def _plain_distribution(value: Distribution | Choices) -> object:
    if isinstance(value, Fixed):
        return float(value.value)
    if isinstance(value, Uniform):
        return [float(value.low), float(value.high)]
    if isinstance(value, Quantiles):
        return {"quantiles": list(value.values)}
    if isinstance(value, (Values, Choices)):
        row = {"values": list(value.values), "weights": list(value.weights)}
        return row if value.weights else {"values": row["values"]}
    (keys,) = (keys for kind, keys in _SHAPES.values() if kind is type(value))
    return {key: [getattr(value, name) for name in names] for key, names in keys.items()}


# ---- telling ----


def distribution_text(drawn: Distribution | Choices) -> str:
    """Return what is drawn, in words for a report.

    Examples
    --------
    >>> distribution_text(Uniform(low=0.25, high=1.0))
    '0.25 to 1'
    >>> distribution_text(Choices(values=("D/Yg", "Yg/Yg"), weights=(3.0, 1.0)))
    'D/Yg (75 %) or Yg/Yg (25 %)'
    """
    if isinstance(drawn, (Values, Choices)):
        weights = drawn.weights or (1.0,) * len(drawn.values)
        shares = [f" ({weight / sum(weights):.0%})".replace("%", " %") for weight in weights]
        names = [item if isinstance(item, str) else f"{item:g}" for item in drawn.values]
        return " or ".join(
            name + (share if drawn.weights else "")
            for name, share, weight in zip(names, shares, weights, strict=True)
            if weight
        )
    low, high = (f"{end:g}" for end in drawn.support)
    if isinstance(drawn, Normal):
        return f"normal, {drawn.mean:g} ± {drawn.sd:g}, from {low} to {high}"
    if isinstance(drawn, Lognormal):
        return f"lognormal, median {drawn.median:g}, σ {drawn.sigma:g}, from {low} to {high}"
    if isinstance(drawn, Triangular):
        return f"{low} to {high}, likeliest {drawn.mode:g}"
    if isinstance(drawn, Quantiles):
        return f"as measured, {low} to {high}, median {float(drawn.quantile(np.array(0.5))):g}"
    return low if low == high else f"{low} to {high}"
