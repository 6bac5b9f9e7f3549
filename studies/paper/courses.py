"""The paper's figures as courses over time: two steady states, stepped at the event.

At time t the detector compares the state then with the state ΔT earlier. So eq. (5) has a
value from the event until ΔT after it, and none before and after.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...model.parts import Feeder
from .cases import (
    PV_KW,
    Case,
    Part,
    line_ohm,
    open_phase_a,
    pv_impedance,
    with_pv,
    yg_d,
)
from .feeds import BOTH_ENDS, OTHER_R3_R4_OHM
from .printed import PRINTED, SETTINGS
from .rows import MORE_YG_D

__all__ = ["WINDOW_S", "Panel", "Trace", "paper_panels"]

Real = NDArray[np.float64]

EVENT_S, PV_EVENT_S, WINDOW_S = 1.0, 2.0, 1.0  #: the paper's; ΔT is the window
PHASES: tuple[Part, ...] = ("a", "b", "c")
CYCLES = 3.0  #: drawn on either side of the event, where waves are drawn


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trace:
    """One curve; NaN where it has no value."""

    label: str
    x: Real
    y: Real
    basis: str = ""  #: said of it in the legend, as in the table: a fit, a variant


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Panel:
    """One pair of axes: our curves, the paper's figures, and a window or thresholds."""

    title: str
    x_label: str
    y_label: str
    traces: tuple[Trace, ...]
    printed: tuple[float, ...] = ()  #: the paper's values
    thresholds: tuple[tuple[str, float], ...] = ()
    window_s: tuple[float, float] | None = None
    log: bool = False


def paper_panels(feeder: Feeder) -> dict[str, tuple[Panel, ...]]:
    """Name of the picture -> its panels."""
    case = open_phase_a(feeder)
    return {
        "fig10": (
            *_waves(case, feeder.source.frequency_hz),
            _change(case, "V", "|ΔV| [%]", "5 %: V_set", 100.0 * SETTINGS.v_set_pu),
            _change(case, "I", "|ΔI| [A]", "1 A: I_set", SETTINGS.i_set_a),
        ),
        "fig11": (
            _impedances(
                "Fig. 11: Z1 of section (R1, R2), external open phase",
                [(f"at {m}", case, m, n, "1", "") for m, n in (("R1", "R2"), ("R2", "R1"))],
                ("z1_r1_ohm",),
            ),
        ),
        "fig12": (
            _impedances(
                "Fig. 12: Z1 of section (R2, R3), internal open phase; Re Z1 < 0",
                [("at R2", case, "R2", "R3", "1", "")],
                ("z1_r2_ohm",),
            ),
        ),
        "fig13": (_figure_13(feeder),),
        "fig14": (_figure_14(feeder),),
        "fig15": _figure_15(feeder),
    }


# ---- over time ----


def _times(event_s: float) -> Real:
    """From half a window before the event to half a window after the window's end."""
    return np.arange(-500, 1501, dtype=np.float64) * (WINDOW_S / 1000.0) + event_s


def _waves(case: Case, frequency_hz: float) -> tuple[Panel, Panel]:
    """Voltages and currents at R3 as waves of the stepped phasors."""
    span = CYCLES / frequency_hz
    t = np.linspace(EVENT_S - span, EVENT_S + span, 1201)
    turn = np.exp(2j * np.pi * frequency_hz * t)
    now = (t >= EVENT_S).astype(np.int64)
    panels = []
    for what, unit, scale in (("V", "kV", 1e-3), ("I", "A", 1.0)):
        phasors = {p: (case.v if what == "V" else case.i)("R3", p) for p in PHASES}
        panels.append(
            Panel(
                title=f"Fig. 10: {'voltages' if what == 'V' else 'currents'} at R3, phase A opens",
                x_label="time [s]",
                y_label=f"{what.lower()} [{unit}]",
                traces=tuple(
                    Trace(
                        label=f"phase {p.upper()}",
                        x=t,
                        y=scale * np.sqrt(2.0) * (phasors[p][now] * turn).real,
                        basis="fit",
                    )
                    for p in PHASES
                ),
            )
        )
    return panels[0], panels[1]


def _change(case: Case, what: str, y_label: str, threshold: str, value: float) -> Panel:
    """Size of a superimposed quantity at R3: zero but within ΔT of the event."""
    t = _times(EVENT_S)
    within = (t >= EVENT_S) & (t < EVENT_S + WINDOW_S)
    size = case.dv_pct if what == "V" else case.di_a
    printed = PRINTED["dv_a_r3_pct" if what == "V" else "di_a_r3_a"].value
    parts: tuple[tuple[Part, str], ...] = (("a", "phase A"), ("1", "positive sequence"))
    return Panel(
        title=f"Δ{what} at R3 over ΔT = {WINDOW_S:g} s",
        x_label="time [s]",
        y_label=y_label,
        traces=tuple(
            Trace(label=words, x=t, y=np.where(within, size("R3", part), 0.0), basis="fit")
            for part, words in parts
        ),
        printed=(printed,),
        thresholds=((threshold, value),),
        window_s=(EVENT_S, EVENT_S + WINDOW_S),
    )


Curve = tuple[str, Case, str, str, Part, str]
"""Label, case, local, remote, quantity, and what to say of it: a fit, a variant."""


def _impedances(
    title: str, curves: list[Curve], printed: tuple[str, ...], event_s: float = EVENT_S
) -> Panel:
    """|Z| of eq. (5) over time."""
    t = _times(event_s)
    now = (t >= event_s).astype(np.int64)
    earlier = (t - WINDOW_S >= event_s).astype(np.int64)
    traces = []
    for label, case, local, remote, part, basis in curves:
        z = np.abs(case.z_between(local, remote, part, now, earlier))
        traces.append(Trace(label=label, x=t, y=np.where(now == earlier, np.nan, z), basis=basis))
    return Panel(
        title=title,
        x_label="time [s]",
        y_label="|Z| [Ω]",
        traces=tuple(traces),
        printed=tuple(PRINTED[name].value for name in printed),
        window_s=(event_s, event_s + WINDOW_S),
    )


def _figure_13(feeder: Feeder) -> Panel:
    curves: list[Curve] = [
        (f"{n} Yg/Δ", open_phase_a(yg_d(feeder, *more)), "R2", "R3", "a", "fit")
        for n, more in enumerate(MORE_YG_D, start=1)
    ]
    names = tuple(f"z_a_{n}_ohm" for n in (1, 2, 3))
    return _impedances("Fig. 13: phase A impedance at R2, 1 to 3 Yg/Δ", curves, names)


def _figure_14(feeder: Feeder) -> Panel:
    printed_data = open_phase_a(feeder, tie_closed=True)
    other = open_phase_a(line_ohm(feeder, "R3-R4", OTHER_R3_R4_OHM), tie_closed=True)
    curves: list[Curve] = [
        (f"at {m}, (R3, R4) {words}", case, m, n, "1", "variant" if case is other else "")
        for case, words in (
            (printed_data, "as printed"),
            (other, f"of {OTHER_R3_R4_OHM:g} Ω"),
        )
        for m, n in BOTH_ENDS
    ]
    return _impedances("Fig. 14: Z1 in the closed loop; Re Z1 < 0", curves, ("loop_ohm",))


def _figure_15(feeder: Feeder) -> tuple[Panel, Panel]:
    wanted = PRINTED["pv_ohm"].value
    stiff = pv_impedance(feeder, 90.0, wanted)
    cases: list[Curve] = [
        (words, open_phase_a(pv), "R2", "R3", "1", basis)
        for words, pv, basis in (
            (f"EMF behind {abs(stiff):.1f} Ω at 90°", with_pv(feeder, "thevenin", stiff), "fit"),
            ("constant current", with_pv(feeder, "constant_current"), "variant"),
            ("constant power; Re Z1 > 0", with_pv(feeder, "constant_power"), "variant"),
        )
    ]
    course = _impedances(
        f"Fig. 15: Z1 at R2, PV of {PV_KW:g} kW", cases, ("pv_ohm",), event_s=PV_EVENT_S
    )
    return replace(course, log=True), _over_z_pv(feeder, wanted)


def _over_z_pv(feeder: Feeder, wanted: float) -> Panel:
    """|Z1| at R2 over the impedance behind the PV's EMF."""
    size = np.geomspace(5.0, 200.0, 25)

    def z1(degrees: float) -> Real:
        behind = [complex(z) for z in size * np.exp(1j * np.radians(degrees))]
        cases = [open_phase_a(with_pv(feeder, "thevenin", z)) for z in behind]
        return np.array([abs(case.z_ohm("R2", "R3")) for case in cases], np.float64)

    return Panel(
        title="which EMF behind which impedance gives it",
        x_label="|Z_pv| [Ω]",
        y_label="|Z1| at R2 [Ω]",
        traces=tuple(
            Trace(label=f"Z_pv at {degrees:g}°", x=size, y=z1(degrees))
            for degrees in (0.0, 45.0, 90.0)
        ),
        printed=(wanted,),
        log=True,
    )
