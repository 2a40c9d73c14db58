"""The reference of contact against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from tests.oracles.boundary_elements import HalfSpace, paraboloid_mm, pressed
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
