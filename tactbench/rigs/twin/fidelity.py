"""How finely the twin resolves a contact: what is paid for accuracy, in one place."""

from __future__ import annotations

import dataclasses
import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from tactbench.plugin import RigError, UsageError
from tactbench.plugin.simulation import SkinSheet


@dataclass(frozen=True)
class Fidelity:
    """One point between quick and exact; two of them differ in error alone, not in the model.

    Raises
    ------
    RigError
        If a number is not positive, or a count below its least.
    """

    solver: Literal["newton", "local"] = "newton"
    """What solves a load: the energy's minimiser with everything in it, or each cell on its own."""
    cells_factor: float = 1.0
    """Cells of the skin along each axis, relative to those of the sensor's SkinSheet."""
    conduction_refinement: int = 2
    """Cells of a finer grid per cell of the skin and axis, for transducers that have such a grid."""
    newton_tolerance: float = 1e-6
    """Largest relative residual of the contact solver."""
    conduction_tolerance: float = 3e-6
    """Relative error at which a transducer's own iteration stops, for transducers that iterate."""
    most_nodes: int = 14
    """Loads after which a load table is refined no further."""
    table_tolerance_factor: float = 6.0
    """Wanted bound of a load table's error, in units of what noise and rounding hide anyway.

    The bound is cautious: three times what nodes miss one another by. At six units the error itself is a tenth of one
    rms, and up to three just above touch-down.
    """

    def __post_init__(self) -> None:
        for name in ("cells_factor", "newton_tolerance", "conduction_tolerance", "table_tolerance_factor"):
            value = getattr(self, name)
            if not (value > 0 and math.isfinite(value)):
                raise RigError(f"Fidelity's {name} is {value!r}; it must be positive and finite.")
        for name, least in (("conduction_refinement", 1), ("most_nodes", 6)):
            value = getattr(self, name)
            if not (isinstance(value, int) and value >= least):
                raise RigError(f"Fidelity's {name} is {value!r}; it must be a whole number of at least {least}.")

    def cells(self, sheet: SkinSheet) -> tuple[int, int]:
        """Return the skin's cells along x and s: the sheet's times the factor, rounded to even numbers.

        Even, because a half-complex transform of an odd grid has no Nyquist wave to interpolate through.
        """
        if self.cells_factor == 1.0:
            return sheet.cells
        along, across = (max(4, 2 * round(cells * self.cells_factor / 2)) for cells in sheet.cells)
        return along, across

    def options(self, factory: Callable[..., Any]) -> dict[str, Any]:
        """Return the keyword arguments a transducer's factory accepts beyond sensor, grid and channels.

        `refinement` and `tolerance`; a factory that names neither is called as ever, and its grid alone gets finer.
        """
        offered = {"refinement": self.conduction_refinement, "tolerance": self.conduction_tolerance}
        accepted = inspect.signature(factory).parameters
        return {name: value for name, value in offered.items() if name in accepted}


DEFAULT = Fidelity()
"""What every recording is made with."""
FINE = Fidelity(
    cells_factor=3.0,
    conduction_refinement=2,
    newton_tolerance=1e-8,
    conduction_tolerance=3e-8,
    most_nodes=64,
    table_tolerance_factor=0.1,
)
"""For measuring the error of the others: a hundred times the cost."""

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
