"""Feeder and study, compiled: one case for each network state that has settings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.distributions import Choices
from ...model.events.base import Places, places_on
from ...model.leaps import with_leaps
from ...model.network import CONNECTIONS, Network, compile_network
from ...model.neutrals import wires_at_unknown
from ...model.parts import Feeder
from ...model.points import Points, find_points, point_probes
from ...model.sides import edge_nodes
from ...optimise.counts import Grid
from ..spec.events import CLASSES, SwitchState
from ..spec.parts import UNKNOWN_CONNECTION
from ..spec.parts import Group as GroupSpec
from ..spec.study_file import Study
from .classes import DrawClass
from .load_levels import load_places
from .starting import mean_voltages

__all__ = ["Case", "Group", "Sites", "Wired", "make_case", "make_cases"]

LOW_VOLTAGE_V = 1000.0 / 3.0**0.5  #: phase to earth; up to 1 kV between phases, IEC 60038
SAME = 1e-6  #: relative difference of nominal voltages that are the same


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """A state of the network that has settings: its name, and its place in the study."""

    name: str
    index: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wired:
    """One state of the network, with the points in it."""

    network: Network
    points: Points
    start: NDArray[np.float64]  #: (W, 1) where the solver starts


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sites:
    """Lines of medium voltage on which events of a class may stand."""

    regions: tuple[Places, ...]  #: of each section, and of what lies alike to all of them
    alike: tuple[Places, ...]  #: the same with paths and laterals apart, for breaks

    @property
    def edges(self) -> NDArray[np.int64]:
        """All the edges."""
        return np.concatenate([own.edges for own in self.alike])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """A feeder and a study in one network state: everything that a block needs."""

    feeder: Feeder
    study: Study
    group: Group
    network: Network
    points: Points
    start: NDArray[np.float64]  #: (W, 1) where the solver starts
    ties: tuple[Wired, ...]  #: states that tie switching goes to and comes from
    transfers: tuple[Wired, ...]  #: and transfers
    places: Mapping[int, Sites]  #: on lines of at least so many phases
    yg_d_units: NDArray[np.int64]  #: units that may be Yg/D, in order
    unknown_units: NDArray[np.int64]  #: units whose connection is drawn
    unknown_choices: Choices
    unknown_connections: NDArray[np.int64]  #: (choices,) their codes in the solver
    load_places: NDArray[np.int64]  #: (L,) which measured place sees each load, -1 for none
    judged: NDArray[np.bool_]  #: (T,) terminals whose settings are live in this group
    drawn: tuple[DrawClass, ...]  #: classes that the study asks for and the feeder can have
    grid: Grid  #: the settings that the device can hold

    @property
    def wired(self) -> Wired:
        """The state itself."""
        return Wired(network=self.network, points=self.points, start=self.start)


def make_cases(feeder: Feeder, study: Study) -> tuple[Case, ...]:
    """Compile ``feeder`` for every network state of ``study``, in the study's order.

    With one setting for all states, a terminal is judged in each of them if it looks at the
    source in any: a relay keeps its setting where it looks the other way.

    Raises
    ------
    InputError
        For a state that cannot be solved: several loops, or a part that nothing feeds.
    """
    groups = study.setting_groups()
    wired = [_wire(feeder, study, group) for group in groups]
    looks = np.array([[not t.load_side for t in state.points.terminals] for state in wired])
    if study.network.settings == "one":
        looks = np.tile(looks.any(axis=0), (len(groups), 1))
    return tuple(
        _case(feeder, study, Group(name=group.name, index=n), wired[n], looks[n])
        for n, group in enumerate(groups)
    )


def make_case(feeder: Feeder, study: Study) -> Case:
    """The case of the study's first network state."""
    return make_cases(feeder, study)[0]


def _wire(feeder: Feeder, study: Study, state: GroupSpec | SwitchState) -> Wired:
    closed = None if state.closed is None else frozenset(state.closed)
    opened = frozenset(state.opened)
    motors = study.motors.share is not None
    network = compile_network(feeder, closed, opened, motors=motors)
    points = find_points(feeder, network, opened)
    start = mean_voltages(network, study)
    return Wired(network=with_leaps(network, point_probes(points)), points=points, start=start)


def _case(
    feeder: Feeder, study: Study, group: Group, wired: Wired, judged: NDArray[np.bool_]
) -> Case:
    network, units = wired.network, wired.network.units
    ties = _others(feeder, study, study.events.tie_switching.states, wired)
    transfers = _others(feeder, study, study.events.transfer.states, wired)
    unknown = [n for n, unit in enumerate(feeder.transformers) if unit.connection == "unknown"]
    choices = study.transformers.unknown or UNKNOWN_CONNECTION[wires_at_unknown(feeder)]
    return Case(
        feeder=feeder,
        study=study,
        group=group,
        network=network,
        points=wired.points,
        start=wired.start,
        ties=ties,
        transfers=transfers,
        places={least: _sites(network, wired.points, least) for least in (1, 2, 3)},
        yg_d_units=np.array([units.index(name) for name in study.transformers.yg_d], np.int64),
        unknown_units=np.array(unknown, np.int64),
        unknown_choices=choices,
        unknown_connections=np.array([CONNECTIONS[name] for name in choices.values], np.int64),
        load_places=load_places(feeder, study),
        judged=judged,
        drawn=_drawn(feeder, study, bool(ties), bool(transfers)),
        grid=_grid(study),
    )


def _grid(study: Study) -> Grid:
    device = study.device
    return Grid(
        i_set_a=np.array(device.i_grid()),
        v_set_pu=np.array(device.v_grid_pu()),
        z_set_ohm=np.array(device.z_grid()),
    )


def _others(
    feeder: Feeder, study: Study, states: Iterable[SwitchState], own: Wired
) -> tuple[Wired, ...]:
    """The states that are not the case's own, compiled."""

    def key(state: Wired) -> set[object]:
        return {piece.key for piece in state.network.pieces if piece is not None}

    wired = [_wire(feeder, study, state) for state in states]
    return tuple(state for state in wired if key(state) != key(own))


def _sites(network: Network, points: Points, least_phases: int) -> Sites:
    """Lines of medium voltage with at least so many phases."""
    medium = _medium_voltage(network, points)
    sections = [terminal.in_section for terminal in points.terminals[::2]]
    rest = ~np.any(sections, axis=0)

    def places(chosen: Iterable[NDArray[np.bool_]]) -> tuple[Places, ...]:
        found = (places_on(network, medium & own, least_phases) for own in chosen)
        return tuple(own for own in found if own.edges.size)

    alike = _alike(points)
    return Sites(regions=places([*sections, *(own & rest for own in alike)]), alike=places(alike))


def _alike(points: Points) -> list[NDArray[np.bool_]]:
    """Parts of the network that lie alike to every section.

    A short path, or a stretch upstream of all, would hardly be drawn as one with long laterals.
    """
    sides = np.stack([terminal.edge_side for terminal in points.terminals[::2]])
    parts, part = np.unique(sides, axis=1, return_inverse=True)
    return [part.reshape(-1) == n for n in range(parts.shape[1])]


def _medium_voltage(network: Network, points: Points) -> NDArray[np.bool_]:
    """(edges,) at a measuring point's nominal voltage, or between low voltage and theirs."""
    _, lower = edge_nodes(network)
    v, own = network.node_v[lower], points.v_nominal_v
    between = (v >= LOW_VOLTAGE_V) & (v <= own.max(initial=0.0) * (1.0 + SAME))
    return np.asarray(between | np.isclose(v[:, None], own, rtol=SAME, atol=0.0).any(axis=1))


def _drawn(feeder: Feeder, study: Study, ties: bool, transfers: bool) -> tuple[DrawClass, ...]:
    """The classes that are wanted and can occur."""
    impossible = {
        DrawClass.REGULATOR_TAP: not feeder.regulators,
        DrawClass.DER_TRIP: not feeder.ders,
        DrawClass.DER_RAMP: not feeder.ders,
        DrawClass.OPEN_WITH_DER_TRIP: not feeder.ders,
        DrawClass.TIE_SWITCHING: not ties,
        DrawClass.TRANSFER: not transfers,
    }
    left_out = {DrawClass(CLASSES.index(name)) for name in study.events.without}
    return tuple(
        drawn for drawn in DrawClass if drawn not in left_out and not impossible.get(drawn, False)
    )
