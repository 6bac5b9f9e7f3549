"""What a study is made of: plain data, and the grids of settings a device can hold.

The defaults are those of a study file in which nothing is said. A ``(low, high)`` pair is
the range of a uniform draw unless its field says otherwise.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

from ...model.errors import InputError

__all__ = [
    "MOST_STEPS",
    "Ambient",
    "CertificateDemand",
    "DetectorOptions",
    "Device",
    "Instruments",
    "LoadDraw",
    "LoadStepDraw",
    "NetworkState",
    "OpenPhaseDraw",
    "ReferenceSettings",
    "SourceStepDraw",
    "Steps",
    "Study",
    "TransformerDraw",
]

MOST_STEPS = 10_000
"""The most numbers that `Steps` may hold: beyond it a mistyped step is likelier."""


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
        Voltage exponent common to all loads, dimensionless.
    exponent_spread
        How far a load's exponent may lie from the common one; the sum is clipped to 0..2.
    """

    level: tuple[float, float] = (0.25, 1.0)
    each: tuple[float, float] = (0.8, 1.2)
    exponent: tuple[float, float] = (0.0, 2.0)
    exponent_spread: float = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class TransformerDraw:
    """How many transformers are Yg/D.

    Parameters
    ----------
    yg_d
        Names of the units in question: the first of them are Yg/D, as many as are drawn,
        and the others are what the feeder file says.
    yg_d_count
        Least and most units drawn, each number between being as likely.
    """

    yg_d: tuple[str, ...] = ()
    yg_d_count: tuple[int, int] = (0, 0)


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
    """Which switches are closed.

    Parameters
    ----------
    closed
        The switches that are closed, all others being open; None for the states in the
        feeder file.
    """

    closed: tuple[str, ...] | None = None


# ---- the events ----


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenPhaseDraw:
    """Broken conductors.

    Parameters
    ----------
    two_phase_share
        Share of the breaks that open two phases; the rest open one.
    """

    two_phase_share: float = 0.2


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

    kw: tuple[float, float] = (10.0, 500.0)
    single_phase_share: float = 0.5
    exponent: tuple[float, float] = (0.0, 2.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceStepDraw:
    """A step of the source's voltage.

    Parameters
    ----------
    pct
        Change of the EMF, percent of what it was.
    """

    pct: tuple[float, float] = (-5.0, 5.0)


# ---- measuring and judging ----


@dataclass(frozen=True, slots=True, kw_only=True)
class Instruments:
    """Bounds of a measured phasor's random error.

    Parameters
    ----------
    tve_pct
        Total vector error, percent of the phasor's magnitude.
    current_floor_a
        Error that a current may have however small it is, A.
    """

    tve_pct: float = 0.05
    current_floor_a: float = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """Numbers in even steps, both ends among them.

    Examples
    --------
    >>> Steps(first=0.1, last=0.4, step=0.1).values()
    (0.1, 0.2, 0.3, 0.4)
    """

    first: float
    last: float
    step: float

    def values(self) -> tuple[float, ...]:
        """Return the numbers, each the float nearest to its decimal.

        Adding up floats would miss: three steps of 0.1 are 0.30000000000000004, which is
        not the 0.3 that a relay is set to.

        Raises
        ------
        InputError
            If the steps do not lead from first to last, or are more than `MOST_STEPS`.
        """
        first, last, step = (Fraction(str(x)) for x in (self.first, self.last, self.step))
        if step <= 0 or last < first:
            raise _unfit("must have a step > 0 and last >= first")
        count = (last - first) / step
        if count.denominator != 1:
            raise _unfit("must reach last from first in whole steps")
        if count >= MOST_STEPS:
            raise _unfit(f"must hold at most {MOST_STEPS} numbers")
        return tuple(float(first + k * step) for k in range(int(count) + 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class Device:
    """The settings that a relay can hold: guesses, until its manual is at hand.

    Parameters
    ----------
    i_set_a
        Current threshold of eq. (22), primary A.
    z_set_ohm
        Impedance threshold of eq. (24), primary ohm: ranges, one above the other.
    v_set_pct
        Voltage threshold of eq. (23), percent of the nominal phase voltage, rising.
    ct_primary_a
        Primary current that is 1 pu to the relay, A. The 100 A is a guess, with which the
        0.01 pu in the paper's Table I is the 1 A it is said to be.
    """

    i_set_a: Steps = Steps(first=0.1, last=10.0, step=0.1)
    z_set_ohm: tuple[Steps, ...] = (
        Steps(first=0.1, last=50.0, step=0.1),
        Steps(first=51.0, last=300.0, step=1.0),
    )
    v_set_pct: tuple[float, ...] = (0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0)
    ct_primary_a: float = 100.0

    def i_grid(self) -> tuple[float, ...]:
        """Return the values of I_set in rising order, primary A.

        Raises
        ------
        InputError
            If there are none, or they do not rise; likewise from the other grids.
        """
        return _rising(self.i_set_a.values())

    def z_grid(self) -> tuple[float, ...]:
        """Return the values of Z_set in rising order, primary ohm."""
        return _rising(value for steps in self.z_set_ohm for value in steps.values())

    def v_grid_pu(self) -> tuple[float, ...]:
        """Return the values of V_set in rising order, pu of the nominal phase voltage.

        Examples
        --------
        >>> Device(v_set_pct=(0.7, 7.0)).v_grid_pu()
        (0.007, 0.07)
        """
        return _rising(float(Fraction(str(pct)) / 100) for pct in self.v_set_pct)


def _rising(numbers: Iterable[float]) -> tuple[float, ...]:
    """Return the numbers; raise if there are none or if one is not above that before it."""
    values = tuple(numbers)
    if not values:
        raise _unfit("must hold at least one number")
    if any(after <= before for before, after in pairwise(values)):
        raise _unfit("must hold numbers that rise")
    return values


def _unfit(rule: str) -> InputError:
    return InputError.single("", "a grid of settings", None, rule)


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorOptions:
    """Options of the detector that are the same everywhere.

    Parameters
    ----------
    dt_ms
        Distance between the two frames that a change is taken from, ms.
    delay_ms
        How long the criteria must hold before the trip, ms. Like `dt_ms` it is carried
        into the results, and not judged yet.
    negative_sign
        Trip only if the real part of the connection impedance is negative.
    """

    dt_ms: float = 800.0
    delay_ms: float = 300.0
    negative_sign: bool = True


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
    """

    confidence: float = 0.95
    target: float = 1e-4
    find_at_least: float = 0.5
    margin: float = 1.25


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """What may happen on a feeder, how it is measured, and what is demanded of settings.

    `spec.study_from_toml` and `spec.check_study` check the values; the class does not.
    """

    loads: LoadDraw = LoadDraw()
    transformers: TransformerDraw = TransformerDraw()
    ambient: Ambient = Ambient()
    network: NetworkState = NetworkState()
    open_phase: OpenPhaseDraw = OpenPhaseDraw()
    load_step: LoadStepDraw = LoadStepDraw()
    source_step: SourceStepDraw = SourceStepDraw()
    instruments: Instruments = Instruments()
    device: Device = Device()
    detector: DetectorOptions = DetectorOptions()
    reference: ReferenceSettings = ReferenceSettings()
    certificate: CertificateDemand = CertificateDemand()
