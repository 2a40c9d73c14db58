"""Laws of the contact solver first, then values."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.rigs.twin.contact.layer import layer_kernel
from tactbench.rigs.twin.contact.newton import TOLERANCE, Press
from tactbench.rigs.twin.contact.skins import medium_of

from .bodies import BIOTAC, ICUB, layer_skin, press, scaled, with_clamp_from_first_cell

SKINS = {"shell": (BIOTAC, -5.0), "foam": (ICUB, 0.0), "layer": (layer_skin(0.3, cells=48, penalty=30.0), 0.0)}
skins = pytest.mark.parametrize("name", SKINS)


def cell_area(one):
    dx, ds = one.medium.grid.cell_mm
    return dx * ds


@skins
@settings(max_examples=12, deadline=None)
@given(radius=st.sampled_from([3.0, 10.0, 40.0, math.inf]), force=st.floats(1e-6, 20.0), s=st.floats(-1.5, 1.5))
def test_the_load_is_carried_and_the_fluid_keeps_its_volume(name, radius, force, s):
    skin, x = SKINS[name]
    one = press(skin, radius, x, s)
    found = one.solve(force)
    # The residual's own definition: |sum p dA - F| / F is one of its two parts.
    assert found.pressure.sum() * cell_area(one) == pytest.approx(force, rel=TOLERANCE)
    assert (found.pressure >= 0).all()
    if one.medium.keeps_volume:
        # Rounding of a mean over 3072 cells of up to a millimetre, in double precision.
        assert abs(found.w.mean()) < 1e-12
        carried = found.pressure - one.medium.law.pressure(found.w)
        assert found.fluid_pressure == pytest.approx(carried.mean(), rel=1e-12)


@skins
def test_the_gradient_is_that_of_the_energy(name):
    skin, x = SKINS[name]
    one = press(skin, 10.0, x)
    rng = np.random.default_rng(0)
    found = one.solve(1.0)
    w, d = found.w + 0.001 * rng.normal(size=one.gap.shape), found.approach_mm
    way = rng.normal(size=one.gap.shape)
    if one.medium.keeps_volume:
        way -= way.mean()
    g_w, g_d = one.gradient(w, d, 1.0)
    e = 1e-6
    by_difference = (one.energy(w + e * way, d, 1.0) - one.energy(w - e * way, d, 1.0)) / (2 * e)
    # Central differences of a piecewise quadratic: exact but for cells that change sides within the step, and roundoff.
    assert float((g_w * way).sum()) * cell_area(one) == pytest.approx(by_difference, rel=1e-5)
    by_difference = (one.energy(w, d + e, 1.0) - one.energy(w, d - e, 1.0)) / (2 * e)
    assert g_d == pytest.approx(by_difference, rel=1e-5)


@skins
def test_the_approach_grows_with_the_load_and_the_pressure_spreads(name):
    skin, x = SKINS[name]
    one = press(skin, 10.0, x)
    found = [one.solve(force) for force in (1e-9, 1e-3, 0.1, 1.0, 5.0, 50.0, 500.0)]
    depths = [one.approach_mm for one in found]
    areas = [int((one.pressure > 0).sum()) for one in found]
    assert all(np.diff(depths) > 0)
    assert all(np.diff(areas) >= 0)
    assert all(np.isfinite(one.w).all() for one in found)


@skins
def test_no_load_is_exactly_rest(name):
    skin, x = SKINS[name]
    rest = press(skin, 10.0, x).solve(0.0)
    assert not rest.w.any()
    assert (rest.approach_mm, rest.fluid_pressure, rest.steps) == (0.0, 0.0, 0)


@skins
def test_a_cap_of_a_thousand_kilometres_is_flat(name):
    skin, x = SKINS[name]
    # The sag over 13 mm at R = 1e9 mm is 1e-7 mm: seven digits below the approach.
    assert press(skin, 1e9, x).solve(5.0).approach_mm == pytest.approx(press(skin, math.inf, x).solve(5.0).approach_mm,
                                                                        abs=2e-6)  # fmt: skip


@skins
def test_force_scales_with_all_moduli(name):
    skin, x = SKINS[name]
    soft, hard = press(skin, 10.0, x).solve(2.0, tol=1e-9), press(scaled(skin, 3.0), 10.0, x).solve(6.0, tol=1e-9)
    assert np.abs(hard.w - soft.w).max() < 1e-6  # mm: both solved to 1e-9 of the load
    assert hard.fluid_pressure == pytest.approx(3 * soft.fluid_pressure, rel=1e-6)


@skins
def test_a_press_on_the_midline_is_its_own_mirror_image(name):
    skin, x = SKINS[name]
    w = press(skin, 10.0, x).solve(3.0, tol=1e-10).w
    assert np.abs(w - w[:, ::-1]).max() < 1e-7  # mm


def test_a_start_from_a_neighbour_ends_in_the_same_place():
    one = press(BIOTAC, 10.0, -5.0)
    near = one.solve(2.5)
    warm, cold = one.solve(3.0, (near.w, near.approach_mm), tol=1e-9), one.solve(3.0, tol=1e-9)
    assert np.abs(warm.w - cold.w).max() < 1e-6  # mm


def test_tilt_does_not_move_the_origin_of_the_approach():
    straight, tilted = press(BIOTAC, 10.0, -5.0), press(BIOTAC, 10.0, -5.0, tilt=(0.3, 0.0))
    assert tilted.gap.min() == 0.0
    assert 0 < tilted.solve(1e-6).approach_mm < 0.01
    assert straight.gap.min() == 0.0


# Values of physics.md section 6 (approach in mm, fluid pressure in kPa), printed with three and two decimals. They
# were made without subtracting the smallest gap of the grid, which is added here, and with clamps measured from cell
# centres.
ANCHORS = {
    5.0: {0.1: (0.216, 0.54), 0.5: (0.796, 2.68), 1.0: (1.348, 5.18), 2.0: (1.515, 6.10), 5.0: (1.777, 7.72)},
    40.0: {0.1: (0.157, 0.53), 0.5: (0.487, 2.46), 1.0: (0.729, 4.49), 2.0: (1.008, 7.75), 5.0: (1.322, 13.75)},
    math.inf: {0.1: (0.027, 0.21), 0.5: (0.112, 0.96), 1.0: (0.202, 1.84), 2.0: (0.357, 3.47), 5.0: (0.694, 8.28)},
}


def smallest_gap(medium, radius, x):
    """The gap under the apex where no cell centre is under it."""
    along, arc = np.abs(medium.grid.x_mm - x).min(), np.abs(medium.grid.s_mm).min()
    across, fall = arc, 0.0
    if not math.isinf(medium.outer_radius_mm):
        across = medium.outer_radius_mm * math.sin(arc / medium.outer_radius_mm)
        fall = 2 * medium.outer_radius_mm * math.sin(arc / medium.outer_radius_mm / 2) ** 2
    r2 = along**2 + across**2
    return fall + (0.0 if math.isinf(radius) else r2 / (radius + math.sqrt(radius**2 - r2)))


@pytest.mark.parametrize("radius", ANCHORS)
def test_the_fluid_backed_skin_against_an_independent_implementation(radius):
    one = with_clamp_from_first_cell(press(BIOTAC, radius, -5.0))
    offset = smallest_gap(one.medium, radius, -5.0)
    for force, (depth, pressure) in ANCHORS[radius].items():
        found = one.solve(force)
        assert found.approach_mm + offset == pytest.approx(depth, abs=6e-4)  # the last printed digit
        assert found.fluid_pressure * 1e3 == pytest.approx(pressure, abs=6e-3)


@pytest.mark.parametrize(
    ("radius", "depths"),
    [(5.0, (0.245, 0.614, 0.850, 1.117, 1.468)), (40.0, (0.139, 0.342, 0.484, 0.668, 0.975)),
     (math.inf, (0.047, 0.185, 0.303, 0.471, 0.770))],
)  # fmt: skip
def test_the_foam_against_an_independent_implementation(radius, depths):
    one = press(ICUB, radius, 0.0)
    offset = smallest_gap(one.medium, radius, 0.0)
    for force, depth in zip((0.1, 0.5, 1.0, 2.0, 5.0), depths, strict=True):
        assert one.solve(force).approach_mm + offset == pytest.approx(depth, abs=1.1e-3)  # arc 20.42 here, 20.4 there


@pytest.mark.parametrize(
    ("nu", "depth", "force"),
    [(0.0, 0.1, 0.21212), (0.3, 0.1, 0.25159), (0.45, 0.1, 0.32848),
     (0.0, 0.5, 4.15586), (0.3, 0.5, 5.29855), (0.45, 0.5, 8.50762)],
)  # fmt: skip
def test_the_bonded_layer_against_axisymmetric_finite_elements(nu, depth, force):
    """Sphere R = 10 mm on 2 mm, E = 1 MPa; finite elements of second order (physics.md section 13)."""
    flat = press(layer_skin(nu))
    grid = flat.medium.grid
    paraboloid = (grid.x_mm[:, None] ** 2 + grid.s_mm[None, :] ** 2) / 20.0  # those elements were pressed by r²/2R
    offset = paraboloid.min()
    one = Press(flat.medium, paraboloid - offset)
    found = one.solve(force)
    # What the finite penalty gives way: the mean contact pressure over its stiffness, and the cell of 0.19 mm.
    soft = found.pressure.max() / one.medium.contact_stiffness
    assert found.approach_mm + offset - soft == pytest.approx(depth, rel=4e-3)


@given(q=st.floats(1e-8, 400.0), nu=st.floats(0.0, 0.5))
def test_the_layer_kernel_is_positive_bounded_and_has_its_limits(q, nu):
    value = float(layer_kernel(np.array([q]), nu)[0])
    assert 0 < value <= 1 + 1e-12 or q < 1e-3
    if q > 20:
        assert value == pytest.approx(1.0, abs=1e-12)  # half-space
    if q < 1e-3 and nu < 0.499:
        # Winkler; corrections are of order q² / (1 - 2 nu).
        assert value == pytest.approx(q * (1 - 2 * nu) / (2 * (1 - nu) ** 2), rel=1e-6 / (1 - 2 * nu) * 10)
    if q < 1e-3 and nu == 0.5:
        assert value == pytest.approx(2 / 3 * q**3, rel=1e-5)  # lubrication


def test_the_layer_kernel_has_no_seam_where_its_two_forms_meet():
    for nu in (0.0, 0.3, 0.49, 0.5):
        low, high = layer_kernel(np.array([0.35 - 1e-9, 0.35 + 1e-9]), nu)
        assert low == pytest.approx(high, rel=1e-7)  # the slope times 2e-9


def test_an_impossible_poisson_ratio_is_refused():
    with pytest.raises(RigError, match=r"0\.6"):
        medium_of(layer_skin(0.6))
