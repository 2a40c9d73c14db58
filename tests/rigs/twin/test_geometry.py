from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import Dome, RigError, SkinGrid, SkinSheet, assumed
from tactbench.rigs.twin.geometry import Contact, check_contact, film_at_rest_mm, gap_mm, skin_grid

SHEET = SkinSheet(
    x_min=assumed(-10, "mm", "t"), x_max=assumed(10, "mm", "t"), arc=assumed(20, "mm", "t"), cells=(40, 50)
)
GRID = skin_grid(SHEET)


def test_cells_fill_the_sheet_symmetrically():
    assert GRID.x_mm[0] == pytest.approx(-9.75)
    assert GRID.cell_mm == pytest.approx((0.5, 0.4))
    # Rounding of half-integer multiples of 0.4 only.
    np.testing.assert_allclose(GRID.s_mm, -GRID.s_mm[::-1], atol=1e-14)


def test_a_huge_cap_is_flat_to_rounding():
    flat = gap_mm(GRID, Contact(math.inf, 0.3, -0.2), 8.2)
    huge = gap_mm(GRID, Contact(1e9, 0.3, -0.2), 8.2)
    # r²/2R is at most 2e-7 mm; the textbook form R - sqrt(R² - r²) would be off by 1e-7 mm of pure rounding.
    np.testing.assert_allclose(
        huge - flat,
        ((GRID.x_mm[:, None] - 0.3) ** 2 + (8.2 * np.sin((GRID.s_mm + 0.2) / 8.2)) ** 2) / 2e9,
        atol=1e-14,
    )


@given(st.floats(1.0, 1e6), st.floats(-3, 3), st.floats(-3, 3))
def test_the_cap_is_a_sphere(radius, x0, s0):
    gap = gap_mm(GRID, Contact(radius, x0, s0))
    r2 = (GRID.x_mm[:, None] - x0) ** 2 + (GRID.s_mm[None, :] - s0) ** 2
    there = r2 < (0.99 * radius) ** 2
    # (R - z)² + r² = R², written without cancellation; 1e-9 is far above rounding and far below any sag.
    np.testing.assert_allclose((gap * (2 * radius - gap))[there], r2[there], rtol=1e-9, atol=1e-9)
    assert np.all(np.isfinite(gap))
    assert np.all(gap >= 0)


def test_beyond_the_cap_nothing_can_touch():
    gap = gap_mm(GRID, Contact(5.0, 0.0, 0.0))
    assert gap.max() == 55.0


def test_tilt_keeps_the_origin_of_the_approach():
    tilted = gap_mm(GRID, Contact(40.0, 0.0, 0.0, tilt_x=0.3), 8.2)
    assert tilted.min() == 0.0


def test_the_film_thins_towards_the_sides():
    film = film_at_rest_mm(GRID, 8.2, gap=1.27, gap_side=0.25, side_fraction=0.85)
    assert film.shape == (40, 50)
    assert film[0, 25] == 1.27
    assert np.all(np.diff(film[0, 25:]) <= 0)
    assert film.min() >= 0.25


@pytest.mark.parametrize(
    ("contact", "says"),
    [
        (Contact(0.3, 0.0, 0.0), "smaller than a cell"),
        (Contact(5.0, 11.0, 0.0), "outside the skin"),
        (Contact(5.0, 0.0, -10.5), "outside the skin"),
    ],
)
def test_what_the_grid_cannot_resolve_is_refused(contact, says):
    with pytest.raises(RigError, match=says):
        check_contact(GRID, contact)


def test_a_small_but_resolved_cap_is_taken():
    check_contact(GRID, Contact(0.6, 9.9, 9.9))


@pytest.mark.parametrize(
    "contact",
    [Contact(math.nan, 0.0, 0.0), Contact(-5.0, 0.0, 0.0), Contact(5.0, math.nan, 0.0), Contact(5.0, 0.0, math.nan)],
)
def test_a_contact_that_is_none_is_refused(contact):
    with pytest.raises(RigError):
        check_contact(GRID, contact)


@pytest.mark.parametrize("slope", [1.01, -2.0, math.tan(math.pi / 2), math.nan])
def test_an_indenter_on_its_side_is_refused(slope):
    with pytest.raises(RigError, match="tilted"):
        check_contact(GRID, Contact(5.0, 0.0, 0.0, tilt_s=slope))


DOME = Dome(start=assumed(0.0, "mm", "test"), arc_per_radian=assumed(8.0, "mm", "test"))


def test_a_dome_falls_away_along_its_meridian_as_the_finger_does_around():
    # Sheet length per radian = radius: one sphere octant, pressed at 0.5 rad up its meridian.
    grid = SkinGrid(x_mm=np.linspace(-4.0, 8.0, 25), s_mm=np.linspace(-8.0, 8.0, 33))
    gap = gap_mm(grid, Contact(math.inf, 4.0, 0.0), 8.0, DOME)
    on_it = grid.x_mm >= 0
    expected = 2 * 8.0 * np.sin((grid.x_mm[on_it] - 4.0) / 16.0) ** 2
    np.testing.assert_allclose(gap[on_it, 16], expected, atol=1e-14)
    # Around the pole of the press axis a sphere looks the same to all sides.
    sphere = gap_mm(grid, Contact(math.inf, 4.0, 0.0), 8.0, DOME)[16]
    ring = 8.0 * math.cos(0.5)
    np.testing.assert_allclose(sphere, math.cos(0.5) * 2 * ring * np.sin(grid.s_mm / 16.0) ** 2, atol=1e-14)


def test_the_cylinder_does_not_know_of_the_dome_and_joins_it_smoothly():
    grid = SkinGrid(x_mm=np.linspace(-4.0, 4.0, 801), s_mm=np.linspace(-3.0, 3.0, 31))
    contact = Contact(12.0, -1.0, 0.4)
    with_dome, without = gap_mm(grid, contact, 8.0, DOME), gap_mm(grid, contact, 8.0)
    np.testing.assert_array_equal(with_dome[grid.x_mm <= 0], without[grid.x_mm <= 0])
    slope = np.diff(with_dome, axis=0) / 0.01
    # The radius of curvature stays above the cap's and the finger's in series: no kink where they meet.
    assert np.abs(np.diff(slope, axis=0)).max() < 0.01 * (1 / 8.0 + 1 / 12.0) * 1.6


@given(x=st.floats(-4.0, 7.0), s=st.floats(-6.0, 6.0), radius=st.floats(2.0, 1e9))
def test_nothing_of_a_finger_stands_above_the_contact_on_it(x, s, radius):
    grid = SkinGrid(x_mm=np.linspace(-4.0, 8.0, 25), s_mm=np.linspace(-8.0, 8.0, 33))
    gap = gap_mm(grid, Contact(radius, x, s), 8.0, DOME)
    assert np.isfinite(gap).all()
    # Convex: rounding of millimetres is all that may stand above the tangent plane.
    assert gap.min() >= -1e-13
