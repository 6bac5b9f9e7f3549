"""Impedances of paths and loops, against what eq. (5) shows of a passive two-port."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from openphase.model.network import compile_network
from openphase.model.parts import Feeder, InlineTransformer, Line, Point, Section, Source, Switch
from openphase.model.points import find_points

Z1 = 0.1 + 0.3j


def line(start: str, end: str, km: float = 1.0) -> Line:
    return Line(
        name=start + end,
        from_bus=start,
        to_bus=end,
        length_km=km,
        z1_ohm_per_km=Z1,
        z0_ohm_per_km=3.0 * Z1,
    )


def feeder(*lines: Line, **parts: tuple[object, ...]) -> Feeder:
    made = Feeder(
        name="paths",
        source=Source(
            bus="S",
            kv_ll=24.9,
            emf_pu=1.0,
            z1_ohm=0.9j,
            z2_ohm=0.9j,
            z0_ohm=0.9j,
            frequency_hz=60.0,
        ),
        lines=lines,
        transformers=(),
        loads=(),
        switches=(),
        points=(),
        sections=(),
    )
    return replace(made, **parts)  # type: ignore[arg-type]


def section(own: Feeder, first: tuple[str, str], last: tuple[str, str]) -> Feeder:
    points = (
        Point(name="P", bus=first[0], line=first[1]),
        Point(name="Q", bus=last[0], line=last[1]),
    )
    return replace(own, points=points, sections=(Section(local="P", remote="Q"),))


def step_down(kva: float, name: str = "T") -> InlineTransformer:
    return InlineTransformer(
        name=name,
        from_bus="B",
        to_bus="C",
        connection="Yg/Yg",
        rating_kva=kva,
        kv_from=24.9,
        kv_to=4.16,
        leakage_pu=0.019 + 0.0408j,
    )


def test_a_path_is_the_sum_of_its_lines_whichever_way() -> None:
    own = section(
        feeder(line("S", "A", 2.0), line("A", "B", 3.0), line("B", "D")), ("S", "SA"), ("D", "BD")
    )
    there, back = find_points(own, compile_network(own)).terminals
    assert there.line_z1_ohm == pytest.approx(6.0 * Z1, rel=1e-15)
    assert back.line_z1_ohm == there.line_z1_ohm
    assert there.loop_z1_ohm is None


@pytest.mark.parametrize("units", [(500.0,), (300.0, 200.0)])
def test_behind_a_transformer_a_part_counts_by_both_ends_voltages(
    units: tuple[float, ...],
) -> None:
    """V_n = D V_m - B I_m, worked out with the chain matrices of the parts."""
    own = section(
        feeder(
            line("S", "B", 2.0),
            line("C", "D", 3.0),
            inline_transformers=tuple(step_down(kva, f"T{kva:g}") for kva in units),
        ),
        ("S", "SB"),
        ("D", "CD"),
    )
    there, back = find_points(own, compile_network(own)).terminals
    turns = 4.16 / 24.9
    leakage = (0.019 + 0.0408j) * 4.16e3**2 / 500e3

    def series(z: complex) -> np.ndarray:
        return np.array([[1.0, -z], [0.0, 1.0]])

    ratio = np.diag([turns, 1.0 / turns])
    chain = series(3.0 * Z1 + leakage) @ ratio @ series(2.0 * Z1)
    assert there.line_z1_ohm == pytest.approx(-chain[0, 1], rel=1e-12)
    assert back.line_z1_ohm == there.line_z1_ohm


def ring(*buses: str) -> tuple[Line, ...]:
    return tuple(line(a, b, km) for km, (a, b) in enumerate(pairwise(buses), 1))


def test_one_loop_is_the_sum_of_all_its_lines() -> None:
    lines = ring("S", "A", "B", "D", "S")
    own = section(feeder(line("S", "L"), *lines), ("A", "AB"), ("B", "AB"))
    terminal = find_points(own, compile_network(own)).terminals[0]
    assert terminal.line_z1_ohm == 2.0 * Z1
    assert terminal.loop_z1_ohm == pytest.approx(10.0 * Z1, rel=1e-12)


def test_where_loops_meet_the_rest_is_what_lies_between_the_ends() -> None:
    """A to B, beside the path: 1 km, then 1 and 3 km side by side; by hand."""
    own = feeder(
        line("S", "A", 1.0),
        line("A", "B", 1.0),
        line("A", "C", 1.0),
        line("C", "B", 1.0),
        line("C", "D", 1.0),
        line("D", "B", 2.0),
        switches=(Switch(name="K", from_bus="D", to_bus="E", closed=True),),
    )
    own = section(own, ("A", "AB"), ("B", "AB"))
    terminal = find_points(own, compile_network(own)).terminals[0]
    assert terminal.loop_z1_ohm == pytest.approx((1.0 + 1.0 + 0.75) * Z1, rel=1e-12)
