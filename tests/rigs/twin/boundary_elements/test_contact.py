"""The reference solver against theory, against its classic sibling, and where it is hard."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.rigs.twin.boundary_elements import active_set, polonsky_keer
from tactbench.rigs.twin.boundary_elements.active_set import Problem
from tactbench.rigs.twin.boundary_elements.contact import press
from tactbench.rigs.twin.boundary_elements.grids import cell_means
from tactbench.rigs.twin.boundary_elements.kernels import HalfSpace, Layer
from tactbench.rigs.twin.boundary_elements.operator import operator
from tactbench.rigs.twin.closed_forms.half_space import FlatPunch, Hertz

SOFT = HalfSpace(1.0)
SIDE = 8.0
HERTZ = Hertz(radius_mm=10.0, modulus_mpa=1.0)


def centres(cells: int, side: float = SIDE) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
    h = side / cells
    x = (np.arange(cells) + 0.5) * h - side / 2
    return x[:, None], x[None, :], (h, h)


def paraboloid(cells: int, x0: float = 0.0, s0: float = 0.0, radius: float = 10.0, side: float = SIDE):
    x, s, cell = centres(cells, side)
    return ((x - x0) ** 2 + (s - s0) ** 2) / (2 * radius), cell


def rough(cells: int, rng: np.random.Generator) -> np.ndarray:
    """A self-affine surface of 0.05 mm rms, waves of 8 to 0.2 mm."""
    k = cells * np.hypot(np.fft.fftfreq(cells)[:, None], np.fft.rfftfreq(cells)[None, :])
    k[0, 0] = 1.0
    waves = np.where((k > 0.5) & (k < 40), k**-1.8, 0.0) * np.exp(2j * np.pi * rng.random(k.shape))
    height = np.fft.irfft2(waves, s=(cells, cells))
    return 0.05 * height / height.std()


def complementary(found, gap: np.ndarray, cell: tuple[float, float], force: float, tolerance: float = 1e-5) -> None:
    """No cell pulls, none penetrates, pressure only in contact, the force carried: on the whole domain."""
    reachable = np.isfinite(gap)
    mean = cell_means(np.where(reachable, gap, 0.0), reachable)
    distance = (found.displacement_mm + mean - found.depth_mm)[reachable]
    scale = found.depth_mm - mean[reachable].min()
    assert found.pressure_mpa.min() >= 0
    assert not found.pressure_mpa[~reachable].any()
    assert distance.min() >= -tolerance * scale * 50
    assert float(np.sum(found.pressure_mpa[reachable] * np.abs(distance))) <= tolerance * scale * np.sum(
        found.pressure_mpa
    )
    assert np.sum(found.pressure_mpa) * cell[0] * cell[1] == pytest.approx(force, rel=1e-12)


@pytest.mark.parametrize(("cells", "bound"), [(64, 1.6e-4), (128, 4e-5), (256, 1.2e-5)])
def test_depth_under_a_paraboloid(cells, bound):
    # The bounds are what point collocation reaches on these grids.
    gap, cell = paraboloid(cells)
    assert press(SOFT, gap, cell, 1.0).depth_mm == pytest.approx(HERTZ.depth_mm(1.0), rel=bound)


def test_depth_converges_faster_than_the_square_of_the_cell():
    cells, errors = np.array([32, 64, 128]), []
    for n in cells:
        one = [paraboloid(n, x0, 0.37 * x0, radius) for x0 in (0.0, 0.013, 0.05) for radius in (8.0, 10.0, 12.0)]
        radii = [radius for _ in range(3) for radius in (8.0, 10.0, 12.0)]
        found = [press(SOFT, gap, cell, 1.0).depth_mm for gap, cell in one]
        truth = np.array([Hertz(radius, 1.0).depth_mm(1.0) for radius in radii])
        errors.append(np.sqrt(np.mean((np.array(found) / truth - 1) ** 2)))
    order = -np.polyfit(np.log(cells), np.log(errors), 1)[0]
    # Theory: 3 (piecewise constants miss a pressure with a square-root rim by h³ in energy). The rim moves in whole
    # cells, so single grids scatter; point collocation, of order 2, would be out.
    assert 2.3 <= order <= 3.7


@settings(max_examples=20)
@given(
    st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(3, 30), st.floats(0.02, 1.5)
)  # fmt: skip
def test_error_estimate_is_no_smaller_than_a_third_of_the_error(x0, s0, radius, force):
    gap, cell = paraboloid(64, x0, s0, radius)
    found, law = press(SOFT, gap, cell, force), Hertz(radius, 1.0)
    if law.contact_radius_mm(force) > 3.5:
        return
    # The rim's whole cells make single errors scatter around zero, so a difference can be small by chance: the
    # tolerance is what one cell of the rim is worth, (h/a)² / 20 of the depth.
    by_chance = (cell[0] / law.contact_radius_mm(force)) ** 2 / 20 * law.depth_mm(force)
    assert abs(found.depth_mm - law.depth_mm(force)) <= 3 * found.depth_error_mm + by_chance


def test_pressure_and_radius_under_a_paraboloid():
    gap, cell = paraboloid(128)
    found = press(SOFT, gap, cell, 1.0)
    x, s, _ = centres(128)
    truth = HERTZ.pressure_mpa(1.0, np.hypot(x, s))
    inner = np.hypot(x, s) < 0.8 * HERTZ.contact_radius_mm(1.0)
    # Cells of a/31: the mean of a cell differs from its centre by (h/a)²/12.
    np.testing.assert_allclose(found.pressure_mpa[inner], truth[inner], rtol=2e-3)
    assert found.contact_radius_mm == pytest.approx(HERTZ.contact_radius_mm(1.0), rel=1e-4)


def test_flat_punch_sinks_with_the_first_power_of_the_cell():
    errors = []
    for cells in (64, 128, 256):
        x, s, cell = centres(cells)
        of_radii = []
        for radius in (1.83, 1.91, 2.0, 2.07):
            gap = np.where(np.hypot(x, s) <= radius, 0.0, math.inf)
            found = press(SOFT, gap, cell, 1.0)
            complementary(found, gap, cell, 1.0)
            of_radii.append(found.depth_mm / FlatPunch(radius, 1.0).depth_mm(1.0) - 1)
        errors.append(np.sqrt(np.mean(np.square(of_radii))))
    # A cell is h/a = 0.06 of the radius at 64: a tenth of that, halved twice.
    assert np.all(np.array(errors) <= 0.006 / np.array([1, 2, 4]))


CASES = {
    "two patches": lambda x, s: np.minimum((x - 2) ** 2 + (s - 2) ** 2, (x + 2) ** 2 + (s + 2.5) ** 2 + 0.04) / 4,
    "edge of the domain": lambda x, s: ((x - 3.9) ** 2 + s**2) / 20,
    "corner": lambda x, s: ((x - 4) ** 2 + (s - 4) ** 2) / 20,
    "cylinder": lambda x, s: x**2 / 20 + 0 * s,
    "cone": lambda x, s: 0.2 * np.hypot(x, s),
    "ring": lambda x, s: (np.hypot(x, s) - 2) ** 2 / 4,
    "tilted plate": lambda x, s: 0.05 * (x + 4) + 0 * s,
    "punch with a wall": lambda x, s: np.where(np.hypot(x, s) <= 2, 0.0, 10.0),
    "far offset": lambda x, s: 1e3 + (x**2 + s**2) / 20,
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("kernel", [SOFT, Layer(1.0, 0.3, 2.0), Layer(1.0, 0.5, 1.0)], ids=["half", "layer", "rubber"])
@pytest.mark.parametrize("force", [1e-9, 0.1, 200.0])
def test_hard_shapes_and_loads(name, kernel, force):
    x, s, cell = centres(64)
    gap = CASES[name](x, s)
    found = press(kernel, gap, cell, force)
    # An offset of a metre leaves 1e-13 mm of the gap: at a nanonewton that is more than the tolerance of the rest.
    complementary(found, gap, cell, force, 1e-4 if name == "far offset" and force < 1e-6 else 1e-5)
    assert found.residual < 1e-3 if name == "far offset" and force < 1e-6 else found.residual < 2e-5


@pytest.mark.parametrize("kernel", [SOFT, Layer(1.0, 0.3, 1.0), Layer(1.0, 0.5, 0.5)], ids=["half", "layer", "rubber"])
@pytest.mark.parametrize("force", [0.01, 2.0])
def test_rough_contact_is_what_polonsky_and_keer_find(kernel, force):
    gap = rough(64, np.random.default_rng(5))
    gap -= gap.min()
    cell = (SIDE / 64, SIDE / 64)
    found = press(kernel, gap, cell, force)
    complementary(found, gap, cell, force)
    reachable = np.ones(gap.shape, dtype=bool)
    mean = cell_means(gap, reachable)
    problem = Problem(operator(kernel, (64, 64), cell, (64, 64)), mean - mean.min(), reachable, force / cell[0] ** 2)
    start = np.where(problem.gap_mm < 0.01, 1.0, 0.0)
    classic = polonsky_keer.solve(problem, start, tolerance=1e-7, most_products=4000)
    assert classic.settled
    assert found.depth_mm - mean.min() == pytest.approx(classic.depth_mm, rel=1e-5)
    assert np.abs(found.pressure_mpa - classic.pressure_mpa).max() <= 1e-3 * found.pressure_mpa.max()


def test_when_the_active_set_does_not_settle_the_classic_takes_over(monkeypatch):
    gap, cell = paraboloid(32)
    before = press(SOFT, gap, cell, 1.0)
    monkeypatch.setattr("tactbench.rigs.twin.boundary_elements.contact._PRODUCTS", 2)
    after = press(SOFT, gap, cell, 1.0)
    assert after.products > before.products
    assert after.depth_mm == pytest.approx(before.depth_mm, rel=1e-5)
    monkeypatch.setattr("tactbench.rigs.twin.boundary_elements.contact._CLASSIC_PRODUCTS", 2)
    with pytest.raises(RigError, match="did not settle"):
        press(SOFT, gap, cell, 1.0)


def test_a_patch_that_the_coarse_grid_does_not_see_is_found():
    x, s, cell = centres(128)
    gap = (x**2 + s**2) / 20
    gap[100, 100] = 0.0
    # The mean over cells takes no bend from a spike, the coarse grid blurs it, the first window leaves it out.
    found = press(SOFT, gap, cell, 0.05)
    assert found.pressure_mpa[100, 100] > 0
    complementary(found, gap, cell, 0.05)


@settings(max_examples=10)
@given(st.floats(0.05, 20), st.floats(0.01, 100))
def test_moduli_and_forces_scale_together(force, factor):
    gap, cell = paraboloid(32)
    one = press(Layer(1.0, 0.4, 2.0), gap, cell, force)
    other = press(Layer(factor, 0.4, 2.0), gap, cell, force * factor)
    assert other.depth_mm == pytest.approx(one.depth_mm, rel=1e-9)


def test_mirrored_gaps_give_mirrored_pressures():
    rng = np.random.default_rng(2)
    gap, cell = paraboloid(64, 0.4, -0.2)
    gap = gap + 0.1 * rough(64, rng)
    one, other = press(SOFT, gap, cell, 0.5, tolerance=1e-9), press(SOFT, gap[::-1], cell, 0.5, tolerance=1e-9)
    np.testing.assert_allclose(other.pressure_mpa[::-1], one.pressure_mpa, atol=1e-6 * one.pressure_mpa.max())


def test_depth_grows_with_force():
    gap, cell = paraboloid(64)
    depths = [press(SOFT, gap, cell, force).depth_mm for force in np.geomspace(1e-6, 1e4, 25)]
    assert np.all(np.diff(depths) > 0)


def test_unequal_cells_and_unequal_sides():
    h = 0.1, 0.2
    x, s = (np.arange(96) - 47.5)[:, None] * h[0], (np.arange(40) - 19.5)[None, :] * h[1]
    found = press(SOFT, (x**2 + s**2) / 20, h, 1.0)
    # As coarse as 54 cells a side in one direction: twice the bound of 64.
    assert found.depth_mm == pytest.approx(HERTZ.depth_mm(1.0), rel=3.2e-4)


@pytest.mark.parametrize(
    ("gap", "cell", "force", "more", "message"),
    [
        (np.zeros(5), (1.0, 1.0), 1.0, {}, "shape"),
        (np.zeros((8, 8)), (1.0, 0.0), 1.0, {}, "Cells of"),
        (np.zeros((8, 8)), (1.0, 1.0), 0.0, {}, "force above zero"),
        (np.zeros((8, 8)), (1.0, 1.0), math.nan, {}, "force above zero"),
        (np.zeros((8, 8)), (1.0, 1.0), 1.0, {"tolerance": 0.0}, "tolerance"),
        (np.full((8, 8), np.inf), (1.0, 1.0), 1.0, {}, "no finite value"),
        (np.full((8, 8), np.nan), (1.0, 1.0), 1.0, {}, "no distance"),
    ],
)
def test_what_is_no_contact_problem_is_refused(gap, cell, force, more, message):
    with pytest.raises(RigError, match=message):
        press(SOFT, gap, cell, force, **more)


def test_an_exhausted_active_set_still_pushes_and_carries_the_load():
    gap, cell = paraboloid(32)
    everywhere = np.ones(gap.shape, dtype=bool)
    problem = Problem(operator(SOFT, (32, 32), cell, (32, 32)), gap - gap.min(), everywhere, 1 / cell[0] ** 2)
    state = active_set.solve(problem, np.ones(gap.shape), tolerance=1e-9, most_products=3)
    assert not state.settled
    assert state.pressure_mpa.min() >= 0
    assert state.pressure_mpa.sum() == pytest.approx(problem.total_mpa)
