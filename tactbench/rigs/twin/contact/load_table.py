"""Readings as a function of load: solved at a few loads, interpolated between them, with an error estimate.

Quasi-static contact depends on time only through the load, so nothing is solved per sample. Nodes are added where the
interpolant is worst; the load at which the skin meets the core is bracketed, and no cubic crosses it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tactbench.plugin import FloatArray, RigError, SkinState
from tactbench.rigs.twin.contact.medium import Medium
from tactbench.rigs.twin.contact.newton import Press, Solution

Observe = Callable[[SkinState], FloatArray]
"""A skin state -> (channels,) readings."""

FIRST_NODES = 6
POWER = 1.7
"""First nodes at ``F_max (j/n)^1.7``: readings change fastest at small loads."""
NARROWEST_N = 0.02
"""Intervals are not split below this."""
BRACKET_N = 0.01
"""Width to which the load of touch-down is known."""
MOST_NODES = 40


@dataclass(frozen=True)
class LoadTable:
    """Readings at loads, and the curve through them.

    Attributes
    ----------
    loads_n
        (n,) nodes, the first one 0.
    readings
        (n, channels)
    error
        Estimate of the largest difference between curve and solution, in the channels' unit: half of what was seen at
        the middles of the accepted intervals before these middles became nodes too.
    touch_down_n
        Load at which the skin meets the core, or None if it does not.
    residual
        Largest residual of a solution.
    solves
        How many loads were solved.
    """

    loads_n: FloatArray
    readings: FloatArray
    error: float
    touch_down_n: float | None
    residual: float
    solves: int
    deepest: SkinState

    def __call__(self, force_n: FloatArray) -> FloatArray:
        """Return (samples, channels) readings at `force_n`; loads beyond the table are clamped, never extrapolated."""
        loads = np.clip(force_n, 0.0, self.loads_n[-1])
        return _curve(self.loads_n, self.readings, self.touch_down_n)(loads)


def build_table(
    medium: Medium, gap: FloatArray, observe: Observe, largest_n: float, tolerance: float, share: float = 0.0
) -> LoadTable:
    """Solve and interpolate the readings of `observe` for loads from 0 to `largest_n`.

    Parameters
    ----------
    medium, gap
        The skin and the gap to the indenter.
    observe
        What is read from a skin state.
    largest_n
        Largest load [N].
    tolerance
        Wanted bound on the interpolation error, in the channels' unit; what was achieved is in the result.
    share
        The bound may be as large as this share of the largest change of a reading.

    Raises
    ------
    RigError
        If `largest_n` is not positive, or contact does not settle.
    """
    if not largest_n > 0:
        raise RigError(f"A load table up to {largest_n} N is empty.", hint="Press with a positive force.")
    solver = _Loads(medium, gap, observe)
    nodes = [largest_n * (j / FIRST_NODES) ** POWER for j in range(FIRST_NODES + 1)]
    for load in nodes:
        solver(load)
    change = np.abs(solver(nodes[-1]) - solver(nodes[0])).max()
    tolerance = max(tolerance, share * float(change))
    touch_down = solver.bracket()
    if touch_down is not None:
        nodes = sorted({*nodes, *solver.around(touch_down)})
    nodes, error = _refine(solver, nodes, touch_down, tolerance)
    loads = np.array(nodes)
    return LoadTable(
        loads_n=loads,
        readings=np.array([solver(load) for load in nodes]),
        error=error,
        touch_down_n=touch_down,
        residual=max(solver.residuals),
        solves=len(solver.residuals) - 1,
        deepest=solver.state(largest_n),
    )


def _refine(
    solver: _Loads, nodes: list[float], touch_down: float | None, tolerance: float
) -> tuple[list[float], float]:
    """Split intervals whose middle is not where the curve says; return the nodes and the largest accepted miss."""
    accepted = 0.0
    open_intervals = [(a, b) for a, b in pairwise(nodes) if not _around(a, b, touch_down)]
    while open_intervals:
        curve = _curve(np.array(nodes), np.array([solver(load) for load in nodes]), touch_down)
        middles = [(a + b) / 2 for a, b in open_intervals]
        split: list[tuple[float, float]] = []
        for (a, b), middle in zip(open_intervals, middles, strict=True):
            # Solved, so it becomes a node. A kink's error halves with its interval, all else falls faster.
            miss = float(np.abs(solver(middle) - curve(np.array([middle]))[0]).max()) / 2
            nodes.append(middle)
            if miss <= tolerance or b - a <= 2 * NARROWEST_N or len(nodes) >= MOST_NODES:
                accepted = max(accepted, miss)
            else:
                split += [(a, middle), (middle, b)]
        nodes.sort()
        open_intervals = split
    return nodes, accepted


def _around(a: float, b: float, touch_down: float | None) -> bool:
    return touch_down is not None and a < touch_down < b


class _Loads:
    """Solves loads, each once, starting from the nearest one that is known."""

    def __init__(self, medium: Medium, gap: FloatArray, observe: Observe) -> None:
        self._medium, self._observe = medium, observe
        self._press = Press(medium, gap)
        dx, ds = medium.grid.cell_mm
        self._cell = dx * ds
        self._solutions: dict[float, Solution] = {}
        self._readings: dict[float, FloatArray] = {}
        self.residuals: list[float] = []

    def __call__(self, load: float) -> FloatArray:
        if load not in self._readings:
            self._readings[load] = np.asarray(self._observe(self.state(load)), dtype=np.float64)
        return self._readings[load]

    def _solution(self, load: float) -> Solution:
        if load not in self._solutions:
            solution = self._press.solve(load, self._start(load))
            self._solutions[load] = solution
            self.residuals.append(solution.residual)
        return self._solutions[load]

    def _start(self, load: float) -> tuple[FloatArray, float] | None:
        """Return a guess: on the line through the two nearest known loads, or the nearest."""
        known = sorted((one for one in self._solutions if one > 0), key=lambda one: abs(one - load))
        if not known:
            return None
        first = self._solutions[known[0]]
        if len(known) == 1:
            return first.w, first.approach_mm
        second = self._solutions[known[1]]
        share = float(np.clip((load - known[0]) / (known[1] - known[0]), -1.0, 1.0))
        return (
            first.w + share * (second.w - first.w),
            first.approach_mm + share * (second.approach_mm - first.approach_mm),
        )

    def state(self, load: float) -> SkinState:
        """Return the skin under `load`, as a transducer sees it."""
        solution, medium = self._solution(load), self._medium
        thickness = np.maximum(medium.rest_thickness_mm - solution.w, medium.least_thickness_mm)
        return SkinState(
            grid=medium.grid,
            force_n=load,
            deflection_mm=solution.w,
            pressure_mpa=solution.pressure,
            thickness_mm=thickness,
            depth_mm=solution.approach_mm,
            fluid_pressure_mpa=solution.fluid_pressure,
            contact_radius_mm=_second_moment_radius(solution.pressure, medium),
            residual=solution.residual,
        )

    def clearance(self, load: float) -> float:
        """Return how far the skin still is from the core under `load`, mm; negative once it is met."""
        core = self._medium.core_at_mm
        return np.inf if core is None else float((core - self._solution(load).w).min())

    def bracket(self) -> float | None:
        """Return the load of touch-down, enclosed to `BRACKET_N` between solved loads; None if there is none.

        By false position with the Illinois correction: the clearance is smooth on both sides of its root, so a handful
        of loads do what bisection needs many for.
        """
        if self._medium.core_at_mm is None:
            return None
        known = sorted(load for load in self._solutions if load > 0)
        over = [load for load in known if self.clearance(load) < 0]
        if not over or over[0] == known[0]:
            return None
        high = over[0]
        low = known[known.index(high) - 1]
        at_low, at_high = self.clearance(low), self.clearance(high)
        while high - low > BRACKET_N:
            # Kept a third of the bracket's final width away from its ends, so that both of them close in.
            middle = (low * at_high - high * at_low) / (at_high - at_low)
            middle = min(max(middle, low + BRACKET_N / 3), high - BRACKET_N / 3)
            here = self.clearance(middle)
            if here < 0:
                high, at_high, at_low = middle, here, at_low / 2
            else:
                low, at_low, at_high = middle, here, at_high / 2
        return (low + high) / 2

    def around(self, load: float) -> tuple[float, float]:
        """Return the known loads on both sides of `load`."""
        return max(one for one in self._solutions if one <= load), min(one for one in self._solutions if one > load)


def _second_moment_radius(pressure: FloatArray, medium: Medium) -> float:
    """Return ``sqrt(5/2 <r²>)`` weighted with pressure: exact for Hertz, and no counting of cells."""
    total = float(pressure.sum())
    if total <= 0:
        return 0.0
    x, s = medium.grid.x_mm[:, None], medium.grid.s_mm[None, :]
    mean_x, mean_s = float((pressure * x).sum()) / total, float((pressure * s).sum()) / total
    moment = float((pressure * ((x - mean_x) ** 2 + (s - mean_s) ** 2)).sum()) / total
    return float(np.sqrt(2.5 * moment))


def _curve(loads: FloatArray, readings: FloatArray, touch_down: float | None) -> Callable[[FloatArray], FloatArray]:
    """Return the shape-preserving cubic through the nodes, in two pieces that do not look across touch-down."""
    from scipy.interpolate import PchipInterpolator

    if touch_down is None:
        whole = PchipInterpolator(loads, readings, axis=0)
        return lambda force: np.asarray(whole(force))
    below, above = loads <= touch_down, loads > touch_down
    # Between the two nodes of the bracket, 0.01 N apart, the curve is the straight line that joins the pieces.
    pieces = [(loads[side], PchipInterpolator(loads[side], readings[side], axis=0) if side.sum() > 1 else None)
              for side in (below, above)]  # fmt: skip
    last, first = loads[below][-1], loads[above][0]
    ends = readings[below][-1], readings[above][0]

    def curve(force: FloatArray) -> FloatArray:
        share = np.clip((force - last) / (first - last), 0.0, 1.0)[:, None]
        out = ends[0] + share * (ends[1] - ends[0])
        for (nodes, piece), inside in zip(pieces, (force <= last, force >= first), strict=True):
            if piece is not None and inside.any():
                out[inside] = piece(np.clip(force[inside], nodes[0], nodes[-1]))
        return np.asarray(out)

    return curve
