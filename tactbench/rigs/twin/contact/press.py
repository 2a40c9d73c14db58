"""Solution of one contact at any force, and the limits within which it is valid."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray, RigError, Scalar
from tactbench.plugin.simulation import BondedLayer, FluidBackedShell, Skin, SkinGrid, SkinSheet, SkinState
from tactbench.rigs.twin.contact.media import Medium
from tactbench.rigs.twin.contact.newton import TOLERANCE, NewtonSolver, Solution
from tactbench.rigs.twin.geometry import RIM, STEEPEST, Contact, around_mm

LARGEST_POISSON = 0.4
"""Largest Poisson's ratio of a layer: at 0.45 the depth is off by 19 to 27 % against the layer's own kernel, below 0.3
by 0.1 to 19 %, least where the contact is wide compared with the layer's thickness."""
_CLOSED = 1e-12
_STEPS = 60
RESOLVED_CELLS = 3.0
"""Smallest contact radius, in cells, at which the mesh does not affect the result. Measured on the ideal grid with a
cap of 2 mm at eight places: against cells a quarter as wide, the depth is off by up to 23 % at 0.9 cells, 6 % at
1.7, 2 % at 2.7 and 1.4 % at 3.4."""
HELD_AGAINST_N = 5.0
"""Largest load [N] in Karl et al. 2016 and in the reference values for the solver; larger ones get a remark."""
INTO_THE_CORE = 0.1
"""Share of the film's thickness by which the skin may sink into the core, whose penalty spring is soft. Assumed."""
AT_THE_EDGE = 0.01
"""Share of the load outside the active skin above which the recording gets a remark. Assumed."""


class AnyPress(ABC):
    """Interface of every contact solver: one contact, at forces in any order."""

    touched_core = False
    fluid_pressure = False
    """True if the solved states include the pressure of the fluid in the skin."""

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
        """Return the skin under a force above zero; loads that close the fluid film press it on the rigid core."""
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


def check_reach(press: AnyPress, force_n: float, sheet: SkinSheet) -> None:
    """Raise an error for a load under which the skin touches the indenter beyond the rim of the cap.

    Raises
    ------
    RigError
        If cells beyond the cap's rim carry load: the cap would have to be pressed in past its own flanks.
    """
    if not force_n > 0 or math.isinf(press.contact.radius_mm):
        return
    along, across, _ = around_mm(press.medium.grid, press.contact, sheet)
    if np.any(press(force_n).pressure_mpa[np.hypot(along, across) >= RIM * press.contact.radius_mm] > 0):
        raise RigError(
            f"Under {force_n:g} N the cap of radius {press.contact.radius_mm:g} mm sinks into the skin beyond its rim, "
            "where the cap ends.",
            hint="Press with less force, or with a larger cap.",
        )


def remarks(press: AnyPress, force: float, sheet: SkinSheet) -> dict[str, Scalar]:
    """Return remarks on the validity of a contact on `sheet` under `force` newtons.

    Returns
    -------
    dict
        ``contact_radius_cells``: radius of the contact in cells, from its area, or half its width where the indenter
        is neither a cap nor flat; and one sentence under each ``remark …`` that applies.
    """
    if not force > 0:
        return {}
    pressure = press(force).pressure_mpa
    shape = press.contact.shape
    cells = math.sqrt(np.count_nonzero(pressure) / math.pi) if shape is None else _narrow_cells(pressure)
    found: dict[str, Scalar] = {"contact_radius_cells": cells}
    if cells < RESOLVED_CELLS:
        found["remark contact"] = (
            f"the contact is {cells:.1f} cells in radius at {force:g} N; below {RESOLVED_CELLS:g} it follows the mesh"
        )
    if force > HELD_AGAINST_N:
        found["remark load"] = f"{force:g} N is beyond {HELD_AGAINST_N:g} N, up to which the model was compared"
    medium = press.medium
    beyond = float((press(force).deflection_mm - medium.rest_thickness_mm).max())
    if medium.has_core and beyond > INTO_THE_CORE * float(medium.rest_thickness_mm.max()):
        found["remark core"] = f"the skin stands {beyond:.2f} mm inside the core, whose penalty is softer than a core"
    if not medium.has_core and beyond > 0:
        found["remark depth"] = f"the skin is pressed {beyond:.2f} mm deeper than it is thick"
    along, across, _ = np.broadcast_arrays(*around_mm(press.medium.grid, press.contact, sheet))
    along, across = along[pressure > 0], across[pressure > 0]
    radius, reach = press.contact.radius_mm, float(np.hypot(along, across).max())
    if shape is not None:
        steepest = float(shape.slope(along, across).max())
        if steepest > STEEPEST * (1 + 1e-6):  # a flank of 45 degrees, by differences
            found["remark flank"] = f"the {shape.name} touches where its flank has a slope of {steepest:.2g}"
    elif reach >= radius * math.sin(math.atan(STEEPEST)):
        found["remark flank"] = (
            f"the contact reaches {reach:.2g} mm from the axis of a cap of radius {radius:g} mm, where its flank is "
            "steeper than 45 degrees"
        )
    if sheet.dome is not None and press.contact.x_mm > sheet.dome.start.to("mm"):
        found["remark dome"] = "the contact is on the dome, where the model was never compared with real presses"
    share = float(pressure[~_active(sheet, press.medium.grid)].sum() / pressure.sum())
    if (math.isfinite(radius) or shape is not None) and share > AT_THE_EDGE:
        found["remark edge"] = f"{100 * share:.0f} % of the load stands on the margin, outside the active skin"
    return found


def _narrow_cells(pressure: FloatArray) -> float:
    """Return, in cells, the shorter half-axis of an ellipse with the second moments of the touched area."""
    places = np.argwhere(pressure > 0)
    scatter = np.atleast_2d(np.cov(places.T, bias=True)) + np.eye(2) / 12  # a cell is a square
    return 2.0 * math.sqrt(float(np.linalg.eigvalsh(scatter)[0]))


def _active(sheet: SkinSheet, grid: SkinGrid) -> npt.NDArray[np.bool_]:
    """Return (nx, ns) True for cells of active skin: the pad's cells, or without a pad all but the outermost."""
    x_mm, s_mm = grid.x_mm, np.abs(grid.s_mm)
    if sheet.pad is None:
        along, across = (x_mm > x_mm[0]) & (x_mm < x_mm[-1]), s_mm < s_mm[-1]
    else:
        low, high, arc = (edge.to("mm") for edge in sheet.pad)
        along, across = (x_mm >= low) & (x_mm <= high), s_mm <= arc / 2
    return np.asarray(along[:, None] & across[None, :])
