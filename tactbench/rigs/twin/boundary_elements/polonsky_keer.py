"""One grid, the classic way: the conjugate gradients of Polonsky & Keer (1999, Wear 231).

Slower than `active_set`, but every step projects onto pressures >= 0: it is the second opinion in tests and what is
used where the active set does not settle.
"""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.rigs.twin.boundary_elements.active_set import Problem, State


def solve(problem: Problem, start: FloatArray, *, tolerance: float, most_products: int) -> State:
    """Return the pressure on one window, with the parameters and the result of `active_set.solve`.

    The tolerance is on the change of the pressure over one iteration, summed and relative to the load.
    """
    apply, gap, total = problem.operator.displacement, problem.gap_mm, problem.total_mpa
    pressure = start * (total / start.sum())
    direction = np.zeros_like(pressure)
    norm_before, keep = 1.0, 0.0
    products, settled = 0, False
    while not settled and products + 2 <= most_products:
        contact = pressure > 0
        lift = apply(pressure) + gap
        depth = float(lift[contact].mean())
        residual = lift - depth
        norm = float(np.square(residual[contact]).sum())
        direction = np.where(contact, residual + keep * (norm / norm_before) * direction, 0.0)
        norm_before = norm
        product = apply(direction)
        product -= product[contact].mean()
        products += 2
        curvature = float(np.vdot(product, direction))
        if curvature <= 0:
            # Nothing is left to change, as in a contact of a single cell.
            settled = True
            break
        length = float(np.vdot(residual, direction)) / curvature
        before = pressure
        pressure = np.maximum(pressure - length * direction, 0.0)
        sinks = problem.reachable & (pressure == 0) & (residual < 0)
        pressure[sinks] = -length * residual[sinks]
        keep = 0.0 if sinks.any() else 1.0
        pressure *= total / pressure.sum()
        settled = float(np.abs(pressure - before).sum()) <= tolerance * total
    displacement = apply(pressure)
    contact = pressure > 0
    return State(pressure, displacement, float((displacement + gap)[contact].mean()), products + 1, settled)
