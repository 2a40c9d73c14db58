"""Solution of one contact at any force; each solution starts from the solutions at neighbouring forces."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np

from tactbench.plugin import FloatArray, RigError
from tactbench.plugin.simulation import BondedLayer, FluidBackedShell, Skin, SkinState
from tactbench.rigs.twin.contact.media import Medium
from tactbench.rigs.twin.contact.newton import TOLERANCE, NewtonSolver, Solution
from tactbench.rigs.twin.geometry import Contact

LARGEST_POISSON = 0.4
"""Largest Poisson's ratio of a layer: at 0.45 the depth is off by 19 to 27 % against the layer's own kernel, below 0.3
by 0.1 to 19 %, least where the contact is wide compared with the layer's thickness."""
_CLOSED = 1e-12
_STEPS = 60


class AnyPress(ABC):
    """Interface of every contact solver: one contact, at forces in any order."""

    touched_core = False
    fluid_pressure = False
    """True if states hold the pressure of the fluid in the skin."""

    def __init__(self, medium: Medium, contact: Contact) -> None:
        self.medium = medium
        self.contact = contact

    @abstractmethod
    def solve(self, force_n: float) -> Solution:
        """Return the skin under a force above zero."""

    def __call__(self, force_n: float) -> SkinState:
        """Return the skin under `force_n`; at zero force it is at rest and nothing is solved."""
        if force_n <= 0:
            return at_rest(self.medium)
        solution = self.solve(force_n)
        medium, deflection, pressure, fluid_mpa = self.medium, solution.deflection_mm, solution.pressure_mpa, 0.0
        if medium.zero_mean and self.fluid_pressure:
            # The part of the mean contact pressure that the skin itself does not carry.
            local, _ = medium.respond(deflection, np.empty(pressure.shape))
            fluid_mpa = float(np.mean(pressure - local))
        r2 = (medium.grid.x_mm[:, None] - self.contact.x_mm) ** 2
        r2 = r2 + (medium.grid.s_mm[None, :] - self.contact.s_mm) ** 2
        return SkinState(
            grid=medium.grid,
            force_n=force_n,
            deflection_mm=deflection,
            pressure_mpa=pressure,
            thickness_mm=medium.thickness_mm(deflection),
            depth_mm=solution.depth_mm,
            fluid_pressure_mpa=fluid_mpa,
            # sqrt(5/2 <r²>), weighted with the pressure: exact for Hertz, where counting cells is not.
            contact_radius_mm=float(np.sqrt(2.5 * np.sum(pressure * r2) / np.sum(pressure))),
            residual=solution.residual,
        )

    def closing_at(self, force_n: float) -> float:
        """Return the distance [mm] by which the film is past closing at `force_n`; minus infinity without a core."""
        return self.medium.closing_mm(self(force_n).deflection_mm) if self.medium.has_core else -np.inf


def at_rest(medium: Medium) -> SkinState:
    """Return the state of the skin without contact."""
    zero = np.zeros(medium.spectrum.shape)
    return SkinState(medium.grid, 0.0, zero, zero, medium.rest_thickness_mm, 0.0, 0.0, 0.0, 0.0)


def whole_skin(state: SkinState) -> FloatArray:
    """Return (3,) depth, contact radius and fluid pressure, the values that a table holds beside its channels."""
    return np.array([state.depth_mm, state.contact_radius_mm, state.fluid_pressure_mpa])


class Press(AnyPress):
    """Contact solver that minimises the energy of the whole skin.

    `medium` has no core yet; the function `core` adds it when a load first closes the film (None: no core). `gap_mm`
    (nx, ns) is the gap at zero approach. With `fluid_pressure` the returned states hold the pressure of the fluid.
    """

    def __init__(
        self,
        medium: Medium,
        gap_mm: FloatArray,
        contact: Contact,
        *,
        core: Callable[[Medium], Medium] | None = None,
        fluid_pressure: bool = True,
        tolerance: float = TOLERANCE,
    ) -> None:
        super().__init__(medium, contact)
        # From first touch: between cells the gap's smallest value on the grid is not zero, and in its rounding the
        # depth of a piconewton would drown.
        self.gap_mm = gap_mm - gap_mm.min()
        self._solver = NewtonSolver(medium, self.gap_mm)
        self._core = core
        self.fluid_pressure = fluid_pressure
        self._tolerance = tolerance
        self._solutions: dict[float, Solution] = {}

    def solve(self, force_n: float) -> Solution:
        """Return the skin under a force above zero, with the core from the load on that closes the film."""
        if force_n in self._solutions:
            return self._solutions[force_n]
        solution = self._started(force_n)
        if self.medium.has_core and not self.touched_core and self.medium.closing_mm(solution.deflection_mm) > 0:
            self.touched_core = True
            if self._core is not None:
                self.medium = self._core(self.medium)
                self._solver = NewtonSolver(self.medium, self.gap_mm)
                solution = self._solver.solve(force_n, solution.vector, tolerance=self._tolerance)
        self._solutions[force_n] = solution
        return solution

    def _started(self, force: float) -> Solution:
        """Solve from the neighbouring loads' states; if the solver fails from there, from the skin at rest.

        For loads below a piconewton the error of a guessed state is larger than the deflection under such a load.
        """
        guess = self._guess(force)
        if guess is not None:
            try:
                return self._solver.solve(force, guess, tolerance=self._tolerance)
            except RigError:
                pass
        return self._solver.solve(force, None, tolerance=self._tolerance)

    def _guess(self, force: float) -> FloatArray | None:
        """Return a state near `force` from the solved loads around it (Lagrange in the square root of the load)."""
        if not self._solutions:
            return None
        # In sqrt(F) the approach of a cap is nearly straight.
        near = sorted(self._solutions, key=lambda load: abs(load**0.5 - force**0.5))[:3]
        if len(near) > 1 and (max(near) < force or min(near) > force):
            near = near[:2]
        u = [load**0.5 for load in near]
        guess = np.zeros_like(self._solutions[near[0]].vector)
        for i, load in enumerate(near):
            weight = 1.0
            for j, other in enumerate(u):
                if j != i:
                    weight *= (force**0.5 - other) / (u[i] - other)
            guess += weight * self._solutions[load].vector
        return guess


class LocalPress(AnyPress):
    """The closed-form contact solver: the skin as a bed of independent springs (Winkler), each cell by itself.

    The model holds for foams and thin compressible layers, whose cells hardly influence each other. `gap_mm` (nx, ns)
    is the gap at zero approach.

    Raises
    ------
    RigError
        For a fluid-backed skin, and for a layer whose Poisson's ratio is above 0.4.
    """

    def __init__(self, skin: Skin, medium: Medium, gap_mm: FloatArray, contact: Contact) -> None:
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
