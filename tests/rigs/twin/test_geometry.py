from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin.simulation import Dome, SheetTable, SkinGrid, SkinSheet
from tactbench.rigs.twin.geometry import Contact, gap_mm, skin_grid
from tests.rigs.twin.conftest import q

SHEET = SkinSheet(x_min=q(-10), x_max=q(10), arc=q(20), cells=(40, 50))
GRID = skin_grid(SHEET)


def test_cells_fill_the_sheet_symmetrically():
    assert GRID.x_mm[0] == pytest.approx(-9.75)
    assert GRID.cell_mm == pytest.approx((0.5, 0.4))
    # Rounding of half-integer multiples of 0.4 only.
    np.testing.assert_allclose(GRID.s_mm, -GRID.s_mm[::-1], atol=1e-14)


@given(st.floats(1.0, 1e6), st.floats(-3, 3), st.floats(-3, 3))
def test_the_cap_is_a_sphere(radius, x0, s0):
    gap = gap_mm(GRID, Contact(radius, x0, s0))
    r2 = (GRID.x_mm[:, None] - x0) ** 2 + (GRID.s_mm[None, :] - s0) ** 2
    there = r2 < (0.99 * radius) ** 2
    # (R - z)² + r² = R², written without cancellation; 1e-9 is far above rounding and far below any sag.
    np.testing.assert_allclose((gap * (2 * radius - gap))[there], r2[there], rtol=1e-9, atol=1e-9)
    assert np.all(np.isfinite(gap))
    assert np.all(gap >= 0)


DOME = Dome(start=q(0.0))


def finger(radius, **more):
    return SHEET.model_copy(update={"outer_radius": q(radius), **more})


FINGER = finger(8.0, dome=DOME)


def test_a_dome_falls_away_along_its_meridian_as_the_finger_does_around():
    # One sphere octant, pressed half a radian up its meridian.
    grid = SkinGrid(x_mm=np.linspace(-4.0, 8.0, 25), s_mm=np.linspace(-8.0, 8.0, 33))
    x = 8.0 * math.sin(0.5)
    gap = gap_mm(grid, Contact(math.inf, x, 0.0), FINGER)
    on_it = grid.x_mm >= 0
    expected = 2 * 8.0 * np.sin((np.arcsin(grid.x_mm[on_it] / 8.0) - 0.5) / 2) ** 2
    np.testing.assert_allclose(gap[on_it, 16], expected, atol=1e-14)
    # Around the pole of the press axis a sphere looks the same to all sides.
    around = SkinGrid(x_mm=np.array([x, x + 0.1]), s_mm=grid.s_mm)
    sphere = gap_mm(around, Contact(math.inf, x, 0.0), FINGER)[0]
    ring = 8.0 * math.cos(0.5)
    np.testing.assert_allclose(sphere, math.cos(0.5) * 2 * ring * np.sin(grid.s_mm / 16.0) ** 2, atol=1e-14)


def relief(value):
    return SheetTable(x_mm=(0.0,), angle_deg=(0.0,), value_mm=((value,),), source=q(0).source)


def test_an_even_relief_is_a_thinner_finger():
    grid = SkinGrid(x_mm=np.linspace(-4.0, 0.0, 9), s_mm=np.linspace(-8.0, 8.0, 33))
    thinner = gap_mm(SkinGrid(x_mm=grid.x_mm, s_mm=grid.s_mm * 7.5 / 8.0), Contact(20.0, -2.0, 0.75), finger(7.5))
    with_relief = gap_mm(grid, Contact(20.0, -2.0, 0.8), finger(8.0, dome=DOME, relief=relief(0.5)))
    np.testing.assert_allclose(with_relief, thinner, atol=1e-14)


def test_a_table_is_met_at_its_entries_straight_between_and_even_beyond():
    table = SheetTable(
        x_mm=(-1.0, 1.0), angle_deg=(0.0, 90.0), value_mm=((1.0, 3.0), (2.0, 8.0)), source=relief(0.0).source
    )
    found = table.at(np.array([-5.0, -1.0, 0.0, 1.0, 9.0]), np.radians([-120.0, -90.0, 0.0, 45.0]))
    np.testing.assert_allclose(
        found, [[3, 3, 1, 2], [3, 3, 1, 2], [5.5, 5.5, 1.5, 3.5], [8, 8, 2, 5], [8, 8, 2, 5]], atol=1e-12
    )


@pytest.mark.parametrize("wrong", [{"x_mm": (1.0, 1.0)}, {"value_mm": ((1.0, math.nan), (1.0, 1.0))}])
def test_a_table_that_is_none_is_refused(wrong):
    given_ = {"x_mm": (0.0, 1.0), "angle_deg": (0.0, 9.0), "value_mm": ((1.0, 1.0), (1.0, 1.0))}
    with pytest.raises(ValueError, match=r"ascending|finite"):
        SheetTable(**{**given_, **wrong}, source=relief(0.0).source)


def test_the_cylinder_does_not_know_of_the_dome_and_joins_it_smoothly():
    grid = SkinGrid(x_mm=np.linspace(-4.0, 4.0, 801), s_mm=np.linspace(-3.0, 3.0, 31))
    contact = Contact(12.0, -1.0, 0.4)
    with_dome, without = gap_mm(grid, contact, FINGER), gap_mm(grid, contact, finger(8.0))
    np.testing.assert_array_equal(with_dome[grid.x_mm <= 0], without[grid.x_mm <= 0])
    slope = np.diff(with_dome, axis=0) / 0.01
    # The radius of curvature stays above the cap's and the finger's in series: no kink where they meet.
    assert np.abs(np.diff(slope, axis=0)).max() < 0.01 * (1 / 8.0 + 1 / 12.0) * 1.6


@given(x=st.floats(-4.0, 7.0), s=st.floats(-6.0, 6.0), radius=st.floats(2.0, 1e9))
def test_nothing_of_a_finger_stands_above_the_contact_on_it(x, s, radius):
    grid = SkinGrid(x_mm=np.linspace(-4.0, 8.0, 25), s_mm=np.linspace(-8.0, 8.0, 33))
    gap = gap_mm(grid, Contact(radius, x, s), FINGER)
    assert np.isfinite(gap).all()
    # Convex: rounding of millimetres is all that may stand above the tangent plane.
    assert gap.min() >= -1e-13
