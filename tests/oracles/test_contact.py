"""The product's contact solver on bonded layers: against boundary elements, finite elements and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.rigs.twin.contact.newton import NewtonSolver, Solution
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.contact.tangential import dragged_state, tangential_of
from tactbench.rigs.twin.geometry import Contact, skin_grid
from tests.oracles.boundary_elements import Layer, paraboloid_mm, pressed
from tests.oracles.closed_forms import CattaneoMindlin
from tests.oracles.layers import bonded_layer

SIDE = 24.0
# Force [N] at a depth, h = 2 mm, E = 1 MPa, indenter r² / 2R with R = 10 mm: axisymmetric quadratic finite elements.
ELEMENTS = [
    (0.0, 0.1, 0.21212), (0.3, 0.1, 0.25159), (0.45, 0.1, 0.32848),
    (0.0, 0.5, 4.15586), (0.3, 0.5, 5.29855), (0.45, 0.5, 8.50762),
]  # fmt: skip


def solved(poisson: float, force_n: float, penalty: float) -> Solution:
    skin = bonded_layer(poisson, penalty=penalty)
    # The solver takes the gap at a cell's centre.
    x = skin_grid(skin.sheet).x_mm
    gap = (x[:, None] ** 2 + x[None, :] ** 2) / 20.0
    return NewtonSolver(medium_of(skin, skin_grid(skin.sheet)), gap).solve(force_n)


@pytest.mark.parametrize(("poisson", "depth", "force"), ELEMENTS)
def test_depth_under_the_finite_elements_force(poisson, depth, force):
    found = solved(poisson, force, 300.0)
    # The penalty lets the indenter into the skin by pressure over 300 MPa/mm; weighted with the pressure that is its
    # share of the depth. What remains is the grid: 0.25 mm cells under contact radii of 1.3 to 4 mm, whose rim moves
    # in whole cells (up to 0.22 % seen, 0.15 % on 128 cells), and the five digits of the force.
    given_way = float((found.pressure_mpa**2).sum() / found.pressure_mpa.sum()) / 300.0
    assert found.depth_mm - given_way == pytest.approx(depth, rel=3e-3)


@pytest.mark.parametrize(("poisson", "force"), [(0.3, 5.0), (0.5, 10.0)])
def test_what_the_penalty_costs_and_how_that_falls(poisson, force):
    depths = [solved(poisson, force, stiffness).depth_mm for stiffness in (100.0, 200.0, 400.0)]
    # d = d0 + c/k: (1/100 - 1/400) / (1/200 - 1/400) = 3.
    assert 2.9 <= (depths[0] - depths[2]) / (depths[1] - depths[2]) <= 3.1
    limit = 2 * depths[2] - depths[1]
    layer, fine = Layer(1.0, poisson, 2.0), paraboloid_mm(192, SIDE)
    # To first order the derivative by force of the penalty's energy, int p²/2k dA, from the reference's pressures; of a
    # tenth of the force, since the rim moves in whole cells.
    energies = [
        float(np.square(pressed(layer, fine, SIDE, force * share).pressure_mpa).sum()) * (SIDE / 192) ** 2 / 200.0
        for share in (1.1, 0.9)
    ]
    cost = (energies[0] - energies[1]) / (0.2 * force)
    assert depths[0] - limit == pytest.approx(cost, rel=0.05)
    # Two discretisations of one kernel: cells of a/12 whose rim moves in whole cells.
    assert limit == pytest.approx(pressed(layer, paraboloid_mm(96, SIDE), SIDE, force).depth_mm, rel=3e-3)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_a_pushed_cap_sticks_and_slips_as_cattaneo_and_mindlin_say(share):
    friction, force, contact = 0.6, 0.3, Contact(5.0, 0.0, 0.0)
    skin = bonded_layer(0.5, thickness_mm=20.0, side_mm=12.0, cells=64, penalty=1000.0)
    grid = skin_grid(skin.sheet)
    r2 = grid.x_mm[:, None] ** 2 + grid.s_mm[None, :] ** 2
    press, along = Press(medium_of(skin, grid), r2 / 10.0, contact), tangential_of(skin, grid)
    state, push = press(force), share * friction * force
    closed = CattaneoMindlin(friction, state.contact_radius_mm, force, 4 / 3 / 1.5)
    dragged = dragged_state(state, press((1 - share) * force), along, (1.0, 0.0), friction, friction)
    r, inside = np.sqrt(r2), r2 < state.contact_radius_mm**2
    off = (dragged.shear_mpa[0] - closed.traction_mpa(push, r))[inside]
    # Cells of a fifth of the contact's radius, two edges in steps.
    assert np.sqrt(np.mean(off**2)) <= 0.05 * friction * state.pressure_mpa.max()
    moved, stuck = dragged.tangential_displacement_mm, r < 0.8 * closed.stick_radius_mm(push)
    # What sticks to a rigid cap moves as one; the same edges.
    assert max(np.ptp(moved[0][stuck]), np.abs(moved[1][stuck]).max()) <= 0.02 * closed.shift_mm(push)
