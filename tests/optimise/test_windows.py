"""Loop windows against their definition, and what would open them against trying."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.brute_settings import decimals

from openphase.optimise.windows import Window, loop_window, overlap, remedy

MARGINS = 2.0, 1.25
Z_SET = decimals(1, 500)
LOOP = complex(1.0, 2.0)


def fits(
    section_ohm: float, loop_ohm: complex, margins: tuple[float, float], z_set_ohm: float
) -> bool:
    """m1 Z_section <= Z_set <= (Z_loop - Z_section)/m2, for a section of the loop's angle."""
    m1, m2 = margins
    return m1 * section_ohm <= z_set_ohm and m2 * z_set_ohm <= abs(loop_ohm) - section_ohm


def possible(
    section_ohm: float, loop_ohm: complex, margins: tuple[float, float], z_set: NDArray[np.float64]
) -> bool:
    return any(fits(section_ohm, loop_ohm, margins, z) for z in z_set.tolist())


def aligned(share: float) -> complex:
    """A section that is this share of the loop."""
    return share * LOOP


def test_the_window_of_the_papers_loop() -> None:
    """The break of its figure 14 shows 2.21 ohm, so 5 ohm never trips, and 2.21/1.25 does."""
    section, rest = complex(0.1, 0.38), complex(0.55, 2.14)
    window = loop_window(section, section + rest, MARGINS)
    assert window.low_ohm == pytest.approx(2 * abs(section))
    assert window.high_ohm == pytest.approx(abs(rest) / 1.25)
    assert not window.holds(np.array([5.0])).any()


@pytest.mark.parametrize("share", [0.05, 0.2, 0.28, 0.285, 0.2858, 0.29, 0.5, 0.9])
@pytest.mark.parametrize("margins", [(2.0, 1.25), (1.0, 1.0), (1.5, 1.1)])
def test_a_window_is_empty_beyond_the_longest_section(
    share: float, margins: tuple[float, float]
) -> None:
    window = loop_window(aligned(share), LOOP, margins)
    longest = remedy(aligned(share), LOOP, margins).longest_section_ohm
    assert longest == pytest.approx(abs(LOOP) / (1.0 + margins[0] * margins[1]))
    assert window.empty == (abs(aligned(share)) > longest)
    np.testing.assert_array_equal(
        window.holds(Z_SET),
        [fits(abs(aligned(share)), LOOP, margins, z) for z in Z_SET],
    )


def test_a_section_of_another_angle_has_the_vectors_difference() -> None:
    window = loop_window(complex(0.6, 0.0), complex(0.6, 0.8), (1.0, 1.0))
    assert window.high_ohm == pytest.approx(0.8)


@pytest.mark.parametrize("share", [0.1, 0.25, 0.3, 0.4, 0.6])
def test_each_remedy_alone_just_opens_the_window(share: float) -> None:
    section = aligned(share)
    found = remedy(section, LOOP, MARGINS)
    for own, margins in (
        (section, (found.m1, MARGINS[1])),
        (section, (MARGINS[0], found.m2)),
        (section, (found.both, found.both)),
        (section / abs(section) * found.longest_section_ohm, MARGINS),
    ):
        less = margins[0] * (1 - 1e-9), margins[1] * (1 - 1e-9)
        more = margins[0] * (1 + 1e-9), margins[1] * (1 + 1e-9)
        assert not loop_window(own, LOOP, less).empty
        assert loop_window(own, LOOP, more).empty


@pytest.mark.parametrize("seed", range(60))
def test_on_a_device_each_remedy_alone_just_leaves_a_setting(seed: int) -> None:
    rng = np.random.default_rng([61, seed])
    z_set = np.sort(rng.choice(decimals(1, 30), int(rng.integers(1, 8)), replace=False))
    section = aligned(float(rng.uniform(0.02, 0.8)))
    margins = float(rng.uniform(1.0, 2.5)), float(rng.uniform(1.0, 2.0))
    found, size = remedy(section, LOOP, margins, z_set), abs(section)
    below, above = 1 - 1e-9, 1 + 1e-9
    if found.longest_section_ohm > 0:
        assert possible(found.longest_section_ohm * below, LOOP, margins, z_set)
    longer = max(found.longest_section_ohm, 0.0) * above + 1e-9
    assert not possible(longer, LOOP, margins, z_set)
    for own, (m1, m2) in (
        (found.m1, (1.0, 0.0)),
        (found.m2, (0.0, 1.0)),
        (found.both, (1.0, 1.0)),
    ):

        def at(factor: float, own: float = own, m1: float = m1, m2: float = m2) -> bool:
            wanted = own * factor + (1e-9 if factor > 1 else 0.0)
            each = wanted if m1 else margins[0], wanted if m2 else margins[1]
            return possible(size, LOOP, each, z_set)

        assert own == 0.0 or at(below)
        assert not at(above)
    continuous = remedy(section, LOOP, margins)
    assert found.longest_section_ohm <= continuous.longest_section_ohm * above
    assert found.m1 <= continuous.m1 * above
    assert found.m2 <= continuous.m2 * above
    assert found.both <= continuous.both * above


def test_a_section_without_impedance_bears_any_margin() -> None:
    found = remedy(0j, LOOP, MARGINS)
    assert (found.m1, found.m2, found.both) == (math.inf,) * 3
    # a device cannot be set to 0
    found = remedy(0j, LOOP, MARGINS, Z_SET)
    assert found.m1 == math.inf
    assert found.m2 == found.both == pytest.approx(abs(LOOP) / Z_SET[0])


def test_a_device_that_is_too_coarse_for_any_section_says_so() -> None:
    found = remedy(aligned(0.1), LOOP, MARGINS, np.array([5.0]))
    assert found.longest_section_ohm <= 0
    assert found.m1 == 0
    assert found.m2 < 1


def test_one_setting_for_several_states_lies_in_all_their_windows() -> None:
    windows = [
        Window(),
        Window(low_ohm=0.4, high_ohm=1.9),
        Window(low_ohm=0.7, high_ohm=2.5),
    ]
    expected = np.all([own.holds(Z_SET) for own in windows], axis=0)
    np.testing.assert_array_equal(overlap(windows).holds(Z_SET), expected)
    assert Window().holds(Z_SET).all()
    assert overlap([]) == Window()
    assert not overlap(windows).empty
    assert overlap([*windows, Window(low_ohm=1.95)]).empty
