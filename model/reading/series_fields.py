"""The fields of what joins two buses: lines and their codes, transformers, regulators, switches."""

from __future__ import annotations

from dataclasses import replace

from . import feeder_refused as refused
from .fields import Field

__all__ = ["CODES", "INLINE_TRANSFORMERS", "LINES", "PHASES", "REGULATORS", "SWITCHES"]

PHASES = Field(name="phases", kind="phases", default="abc", doc="The conductors it has.")

CODES: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="Name that lines refer to."),
    Field(
        name="r_ohm_per_km",
        kind="matrix",
        unit="ohm/km",
        low=0.0,
        required=True,
        doc="Series resistance, a row for each conductor, the neutral reduced.",
    ),
    Field(
        name="x_ohm_per_km",
        kind="matrix",
        unit="ohm/km",
        low=0.0,
        required=True,
        doc="Series reactance at the source's frequency.",
    ),
    Field(
        name="c_nf_per_km",
        kind="matrix",
        unit="nF/km",
        low=0.0,
        absent="no charging",
        doc="Nodal capacitance: off the diagonal, what is between conductors counts negative.",
    ),
)

LINES: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="Not ending in `.p` or `.q`."),
    Field(name="from", kind="name", required=True, doc="Bus that fractions are counted from."),
    Field(name="to", kind="name", required=True, doc="Bus at the other end."),
    Field(
        name="length_km", kind="number", unit="km", above=0.0, required=True, doc="Route length."
    ),
    replace(PHASES, doc="The conductors it has, in the order of its code's rows."),
    Field(
        name="code",
        kind="name",
        doc="How it is built; or give `z1_ohm_per_km` and `z0_ohm_per_km`.",
    ),
    Field(
        name="z1_ohm_per_km",
        kind="impedance",
        unit="ohm/km",
        above=0.0,
        doc="Positive-sequence series impedance of a transposed line.",
    ),
    Field(
        name="z0_ohm_per_km",
        kind="impedance",
        unit="ohm/km",
        above=0.0,
        doc="Its zero-sequence series impedance.",
    ),
    Field(
        name="c1_nf_per_km",
        kind="number",
        unit="nF/km",
        low=0.0,
        default=0.0,
        doc="Its positive-sequence charging.",
    ),
    Field(
        name="c0_nf_per_km",
        kind="number",
        unit="nF/km",
        low=0.0,
        default=0.0,
        doc="Its zero-sequence charging, at most `c1_nf_per_km`.",
    ),
)

INLINE_TRANSFORMERS: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="The unit's name."),
    Field(name="from", kind="name", required=True, doc="Bus of the from-windings."),
    Field(name="to", kind="name", required=True, doc="Bus of the to-windings."),
    Field(
        name="connection",
        kind="text",
        choices=(
            "Yg/Yg",
            "Y/Yg",
            "Yg/Y",
            "Y/Y",
            "D/Yg",
            "D/Y",
            "Yg/D",
            "Y/D",
            "D/D",
            "single",
            "centre-tap",
        ),
        respell=(("\N{GREEK CAPITAL LETTER DELTA}", "D"), ("\N{INCREMENT}", "D")),
        refused=refused.INLINE_CONNECTIONS,
        required=True,
        doc="Windings, from-side first; Y without g: its neutral is not earthed.",
    ),
    Field(
        name="rating_kva",
        kind="number",
        unit="kVA",
        above=0.0,
        required=True,
        doc="Rating of all its phases together.",
    ),
    Field(
        name="kv_from",
        kind="number",
        unit="kV",
        above=0.0,
        high=1000.0,
        required=True,
        doc="Line to line; of `single` and `centre-tap` that of the winding.",
    ),
    Field(
        name="kv_to",
        kind="number",
        unit="kV",
        above=0.0,
        high=1000.0,
        required=True,
        doc="Line to line; of `single` that of the winding, of `centre-tap` from leg to leg.",
    ),
    Field(
        name="leakage_pu",
        kind="impedance",
        unit="pu",
        high=1.0,
        required=True,
        doc="Leakage, not 0; of `centre-tap` the from-winding's branch of the star, maybe 0.",
    ),
    Field(
        name="leg_leakage_pu",
        kind="impedance",
        unit="pu",
        above=0.0,
        high=1.0,
        doc="Of either leg's branch of the star, for `centre-tap` only, which needs it.",
    ),
    Field(
        name="magnetizing_pu",
        kind="impedance",
        unit="pu",
        high=1.0,
        default=0j,
        doc="Admittance across the to-windings, `[g, -b]`.",
    ),
    Field(
        name="from_tap",
        kind="number",
        low=0.5,
        high=2.0,
        default=1.0,
        doc="Turns of the from-windings over their rated turns.",
    ),
    Field(
        name="to_tap",
        kind="number",
        low=0.5,
        high=2.0,
        default=1.0,
        doc="The same of the to-windings.",
    ),
    replace(
        PHASES,
        doc="At `from`, of `single` and `centre-tap`: one to earth, or two in their order.",
    ),
    replace(
        PHASES,
        name="to_phases",
        doc="At `to`: the same; of `centre-tap` its two legs.",
    ),
    Field(
        name="shift",
        kind="text",
        choices=("lag", "lead"),
        default="lag",
        doc="What phase a does at `to`, by 30 degrees, where one side is D and the other Y.",
    ),
    Field(
        name="from_neutral_ohm",
        kind="impedance",
        unit="ohm",
        default=0j,
        doc="Between the neutral of a Yg from-winding and earth.",
    ),
    Field(
        name="to_neutral_ohm",
        kind="impedance",
        unit="ohm",
        default=0j,
        doc="Between the neutral of a Yg to-winding and earth.",
    ),
)

REGULATORS: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="The regulator's name."),
    Field(name="from", kind="name", required=True, doc="Bus whose voltage it steps."),
    Field(name="to", kind="name", required=True, doc="Bus that gets the stepped voltage."),
    Field(
        name="taps",
        kind="integers",
        count=3,
        default=(0, 0, 0),
        doc="Tap positions of phases a, b, c; each adds tap x `step_pct` of its voltage at `from`.",
    ),
    Field(
        name="step_pct",
        kind="number",
        unit="%",
        above=0.0,
        high=5.0,
        default=0.625,
        doc="Voltage of one tap.",
    ),
    Field(
        name="most_taps",
        kind="integer",
        low=1,
        high=100,
        default=16,
        doc="Farthest tap position, up and down.",
    ),
    replace(PHASES, doc="Those that have a unit."),
    Field(
        name="reference",
        kind="text",
        choices=("earth", "a", "b", "c", "next"),
        refused=refused.REFERENCES,
        default="earth",
        doc="What each unit's voltage is to: earth, a phase (open delta), the `next` one (closed).",
    ),
    Field(
        name="z_ohm",
        kind="impedance",
        unit="ohm",
        default=0j,
        doc="Before each unit, on the side of `from`.",
    ),
    Field(
        name="jumper_ohm",
        kind="impedance",
        unit="ohm",
        default=0j,
        doc="In the phase that the units of an open delta refer to.",
    ),
    Field(name="gang", kind="flag", default=False, doc="All its units step together."),
)

SWITCHES: tuple[Field, ...] = (
    Field(name="name", kind="name", required=True, doc="The switch's name."),
    Field(name="from", kind="name", required=True, doc="Bus on one side."),
    Field(name="to", kind="name", required=True, doc="Bus on the other side."),
    Field(name="closed", kind="flag", default=False, doc="Its normal state."),
    replace(PHASES, doc="The conductors that it switches."),
)
