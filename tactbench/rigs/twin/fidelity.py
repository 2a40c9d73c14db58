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
    """Contact solver: minimises the energy of the whole skin (newton), or computes each cell by itself (local)."""
    cells_factor: float = 1.0
    """Number of the skin's cells along each axis, relative to the number in the sensor's SkinSheet."""
    newton_tolerance: float = 1e-6
    """Largest relative residual of the contact solver."""
    most_nodes: int = 14
    """Largest number of loads at which a load table is solved."""
    table_tolerance_factor: float = 6.0
    """Wanted bound of a load table's interpolation error, as a multiple of the noise and rounding (rms).

    The bound is cautious: three times the interpolation error found at nodes. For a factor of 6 the actual error is
    0.1 of the noise (rms), and up to 3 times the noise just above touch-down.
    """

    def cells(self, sheet: SkinSheet) -> tuple[int, int]:
        """Return the numbers of the skin's cells along x and s: the sheet's times the factor, rounded to even numbers.

        Numbers are even because a half-complex transform of an odd grid has no Nyquist wave, needed to interpolate.
        """
        if self.cells_factor == 1.0:
            return sheet.cells
        along, across = (max(4, 2 * round(cells * self.cells_factor / 2)) for cells in sheet.cells)
        return along, across


DEFAULT = Fidelity()
"""Accuracy settings of every recording whose scene states no others."""
FINE = Fidelity(cells_factor=3.0, newton_tolerance=1e-8, most_nodes=64, table_tolerance_factor=0.1)
"""Reference settings, with which the error of other settings is measured, at a hundred times the computing time."""

RUNGS: dict[str, Fidelity] = {
    "closed-form": dataclasses.replace(DEFAULT, solver="local"),
    "default": DEFAULT,
    "fine": dataclasses.replace(DEFAULT, cells_factor=2.0, most_nodes=32, table_tolerance_factor=1 / 3),
    "reference": FINE,
}
"""Accuracy settings of the contact solvers by name, the cheapest first."""


def rung(name: str) -> Fidelity:
    """Return the settings of the contact solver `name`; raises UsageError for an unknown name."""
    if name not in RUNGS:
        raise UsageError(f"The twin has no contact solver {name!r}.", hint=f"Set rung to one of: {', '.join(RUNGS)}.")
    return RUNGS[name]
