"""One grid: the pressure that carries a force without pulling, by an active set around conjugate gradients.

Find ``p >= 0`` and ``delta`` with ``r = A p + g - delta >= 0``, ``p r = 0`` and ``sum p = P`` (Johnson 1985,
section 5.9; the pressure minimises ``p A p / 2 + g p`` under the load). For a given contact set this is a linear
system with one side condition. It is solved a little, by conjugate gradients in the space of pressures without net
load, and then the set is corrected: cells that pull leave, cells that penetrate enter (the primal-dual active set of
Hintermüller, Ito & Kunisch 2002, SIAM J. Optim. 13, with inexact solves). The preconditioner multiplies by the
stiffness of the window's waves inside the contact set, which leaves a number of iterations that hardly grows with the
grid.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray
from tactbench.rigs.twin.boundary_elements.operator import Operator

Mask = npt.NDArray[np.bool_]

_INNER = 0.3
"""The linear system is solved until its residual has fallen by this factor; then the set is looked at again."""
_ROUNDING = 1e-11
"""A penetration below this fraction of the depth is rounding."""
_WILD = 1e3
"""Pulling and pushing may not exceed the load by this factor: a far too large contact set, whose sum loses digits."""
_UNBALANCED = 1e-12
"""Relative error of the load above which it is restored."""


@dataclass(frozen=True)
class Problem:
    """What is pressed into what, on one window."""

    operator: Operator
    gap_mm: FloatArray
    """(nx, ns) from first touch: 0 where it is smallest in the whole domain; any number where nothing can touch."""
    reachable: Mask
    """(nx, ns) where the indenter exists."""
    total_mpa: float
    """Sum of the pressures of all cells: force over cell area."""


@dataclass(frozen=True)
class State:
    """A pressure on a window, on the way or at the end."""

    pressure_mpa: FloatArray
    displacement_mm: FloatArray
    depth_mm: float
    """From first touch."""
    products: int
    """Products with the kernel so far."""
    settled: bool
    """Whether the tolerance was reached."""


def solve(problem: Problem, start: FloatArray, *, tolerance: float, most_products: int) -> State:
    """Return the pressure on one window.

    Parameters
    ----------
    problem
        The window.
    start
        (nx, ns) a pressure >= 0 that is positive somewhere reachable; its scale does not matter.
    tolerance
        Largest residual in the norm of the energy, relative to force times depth.
    most_products
        After these many products with the kernel the state is returned unsettled.
    """
    total = problem.total_mpa
    now = _Iterate(start > 0, start * (total / start.sum()), problem.operator.displacement)
    while now.products < most_products:
        change = now.relax(problem, tolerance, most_products)
        if np.abs(now.pressure).sum() > _WILD * total:
            nearer = problem.gap_mm <= np.median(problem.gap_mm[now.contact])
            now.restart(now.contact & nearer, None, total)
        elif change is None:
            break
        elif change.any():
            now.restart(now.contact ^ change, now.pressure, total)
        elif abs(now.pressure.sum() - total) > _UNBALANCED * total:
            now.restart(now.contact, now.pressure, total)
        else:
            return State(now.pressure, now.displacement, now.depth, now.products, True)
    now.restart(now.contact, now.pressure, total)
    return State(now.pressure, now.displacement, now.depth, now.products, False)


class _Iterate:
    """A pressure on its way, its displacement and its contact set."""

    def __init__(self, contact: Mask, pressure: FloatArray, apply: Callable[[FloatArray], FloatArray]) -> None:
        self.contact, self.pressure, self.depth, self.products = contact, pressure, 0.0, 0
        self._apply = apply
        self.displacement = self.apply(pressure)

    def apply(self, pressure: FloatArray) -> FloatArray:
        """Return the displacement, and count."""
        self.products += 1
        return self._apply(pressure)

    def restart(self, contact: Mask, pressure: FloatArray | None, total: float) -> None:
        """Go on with another contact set. What pulls is cut off and the load restored; None: press evenly."""
        self.contact = contact
        pushing = None if pressure is None else np.maximum(pressure, 0.0)
        if pushing is None or not pushing.sum() > 0:
            pushing = contact.astype(np.float64)
        carried = float(pushing.sum())
        if np.array_equal(pushing, self.pressure) and abs(carried - total) <= _UNBALANCED * total:
            return
        self.pressure = pushing * (total / carried)
        self.displacement = self.apply(self.pressure)

    def relax(self, problem: Problem, tolerance: float, most_products: int) -> Mask | None:
        """Iterate on the contact set until it has to change.

        Returns
        -------
        Mask | None
            The cells that have to enter or leave; none of them: solved. None: there is no going on.
        """
        gap, total = problem.gap_mm, problem.total_mpa
        condition = _Conditioner(problem.operator, self.contact)
        lift = self.displacement + gap
        # About the mean under pressure, not about an earlier depth: that may have been far off, and digits with it.
        step, rho, self.depth = condition.begin(lift, float(np.vdot(self.pressure, lift)) / total)
        direction, goal = -step, rho * _INNER**2
        while True:
            small = rho <= tolerance**2 * total * self.depth
            if small or rho <= goal:
                change = problem.reachable & ~self.contact & (lift < (1 - _ROUNDING) * self.depth)
                change |= self.contact & (self.pressure < 0)
                if small or change.any():
                    return change
                goal = rho * _INNER**2
            product = self.apply(direction)
            curvature = float(np.vdot(direction, product))
            if not curvature > 0 or self.products > most_products:
                return None
            self.pressure = self.pressure + (rho / curvature) * direction
            self.displacement = self.displacement + (rho / curvature) * product
            lift, before = self.displacement + gap, rho
            step, rho, self.depth = condition(lift, self.depth)
            direction *= rho / before
            direction -= step


class _Conditioner:
    """Turns a residual on one contact set into a change of pressure without net load.

    The depth that goes with it is the multiplier of the load: the mean of ``A p + g`` over the contact, weighted like
    the pressure under a flat punch. Under the exact such weights errors of the pressure would not reach the depth.
    """

    def __init__(self, operator: Operator, contact: Mask) -> None:
        self._stiffen = operator.stiffen
        self._inside = contact.astype(np.float64)

    def begin(self, lift: FloatArray, depth: float) -> tuple[FloatArray, float, float]:
        """Do as `__call__` does, for the first time on this set: both fields in one transform."""
        residual = (lift - depth) * self._inside
        self._punch, step = self._stiffen(np.stack([self._inside, residual]))
        self._punch *= self._inside
        self._load = float(self._punch.sum())
        return self._without_load(residual, step, depth)

    def __call__(self, lift: FloatArray, depth: float) -> tuple[FloatArray, float, float]:
        """Return the (nx, ns) preconditioned residual, its energy and the depth, given about that depth."""
        residual = lift - depth
        residual *= self._inside
        return self._without_load(residual, self._stiffen(residual), depth)

    def _without_load(self, residual: FloatArray, step: FloatArray, depth: float) -> tuple[FloatArray, float, float]:
        step *= self._inside
        more = float(step.sum()) / self._load
        step -= more * self._punch
        return step, float(np.vdot(residual, step)), depth + more
