"""Figures 14 and 15 of the paper: fed from both ends of the loop, and with a PV system."""

from __future__ import annotations

from collections.abc import Iterator

from ..model.closed_form import z_op1_loop_approx
from ..model.parts import Feeder
from .paper_cases import PV_KW, line_ohm, open_phase_a, pv_impedance, trips, with_pv
from .paper_printed import PRINTED, SETTINGS, Group, Row

__all__ = ["OTHER_R3_R4_OHM", "two_source_groups"]

OTHER_R3_R4_OHM = 0.52  #: of (R3, R4), with which the loop's figures come out
BOTH_ENDS = (("R2", "R3"), ("R3", "R2"))


def two_source_groups(feeder: Feeder) -> Iterator[Group]:
    """The tie closed; then open again, with a PV system behind T6."""
    yield _figure_14(feeder)
    yield _figure_15(feeder)


def _figure_14(feeder: Feeder) -> Group:
    case = open_phase_a(feeder, tie_closed=True)
    ohm = {line.name: line.z1_ohm_per_km * line.length_km for line in feeder.lines}
    rest = z_op1_loop_approx(sum(ohm.values()), ohm["R2-R3"])
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
            f"{parts} = {abs(rest):.2f} Ω of line. The printed impedances cannot give 2.21 Ω; "
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
            quantity=f"the same, (R3, R4) of {OTHER_R3_R4_OHM:g} Ω",
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
    rows.append(
        Row(
            name="verdict_loop",
            quantity="R2 with the paper's 1 A, 5 %, 5 Ω",
            unit="",
            model=case.said("R2", "R3", SETTINGS),
            digits=0,
            basis="circuit",
            why="As the paper says, a loop needs a lower Z_set than its default.",
        )
    )
    return Group(
        name="Fig. 14",
        title="tie R4 closed: the break is fed from both sides",
        rows=tuple(rows),
    )


def _figure_15(feeder: Feeder) -> Group:
    wanted = PRINTED["pv_ohm"].value
    inductive, resistive = (pv_impedance(feeder, degrees, wanted) for degrees in (90.0, 0.0))
    rated = (feeder.source.kv_ll * 1000.0) ** 2 / (PV_KW * 1000.0)
    share = [100.0 * abs(z) / rated for z in (inductive, resistive)]
    current = open_phase_a(with_pv(feeder, "constant_current"))
    power = open_phase_a(with_pv(feeder, "constant_power"))
    return Group(
        name="Fig. 15",
        title=f"a PV system of {PV_KW:g} kW behind T6, phase A open",
        rows=(
            Row(
                name="z_pv_90_ohm",
                quantity=f"|Z_pv| for {wanted:g} Ω, at 90°",
                unit="Ω",
                model=abs(inductive),
                digits=2,
                basis="fit",
                why="Solved for. A steady EMF behind Z_pv makes Z1 minus the whole loop of eq. (17): "
                "source, lines, and the load in parallel with T6 and Z_pv, whatever the PV's other "
                "sequences are.",
            ),
            Row(
                name="z_pv_0_ohm",
                quantity=f"|Z_pv| for {wanted:g} Ω, at 0°",
                unit="Ω",
                model=abs(resistive),
                digits=2,
                basis="fit",
                why=f"So the figure needs an EMF behind {share[0]:.0f} to {share[1]:.0f} % of the "
                f"PV's rated {rated:.0f} Ω: a stiff voltage source, not the controlled current "
                "source that the paper's Section III-E describes.",
            ),
            Row(
                name="pv_constant_current_ohm",
                quantity="|Z1| at R2, PV as constant current",
                unit="Ω",
                model=current.z_ohm("R2", "R3"),
                digits=1,
                basis="circuit",
                paper=PRINTED["pv_ohm"],
                why="A current that stays adds nothing to the changes: the load's 288 Ω again, while "
                "the current through the break, and ΔI1 with it, is much smaller.",
            ),
            Row(
                name="pv_constant_current_di1_a",
                quantity="|ΔI1| there",
                unit="A",
                model=current.di_a("R2", "1"),
                digits=2,
                basis="fit",
            ),
            Row(
                name="pv_constant_power_ohm",
                quantity="|Z1| at R2, PV as constant power",
                unit="Ω",
                model=power.z_ohm("R2", "R3"),
                digits=0,
                basis="fit",
                paper=PRINTED["pv_ohm"],
                why="To small changes a constant power is a negative resistance; more of it than "
                "load beyond the break turns the sign of Z1.",
            ),
            Row(
                name="pv_constant_power_di1_a",
                quantity="|ΔI1| there",
                unit="A",
                model=power.di_a("R2", "1"),
                digits=2,
                basis="fit",
            ),
            Row(
                name="verdict_pv",
                quantity="R2 with the paper's 1 A, 5 %, 5 Ω",
                unit="",
                model="; ".join(case.said("R2", "R3", SETTINGS) for case in (current, power)),
                digits=0,
                basis="fit",
                why="Constant current first, then constant power.",
            ),
        ),
    )
