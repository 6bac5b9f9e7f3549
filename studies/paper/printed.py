"""What the paper prints, and the form in which ours stands beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from ...detector.criteria import Options, Settings

__all__ = ["PRINTED", "SETTINGS", "WITH_PHASES", "Basis", "Group", "Printed", "Row"]

Basis = Literal["circuit", "fit", "variant", "formula"]

SETTINGS = Settings(i_set_a=1.0, v_set_pu=0.05, z_set_ohm=5.0, options=Options(fallback=False))
"""The paper's: 1 A and 5 % in its Section V-A, 5 Ω in Section IV; by Z1, as it simulates."""

WITH_PHASES = replace(SETTINGS, options=Options(fallback=True))
"""The same, where phase quantities stand in below 1 A of |ΔI1|, as its Section VI suggests."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Printed:
    """A figure as the paper prints it, and where."""

    value: float
    where: str
    about: bool = False  #: the paper says "about"


PRINTED = {
    "dv_a_r3_pct": Printed(value=10.0, where="Fig. 10, Section V-B", about=True),
    "di_a_r3_a": Printed(value=3.0, where="Fig. 10, Section V-B", about=True),
    "z1_r1_ohm": Printed(value=0.396, where="Fig. 11, Section V-B"),
    "z1_r2_ohm": Printed(value=289.1, where="Fig. 12, Section V-B"),
    "eq_13_ohm": Printed(value=28.5, where="Section V-B", about=True),
    "z_a_1_ohm": Printed(value=28.1, where="Fig. 13, Section V-B"),
    "z_a_2_ohm": Printed(value=18.3, where="Fig. 13, Section V-B"),
    "z_a_3_ohm": Printed(value=14.5, where="Fig. 13, Section V-B"),
    "loop_ohm": Printed(value=2.21, where="Fig. 14, Section V-C"),
    "pv_ohm": Printed(value=23.4, where="Fig. 15, Section V-D", about=True),
}
"""All figures of the paper's results that a steady state can be compared with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One quantity: the paper's figure (None: it prints none), the model's, and why they differ.

    ``model`` is complex where the angle is worth showing, a text where it is a verdict.
    """

    name: str
    quantity: str
    unit: str
    model: complex | float | str
    digits: int  #: decimals in print
    basis: Basis
    paper: Printed | None = None
    why: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """What belongs to one figure of the paper."""

    name: str
    title: str
    rows: tuple[Row, ...]
