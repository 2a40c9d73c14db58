"""The conduction solver against conductors whose resistance is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.sensors.biotac.discs import Discs, disc_overlap
from tactbench.sensors.biotac.sheet import FilmSheet

# Contacts (almost) without resistance: a millionth of the sheet's own. Smaller still, and float64 would not resolve
# the sheet beside them.
PERFECT = 1e6
TINY = 1e-6  # radius, for the part of the contact that goes with 1/radius


def resistance(sheet: FilmSheet, film, leak: float) -> float:
    """Times sigma, between drive and the only electrode: (1 - V) / (leak V)."""
    potential = sheet.solve(film, tolerance=1e-10).electrodes[0]
    return float((1.0 - potential) / (leak * potential))


@given(width=st.integers(2, 12), length=st.integers(3, 30), film=st.floats(0.05, 3.0), aspect=st.floats(0.3, 3.0))
@settings(max_examples=40, deadline=None)  # the first example imports scipy
def test_a_uniform_strip_has_the_resistance_of_a_strip(width, length, film, aspect):
    ends = np.zeros((2, length, width))
    ends[0, 0] = ends[1, -1] = 1.0
    thickness = np.full((length, width), film)
    sheet = FilmSheet((aspect, 1.0), Discs(ends[1:], ends[0], TINY, TINY, PERFECT), 0.3, thickness)
    expected = (length - 1) * aspect / (film * width)  # L / (h W) between the centres of the end cells
    assert resistance(sheet, thickness, 0.3) == pytest.approx(expected, rel=1e-5)


def test_an_annulus_has_the_resistance_of_an_annulus():
    inner, outer, film, leak = 1.0, 4.0, 0.7, 0.5
    expected = np.log(outer / inner) / (2 * np.pi * film)
    found, cells = {}, (30, 60, 120)
    for n in cells:
        x = -5.0 + (np.arange(n) + 0.5) * 10.0 / n
        ring = (np.hypot(x[:, None], x[None, :]) > outer).astype(float)
        disc = (np.hypot(x[:, None], x[None, :]) < inner).astype(float)
        thickness = np.full((n, n), film)
        sheet = FilmSheet((10 / n, 10 / n), Discs(disc[None], ring, TINY, TINY, PERFECT), leak, thickness)
        found[n] = resistance(sheet, thickness, leak)
        # The rims run between cell centres, at most one cell inside the disc and one outside the ring.
        widest = np.log((outer + 10 / n) / (inner - 10 / n)) / (2 * np.pi * film)
        assert expected < found[n] < widest
    # Between these bounds the error is of first order in the cell; taking it out leaves that of the staircase.
    assert abs(2 * found[120] - found[60] - expected) < 0.015 * expected


@pytest.mark.parametrize("ratio", [1.2, 2.0, 4.2])
def test_a_small_disc_on_a_thick_film_agrees_with_the_method_of_images(ratio):
    radius, outer, n = 1.0, 10.0, 128
    film, leak = ratio * radius, 0.2
    x = -12.0 + (np.arange(n) + 0.5) * 24.0 / n
    ring = (np.hypot(x[:, None], x[None, :]) > outer).astype(float)
    disc = disc_overlap(x, x, (0.0, 0.0), radius)
    thickness = np.full((n, n), film)
    # The ring must be perfect and the disc must not: the ring's 4/(pi a) is made huge by its "radius".
    sheet = FilmSheet((24 / n, 24 / n), Discs(disc[None], ring, radius, TINY), leak, thickness)
    images = 1 / (4 * radius) + (np.log(outer / (4 * film)) + np.euler_gamma) / (2 * np.pi * film)
    # The contact law is within 2 % of 1/(4a); the ring's staircase adds 0.2 mm of 10.
    assert resistance(sheet, thickness, leak) == pytest.approx(images, abs=0.03 / (4 * radius))


@pytest.mark.parametrize("thin", [0.9, 0.5, 0.1])
def test_a_thinner_film_never_conducts_better(thin):
    # No conductor does (Rayleigh); the depth-averaged contact alone would, for small discs on thick films.
    x = -6.0 + (np.arange(48) + 0.5) * 0.25
    drive = disc_overlap(x, x, (-4.0, 0.0), 0.8)
    disc = disc_overlap(x, x, (3.0, 0.0), 0.3)
    thick = np.full((48, 48), 1.27)
    sheet = FilmSheet((0.25, 0.25), Discs(disc[None], drive, 0.3, 0.8), 0.1, thick)
    assert sheet.solve(thin * thick).electrodes[0] < sheet.solve(thick).electrodes[0]


def several(rng, n=24, electrodes=4):
    x = -3.0 + (np.arange(n) + 0.5) * 6.0 / n
    places = rng.uniform(-2.4, 2.4, size=(electrodes + 1, 2))
    discs = [disc_overlap(x, x, (float(a), float(b)), 0.5) for a, b in places]
    film = np.full((n, n), 1.0)
    sheet = FilmSheet((6 / n, 6 / n), Discs(np.stack(discs[1:]), discs[0], 0.5, 0.5), 0.07, film)
    waves = rng.normal(size=(3, 3))
    rough = sum(
        waves[i, j] * np.cos(np.pi * i * (x[:, None] + 3) / 6) * np.cos(np.pi * j * (x[None, :] + 3) / 6)
        for i in range(3)
        for j in range(3)
    )
    # From a closed film to an open one, 0.06 to 1.3 mm: as steep as the BioTac's ever gets.
    return sheet, 0.28 * np.exp(1.54 * rough / np.abs(rough).max())


@given(seed=st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_what_flows_in_flows_out(seed):
    sheet, film = several(np.random.default_rng(seed))
    entering, leaving = sheet.currents(film, sheet.solve(film, tolerance=1e-10).unknowns)
    assert entering > 0
    # Charge is lost only by what the iteration leaves: 1e-10 in the energy norm, a few powers less well in currents.
    assert leaving == pytest.approx(entering, rel=1e-7)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_the_iteration_agrees_with_a_direct_solution(seed):
    sheet, film = several(np.random.default_rng(seed))
    direct = sheet.solve_directly(film)
    cold, warm = sheet.solve(film), sheet.solve(film, [sheet.solve(1.1 * film).unknowns])
    for answer in (cold, warm):
        # The promise of TOLERANCE: 0.12 of 4095 counts.
        assert 4095 * np.abs(answer.electrodes - direct[sheet.cells :]).max() < 0.12


@given(seed=st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_potentials_lie_between_ground_and_drive(seed):
    sheet, film = several(np.random.default_rng(seed))
    unknowns = sheet.solve(film, tolerance=1e-9).unknowns
    assert unknowns.min() > 0.0  # the maximum principle
    assert unknowns.max() < 1.0


def test_the_film_at_rest_needs_no_step():
    sheet, _ = several(np.random.default_rng(1))
    assert sheet.solve(np.full((24, 24), 1.0)).steps == 0


@pytest.mark.parametrize("bad", [0.0, -0.1, np.nan, np.inf])
def test_a_film_that_is_none_is_refused(bad):
    sheet, film = several(np.random.default_rng(2))
    film[3, 4] = bad
    with pytest.raises(RigError, match="finite and positive"):
        sheet.solve(film)


def test_a_disc_keeps_its_area_wherever_it_falls():
    x = -2.0 + (np.arange(40) + 0.5) * 0.1
    for shift in (0.0, 0.013, 0.05):
        areas = disc_overlap(x, x, (shift, -shift), 0.6)
        assert areas.sum() == pytest.approx(np.pi * 0.36, rel=1e-12)
        assert areas.max() <= 0.01 * 1.02  # no cell is covered by more than itself, up to the rescaling
    with pytest.raises(RigError, match="covers no part"):
        disc_overlap(x, x, (9.0, 0.0), 0.6)
