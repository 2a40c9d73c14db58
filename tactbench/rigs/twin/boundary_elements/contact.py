"""A rigid indenter of any shape pressed into an elastic surface without friction, under a given force.

Coarse to fine: each grid starts from the pressure of one of half as many cells a side, on the window that holds the
contact. What was left out is looked at afterwards, on the whole domain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tactbench.plugin import FloatArray, RigError
from tactbench.rigs.twin.boundary_elements import active_set, polonsky_keer
from tactbench.rigs.twin.boundary_elements.active_set import Mask, Problem, State
from tactbench.rigs.twin.boundary_elements.grids import can_halve, cell_means, double, halve
from tactbench.rigs.twin.boundary_elements.kernels import Kernel
from tactbench.rigs.twin.boundary_elements.operator import operator, window_cells

TOLERANCE = 1e-6
"""In the norm of the energy. The depth's own error is of second order in it."""
COARSE_TOLERANCE = 1e-3
"""Of the grids that only give a start and, by their depth, the error estimate."""
_MARGIN = 2
"""Cells around a start that its window includes."""
_PRODUCTS = 400
"""Products with the kernel before the active set is given up for Polonsky-Keer; hard cases take up to 100."""
_CLASSIC_PRODUCTS = 4000
_TRUSTED = 100.0
"""A residual is a largest value and may exceed the tolerance, which is in the norm of the energy, by this factor."""


@dataclass(frozen=True)
class ElasticContact:
    """A surface under one load."""

    force_n: float
    pressure_mpa: FloatArray
    """(nx, ns), never negative; sums to the force to rounding."""
    displacement_mm: FloatArray
    """(nx, ns) mean of each cell, into the surface; on the whole domain."""
    depth_mm: float
    """Approach of the indenter, counted from where the gap is zero."""
    depth_error_mm: float
    """A posteriori: the change of the depth from the grid of half as many cells a side. That is the error if errors
    fall like the cell, as at sharp edges, and three to seven times the error if they fall like its square or cube.
    Not a number without such a grid."""
    residual: float
    """Complementarity on the whole domain: mean distance from contact under pressure, or largest penetration without,
    whichever is worse, relative to the depth below the first touch."""
    products: int
    """Products with the kernel on the finest grid."""
    window: tuple[int, int]
    """Cells of the window that was solved on the finest grid."""
    contact_radius_mm: float
    """``sqrt(5/2 <r²>)``, the mean weighted with pressure, about the centre of pressure: exact for Hertz's pressure,
    and far less sensitive to the grid than counting cells."""
    area_mm2: float
    """Cells under pressure, times their area."""


def press(
    kernel: Kernel,
    gap_mm: FloatArray,
    cell_mm: tuple[float, float],
    force_n: float,
    *,
    tolerance: float = TOLERANCE,
) -> ElasticContact:
    """Return the surface under a rigid indenter.

    Parameters
    ----------
    kernel
        The elastic surface.
    gap_mm
        (nx, ns) distance of indenter and surface at cell centres, at zero approach; infinite where the indenter has
        no surface.
    cell_mm
        Sides of a cell.
    force_n
        Positive normal force.
    tolerance
        Largest residual in the norm of the energy, relative: ``sqrt(r A⁻¹ r / (F depth))``.

    Raises
    ------
    RigError
        If the input is no contact problem, or if the tolerance is not reached; a result that is not one is never
        returned.
    """
    gap, reachable = _checked(gap_mm, cell_mm, force_n, tolerance)
    ladder = [(cell_means(gap, reachable), reachable)]
    while can_halve((ladder[-1][0].shape[0], ladder[-1][0].shape[1])):
        ladder.append(halve(*ladder[-1]))
    start, depth, coarser = None, math.nan, math.nan
    for level in range(len(ladder) - 1, -1, -1):
        scale = 2.0**level
        side = (cell_mm[0] * scale, cell_mm[1] * scale)
        grid = _Grid(kernel, *ladder[level], side, force_n)
        begin = grid.guess() if start is None else np.where(grid.reachable, double(start), 0.0)
        coarser = depth
        found = grid.solve(begin, max(tolerance, COARSE_TOLERANCE) if level else tolerance)
        start, depth = found.pressure_mpa, grid.lowest_mm + found.depth_mm
    result = grid.result(found, abs(depth - coarser))
    if result.residual > _TRUSTED * tolerance:
        raise grid.unsettled(tolerance, f"left a residual of {result.residual:.1e}")
    return result


@dataclass(frozen=True)
class _Whole:
    """A state on the whole domain."""

    pressure_mpa: FloatArray
    displacement_mm: FloatArray
    depth_mm: float
    """From first touch."""
    products: int
    window: tuple[int, int]


class _Grid:
    """The problem on one grid."""

    def __init__(
        self, kernel: Kernel, gap_mm: FloatArray, reachable: Mask, cell_mm: tuple[float, float], force_n: float
    ) -> None:
        self.kernel, self.reachable, self.cell_mm, self.force_n = kernel, reachable, cell_mm, force_n
        self.cells = (gap_mm.shape[0], gap_mm.shape[1])
        self.total_mpa = force_n / (cell_mm[0] * cell_mm[1])
        self.lowest_mm = float(gap_mm[reachable].min())
        """Smallest mean gap of a cell."""
        self.gap_mm = gap_mm - self.lowest_mm
        """From first touch, so that tiny depths do not drown in a large offset."""

    def guess(self) -> FloatArray:
        """Return a start without a coarser grid: Hertz's law, with the area of the gap's own level sets.

        Pressing on by ``d delta`` adds ``2 E* a d delta`` (a flat punch of the contact's area, Johnson 1985, section
        3.8), and under a smooth indenter the contact is where the gap is below half the depth: exact for a
        paraboloid on a half-space. A layer counts as a half-space as stiff as it is to waves of number ``1/a``.
        """
        levels = np.sort(self.gap_mm[self.reachable])
        radius = np.sqrt(np.arange(1, levels.size) * (self.cell_mm[0] * self.cell_mm[1] / math.pi))
        carried = np.cumsum(8 * self.kernel.stiffness(1 / radius) * radius**2 * np.diff(levels))
        level = levels[min(int(np.searchsorted(carried, self.force_n)) + 1, levels.size - 1)]
        below = level - self.gap_mm
        # The rim itself gets a little: a level set of no height, a flat punch, is pressed evenly.
        rim = 1e-3 * level or 1.0
        return np.sqrt(np.where(self.reachable & (below >= 0), below + rim, 0.0))

    def solve(self, start: FloatArray, tolerance: float) -> _Whole:
        """Return the solution, from a (nx, ns) pressure; widen the window until nothing outside penetrates."""
        everywhere = operator(self.kernel, self.cells, self.cell_mm, self.cells)
        touched, products = start > 0, 0
        while True:
            window = self._window(touched)
            shape = (window[0].stop - window[0].start, window[1].stop - window[1].start)
            inside = operator(self.kernel, self.cells, self.cell_mm, shape)
            problem = Problem(inside, self.gap_mm[window], self.reachable[window], self.total_mpa)
            state = self._settle(problem, start[window], tolerance)
            products += state.products
            pressure = np.zeros(self.cells)
            pressure[window] = state.pressure_mpa
            displacement = everywhere.displacement(pressure)
            if shape == self.cells:
                break
            sinks = self.reachable & (displacement + self.gap_mm < state.depth_mm)
            sinks[window] = False
            if not sinks.any():
                break
            touched, start = touched | sinks, pressure
        return _Whole(pressure, displacement, state.depth_mm, products, shape)

    def _settle(self, problem: Problem, start: FloatArray, tolerance: float) -> State:
        state = active_set.solve(problem, start, tolerance=tolerance, most_products=_PRODUCTS)
        if state.settled:
            return state
        classic = polonsky_keer.solve(
            problem, state.pressure_mpa, tolerance=0.1 * tolerance, most_products=_CLASSIC_PRODUCTS
        )
        if classic.settled:
            return classic
        raise self.unsettled(tolerance, "did not settle")

    def unsettled(self, tolerance: float, what: str) -> RigError:
        """Return the error to raise."""
        return RigError(
            f"The reference solver {what} at {self.force_n:g} N on {self.cells[0]} x {self.cells[1]} cells "
            f"with a tolerance of {tolerance:.0e}.",
            hint="Ask for a larger tolerance, or check that the gap is that of a solid indenter.",
        )

    def _window(self, touched: Mask) -> tuple[slice, slice]:
        """Return the quickest window around some cells, with a margin."""
        spans = []
        for axis in (0, 1):
            places = np.flatnonzero(touched.any(axis=1 - axis))
            spans.append((int(places[0]) - _MARGIN, int(places[-1]) + 1 + _MARGIN))
        lengths = window_cells(self.kernel, self.cells, (spans[0][1] - spans[0][0], spans[1][1] - spans[1][0]))
        slices = []
        for (low, high), length, n in zip(spans, lengths, self.cells, strict=True):
            begin = min(max((low + high - length) // 2, 0), n - length)
            slices.append(slice(begin, begin + length))
        return slices[0], slices[1]

    def result(self, found: _Whole, depth_error_mm: float) -> ElasticContact:
        """Return what is handed out, with the residual taken on the whole domain."""
        pressure, depth = found.pressure_mpa, found.depth_mm
        distance = found.displacement_mm + self.gap_mm - depth
        apart = float(np.vdot(pressure, np.abs(distance))) / self.total_mpa
        through = float(np.max(-distance, where=self.reachable & (pressure == 0), initial=0.0))
        dx, ds = self.cell_mm
        along, across = pressure.sum(axis=1) / self.total_mpa, pressure.sum(axis=0) / self.total_mpa
        moment = sum(
            # The last term is a cell's own: pressure is even on it.
            float(weight @ place**2) - float(weight @ place) ** 2 + side**2 / 12
            for weight, place, side in (
                (along, dx * np.arange(self.cells[0]), dx), (across, ds * np.arange(self.cells[1]), ds),
            )
        )  # fmt: skip
        return ElasticContact(
            force_n=self.force_n,
            pressure_mpa=pressure,
            displacement_mm=found.displacement_mm,
            depth_mm=self.lowest_mm + depth,
            depth_error_mm=depth_error_mm,
            residual=max(apart, through) / depth,
            products=found.products,
            window=found.window,
            contact_radius_mm=math.sqrt(2.5 * moment),
            area_mm2=float(np.count_nonzero(pressure)) * dx * ds,
        )


def _checked(
    gap_mm: FloatArray, cell_mm: tuple[float, float], force_n: float, tolerance: float
) -> tuple[FloatArray, Mask]:
    """Return the gap with zeros where there is no indenter, and where there is one."""
    gap = np.asarray(gap_mm, dtype=np.float64)
    if gap.ndim != 2 or min(gap.shape) < 4:
        raise RigError(
            f"The gap has shape {gap.shape}; the reference solver needs a grid of at least 4 x 4 cells.",
            hint="Sample the gap at the centres of a grid.",
        )
    if not all(side > 0 and math.isfinite(side) for side in cell_mm):
        raise RigError(f"Cells of {cell_mm} mm were given; both sides must be positive.", hint="Correct the grid.")
    if not (force_n > 0 and math.isfinite(force_n)):
        raise RigError(
            f"The reference solver was asked for {force_n!r} N; it needs a finite force above zero.",
            hint="At zero force the surface is at rest and nothing is solved.",
        )
    if not 1e-12 <= tolerance < 1:
        raise RigError(
            f"A tolerance of {tolerance!r} was asked for; it must lie between 1e-12 and 1.",
            hint="1e-3 keeps the error of a 64 x 64 grid, 1e-5 that of a 512 x 512 grid.",
        )
    reachable = np.isfinite(gap)
    if not reachable.any() or np.isnan(gap).any() or np.isneginf(gap).any():
        raise RigError(
            "The gap has values that are no distance, or no finite value at all.",
            hint="Give plus infinity where the indenter has no surface, finite distances elsewhere.",
        )
    return np.where(reachable, gap, 0.0), reachable
