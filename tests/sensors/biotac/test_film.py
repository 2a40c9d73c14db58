"""The film at rest and its way to the conduction's grid."""

import numpy as np
import pytest

from tactbench.sensors.biotac import SKIN
from tactbench.sensors.biotac.channels import ELECTRODES
from tactbench.sensors.biotac.conduction import faces_between
from tactbench.sensors.biotac.meshes import CORE_MM, ELECTRODES_MM, core_reach_mm
from tactbench.sensors.biotac.transduction import mid_film_mm, spectral_interpolation

OUTER, DOME = SKIN.sheet.outer_radius.to("mm"), SKIN.sheet.dome.start.to("mm")


def test_every_electrode_is_let_into_the_core_by_the_same_depth():
    # The facet's distance is set by electrode 7 alone; the tip's other three and the rest must follow.
    for electrode in ELECTRODES:
        height, angle = np.hypot(electrode.y_mm, electrode.z_mm), np.arctan2(electrode.y_mm, -electrode.z_mm)
        behind = min(electrode.x_mm, 1.8)
        ray = np.arctan2(electrode.x_mm - behind, height)
        let_in = core_reach_mm(np.array(behind), np.array(ray), np.array(angle)) - np.hypot(
            electrode.x_mm - behind, height
        )
        # Along the ray, which leans on the facet by up to 22 degrees; electrode 1 has a bevel of its own.
        assert 0.9 * (CORE_MM - ELECTRODES_MM) < let_in < 1.4 * (CORE_MM - ELECTRODES_MM)


def test_the_inner_skin_ends_where_the_meshes_do():
    (tip,) = mid_film_mm(np.array([OUTER + DOME]), np.zeros(1), np.zeros((1, 1)), OUTER, DOME)[0]
    assert tip == pytest.approx([7.13, 0.0, 0.0], abs=0.03)


def test_a_curved_film_conducts_as_its_middle_is_long():
    # A half cylinder of film, current along the arc: L / (h W) with L at the film's middle.
    x, angle = np.linspace(-10.0, -5.0, 6), np.linspace(-1.2, 1.2, 60)
    faces = faces_between(mid_film_mm(x, angle, np.full((6, 60), 0.4), OUTER, DOME))
    step = (CORE_MM + 0.2) * (angle[1] - angle[0])
    # Chords of a fortieth of a radian, and a facet that begins at x = -0.07.
    np.testing.assert_allclose(faces.along_s, 1.0 / step, rtol=1e-3)
    np.testing.assert_allclose(faces.along_x, step, rtol=1e-3)


@pytest.mark.parametrize(
    ("n", "finer", "mirrored", "phase", "waves"),
    # A mirrored sample goes on as its own image: half waves, too, which a period of the same length does not hold.
    [(16, 64, False, 0.7, (0, 1, 7)), (64, 192, False, 0.7, (0, 1, 31)), (64, 96, True, 0.0, (0, 0.5, 3.5, 31.5))],
)
def test_waves_below_nyquist_arrive_unchanged(n, finer, mirrored, phase, waves):
    to_fine = spectral_interpolation(n, finer, mirrored=mirrored)
    for wave in waves:
        coarse, fine = (np.cos(2 * np.pi * wave * (np.arange(cells) + 0.5) / cells + phase) for cells in (n, finer))
        # Exact in exact arithmetic; n terms of rounding. A missing half-cell shift is off by pi*wave/(2n).
        assert to_fine @ coarse == pytest.approx(fine, abs=1e-12)
