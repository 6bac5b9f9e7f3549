"""The study file that keeps measured load levels beside a feeder file."""

from __future__ import annotations

from collections.abc import Sequence

from ...model.reading.toml_file import toml_rows
from ..spec.fields import FORMAT
from ..spec.study_file import MeasuredLoad
from ..spec.values import as_table

__all__ = ["measured_study_text"]


def measured_study_text(measured: Sequence[MeasuredLoad], source: str) -> str:
    """Return a study file that has measured levels, and all else by default.

    Parameters
    ----------
    measured
        Of each measured place.
    source
        Name of the file that they were read from.

    Examples
    --------
    >>> from openphase.model.distributions import Uniform
    >>> own = MeasuredLoad(point="R2", level=Uniform(low=0.2, high=1.0))
    >>> print(measured_study_text([own], "peaks.csv"), end="")
    # measured levels from peaks.csv; all else is by default
    format = 1
    <BLANKLINE>
    [[measured]]
    point = "R2"
    level = [0.2, 1.0]
    """
    # a control character would end the comment
    name = "".join(letter if letter.isprintable() else "?" for letter in source)
    head = f"# measured levels from {name}; all else is by default\nformat = {FORMAT}\n"
    return head + "".join(f"\n[[measured]]\n{toml_rows(as_table(item))}" for item in measured)
