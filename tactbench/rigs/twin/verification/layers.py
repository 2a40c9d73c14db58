"""Checks of bonded layers: the reference solver and the default one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactbench.plugin import assumed
from tactbench.plugin.simulation import BondedLayer, SkinSheet, Verdict
from tactbench.rigs.twin.boundary_elements.kernels import Layer
from tactbench.rigs.twin.closed_forms.layers import IncompressibleLayer, Winkler
from tactbench.rigs.twin.contact.newton import NewtonSolver, Solution
from tactbench.rigs.twin.contact.skins import medium_of
from tactbench.rigs.twin.geometry import skin_grid
from tactbench.rigs.twin.layer_kernel import compliance_shape
from tactbench.rigs.twin.verification.pressing import RADIUS_MM, paraboloid_mm, pressed, within

_THIN_MM = 0.05
_THICKNESS_MM, _SIDE_MM, _CELLS = 2.0, 24.0, 96
_ELEMENTS = (
    (0.3, 0.1, 0.25157), (0.45, 0.1, 0.32887), (0.499, 0.1, 0.38195),
    (0.3, 0.5, 5.3011), (0.45, 0.5, 8.5248), (0.499, 0.5, 12.0488),
)  # fmt: skip
"""Poisson's ratio, depth [mm], force [N] of a paraboloid R = 10 on h = 2, E = 1: axisymmetric finite elements of this
project's tests (Taylor-Hood, 193 to 200 nodes under the contact); their last digit but one is uncertain."""


def thin() -> Sequence[Verdict]:
    """Hold layers of a hundredth to a twentieth of the contact against the limits of thin layers."""
    verdicts = []
    for poisson in (0.0, 0.3):
        # The next term of the compliance, C = h/E_oed (1 + c q²), adds c h² |grad p|² / 2k to the energy: with the
        # pressure of the springs that deepens a paraboloid under a given force by 2c (h/a)².
        q = 1e-2
        limit = (1 - 2 * poisson) / (2 * (1 - poisson) ** 2)
        c = (float(compliance_shape(np.array([q]), poisson)[0]) / (q * limit) - 1) / q**2
        for ratio in (10, 22):
            a = ratio * _THIN_MM
            law = Winkler.of_layer(RADIUS_MM, 1.0, poisson, _THIN_MM)
            force = law.force_n(a**2 / (2 * RADIUS_MM))
            expected = law.depth_mm(force) * (1 + 2 * c / ratio**2)
            found = pressed(Layer(1.0, poisson, _THIN_MM), paraboloid_mm(128, 4 * a), 4 * a, force)
            verdicts.append(
                within(
                    f"compressible, nu {poisson:g}, a/h {ratio}: depth",
                    found.depth_mm / expected - 1,
                    0.5 / ratio**3 + 1e-4,
                    source="Johnson 1985, section 5.8, with the next term in h/a; bound: half of the term after it, "
                    "and 1e-4 for cells of a/32",
                )
            )
    gaps = []
    for ratio in (10, 15, 22):
        a = ratio * _THIN_MM
        rubber = IncompressibleLayer(RADIUS_MM, 1.0, _THIN_MM)
        force = rubber.force_n(a**2 / (4 * RADIUS_MM))
        found = pressed(Layer(1.0, 0.5, _THIN_MM), paraboloid_mm(256, 8 * a), 8 * a, force)
        gaps.append(1 - found.depth_mm / rubber.depth_mm(force))
        verdicts.append(
            Verdict(
                name=f"incompressible, a/h {ratio}: shortfall of the depth",
                found=gaps[-1],
                low=0.0,
                high=0.6 / ratio,
                source="Johnson 1985, section 5.8: a limit from above; bound: a rim of 0.6 h is no film",
            )
        )
    verdicts.append(
        Verdict(
            name="incompressible: shortfall at a/h 22 over that at 10",
            found=gaps[-1] / gaps[0],
            low=(10 / 22) ** 2,
            high=10 / 22,
            source="it closes with h/a or its square",
        )
    )
    return verdicts


def elements() -> Sequence[Verdict]:
    """Hold the depth under the finite elements' force against theirs, by both solvers."""
    verdicts = []
    for poisson, depth, force in _ELEMENTS:
        side, cells = (24.0, 256) if depth < 0.3 else (32.0, 192)
        found = pressed(Layer(1.0, poisson, _THICKNESS_MM), paraboloid_mm(cells, side), side, force)
        verdicts.append(
            within(
                f"reference, nu {poisson:g}, depth {depth:g} mm",
                found.depth_mm / depth - 1,
                2e-4 if depth > 0.3 else 5e-4,
                source="axisymmetric finite elements; bound: cells of a/13 and a/18, and the elements' 1e-4",
            )
        )
    for poisson, depth, force in _ELEMENTS[3:]:
        default = _by_newton(poisson, force, 300.0).depth_mm - _cost_mm(poisson, force, 300.0)
        verdicts.append(
            within(
                f"default less its penalty, nu {poisson:g}, depth {depth:g} mm",
                default / depth - 1,
                3e-3,
                source="axisymmetric finite elements; bound: cells of a/12 whose rim moves in whole cells (2e-3), and "
                "the images of a periodic sheet of 24 mm (3e-4)",
            )
        )
    return verdicts


def penalty() -> Sequence[Verdict]:
    """Hold the default solver against the reference: what its contact stiffness costs, and how that falls."""
    verdicts = []
    for poisson, force in ((0.3, 5.0), (0.5, 10.0)):
        reference = pressed(Layer(1.0, poisson, _THICKNESS_MM), paraboloid_mm(_CELLS, _SIDE_MM), _SIDE_MM, force)
        depths = [_by_newton(poisson, force, stiffness).depth_mm for stiffness in (100.0, 200.0, 400.0)]
        # d = d0 + c/k: from the two stiffer ones.
        limit = 2 * depths[2] - depths[1]
        cost = _cost_mm(poisson, force, 100.0)
        verdicts += [
            Verdict(
                name=f"nu {poisson:g}: excess at 100 over that at 200, from 400 MPa/mm",
                found=(depths[0] - depths[2]) / (depths[1] - depths[2]),
                low=2.9,
                high=3.1,
                source="the penalty's cost falls like one over its stiffness: (1/100 - 1/400) / (1/200 - 1/400) = 3",
            ),
            within(
                f"nu {poisson:g}: excess at 100 MPa/mm over the one expected",
                (depths[0] - limit) / cost - 1,
                0.05,
                source="expected: the derivative by force of the penalty's energy, from the reference's pressures; "
                "bound: second order, and rims in whole cells",
                note=f"the penalty costs {cost / limit:.2%} of the depth at 100 MPa/mm",
            ),
            within(
                f"nu {poisson:g}: default without its penalty against the reference",
                limit / reference.depth_mm - 1,
                3e-3,
                source="two discretisations of one kernel; bound: cells of a/12 whose rim moves in whole cells",
            ),
        ]
    return verdicts


def _by_newton(poisson: float, force_n: float, penalty: float) -> Solution:
    """Return the default solver's answer on a flat layer of E = 1 MPa, h = 2 mm, on 24 mm."""
    why = "a check"
    skin = BondedLayer(
        sheet=SkinSheet(
            x_min=assumed(-_SIDE_MM / 2, "mm", why),
            x_max=assumed(_SIDE_MM / 2, "mm", why),
            arc=assumed(_SIDE_MM, "mm", why),
            cells=(_CELLS, _CELLS),
        ),
        young=assumed(1.0, "MPa", why),
        poisson=assumed(poisson, "1", why),
        thickness=assumed(_THICKNESS_MM, "mm", why),
        contact_stiffness=assumed(penalty, "MPa/mm", why),
    )
    return NewtonSolver(medium_of(skin, skin_grid(skin.sheet)), paraboloid_mm(_CELLS, _SIDE_MM)).solve(force_n)


def _cost_mm(poisson: float, force_n: float, penalty: float) -> float:
    """Return what a soft contact adds to the depth to first order: ``d/dF`` of its energy ``int p² / 2k dA``."""
    # A tenth of the force, on a fine grid: the rim moves in whole cells, and the difference must not follow it.
    step, cells = 0.1, 2 * _CELLS
    layer, gap = Layer(1.0, poisson, _THICKNESS_MM), paraboloid_mm(cells, _SIDE_MM)
    energies = [
        float(np.square(pressed(layer, gap, _SIDE_MM, force_n * share).pressure_mpa).sum())
        * (_SIDE_MM / cells) ** 2
        / (2 * penalty)
        for share in (1 + step, 1 - step)
    ]
    return (energies[0] - energies[1]) / (2 * step * force_n)
