"""What a study is made of: plain data.

The defaults are those of a study file in which nothing is said. The events stand in
`spec_events`, the relay's grids of settings in `spec_device`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

from ...detector.options import BothEnds, Options
from ...model.distributions import Choices, Distribution, Fixed, Uniform
from .device import Device
from .events import Events

__all__ = [
    "UNKNOWN_CONNECTION",
    "Ambient",
    "CertificateDemand",
    "Correlation",
    "DerDraw",
    "DetectorOptions",
    "Group",
    "Instruments",
    "LoadDraw",
    "MeasuredLoad",
    "MotorDraw",
    "NetworkState",
    "ReferenceSettings",
    "Study",
    "TransformerDraw",
]

GroupSettings = Literal["each", "one"]

UNKNOWN_CONNECTION = {
    4: Choices(values=("Yg/Yg", "D/Yg", "Yg/D"), weights=(0.6, 0.3, 0.1)),
    3: Choices(values=("D/Yg", "D/D", "Y/D"), weights=(0.8, 0.1, 0.1)),
}
"""What a transformer of unknown connection may be, by the wires at their places: a guess."""


# ---- the state of the feeder before the event ----


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadDraw:
    """How much every load takes and how it follows the voltage.

    Parameters
    ----------
    level
        Factor common to all loads, on the feeder file's kW.
    each
        Further factor, drawn for each load by itself.
    exponent
        Voltage exponent common to all loads, dimensionless; "file": each load follows its own
        law in the feeder file.
    exponent_spread
        How far a load's exponent may lie from the common one, uniformly; the sum is clipped
        to 0..2.
    """

    level: Distribution = Uniform(low=0.25, high=1.0)
    each: Distribution = Uniform(low=0.8, high=1.2)
    exponent: Distribution | Literal["file"] = Uniform(low=0.0, high=2.0)
    exponent_spread: float = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredLoad:
    """How much the loads take that a measured place sees, in place of the common level.

    Parameters
    ----------
    point
        A measuring point, or the source's bus for all of the feeder. Its loads are those beyond
        it that no further measured place sees.
    level
        Factor common to these loads, on the feeder file's kW. It is high and low together with
        the common level.
    """

    point: str
    level: Distribution


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorDraw:
    """How much of the loads are motors, the same for all of them.

    Parameters
    ----------
    share
        Part of each load's P + jQ that motors take; None for the shares in the feeder file.
    y2_y1
        Their negative-sequence admittance over their positive-sequence one; None likewise.
    """

    share: Distribution | None = None
    y2_y1: Distribution | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TransformerDraw:
    """How the transformers are connected.

    Parameters
    ----------
    yg_d
        Names of the units in question: the first of them are Yg/D, as many as are drawn,
        and the others are what the feeder file says.
    yg_d_count
        How many are Yg/D, a whole number.
    unknown
        What each unit is whose connection is unknown, drawn for it by itself; None for
        `UNKNOWN_CONNECTION`.
    """

    yg_d: tuple[str, ...] = ()
    yg_d_count: Distribution = Fixed(value=0.0)
    unknown: Choices | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DerDraw:
    """How much the DER deliver, and how they answer an event.

    Parameters
    ----------
    level
        Factor common to all DER, on the feeder file's kW.
    model
        What each DER is, drawn for it by itself; None for the models in the feeder file.
    """

    level: Distribution = Uniform(low=0.0, high=1.0)
    model: Choices | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Ambient:
    """What changes between the two frames of every scenario, whatever the event.

    Parameters
    ----------
    source_pct
        Largest change of the source's EMF, percent, either way.
    load_pct
        Largest change of each load by itself, percent, either way.
    """

    source_pct: float = 0.3
    load_pct: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkState:
    """Which switches are closed, and whether each state of the network has settings of its own.

    Parameters
    ----------
    closed
        The switches that are closed, all others being open; None for the states in the
        feeder file. Of no use where there are groups.
    settings
        Whether each group has settings of its own, or one setting serves all.
    """

    closed: tuple[str, ...] | None = None
    settings: GroupSettings = "each"


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """A state of the network for which the relay has a setting group.

    Parameters
    ----------
    name
        Name of the group.
    closed
        The switches that are closed, all others being open; None for the states in the
        feeder file.
    opened
        The measuring points whose recloser is open.
    """

    name: str
    closed: tuple[str, ...] | None = None
    opened: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Correlation:
    """Two quantities of a scenario that go together.

    Parameters
    ----------
    between
        The two, such as ``("loads.level", "ders.level")``: of `spec_correlations.SCALARS`.
    rank
        Spearman's rank correlation.
    """

    between: tuple[str, str]
    rank: float


# ---- measuring and judging ----


@dataclass(frozen=True, slots=True, kw_only=True)
class Instruments:
    """Bounds of what a measured phasor may be wrong by.

    Parameters
    ----------
    tve_pct
        Random error of each phasor: total vector error, percent of its magnitude.
    current_floor_a
        Random error that a current may have however small it is, A.
    ratio_pct
        Error of magnitude, percent, constant within a scenario; per phase and channel.
    angle_mrad
        Error of angle, mrad, likewise.
    clock_us
        Offset of each measuring point's clock, microseconds, constant within a scenario.
    frequency_hz
        Error of the frequency that all phasors are referred to, Hz.
    """

    tve_pct: float = 0.05
    current_floor_a: float = 0.05
    ratio_pct: float = 0.3
    angle_mrad: float = 5.0
    clock_us: float = 1.0
    frequency_hz: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorOptions:
    """Options of the detector that are the same everywhere; more on them in `detector.options`.

    Parameters
    ----------
    dt_ms
        Distance between the two frames that a change is taken from, ms.
    delay_ms
        How long the criteria must hold before the trip, ms. It is carried into the results,
        and not judged yet.
    negative_sign
        Trip only if the real part of the connection impedance is negative.
    fallback
        Judge each phase by itself where the positive sequence changes too little.
    compensated
        Demand that the part of the current's change that the local voltage does not explain
        reach I_set too.
    any_sequence
        Let the largest change of the three sequences reach I_set.
    floor_v
        Least compensated change of the remote voltage with `any_sequence`, V.
    waive_sign_below_a
        With `any_sequence`, the sign is not asked for below this compensated change, A.
    unbalance
        Least change of the other sequences, in changes of the positive; 0 asks for none.
    direction
        Trip only on what opens, not on what closes.
    both_ends
        What the far end must say: nothing, no small impedance, or the same.
    """

    dt_ms: float = 800.0
    delay_ms: float = 300.0
    negative_sign: bool = True
    fallback: bool = True
    compensated: bool = False
    any_sequence: bool = False
    floor_v: float = 25.0
    waive_sign_below_a: float = 0.3
    unbalance: float = 0.0
    direction: bool = False
    both_ends: BothEnds = "off"

    def options(self) -> Options:
        """Return those of them that the criteria know."""
        return Options(**{field.name: getattr(self, field.name) for field in fields(Options)})


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceSettings:
    """Settings judged beside the chosen ones, for comparison; at first the paper's.

    Parameters
    ----------
    i_set_a
        Current threshold, primary A.
    v_set_pct
        Voltage threshold, percent of the nominal phase voltage.
    z_set_ohm
        Impedance threshold, primary ohm.
    """

    i_set_a: float = 1.0
    v_set_pct: float = 5.0
    z_set_ohm: float = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CertificateDemand:
    """What the settings must show before they count as set.

    Parameters
    ----------
    confidence
        Probability that the false-trip bounds of all terminals hold together.
    target
        The most false trips per event that the upper bound may leave possible.
    find_at_least
        The least dependability, as a share of the breaks; below it settings are weak.
    margin
        The least factor to the nearest false trip.
    loop_margins
        In a closed loop Z_set must be at least the first factor times the section's
        impedance, and at most what the rest of the loop has, over the second factor.
    """

    confidence: float = 0.95
    target: float = 1e-4
    find_at_least: float = 0.5
    margin: float = 1.25
    loop_margins: tuple[float, float] = (2.0, 1.25)


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """What may happen on a feeder, how it is measured, and what is demanded of settings.

    `spec.study_from_toml` and `spec.check_study` check the values; the class does not.
    """

    loads: LoadDraw = LoadDraw()
    measured: tuple[MeasuredLoad, ...] = ()
    motors: MotorDraw = MotorDraw()
    transformers: TransformerDraw = TransformerDraw()
    ders: DerDraw = DerDraw()
    ambient: Ambient = Ambient()
    correlations: tuple[Correlation, ...] = ()
    network: NetworkState = NetworkState()
    groups: tuple[Group, ...] = ()
    events: Events = Events()
    instruments: Instruments = Instruments()
    device: Device = Device()
    detector: DetectorOptions = DetectorOptions()
    reference: ReferenceSettings = ReferenceSettings()
    certificate: CertificateDemand = CertificateDemand()

    def setting_groups(self) -> tuple[Group, ...]:
        """Return the states of the network, at least one: "normal" where none is named.

        Examples
        --------
        >>> Study().setting_groups()
        (Group(name='normal', closed=None, opened=()),)
        """
        return self.groups or (Group(name="normal", closed=self.network.closed),)
