"""Fields of a study file that say how it is measured and judged: kind, unit, range, meaning."""

from __future__ import annotations

from ...model.reading.fields import Field

__all__ = ["JUDGING_TABLES", "STEPS"]

STEPS: tuple[Field, ...] = (
    Field(name="first", kind="number", above=0.0, required=True, doc="The lowest value."),
    Field(
        name="last",
        kind="number",
        above=0.0,
        required=True,
        doc="The highest value, a whole number of steps from `first`.",
    ),
    Field(name="step", kind="number", above=0.0, required=True, doc="From one to the next."),
)

JUDGING_TABLES: dict[str, tuple[Field, ...]] = {
    "instruments": (
        Field(
            name="tve_pct",
            kind="number",
            unit="%",
            low=0.0,
            high=100.0,
            doc="Largest total vector error, of the phasor's magnitude.",
        ),
        Field(
            name="current_floor_a",
            kind="number",
            unit="A",
            low=0.0,
            high=1000.0,
            doc="Largest error of a current so small that its `tve_pct` is less.",
        ),
        Field(
            name="ratio_pct",
            kind="number",
            unit="%",
            low=0.0,
            high=50.0,
            doc="Largest error of magnitude of a phase and channel.",
        ),
        Field(
            name="angle_mrad",
            kind="number",
            unit="mrad",
            low=0.0,
            high=1000.0,
            doc="Largest error of angle of a phase and channel.",
        ),
        Field(
            name="clock_us",
            kind="number",
            unit="µs",
            low=0.0,
            high=10_000.0,
            doc="Largest offset of a measuring point's clock.",
        ),
        Field(
            name="frequency_hz",
            kind="number",
            unit="Hz",
            low=0.0,
            high=5.0,
            doc="Largest error of the frequency that all phasors are referred to.",
        ),
    ),
    "device": (
        Field(
            name="unit",
            kind="text",
            choices=("A", "pu"),
            doc="What `i_set` is in: primary A, or pu of `ct_primary_a`.",
        ),
        Field(name="i_set", kind="table", doc="Values of I_set, in that unit: steps."),
        Field(
            name="z_set_ohm",
            kind="tables",
            unit="ohm",
            doc="Values of Z_set, primary: one or more steps, rising; at first to 50 by 0.1,"
            " then from 51 to 300 by 1.",
        ),
        Field(
            name="v_set_pct",
            kind="numbers",
            unit="%",
            above=0.0,
            high=100.0,
            doc="Values of V_set on the nominal phase voltage, rising.",
        ),
        Field(
            name="ct_primary_a",
            kind="number",
            unit="A",
            above=0.0,
            high=100_000.0,
            doc="Primary current of 1 pu in the relay's own settings.",
        ),
    ),
    "detector": (
        Field(
            name="dt_ms",
            kind="number",
            unit="ms",
            above=0.0,
            doc="ΔT, between the frames that are compared.",
        ),
        Field(
            name="delay_ms",
            kind="number",
            unit="ms",
            low=0.0,
            doc="From pickup to trip; carried, not judged yet.",
        ),
        Field(
            name="negative_sign",
            kind="flag",
            doc="Trip only if the connection impedance has a real part < 0.",
        ),
        Field(
            name="fallback",
            kind="flag",
            doc="Judge each phase by itself where \\|ΔI1\\| stays below I_set.",
        ),
        Field(
            name="compensated",
            kind="flag",
            doc="The change of I1 that V1 does not explain must reach I_set too.",
        ),
        Field(
            name="any_sequence",
            kind="flag",
            doc="The largest change of the three sequences must reach I_set, not that of I1.",
        ),
        Field(
            name="floor_v",
            kind="number",
            unit="V",
            low=0.0,
            doc="With `any_sequence`: least change of the remote V1 that the local V1 does not"
            " explain.",
        ),
        Field(
            name="waive_sign_below_a",
            kind="number",
            unit="A",
            low=0.0,
            doc="With `any_sequence`: where the unexplained change of I1 is less, the sign is not"
            " asked for.",
        ),
        Field(
            name="unbalance",
            kind="number",
            low=0.0,
            high=10.0,
            doc="Least change of I2 or I0, in changes of I1; 0 asks for none.",
        ),
        Field(name="direction", kind="flag", doc="Trip on what opens only, not on what closes."),
        Field(
            name="both_ends",
            kind="text",
            choices=("off", "no_small_z", "agree"),
            doc="What the far end must see: no matter, no impedance below Z_set, or the same.",
        ),
    ),
    "reference": (
        Field(name="i_set_a", kind="number", unit="A", above=0.0, doc="I_set, primary."),
        Field(
            name="v_set_pct",
            kind="number",
            unit="%",
            above=0.0,
            high=100.0,
            doc="V_set on the nominal phase voltage.",
        ),
        Field(name="z_set_ohm", kind="number", unit="ohm", above=0.0, doc="Z_set, primary."),
    ),
    "certificate": (
        Field(
            name="confidence",
            kind="number",
            low=0.5,
            high=1.0,
            doc="Confidence of the terminals' false-trip bounds together, less than 1.",
        ),
        Field(
            name="target",
            kind="number",
            above=0.0,
            high=0.5,
            doc="Upper bound demanded of the false trips per event.",
        ),
        Field(
            name="find_at_least",
            kind="number",
            low=0.0,
            high=1.0,
            doc="Share of breaks whose detection makes settings more than weak.",
        ),
        Field(
            name="margin",
            kind="number",
            low=1.0,
            doc="Factor demanded to the nearest false trip.",
        ),
        Field(
            name="loop_margins",
            kind="numbers",
            low=1.0,
            doc="In a closed loop: least Z_set in impedances of the section, and the factor from"
            " the largest Z_set to the impedance of the rest of the loop.",
        ),
    ),
}
"""The fields of each table, without defaults: `spec_fields.TABLES` has them."""
