"""The bonded layer against theory and against independent finite elements."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.rigs.twin.contact.newton import NewtonSolver

# Force [N] at a depth, h = 2 mm, E = 1 MPa, indenter r² / 2R with R = 10 mm: axisymmetric quadratic finite elements.
FEM = [
    (0.0, 0.1, 0.21212), (0.3, 0.1, 0.25159), (0.45, 0.1, 0.32848),
    (0.0, 0.5, 4.15586), (0.3, 0.5, 5.29855), (0.45, 0.5, 8.50762),
]  # fmt: skip


@pytest.mark.parametrize(("poisson", "depth", "force"), FEM)
def test_depth_under_the_finite_elements_force(layer, poisson, depth, force):
    _, press = layer(poisson)
    grid = press.medium.grid
    # The finite elements pressed a paraboloid: under a true sphere of that radius the depth 0.5 mm grows by 0.75 %.
    parabola = NewtonSolver(press.medium, (grid.x_mm[:, None] ** 2 + grid.s_mm[None, :] ** 2) / 20.0)
    found = parabola.solve(force)
    # The penalty lets the indenter into the skin by pressure over 300 MPa/mm; weighted with the pressure that is its
    # share of the depth. What remains is the grid: 0.25 mm cells under contact radii of 1.3 to 4 mm, whose rim moves
    # in whole cells (up to 0.22 % seen, 0.15 % on 128 cells), and the five digits of the force.
    pressure = found.pressure_mpa
    penalty = float((pressure**2).sum() / pressure.sum()) / press.medium.contact_stiffness
    assert found.depth_mm - penalty == pytest.approx(depth, rel=3e-3)


def test_hertz_law_on_a_thick_layer(layer):
    """Depth grows as force to the 2/3 when the layer is thick beside the contact."""
    _, press = layer(0.3, thickness=40.0, cells=128, penalty=3000.0)
    forces = np.array([0.02, 0.04, 0.08])
    vector, radii = None, []
    grid = press.medium.grid
    r2 = grid.x_mm[:, None] ** 2 + grid.s_mm[None, :] ** 2
    for force in forces:
        found = press.solve(force, vector)
        vector = found.vector
        radii.append(np.sqrt(2.5 * (found.pressure_mpa * r2).sum() / found.pressure_mpa.sum()))
    hertz = (3 * forces * 10 * (1 - 0.3**2) / 4) ** (1 / 3)
    # Cells of 0.19 mm under contact radii of 0.5-0.8 mm: the second moment is good to a few per cent.
    np.testing.assert_allclose(radii, hertz, rtol=0.04)
