"""The film at rest and its way to the finer grid."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import FluidBackedShell, SkinGrid, UsageError
from tactbench.sensors.biotac.film import film_at_rest, refined, spectral_interpolation
from tactbench.sensors.biotac.spec import SKIN


@given(s=st.floats(0.0, 12.8), further=st.floats(0.0, 2.0))
def test_the_film_is_a_mirror_image_and_narrows_towards_the_sides(s, further):
    film = film_at_rest(SKIN, np.array([-s, s, s + further]))
    assert film[0] == film[1]
    assert film[2] <= film[1]
    assert SKIN.gap_side.to("mm") <= film[2]
    assert film[1] <= SKIN.gap.to("mm")


def test_the_film_has_the_measured_thickness_at_the_pad_and_at_the_sides():
    pad, side = film_at_rest(SKIN, np.array([0.0, np.radians(77.0) * 8.2]))
    # Inner skin minus core in the public meshes. They have 0.15-0.7 mm near 70 degrees; the fit comes there at 77,
    # where the side electrodes are, and has 0.85 mm at 70.
    assert 1.2 <= pad <= 1.3
    assert 0.15 <= side <= 0.7


def test_a_flat_sheet_has_no_film():
    flat = SKIN.model_copy(update={"sheet": SKIN.sheet.model_copy(update={"outer_radius": None})})
    assert isinstance(flat, FluidBackedShell)
    with pytest.raises(UsageError, match="outer radius"):
        film_at_rest(flat, np.zeros(1))


def test_refined_cells_fill_the_same_sheet():
    grid = SkinGrid(np.arange(6) + 0.5, np.arange(4) * 0.5)
    fine = refined(grid, 3)
    assert fine.cell_mm == pytest.approx((1 / 3, 0.5 / 3))
    # The mean of the three parts of a cell is its centre.
    assert fine.x_mm.reshape(6, 3).mean(axis=1) == pytest.approx(grid.x_mm)
    assert fine.s_mm.reshape(4, 3).mean(axis=1) == pytest.approx(grid.s_mm)


@pytest.mark.parametrize("n", [16, 48, 64])
@pytest.mark.parametrize("factor", [2, 3, 4])
def test_waves_below_nyquist_arrive_unchanged(n, factor):
    to_fine = spectral_interpolation(n, n * factor)
    coarse = (np.arange(n) + 0.5) / n
    fine = (np.arange(n * factor) + 0.5) / (n * factor)
    for wave in (0, 1, 3, n // 2 - 1):
        for phase in (0.0, 0.7):
            there = np.cos(2 * np.pi * wave * fine + phase)
            # Exact in exact arithmetic; n terms of rounding. A missing half-cell shift is off by pi*wave/(2n).
            assert to_fine @ np.cos(2 * np.pi * wave * coarse + phase) == pytest.approx(there, abs=1e-12)


def test_the_mean_is_kept():
    # The fluid's volume: zero stays zero on the finer grid.
    field = np.random.default_rng(3).normal(size=64)
    assert (spectral_interpolation(64, 128) @ field).mean() == pytest.approx(field.mean(), abs=1e-14)
