from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import RigError, SkinSheet, assumed
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
