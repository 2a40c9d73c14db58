"""Discs on coarse grids against conductors whose resistance is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.sensors.biotac.discs import Discs, disc_overlap
from tactbench.sensors.biotac.rims import Disc, RimmedDiscs
from tactbench.sensors.biotac.sheet import FilmSheet, flat_faces

HALF, RADIUS, RING = 4.0, 0.6, 3.0


class WithRing:
    """A rimmed electrode inside a drive that holds everything beyond a circle, both on one grid."""

    def __init__(self, x, centre):
        self._disc = RimmedDiscs(x, x, [Disc(*centre, RADIUS)], [Disc(*centre, RADIUS)])
        self.count, self.owner, self.under = 1, self._disc.owner, self._disc.under
        self._ring = 1e4 * (np.hypot(x[:, None] - centre[0], x[None, :] - centre[1]) > RING).ravel()

    def joints(self, film_mm):
        joints, _ = self._disc.joints(film_mm)
        return joints, self._ring

    def narrow(self, film_mm, along_x, along_s):
        self._disc.narrow(film_mm, along_x, along_s)


def exact(film):
    """Times sigma, from the ring's edge into the disc: a ring of film, and under the disc I0(r / lambda)."""
    from scipy.special import i0, i1

    decay = film / np.sqrt(3 + 4 * film / (np.pi * RADIUS))
    inside = decay / (2 * np.pi * film * RADIUS) * i0(RADIUS / decay) / i1(RADIUS / decay)
    return np.log(RING / RADIUS) / (2 * np.pi * film) + inside


def found(film, cells, centre, contacts):
    x = -HALF + (np.arange(cells) + 0.5) * 2 * HALF / cells
    thickness = np.full((cells, cells), film)
    sheet = FilmSheet(flat_faces(thickness.shape, (2 * HALF / cells, 2 * HALF / cells)), contacts(x, centre))
    return float(sheet.resistances(thickness)[0, 0])


def overlapping(x, centre):
    ring = (np.hypot(x[:, None] - centre[0], x[None, :] - centre[1]) > RING).astype(float)
    made = Discs(disc_overlap(x, x, centre, RADIUS)[None], ring, RADIUS, RADIUS)
    made._thick_drive = 1e4 * ring.ravel()
    return made


def spread(film, contacts, cells=32):
    """Standard deviation over places of the disc on its grid, and mean, of the error relative to the exact value."""
    places = np.random.default_rng(2).uniform(0, 2 * HALF / cells, size=(12, 2))
    errors = [found(film, cells, tuple(map(float, place)), contacts) / exact(film) - 1 for place in places]
    return float(np.std(errors)), float(np.mean(errors))


@pytest.mark.parametrize("film", [0.06, 0.2, 0.6, 1.2])
def test_a_disc_on_a_coarse_grid_has_the_resistance_of_a_disc(film):
    # 0.25 mm cells, 2.4 of them along the radius. Cells beyond the ring are held: where its edge is, is known to a
    # cell, and the mean error must lie within that. The scatter is the disc's own: seen, 0.0018 to 0.0035.
    scatter, mean = spread(film, WithRing)
    widest = np.log((RING + 0.25) / RING) / (2 * np.pi * film) / exact(film)
    assert 0 < mean < widest
    assert scatter < 0.006


def test_a_closed_film_needs_the_rim():
    # Area weighting makes the disc larger, by an amount that follows from where it falls on the grid.
    plain, rimmed = spread(0.06, overlapping), spread(0.06, WithRing)
    assert plain[0] > 3 * rimmed[0]
    # The ring is the same: what is left is the disc's growth. An eighth of a cell is ln(0.631/0.6) of ln(5), 0.03.
    assert rimmed[1] - plain[1] > 0.03


@given(film=st.floats(0.06, 1.3), x=st.floats(-0.2, 0.2), s=st.floats(-0.2, 0.2))
@settings(max_examples=30, deadline=None)
def test_conductances_stay_positive(film, x, s):
    axis = -HALF + (np.arange(32) + 0.5) * 0.25
    discs = RimmedDiscs(axis, axis, [Disc(x, s, RADIUS)], [Disc(2.0, 2.0, RADIUS)])
    thickness = np.full((32, 32), film)
    joints, drive = discs.joints(thickness)
    along_x, along_s = np.full((31, 32), film), np.full((32, 31), film)
    discs.narrow(thickness, along_x, along_s)
    assert joints.min() >= 0
    assert joints.sum() > 0
    assert drive.min() >= 0
    # A rim only shortens the way: no face conducts worse than without it (but for rounding).
    assert min(along_x.min(), along_s.min()) > film * (1 - 1e-9)


def test_a_thick_film_sees_the_discs_area():
    axis = -HALF + (np.arange(32) + 0.5) * 0.25
    discs = RimmedDiscs(axis, axis, [Disc(0.07, -0.11, RADIUS)], [Disc(2.0, 2.0, RADIUS)])
    thick = 1e5
    joints, _ = discs.joints(np.full((32, 32), thick))
    # kappa A with kappa = 3/h + 4/(pi a); what the film's own decay length leaves is of order a / lambda = 0.003.
    assert joints.sum() == pytest.approx(np.pi * RADIUS**2 * (3 / thick + 4 / (np.pi * RADIUS)), rel=0.01)


def test_a_disc_that_covers_no_cell_is_refused():
    axis = np.arange(10) + 0.5
    with pytest.raises(RigError, match="covers no cell"):
        RimmedDiscs(axis, axis, [Disc(5.0, 5.0, 0.3)], [Disc(2.5, 2.5, 0.6)])


def test_a_disc_may_reach_the_sheets_edge():
    axis = (np.arange(20) + 0.5) * 0.2
    discs = RimmedDiscs(axis, axis, [Disc(0.3, 2.0, 0.6)], [Disc(2.5, 2.5, 0.6)])
    film = np.full((20, 20), 0.5)
    joints, _ = discs.joints(film)
    along_x, along_s = np.full((19, 20), 0.5), np.full((20, 19), 0.5)
    discs.narrow(film, along_x, along_s)
    assert joints.min() >= 0
    assert np.isfinite(joints).all()
    assert min(along_x.min(), along_s.min()) > 0.5 * (1 - 1e-9)
