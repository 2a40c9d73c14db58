"""The reference of contact against closed forms and finite elements."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tactbench.rigs.twin.contact.layer import compliance_shape
from tests.oracles import finite_elements
from tests.oracles.boundary_elements import HalfSpace, Layer, paraboloid_mm, pressed
from tests.oracles.closed_forms import CattaneoMindlin, FlatPunch, Hertz, ThinLayer

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
        for radius in (1.77, 1.83, 1.91, 2.0, 2.07, 2.13):
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


@pytest.mark.parametrize("poisson", [0.0, 0.3])
@pytest.mark.parametrize("ratio", [10, 22])
def test_a_thin_compressible_layer_is_a_bed_of_springs(poisson, ratio):
    # The next term of the compliance, C = h/E_oed (1 + c q²), adds c h² |grad p|² / 2k to the energy: with the pressure
    # of the springs that deepens a paraboloid under a given force by 2c (h/a)².
    h, q = 0.05, 1e-2
    limit = (1 - 2 * poisson) / (2 * (1 - poisson) ** 2)
    c = (float(compliance_shape(np.array([q]), poisson)[0]) / (q * limit) - 1) / q**2
    a, law = ratio * h, ThinLayer(10.0, poisson, h)
    found = pressed(Layer(1.0, poisson, h), paraboloid_mm(128, 4 * a), 4 * a, law.force_n(a))
    # Half of the term after it, and 1e-4 for cells of a/32.
    assert found.depth_mm == pytest.approx(law.depth_mm(a) * (1 + 2 * c / ratio**2), rel=0.5 / ratio**3 + 1e-4)


def test_a_thin_incompressible_layer_flows_aside():
    h, short = 0.05, {}
    for ratio in (10, 15, 22):
        a, law = ratio * h, ThinLayer(10.0, 0.5, h)
        found = pressed(Layer(1.0, 0.5, h), paraboloid_mm(256, 8 * a), 8 * a, law.force_n(a))
        short[ratio] = 1 - found.depth_mm / law.depth_mm(a)
        assert 0 <= short[ratio] <= 0.6 / ratio  # a limit from above: a rim of 0.6 h is no film
    # It closes with h/a or its square.
    assert (10 / 22) ** 2 <= short[22] / short[10] <= 10 / 22


@pytest.mark.parametrize("poisson", [0.3, 0.45, 0.499])
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


def test_a_layer_against_finite_elements_narrow_contact():
    """Depth 0.1 mm: a contact radius near 1.2 mm."""
    force = finite_elements.force_at(0.1, *finite_elements.surface_compliance(0.45, *finite_elements.graded(1.7, 2)))
    found = pressed(Layer(1.0, 0.45, 2.0), paraboloid_mm(512, 32.0), 32.0, force)
    # Cells of a/19 leave 1e-4, the finite elements as much.
    assert found.depth_mm == pytest.approx(0.1, rel=2.5e-4)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_partial_slip_is_the_difference_of_two_contacts(share):
    """With equal normal and tangential influence the smaller contact sticks (Jäger 1998; Ciavarella 1998)."""
    friction, cells = 0.6, 128
    law = CattaneoMindlin(friction, HERTZ.contact_radius_mm(1.0), 1.0, tangential_modulus_mpa=1.0)
    push, gap, r = share * friction, paraboloid_mm(cells, SIDE), distances(cells)
    whole, stuck = pressed(SOFT, gap, SIDE, 1.0), pressed(SOFT, gap, SIDE, 1.0 - share)
    # The smaller contact's radius and depth at 14 cells.
    ratio = stuck.contact_radius_mm / whole.contact_radius_mm
    assert ratio == pytest.approx(law.stick_radius_mm(push) / law.contact_radius_mm, abs=1e-3)
    assert friction * (whole.depth_mm - stuck.depth_mm) == pytest.approx(law.shift_mm(push), rel=1e-3)
    away = np.abs(r - law.stick_radius_mm(push)) > 2 * SIDE / cells
    away &= np.abs(r - law.contact_radius_mm) > 2 * SIDE / cells
    traction, truth = friction * (whole.pressure_mpa - stuck.pressure_mpa), law.traction_mpa(push, r)
    # (h/a)² at 14 cells, two cells off the rims.
    assert rms((traction - truth)[away]) <= 3e-3 * truth.max()
