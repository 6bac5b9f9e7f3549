"""Measuring points and sections in a network: who measures what, and what lies inside."""

from __future__ import annotations

import numpy as np
import pytest

from openphase.model import Feeder, InputError, Line, Load, Place, Point, Section, Source, Switch
from openphase.model.feeder import make_feeder
from openphase.model.network import compile_network
from openphase.model.points import find_points

TREE = (("S", "B"), ("B", "C"), ("C", "D"), ("B", "L"), ("C", "M"))


def feeder(
    points: dict[str, tuple[str, str]],
    sections: list[tuple[str, str]],
    switches: tuple[Switch, ...] = (),
    extra: tuple[Load, ...] = (),
) -> Feeder:
    """A trunk S–B–C–D with laterals B–L and C–M; lines are called by their ends."""
    return make_feeder(
        name="tree",
        source=Source(
            bus="S",
            kv_ll=12.0,
            emf_pu=1.0,
            z1_ohm=0.9j,
            z2_ohm=0.9j,
            z0_ohm=0.9j,
            frequency_hz=60.0,
        ),
        lines=tuple(
            Line(
                name=a + b,
                from_bus=a,
                to_bus=b,
                length_km=1.0,
                z1_ohm_per_km=0.1 + 0.3j,
                z0_ohm_per_km=0.2 + 0.9j,
            )
            for a, b in TREE
        ),
        loads=tuple(
            Load(
                name=bus,
                transformer=None,
                place=Place(bus=bus),
                connection="wye",
                kw=100.0,
                power_factor=1.0,
                exponent=2.0,
            )
            for bus in "DLM"
        )
        + extra,
        switches=switches,
        points=tuple(Point(name=name, bus=bus, line=line) for name, (bus, line) in points.items()),
        sections=tuple(Section(local=a, remote=b) for a, b in sections),
    )


def inside(own: Feeder) -> set[str]:
    """Lines in the first section, path and laterals."""
    network = compile_network(own)
    terminal = find_points(own, network).terminals[0]
    edges = np.flatnonzero(terminal.in_section)
    return {piece.line for k in edges if (piece := network.pieces[k]) and piece.line}


def test_laterals_between_the_points_belong_to_the_section() -> None:
    own = feeder({"P": ("B", "BC"), "Q": ("D", "CD")}, [("P", "Q")])
    assert inside(own) == {"BC", "CD", "CM"}


def test_a_point_at_the_head_of_a_lateral_ends_the_section_there() -> None:
    own = feeder({"P": ("B", "BC"), "Q": ("D", "CD"), "X": ("C", "CM")}, [("P", "Q")])
    assert inside(own) == {"BC", "CD"}


def test_a_point_at_the_end_of_a_lateral_leaves_the_lateral_inside() -> None:
    own = feeder(
        {"P": ("B", "BC"), "Q": ("D", "CD"), "X": ("M", "CM")},
        [("P", "Q")],
        switches=(Switch(name="K", from_bus="M", to_bus="N", closed=True),),
    )
    assert inside(own) == {"BC", "CD", "CM"}
    network = compile_network(own)
    beyond = [k for k, piece in enumerate(network.pieces) if piece and piece.line is None]
    assert not find_points(own, network).terminals[0].in_section[beyond].any()


def test_a_point_on_the_line_before_the_path_takes_the_bus_s_laterals_in() -> None:
    own = feeder({"P": ("B", "SB"), "Q": ("D", "CD")}, [("P", "Q")])
    assert inside(own) == {"BC", "CD", "CM", "BL"}
    terminal = find_points(own, compile_network(own)).terminals[0]
    assert terminal.into == -1.0


@pytest.mark.parametrize(
    "points",
    [
        {"P": ("B", "BL"), "Q": ("D", "CD")},  # P measures a lateral, not the way in
        {"P": ("B", "BL"), "Q": ("D", "CD"), "U": ("B", "SB")},  # another point does not mend it
        {"P": ("L", "BL"), "Q": ("D", "CD")},  # the source feeds in between
    ],
)
def test_a_section_that_is_fed_past_its_points_is_refused(
    points: dict[str, tuple[str, str]],
) -> None:
    own = feeder(points, [("P", "Q")])
    with pytest.raises(InputError, match="must be fed through its two points alone"):
        find_points(own, compile_network(own))


def test_everything_in_a_loop_has_something_beyond_it() -> None:
    own = feeder({}, [], switches=(Switch(name="T", from_bus="L", to_bus="M", closed=False),))
    radial, loop = compile_network(own), compile_network(own, frozenset({"T"}))
    assert find_points(own, radial).terminals == ()
    ring = {"BC", "CM", "BL"}
    of_ring = [k for k, p in enumerate(loop.pieces) if p and (p.line in ring or p.line is None)]
    assert loop.chords
    assert loop.equipped[of_ring].all()


def test_a_load_may_be_called_like_a_transformer_or_stand_next_to_another() -> None:
    near = tuple(
        Load(
            name=f"near {at}",
            transformer=None,
            place=Place(line="CD", at=at),
            connection="delta",
            kw=10.0,
            power_factor=1.0,
            exponent=2.0,
        )
        for at in (0.3333333, 0.33333334)
    )
    network = compile_network(feeder({}, [], extra=near))
    assert len(set(network.nodes)) == len(network.nodes) == 8
