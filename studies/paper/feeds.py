"""Figures 14 and 15 of the paper: fed from both ends of the loop, and with a PV system."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...model.closed_form import z_op1_loop_approx
from ...model.line_matrices import z1_ohm
from ...model.parts import DerModel, Feeder
from .cases import PV_KW, line_ohm, open_phase_a, pv_impedance, with_pv
from .printed import PRINTED, Group, Row
from .rows import verdict_rows

__all__ = ["OTHER_R3_R4_OHM", "two_source_groups"]

OTHER_R3_R4_OHM = 0.52  #: of (R3, R4), with which the loop's figures come out
BOTH_ENDS = (("R2", "R3"), ("R3", "R2"))


def two_source_groups(feeder: Feeder) -> Iterator[Group]:
    """The tie closed; then open again, with a PV system behind T6."""
    yield _figure_14(feeder)
    yield _figure_15(feeder)


def _figure_14(feeder: Feeder) -> Group:
    case = open_phase_a(feeder, tie_closed=True)
    ohm = {line.name: z1_ohm(feeder, line) for line in feeder.lines}
    total = np.array(sum(ohm.values(), start=0j))
    rest = float(np.abs(z_op1_loop_approx(total, np.array(ohm["R2-R3"]))))
    parts = " + ".join(f"{abs(z):g}" for name, z in ohm.items() if name != "R2-R3")
    rows = [
        Row(
            name=f"loop_{local.lower()}_ohm",
            quantity=f"|Z1| at {local}, towards {remote}",
            unit="Ω",
            model=case.z_ohm(local, remote),
            digits=4,
            basis="circuit",
            paper=PRINTED["loop_ohm"],
            why="Minus what joins R2 and R3 outside the section, up to the loop's loads: "
            f"{parts} = {rest:.2f} Ω of line. The printed impedances cannot give 2.21 Ω; "
            "they also contradict the paper's own 0.13 Ω/km on two of four lines."
            if local == "R2"
            else "",
        )
        for local, remote in BOTH_ENDS
    ]
    other = open_phase_a(line_ohm(feeder, "R3-R4", OTHER_R3_R4_OHM), tie_closed=True)
    rows += [
        Row(
            name=f"loop_{local.lower()}_052_ohm",
            quantity=f"|Z1| at {local}, (R3, R4) of {OTHER_R3_R4_OHM:g} Ω",
            unit="Ω",
            model=other.z_ohm(local, remote),
            digits=4,
            basis="variant",
            paper=PRINTED["loop_ohm"],
            why="As if (R3, R4) were 4 km at 0.13 Ω/km. It shows how far the data are from the "
            "result, not what the authors simulated."
            if local == "R3"
            else "",
        )
        for local, remote in BOTH_ENDS
    ]
    rows += verdict_rows(
        "verdict_loop",
        case,
        "circuit",
        ("As the paper says, a loop needs a lower Z_set than its default.", ""),
    )
    return Group(
        name="Fig. 14",
        title="tie R4 closed: the break is fed from both sides",
        rows=tuple(rows),
    )


def _figure_15(feeder: Feeder) -> Group:
    stiff = [pv_impedance(feeder, degrees, PRINTED["pv_ohm"].value) for degrees in (90.0, 0.0)]
    return Group(
        name="Fig. 15",
        title=f"a PV system of {PV_KW:g} kW behind T6, phase A open",
        rows=(*_emf_rows(feeder, stiff), *_other_rows(feeder)),
    )


def _emf_rows(feeder: Feeder, stiff: list[complex]) -> Iterator[Row]:
    """The PV as an EMF behind the impedances that make the paper's figure."""
    printed = PRINTED["pv_ohm"]
    rated = (feeder.source.kv_ll * 1000.0) ** 2 / (PV_KW * 1000.0)
    share = [100.0 * abs(z) / rated for z in stiff]
    reasons = (
        "Solved for. Beside an EMF that stays the source's term of eq. (17) is real: Z1 is about "
        "minus the impedance up to R2, and minus that beyond the break, the load in parallel with "
        "T6 and Z_pv. Z2 and Z0 of the PV do not matter.",
        f"So the figure needs an EMF behind {share[0]:.0f} to {share[1]:.0f} % of the PV's rated "
        f"{rated:.0f} Ω: a stiff voltage source, not the controlled current source that the "
        "paper's Section III-E describes.",
    )
    for z_pv, degrees, why in zip(stiff, (90, 0), reasons, strict=True):
        case = open_phase_a(with_pv(feeder, "thevenin", z_pv))
        yield Row(
            name=f"z_pv_{degrees}_ohm",
            quantity=f"|Z_pv| for {printed.value:g} Ω, at {degrees}°",
            unit="Ω",
            model=abs(z_pv),
            digits=2,
            basis="fit",
            why=why,
        )
        yield Row(
            name=f"pv_emf_{degrees}_ohm",
            quantity="|Z1| at R2 with it",
            unit="Ω",
            model=case.z_ohm("R2", "R3"),
            digits=1,
            basis="fit",
            paper=printed,
        )
        yield from verdict_rows(f"verdict_pv_emf_{degrees}", case, "fit")


def _other_rows(feeder: Feeder) -> Iterator[Row]:
    """The PV as what inverters are usually taken for."""
    models: tuple[tuple[DerModel, str, int, str], ...] = (
        (
            "constant_current",
            "constant current",
            1,
            "A current that stays adds nothing to the changes: the load's 288 Ω again, while the "
            "current through the break, and ΔI1 with it, is much smaller.",
        ),
        (
            "constant_power",
            "constant power",
            0,
            "To small changes a constant power is a negative resistance; more of it than load "
            "beyond the break turns the sign of Z1.",
        ),
    )
    for model, words, digits, why in models:
        case = open_phase_a(with_pv(feeder, model))
        yield Row(
            name=f"pv_{model}_ohm",
            quantity=f"|Z1| at R2, PV as {words}",
            unit="Ω",
            model=case.z_ohm("R2", "R3"),
            digits=digits,
            basis="variant",
            paper=PRINTED["pv_ohm"],
            why=why,
        )
        yield Row(
            name=f"pv_{model}_di1_a",
            quantity="|ΔI1| there",
            unit="A",
            model=case.di_a("R2", "1"),
            digits=2,
            basis="fit",
        )
        yield from verdict_rows(f"verdict_pv_{model}", case, "fit")
