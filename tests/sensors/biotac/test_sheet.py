"""The conduction solver against conductors whose resistance is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.sensors.biotac.discs import Discs, disc_overlap
from tactbench.sensors.biotac.sheet import FilmSheet, flat_faces

# Contacts (almost) without resistance: a millionth of the sheet's own. Smaller still, and float64 would not resolve
# the sheet beside them.
PERFECT = 1e6
TINY = 1e-6  # radius, for the part of the contact that goes with 1/radius


def resistance(sheet: FilmSheet, film) -> float:
    """Times sigma, between drive and the only electrode."""
    return float(sheet.resistances(film)[0, 0])


@given(width=st.integers(2, 12), length=st.integers(3, 30), film=st.floats(0.05, 3.0), aspect=st.floats(0.3, 3.0))
@settings(max_examples=40, deadline=None)  # the first example imports scipy
def test_a_uniform_strip_has_the_resistance_of_a_strip(width, length, film, aspect):
    ends = np.zeros((2, length, width))
    ends[0, 0] = ends[1, -1] = 1.0
    thickness = np.full((length, width), film)
    sheet = FilmSheet(flat_faces(thickness.shape, (aspect, 1.0)), Discs(ends[1:], ends[0], TINY, TINY, PERFECT))
    expected = (length - 1) * aspect / (film * width)  # L / (h W) between the centres of the end cells
    assert resistance(sheet, thickness) == pytest.approx(expected, rel=1e-5)


def test_an_annulus_has_the_resistance_of_an_annulus():
    inner, outer, film = 1.0, 4.0, 0.7
    expected = np.log(outer / inner) / (2 * np.pi * film)
    found, cells = {}, (30, 60, 120)
    for n in cells:
        x = -5.0 + (np.arange(n) + 0.5) * 10.0 / n
        ring = (np.hypot(x[:, None], x[None, :]) > outer).astype(float)
        disc = (np.hypot(x[:, None], x[None, :]) < inner).astype(float)
        thickness = np.full((n, n), film)
        sheet = FilmSheet(flat_faces((n, n), (10 / n, 10 / n)), Discs(disc[None], ring, TINY, TINY, PERFECT))
        found[n] = resistance(sheet, thickness)
        # The rims run between cell centres, at most one cell inside the disc and one outside the ring.
        widest = np.log((outer + 10 / n) / (inner - 10 / n)) / (2 * np.pi * film)
        assert expected < found[n] < widest
    # Between these bounds the error is of first order in the cell; taking it out leaves that of the staircase.
    assert abs(2 * found[120] - found[60] - expected) < 0.015 * expected


@pytest.mark.parametrize("ratio", [1.2, 2.0, 4.2])
def test_a_small_disc_on_a_thick_film_agrees_with_the_method_of_images(ratio):
    radius, outer, n = 1.0, 10.0, 128
    film = ratio * radius
    x = -12.0 + (np.arange(n) + 0.5) * 24.0 / n
    ring = (np.hypot(x[:, None], x[None, :]) > outer).astype(float)
    disc = disc_overlap(x, x, (0.0, 0.0), radius)
    thickness = np.full((n, n), film)
    # The ring must be perfect and the disc must not: the ring's 4/(pi a) is made huge by its "radius".
    sheet = FilmSheet(flat_faces((n, n), (24 / n, 24 / n)), Discs(disc[None], ring, radius, TINY))
    images = 1 / (4 * radius) + (np.log(outer / (4 * film)) + np.euler_gamma) / (2 * np.pi * film)
    # The contact law is within 2 % of 1/(4a); the ring's staircase adds 0.2 mm of 10.
    assert resistance(sheet, thickness) == pytest.approx(images, abs=0.03 / (4 * radius))


@pytest.mark.parametrize("thin", [0.9, 0.5, 0.1])
def test_a_thinner_film_never_conducts_better(thin):
    # No conductor does (Rayleigh); the depth-averaged contact alone would, for small discs on thick films.
    x = -6.0 + (np.arange(48) + 0.5) * 0.25
    drive = disc_overlap(x, x, (-4.0, 0.0), 0.8)
    disc = disc_overlap(x, x, (3.0, 0.0), 0.3)
    thick = np.full((48, 48), 1.27)
    sheet = FilmSheet(flat_faces((48, 48), (0.25, 0.25)), Discs(disc[None], drive, 0.3, 0.8))
    assert resistance(sheet, thin * thick) > resistance(sheet, thick)


def several(rng, n=24, electrodes=4):
    x = -3.0 + (np.arange(n) + 0.5) * 6.0 / n
    places = rng.uniform(-2.4, 2.4, size=(electrodes + 1, 2))
    discs = [disc_overlap(x, x, (float(a), float(b)), 0.5) for a, b in places]
    sheet = FilmSheet(flat_faces((n, n), (6 / n, 6 / n)), Discs(np.stack(discs[1:]), discs[0], 0.5, 0.5))
    waves = rng.normal(size=(3, 3))
    rough = sum(
        waves[i, j] * np.cos(np.pi * i * (x[:, None] + 3) / 6) * np.cos(np.pi * j * (x[None, :] + 3) / 6)
        for i in range(3)
        for j in range(3)
    )
    # From a closed film to an open one, 0.06 to 1.3 mm: as steep as the BioTac's ever gets.
    return sheet, 0.28 * np.exp(1.54 * rough / np.abs(rough).max())


def in_full(sheet, film):
    """The same by one dense matrix of cells and electrodes, assembled face by face."""
    nx, ns = film.shape
    joints, drive = sheet._contacts.joints(film)
    size = film.size + sheet._contacts.count
    matrix, number = np.zeros((size, size)), np.arange(film.size).reshape(nx, ns)

    def join(one, other, conductance):
        for i, j, g in zip(np.ravel(one), np.ravel(other), np.ravel(conductance), strict=True):
            matrix[[i, j], [i, j]] += g
            matrix[[i, j], [j, i]] -= g

    mean = lambda a, b: (b - a) / np.log(b / a)  # noqa: E731
    join(number[1:], number[:-1], sheet._faces.along_x * mean(film[1:], film[:-1]))
    join(number[:, 1:], number[:, :-1], sheet._faces.along_s * mean(film[:, 1:], film[:, :-1]))
    join(sheet._contacts.under, film.size + sheet._contacts.owner, joints)
    matrix[np.arange(film.size), np.arange(film.size)] += drive
    return np.linalg.inv(matrix)[film.size :, film.size :]


@given(seed=st.integers(0, 10_000), shape=st.sampled_from([(24, 24), (9, 14), (14, 9), (2, 7), (7, 2), (3, 3)]))
@settings(max_examples=25, deadline=None)
def test_the_elimination_agrees_with_a_dense_inverse(seed, shape):
    rng = np.random.default_rng(seed)
    x, s = (-3.0 + (np.arange(n) + 0.5) * 6.0 / n for n in shape)
    discs = [disc_overlap(x, s, tuple(rng.uniform(-2.4, 2.4, 2)), 0.5) for _ in range(5)]
    sheet = FilmSheet(flat_faces(shape, (6 / shape[0], 6 / shape[1])), Discs(np.stack(discs[1:]), discs[0], 0.5, 0.5))
    film = np.exp(rng.uniform(np.log(0.06), np.log(2.4), shape))
    # Conductances over four decades: rounding of 1e-16, multiplied by as much.
    np.testing.assert_allclose(sheet.resistances(film), in_full(sheet, film), rtol=1e-9)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_resistances_are_reciprocal_and_no_potential_exceeds_its_source(seed):
    sheet, film = several(np.random.default_rng(seed))
    found = sheet.resistances(film)
    np.testing.assert_allclose(found, found.T, rtol=1e-9)
    # The maximum principle: the others lie between ground and the electrode that is fed.
    assert found.min() > 0
    assert np.all(found.max(axis=0) == np.diag(found))


@given(seed=st.integers(0, 10_000), share=st.floats(0.3, 0.95))
@settings(max_examples=25, deadline=None)
def test_no_electrodes_resistance_falls_where_film_is_lost(seed, share):
    # Rayleigh's law, with the others floating. Beside the discs: under one, a film fed from its face joins it the
    # better the thinner it is.
    rng = np.random.default_rng(seed)
    sheet, film = several(rng)
    touched = sheet._contacts.joints(film)[1] > 0
    touched[sheet._contacts.under] = True
    lost = np.where((rng.random(film.shape) < 0.3) & ~touched.reshape(film.shape), share * film, film)
    assert np.all(np.diag(sheet.resistances(lost)) >= np.diag(sheet.resistances(film)) * (1 - 1e-9))


@pytest.mark.parametrize("bad", [0.0, -0.1, np.nan, np.inf])
def test_a_film_that_is_none_is_refused(bad):
    sheet, film = several(np.random.default_rng(2))
    film[3, 4] = bad
    with pytest.raises(RigError, match="finite and positive"):
        sheet.resistances(film)


def test_a_disc_keeps_its_area_wherever_it_falls():
    x = -2.0 + (np.arange(40) + 0.5) * 0.1
    for shift in (0.0, 0.013, 0.05):
        areas = disc_overlap(x, x, (shift, -shift), 0.6)
        assert areas.sum() == pytest.approx(np.pi * 0.36, rel=1e-12)
        assert areas.max() <= 0.01 * 1.02  # no cell is covered by more than itself, up to the rescaling
    with pytest.raises(RigError, match="covers no part"):
        disc_overlap(x, x, (9.0, 0.0), 0.6)
