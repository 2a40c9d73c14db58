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
    apply = problem.operator.displacement
    gap, total = problem.gap_mm, problem.total_mpa
    pressure = start * (total / start.sum())
    displacement = apply(pressure)
    contact: Mask = pressure > 0
    depth, products = 0.0, 1
    while True:
        condition = _Conditioner(problem.operator, contact)
        lift = displacement + gap
        step, rho, depth = condition.begin(lift, depth)
        direction, goal = -step, rho * _INNER**2
        pulls = np.zeros_like(contact)
        while True:
            small = rho <= tolerance**2 * total * depth
            if small or rho <= goal:
                pulls = contact & (pressure < 0)
                sinks = problem.reachable & ~contact & (lift < (1 - _ROUNDING) * depth)
                if pulls.any() or sinks.any():
                    break
                if small:
                    return State(pressure, displacement, depth, products, True)
                goal = rho * _INNER**2
            product = apply(direction)
            products += 1
            curvature = float(np.vdot(direction, product))
            if not curvature > 0 or products > most_products:
                return State(_pushing(pressure, total), displacement, depth, products, False)
            pressure = pressure + (rho / curvature) * direction
            displacement = displacement + (rho / curvature) * product
            lift, before = displacement + gap, rho
            step, rho, depth = condition(lift, depth)
            direction *= rho / before
            direction -= step
        if pulls.any():
            pressure = _pushing(pressure, total)
            displacement = apply(pressure)
            products += 1
        contact = (contact & ~pulls) | sinks


def _pushing(pressure: FloatArray, total: float) -> FloatArray:
    """Return the pressure without what pulls, carrying the same load."""
    pushing = np.maximum(pressure, 0.0)
    pushing *= total / pushing.sum()
    return pushing


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
