"""Film and discs against conductors whose resistance is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.sensors.biotac.conduction import Disc, Faces, FilmSheet, RimmedDiscs

RADIUS, RING = 0.6, 3.0


def flat_faces(shape, cell_mm=(1.0, 1.0)):
    """Faces of equal rectangles."""
    (nx, ns), (dx, ds) = shape, cell_mm
    return Faces(np.full((nx - 1, ns), ds / dx), np.full((nx, ns - 1), dx / ds))


def centred(cells, half_mm):
    """Centres of cells, and their length."""
    step = 2 * half_mm / cells
    return -half_mm + (np.arange(cells) + 0.5) * step, step


class WithRing:
    """A disc inside a drive that holds everything beyond a circle, both on one grid."""

    def __init__(self, x, centre, radius=RADIUS, ring=RING):
        self._disc = RimmedDiscs(x, x, [Disc(*centre, radius)], [Disc(*centre, radius)])
        self.count, self.owner, self.under = 1, self._disc.owner, self._disc.under
        self._ring = 1e4 * (np.hypot(x[:, None] - centre[0], x[None, :] - centre[1]) > ring).ravel()

    def joints(self, film_mm):
        return self._disc.joints(film_mm)[0], self._ring

    def narrow(self, film_mm, along_x, along_s):
        self._disc.narrow(film_mm, along_x, along_s)


def resistance(contacts, film, cell_mm=(1.0, 1.0)):
    """Times sigma, between drive and the only electrode."""
    return float(FilmSheet(flat_faces(film.shape, cell_mm), contacts).resistances(film)[0, 0])


@pytest.mark.parametrize("film", [0.06, 0.2, 0.6, 1.2])
def test_a_disc_on_a_coarse_grid_has_the_resistance_of_a_disc(film):
    # Times sigma, from the ring's edge into the disc: a ring of film, and under the disc I0(r / lambda).
    from scipy.special import i0, i1

    decay = film / np.sqrt(3 + 4 * film / (np.pi * RADIUS))
    exact = np.log(RING / RADIUS) / (2 * np.pi * film)
    exact += decay / (2 * np.pi * film * RADIUS) * i0(RADIUS / decay) / i1(RADIUS / decay)
    # 0.25 mm cells, 2.4 of them along the radius, at places of the disc on its grid.
    x, step = centred(32, 4.0)
    places = np.random.default_rng(2).uniform(0, step, size=(12, 2))
    errors = [resistance(WithRing(x, tuple(p)), np.full((32, 32), film), (step, step)) / exact - 1 for p in places]
    # Cells beyond the ring are held: where its edge is, is known to a cell, and the mean error must lie within that.
    assert 0 < np.mean(errors) < np.log((RING + step) / RING) / (2 * np.pi * film) / exact
    # The scatter is the disc's own: seen, 0.0018 to 0.0035. A disc of cells' areas has 0.02 under the closed film.
    assert np.std(errors) < 0.006


@pytest.mark.parametrize("ratio", [1.2, 2.0, 4.2])
def test_a_small_disc_on_a_thick_film_agrees_with_the_method_of_images(ratio):
    outer, (x, step) = 10.0, centred(128, 12.0)
    images = 1 / 4 + (np.log(outer / (4 * ratio)) + np.euler_gamma) / (2 * np.pi * ratio)
    found = resistance(WithRing(x, (0.0, 0.0), 1.0, outer), np.full((128, 128), ratio), (step, step))
    # The contact law is within 2 % of 1/(4a); the ring's staircase adds 0.2 mm of 10.
    assert found == pytest.approx(images, abs=0.03 / 4)


@pytest.mark.parametrize("thin", [0.9, 0.5, 0.1])
def test_a_thinner_film_never_conducts_better(thin):
    # No conductor does (Rayleigh); the depth-averaged contact alone would, for small discs on thick films.
    x, step = centred(48, 6.0)
    discs = RimmedDiscs(x, x, [Disc(3.0, 0.0, 0.3)], [Disc(-4.0, 0.0, 0.8)])
    thick = np.full((48, 48), 1.27)
    assert resistance(discs, thin * thick, (step, step)) > resistance(discs, thick, (step, step))


def several(seed, shape=(24, 24)):
    """Discs at random places, and a film from closed to open, 0.06 to 2.4 mm: steeper than the BioTac's ever gets."""
    rng = np.random.default_rng(seed)
    (x, dx), (s, ds) = (centred(n, 3.0) for n in shape)
    at = [Disc(*rng.uniform(-2.4, 2.4, 2), max(0.5, 0.75 * max(dx, ds))) for _ in range(5)]
    sheet = FilmSheet(flat_faces(shape, (dx, ds)), RimmedDiscs(x, s, at[1:], at[:1]))
    return rng, sheet, np.exp(rng.uniform(np.log(0.06), np.log(2.4), shape))


@given(seed=st.integers(0, 10_000), shape=st.sampled_from([(24, 24), (12, 16), (16, 12)]))
@settings(max_examples=25, deadline=None)
def test_the_elimination_agrees_with_a_dense_inverse(seed, shape):
    """The same by one dense matrix of cells and electrodes, assembled face by face."""
    _, sheet, film = several(seed, shape)
    contacts, faces = sheet._contacts, sheet._faces
    joints, drive = contacts.joints(film)
    size = film.size + contacts.count
    matrix, number = np.diag(np.append(drive, np.zeros(contacts.count))), np.arange(film.size).reshape(shape)

    def join(one, other, conductance):
        for i, j, g in zip(np.ravel(one), np.ravel(other), np.ravel(conductance), strict=True):
            matrix[[i, j], [i, j]] += g
            matrix[[i, j], [j, i]] -= g

    mean = lambda a, b: (b - a) / np.log(b / a)  # noqa: E731
    along_x = faces.along_x * mean(film[1:], film[:-1])
    along_s = faces.along_s * mean(film[:, 1:], film[:, :-1])
    contacts.narrow(film, along_x, along_s)
    join(number[1:], number[:-1], along_x)
    join(number[:, 1:], number[:, :-1], along_s)
    join(contacts.under, film.size + contacts.owner, joints)
    assert matrix.shape == (size, size)
    # Conductances over four decades: rounding of 1e-16, multiplied by as much.
    np.testing.assert_allclose(
        sheet.resistances(film), np.linalg.inv(matrix)[film.size :, film.size :], rtol=1e-9, atol=1e-12
    )


@pytest.mark.parametrize("bad", [0.0, -0.1, np.nan, np.inf])
def test_a_film_that_is_none_is_refused(bad):
    _, sheet, film = several(2)
    film[3, 4] = bad
    with pytest.raises(RigError, match="thickness"):
        sheet.resistances(film)


def test_a_stretched_disc_is_the_disc_on_the_stretched_grid():
    x, film = (np.arange(40) + 0.5) * 0.2, np.full((40, 40), 0.5)
    plain = RimmedDiscs(x, x, [Disc(2.0, 3.1, 0.6)], [Disc(6.0, 5.0, 0.8)])
    squeezed = RimmedDiscs(x / 2, 4 * x, [Disc(1.0, 12.4, 0.6, (2.0, 0.25))], [Disc(3.0, 20.0, 0.8, (2.0, 0.25))])
    assert resistance(plain, film) == pytest.approx(resistance(squeezed, film), rel=1e-12)
