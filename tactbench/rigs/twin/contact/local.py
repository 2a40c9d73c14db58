"""The closed-form contact solver: the skin as a bed of independent springs (Winkler).

The model holds for foams and thin compressible layers, whose cells hardly influence each other. Skins of nearly
constant volume raise an error.
"""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray, RigError
from tactbench.plugin.simulation import BondedLayer, FluidBackedShell, FoamPad
from tactbench.rigs.twin.contact.media import Medium
from tactbench.rigs.twin.contact.newton import Solution
from tactbench.rigs.twin.contact.press import AnyPress
from tactbench.rigs.twin.geometry import Contact

LARGEST_POISSON = 0.4
"""Largest Poisson's ratio of a layer: at 0.45 the depth is off by 19 to 27 % against the layer's own kernel, below 0.3
by 0.1 to 19 %, least where the contact is wide compared with the layer's thickness."""
_CLOSED = 1e-12
_STEPS = 60


class LocalPress(AnyPress):
    """Contact solver that computes each cell by itself, from the skin's declaration and grid and the (nx, ns) gap.

    Raises
    ------
    RigError
        For a fluid-backed skin, and for a layer whose Poisson's ratio is above 0.4.
    """

    def __init__(
        self, skin: FluidBackedShell | FoamPad | BondedLayer, medium: Medium, gap_mm: FloatArray, contact: Contact
    ) -> None:
        if isinstance(skin, FluidBackedShell):
            raise RigError(
                "The solver 'closed-form' cannot compute a skin over a fluid, whose volume must stay constant.",
                hint="Set the option rung to default.",
            )
        if isinstance(skin, BondedLayer) and skin.poisson.to("1") > LARGEST_POISSON:
            raise RigError(
                f"The solver 'closed-form' cannot compute a layer with Poisson's ratio {skin.poisson.to('1'):g}: above "
                f"{LARGEST_POISSON} its depth would be wrong by a fifth or more.",
                hint="Set the option rung to default.",
            )
        super().__init__(medium, contact)
        self._gap = gap_mm
        self._least_gap = float(gap_mm.min())
        self._springs = float(medium.stiffness[0, 0])
        self._depth = self._least_gap + 0.02
        self._cell = float(np.prod(medium.grid.cell_mm))

    def solve(self, force_n: float) -> Solution:
        """Return the skin under a force above zero.

        The force is a convex function of the approach (the contact widens, foam hardens), so that Newton's steps from
        above the solution always converge.
        """
        depth = self._depth
        deflection, pressure, slope = self._pushed(depth)
        while self._cell * pressure.sum() < force_n:
            depth = self._least_gap + 2 * (depth - self._least_gap)
            deflection, pressure, slope = self._pushed(depth)
        for _ in range(_STEPS):
            excess = self._cell * pressure.sum() - force_n
            if abs(excess) <= _CLOSED * force_n:
                break
            depth -= excess / (self._cell * slope)
            deflection, pressure, slope = self._pushed(depth)
        residual = abs(self._cell * float(pressure.sum()) - force_n) / force_n
        if residual > 1e-8:
            raise RigError(
                f"The solver 'closed-form' misses the force {force_n:g} N by the relative error {residual:.1e}.",
                hint="Set the option rung to default, or check the skin's parameters.",
            )
        self._depth = depth
        return Solution(np.array([depth - self._least_gap]), deflection, pressure, residual)

    def _pushed(self, depth: float) -> tuple[FloatArray, FloatArray, float]:
        """Return (nx, ns) deflection, (nx, ns) contact pressure and the summed stiffness at an approach of `depth` mm.

        Each cell's spring stands in series with the contact's own stiffness; its law hardens, so that Newton's steps
        from the stiff side fall monotonically to the balance.
        """
        push, stiffness = np.maximum(depth - self._gap, 0.0), self.medium.contact_stiffness
        deflection, tangent = push.copy(), np.empty_like(push)
        for _ in range(_STEPS):
            carried, _ = self.medium.respond(deflection, tangent)
            carried += self._springs * deflection
            tangent += self._springs
            step = (carried - stiffness * (push - deflection)) / (tangent + stiffness)
            deflection -= step
            if float(np.abs(step).max()) <= _CLOSED * max(float(push.max()), 1e-300):
                break
        pressure: FloatArray = stiffness * (push - deflection)
        series = stiffness * tangent / (tangent + stiffness)
        return deflection, pressure, float(series[push > 0].sum())
