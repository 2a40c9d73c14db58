"""The reference of contact against closed forms and finite elements."""

from __future__ import annotations

import numpy as np
import pytest

from tests.oracles import finite_elements
from tests.oracles.boundary_elements import HalfSpace, Layer, paraboloid_mm, pressed
from tests.oracles.closed_forms import Hertz

SOFT, SIDE, HERTZ = HalfSpace(1.0), 8.0, Hertz(10.0, 1.0)


def distances(cells: int) -> np.ndarray:
    x = (np.arange(cells) + 0.5) * (SIDE / cells) - SIDE / 2
    return np.hypot(x[:, None], x[None, :])


# The bounds are what point collocation reaches on these grids.
@pytest.mark.parametrize(
    ("cells", "depth", "peak", "radius"),
    [(64, 1.6e-4, 8.3e-4, 3.4e-4), (128, 4e-5, 2.1e-4, 1.1e-4)],
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


@pytest.mark.parametrize("poisson", [0.499])
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
