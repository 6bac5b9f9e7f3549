"""The events of a study: what is drawn for each class, as plain data.

A class stands here if it has parameters; `CLASSES` names them all. The defaults are those
of a study file in which nothing is said; why they are what they are stands in
``docs/study-file.md``.
"""

from __future__ import annotations

from dataclasses import dataclass

from ...detector.instruments import Wiring
from ...model.distributions import Choices, Distribution, Lognormal, Uniform, Values

__all__ = [
    "CLASSES",
    "WIRING_KINDS",
    "CapacitorStepDraw",
    "DerRampDraw",
    "DerTripDraw",
    "EarthFaultDraw",
    "Events",
    "FallenDraw",
    "LineFaultDraw",
    "LoadStepDraw",
    "LoadSwapDraw",
    "MotorStartDraw",
    "OpenPhaseDraw",
    "OpenWithLoadStepDraw",
    "ReclosingDraw",
    "RegulatorTapDraw",
    "SinglePoleDraw",
    "SourceStepDraw",
    "StepWithTapDraw",
    "SwitchState",
    "SwitchingDraw",
    "WiringDraw",
]

CLASSES = (
    "open_phase",
    "load_step",
    "source_step",
    "open_three",
    "capacitor_step",
    "motor_start",
    "regulator_tap",
    "earth_fault",
    "line_fault",
    "tie_switching",
    "transfer",
    "der_trip",
    "der_ramp",
    "energisation",
    "reclosing",
    "single_pole",
    "fallen_source_side",
    "fallen_load_side",
    "open_with_load_step",
    "open_with_der_trip",
    "load_swap",
    "step_with_tap",
    "wiring",
)
"""Every class of events, in the order of its number in the random streams."""

WIRING_KINDS: dict[str, tuple[Wiring, ...]] = {
    "labels_swapped": (Wiring.SWAPPED_AB, Wiring.SWAPPED_BC, Wiring.SWAPPED_CA),
    "voltage_labels_swapped": (
        Wiring.VOLTAGES_SWAPPED_AB,
        Wiring.VOLTAGES_SWAPPED_BC,
        Wiring.VOLTAGES_SWAPPED_CA,
    ),
    "ct_reversed": (Wiring.REVERSED_A, Wiring.REVERSED_B, Wiring.REVERSED_C),
    "cts_reversed": (Wiring.REVERSED_ALL,),
    "labels_rotated": (Wiring.ROTATED_BCA, Wiring.ROTATED_CAB),
}
"""Wiring faults by name, and each as it may be for the different phases."""

_LOAD_KW = Uniform(low=10.0, high=500.0)
_TO_EARTH_OHM = Lognormal(median=200.0, sigma=1.0, low=20.0, high=2000.0)


# ---- open phases ----


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenPhaseDraw:
    """Broken conductors; the pairs with a break draw it likewise.

    Parameters
    ----------
    two_phase_share
        Share of the breaks that open two phases; the rest open one.
    """

    two_phase_share: float = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class FallenDraw:
    """A broken conductor of which one end lies on the ground.

    Parameters
    ----------
    ohm
        Resistance between that end and earth, ohm.
    """

    ohm: Distribution = _TO_EARTH_OHM


@dataclass(frozen=True, slots=True, kw_only=True)
class SinglePoleDraw:
    """A fuse, cut-out or single-phase recloser closes.

    Parameters
    ----------
    two_phase_share
        Share of the closings in which two phases were open; in the rest it was one.
    """

    two_phase_share: float = 0.2


# ---- load, capacitors, motors, voltage ----


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadStepDraw:
    """Load switched on or off, somewhere on a line.

    Parameters
    ----------
    kw
        Size at nominal voltage, kW.
    single_phase_share
        Share of the steps that are on one phase; the rest are balanced.
    exponent
        Voltage exponent of the load switched, dimensionless.
    """

    kw: Distribution = _LOAD_KW
    single_phase_share: float = 0.5
    exponent: Distribution = Uniform(low=0.0, high=2.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class CapacitorStepDraw:
    """A capacitor bank switched on or off, somewhere on a line.

    Parameters
    ----------
    kvar
        Size of the bank, three phases together, kvar at nominal voltage.
    delta_share
        Share of the banks between the phases; the rest are grounded wye. On three wires
        all are between the phases.
    """

    kvar: Distribution = Values(values=(150.0, 300.0, 450.0, 600.0, 900.0, 1200.0))
    delta_share: float = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorStartDraw:
    """A motor begins to start, or is up to speed, somewhere on a line.

    Parameters
    ----------
    kva
        Rating, kVA.
    times
        Power taken while it starts, in ratings, at nominal voltage.
    power_factor
        While it starts, lagging.
    """

    kva: Distribution = Uniform(low=20.0, high=300.0)
    times: Distribution = Uniform(low=5.0, high=7.0)
    power_factor: Distribution = Uniform(low=0.2, high=0.4)


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceStepDraw:
    """A step of the source's voltage.

    Parameters
    ----------
    pct
        Change of the EMF, percent of what it was.
    """

    pct: Distribution = Uniform(low=-5.0, high=5.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class RegulatorTapDraw:
    """A regulator changes its tap.

    Parameters
    ----------
    taps
        Change of tap position, up or down, whole numbers.
    single_phase_share
        Share of the changes of one phase alone; the rest are of all three alike.
    """

    taps: Distribution = Values(values=(-2.0, -1.0, 1.0, 2.0))
    single_phase_share: float = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadSwapDraw:
    """Load on at one place, load off at another, within ΔT; or the other way round.

    Parameters
    ----------
    kw
        Size of the step at the first place, kW.
    ratio
        The step at the second place, in steps at the first; negative.
    """

    kw: Distribution = _LOAD_KW
    ratio: Distribution = Uniform(low=-1.2, high=-0.8)


@dataclass(frozen=True, slots=True, kw_only=True)
class StepWithTapDraw:
    """A load step and a source step within ΔT.

    Parameters
    ----------
    kw
        Size of the load, kW; drawn like a load step otherwise.
    pct
        Change of the EMF, percent of what it was.
    """

    kw: Distribution = _LOAD_KW
    pct: Distribution = Uniform(low=-5.0, high=5.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenWithLoadStepDraw:
    """A break and a load step within ΔT.

    Parameters
    ----------
    kw
        Size of the load, kW; drawn like a load step otherwise.
    """

    kw: Distribution = _LOAD_KW


# ---- faults with whole conductors ----


@dataclass(frozen=True, slots=True, kw_only=True)
class EarthFaultDraw:
    """One phase to earth; the fault appears or clears.

    Parameters
    ----------
    ohm
        Resistance of the fault, ohm.
    """

    ohm: Distribution = Lognormal(median=10.0, sigma=1.5, low=0.1, high=100.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class LineFaultDraw:
    """Two phases together; the fault appears or clears.

    Parameters
    ----------
    ohm
        Resistance of the fault, ohm.
    earth_share
        Share of the faults that touch earth too. On three wires all may.
    """

    ohm: Distribution = Uniform(low=0.1, high=10.0)
    earth_share: float = 0.5


# ---- switching ----


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchState:
    """A state of the network.

    Parameters
    ----------
    closed
        The switches that are closed, all others being open; None for the states in the
        feeder file.
    opened
        The measuring points whose recloser is open.
    """

    closed: tuple[str, ...] | None = None
    opened: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchingDraw:
    """The network goes to one of other states, or comes from it.

    Parameters
    ----------
    states
        The other states, each as likely; without any there are no such events.
    """

    states: tuple[SwitchState, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ReclosingDraw:
    """Three phases close again, upon loads that all want to run at once.

    Parameters
    ----------
    cold_load
        Factor on the loads beyond the place.
    """

    cold_load: Distribution = Uniform(low=1.5, high=3.0)


# ---- DER ----


@dataclass(frozen=True, slots=True, kw_only=True)
class DerTripDraw:
    """DER trip, by themselves or upon a break within ΔT.

    Parameters
    ----------
    share
        Share of the units that trip, any of them; at least one does.
    """

    share: Distribution = Uniform(low=0.0, high=1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class DerRampDraw:
    """All DER deliver more or less than before.

    Parameters
    ----------
    factor
        On what they deliver.
    """

    factor: Distribution = Uniform(low=0.7, high=1.3)


# ---- wiring ----


@dataclass(frozen=True, slots=True, kw_only=True)
class WiringDraw:
    """A measuring point is wired wrongly.

    Parameters
    ----------
    kinds
        What is wrong, of `WIRING_KINDS`; which phases are concerned is as likely as not.
    """

    kinds: Choices = Choices(values=tuple(WIRING_KINDS))


@dataclass(frozen=True, slots=True, kw_only=True)
class Events:
    """Every class of events that has parameters, by its name, and the classes left out."""

    without: tuple[str, ...] = ()
    open_phase: OpenPhaseDraw = OpenPhaseDraw()
    load_step: LoadStepDraw = LoadStepDraw()
    source_step: SourceStepDraw = SourceStepDraw()
    capacitor_step: CapacitorStepDraw = CapacitorStepDraw()
    motor_start: MotorStartDraw = MotorStartDraw()
    regulator_tap: RegulatorTapDraw = RegulatorTapDraw()
    earth_fault: EarthFaultDraw = EarthFaultDraw()
    line_fault: LineFaultDraw = LineFaultDraw()
    tie_switching: SwitchingDraw = SwitchingDraw()
    transfer: SwitchingDraw = SwitchingDraw()
    der_trip: DerTripDraw = DerTripDraw()
    der_ramp: DerRampDraw = DerRampDraw()
    reclosing: ReclosingDraw = ReclosingDraw()
    single_pole: SinglePoleDraw = SinglePoleDraw()
    fallen_source_side: FallenDraw = FallenDraw()
    fallen_load_side: FallenDraw = FallenDraw()
    open_with_load_step: OpenWithLoadStepDraw = OpenWithLoadStepDraw()
    open_with_der_trip: DerTripDraw = DerTripDraw()
    load_swap: LoadSwapDraw = LoadSwapDraw()
    step_with_tap: StepWithTapDraw = StepWithTapDraw()
    wiring: WiringDraw = WiringDraw()
