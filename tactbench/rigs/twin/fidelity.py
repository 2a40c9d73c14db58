"""Settings that trade the accuracy of a simulated contact for computing time."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Literal

from tactbench.plugin import UsageError
from tactbench.plugin.simulation import SkinSheet


@dataclass(frozen=True)
class Fidelity:
    """A set of accuracy settings; they change the error of the solution, not the model."""

    solver: Literal["newton", "local"] = "newton"
    """Solver of a load: the minimiser of the whole energy, or each cell by itself."""
    cells_factor: float = 1.0
    """Cells of the skin along each axis, relative to those of the sensor's SkinSheet."""
    newton_tolerance: float = 1e-6
    """Largest relative residual of the contact solver."""
    most_nodes: int = 14
    """Limit on the loads of a load table."""
    table_tolerance_factor: float = 6.0
    """Wanted bound of a load table's error, in units of what noise and rounding hide anyway.

    The bound is cautious: three times what nodes miss one another by. At six units the error itself is a tenth of one
    rms, and up to three just above touch-down.
    """

    def cells(self, sheet: SkinSheet) -> tuple[int, int]:
        """Return the skin's cells along x and s: the sheet's times the factor, rounded to even numbers.

        Even, because a half-complex transform of an odd grid has no Nyquist wave to interpolate through.
        """
        if self.cells_factor == 1.0:
            return sheet.cells
        along, across = (max(4, 2 * round(cells * self.cells_factor / 2)) for cells in sheet.cells)
        return along, across


DEFAULT = Fidelity()
"""Settings of every recording without settings of its own."""
FINE = Fidelity(cells_factor=3.0, newton_tolerance=1e-8, most_nodes=64, table_tolerance_factor=0.1)
"""Reference for measuring the error of the others, at a hundred times the cost."""

RUNGS: dict[str, Fidelity] = {
    "closed-form": dataclasses.replace(DEFAULT, solver="local"),
    "default": DEFAULT,
    "fine": dataclasses.replace(DEFAULT, cells_factor=2.0, most_nodes=32, table_tolerance_factor=1 / 3),
    "reference": FINE,
}
"""The ladder of contact solvers, the cheapest first."""


def rung(name: str) -> Fidelity:
    """Return a rung by name; raises UsageError if there is none of that name."""
    if name not in RUNGS:
        raise UsageError(f"The twin's ladder has no rung {name!r}.", hint=f"Rungs: {', '.join(RUNGS)}.")
    return RUNGS[name]
