"""The reference of contact against closed forms and finite elements."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.oracles import finite_elements
from tests.oracles.boundary_elements import HalfSpace, Layer, paraboloid_mm, pressed
from tests.oracles.closed_forms import FlatPunch, Hertz

SOFT, SIDE, HERTZ = HalfSpace(1.0), 8.0, Hertz(10.0, 1.0)


def distances(cells: int) -> np.ndarray:
    x = (np.arange(cells) + 0.5) * (SIDE / cells) - SIDE / 2
    return np.hypot(x[:, None], x[None, :])


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def order(cells, errors) -> float:
    return -float(np.polyfit(np.log(cells), np.log(errors), 1)[0])


# The bounds are what point collocation reaches on these grids.
@pytest.mark.parametrize(
    ("cells", "depth", "peak", "radius"),
    [(64, 1.6e-4, 8.3e-4, 3.4e-4), (128, 4e-5, 2.1e-4, 1.1e-4), (256, 1.2e-5, 5e-5, 2.4e-5)],
)
def test_hertz(cells, depth, peak, radius):
    found, a = pressed(SOFT, paraboloid_mm(cells, SIDE), SIDE, 1.0), HERTZ.contact_radius_mm(1.0)
    assert found.depth_mm == pytest.approx(HERTZ.depth_mm(1.0), rel=depth)
    assert found.contact_radius_mm == pytest.approx(a, rel=radius)
    # The four cells in the middle: their mean of Hertz's pressure, by its series to fourth order.
    h2 = (SIDE / cells / a) ** 2
    top = HERTZ.largest_pressure_mpa(1.0) * (1 - h2 / 3 - 7 * h2**2 / 90)
    assert found.pressure_mpa.max() == pytest.approx(top, rel=peak)
    inner = distances(cells) < 0.8 * a
    # Cells of a/16 at most: the mean of a cell differs from its centre by (h/a)²/12.
    np.testing.assert_allclose(
        found.pressure_mpa[inner], HERTZ.pressure_mpa(1.0, distances(cells)[inner]), rtol=8e-3 * (64 / cells) ** 2
    )


def test_depth_converges_faster_than_the_square_of_the_cell():
    cells, errors = [32, 64, 128], []
    for n in cells:
        errors.append(
            rms(
                [
                    pressed(SOFT, paraboloid_mm(n, SIDE, radius, x, 0.37 * x), SIDE, 1.0).depth_mm
                    / Hertz(radius, 1.0).depth_mm(1.0)
                    - 1
                    for x in (0.0, 0.013, 0.05)
                    for radius in (8.0, 10.0, 12.0)
                ]
            )
        )
    # Theory: 3 (piecewise constants miss a pressure with a square-root rim by h³ in energy). The rim moves in whole
    # cells, so single grids scatter; point collocation, of order 2, would be out.
    assert 2.3 <= order(cells, errors) <= 3.7


def test_flat_punches_sink_with_the_first_power_of_the_cell():
    cells, depths = [64, 128, 256], []
    for n in cells:
        off, pressures = [], []
        for radius in (1.77, 1.91, 2.07):
            punch, r = FlatPunch(radius, 1.0), distances(n)
            found = pressed(SOFT, np.where(r <= radius, 0.0, math.inf), SIDE, 1.0)
            inner = r < 0.7 * radius
            off.append(found.depth_mm / punch.depth_mm(1.0) - 1)
            pressures.append(rms(found.pressure_mpa[inner] / punch.pressure_mpa(1.0, r[inner]) - 1))
        depths.append(rms(off))
        # A tenth of a cell over the radius is all that a rim of whole cells knows; of the pressure up to three times.
        assert depths[-1] <= 0.1 * SIDE / n / 2
        assert rms(pressures) <= 0.3 * SIDE / n / 2
    # 1 from the singular rim, 3/2 from the area of a circle of whole cells.
    assert 0.7 <= order(cells, depths) <= 1.8


@pytest.mark.parametrize("poisson", [0.3, 0.499])
def test_a_layer_against_finite_elements_wide_contact(poisson):
    """Depth 0.5 mm: contact radii of 2.8 to 3.1 mm on a layer of 2 mm."""
    misses = []
    for fineness in (1, 2):
        force = finite_elements.force_at(
            0.5, *finite_elements.surface_compliance(poisson, *finite_elements.graded(4.0, fineness))
        )
        misses.append(pressed(Layer(1.0, poisson, 2.0), paraboloid_mm(256, 32.0), 32.0, force).depth_mm / 0.5 - 1)
    # The finite elements' own error: their rim lies between nodes. It falls, and with it the difference.
    assert abs(misses[1]) <= 1.5e-4
    assert abs(misses[1]) <= 0.5 * abs(misses[0])
