"""A plate against a finger with a dome."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import assumed
from tactbench.plugin.simulation import Dome, SkinGrid
from tactbench.rigs.twin.geometry import Contact, finger_surface_mm, gap_mm
from tactbench.rigs.twin.likeness.plate import plate_gap_mm, plate_normal

GRID = SkinGrid(x_mm=np.linspace(-14.0, 8.0, 89), s_mm=np.linspace(-12.0, 12.0, 97))
RADIUS = 8.2
DOME = Dome(start=assumed(0.0, "mm", "test"))


@given(st.floats(0.0, 70.0), st.floats(-90.0, 90.0))
def test_the_plate_touches_once_and_passes_through_nothing(tilt, azimuth):
    gap = plate_gap_mm(finger_surface_mm(GRID, RADIUS, DOME), plate_normal(math.radians(tilt), math.radians(azimuth)))
    assert gap.min() == 0.0
    assert np.isfinite(gap).all()


@pytest.mark.parametrize("tilt", [10.0, 29.0, 51.0])
def test_a_plate_tilted_to_the_tip_touches_the_dome_where_the_dome_faces_it(tilt):
    gap = plate_gap_mm(finger_surface_mm(GRID, RADIUS, DOME), plate_normal(math.radians(tilt), 0.0))
    x, s = np.unravel_index(gap.argmin(), gap.shape)
    # Within half a cell of the grid.
    assert GRID.x_mm[x] == pytest.approx(RADIUS * math.sin(math.radians(tilt)), abs=0.13)
    assert GRID.s_mm[s] == pytest.approx(0.0, abs=0.13)


def test_without_pitch_the_cylinder_is_met_as_by_the_rigs_own_plate():
    # Rolled by 20 degrees: the same as a contact point shifted along the arc; behind the dome only.
    roll = math.radians(20.0)
    back = GRID.x_mm < 0
    ours = plate_gap_mm(finger_surface_mm(GRID, RADIUS, DOME), plate_normal(roll, math.pi / 2))[back]
    rigs = gap_mm(GRID, Contact(math.inf, -5.0, RADIUS * roll), RADIUS, DOME)[back]
    # The grid's nearest node is not the contact point: a constant of up to (cell/2)²/2R.
    assert ours - ours.min() == pytest.approx(rigs - rigs.min(), abs=1e-12)


def test_a_mirrored_plate_gives_a_mirrored_gap():
    surface = finger_surface_mm(GRID, RADIUS, DOME)
    one = plate_gap_mm(surface, plate_normal(0.5, 0.6))
    assert one[:, ::-1] == pytest.approx(plate_gap_mm(surface, plate_normal(0.5, -0.6)), abs=1e-12)
